// The exchange in double precision.
#include <new>

#include "corridor/exchange.hpp"

namespace minsnap {

ExchangeSolver::~ExchangeSolver() {
    delete snap_;
    delete any_;
}

Status ExchangeSolver::solve(const Request &given, Answer &answer, Aim aim, const Contact *known, int count) {
    if (given.half == 4) {
        if (snap_ == nullptr) snap_ = new (std::nothrow) Exchange<double, 4>(4);
        return snap_ == nullptr ? Status::no_memory : snap_->solve(given, answer, aim, known, count);
    }
    if (half_ != given.half) {
        delete any_;
        any_ = new (std::nothrow) Exchange<double, 0>(given.half);
        half_ = any_ == nullptr ? 0 : given.half;
    }
    return any_ == nullptr ? Status::no_memory : any_->solve(given, answer, aim, known, count);
}

}  // namespace minsnap

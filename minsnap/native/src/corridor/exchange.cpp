// The exchange in double precision.
#include "basics/owned.hpp"
#include "corridor/exchange.hpp"

namespace minsnap {

ExchangeSolver::ExchangeSolver() = default;
ExchangeSolver::~ExchangeSolver() = default;

Status ExchangeSolver::solve(const Request &given, Answer &answer, Aim aim, const Contact *known, int count) {
    if (given.half == 4) {
        if (!snap_) snap_ = owned<Exchange<double, 4>>(4);
        return snap_ ? snap_->solve(given, answer, aim, known, count) : Status::no_memory;
    }
    if (half_ != given.half) {
        any_ = owned<Exchange<double, 0>>(given.half);
        half_ = any_ ? given.half : 0;
    }
    return any_ ? any_->solve(given, answer, aim, known, count) : Status::no_memory;
}

}  // namespace minsnap

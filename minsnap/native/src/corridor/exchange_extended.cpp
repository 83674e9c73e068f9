// The exchange in double-double arithmetic.
#include <new>

#include "corridor/exchange.hpp"

namespace minsnap {

Status solve_extended(const Request &given, Answer &answer) {
    Exchange<DoubleDouble, 0> *const exchange = new (std::nothrow) Exchange<DoubleDouble, 0>(given.half);
    const Status status = exchange == nullptr ? Status::no_memory : exchange->solve(given, answer);
    delete exchange;
    return status;
}

}  // namespace minsnap

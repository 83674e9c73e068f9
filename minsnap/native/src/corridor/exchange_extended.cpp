// The exchange in double-double arithmetic.
#include "basics/owned.hpp"
#include "corridor/exchange.hpp"

namespace minsnap {

Status solve_extended(const Request &given, Answer &answer) {
    const auto exchange = owned<Exchange<DoubleDouble, 0>>(given.half);
    return exchange ? exchange->solve(given, answer) : Status::no_memory;
}

}  // namespace minsnap

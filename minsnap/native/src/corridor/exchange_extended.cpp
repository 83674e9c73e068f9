// The exchange in double-double arithmetic.
#include "basics/owned.hpp"
#include "corridor/exchange.hpp"

namespace minsnap {

Status solve_extended(const Request &given, Answer &answer, Aim aim, const Contact *known, int count) {
    const auto exchange = owned<Exchange<DoubleDouble, 0>>(given.half);
    return exchange ? exchange->solve(given, answer, aim, known, count) : Status::no_memory;
}

}  // namespace minsnap

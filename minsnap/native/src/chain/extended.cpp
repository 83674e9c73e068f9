// Chains whose durations are too far apart for doubles: the same elimination in double-double arithmetic. They are rare,
// so the axes do not share it: that would take three times as long to compile.
#define MINSNAP_UNROLL
#define MINSNAP_INLINE inline
#include "basics/dispatch.hpp"
#include "chain/unconstrained.hpp"

namespace minsnap {
namespace {

template <int half>
Status solve_axis(const ChainProblem &chain, int axis, Output out) {
    Buffer<typename Elimination<half, 1, DoubleDouble>::Record> records;
    LegWriter<half, 1> writer(chain, axis, out);
    const Status status = OneWayChain<half, 1, DoubleDouble>::solve(chain, axis, records, writer);
    return status == Status::done && !writer.finite() ? Status::singular : status;
}

}  // namespace

Status solve_chain_extended(const ChainProblem &chain, int half, Output out) {
    return for_half(half, [&](auto k) {
        Status status = Status::done;
        for (int axis = 0; axis < chain.stride && status == Status::done; ++axis) status = solve_axis<k.value>(chain, axis, out);
        return status;
    });
}

}  // namespace minsnap

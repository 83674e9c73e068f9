// Chains whose durations are too far apart for doubles: the same elimination in double-double arithmetic.
#define MINSNAP_UNROLL
#define MINSNAP_INLINE inline
#include "dispatch.hpp"
#include "unconstrained.hpp"

namespace minsnap {
namespace {

template <int half, int dim>
Status solve_axes(const ChainProblem &chain, int axis, Output out) {
    Buffer<typename Elimination<half, dim, DoubleDouble>::Record> records;
    LegWriter<half, dim> writer(chain, axis, out);
    const Status status = OneWayChain<half, dim, DoubleDouble>::solve(chain, axis, records, writer);
    return status == Status::done && !writer.finite() ? Status::singular : status;
}

}  // namespace

Status solve_chain_extended(const ChainProblem &chain, int half, Output out) {
    return for_half(half, [&](auto k) {
        return for_axes(chain.stride,
                        [&](auto axes, int axis) { return solve_axes<k.value, axes.value>(chain, axis, out); });
    });
}

}  // namespace minsnap

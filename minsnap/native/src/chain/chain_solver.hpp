// The elimination of sweep.hpp for one degree, all coordinates.
#pragma once

#include "basics/dispatch.hpp"
#include "chain/sweep.hpp"
#include "chain/unconstrained.hpp"

namespace minsnap {

template <int half, int dim>
Status solve_axes(const ChainProblem &chain, int axis, Output out) {
    using TwoWay = TwoWayChain<half, dim>;
    LegWriter<half, dim> writer(chain, axis, out);
    Status status;
    if (out.points != nullptr && TwoWay::width <= 2 * half * dim && dim == chain.stride) {
        // the records fit where the control points of their legs will be
        status = TwoWay::solve(chain, axis, {out.points, 2 * half * dim}, writer);
    } else {
        Buffer<double> room;
        if (!room.allocate(static_cast<std::size_t>(chain.legs * TwoWay::width))) return Status::no_memory;
        status = TwoWay::solve(chain, axis, {room.data(), TwoWay::width}, writer);
    }
    return status == Status::done && !writer.finite() ? Status::singular : status;
}

template <int half>
Status solve_all_axes(const ChainProblem &chain, Output out) {
    return for_axes<half>(chain.stride, [&](auto axes, int axis) { return solve_axes<half, axes.value>(chain, axis, out); });
}

}  // namespace minsnap

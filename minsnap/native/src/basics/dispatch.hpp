// From counts known when running to counts known when compiling.
#pragma once

#include <type_traits>

#include "basics/status.hpp"

namespace minsnap {

constexpr int least_half = 2, most_half = 6;  // degrees 3 ... 11
constexpr int most_axes = 64;                 // coordinates of a point
constexpr int axes_at_once = 3;

template <int value>
using Constant = std::integral_constant<int, value>;

// Call action(Constant<half>) for half = k, degree 2k - 1.
template <class Action>
Status for_half(int half, Action &&action) {
    switch (half) {
        case 2: return action(Constant<2>{});
        case 3: return action(Constant<3>{});
        case 4: return action(Constant<4>{});
        case 5: return action(Constant<5>{});
        case 6: return action(Constant<6>{});
        default: return Status::unsupported;
    }
}

// Call action(Constant<count>, first axis) for groups of at most three axes, until one does not end well. Above degree 7
// there are no groups of two: each kind of group takes seconds to compile.
template <int half, class Action>
Status for_axes(int dim, Action &&action) {
    constexpr int pair = half > 4 ? 1 : 2;
    Status status = Status::done;
    for (int axis = 0, count = 0; axis < dim && status == Status::done; axis += count) {
        count = dim - axis >= axes_at_once ? axes_at_once : dim - axis == 2 ? pair : 1;
        if (count == axes_at_once)
            status = action(Constant<axes_at_once>{}, axis);
        else if (count == pair)
            status = action(Constant<pair>{}, axis);
        else
            status = action(Constant<1>{}, axis);
    }
    return status;
}

}  // namespace minsnap

// Curves of least cost in given durations, or in the best split of a total time.
#pragma once

#include "basics/border.hpp"
#include "planner/answer.hpp"

namespace minsnap {

class GivenTimes {
public:
    GivenTimes(const Course &course, Says &says) : course_(course), says_(says) {}

    // Whether the last curve passed the last look already: waypoints, states, joints and its tube.
    bool seen() const { return seen_; }

    // In durations of the legs.
    Status solve(const double *durations, CurveMemory &curve);

    // In the split of the total time that costs least; where none is found, by distance.
    Status split(CurveMemory &curve);

    // Without walls, one polynomial a leg.
    Status free(const double *durations, CurveMemory &curve);

private:
    ChainRecord chain(const double *durations) const;
    bool plain_tube() const;
    Status in_tube(CurveMemory &curve);
    Status inside(CurveMemory &curve);
    bool make_question(const double *durations, std::int64_t per_leg);
    bool add_regions(std::int64_t per_leg);
    bool split_inside(bool free, SplitRecord &record);

    const Course &course_;
    Says &says_;
    bool seen_ = false;
    CorridorRecord question_ = {};
    WallSets sets_;
    Buffer<double> positions_, values_, states_, knots_, numbers_, direction_, best_, first_, history_;
    Buffer<std::uint8_t> pinned_;
    Buffer<std::int64_t> wall_;
};

}  // namespace minsnap

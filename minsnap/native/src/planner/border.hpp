// What Python asks of many plans within limits, and where they are written.
#pragma once

#include "basics/record.hpp"

namespace minsnap {

// Problems from rest to rest, one after the other: problem b has the legs offsets[b] ... offsets[b + 1] - 1, and one knot more.
MINSNAP_RECORD(PlansRecord, {
    std::int64_t count, dim, threads;
    std::int64_t pieces;          // polynomials of a leg; 0 leaves them to each search
    std::int64_t most;            // polynomials of a leg that there is room for
    const double *points;         // (knots in all, dim) [m]
    const std::int64_t *offsets;  // (count + 1,)
    const double *limits;  // (count, 9) speed to snap, most and least thrust, tilt, body rate, gravity, as minsnap_limits; zero is no limit
    const double *widths;  // (legs in all,) half-widths of tubes, infinite where there is none [m]; or null
    double *curves;        // (legs in all * most, 8, dim) control points [m]; those of problem b begin at most * offsets[b]
    double *durations;     // (legs in all * most,) likewise [s]
    std::int64_t *found;   // (count,) polynomials of a leg
    std::int32_t *statuses;  // (count,)
});

}  // namespace minsnap

// Walls as they cross the border, the only form: sets of one kind in which a derivative stays, each on one leg.
#pragma once

#include "basics/record.hpp"

namespace minsnap {

// Sets |A (x - a)| <= radius + slope . (x - a) of a derivative x; planes have no rows in A.
MINSNAP_RECORD(WallsRecord, {
    std::int64_t count, rows, order;
    std::int64_t equal;              // whether they are planes on which the curve lies, at the instants of `at`; of corridors alone
    std::int64_t outside, at_knots;  // of the shortest time alone: |x - a| >= radius instead; `leg` is the waypoint at which each holds
    const std::int64_t *leg;         // (count,) of a corridor the piece
    const std::int64_t *at;          // (count,) of corridors: 0 at the start alone, 1 at the end alone; or null: at every instant
    const double *matrix;            // (count, rows, dim)
    const double *anchor, *slope;    // (count, dim)
    const double *radius, *width;    // (count,) the width is the length by which an excess is judged
});

}  // namespace minsnap

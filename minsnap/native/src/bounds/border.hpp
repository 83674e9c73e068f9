// A search for the costate that proves the greatest bound of the flight time, and what it writes.
#pragma once

#include "basics/record.hpp"

namespace minsnap {

// Coordinates are padded with zeros to three, lengths and times are of order one.
MINSNAP_RECORD(CostateSearch, {
    std::int64_t legs;
    std::int64_t cells, fine;                // of each leg, at first and at the end
    std::int64_t parts;                      // parts of each cell in which norms of the costate are summed
    std::int64_t closed;                     // whether the state at the end is that at the start, and free
    std::int64_t accelerations, velocities;  // sets in which they stay; the first of each covers what any covers
    std::int64_t costate_axes, rate_axes;    // bits of the coordinates in which the costate, and its rate, may differ from zero
    const double *sets;                      // (accelerations + velocities, 12), as SupportSet
    const double *steps;                     // (legs, 3) from nominal position to nominal position
    const double *rounds;                    // (legs + 1, 3, 3) maps of the unit ball, and
    const double *sides;                     // (legs + 1, 3, 3) half the sides of boxes, of whose sum each knot lies in one
    const double *times;                     // (legs,) roughly
    const double *ends;                      // (2, 3) velocities
    double *grid;                            // (legs, fine + 1) where cells end, on [0, 1]; those to begin with in the first cells + 1
    double *costate;                         // (legs, fine + 1, 3), likewise
    double *rate;                            // (legs, 3)
    double *splits;                          // (legs, fine, parts + 1, accelerations - 1, 3) shares of the sets after the first
    double *rate_splits;                     // (legs, fine, velocities - 1, 3)
    std::int64_t iterations;                 // that were made
});

}  // namespace minsnap

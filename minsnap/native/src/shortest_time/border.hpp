// What Python asks of the search for the shortest time, and what it gets: plain numbers and pointers.
#pragma once

#include <cstdint>

#include "basics/walls_record.hpp"

namespace minsnap {

// A limit on several derivatives at an instant, on every leg: a `LimitKind` of `instant_limits.hpp` and its parameters.
MINSNAP_RECORD(MomentaryLimit, {
    std::int64_t kind;
    const double *parameters;
});

// Reads the totals of the answer, and sets their count to 0; gets the context of the request; what is not 0 ends the search.
using Poll = std::int64_t (*)(void *);

MINSNAP_RECORD(ShortestRequest, {
    std::int64_t half, dim, legs, closed, groups, limits;
    std::int64_t divisions;     // how many numbers stand in `parts`
    std::int64_t moving;        // whether time may not be scaled to keep the limits
    std::int64_t timed;         // whether all durations stay those of a guess
    std::int64_t rough;         // whether the curve is only one to begin another search from
    const std::int64_t *parts;  // pieces into which pieces are divided, one time after another
    double worthwhile;          // relative gain of a division below which no further one is tried
    double inwards, tightened;  // shares of their widths by which walls are moved inwards, and limits
    const double
        *pinned;  // (legs + 1, half, dim) derivatives at waypoints, positions nominal where they are free and along their axes [m/s^order]
    const std::int64_t *free;  // (legs + 1, half, dim) 1 where free
    const double *lengths;     // (legs,) of the legs, none very short [m]
    const double *norms;       // (4,) speed, acceleration, jerk, snap that a motion in any direction may reach; infinite where free
    double price;              // of a second, for least cost + price * time; 0 for least time alone
    double total;              // of all durations, for the least cost; 0 where it is free [s]
    double slower;             // factor on time at which a guess is begun from
    std::int64_t guessed;      // pieces per leg of a guess; 0 for none
    const double *guess_durations, *guess_knots;  // (pieces,) [s], (pieces + 1, half, dim) [m/s^order]
    std::int64_t planned;                         // whether a guess is a plan, whose first piece may be a way back into the limits
    const double *turned;             // (legs + 1, dim, dim) columns are the axes of a waypoint's position, zeros for the world's; or null
    const WallsRecord *cones;         // (groups,)
    const MomentaryLimit *momentary;  // (limits,)
    std::int64_t turns;               // cubics of a heading that is a function of time
    const double *turning;            // (turns, 4) their control points [rad], or null
    double clock;                     // seconds that they span from the start on, by equal shares
    const double *angles;             // (legs + 1,) through which it goes by a spline of the legs' durations instead, or null [rad]
    double rate;                      // of that at the start of an open course [rad/s]
    std::int64_t rule;                // that makes it of the curve instead: 1 along the velocity, 2 towards a point, 0 for none
    const double *ruled;              // (3,) largest rate where it is held [rad/s], speed below which it is or 0 [m/s], angle at the start
                                      // or infinity [rad]; or the point, east and north [m]
    double row_work, iteration_work;  // of an iteration: for each row, and besides
    double worth;                     // work of a question beyond which its search ends
    double vanishing;                 // share of the longest total below which a search ends
    std::int64_t room;                // for totals
    std::int64_t live;                // whether it is polled before every iteration
    Poll poll;
    void *context;
});

MINSNAP_RECORD(ShortestAnswer, {
    std::int64_t pieces, iterations;  // per leg; of all stages
    double total, wall, limit;        // [s]; largest excess of walls and of limits at peaks, in widths
    double work, longest;             // of the question so far: work, and its longest total [s]; set before and after
    std::int64_t told;                // how many of `totals` were not read
    double *totals;                   // (room,) of iterations [s]
    double *durations;                // room for (legs * product of parts,) [s]
    double *points;                   // room for (pieces, 2 half, dim) control points [m]
    double *knots;                    // room for (pieces + 1, half, dim) derivatives [m/s^order]
    std::int64_t restored;            // whether it had no end of its own: what is found may be far from the best
    std::int64_t inside;              // pieces per leg of the shortest curve inside that the search came by; 0 for none
    double *inside_durations, *inside_points, *inside_knots;  // that curve, or null where it is not asked for
});

}  // namespace minsnap

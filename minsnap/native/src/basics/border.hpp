// The border: structs of plain numbers and pointers that entry points take, declared here, or in the folder of their method, and nowhere else.
//
// ``MINSNAP_RECORD`` keeps the text of each struct, and Python lays its own out by that text. Arrays are contiguous and belong to the caller; null where a
// comment allows it.
#pragma once

#include "basics/walls_record.hpp"
#include "shortest_time/border.hpp"

namespace minsnap {

// A chain of pieces through nominal positions, inside walls, as in request.hpp.
MINSNAP_RECORD(CorridorRecord, {
    std::int64_t half, pieces, dim, continuity, closed, groups;
    double length, time;         // what normalised units are worth [m], [s]
    double gap;                  // share of the cost that may be given away
    double effort, seconds;      // share of the work a request is worth, and time [s], after either of which it gives up
    const double *positions;     // (pieces + 1, dim) [m]
    const double *durations;     // (pieces,) [s]; of a search (legs,), to begin with
    const std::uint8_t *pinned;  // (pieces + 1, slots, dim), or null; there are k slots, one more where continuity is k - 2
    const double *values;        // (pieces + 1, slots, dim) [m/s^order], or null
    const WallsRecord *walls;    // (groups,)
});

// What is written for the caller, as in exchange_solver.hpp.
MINSNAP_RECORD(CorridorAnswerRecord, {
    double *points, *knots;  // (pieces, 2k, dim) [m]; (pieces + 1, slots, dim)
    std::int64_t *wall;      // (pieces * slots * dim + 2,), with slacks as many more
    double *s, *multiplier;  // the same
    double *direction;       // the same times dim: of tangent planes of balls; or null
    double cost, bound, share, work;
    std::int64_t rows, rounds, attempts;
});

// Slacks of a corridor's walls, and what is written of them and of its rows.
MINSNAP_RECORD(SlackRecord, {
    std::int64_t count;
    const std::int64_t *group;  // (walls,) which one moves each wall outwards, or -1
    const double *weight;       // (walls,) widths for a slack of 1
    std::int64_t sign;          // whether it is sufficient to know that walls must give way
    double *slack;              // (count,)
    double *remainder;          // (rows of the answer,) what doubles leave of multipliers
});

// A chain of legs without walls.
MINSNAP_RECORD(ChainRecord, {
    std::int64_t half, legs, dim, pins;
    std::int64_t closed;         // whether the state at the end is that at the start, and free
    const double *points;        // (legs + 1, dim) [m]
    const double *durations;     // (legs,) [s]; of a search to begin with
    const double *start, *end;   // (half - 1, dim) derivatives at the ends, or null at rest
    const std::int64_t *knots;   // (pins,) inner ones, ascending
    const std::uint32_t *masks;  // (pins,) bit a stands for order a
    const double *values;        // (pins, half - 1, dim) [m/s^order]
});

// A search for the durations of legs that cost least, and what it writes.
MINSNAP_RECORD(SplitRecord, {
    std::int64_t legs, per_leg;  // pieces of each leg
    std::int64_t capacity;       // evaluations at most
    double price;                // of a second; zero for a fixed total
    double seconds, effort;      // and shares of the work a request is worth, after either of which it ends
    double *durations;           // (legs,) [s]
    double *history;             // (capacity, 2)
    std::int64_t evaluations;
    double work;  // of all evaluations, as shares
});

// Many problems, one after the other: problem b has the legs offsets[b] ... offsets[b + 1] - 1, and one knot more. And where their answers are
// written; an entry point reads and writes what its comment names, and the rest may be null.
MINSNAP_RECORD(ManyRecord, {
    std::int64_t count, dim, half, threads;
    double gap, most_gap;         // shares of a cost that may be given away, and where the first does not end with a proof
    const double *points;         // (knots in all, dim) [m]
    const double *durations;      // (legs in all,) [s]
    const std::int64_t *offsets;  // (count + 1,)
    const double *widths;         // (legs in all,) [m]
    const double *starts, *ends;  // (count, half - 1, dim) derivatives, or null at rest
    double *curves;               // (legs in all, 2 half, dim) [m]
    double *breaks;               // (knots in all,) [s]
    double *costs;                // (count,) [m^2/s^(2k-1)]
    double *figures;              // (count, 4) costs in tubes, lower bounds, contacts, rounds
    double *slopes;               // (legs in all,) derivatives of a cost in the durations, or null
    double *displacements;        // (legs in all, dim) and in the displacements of legs
    double *width_slopes;         // (legs in all,) and in the half-widths
    std::int32_t *statuses;       // (count,)
});

// A vehicle on parts of a path, and where bounds are written: greatest and minus the least thrust per mass [m/s^2], square of the tilt's tangent, square
// of the body rate [rad^2/s^2], greatest and minus the least thrust of a rotor [N].
MINSNAP_RECORD(VehicleRecord, {
    std::int64_t parts, count;  // control points of each coordinate
    double mass, jerk;          // [kg]; bound of the yaw's third derivative [rad/s^3]
    const double *medium;       // (5,) gravity, and drag per mass: linear, quadratic, and by how much more along the thrust
    const double *inertia;      // (3, 3) [kg m^2]
    const double *mixer;        // (4, 4) from thrust and torques to thrusts of the rotors
    const double *points;       // (parts, 4, 3, count) velocity to snap
    const double *half;         // (parts,) half of what each takes [s]
    const double *yaw;          // (parts, 4) in the middle: cosine, sine, rate, acceleration; or null
    const double *axes;         // (parts, 2, 3) x and y of a body without spin there; or null
    double *bounds;             // (parts, 6); no rotors without heading
});

// A curve, and its greatest excess over walls, which is written.
MINSNAP_RECORD(ExcessRecord, {
    std::int64_t pieces, degree, dim;
    std::int64_t per_leg;           // pieces of each leg
    const double *points;           // (pieces, degree + 1, dim) [m]
    const double *durations;        // (pieces,) [s]
    double attained, bound, where;  // where on [0, 1]
    std::int64_t row;               // wall times per_leg, plus the piece of the leg
});

// Curves, one after the other as in ManyRecord, and where their derivatives at instants are written.
MINSNAP_RECORD(ValuesRecord, {
    std::int64_t count, degree, dim, order, instants;
    std::int64_t shared;  // whether all have the same instants
    std::int64_t threads;
    const double *points;         // (legs in all, degree + 1, dim) [m]
    const double *durations;      // (legs in all,) [s]
    const double *breaks;         // (knots in all,) [s]
    const std::int64_t *offsets;  // (count + 1,)
    const std::uint8_t *present;  // (count,); what is not gives not a number
    const double *t;              // (instants,) if shared, else (count, instants) [s]
    double *values;               // (count, instants, dim)
    std::int32_t *statuses;       // (count,)
});

// Sets of half-spaces, one after the other: set i has the rows first[i] ... first[i + 1] - 1. And what is written of them: their largest balls where
// ways is 0, else the least products of their points with directions.
MINSNAP_RECORD(SetsRecord, {
    std::int64_t sets, dim, ways;
    double far;                      // largest radius and reach, over 1 m and the largest bound of a set
    const std::int64_t *first;       // (sets + 1,)
    const double *normals, *bounds;  // (rows, dim) of unit length, (rows,) [m]
    const double *along;             // (ways, dim), or null
    double *centers, *radii;         // (sets, dim), (sets,) negative where a set is empty [m]; or null
    double *least;                   // (sets, ways), or null
});

// One polynomial from a moving state, and conditions at instants: cones in which rows times a derivative plus a bound lie.
MINSNAP_RECORD(PieceRecord, {
    std::int64_t half, dim, conditions;
    std::int64_t free;              // bit a: the derivative of order a at the end is to be chosen
    double duration, acceleration;  // [s]; one that counts as large [m/s^2]
    const std::int64_t *order;      // (conditions,) of the derivative
    const std::int64_t *soft;       // (conditions,) 1 where it may be exceeded, 0 where not
    const std::int64_t *first;      // (conditions + 1,) where the rows of each begin
    const double *s, *ahead;        // (conditions,) in [0, 1]; time by which the next derivative extrapolates it [s]
    const double *matrix, *bound;   // (rows, dim), (rows,)
    const double *ends;             // (2k, dim) derivatives at both ends on the unit interval [m], those to be chosen as a guess
    double *points;                 // (2k, dim) control points [m]
});

// A way to come to rest inside walls, as in stops.cpp. Groups of walls come first, then those of limits, which have one leg.
MINSNAP_RECORD(StopRecord, {
    std::int64_t half, dim, walls, limits;  // groups
    std::int64_t legs;                      // within which it ends, 1 or 2
    std::int64_t member;       // of the family, from which on one is looked for, and which one was found; -1 to prove one polynomial
    double unit;               // time that stopping takes at a large acceleration [s]
    const double *state;       // (k, dim) at the start [m/s^order]
    const double *waypoints;   // (legs + 1, dim) [m]
    const WallsRecord *cones;  // (walls + limits,)
    double *caps;              // (legs,) how far beyond the waypoint at its end a leg goes on, infinite where that is not bounded [m]
    double *points;            // (2, 2k, dim) control points [m]; one polynomial to prove is counted from the start
    double duration, change;   // [s]; share of the duration after which the second leg is entered, 0 where it is not
    std::int64_t limited;      // whether it is proved to keep the sets of the limits
});

}  // namespace minsnap

// The border: structs of plain numbers and pointers that entry points take, declared here and nowhere else in C++.
//
// ``records.py`` declares the same for ctypes. ``border_fields`` lists where every field lies, by name; Python compares
// names, offsets and sizes before it calls, so that swapped or missing fields cannot pass. Arrays are contiguous and belong
// to the caller; null where a comment allows it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "shortest_time/border.hpp"

namespace minsnap {

// Walls on pieces, as in walls.hpp.
struct WallsRecord {
    std::int64_t count, balls;
    const std::int64_t *piece, *order;  // (count,)
    const double *normal, *anchor;      // (count, dim)
    const double *bound, *width;        // (count,)
    const std::int64_t *when, *ball;    // (count,), or null
    const double *matrix;               // (balls, dim, dim), or null
};

// A chain of pieces through nominal positions, inside walls, as in request.hpp.
struct CorridorRecord {
    std::int64_t half, pieces, dim, continuity, closed;
    double length, time;         // what normalised units are worth [m], [s]
    double gap;                  // share of the cost that may be given away
    double effort, seconds;      // share of the work a request is worth, and time [s], after either of which it gives up
    const double *positions;     // (pieces + 1, dim) [m]
    const double *durations;     // (pieces,) [s]; of a search (legs,), to begin with
    const std::uint8_t *pinned;  // (pieces + 1, k, dim), or null
    const double *values;        // (pieces + 1, k, dim) [m/s^order], or null
    WallsRecord walls;
};

// What is written for the caller, as in exchange_solver.hpp.
struct CorridorAnswerRecord {
    double *points, *knots;  // (pieces, 2k, dim) [m]; (pieces + 1, k, dim)
    std::int64_t *wall;      // (pieces * k * dim + 2,), with slacks as many more
    double *s, *multiplier;  // the same
    double *direction;       // the same times dim: of tangent planes of balls; or null
    double cost, bound, share, work;
    std::int64_t rows, rounds, attempts;
};

// Slacks of a corridor's walls, and what is written of them and of its rows.
struct SlackRecord {
    std::int64_t count;
    const std::int64_t *group;  // (walls,) which one moves each wall outwards, or -1
    const double *weight;       // (walls,) widths for a slack of 1
    double *slack;              // (count,)
    double *remainder;          // (rows of the answer,) what doubles leave of multipliers
};

// A chain of legs without walls.
struct ChainRecord {
    std::int64_t half, legs, dim, pins;
    std::int64_t closed;         // whether the state at the end is that at the start, and free
    const double *points;        // (legs + 1, dim) [m]
    const double *durations;     // (legs,) [s]; of a search to begin with
    const double *start, *end;   // (half - 1, dim) derivatives at the ends, or null at rest
    const std::int64_t *knots;   // (pins,) inner ones, ascending
    const std::uint32_t *masks;  // (pins,) bit a stands for order a
    const double *values;        // (pins, half - 1, dim) [m/s^order]
};

// A search for the durations of legs that cost least, and what it writes.
struct SplitRecord {
    std::int64_t legs, per_leg;  // pieces of each leg
    std::int64_t capacity;       // evaluations at most
    double price;                // of a second; zero for a fixed total
    double seconds, effort;      // and shares of the work a request is worth, after either of which it ends
    double *durations;           // (legs,) [s]
    double *history;             // (capacity, 2)
    std::int64_t evaluations;
    double work;  // of all evaluations, as shares
};

// Many problems, one after the other: problem b has the legs offsets[b] ... offsets[b + 1] - 1, and one knot more. And where their answers are
// written; an entry point reads and writes what its comment names, and the rest may be null.
struct ManyRecord {
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
};

// A vehicle on parts of a path, and where bounds are written: greatest and minus the least thrust per mass [m/s^2], square of the tilt's tangent, square
// of the body rate [rad^2/s^2], greatest and minus the least thrust of a rotor [N].
struct VehicleRecord {
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
};

// Walls on a derivative of a curve, each on the pieces of its leg, and the greatest excess over them, which is written.
struct ExcessRecord {
    std::int64_t pieces, degree, dim, order;
    std::int64_t per_leg;           // pieces of each leg
    std::int64_t walls, rows;       // one row for a normal, those of a ball's matrix else
    const double *points;           // (pieces, degree + 1, dim) [m]
    const double *durations;        // (pieces,) [s]
    const std::int64_t *leg;        // (walls,)
    const double *matrix, *anchor;  // (walls, rows, dim), (walls, dim)
    const double *lower, *upper;    // (walls,); of balls null, and radii
    double attained, bound, where;  // where on [0, 1]
    std::int64_t row;               // wall times per_leg, plus the piece of the leg
};

// Curves, one after the other as in ManyRecord, and where their derivatives at instants are written.
struct ValuesRecord {
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
};

// Sets of half-spaces, one after the other: set i has the rows first[i] ... first[i + 1] - 1. And what is written of them: their largest balls where
// ways is 0, else the least products of their points with directions.
struct SetsRecord {
    std::int64_t sets, dim, ways;
    double far;                      // largest radius and reach, over 1 m and the largest bound of a set
    const std::int64_t *first;       // (sets + 1,)
    const double *normals, *bounds;  // (rows, dim) of unit length, (rows,) [m]
    const double *along;             // (ways, dim), or null
    double *centers, *radii;         // (sets, dim), (sets,) negative where a set is empty [m]; or null
    double *least;                   // (sets, ways), or null
};

// One polynomial from a moving state, and conditions at instants: cones in which rows times a derivative plus a bound lie.
struct PieceRecord {
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
};

// A way to come to rest inside walls, as in stops.cpp. Groups of walls come first, then those of limits, which have one leg.
struct StopRecord {
    std::int64_t half, dim, walls, limits;  // groups
    std::int64_t legs;                      // within which it ends, 1 or 2
    std::int64_t member;      // of the family, from which on one is looked for, and which one was found; -1 to prove one polynomial
    double unit;              // time that stopping takes at a large acceleration [s]
    const double *state;      // (k, dim) at the start [m/s^order]
    const double *waypoints;  // (legs + 1, dim) [m]
    const ConeGroup *cones;   // (walls + limits,)
    double *caps;             // (legs,) how far beyond the waypoint at its end a leg goes on, infinite where that is not bounded [m]
    double *points;           // (2, 2k, dim) control points [m]; one polynomial to prove is counted from the start
    double duration, change;  // [s]; share of the duration after which the second leg is entered, 0 where it is not
    std::int64_t limited;     // whether it is proved to keep the sets of the limits
};

struct BorderField {
    const char *record, *name;
    std::int64_t offset, size;
};

#define MINSNAP_FIELD(record, name) {#record, #name, std::int64_t(offsetof(record, name)), std::int64_t(sizeof(record::name))}

constexpr BorderField border_fields[] = {
    MINSNAP_FIELD(WallsRecord, count),
    MINSNAP_FIELD(WallsRecord, balls),
    MINSNAP_FIELD(WallsRecord, piece),
    MINSNAP_FIELD(WallsRecord, order),
    MINSNAP_FIELD(WallsRecord, normal),
    MINSNAP_FIELD(WallsRecord, anchor),
    MINSNAP_FIELD(WallsRecord, bound),
    MINSNAP_FIELD(WallsRecord, width),
    MINSNAP_FIELD(WallsRecord, when),
    MINSNAP_FIELD(WallsRecord, ball),
    MINSNAP_FIELD(WallsRecord, matrix),
    MINSNAP_FIELD(CorridorRecord, half),
    MINSNAP_FIELD(CorridorRecord, pieces),
    MINSNAP_FIELD(CorridorRecord, dim),
    MINSNAP_FIELD(CorridorRecord, continuity),
    MINSNAP_FIELD(CorridorRecord, closed),
    MINSNAP_FIELD(CorridorRecord, length),
    MINSNAP_FIELD(CorridorRecord, time),
    MINSNAP_FIELD(CorridorRecord, gap),
    MINSNAP_FIELD(CorridorRecord, effort),
    MINSNAP_FIELD(CorridorRecord, seconds),
    MINSNAP_FIELD(CorridorRecord, positions),
    MINSNAP_FIELD(CorridorRecord, durations),
    MINSNAP_FIELD(CorridorRecord, pinned),
    MINSNAP_FIELD(CorridorRecord, values),
    MINSNAP_FIELD(CorridorRecord, walls),
    MINSNAP_FIELD(CorridorAnswerRecord, points),
    MINSNAP_FIELD(CorridorAnswerRecord, knots),
    MINSNAP_FIELD(CorridorAnswerRecord, wall),
    MINSNAP_FIELD(CorridorAnswerRecord, s),
    MINSNAP_FIELD(CorridorAnswerRecord, multiplier),
    MINSNAP_FIELD(CorridorAnswerRecord, direction),
    MINSNAP_FIELD(CorridorAnswerRecord, cost),
    MINSNAP_FIELD(CorridorAnswerRecord, bound),
    MINSNAP_FIELD(CorridorAnswerRecord, share),
    MINSNAP_FIELD(CorridorAnswerRecord, work),
    MINSNAP_FIELD(CorridorAnswerRecord, rows),
    MINSNAP_FIELD(CorridorAnswerRecord, rounds),
    MINSNAP_FIELD(CorridorAnswerRecord, attempts),
    MINSNAP_FIELD(SlackRecord, count),
    MINSNAP_FIELD(SlackRecord, group),
    MINSNAP_FIELD(SlackRecord, weight),
    MINSNAP_FIELD(SlackRecord, slack),
    MINSNAP_FIELD(SlackRecord, remainder),
    MINSNAP_FIELD(ChainRecord, half),
    MINSNAP_FIELD(ChainRecord, legs),
    MINSNAP_FIELD(ChainRecord, dim),
    MINSNAP_FIELD(ChainRecord, pins),
    MINSNAP_FIELD(ChainRecord, closed),
    MINSNAP_FIELD(ChainRecord, points),
    MINSNAP_FIELD(ChainRecord, durations),
    MINSNAP_FIELD(ChainRecord, start),
    MINSNAP_FIELD(ChainRecord, end),
    MINSNAP_FIELD(ChainRecord, knots),
    MINSNAP_FIELD(ChainRecord, masks),
    MINSNAP_FIELD(ChainRecord, values),
    MINSNAP_FIELD(SplitRecord, legs),
    MINSNAP_FIELD(SplitRecord, per_leg),
    MINSNAP_FIELD(SplitRecord, capacity),
    MINSNAP_FIELD(SplitRecord, price),
    MINSNAP_FIELD(SplitRecord, seconds),
    MINSNAP_FIELD(SplitRecord, effort),
    MINSNAP_FIELD(SplitRecord, durations),
    MINSNAP_FIELD(SplitRecord, history),
    MINSNAP_FIELD(SplitRecord, evaluations),
    MINSNAP_FIELD(SplitRecord, work),
    MINSNAP_FIELD(ManyRecord, count),
    MINSNAP_FIELD(ManyRecord, dim),
    MINSNAP_FIELD(ManyRecord, half),
    MINSNAP_FIELD(ManyRecord, threads),
    MINSNAP_FIELD(ManyRecord, gap),
    MINSNAP_FIELD(ManyRecord, most_gap),
    MINSNAP_FIELD(ManyRecord, points),
    MINSNAP_FIELD(ManyRecord, durations),
    MINSNAP_FIELD(ManyRecord, offsets),
    MINSNAP_FIELD(ManyRecord, widths),
    MINSNAP_FIELD(ManyRecord, starts),
    MINSNAP_FIELD(ManyRecord, ends),
    MINSNAP_FIELD(ManyRecord, curves),
    MINSNAP_FIELD(ManyRecord, breaks),
    MINSNAP_FIELD(ManyRecord, costs),
    MINSNAP_FIELD(ManyRecord, figures),
    MINSNAP_FIELD(ManyRecord, slopes),
    MINSNAP_FIELD(ManyRecord, displacements),
    MINSNAP_FIELD(ManyRecord, width_slopes),
    MINSNAP_FIELD(ManyRecord, statuses),
    MINSNAP_FIELD(VehicleRecord, parts),
    MINSNAP_FIELD(VehicleRecord, count),
    MINSNAP_FIELD(VehicleRecord, mass),
    MINSNAP_FIELD(VehicleRecord, jerk),
    MINSNAP_FIELD(VehicleRecord, medium),
    MINSNAP_FIELD(VehicleRecord, inertia),
    MINSNAP_FIELD(VehicleRecord, mixer),
    MINSNAP_FIELD(VehicleRecord, points),
    MINSNAP_FIELD(VehicleRecord, half),
    MINSNAP_FIELD(VehicleRecord, yaw),
    MINSNAP_FIELD(VehicleRecord, axes),
    MINSNAP_FIELD(VehicleRecord, bounds),
    MINSNAP_FIELD(ExcessRecord, pieces),
    MINSNAP_FIELD(ExcessRecord, degree),
    MINSNAP_FIELD(ExcessRecord, dim),
    MINSNAP_FIELD(ExcessRecord, order),
    MINSNAP_FIELD(ExcessRecord, per_leg),
    MINSNAP_FIELD(ExcessRecord, walls),
    MINSNAP_FIELD(ExcessRecord, rows),
    MINSNAP_FIELD(ExcessRecord, points),
    MINSNAP_FIELD(ExcessRecord, durations),
    MINSNAP_FIELD(ExcessRecord, leg),
    MINSNAP_FIELD(ExcessRecord, matrix),
    MINSNAP_FIELD(ExcessRecord, anchor),
    MINSNAP_FIELD(ExcessRecord, lower),
    MINSNAP_FIELD(ExcessRecord, upper),
    MINSNAP_FIELD(ExcessRecord, attained),
    MINSNAP_FIELD(ExcessRecord, bound),
    MINSNAP_FIELD(ExcessRecord, where),
    MINSNAP_FIELD(ExcessRecord, row),
    MINSNAP_FIELD(ValuesRecord, count),
    MINSNAP_FIELD(ValuesRecord, degree),
    MINSNAP_FIELD(ValuesRecord, dim),
    MINSNAP_FIELD(ValuesRecord, order),
    MINSNAP_FIELD(ValuesRecord, instants),
    MINSNAP_FIELD(ValuesRecord, shared),
    MINSNAP_FIELD(ValuesRecord, threads),
    MINSNAP_FIELD(ValuesRecord, points),
    MINSNAP_FIELD(ValuesRecord, durations),
    MINSNAP_FIELD(ValuesRecord, breaks),
    MINSNAP_FIELD(ValuesRecord, offsets),
    MINSNAP_FIELD(ValuesRecord, present),
    MINSNAP_FIELD(ValuesRecord, t),
    MINSNAP_FIELD(ValuesRecord, values),
    MINSNAP_FIELD(ValuesRecord, statuses),
    MINSNAP_FIELD(SetsRecord, sets),
    MINSNAP_FIELD(SetsRecord, dim),
    MINSNAP_FIELD(SetsRecord, ways),
    MINSNAP_FIELD(SetsRecord, far),
    MINSNAP_FIELD(SetsRecord, first),
    MINSNAP_FIELD(SetsRecord, normals),
    MINSNAP_FIELD(SetsRecord, bounds),
    MINSNAP_FIELD(SetsRecord, along),
    MINSNAP_FIELD(SetsRecord, centers),
    MINSNAP_FIELD(SetsRecord, radii),
    MINSNAP_FIELD(SetsRecord, least),
    MINSNAP_FIELD(PieceRecord, half),
    MINSNAP_FIELD(PieceRecord, dim),
    MINSNAP_FIELD(PieceRecord, conditions),
    MINSNAP_FIELD(PieceRecord, free),
    MINSNAP_FIELD(PieceRecord, duration),
    MINSNAP_FIELD(PieceRecord, acceleration),
    MINSNAP_FIELD(PieceRecord, order),
    MINSNAP_FIELD(PieceRecord, soft),
    MINSNAP_FIELD(PieceRecord, first),
    MINSNAP_FIELD(PieceRecord, s),
    MINSNAP_FIELD(PieceRecord, ahead),
    MINSNAP_FIELD(PieceRecord, matrix),
    MINSNAP_FIELD(PieceRecord, bound),
    MINSNAP_FIELD(PieceRecord, ends),
    MINSNAP_FIELD(PieceRecord, points),
    MINSNAP_FIELD(StopRecord, half),
    MINSNAP_FIELD(StopRecord, dim),
    MINSNAP_FIELD(StopRecord, walls),
    MINSNAP_FIELD(StopRecord, limits),
    MINSNAP_FIELD(StopRecord, legs),
    MINSNAP_FIELD(StopRecord, member),
    MINSNAP_FIELD(StopRecord, unit),
    MINSNAP_FIELD(StopRecord, state),
    MINSNAP_FIELD(StopRecord, waypoints),
    MINSNAP_FIELD(StopRecord, cones),
    MINSNAP_FIELD(StopRecord, caps),
    MINSNAP_FIELD(StopRecord, points),
    MINSNAP_FIELD(StopRecord, duration),
    MINSNAP_FIELD(StopRecord, change),
    MINSNAP_FIELD(StopRecord, limited),
    MINSNAP_FIELD(ConeGroup, count),
    MINSNAP_FIELD(ConeGroup, rows),
    MINSNAP_FIELD(ConeGroup, order),
    MINSNAP_FIELD(ConeGroup, outside),
    MINSNAP_FIELD(ConeGroup, at_knots),
    MINSNAP_FIELD(ConeGroup, leg),
    MINSNAP_FIELD(ConeGroup, matrix),
    MINSNAP_FIELD(ConeGroup, anchor),
    MINSNAP_FIELD(ConeGroup, slope),
    MINSNAP_FIELD(ConeGroup, radius),
    MINSNAP_FIELD(ConeGroup, width),
    MINSNAP_FIELD(MomentaryLimit, kind),
    MINSNAP_FIELD(MomentaryLimit, parameters),
    MINSNAP_FIELD(ShortestRequest, half),
    MINSNAP_FIELD(ShortestRequest, dim),
    MINSNAP_FIELD(ShortestRequest, legs),
    MINSNAP_FIELD(ShortestRequest, closed),
    MINSNAP_FIELD(ShortestRequest, groups),
    MINSNAP_FIELD(ShortestRequest, limits),
    MINSNAP_FIELD(ShortestRequest, divisions),
    MINSNAP_FIELD(ShortestRequest, moving),
    MINSNAP_FIELD(ShortestRequest, rough),
    MINSNAP_FIELD(ShortestRequest, parts),
    MINSNAP_FIELD(ShortestRequest, worthwhile),
    MINSNAP_FIELD(ShortestRequest, inwards),
    MINSNAP_FIELD(ShortestRequest, tightened),
    MINSNAP_FIELD(ShortestRequest, pinned),
    MINSNAP_FIELD(ShortestRequest, free),
    MINSNAP_FIELD(ShortestRequest, lengths),
    MINSNAP_FIELD(ShortestRequest, norms),
    MINSNAP_FIELD(ShortestRequest, price),
    MINSNAP_FIELD(ShortestRequest, slower),
    MINSNAP_FIELD(ShortestRequest, guessed),
    MINSNAP_FIELD(ShortestRequest, guess_durations),
    MINSNAP_FIELD(ShortestRequest, guess_knots),
    MINSNAP_FIELD(ShortestRequest, least),
    MINSNAP_FIELD(ShortestRequest, turned),
    MINSNAP_FIELD(ShortestRequest, cones),
    MINSNAP_FIELD(ShortestRequest, momentary),
    MINSNAP_FIELD(ShortestRequest, poll),
    MINSNAP_FIELD(ShortestAnswer, pieces),
    MINSNAP_FIELD(ShortestAnswer, iterations),
    MINSNAP_FIELD(ShortestAnswer, total),
    MINSNAP_FIELD(ShortestAnswer, wall),
    MINSNAP_FIELD(ShortestAnswer, limit),
    MINSNAP_FIELD(ShortestAnswer, durations),
    MINSNAP_FIELD(ShortestAnswer, points),
    MINSNAP_FIELD(ShortestAnswer, knots),
};

#undef MINSNAP_FIELD

}  // namespace minsnap

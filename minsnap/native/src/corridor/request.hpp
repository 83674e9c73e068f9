// A request as the caller states it, in metres and seconds, and how it becomes a chain and walls in normalised units.
#pragma once

#include <chrono>
#include <cmath>
#include <limits>

#include "corridor/balls.hpp"
#include "basics/border.hpp"
#include "basics/status.hpp"
#include "corridor/flat_walls.hpp"

namespace minsnap {

constexpr double hasty = 0.1;    // effort below which double precision alone is tried
constexpr double patient = 2.6;  // effort from which neither cost nor what double precision calls infeasible is a reason to give up

using Instant = std::chrono::steady_clock::time_point;

// The instant a number of seconds from now; none for as many as there are no clocks for.
inline Instant instant_in(double seconds) {
    if (!(seconds < 1e9)) return Instant::max();
    const std::chrono::duration<double> left(seconds > 0.0 ? seconds : 0.0);
    return std::chrono::steady_clock::now() + std::chrono::duration_cast<Instant::duration>(left);
}

// Unknowns by which walls move outwards, in shares of their widths times a weight; nothing moves without a count.
struct Slacks {
    int count = 0;
    const std::int64_t *group = nullptr;  // (walls,) which one moves each wall, or -1
    const double *weight = nullptr;       // (walls,)
    bool sign = false;                    // whether it is sufficient to know that they are not zero
    double price = 0.0;  // of the square of one, over the cost of the curve: high ones leave the curve alone out of account
};

struct Request {
    int half, pieces, dim;
    bool closed;
    double length, time;         // what normalised units are worth [m], [s]
    const double *positions;     // (pieces + 1, dim) nominal [m]
    const double *durations;     // (pieces,) [s]
    const std::uint8_t *pinned;  // (pieces + 1, slots, dim), or null: all positions, and the whole state at both ends
    const double *values;        // (pieces + 1, slots, dim) [m/s^order], deviations for order 0, or null: zero
    GivenWalls walls;
    double gap;           // share of the cost that may be given away
    int continuity = -1;  // derivatives continuous at the knots, from k - 2 on; less than zero is k - 1
    double effort = 1.0;  // share of the work that it is worth, after which it is given up
    Instant due = Instant::max();
    Slacks slacks = {};

    int smoothness() const { return continuity < 0 ? half - 1 : continuity; }
    int slots() const { return smoothness() < half - 1 ? half + 1 : half; }  // values at a knot, as in a chain
};

inline bool all_finite(const double *values, std::int64_t count) {
    for (std::int64_t i = 0; i < count; ++i)
        if (!std::isfinite(values[i])) return false;
    return true;
}

// Whether counts are within the bounds of a request.
bool corridor_sizes_fit(std::int64_t half, std::int64_t pieces, std::int64_t dim, std::int64_t walls);

// Whether the sizes of a request are within their bounds and its numbers are finite; done, or why not.
Status check_request(const Request &given);

// Make what a record of the border says a request that passes this check, with one duration of each piece; ``walls`` has its walls.
Status take_request(const CorridorRecord &asked, std::int64_t pieces, const double *durations, FlatWalls &walls, Request &given);

inline bool is_pinned(const Request &given, int knot, int slot, int axis) {
    if (given.pinned == nullptr) return slot == 0 || (!given.closed && (knot == 0 || knot == given.pieces));
    return given.pinned[(std::size_t(knot) * given.slots() + slot) * given.dim + axis] != 0;
}

// Fill a chain that has been allocated.
template <class Real, int Half>
void load_chain(const Request &given, Chain<Real, Half> &chain) {
    const Real length = given.length, time = given.time;
    for (int piece = 0; piece < given.pieces; ++piece) {
        chain.durations[piece] = given.durations[piece] / time;
        const double *const start = given.positions + std::size_t(piece) * given.dim;
        for (int axis = 0; axis < given.dim; ++axis)
            chain.steps[std::size_t(piece) * given.dim + axis] = (Real(start[given.dim + axis]) - start[axis]) / length;
    }
    for (int knot = given.pieces; knot >= 0; --knot) {  // of a closed chain the first knot counts, not the last
        Real unit = length;
        for (int slot = 0; slot < chain.slots(); ++slot) {
            for (int axis = 0; axis < given.dim; ++axis) {
                const std::size_t at = chain.at(knot, slot, axis);
                const bool pinned = is_pinned(given, knot, slot, axis);
                const std::size_t from = (std::size_t(knot) * chain.slots() + slot) * given.dim + axis;
                chain.pinned[at] = pinned;
                chain.values[at] = pinned && given.values != nullptr ? given.values[from] / unit : Real(0);
            }
            if (slot < given.half - 1) unit /= time;
        }
    }
}

// How far a wall is from what is pinned at an end of its piece; infinite where the value is free.
template <class Real, int Half>
Real room_at(const Chain<Real, Half> &chain, const Wall<Real> &wall, const Ball<Real> &ball, int end) {
    if (wall.order >= chain.size.half()) return std::numeric_limits<Real>::infinity();
    Real value = 0, place[max_dim];
    for (int q = 0; q < max_dim; ++q) place[q] = ball.offset[q];
    for (int axis = 0; axis < chain.dim; ++axis) {
        if (!((wall.axes | ball.axes) >> axis & 1U)) continue;
        const int knot = wall.piece + end, slot = chain.slot(wall.order, end);
        if (chain.is_free(knot, slot, axis)) return std::numeric_limits<Real>::infinity();
        Real own = chain.values[chain.at(knot, slot, axis)];
        if (end == 1 && wall.order == 0) own += chain.steps[std::size_t(wall.piece) * chain.dim + axis];
        value += wall.normal[axis] * own;
        for (int q = 0; q < ball.rows; ++q) place[q] += ball.matrix[q][axis] * own;
    }
    return wall.bound - value - sqrt(dot(place, place, ball.rows));
}

// Walls move inwards by shares of their width, or of the room at the ends of the piece where that is less. A wall on
// which a pinned state lies does not move.
template <class Real, int Half>
bool set_give(const Chain<Real, Half> &chain, const Ball<Real> &ball, Wall<Real> &wall) {
    wall.give[0] = wall.give[1] = wall.equality ? Real(0) : wall.width;
    if (wall.equality) return true;
    for (int end = 0; end < 2; ++end) {
        if (wall.when != When::always && int(wall.when) != end) continue;
        const Real room = room_at(chain, wall, ball, end);
        if (room < -Real(1e-12) * wall.width) return false;
        if (room < wall.width) wall.give[end] = room;
    }
    const Real least = smallest(wall.give[0], wall.give[1]);
    if (wall.when != When::always) wall.give[0] = wall.give[1] = least;
    if (least < Real(1e-9) * wall.width) wall.give[0] = wall.give[1] = 0;
    return true;
}

// Column ``axis`` of a ball's matrix, whose origin is ``away`` from its anchor along that axis.
template <class Real>
void load_column(const double *matrix, int dim, int axis, Real away, Ball<Real> &ball) {
    for (int q = 0; q < dim; ++q) {
        const Real component = matrix[q * dim + axis];
        if (component == 0) continue;
        ball.axes |= 1U << axis;
        ball.rows = ball.rows > q ? ball.rows : q + 1;
        ball.matrix[q][axis] = component;
        ball.offset[q] += component * away;
    }
}

// ``number`` is the ball's if the wall is one.
template <class Real, int Half>
Status load_wall(const Request &given, const Chain<Real, Half> &chain, std::int64_t index, int number, Wall<Real> &wall, Ball<Real> &ball) {
    const GivenWalls &all = given.walls;
    wall = {}, ball = {};
    wall.piece = int(all.piece_of(index)), wall.order = int(all.order[index]);
    wall.when = all.when_of(index), wall.equality = all.is_equality(index);
    wall.ball = all.is_ball(index) ? number : -1;
    Real unit = given.length;
    for (int q = 0; q < wall.order; ++q) unit /= given.time;
    wall.bound = all.bound[index] / unit, wall.width = all.width[index] / unit;
    for (int axis = 0; axis < given.dim; ++axis) {
        const Real origin = wall.order == 0 ? given.positions[std::size_t(wall.piece) * given.dim + axis] : 0.0;
        const Real away = (origin - Real(all.anchor[index * given.dim + axis])) / unit;
        if (wall.ball >= 0) load_column(all.matrix_of(index, given.dim), given.dim, axis, away, ball);
        wall.touch(axis, all.normal[index * given.dim + axis]);
        wall.bound -= wall.normal[axis] * away;
    }
    wall.slack = -1;
    if (given.slacks.count == 0) return set_give(chain, ball, wall) ? Status::done : Status::infeasible;
    wall.slack = int(given.slacks.group[index]);
    wall.give[0] = wall.give[1] = wall.slack < 0 ? Real(0) : given.slacks.weight[index] * wall.width;
    return Status::done;
}

// Control points (pieces, 2k, dim) in metres, exact at the knots.
template <class Real, int Half>
void write_points(const Request &given, const Chain<Real, Half> &chain, double *points) {
    const int half = given.half, dim = given.dim, degree = 2 * half - 1;
    for (int piece = 0; piece < given.pieces; ++piece)
        for (int axis = 0; axis < dim; ++axis) {
            const double *const from = given.positions + std::size_t(piece) * dim + axis;
            double *const out = points + std::size_t(piece) * 2 * half * dim + axis;
            Real ends[max_points];
            chain.ends_of(piece, axis, ends);
            ends[half] -= chain.steps[std::size_t(piece) * dim + axis];
            for (int j = 0; j < half; ++j) {
                Real start = 0, end = 0;
                for (int a = 0; a <= j; ++a) {
                    start += chain.tables->ends[j][a] * ends[a];
                    end += (a % 2 ? -chain.tables->ends[j][a] : chain.tables->ends[j][a]) * ends[half + a];
                }
                out[j * dim] = double(from[0] + Real(given.length) * start);
                out[(degree - j) * dim] = double(from[dim] + Real(given.length) * end);
            }
        }
}

}  // namespace minsnap

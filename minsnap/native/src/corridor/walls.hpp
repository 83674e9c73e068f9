// Walls on a piece, at every instant or at one of its ends only: planes n . x <= b with x = r^(p)(t) - a, and round walls
// |A x| + n . x <= b: balls where n is zero, as cylinders (A a projection), ellipsoids and limits of derivatives are, else
// cones, such as a limit of tilt.
#pragma once

#include <cmath>

#include "chain/chain.hpp"

namespace minsnap {

enum class When : int { always = -1, start = 0, end = 1 };

constexpr int equal = 2;  // added to a When other than always: a plane on which the curve lies then, instead of behind it

// As given by the caller, in metres and seconds.
struct GivenWalls {
    std::int64_t count;
    const std::int64_t *piece, *order;   // (count,)
    const double *normal, *anchor;       // (count, dim); the anchor is a point for order 0, else a derivative
    const double *bound, *width;         // (count,); the width is the length by which an excess is judged
    const std::int64_t *when;            // (count,) When, or that plus ``equal``; or null: always
    std::int64_t origin = 0;             // pieces are counted from this one
    const std::int64_t *ball = nullptr;  // (count,) which matrix a round wall has, -1 for planes; null: all are planes
    const double *matrix = nullptr;      // (balls, dim, dim): A, its last rows zero where it has fewer
    std::int64_t balls = 0;

    std::int64_t piece_of(std::int64_t index) const { return piece[index] - origin; }
    bool is_equality(std::int64_t index) const { return when != nullptr && when[index] >= equal; }
    When when_of(std::int64_t index) const { return when == nullptr ? When::always : When(when[index] - (is_equality(index) ? equal : 0)); }
    bool is_ball(std::int64_t index) const { return ball != nullptr && ball[index] >= 0; }
    const double *matrix_of(std::int64_t index, int dim) const { return matrix + ball[index] * dim * dim; }
};

// n . r^(p) <= b in normalised units, measured from the nominal start of the piece.
template <class Real>
struct Plane {
    int piece, order;
    unsigned axes;  // bits of the coordinates that it touches
    Real normal[max_dim];
    Real bound;

    void touch(int axis, Real component) {
        normal[axis] = component;
        if (component == 0) return;
        axes |= 1U << axis;
    }
};

// A plane; or a round wall |A r^(p) + c| + n . r^(p) <= b.
template <class Real>
struct Wall : Plane<Real> {
    When when;
    bool equality;
    Real width;
    Real give[2];  // by how much it moves inwards at the ends of the piece for each share of a width
    int ball;      // index of its A and c, or -1
    Real inward;   // by how much it moves inwards besides, so that rounding leaves room for the proof
    int slack;     // which slack moves it outwards, or -1
};

// The derivative of order ``plane.order`` along the normal: control points; returns their degree. ``all`` are the control
// points of all pieces, such as chain.points.
template <class Real, int Half>
inline int along_normal(const Chain<Real, Half> &chain, const Real *all, const Plane<Real> &plane, Real *points) {
    int degree = chain.size.degree();
    const int count = chain.size.points();
    for (int j = 0; j < count; ++j) points[j] = 0;
    for (int axis = 0; axis < chain.dim; ++axis) {
        if (!(plane.axes >> axis & 1U)) continue;
        const Real *const own = all + (std::size_t(plane.piece) * chain.dim + axis) * count;
        const Real factor = plane.normal[axis];
        for (int j = 0; j < count; ++j) points[j] += factor * own[j];
    }
    for (int q = 0; q < plane.order; ++q, --degree) {
        differentiate(points, degree);
        for (int j = 0; j < degree; ++j) points[j] /= chain.durations[plane.piece];
        if (degree == 0) return points[0] = 0, 0;
    }
    return degree;
}

// By how much a wall stands nearer at s, for each share of a width that walls are moved inwards.
template <class Real>
inline Real give_at(const Wall<Real> &wall, Real s) {
    return wall.give[0] + s * (wall.give[1] - wall.give[0]);
}

// By how much a wall is moved inwards at s.
template <class Real>
inline Real inwards_at(const Wall<Real> &wall, Real share, Real s) {
    return wall.inward + share * give_at(wall, s);
}

// From control points of the excess over a wall to those over the wall moved inwards by a share of its width.
template <class Real>
inline void move_inwards(const Wall<Real> &wall, Real share, int degree, Real *points) {
    const Real start = inwards_at(wall, share, Real(0)), rise = share * (wall.give[1] - wall.give[0]);
    const Real slope = degree > 0 ? rise / degree : Real(0);
    for (int j = 0; j <= degree; ++j) points[j] += start + j * slope;
}

// Control points of n . r^(p) - b, the wall moved inwards: the excess over a plane; returns their degree.
template <class Real, int Half>
inline int beyond_plane(const Chain<Real, Half> &chain, const Wall<Real> &wall, Real share, Real *excess) {
    const int degree = along_normal(chain, chain.points.data(), wall, excess);
    for (int j = 0; j <= degree; ++j) excess[j] -= wall.bound;
    move_inwards(wall, share, degree, excess);
    return degree;
}

// The length that an excess at s is measured by: what the wall gives there, or its width where it does not move.
template <class Real>
inline Real unit_at(const Wall<Real> &wall, Real s) {
    const Real give = give_at(wall, s);
    return give > 0 ? give : wall.width;
}

}  // namespace minsnap

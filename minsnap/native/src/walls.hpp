// Walls: n . (r^(p)(t) - a) <= b on a piece at every instant, or at one of its ends only.
#pragma once

#include "chain.hpp"

namespace minsnap {

enum class When : int { always = -1, start = 0, end = 1 };

// As given by the caller, in metres and seconds.
struct GivenWalls {
    std::int64_t count;
    const std::int64_t *piece, *order;  // (count,)
    const double *normal, *anchor;      // (count, dim); the anchor is a point for order 0, else a derivative
    const double *bound, *width;        // (count,); the width is the length by which an excess is judged
    const std::int64_t *when;           // (count,) When, or null: always
    std::int64_t origin = 0;            // pieces are counted from this one

    std::int64_t piece_of(std::int64_t index) const { return piece[index] - origin; }
};

// In normalised units, measured from the nominal start of the piece.
template <class Real>
struct Wall {
    int piece, order;
    When when;
    unsigned axes;  // bits of the coordinates that it touches
    int steepest;   // the coordinate along which the normal is longest
    Real normal[max_dim];
    Real bound, width;
    Real give[2];  // by how much it moves inwards at the ends of the piece for each share of a width
    Real inward = 0;  // by how much it moves inwards besides, so that rounding leaves room for the proof
};

// The derivative of order ``wall.order`` along the normal: control points; returns their degree. ``all`` are the control
// points of all pieces, such as chain.points.
template <class Real, int Half>
inline int along_normal(const Chain<Real, Half> &chain, const Real *all, const Wall<Real> &wall, Real *points) {
    int degree = chain.size.degree();
    const int count = chain.size.points();
    for (int j = 0; j < count; ++j) points[j] = 0;
    for (int axis = 0; axis < chain.dim; ++axis) {
        if (!(wall.axes >> axis & 1U)) continue;
        const Real *const own = all + (std::size_t(wall.piece) * chain.dim + axis) * count;
        const Real factor = wall.normal[axis];
        for (int j = 0; j < count; ++j) points[j] += factor * own[j];
    }
    for (int q = 0; q < wall.order; ++q, --degree) {
        differentiate(points, degree);
        for (int j = 0; j < degree; ++j) points[j] /= chain.durations[wall.piece];
    }
    return degree;
}

// By how much a wall stands nearer at s, for each share of a width that walls are moved inwards.
template <class Real>
inline Real give_at(const Wall<Real> &wall, Real s) {
    return wall.give[0] + s * (wall.give[1] - wall.give[0]);
}

// The bound at s of a wall moved inwards.
template <class Real>
inline Real limit_at(const Wall<Real> &wall, Real share, Real s) {
    return wall.bound - wall.inward - share * give_at(wall, s);
}

// The length that an excess at s is measured by: what the wall gives there, or its width where it does not move.
template <class Real>
inline Real unit_at(const Wall<Real> &wall, Real s) {
    const Real give = give_at(wall, s);
    return give > 0 ? give : wall.width;
}

}  // namespace minsnap

// Round walls |A r^(p) + c| <= b - n . r^(p), whose right side is their height: the radius of a ball, and what a cone has
// there. The unit vectors by which their tangent planes are known, and where a curve leaves them.
#pragma once

#include "arithmetic/vectors.hpp"
#include "corridor/walls.hpp"

namespace minsnap {

template <class Real>
struct Ball {
    int rows;       // of A, zero ones at the end left out
    unsigned axes;  // bits of the coordinates that A touches
    Real matrix[max_dim][max_dim], offset[max_dim];
};

// Coordinate q of A r^(p), as a plane without a bound.
template <class Real>
inline Plane<Real> coordinate(const Wall<Real> &wall, const Ball<Real> &ball, int dim, int q) {
    Plane<Real> plane = {};
    plane.piece = wall.piece, plane.order = wall.order;
    for (int axis = 0; axis < dim; ++axis) plane.touch(axis, ball.matrix[q][axis]);
    return plane;
}

// The plane u . (A r^(p) + c) + n . r^(p) <= b that touches the wall where A r^(p) + c is along the unit vector u: every point
// inside keeps it.
template <class Real>
inline Plane<Real> tangent(const Wall<Real> &wall, const Ball<Real> &ball, int dim, const Real *direction) {
    Plane<Real> plane = wall;
    plane.axes = 0;
    for (int q = 0; q < ball.rows; ++q) plane.bound -= direction[q] * ball.offset[q];
    for (int axis = 0; axis < dim; ++axis) {
        Real component = wall.normal[axis];
        for (int q = 0; q < ball.rows; ++q) component += direction[q] * ball.matrix[q][axis];
        plane.touch(axis, component);
    }
    return plane;
}

// Make a vector of ``rows`` entries a unit vector. False if it is zero.
template <class Real>
inline bool normalise(Real *vector, int rows) {
    const Real length = sqrt(dot(vector, vector, rows));
    if (!(length > 0)) return false;
    for (int q = 0; q < rows; ++q) vector[q] /= length;
    return true;
}

// A r^(p) + c at s.
template <class Real, int Half>
inline void place_in_ball(const Chain<Real, Half> &chain, const Wall<Real> &wall, const Ball<Real> &ball, Real s, Real *place) {
    for (int q = 0; q < ball.rows; ++q) {
        Real points[max_points];
        const int degree = along_normal(chain, chain.points.data(), coordinate(wall, ball, chain.dim, q), points);
        place[q] = ball.offset[q] + jet_at(points, degree, s).value;
    }
}

// Add to ``sums`` a sign times the square of a polynomial, each control point times its binomial coefficient.
template <class Real>
inline void add_square(const Real *points, int degree, Real sign, Real *sums) {
    Real scaled[max_points];
    for (int j = 0; j <= degree; ++j) scaled[j] = points[j] * binomial_rows().row[degree][j];
    for (int i = 0; i <= degree; ++i)
        for (int j = 0; j <= degree; ++j) sums[i + j] += sign * scaled[i] * scaled[j];
}

// From control points of minus the height h to those of (|A r^(p) + c|^2 - h^2) / (2 width), which is positive beyond the
// wall while h is; returns their degree.
template <class Real, int Half>
inline int beyond_ball(const Chain<Real, Half> &chain, const Wall<Real> &wall, const Ball<Real> &ball, int degree, Real *excess) {
    Real sums[max_products] = {};
    add_square(excess, degree, Real(-1), sums);
    for (int q = 0; q < ball.rows; ++q) {
        Real points[max_points];
        along_normal(chain, chain.points.data(), coordinate(wall, ball, chain.dim, q), points);
        for (int j = 0; j <= degree; ++j) points[j] += ball.offset[q];
        add_square(points, degree, Real(1), sums);
    }
    for (int j = 0; j <= 2 * degree; ++j) excess[j] = sums[j] / (binomial_rows().row[2 * degree][j] * 2 * wall.width);
    return 2 * degree;
}

// The distance beyond a round wall from the value of that polynomial, where the wall has this height.
template <class Real>
inline Real distance_beyond(const Wall<Real> &wall, Real height, Real value) {
    const Real norm = sqrt(largest(height * height + 2 * wall.width * value, Real(0)));
    return height > 0 ? 2 * wall.width * value / (height + norm) : norm - height;
}

}  // namespace minsnap

// Balls |A r^(p) + c| <= b, the unit vectors by which their tangent planes are known, and where a curve leaves them.
#pragma once

#include "vectors.hpp"
#include "walls.hpp"

namespace minsnap {

template <class Real>
struct Ball {
    int rows;  // of A, zero ones at the end left out
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

// The plane u . (A r^(p) + c) <= b that touches a ball where its unit normal is u: every point of the ball keeps it.
template <class Real>
inline Plane<Real> tangent(const Wall<Real> &wall, const Ball<Real> &ball, int dim, const Real *direction) {
    Plane<Real> plane = {};
    plane.piece = wall.piece, plane.order = wall.order, plane.bound = wall.bound;
    for (int q = 0; q < ball.rows; ++q) plane.bound -= direction[q] * ball.offset[q];
    for (int axis = 0; axis < dim; ++axis) {
        Real component = 0;
        for (int q = 0; q < ball.rows; ++q) component += direction[q] * ball.matrix[q][axis];
        plane.touch(axis, component);
    }
    return plane;
}

// Make a vector of ``rows`` entries a unit vector. False if it is zero.
template <class Real>
inline bool normalise(Real *vector, int rows) {
    const Real length = std::sqrt(dot(vector, vector, rows));
    if (!(length > 0)) return false;
    for (int q = 0; q < rows; ++q) vector[q] /= length;
    return true;
}

// A r^(p) + c at s.
template <class Real, int Half>
inline void place_in_ball(const Chain<Real, Half> &chain, const Wall<Real> &wall, const Ball<Real> &ball, Real s,
                          Real *place) {
    for (int q = 0; q < ball.rows; ++q) {
        Real points[max_points];
        const int degree = along_normal(chain, chain.points.data(), coordinate(wall, ball, chain.dim, q), points);
        place[q] = ball.offset[q] + jet_at(points, degree, s).value;
    }
}

// Control points of (|A r^(p) + c|^2 - b^2) / (2 b), to first order the distance beyond the ball; returns their degree.
template <class Real, int Half>
inline int beyond_ball(const Chain<Real, Half> &chain, const Wall<Real> &wall, const Ball<Real> &ball, Real *excess) {
    Real sums[max_products] = {};
    int degree = 0;
    for (int q = 0; q < ball.rows; ++q) {
        Real points[max_points];
        degree = along_normal(chain, chain.points.data(), coordinate(wall, ball, chain.dim, q), points);
        for (int j = 0; j <= degree; ++j) points[j] = (points[j] + ball.offset[q]) * binomial_rows().row[degree][j];
        for (int i = 0; i <= degree; ++i)
            for (int j = 0; j <= degree; ++j) sums[i + j] += points[i] * points[j];
    }
    for (int j = 0; j <= 2 * degree; ++j)
        excess[j] = (sums[j] / binomial_rows().row[2 * degree][j] / wall.bound - wall.bound) / 2;
    return 2 * degree;
}

// The distance beyond a ball from the value of that polynomial.
template <class Real>
inline Real distance_beyond(const Wall<Real> &wall, Real value) {
    const Real square = wall.bound * (wall.bound + 2 * value);
    return 2 * wall.bound * value / (wall.bound + std::sqrt(largest(square, Real(0))));
}

}  // namespace minsnap

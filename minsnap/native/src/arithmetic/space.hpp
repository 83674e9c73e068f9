// Vectors in space of plain numbers, or of numbers that carry derivatives or ranges.
#pragma once

#include <cmath>

namespace minsnap {

inline double root(double a) { return std::sqrt(a); }

inline double positive(double a) { return a > 0.0 ? a : 0.0; }

// A square, and a number that is known to lie in [-1, 1]; numbers with ranges know more of both.
template <class Real>
inline Real squared(const Real &a) {
    return a * a;
}
template <class Real>
inline Real within_one(const Real &a) {
    return a;
}

template <class Real>
struct Space {
    Real x, y, z;
};

template <class Real>
inline Space<Real> operator+(const Space<Real> &a, const Space<Real> &b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}

template <class Real>
inline Space<Real> operator-(const Space<Real> &a, const Space<Real> &b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}

template <class Real>
inline Space<Real> operator*(const Real &a, const Space<Real> &b) {
    return {a * b.x, a * b.y, a * b.z};
}

template <class Real>
inline Real inner(const Space<Real> &a, const Space<Real> &b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class Real>
inline Space<Real> cross(const Space<Real> &a, const Space<Real> &b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Square of the length; and the length, rounded off by what is added to its square.
template <class Real>
inline Real square(const Space<Real> &a) {
    return squared(a.x) + squared(a.y) + squared(a.z);
}
template <class Real>
inline Real norm(const Space<Real> &a, double floor) {
    return root(square(a) + floor);
}

// The direction of a vector of that length.
template <class Real>
inline Space<Real> along(const Space<Real> &a, const Real &size) {
    const Real inverse = Real(1.0) / size;
    return {within_one(inverse * a.x), within_one(inverse * a.y), within_one(inverse * a.z)};
}

}  // namespace minsnap

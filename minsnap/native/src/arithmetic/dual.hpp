// Numbers with their derivatives in several directions: forward differentiation, exact to rounding.
#pragma once

#include <cmath>

namespace minsnap {

template <int count>
struct Dual {
    double value = 0.0;
    double slope[count] = {};

    Dual() = default;
    Dual(double number) : value(number) {}  // NOLINT: numbers are duals without slopes
};

template <int n>
inline Dual<n> operator+(const Dual<n> &a, const Dual<n> &b) {
    Dual<n> c(a.value + b.value);
    for (int i = 0; i < n; ++i) c.slope[i] = a.slope[i] + b.slope[i];
    return c;
}

template <int n>
inline Dual<n> operator-(const Dual<n> &a, const Dual<n> &b) {
    Dual<n> c(a.value - b.value);
    for (int i = 0; i < n; ++i) c.slope[i] = a.slope[i] - b.slope[i];
    return c;
}

template <int n>
inline Dual<n> operator*(const Dual<n> &a, const Dual<n> &b) {
    Dual<n> c(a.value * b.value);
    for (int i = 0; i < n; ++i) c.slope[i] = a.slope[i] * b.value + a.value * b.slope[i];
    return c;
}

template <int n>
inline Dual<n> operator*(double a, const Dual<n> &b) {
    Dual<n> c(a * b.value);
    for (int i = 0; i < n; ++i) c.slope[i] = a * b.slope[i];
    return c;
}

template <int n>
inline Dual<n> operator/(const Dual<n> &a, const Dual<n> &b) {
    Dual<n> c(a.value / b.value);
    for (int i = 0; i < n; ++i) c.slope[i] = (a.slope[i] - c.value * b.slope[i]) / b.value;
    return c;
}

template <int n>
inline Dual<n> operator+(const Dual<n> &a, double b) {
    Dual<n> c = a;
    c.value += b;
    return c;
}

template <int n>
inline Dual<n> operator-(const Dual<n> &a, double b) {
    return a + (-b);
}

template <int n>
inline Dual<n> root(const Dual<n> &a) {
    Dual<n> c(std::sqrt(a.value));
    const double half = 0.5 / c.value;
    for (int i = 0; i < n; ++i) c.slope[i] = a.slope[i] * half;
    return c;
}

inline double root(double a) { return std::sqrt(a); }

template <int n>
inline double value_of(const Dual<n> &a) {
    return a.value;
}

inline double value_of(double a) { return a; }

// Vectors in space of such numbers or of plain ones.
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

template <class Real>
inline Real norm(const Space<Real> &a, double floor) {
    return root(inner(a, a) + floor);
}

}  // namespace minsnap

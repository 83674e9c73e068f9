// Numbers with their derivatives in several directions, or in none: forward differentiation, exact to rounding. With lanes (`lanes.hpp`) several such
// numbers at once.
#pragma once

#include "arithmetic/lanes.hpp"
#include "arithmetic/space.hpp"

namespace minsnap {

// The square root, lane by lane.
MINSNAP_INLINE Quad root(const Quad &number) {
    return Quad{std::sqrt(number[0]), std::sqrt(number[1]), std::sqrt(number[2]), std::sqrt(number[3])};
}

template <int count, class Real = double>
struct Dual {
    Real value{};
    Real slope[count > 0 ? count : 1] = {};

    Dual() = default;
    Dual(double number) : value(filled<Real>(number)) {}  // NOLINT: numbers are constants
};

template <int n, class Real>
inline Dual<n, Real> operator+(const Dual<n, Real> &a, const Dual<n, Real> &b) {
    Dual<n, Real> c;
    c.value = a.value + b.value;
    for (int i = 0; i < n; ++i) c.slope[i] = a.slope[i] + b.slope[i];
    return c;
}

template <int n, class Real>
inline Dual<n, Real> operator-(const Dual<n, Real> &a, const Dual<n, Real> &b) {
    Dual<n, Real> c;
    c.value = a.value - b.value;
    for (int i = 0; i < n; ++i) c.slope[i] = a.slope[i] - b.slope[i];
    return c;
}

template <int n, class Real>
inline Dual<n, Real> operator*(const Dual<n, Real> &a, const Dual<n, Real> &b) {
    Dual<n, Real> c;
    c.value = a.value * b.value;
    for (int i = 0; i < n; ++i) c.slope[i] = a.slope[i] * b.value + a.value * b.slope[i];
    return c;
}

template <int n, class Real>
inline Dual<n, Real> operator*(double a, const Dual<n, Real> &b) {
    Dual<n, Real> c;
    c.value = a * b.value;
    for (int i = 0; i < n; ++i) c.slope[i] = a * b.slope[i];
    return c;
}

template <int n, class Real>
inline Dual<n, Real> operator/(const Dual<n, Real> &a, const Dual<n, Real> &b) {
    Dual<n, Real> c;
    c.value = a.value / b.value;
    for (int i = 0; i < n; ++i) c.slope[i] = (a.slope[i] - c.value * b.slope[i]) / b.value;
    return c;
}

template <int n, class Real>
inline Dual<n, Real> operator+(const Dual<n, Real> &a, double b) {
    Dual<n, Real> c = a;
    c.value += filled<Real>(b);
    return c;
}

template <int n, class Real>
inline Dual<n, Real> operator-(const Dual<n, Real> &a, double b) {
    return a + (-b);
}

template <int n, class Real>
inline Dual<n, Real> root(const Dual<n, Real> &a) {
    Dual<n, Real> c;
    c.value = root(a.value);
    for (int i = 0; i < n; ++i) c.slope[i] = a.slope[i] * (0.5 / c.value);
    return c;
}

// The number where it is positive, else a zero that does not change.
template <int n, class Real>
inline Dual<n, Real> positive(const Dual<n, Real> &a) {
    Dual<n, Real> c;
    const auto above = a.value > c.value;
    c.value = above ? a.value : c.value;
    for (int i = 0; i < n; ++i) c.slope[i] = above ? a.slope[i] : c.slope[i];
    return c;
}

}  // namespace minsnap

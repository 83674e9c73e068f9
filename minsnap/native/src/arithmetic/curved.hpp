// Numbers with their first and second derivatives in several directions: forward differentiation, exact to rounding. With
// lanes (`lanes.hpp`) several such numbers at once.
#pragma once

#include "arithmetic/dual.hpp"

namespace minsnap {

template <int count, class Real = double>
struct Curved {
    static constexpr int packed = count * (count + 1) / 2;  // lower triangle

    Real value{};
    Real slope[count] = {};
    Real bend[packed] = {};

    Curved() = default;
    Curved(double number) : value(filled<Real>(number)) {}  // NOLINT: numbers are constants

    static Curved unknown(const Real &number, int direction) {
        Curved made;
        made.value = number;
        made.slope[direction] = filled<Real>(1.0);
        return made;
    }
};

template <int n, class Real>
inline Curved<n, Real> operator+(const Curved<n, Real> &a, const Curved<n, Real> &b) {
    Curved<n, Real> c;
    c.value = a.value + b.value;
    for (int i = 0; i < n; ++i) c.slope[i] = a.slope[i] + b.slope[i];
    for (int t = 0; t < Curved<n, Real>::packed; ++t) c.bend[t] = a.bend[t] + b.bend[t];
    return c;
}

template <int n, class Real>
inline Curved<n, Real> operator-(const Curved<n, Real> &a, const Curved<n, Real> &b) {
    Curved<n, Real> c;
    c.value = a.value - b.value;
    for (int i = 0; i < n; ++i) c.slope[i] = a.slope[i] - b.slope[i];
    for (int t = 0; t < Curved<n, Real>::packed; ++t) c.bend[t] = a.bend[t] - b.bend[t];
    return c;
}

template <int n, class Real>
inline Curved<n, Real> operator*(const Curved<n, Real> &a, const Curved<n, Real> &b) {
    Curved<n, Real> c;
    c.value = a.value * b.value;
    for (int i = 0; i < n; ++i) c.slope[i] = a.slope[i] * b.value + a.value * b.slope[i];
    for (int i = 0, t = 0; i < n; ++i)
        for (int j = 0; j <= i; ++j, ++t)
            c.bend[t] = (a.bend[t] * b.value + a.value * b.bend[t]) + (a.slope[i] * b.slope[j] + a.slope[j] * b.slope[i]);
    return c;
}

template <int n, class Real>
inline Curved<n, Real> operator*(double a, const Curved<n, Real> &b) {
    Curved<n, Real> c;
    c.value = a * b.value;
    for (int i = 0; i < n; ++i) c.slope[i] = a * b.slope[i];
    for (int t = 0; t < Curved<n, Real>::packed; ++t) c.bend[t] = a * b.bend[t];
    return c;
}

// A function of one number, from its value and its first and second derivative there.
template <int n, class Real>
inline Curved<n, Real> chained(const Curved<n, Real> &a, const Real &value, const Real &first, const Real &second) {
    Curved<n, Real> c;
    c.value = value;
    for (int i = 0; i < n; ++i) c.slope[i] = first * a.slope[i];
    for (int i = 0, t = 0; i < n; ++i)
        for (int j = 0; j <= i; ++j, ++t) c.bend[t] = first * a.bend[t] + second * (a.slope[i] * a.slope[j]);
    return c;
}

template <int n, class Real>
inline Curved<n, Real> operator/(const Curved<n, Real> &a, const Curved<n, Real> &b) {
    const Real inverse = 1.0 / b.value;
    return a * chained(b, inverse, -inverse * inverse, 2.0 * inverse * inverse * inverse);
}

template <int n, class Real>
inline Curved<n, Real> operator+(const Curved<n, Real> &a, double b) {
    Curved<n, Real> c = a;
    c.value += filled<Real>(b);
    return c;
}

template <int n, class Real>
inline Curved<n, Real> operator-(const Curved<n, Real> &a, double b) {
    return a + (-b);
}

template <int n, class Real>
inline Curved<n, Real> root(const Curved<n, Real> &a) {
    const Real value = root(a.value), first = 0.5 / value;
    return chained(a, value, first, -0.5 * first / a.value);
}

// The number where it is positive, else a zero that does not change.
template <int n, class Real>
inline Curved<n, Real> positive(const Curved<n, Real> &a) {
    Curved<n, Real> c;
    const auto above = a.value > c.value;
    c.value = above ? a.value : c.value;
    for (int i = 0; i < n; ++i) c.slope[i] = above ? a.slope[i] : c.slope[i];
    for (int t = 0; t < Curved<n, Real>::packed; ++t) c.bend[t] = above ? a.bend[t] : c.bend[t];
    return c;
}

}  // namespace minsnap

// Numbers with their derivatives in several directions: forward differentiation, exact to rounding.
#pragma once

#include "arithmetic/space.hpp"

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

template <int n>
inline Dual<n> positive(const Dual<n> &a) {
    return a.value > 0.0 ? a : Dual<n>(0.0);
}

}  // namespace minsnap

// Numbers with their first and second derivatives in several directions: forward differentiation, exact to rounding.
#pragma once

#include "arithmetic/dual.hpp"

namespace minsnap {

template <int count>
struct Curved {
    static constexpr int packed = count * (count + 1) / 2;  // lower triangle

    double value = 0.0;
    double slope[count] = {};
    double bend[packed] = {};

    Curved() = default;
    Curved(double number) : value(number) {}  // NOLINT: numbers are constants

    static Curved unknown(double number, int direction) {
        Curved made(number);
        made.slope[direction] = 1.0;
        return made;
    }
};

template <int n>
inline Curved<n> operator+(const Curved<n> &a, const Curved<n> &b) {
    Curved<n> c(a.value + b.value);
    for (int i = 0; i < n; ++i) c.slope[i] = a.slope[i] + b.slope[i];
    for (int t = 0; t < Curved<n>::packed; ++t) c.bend[t] = a.bend[t] + b.bend[t];
    return c;
}

template <int n>
inline Curved<n> operator-(const Curved<n> &a, const Curved<n> &b) {
    Curved<n> c(a.value - b.value);
    for (int i = 0; i < n; ++i) c.slope[i] = a.slope[i] - b.slope[i];
    for (int t = 0; t < Curved<n>::packed; ++t) c.bend[t] = a.bend[t] - b.bend[t];
    return c;
}

template <int n>
inline Curved<n> operator*(const Curved<n> &a, const Curved<n> &b) {
    Curved<n> c(a.value * b.value);
    for (int i = 0; i < n; ++i) c.slope[i] = a.slope[i] * b.value + a.value * b.slope[i];
    for (int i = 0, t = 0; i < n; ++i)
        for (int j = 0; j <= i; ++j, ++t)
            c.bend[t] = (a.bend[t] * b.value + a.value * b.bend[t]) + (a.slope[i] * b.slope[j] + a.slope[j] * b.slope[i]);
    return c;
}

template <int n>
inline Curved<n> operator*(double a, const Curved<n> &b) {
    Curved<n> c(a * b.value);
    for (int i = 0; i < n; ++i) c.slope[i] = a * b.slope[i];
    for (int t = 0; t < Curved<n>::packed; ++t) c.bend[t] = a * b.bend[t];
    return c;
}

// A function of one number, from its value and its first and second derivative there.
template <int n>
inline Curved<n> chained(const Curved<n> &a, double value, double first, double second) {
    Curved<n> c(value);
    for (int i = 0; i < n; ++i) c.slope[i] = first * a.slope[i];
    for (int i = 0, t = 0; i < n; ++i)
        for (int j = 0; j <= i; ++j, ++t) c.bend[t] = first * a.bend[t] + second * (a.slope[i] * a.slope[j]);
    return c;
}

template <int n>
inline Curved<n> operator/(const Curved<n> &a, const Curved<n> &b) {
    const double inverse = 1.0 / b.value;
    return a * chained(b, inverse, -inverse * inverse, 2.0 * inverse * inverse * inverse);
}

template <int n>
inline Curved<n> operator+(const Curved<n> &a, double b) {
    Curved<n> c = a;
    c.value += b;
    return c;
}

template <int n>
inline Curved<n> operator-(const Curved<n> &a, double b) {
    return a + (-b);
}

template <int n>
inline Curved<n> root(const Curved<n> &a) {
    const double value = std::sqrt(a.value), first = 0.5 / value;
    return chained(a, value, first, -0.5 * first / a.value);
}

template <int n>
inline double value_of(const Curved<n> &a) {
    return a.value;
}

}  // namespace minsnap

// Exponential, logarithm, sine, cosine, angles and whole powers by operations that IEEE 754 rounds once: C libraries differ in the last
// bit, and what searches decide by must not.
//
// Reduction by powers of two, or by quarter turns, with ln 2 or the turn in two parts, then a Taylor polynomial (W. J. Cody
// and W. Waite, "Software Manual for the Elementary Functions", 1980). All are accurate to about two units in the last place.
#pragma once

#include <cmath>

namespace minsnap {

constexpr double ln2_high = 0x1.62e42feep-1, ln2_low = 0x1.a39ef35793c76p-33;

inline double exponential(double x) {
    if (!(x > -745.0)) return x != x ? x : 0.0;
    if (x > 709.7) return __builtin_huge_val();
    const double whole = std::floor(x * 1.4426950408889634 + 0.5);
    const double rest = (x - whole * ln2_high) - whole * ln2_low;
    double sum = 1.0;
    for (int n = 14; n > 0; --n) sum = 1.0 + sum * rest / n;
    return std::ldexp(sum, int(whole));
}

// Of a positive number.
inline double logarithm(double x) {
    int exponent = 0;
    double mantissa = std::frexp(x, &exponent);
    if (mantissa < 0.70710678118654752) mantissa *= 2.0, --exponent;
    const double ratio = (mantissa - 1.0) / (mantissa + 1.0), square = ratio * ratio;
    double sum = 0.0;
    for (int n = 21; n > 1; n -= 2) sum = (sum + 1.0 / n) * square;
    return exponent * ln2_high + (2.0 * ratio * (1.0 + sum) + exponent * ln2_low);
}

// Of an angle of at most some thousand turns.
inline void sine_and_cosine(double angle, double &sine, double &cosine) {
    constexpr double high = 0x1.921fb544p+0, low = 0x1.0b4611a626331p-34;  // a quarter turn
    const double whole = std::floor(angle * 0.63661977236758134 + 0.5);
    const double rest = (angle - whole * high) - whole * low, square = rest * rest;
    double along = 1.0, across = 1.0;
    for (int n = 18; n > 0; n -= 2) {
        along = 1.0 - along * square / (n * (n - 1));
        across = 1.0 - across * square / (n * (n + 1));
    }
    across *= rest;
    const int quarter = int(whole - 4.0 * std::floor(0.25 * whole));
    const double turned[4] = {along, -across, -along, across};
    cosine = turned[quarter];
    sine = turned[(quarter + 3) % 4];
}

// The angle of a vector, from -pi to pi; 0 of none.
inline double angle_of(double east, double north) {
    constexpr double quarter = 0x1.921fb54442d18p+0, eighth = 0.5 * quarter, half = 0x1.dac670561bb4fp-2;  // the last one of 1 to 2
    const double x = std::abs(east), y = std::abs(north), low = x < y ? x : y, high = x < y ? y : x;
    if (!(high > 0.0)) return 0.0;
    const double slope = low / high;
    const double from = slope < 0.25 ? 0.0 : slope < 0.75 ? 0.5 : 1.0, turned = slope < 0.25 ? 0.0 : slope < 0.75 ? half : eighth;
    const double rest = (slope - from) / (1.0 + from * slope), square = rest * rest;
    double sum = 0.0;
    for (int n = 25; n > 1; n -= 2) sum = square * (1.0 / n - sum);
    double angle = turned + rest * (1.0 - sum);
    if (x < y) angle = quarter - angle;
    if (east < 0.0) angle = 2.0 * quarter - angle;
    return north < 0.0 ? -angle : angle;
}

inline double power(double x, int n) {
    double product = 1.0;
    for (int i = 0; i < n; ++i) product *= x;
    return product;
}

// A power of two near the geometric mean of durations: what the unit of time is, so that scaling by it is exact.
inline double typical_time(const double *durations, long long count) {
    long long sum = 0;
    for (long long i = 0; i < count; ++i) {
        int exponent = 0;
        std::frexp(durations[i], &exponent);
        sum += exponent;
    }
    const long long down = sum >= 0 ? sum / count : -((-sum + count - 1) / count);
    return std::ldexp(1.0, int(down));
}

}  // namespace minsnap

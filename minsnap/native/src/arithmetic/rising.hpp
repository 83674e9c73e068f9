// Numbers along a part of a path: the value in its middle, and ranges of value and slope, so that a short part has narrow ones.
//
// Ranges follow R. E. Moore, "Interval Analysis", 1966; the value also lies within the slope's reach of the middle (the mean value form), which closes
// in with the square of the length. To rounding: ranges are not rounded outwards.
#pragma once

#include <algorithm>
#include <cmath>

#include "arithmetic/space.hpp"

namespace minsnap {

struct Range {
    double low = 0.0, high = 0.0;

    static Range whole() { return {-HUGE_VAL, HUGE_VAL}; }
    static Range around(double middle, double reach) { return {middle - reach, middle + reach}; }
    bool bounded() const { return low > -HUGE_VAL && high < HUGE_VAL; }
    double reach() const { return std::max(-low, high); }
};

inline Range operator+(const Range &a, const Range &b) { return {a.low + b.low, a.high + b.high}; }
inline Range operator-(const Range &a, const Range &b) { return {a.low - b.high, a.high - b.low}; }
inline Range operator*(const Range &a, const Range &b) {
    if (!a.bounded() || !b.bounded()) return Range::whole();
    const double p = a.low * b.low, q = a.low * b.high, r = a.high * b.low, s = a.high * b.high;
    return {std::min(std::min(p, q), std::min(r, s)), std::max(std::max(p, q), std::max(r, s))};
}
inline Range operator*(double a, const Range &b) {
    if (a == 0.0) return {};
    return a > 0.0 ? Range{a * b.low, a * b.high} : Range{a * b.high, a * b.low};
}
inline Range inverse(const Range &a) { return a.low > 0.0 || a.high < 0.0 ? Range{1.0 / a.high, 1.0 / a.low} : Range::whole(); }
inline Range common(const Range &a, const Range &b) { return {std::max(a.low, b.low), std::min(a.high, b.high)}; }

// The slope is that in a parameter from -1 to 1 along the part.
struct Rising {
    double middle = 0.0;
    Range value, slope;

    Rising() = default;
    Rising(double number) : middle(number), value{number, number} {}  // NOLINT: numbers are constants
    Rising(double at, const Range &found, const Range &slopes) : middle(at), value(found), slope(slopes) {
        const double reach = slope.reach();
        if (reach < HUGE_VAL && std::abs(middle) < HUGE_VAL) value = common(value, Range::around(middle, reach));
    }
};

inline Rising operator+(const Rising &a, const Rising &b) { return {a.middle + b.middle, a.value + b.value, a.slope + b.slope}; }
inline Rising operator-(const Rising &a, const Rising &b) { return {a.middle - b.middle, a.value - b.value, a.slope - b.slope}; }
inline Rising operator*(const Rising &a, const Rising &b) {
    return {a.middle * b.middle, a.value * b.value, a.slope * b.value + a.value * b.slope};
}
inline Rising operator*(double a, const Rising &b) { return {a * b.middle, a * b.value, a * b.slope}; }
inline Rising operator+(const Rising &a, double b) { return {a.middle + b, a.value + Range{b, b}, a.slope}; }
inline Rising operator-(const Rising &a, double b) { return a + (-b); }

inline Rising operator/(const Rising &a, const Rising &b) {
    const Range over = inverse(b.value), quotient = a.value * over;
    return {a.middle / b.middle, quotient, (a.slope - quotient * b.slope) * over};
}

inline Rising root(const Rising &a) {
    const Range value{std::sqrt(std::max(a.value.low, 0.0)), std::sqrt(std::max(a.value.high, 0.0))};
    return {std::sqrt(std::max(a.middle, 0.0)), value, 0.5 * (a.slope * inverse(value))};
}

inline Rising squared(const Rising &a) {
    Range square = a.value * a.value;
    const bool across = a.value.low <= 0.0 && a.value.high >= 0.0;
    square.low = across ? 0.0 : std::max(square.low, 0.0);
    return {a.middle * a.middle, square, 2.0 * (a.value * a.slope)};
}

inline Rising within_one(const Rising &a) {
    const auto cut = [](double x) { return std::min(std::max(x, -1.0), 1.0); };
    return {a.middle, {cut(a.value.low), cut(a.value.high)}, a.slope};
}

}  // namespace minsnap

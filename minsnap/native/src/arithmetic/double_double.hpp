// Numbers of twice the precision: unevaluated sums of two doubles, about 32 digits.
//
// T. J. Dekker, "A floating-point technique for extending the available precision", Numerische Mathematik 18, 1971;
// D. E. Knuth, "The Art of Computer Programming", volume 2, section 4.2.2.  The operations rely on every double being
// rounded once: no contraction, no excess precision.
#pragma once

#include <cmath>
#include <limits>

namespace minsnap {

using std::fabs, std::isfinite, std::sqrt;

struct DoubleDouble {
    double high;
    double low;

    DoubleDouble() = default;  // not initialised, as a double
    constexpr DoubleDouble(double value) : high(value), low(0.0) {}
    constexpr DoubleDouble(double one, double two) : high(one), low(two) {}
    explicit operator double() const { return high + low; }
};

inline double to_double(double value) { return value; }
inline double to_double(const DoubleDouble &value) { return value.high + value.low; }

// Exact sum of two doubles, whichever is larger (Knuth).
inline DoubleDouble exact_sum(double a, double b) {
    const double sum = a + b, part = sum - a;
    return {sum, (a - (sum - part)) + (b - part)};
}

// Exact sum where |a| >= |b| (Dekker).
inline DoubleDouble ordered_sum(double a, double b) {
    const double sum = a + b;
    return {sum, b - (sum - a)};
}

// Exact product by splitting both factors into halves of 26 bits (Dekker, Veltkamp).
inline DoubleDouble exact_product(double a, double b) {
    const double splitter = 134217729.0;  // 2^27 + 1
    const double wide_a = splitter * a, high_a = wide_a - (wide_a - a), low_a = a - high_a;
    const double wide_b = splitter * b, high_b = wide_b - (wide_b - b), low_b = b - high_b;
    const double product = a * b;
    return {product, ((high_a * high_b - product) + high_a * low_b + low_a * high_b) + low_a * low_b};
}

inline DoubleDouble operator+(const DoubleDouble &a, const DoubleDouble &b) {
    const DoubleDouble high = exact_sum(a.high, b.high), low = exact_sum(a.low, b.low);
    const DoubleDouble joined = ordered_sum(high.high, high.low + low.high);
    return ordered_sum(joined.high, joined.low + low.low);
}

inline DoubleDouble operator-(const DoubleDouble &a) { return {-a.high, -a.low}; }
inline DoubleDouble operator-(const DoubleDouble &a, const DoubleDouble &b) { return a + (-b); }

inline DoubleDouble operator*(const DoubleDouble &a, const DoubleDouble &b) {
    const DoubleDouble product = exact_product(a.high, b.high);
    return ordered_sum(product.high, product.low + (a.high * b.low + a.low * b.high));
}

inline DoubleDouble operator*(double a, const DoubleDouble &b) { return DoubleDouble(a) * b; }

inline DoubleDouble operator/(const DoubleDouble &a, const DoubleDouble &b) {
    const double first = a.high / b.high;
    const DoubleDouble left = a - first * b;
    const double second = left.high / b.high;
    const DoubleDouble rest = left - second * b;
    return ordered_sum(first, second) + DoubleDouble(rest.high / b.high);
}

inline DoubleDouble operator/(double a, const DoubleDouble &b) { return DoubleDouble(a) / b; }

inline DoubleDouble &operator+=(DoubleDouble &a, const DoubleDouble &b) { return a = a + b; }
inline DoubleDouble &operator-=(DoubleDouble &a, const DoubleDouble &b) { return a = a - b; }
inline DoubleDouble &operator*=(DoubleDouble &a, const DoubleDouble &b) { return a = a * b; }

inline DoubleDouble &operator/=(DoubleDouble &a, const DoubleDouble &b) { return a = a / b; }

inline bool operator==(const DoubleDouble &a, const DoubleDouble &b) { return a.high == b.high && a.low == b.low; }
inline bool operator!=(const DoubleDouble &a, const DoubleDouble &b) { return !(a == b); }
inline bool operator<(const DoubleDouble &a, const DoubleDouble &b) { return a.high < b.high || (a.high == b.high && a.low < b.low); }
inline bool operator>(const DoubleDouble &a, const DoubleDouble &b) { return b < a; }
inline bool operator<=(const DoubleDouble &a, const DoubleDouble &b) { return a < b || a == b; }
inline bool operator>=(const DoubleDouble &a, const DoubleDouble &b) { return b <= a; }

inline DoubleDouble fabs(const DoubleDouble &a) { return a.high < 0.0 || (a.high == 0.0 && a.low < 0.0) ? -a : a; }
inline bool isfinite(const DoubleDouble &a) { return isfinite(a.high); }

// A Newton step from the root of the larger part (A. H. Karp and P. Markstein, ACM TOMS 23, 1997).
inline DoubleDouble sqrt(const DoubleDouble &a) {
    if (!(a.high > 0.0)) return DoubleDouble(sqrt(a.high));
    const double root = sqrt(a.high);
    return ordered_sum(root, (a - exact_product(root, root)).high / (2.0 * root));
}

}  // namespace minsnap

namespace std {

template <>
struct numeric_limits<minsnap::DoubleDouble> {
    static constexpr bool is_specialized = true;
    static constexpr minsnap::DoubleDouble infinity() { return {numeric_limits<double>::infinity(), 0.0}; }
    static constexpr minsnap::DoubleDouble epsilon() { return {4.930380657631324e-32, 0.0}; }  // 2^-104
};

}  // namespace std

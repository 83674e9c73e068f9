// Running error bounds: with every computed number goes a bound on its distance from the exact one.
//
// Standard model (N. J. Higham, "Accuracy and Stability of Numerical Algorithms", 2nd ed., SIAM 2002, sections 2.2 and
// 3.3): fl(a op b) = (a op b)(1 + d) = (a op b)/(1 + d'), |d|, |d'| <= u. So one operation adds at most u |result| to
// the error, and the result is at hand. The bounds are sums and products of numbers >= 0; computed with some 10^5
// operations they are wrong by less than a share of 2^-30, which `above` allows for once, at the end.
// Underflow is outside the model; `above` adds `tiny`, far below any length, wherever a result is not exact.
#pragma once

#include <cmath>

namespace minsnap {

constexpr double unit = 0x1p-53;
constexpr double tiny = 0x1p-1000;

// A number that is not below value + error, whatever the rounding of this sum; value itself where it is exact.
inline double above(double value, double error) {
    if (error == 0.0) return value;
    const double sum = value + error * (1.0 + 0x1p-29);
    return sum + (2.0 * unit * std::fabs(sum) + tiny);
}

inline double below(double value, double error) { return -above(-value, error); }

// Error of fl(a - b), exactly (D. E. Knuth, "The Art of Computer Programming", vol. 2, theorem 4.2.2B).
inline double difference_error(double a, double b, double difference) {
    const double b_back = a - difference;
    const double a_back = difference + b_back;
    return std::fabs((a - a_back) - (b - b_back));
}

}  // namespace minsnap

// Polynomials on 0 <= s <= 1 by their Bernstein coefficients (control points) of one coordinate.
//
// G. Farin, "Curves and Surfaces for CAGD", 5th edition, 2002, chapters 4 and 5.
#pragma once

#include "arithmetic/double_double.hpp"

namespace minsnap {

constexpr int max_half = 6;                       // k of the largest degree 2k - 1 = 11
constexpr int max_points = 2 * max_half;          // control points of a piece
constexpr int max_dim = 6;                        // coordinates of a curve
constexpr int max_products = 2 * max_points - 1;  // control points of a product of two coordinates

// k of degree 2k - 1: known when compiled (Half > 0), or given at run time (Half = 0).
template <int Half>
struct Degree {
    explicit Degree(int) {}
    static constexpr int half() { return Half; }
    static constexpr int points() { return 2 * Half; }
    static constexpr int degree() { return 2 * Half - 1; }
};

template <>
struct Degree<0> {
    explicit Degree(int half) : half_(half) {}
    int half() const { return half_; }
    int points() const { return 2 * half_; }
    int degree() const { return 2 * half_ - 1; }

private:
    int half_;
};

inline double binomial(int n, int k) {
    double value = 1.0;
    for (int i = 1; i <= k; ++i) value = value * (n - k + i) / i;
    return value;
}

// Rows of Pascal's triangle, made once.
struct BinomialRows {
    double row[max_products][max_products] = {};
    BinomialRows() {
        for (int n = 0; n < max_products; ++n)
            for (int k = 0; k <= n; ++k) row[n][k] = binomial(n, k);
    }
};

inline const BinomialRows &binomial_rows() {
    static const BinomialRows made;
    return made;
}

// Values of the degree + 1 basis polynomials at s.
template <class Real>
inline void bernstein_basis(int degree, Real s, Real *basis) {
    basis[0] = 1;
    for (int m = 1; m <= degree; ++m) {  // from degree m - 1 to m
        basis[m] = s * basis[m - 1];
        for (int j = m - 1; j > 0; --j) basis[j] = (1 - s) * basis[j] + s * basis[j - 1];
        basis[0] *= 1 - s;
    }
}

// Control points of the derivative in s, in place: degree of them remain.
template <class Real>
inline void differentiate(Real *points, int degree) {
    for (int j = 0; j < degree; ++j) points[j] = degree * (points[j + 1] - points[j]);
}

template <class Real>
struct Jet {
    Real value, slope, curvature;  // of a polynomial and its first two derivatives in s
};

// Value and derivatives at s, by de Casteljau's algorithm stopped two steps early.
template <class Real>
inline Jet<Real> jet_of_degree(const Real *points, const int degree, Real s) {
    Real row[max_products];
    for (int j = 0; j <= degree; ++j) row[j] = points[j];
    for (int m = degree; m > 2; --m)
        for (int j = 0; j < m; ++j) row[j] += s * (row[j + 1] - row[j]);
    if (degree == 0) return {row[0], 0, 0};
    if (degree == 1) return {row[0] + s * (row[1] - row[0]), row[1] - row[0], 0};
    const Real first = row[0] + s * (row[1] - row[0]), second = row[1] + s * (row[2] - row[1]);
    const Real bend = degree * (degree - 1) * (row[2] - 2 * row[1] + row[0]);
    return {first + s * (second - first), degree * (second - first), bend};
}

template <class Real>
inline Jet<Real> jet_at(const Real *points, int degree, Real s) {
    return degree == 7 ? jet_of_degree(points, 7, s) : jet_of_degree(points, degree, s);  // loops of the usual one unrolled
}

}  // namespace minsnap

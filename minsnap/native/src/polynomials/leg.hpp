// What is constant about a piece of degree 2k - 1: how its end derivatives give its control points, its cost and the
// value of a derivative at an instant.
//
// Ends are e = (r, r'T, ..., r^(k-1) T^(k-1)) at the start, then the same at the end: all are lengths
// (C. Richter, A. Bry and N. Roy, ISRR 2013, in scaled form).
#pragma once

#include <cmath>

#include "polynomials/bernstein.hpp"

namespace minsnap {

template <class Real>
struct LegTables {
    Real ends[max_half][max_half];    // control point j = sum_a ends[j][a] e_a; mirrored, odd orders negated, at the end
    Real root[max_half][max_points];  // the cost of a piece with T = 1 is |root e|^2
};

// The k-th derivative has the Bernstein coefficients d = D e, and its integral of squares is d'Gd with
// G_ij = C(m,i) C(m,j) / C(2m, i+j) / (2m+1), m = k - 1; root = U D with G = U'U. Positions enter by their difference
// only, so that root is blind to where the piece lies.
inline void make_root(int half, LegTables<DoubleDouble> &tables) {
    const int degree = 2 * half - 1, last = half - 1;
    DoubleDouble factor[max_half][max_half] = {}, falling = 1;
    for (int j = 0; j < half; ++j)  // Cholesky of G
        for (int i = 0; i <= j; ++i) {
            DoubleDouble sum = binomial(last, i) * binomial(last, j) / (binomial(2 * last, i + j) * (2 * last + 1.0));
            for (int q = 0; q < i; ++q) sum -= factor[q][i] * factor[q][j];
            factor[i][j] = i == j ? sqrt(sum) : sum / factor[i][i];
        }
    for (int q = 0; q < half; ++q) falling *= degree - q;
    for (int column = 1; column < 2 * half; ++column) {
        DoubleDouble points[max_points] = {};
        const int order = column % half;
        for (int j = order; j < half; ++j)
            if (column < half)
                points[j] = tables.ends[j][order];
            else
                points[degree - j] = order % 2 ? -tables.ends[j][order] : tables.ends[j][order];
        for (int m = degree; m > last; --m)
            for (int j = 0; j < m; ++j) points[j] = points[j + 1] - points[j];
        for (int i = 0; i < half; ++i)
            for (int j = i; j < half; ++j) tables.root[i][column] += factor[i][j] * falling * points[j];
    }
    for (int i = 0; i < half; ++i) tables.root[i][0] = -tables.root[i][half];
}

template <class Real>
LegTables<Real> make_tables(int half) {
    LegTables<DoubleDouble> exact = {};
    for (int j = 0; j < half; ++j) {
        DoubleDouble divisor = 1;
        for (int a = 0; a <= j; ++a) {
            exact.ends[j][a] = binomial(j, a) / divisor;
            divisor *= 2 * half - 1 - a;
        }
    }
    make_root(half, exact);
    LegTables<Real> tables = {};
    for (int i = 0; i < max_half; ++i)
        for (int j = 0; j < max_points; ++j) {
            if (j < max_half) tables.ends[i][j] = Real(exact.ends[i][j]);
            tables.root[i][j] = Real(exact.root[i][j]);
        }
    return tables;
}

// Tables for k, made once.
template <class Real>
const LegTables<Real> &leg_tables(int half) {
    static const LegTables<Real> tables[max_half - 1] = {make_tables<Real>(2), make_tables<Real>(3), make_tables<Real>(4),
                                                         make_tables<Real>(5), make_tables<Real>(6)};
    return tables[half - 2];
}

// Control points of one coordinate from its ends (2k,).
template <class Real, int Half>
inline void points_from_ends(Degree<Half> size, const LegTables<Real> &tables, const Real *ends, Real *points) {
    const int half = size.half(), degree = size.degree();
    for (int j = 0; j < half; ++j) {
        Real start = 0, end = 0;
        for (int a = 0; a <= j; ++a) {
            start += tables.ends[j][a] * ends[a];
            end += (a % 2 ? -tables.ends[j][a] : tables.ends[j][a]) * ends[half + a];
        }
        points[j] = start;
        points[degree - j] = end;
    }
}

// Factors of the knot derivatives (not yet times a power of T) in the order-th derivative of a piece at s: (2k,).
template <class Real, int Half>
inline void row_factors(Degree<Half> size, const LegTables<Real> &tables, Real duration, int order, Real s, Real *factors) {
    const int half = size.half(), degree = size.degree();
    if (order > degree) {
        for (int j = 0; j <= degree; ++j) factors[j] = 0;
        return;
    }
    Real weights[max_points];
    bernstein_basis(degree - order, s, weights);
    for (int m = degree - order; m < degree; ++m) {  // the transposed differences, back to degree 2k - 1
        weights[m + 1] = (m + 1) * weights[m];
        for (int j = m; j > 0; --j) weights[j] = (m + 1) * (weights[j - 1] - weights[j]);
        weights[0] *= -(m + 1);
    }
    Real power = 1;
    for (int q = 0; q < order; ++q) power /= duration;
    for (int a = 0; a < half; ++a, power *= duration) {
        Real start = 0, end = 0;
        for (int j = a; j < half; ++j) {
            start += weights[j] * tables.ends[j][a];
            end += weights[degree - j] * tables.ends[j][a];
        }
        factors[a] = power * start;
        factors[half + a] = a % 2 ? -power * end : power * end;
    }
}

}  // namespace minsnap

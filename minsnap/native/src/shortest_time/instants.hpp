// Values of a piece's derivatives at instants, from its end derivatives: the Hermite basis of degree 2k - 1 on the unit interval.
//
// End derivatives become Bernstein control points, b_j = sum_q C(j, q) (n - q)! / n! e_q near the start and alike near the end
// (G. Farin, "Curves and Surfaces for CAGD", chapter 5), whose differences give the derivatives.
#pragma once

#include "shortest_time/settings.hpp"

namespace minsnap {

// Sizes of a search: degree 2 half - 1, axes, and instants per piece at which conditions stand.
template <int halves, int axes, int count>
struct Shape {
    static constexpr int half = halves, dim = axes, instants = count;
    static constexpr int ends = 2 * half;  // end derivatives of a piece per axis
    static constexpr int degree = ends - 1;
    static constexpr int knot = half * dim;               // unknowns of a knot
    static constexpr int block = knot + 1;                // with the duration that follows
    static constexpr int whole = ends * dim;              // end derivatives of a piece
    static constexpr int packed = ends * (ends + 1) / 2;  // lower triangle over end derivatives
    static constexpr int pairs = dim * (dim + 1) / 2;     // of axes
    static constexpr int local = 2 * knot + 3;            // unknowns that a piece depends on
};

constexpr int condition_orders = 5;  // position to snap

// Control points of the unit end derivatives: point j of end a is map[j][a].
template <int half>
inline void control_map(double map[2 * half][2 * half]) {
    constexpr int n = 2 * half - 1;
    for (int j = 0; j <= n; ++j)
        for (int a = 0; a < 2 * half; ++a) map[j][a] = 0.0;
    for (int j = 0; j < half; ++j) {
        double factor = 1.0;  // C(j, q) (n - q)! / n!
        for (int q = 0; q <= j; ++q) {
            map[j][q] = factor;
            map[n - j][half + q] = q % 2 ? -factor : factor;
            factor *= static_cast<double>(j - q) / ((q + 1.0) * (n - q));
        }
    }
}

// Factors of the end derivatives in the derivative of an order at s, (2 half,).
template <int half>
inline void hermite(double s, int order, double *factors) {
    constexpr int ends = 2 * half, n = ends - 1;
    double points[ends][ends];
    control_map<half>(points);
    for (int k = 0; k < order; ++k)
        for (int j = 0; j < n - k; ++j)
            for (int a = 0; a < ends; ++a) points[j][a] = (n - k) * (points[j + 1][a] - points[j][a]);
    for (int k = order; k < n; ++k)  // de Casteljau
        for (int j = 0; j < n - k; ++j)
            for (int a = 0; a < ends; ++a) points[j][a] = (1.0 - s) * points[j][a] + s * points[j + 1][a];
    for (int a = 0; a < ends; ++a) factors[a] = order > n ? 0.0 : points[0][a];
}

// Tables for equally spaced instants from one end of a piece to the other.
template <int half, int count>
struct Instants {
    static constexpr int ends = 2 * half, packed = ends * (ends + 1) / 2;
    double by_end[condition_orders][ends][count];      // factor of an end derivative
    double powers[2 * ends - 1][2 * ends - 1][count];  // s^k (1 - s)^(m - k), by m, then k
    double choose[ends][ends];                         // binomials
    double control[ends][ends];                        // control points of the unit end derivatives
    static constexpr int grams = half < condition_orders ? condition_orders : half + 1;
    double gram[grams][packed];  // integrals of these products over the interval, of derivatives to the one of order half
    double derived[half][ends];  // control points of the derivative of order half
    double mass[half][half];     // integrals of products of Bernstein polynomials of their degree

    static double place(int g) { return static_cast<double>(g) / (count - 1); }

    Instants() {
        double factors[ends];
        for (int order = 0; order < condition_orders; ++order)
            for (int g = 0; g < count; ++g) {
                hermite<half>(place(g), order, factors);
                for (int a = 0; a < ends; ++a) by_end[order][a][g] = factors[a];
            }
        for (int g = 0; g < count; ++g) raise(g);
        control_map<half>(control);
        for (int m = 0; m < ends; ++m)
            for (int k = 0; k <= m; ++k) choose[m][k] = k == 0 || k == m ? 1.0 : choose[m - 1][k - 1] + choose[m - 1][k];
        for (int order = 0; order < grams; ++order) integrate(order);
        derive();
    }

private:
    void raise(int g) {
        const double s = place(g), left = 1.0 - s;
        powers[0][0][g] = 1.0;
        for (int m = 1; m < 2 * ends - 1; ++m) {
            for (int k = 0; k < m; ++k) powers[m][k][g] = left * powers[m - 1][k][g];
            powers[m][m][g] = s * powers[m - 1][m - 1][g];
        }
    }

    void derive() {
        double points[ends][ends];
        control_map<half>(points);
        for (int k = 0; k < half; ++k)
            for (int j = 0; j + k + 1 < ends; ++j)
                for (int a = 0; a < ends; ++a) points[j][a] = (ends - 1 - k) * (points[j + 1][a] - points[j][a]);
        for (int j = 0; j < half; ++j)
            for (int a = 0; a < ends; ++a) derived[j][a] = points[j][a];
        double many = 1.0;  // of degree 2 half - 2, divided by the number of its polynomials
        double row[2 * half - 1] = {1.0};
        for (int k = 1; k <= 2 * half - 2; ++k) {
            many *= (2.0 * half - 1.0 - k) / k;
            row[k] = many;
        }
        for (int i = 0; i < half; ++i)
            for (int j = 0; j < half; ++j) mass[i][j] = choose[half - 1][i] * choose[half - 1][j] / (row[i + j] * (2 * half - 1));
    }

    // By the composite rule of Gauss with two nodes: a metric need not be exact.
    void integrate(int order) {
        constexpr int cells = 64;
        constexpr double offset = 0.28867513459481288225;  // half of 1 / sqrt(3)
        double factors[ends];
        for (int t = 0; t < packed; ++t) gram[order][t] = 0.0;
        for (int k = 0; k < 2 * cells; ++k) {
            hermite<half>((k / 2 + 0.5 + (k % 2 ? offset : -offset)) / cells, order, factors);
            for (int a = 0, t = 0; a < ends; ++a)
                for (int b = 0; b <= a; ++b, ++t) gram[order][t] += 0.5 / cells * factors[a] * factors[b];
        }
    }
};

}  // namespace minsnap

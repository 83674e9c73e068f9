// Pieces of degree 7 by the derivatives at their ends, 0 to 3 of each, in units of the piece's own time: position = sum over e of B_e(u) x_e.
//
// Bernstein control points of Hermite data: J. Hoschek and D. Lasser, "Fundamentals of Computer Aided Geometric Design", section 4.1.
#pragma once

#include "polynomials/bernstein.hpp"

namespace minsnap {

constexpr int ends = 8;           // data of a piece: 4 derivatives at each end
constexpr int end_pairs = 36;     // unordered pairs of them
constexpr int knot_size = 12;     // unknowns of a knot: 4 derivatives, 3 axes
constexpr int septic_orders = 5;  // derivatives 0 ... 4

inline int end_pair(int e, int g) { return e * (e + 1) / 2 + g; }  // g <= e

// Control points (8) from end data (8): columns of the map.
struct SepticMap {
    double to_points[ends][ends] = {};
    SepticMap() {
        constexpr double left[4][4] = {{1, 0, 0, 0}, {1, 1.0 / 7, 0, 0}, {1, 2.0 / 7, 1.0 / 42, 0}, {1, 3.0 / 7, 3.0 / 42, 1.0 / 210}};
        for (int k = 0; k < 4; ++k)
            for (int e = 0; e < 4; ++e) {
                to_points[k][e] = left[k][e];
                to_points[7 - k][4 + e] = e % 2 == 0 ? left[k][e] : -left[k][e];
            }
    }
};

inline const SepticMap &septic_map() {
    static const SepticMap made;
    return made;
}

// B_e(u), or their derivatives of an order in u.
inline void septic_basis(double u, int order, double *basis) {
    const SepticMap &map = septic_map();
    double weight[ends] = {}, bernstein[ends];
    const int n = 7 - order;
    bernstein_basis(n, u, bernstein);
    double factor = 1.0;
    for (int i = 0; i < order; ++i) factor *= 7 - i;
    for (int k = 0; k <= n; ++k) weight[k] = factor * bernstein[k];
    for (int i = 0; i < order; ++i)  // transposed differences
        for (int k = n + i + 1; k >= 0; --k) weight[k] = (k > 0 ? weight[k - 1] : 0.0) - weight[k];
    for (int e = 0; e < ends; ++e) {
        double sum = 0.0;
        for (int k = 0; k < ends; ++k) sum += weight[k] * map.to_points[k][e];
        basis[e] = sum;
    }
}

// Gram matrix of a derivative over u in [0, 1], by Gauss's rule with 8 nodes through equal powers of Bernstein polynomials.
inline void septic_gram(int order, double *gram) {
    const SepticMap &map = septic_map();
    const int n = 7 - order;
    double rows[ends][ends] = {};  // control points of the derivative of each B_e
    double factor = 1.0;
    for (int i = 0; i < order; ++i) factor *= 7 - i;
    for (int e = 0; e < ends; ++e) {
        for (int k = 0; k < ends; ++k) rows[e][k] = map.to_points[k][e];
        for (int i = 0; i < order; ++i)
            for (int k = 0; k + i < 7; ++k) rows[e][k] = rows[e][k + 1] - rows[e][k];
    }
    for (int e = 0; e < ends; ++e)
        for (int g = 0; g <= e; ++g) {
            double sum = 0.0;
            for (int i = 0; i <= n; ++i)
                for (int j = 0; j <= n; ++j) sum += binomial(n, i) * binomial(n, j) / binomial(2 * n, i + j) * rows[e][i] * rows[g][j];
            gram[end_pair(e, g)] = factor * factor * sum / (2 * n + 1);
        }
}

}  // namespace minsnap

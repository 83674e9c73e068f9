// The pieces of a chain as Bernstein polynomials.
#pragma once

#include "shortest_time/chain.hpp"

namespace minsnap {

// The derivatives of one piece as Bernstein control points.
template <class S>
class PieceCurve {
public:
    static constexpr int ends = 2 * S::half, orders = condition_orders + 2;

    // Control points (ends, dim) of the curve itself come first.
    double points[orders][ends][S::dim];

    PieceCurve(const PieceEnds<S> &piece) {
        static const Map map;
        for (int j = 0; j < ends; ++j)
            for (int c = 0; c < S::dim; ++c) {
                double sum = 0.0;
                for (int a = 0; a < ends; ++a) sum += map.entries[j][a] * piece.e[a * S::dim + c];
                points[0][j][c] = sum;
            }
        for (int q = 1; q < orders; ++q)
            for (int j = 0; j + q < ends; ++j)
                for (int c = 0; c < S::dim; ++c) points[q][j][c] = (ends - q) * (points[q - 1][j + 1][c] - points[q - 1][j][c]);
    }

    // The derivative of an order on the unit interval, times a factor: Bernstein polynomials by nested multiplication.
    template <class Real>
    MINSNAP_INLINE void at(int order, const Real &s, double factor, Real *x) const {
        const int last = ends - 1 - order;
        const Real left = 1.0 - s;
        Real weight = filled<Real>(1.0);
        for (int c = 0; c < S::dim; ++c) x[c] = filled<Real>(last >= 0 ? factor * points[order][0][c] : 0.0);
        for (int j = 1; j <= last; ++j) {
            weight *= s * static_cast<double>(last + 1 - j) / static_cast<double>(j);
            for (int c = 0; c < S::dim; ++c) x[c] = x[c] * left + factor * weight * points[order][j][c];
        }
    }

private:
    struct Map {
        double entries[ends][ends];
        Map() { control_map<S::half>(entries); }
    };
};

}  // namespace minsnap

// How far conditions rise between instants: true peaks beside the largest samples, by Newton's method along the curve.
//
// A peak's rise over its sample becomes a margin of the two rows beside it. Peaks beside the ends of a piece count too.
#pragma once

#include "shortest_time/rows.hpp"

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

    // The derivative of an order on the unit interval, times a factor.
    void at(int order, double s, double factor, double *x) const {
        double values[ends][S::dim];
        for (int j = 0; j + order < ends; ++j)
            for (int c = 0; c < S::dim; ++c) values[j][c] = points[order][j][c];
        for (int last = ends - 1 - order; last > 0; --last)
            for (int j = 0; j < last; ++j)
                for (int c = 0; c < S::dim; ++c) values[j][c] += s * (values[j + 1][c] - values[j][c]);
        for (int c = 0; c < S::dim; ++c) x[c] = order < ends ? factor * values[0][c] : 0.0;
    }

private:
    struct Map {
        double entries[ends][ends];
        Map() { control_map<S::half>(entries); }
    };
};

// Call found(row, beside, rise) for every sampled peak of a piece that lies near its bound: the two rows, and by how much the curve rises over the
// first (0 where the sample is the peak). `value` holds the rows of the piece with their margins.
template <class S, class Found>
inline void each_peak(const Rows<S> &rows, const Chain<S> &chain, int i, const PieceEnds<S> &piece, const double *value, double near,
                      Found &&found) {
    constexpr int count = S::instants, newton_steps = 4;
    constexpr double spacing = 1.0 / (count - 1);
    const PieceCurve<S> curve(piece);
    const int leg = i / chain.per_leg;
    const Condition<S::dim> *condition = rows.legs.begin(leg);
    int row = rows.first[i];
    for (int k = 0; k < rows.legs.count(leg); ++k, ++condition, row += count) {
        const int q = condition->order;
        const auto sample = [&](int g) { return value[row + g] - rows.margin[row + g]; };
        for (int g = 0; g < count; ++g) {
            const double here = sample(g);
            if (here < -near || (g > 0 && sample(g - 1) > here) || (g + 1 < count && sample(g + 1) > here)) continue;
            const double center = Instants<S::half, S::instants>::place(g);
            const double low = g > 0 ? center - spacing : 0.0, high = g + 1 < count ? center + spacing : 1.0;
            double s = center, x[S::dim], first[S::dim], second[S::dim], y[S::dim], base = 0.0, best = 0.0, place = center;
            for (int n = 0; n <= newton_steps; ++n) {
                curve.at(q, s, piece.inverse[q], x);
                curve.at(q + 1, s, piece.inverse[q], first);
                curve.at(q + 2, s, piece.inverse[q], second);
                const double now = condition->at(x, y);
                if (n == 0) base = now;
                if (now - base > best) {
                    best = now - base;
                    place = s;
                }
                double slope = 0.0, bend = condition->bend(first);
                for (int c = 0; c < S::dim; ++c) {
                    slope += y[c] * first[c];
                    bend += y[c] * second[c];
                }
                double moved = bend < 0.0 ? s - slope / bend : slope > 0.0 ? s + 0.5 * spacing : s - 0.5 * spacing;
                moved = moved < low ? low : moved > high ? high : moved;
                if (moved == s) break;
                s = moved;
            }
            const int beside = place > center ? g + 1 : place < center ? g - 1 : g;
            found(*condition, row + g, row + beside, best);
        }
    }
}

}  // namespace minsnap

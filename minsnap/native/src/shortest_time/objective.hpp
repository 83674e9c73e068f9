// What is minimised: the time, a little squared jerk so that the curve is unique, and a pull of neighbouring durations of a leg to the ratio of
// their first split.
#pragma once

#include "shortest_time/chain.hpp"

namespace minsnap {

// The derivative of order half of a piece on the unit interval, and the integral of its square: from control points, since it is tiny beside
// the ends where a piece is short.
template <class S>
struct TopDerivative {
    double weighed[S::half][S::dim];  // control points times the integrals of their products
    double square = 0.0;

    template <class Tables>
    TopDerivative(const double *e, const Tables &tables) {
        double points[S::half][S::dim];
        for (int j = 0; j < S::half; ++j)
            for (int c = 0; c < S::dim; ++c) {
                double sum = tables.derived[j][S::half] * (e[S::knot + c] - e[c]);
                for (int a = 1; a < S::half; ++a)
                    sum += tables.derived[j][a] * e[a * S::dim + c] + tables.derived[j][S::half + a] * e[(S::half + a) * S::dim + c];
                points[j][c] = sum;
            }
        for (int i = 0; i < S::half; ++i)
            for (int c = 0; c < S::dim; ++c) {
                weighed[i][c] = 0.0;
                for (int j = 0; j < S::half; ++j) weighed[i][c] += tables.mass[i][j] * points[j][c];
                square += points[i][c] * weighed[i][c];
            }
    }

    // Of half the integral, in an end derivative.
    template <class Tables>
    double slope(const Tables &tables, int a, int c) const {
        double sum = 0.0;
        for (int j = 0; j < S::half; ++j) sum += tables.derived[j][a] * weighed[j][c];
        return sum;
    }
};

template <class S>
struct TimeObjective {
    double unit = 1.0;            // total time that counts as one [s]
    double sizes[3] = {1, 1, 1};  // of speed, acceleration and jerk that count as large
    double price = 0.0;           // of a second, where the cost counts too
    Buffer<double> ratio;         // (pieces,) log of a duration less that of the next at the split

    static constexpr int smoothed = S::half > 3 ? 3 : S::half - 1;  // order of the derivative whose square is small: jerk

    // Weight of the squared derivative over the unit interval, which goes as T^(1 - 2 order).
    double smoothing(const PieceEnds<S> &piece) const {
        const double size = sizes[smoothed - 1] / piece.inverse[smoothed];
        return ShortestSettings::smoothing * piece.duration / (unit * size * size);
    }
    static constexpr double smoothing_power = 1.0 - 2.0 * smoothed;

    // Weight of the cost, the squared derivative of order half, which goes as T^(1 - 2 half).
    double costing(const PieceEnds<S> &piece) const {
        double weight = 2.0 / (price * unit) * piece.duration;
        for (int q = 0; q < S::half; ++q) weight *= piece.inverse[1] * piece.inverse[1];
        return weight;
    }
    static constexpr double costing_power = 1.0 - 2.0 * S::half;

    // The squared derivative of order half, over time.
    template <class Tables>
    double cost(const PieceEnds<S> &piece, const Tables &tables) const {
        return 0.5 * price * unit * costing(piece) * TopDerivative<S>(piece.e, tables).square;
    }

    double balance(const Chain<S> &chain, int i) const {
        const bool pulled = i + 1 < chain.pieces && i % chain.per_leg != chain.per_leg - 1;
        return pulled ? ShortestSettings::balance / chain.pieces : 0.0;
    }
    double deviation(const Chain<S> &chain, int i) const { return chain.sigma[i] - chain.sigma[i + 1] - ratio[i]; }

    // Share of one piece.
    template <class Tables>
    double value(const Chain<S> &chain, int i, const PieceEnds<S> &piece, const Tables &tables) const {
        const double pull = balance(chain, i), away = pull > 0.0 ? deviation(chain, i) : 0.0;
        const double cost = price > 0.0 ? 0.5 * costing(piece) * TopDerivative<S>(piece.e, tables).square : 0.0;
        return piece.duration / unit + cost + 0.5 * smoothing(piece) * square(piece, tables.gram[smoothed]) + 0.5 * pull * away * away;
    }

private:
    static double square(const PieceEnds<S> &piece, const double *gram) {
        double square = 0.0;
        for (int a = 0, k = 0; a < S::ends; ++a)
            for (int b = 0; b <= a; ++b, ++k) {
                double sum = 0.0;
                for (int c = 0; c < S::dim; ++c) sum += piece.e[a * S::dim + c] * piece.e[b * S::dim + c];
                square += (a == b ? 1.0 : 2.0) * gram[k] * sum;
            }
        return square;
    }
};

}  // namespace minsnap

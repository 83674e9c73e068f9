// What is minimised: the time, a little squared jerk so that the curve is unique, and a pull of neighbouring durations of a leg to the ratio of
// their first split.
#pragma once

#include "shortest_time/chain.hpp"

namespace minsnap {

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

    double balance(const Chain<S> &chain, int i) const {
        const bool pulled = i + 1 < chain.pieces && i % chain.per_leg != chain.per_leg - 1;
        return pulled ? ShortestSettings::balance / chain.pieces : 0.0;
    }
    double deviation(const Chain<S> &chain, int i) const { return chain.sigma[i] - chain.sigma[i + 1] - ratio[i]; }

    // Share of one piece.
    template <class Grams>
    double value(const Chain<S> &chain, int i, const PieceEnds<S> &piece, const Grams &gram) const {
        const double pull = balance(chain, i), away = pull > 0.0 ? deviation(chain, i) : 0.0;
        const double cost = price > 0.0 ? 0.5 * costing(piece) * square(piece, gram[S::half]) : 0.0;
        return piece.duration / unit + cost + 0.5 * smoothing(piece) * square(piece, gram[smoothed]) + 0.5 * pull * away * away;
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

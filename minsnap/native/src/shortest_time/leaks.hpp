// How far conditions rise between instants: true peaks beside the largest samples, by Newton's method along the curve.
//
// A peak's rise over its sample becomes a margin of the two rows beside it. Peaks beside the ends of a piece count too, and those beside samples that are
// barely less than the next one: a curve may fall and rise again between two.
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

    // The derivative of an order on the unit interval, times a factor: Bernstein polynomials by nested multiplication.
    void at(int order, double s, double factor, double *x) const {
        const int last = ends - 1 - order;
        const double left = 1.0 - s;
        double weight = 1.0;
        for (int c = 0; c < S::dim; ++c) x[c] = last >= 0 ? factor * points[order][0][c] : 0.0;
        for (int j = 1; j <= last; ++j) {
            weight *= s * (last + 1 - j) / j;
            for (int c = 0; c < S::dim; ++c) x[c] = x[c] * left + factor * weight * points[order][j][c];
        }
    }

private:
    struct Map {
        double entries[ends][ends];
        Map() { control_map<S::half>(entries); }
    };
};

// A sampled peak of a piece that lies near its bound: its row and that beside it, and by how much the curve rises over the first (0 where the sample
// is the peak).
struct Peak {
    int row, beside;
    double rise;
    bool wall;
};

// Call found(peak) for every one. `value` holds the rows of the piece with their margins.
template <class S, class Found>
class Peaks {
public:
    Peaks(const Rows<S> &rows, const Chain<S> &chain, int i, const PieceEnds<S> &piece, const double *value, Found &found)
        : rows_(rows), piece_(piece), curve_(piece), value_(value), found_(found), row_(rows.first[i]) {
        const int leg = i / chain.per_leg;
        const Condition<S::dim> *condition = rows.legs.begin(leg);
        for (int k = 0; k < rows.legs.count(leg); ++k, ++condition) {
            const int q = condition->order;
            each(q == 0, [&](double s) {
                double x[S::dim], y[S::dim];
                curve_.at(q, s, piece_.inverse[q], x);
                return condition->at(x, y);
            });
        }
        for (int k = 0; k < rows.limit_count; ++k)
            for (int f = 0; f < rows.limits[k].functions; ++f) each(false, [&](double s) { return limited(rows.limits[k], f, s); });
    }

private:
    static constexpr int count = S::instants;

    double limited(const InstantLimit &limit, int function, double s) const {
        double u[InstantLimit::most_inputs], out[InstantLimit::most_functions], x[S::dim];
        for (int q = limit.span.low; q <= limit.span.high; ++q) {
            curve_.at(q, s, piece_.inverse[q], x);
            for (int c = 0; c < limit.axes; ++c) u[(q - limit.span.low) * limit.axes + c] = x[c < S::dim ? c : 0];
        }
        limit.at(u, out);
        return out[function];
    }

    template <class Curve>
    void each(bool wall, Curve &&curve) {
        const auto sample = [&](int g) { return value_[row_ + g] - rows_.margin[row_ + g]; };
        for (int g = 0; g < count; ++g) {
            const double here = sample(g), level = here + ShortestSettings::level;
            if (here < -ShortestSettings::near || (g > 0 && sample(g - 1) > level) || (g + 1 < count && sample(g + 1) > level)) continue;
            rise(g, wall, curve);
        }
        row_ += count;
    }

    // Parabolas through three points around the peak.
    template <class Curve>
    void rise(int g, bool wall, Curve &&curve) {
        constexpr int parabolas = 6;
        constexpr double spacing = 1.0 / (count - 1), apart = 1e-3 * spacing;
        const double center = Instants<S::half, S::instants>::place(g), base = curve(center);
        double x[3] = {g > 0 ? center - spacing : center, center, g + 1 < count ? center + spacing : center};
        if (g == 0) x[1] = 0.5 * spacing;
        if (g + 1 == count) x[1] = 1.0 - 0.5 * spacing;
        double y[3] = {g == 0 ? base : curve(x[0]), g == 0 || g + 1 == count ? curve(x[1]) : base, g + 1 == count ? base : curve(x[2])};
        const double left_of = y[0], right_of = y[2];
        double best = std::max(0.0, y[1] - base), place = best > 0.0 ? x[1] : center;
        for (int n = 0; n < parabolas; ++n) {
            const double left = (y[1] - y[0]) / (x[1] - x[0]), right = (y[2] - y[1]) / (x[2] - x[1]), bend = right - left;
            double s = bend < 0.0 ? 0.5 * (x[0] + x[1]) - 0.5 * left * (x[2] - x[0]) / bend : y[0] > y[2] ? x[0] : x[2];
            if (!(s > x[0] + apart && s < x[2] - apart) || std::abs(s - x[1]) < apart)
                s = x[1] - x[0] > x[2] - x[1] ? x[1] - 0.5 * (x[1] - x[0]) : x[1] + 0.5 * (x[2] - x[1]);
            const double now = curve(s);
            if (now - base > best) {
                best = now - base;
                place = s;
            }
            const bool later = s > x[1];
            if (now > y[1]) {
                const int end = later ? 0 : 2;
                x[end] = x[1], y[end] = y[1];
                x[1] = s, y[1] = now;
            } else {
                x[later ? 2 : 0] = s, y[later ? 2 : 0] = now;
            }
        }
        const double beside = place > center ? right_of : place < center ? left_of : base;  // it may be the higher of the two
        const double rise = std::max(0.0, best - std::max(0.0, beside - base));
        found_(Peak{row_ + g, row_ + (place > center ? g + 1 : place < center ? g - 1 : g), rise, wall});
    }

    const Rows<S> &rows_;
    const PieceEnds<S> &piece_;
    const PieceCurve<S> curve_;
    const double *value_;
    Found &found_;
    int row_;
};

template <class S, class Found>
inline void each_peak(const Rows<S> &rows, const Chain<S> &chain, int i, const PieceEnds<S> &piece, const double *value, Found &&found) {
    Peaks<S, Found>(rows, chain, i, piece, value, found);
}

}  // namespace minsnap

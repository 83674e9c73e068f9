// How far conditions rise between instants: true peaks beside the largest samples, four at a time by parabolas along the curve.
//
// A peak's rise over its sample becomes a margin of the two rows beside it. Peaks beside the ends of a piece count too, and those beside samples that are
// barely less than the next one: a curve may fall and rise again between two.
#pragma once

#include "arithmetic/wide.hpp"
#include "shortest_time/rows.hpp"

namespace minsnap {

// A sampled peak of a piece that lies near its bound: its row and that beside it, and by how much the curve rises over the first (0 where the sample
// is the peak).
struct Peak {
    int row, beside;
    double rise;
    bool wall;
};

// A condition, or one function of a limit, along a piece.
template <class S>
struct RowCurve {
    const PieceCurve<S> &curve;
    const double *inverse;                // T^-q
    const Condition<S::dim> *condition;   // or null
    const InstantLimit *limit = nullptr;  // where there is no condition
    int function = 0;
    const TurningPiece *turning = nullptr;  // of the heading, where the limit asks for one

    MINSNAP_INLINE Quad at(const Quad &s) const {
        Quad x[S::dim], gradient[S::dim], out[InstantLimit::most_functions];
        if (condition != nullptr) {
            curve.at(condition->order, s, inverse[condition->order], x);
            return condition->at(x, gradient);
        }
        all_at(s, out);
        return out[function];
    }

    // All functions of a limit.
    MINSNAP_INLINE void all_at(const Quad &s, Quad *out) const {
        Quad x[S::dim], u[InstantLimit::most_inputs];
        for (int q = limit->span.low; q <= limit->span.high; ++q) {
            curve.at(q, s, inverse[q], x);
            for (int c = 0; c < limit->axes; ++c) u[(q - limit->span.low) * limit->axes + c] = x[c < S::dim ? c : 0];
        }
        if (limit->headed()) {
            turning->at(s, inverse[1], u + limit->inputs());
            if (limit->follows()) follow(u, u + limit->inputs());
        }
        limit->values(u, out);
    }
};

// Peaks of one row around up to four samples: how far they rise over their samples, beside those next to them, and where.
template <class S>
class Rises {
public:
    static constexpr int count = S::instants, together = Lanes<Quad>::count;

    Quad center, place, rise;

    Rises(const RowCurve<S> &curve, const int (&instants)[together]) {
        widely([&]() MINSNAP_INLINED { find(curve, instants); });
    }

private:
    // Parabolas through three points around each peak.
    MINSNAP_INLINE void find(const RowCurve<S> &curve, const int (&instants)[together]) {
        constexpr int parabolas = 6;
        constexpr double spacing = 1.0 / (count - 1), apart = 1e-3 * spacing;
        Quad x[3], y[3], base;
        for (int lane = 0; lane < together; ++lane) {
            const int g = instants[lane];
            const double middle = Instants<S::half, S::instants>::place(g);
            center[lane] = middle;
            x[0][lane] = g > 0 ? middle - spacing : middle;
            x[1][lane] = g == 0 ? 0.5 * spacing : g + 1 == count ? 1.0 - 0.5 * spacing : middle;
            x[2][lane] = g + 1 < count ? middle + spacing : middle;
        }
        for (int k = 0; k < 3; ++k) y[k] = curve.at(x[k]);
        base = x[0] == center ? y[0] : x[2] == center ? y[2] : y[1];
        const Quad zero{}, left_of = y[0], right_of = y[2];
        Quad best = larger(y[1] - base, zero);
        place = best > 0.0 ? x[1] : center;
        for (int n = 0; n < parabolas; ++n) {
            const Quad left = (y[1] - y[0]) / (x[1] - x[0]), right = (y[2] - y[1]) / (x[2] - x[1]), bend = right - left;
            Quad s = bend < 0.0 ? 0.5 * (x[0] + x[1]) - 0.5 * left * (x[2] - x[0]) / bend : y[0] > y[2] ? x[0] : x[2];
            const Quad halved = x[1] - x[0] > x[2] - x[1] ? x[1] - 0.5 * (x[1] - x[0]) : x[1] + 0.5 * (x[2] - x[1]), moved = s - x[1];
            const auto inside = (s > x[0] + apart) & (s < x[2] - apart) & ((moved >= apart) | (moved <= -apart));
            s = inside ? s : halved;
            const Quad now = curve.at(s);
            place = now - base > best ? s : place;
            best = larger(now - base, best);
            const auto later = s > x[1], higher = now > y[1];
            const auto first = higher & later, last = higher & ~later, before = ~higher & ~later, after = ~higher & later;
            x[0] = first ? x[1] : before ? s : x[0], y[0] = first ? y[1] : before ? now : y[0];
            x[2] = last ? x[1] : after ? s : x[2], y[2] = last ? y[1] : after ? now : y[2];
            x[1] = higher ? s : x[1], y[1] = higher ? now : y[1];
        }
        const Quad beside = place > center ? right_of : place < center ? left_of : base;  // it may be the higher of the two
        rise = larger(best - larger(beside - base, zero), zero);
    }

    static MINSNAP_INLINE Quad larger(const Quad &one, const Quad &two) { return one > two ? one : two; }
};

// Call found(peak) for every one. `value` holds the rows of the piece with their margins.
template <class S, class Found>
class Peaks {
public:
    Peaks(const Rows<S> &rows, const Chain<S> &chain, int i, const PieceEnds<S> &piece, const double *value, Found &found)
        : rows_(rows), curve_(piece), value_(value), found_(found), allowed_(rows.allowed(chain, i)), row_(rows.first[i]), first_(row_) {
        const int leg = i / chain.per_leg;
        for (int k = 0; k < rows.legs.count(leg); ++k) {
            const Condition<S::dim> *condition = rows.legs.begin(leg) + k;
            each(condition->order == 0, {curve_, piece.inverse, condition});
        }
        for (int k = 0; k < rows.limit_count; ++k) {
            const InstantLimit &limit = rows.limits[k];
            if (limit.headed()) jumps({curve_, piece.inverse, nullptr, &limit, 0, rows.turning(i)});
            for (int f = 0; f < limit.functions; ++f) each(false, {curve_, piece.inverse, nullptr, &limit, f, rows.turning(i)});
        }
    }

private:
    static constexpr int count = S::instants, together = Rises<S>::together;

    // On both sides of the instants at which a heading begins or ends to turn, its torque may be a peak.
    void jumps(const RowCurve<S> &curve) {
        constexpr double beside = 1e-9;
        double cuts[2];
        for (int next = 0, cut_count; (cut_count = curve.turning->cuts_within(next, cuts)) > 0;) {
            Quad s, out[InstantLimit::most_functions];
            for (int lane = 0; lane < together; ++lane) s[lane] = cuts[std::min(lane / 2, cut_count - 1)] + (lane % 2 ? beside : -beside);
            curve.all_at(s, out);
            for (int lane = 0; lane < 2 * cut_count; ++lane) {
                const int before = std::min(static_cast<int>(s[lane] * (count - 1)), count - 2), g = before + lane % 2;
                for (int f = 0; f < curve.limit->functions; ++f) {
                    const int row = row_ + f * count + g;
                    const double allowed = allowed_ == nullptr ? 0.0 : allowed_[row - first_];
                    const double peak = out[f][lane] + rows_.limit_margin - allowed, rise = peak - (value_[row] - rows_.margin[row]);
                    if (rise > 0.0 && peak > -ShortestSettings::near) found_(Peak{row, row, rise, false});
                }
            }
        }
    }

    void each(bool wall, const RowCurve<S> &curve) {
        const auto sample = [&](int g) { return value_[row_ + g] - rows_.margin[row_ + g]; };
        int peaks[together] = {}, held = 0;
        for (int g = 0; g < count; ++g) {
            const double here = sample(g), level = here + ShortestSettings::level;
            const bool below =
                here < -ShortestSettings::near || (g > 0 && sample(g - 1) > level) || (g + 1 < count && sample(g + 1) > level);
            if (!below) peaks[held++] = g;
            if (held == 0 || (held < together && g + 1 < count)) continue;
            const Rises<S> rises(curve, peaks);
            for (int n = 0; n < held; ++n) {
                const int to = rises.place[n] > rises.center[n] ? 1 : rises.place[n] < rises.center[n] ? -1 : 0;
                found_(Peak{row_ + peaks[n], row_ + peaks[n] + to, rises.rise[n], wall});
            }
            held = 0;
        }
        row_ += count;
    }

    const Rows<S> &rows_;
    const PieceCurve<S> curve_;
    const double *value_;
    Found &found_;
    const double *allowed_;  // or null
    int row_, first_;
};

template <class S, class Found>
inline void each_peak(const Rows<S> &rows, const Chain<S> &chain, int i, const PieceEnds<S> &piece, const double *value, Found &&found) {
    Peaks<S, Found>(rows, chain, i, piece, value, found);
}

}  // namespace minsnap

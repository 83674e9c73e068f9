// From few pieces a leg to more, nearly the same curve. A single piece is cut into parts of which the first and the last are short. Several are cut
// anew, so that the uses of limits change by as much on each: a mesh that is equally distributed over a monitor function (C. de Boor, "Good
// approximation by splines with variable knots", 1973), whose pieces end near where other limits become active.
#pragma once

#include "shortest_time/leaks.hpp"

namespace minsnap {

// Scaled derivatives of a knot from physical ones, or back.
template <class S>
inline void scale_knot(const Chain<S> &chain, int knot, const double *from, double *to, bool back) {
    const int last = chain.pieces - 1, waypoint = knot % chain.per_leg == 0 ? knot / chain.per_leg : -1;
    const bool ring = chain.course.closed;
    const double before = knot > 0 ? chain.sigma[knot - 1] : ring ? chain.sigma[last] : chain.sigma[0];
    const double after = knot <= last ? chain.sigma[knot] : ring ? chain.sigma[0] : chain.sigma[last];
    const double unit = exponential(0.5 * (before + after));
    double power = 1.0;
    for (int q = 0; q < S::half; ++q, power *= unit) {
        const double factor = waypoint >= 0 && !chain.course.any_free(waypoint, q) ? 1.0 : back ? 1.0 / power : power;
        for (int c = 0; c < S::dim; ++c) to[q * S::dim + c] = from[q * S::dim + c] * factor;
    }
}

// The same with positions in the world's axes instead of a waypoint's own.
template <class S>
inline void world_knot(const Chain<S> &chain, int knot, const double *from, double *to) {
    scale_knot(chain, knot, from, to, true);
    Chain<S>::turn(chain.axes_at(knot, 0), to);
}
template <class S>
inline void own_knot(const Chain<S> &chain, int knot, const double *from, double *to) {
    scale_knot(chain, knot, from, to, false);
    const double *axes = chain.axes_at(knot, 0);
    for (int c = 0; axes != nullptr && c < S::dim; ++c) {
        to[c] = 0.0;
        for (int d = 0; d < S::dim; ++d) to[c] += axes[d * S::dim + c] * from[d];
    }
}

// Where a leg is cut anew: shares of its time.
template <class S>
class LegCuts {
public:
    Buffer<double> cuts;    // (parts + 1,)
    Buffer<double> shares;  // (parts,) between them

    [[nodiscard]] bool allocate(int per_leg, int parts) {
        return cuts.allocate(parts + 1) && shares.allocate(parts) && time_.allocate(per_leg * S::instants) &&
               sum_.allocate(per_leg * S::instants);
    }

    // By the values of rows; without them every piece into equal parts, which leaves the curve as it is.
    void find(const Rows<S> &rows, const Chain<S> &chain, const double *value, int leg, int parts) {
        if (chain.per_leg == 1) return part(parts);
        if (value == nullptr) return alike(chain, leg, parts);
        gather(rows, chain, value, leg);
        const bool ramps = !rows.turns_hard();  // a body that turns hard does not reach its limits on ramps
        const bool first = ramps && sharp(chain, leg, parts), last = ramps && sharp(chain, leg + 1, parts);
        const int begin = first ? 1 : 0, end = last ? parts - 1 : parts;
        const double least = 0.02 / parts;
        cuts[0] = 0.0;
        cuts[parts] = 1.0;
        cuts[begin] = first ? ramp : 0.0;
        cuts[end] = last ? 1.0 - ramp : 1.0;
        for (int k = begin + 1, m = 0; k < end; ++k) {
            const double wanted = sum_[count_ - 1] * (k - begin) / (end - begin);
            while (m + 2 < count_ && sum_[m + 1] < wanted) ++m;
            const double place = time_[m] + (time_[m + 1] - time_[m]) * (wanted - sum_[m]) / (sum_[m + 1] - sum_[m]);
            cuts[k] = std::min(std::max(place, cuts[k - 1] + least), cuts[end] - least * (end - k));
        }
        for (int k = 0; k < parts; ++k) shares[k] = cuts[k + 1] - cuts[k];
    }

private:
    static constexpr double outer = 2.0 / 3.0;         // the first and the last part of a single piece, of an equal share
    static constexpr double even = 2.0, ramp = 0.003;  // weight of time beside changes; the leg's share that a ramp takes
    static constexpr double idle = -0.5;               // value of a limit on a norm that is not used
    static constexpr int enough = 6;                   // pieces from which some are spent on ramps

    // Cut a single piece: changes along it say little about those of several.
    void part(int parts) {
        const double end = parts < 3 ? 1.0 / parts : outer / parts, middle = parts < 3 ? end : (1.0 - 2.0 * end) / (parts - 2);
        cuts[0] = 0.0;
        for (int k = 0; k < parts; ++k) {
            shares[k] = k == 0 || k + 1 == parts ? end : middle;
            cuts[k + 1] = cuts[k] + shares[k];
        }
    }

    // Cut every piece into as many equal parts.
    void alike(const Chain<S> &chain, int leg, int parts) {
        const int per = chain.per_leg, each = parts / per;
        double total = 0.0;
        for (int k = 0; k < per; ++k) total += exponential(chain.sigma[leg * per + k]);
        cuts[0] = 0.0;
        for (int k = 0; k < parts; ++k) {
            shares[k] = exponential(chain.sigma[leg * per + k / each]) / (total * each);
            cuts[k + 1] = cuts[k] + shares[k];
        }
    }

    // Where the last derivative of a knot is pinned, at rest above all, a short piece lets it rise at once.
    static bool sharp(const Chain<S> &chain, int waypoint, int parts) {
        return parts >= enough && !chain.course.any_free(waypoint, S::half - 1);
    }

    // Sums of changes up to every instant of the leg, relative times, and how many.
    void gather(const Rows<S> &rows, const Chain<S> &chain, const double *value, int leg) {
        const int begin = leg * chain.per_leg;
        double total = 0.0, begun = 0.0;
        for (int i = begin; i < begin + chain.per_leg; ++i) total += exponential(chain.sigma[i]);
        time_[0] = sum_[0] = 0.0;
        count_ = 1;
        for (int i = begin; i < begin + chain.per_leg; ++i) {
            const double step = exponential(chain.sigma[i]) / (total * (S::instants - 1));
            for (int g = 1; g < S::instants; ++g, ++count_) {
                time_[count_] = begun + g * step;
                sum_[count_] = sum_[count_ - 1] + even * step + change(rows, value, i, leg, g);
            }
            begun += (S::instants - 1) * step;
        }
    }

    // How much the uses of all limits change from the instant before, walls left out.
    double change(const Rows<S> &rows, const double *value, int i, int leg, int g) const {
        const int end = rows.first[i] + rows.sampled(leg);
        int row = rows.first[i];
        for (int k = 0; k < rows.legs.count(leg) && rows.legs.begin(leg)[k].order == 0; ++k) row += S::instants;
        double sum = 0.0;
        for (; row < end; row += S::instants) {
            const double before = value[row + g - 1] - rows.margin[row + g - 1], here = value[row + g] - rows.margin[row + g];
            sum += std::abs(std::max(idle, here) - std::max(idle, before));
        }
        return sum;
    }

    Buffer<double> time_, sum_;
    int count_ = 0;
};

// Cut every leg of `coarse`, whose rows have these values if they are given, into so many times its pieces; `fine` has room for them.
template <class S>
[[nodiscard]] bool divide(const Rows<S> &rows, const double *value, const Chain<S> &coarse, int parts, Chain<S> &fine) {
    const int per = coarse.per_leg, many = per * parts;
    fine.course = coarse.course;
    fine.pieces = coarse.pieces * parts;
    fine.per_leg = many;
    LegCuts<S> found;
    if (!found.allocate(per, many)) return false;
    PieceEnds<S> piece;
    for (int leg = 0; leg < coarse.course.legs; ++leg) {
        found.find(rows, coarse, value, leg, many);
        const double *cuts = found.cuts.data();
        double total = 0.0, begun = 0.0;
        for (int k = 0; k < per; ++k) total += exponential(coarse.sigma[leg * per + k]);
        const double whole = per == 1 ? coarse.sigma[leg] : logarithm(total);
        for (int k = 0, m = 0; k < per; ++k) {
            coarse.ends(leg * per + k, piece);
            const PieceCurve<S> curve(piece);
            const double share = piece.duration / total;
            for (; m < many && (cuts[m] < begun + share || k + 1 == per); ++m) {
                double *knot = fine.w.data() + static_cast<std::size_t>(leg * many + m) * S::knot;
                const double s = std::min(1.0, (cuts[m] - begun) / share);
                for (int q = 0; q < S::half; ++q) curve.at(q, s, piece.inverse[q], knot + q * S::dim);
                fine.sigma[leg * many + m] = whole + logarithm(found.shares[m]);
            }
            begun += share;
        }
    }
    for (int k = 0; k <= coarse.course.legs; ++k)
        scale_knot(coarse, k * per, coarse.w.data() + k * per * S::knot, fine.w.data() + static_cast<std::size_t>(k) * many * S::knot,
                   true);
    for (int k = 0; k <= fine.pieces; ++k) scale_knot(fine, k, fine.w.data() + k * S::knot, fine.w.data() + k * S::knot, false);
    return true;
}

}  // namespace minsnap

// From few pieces a leg to more: the same curve, every piece cut into parts of which the first and the last are short.
#pragma once

#include "shortest_time/leaks.hpp"

namespace minsnap {

// Share of a piece that part k of so many takes.
inline double part_share(int k, int parts) {
    constexpr double outer = 2.0 / 3.0;  // of an equal share
    if (parts < 3) return 1.0 / parts;
    const double end = outer / parts;
    return k == 0 || k + 1 == parts ? end : (1.0 - 2.0 * end) / (parts - 2);
}

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

// Cut every piece of `coarse` into parts; `fine` has room for them.
template <class S>
inline void divide(const Chain<S> &coarse, int parts, Chain<S> &fine) {
    fine.course = coarse.course;
    fine.pieces = coarse.pieces * parts;
    fine.per_leg = coarse.per_leg * parts;
    PieceEnds<S> piece;
    for (int i = 0; i < coarse.pieces; ++i) {
        coarse.ends(i, piece);
        const PieceCurve<S> curve(piece);
        double s = 0.0;
        for (int k = 0; k < parts; ++k) {
            double *knot = fine.w.data() + static_cast<std::size_t>(i * parts + k) * S::knot;
            for (int q = 0; q < S::half; ++q) curve.at(q, s, piece.inverse[q], knot + q * S::dim);
            fine.sigma[i * parts + k] = coarse.sigma[i] + logarithm(part_share(k, parts));
            s += part_share(k, parts);
        }
    }
    for (int k = 0; k <= coarse.pieces; ++k)
        scale_knot(coarse, k, coarse.w.data() + k * S::knot, fine.w.data() + static_cast<std::size_t>(k) * parts * S::knot, true);
    for (int k = 0; k <= fine.pieces; ++k) scale_knot(fine, k, fine.w.data() + k * S::knot, fine.w.data() + k * S::knot, false);
}

}  // namespace minsnap

// The unknowns: logarithms of the durations of all pieces, and derivatives at knots times a power of time, as lengths.
//
// A free derivative of order q at a knot is searched as w = z (T_left T_right)^(q/2), at a free end of the chain as z T^q; pinned ones stay as
// they are. The end derivatives of a piece on its unit interval are then e = w exp(own * s_i + other * s_neighbour) with s = log T.
#pragma once

#include <cmath>

#include "arithmetic/elementary.hpp"
#include "basics/buffer.hpp"
#include "shortest_time/border.hpp"
#include "shortest_time/instants.hpp"

namespace minsnap {

// What does not change during a search.
template <class S>
struct Course {
    int legs = 0;
    bool closed = false, moving = false, timed = false;  // timed: durations stay as they are
    double total = 0.0;                                  // of all durations, where it is given [s]
    const std::int64_t *free = nullptr;                  // (legs + 1, half, dim)
    const double *turned = nullptr;                      // (legs + 1, dim, dim)

    // The axes of a waypoint's position, by rows of the world's coordinates; null where they are the world's.
    const double *axes(int waypoint) const {
        if (turned == nullptr || waypoint < 0) return nullptr;
        const double *found = turned + waypoint * S::dim * S::dim;
        double size = 0.0;
        for (int k = 0; k < S::dim * S::dim; ++k) size += std::abs(found[k]);
        return size > 0.0 ? found : nullptr;
    }

    bool is_free(int waypoint, int entry) const { return free[waypoint * S::knot + entry] != 0; }
    bool any_free(int waypoint, int order) const {
        bool found = false;
        for (int c = 0; c < S::dim; ++c) found = found || is_free(waypoint, order * S::dim + c);
        return found;
    }
};

// Ends of one piece, and how they depend on the unknowns.
template <class S>
struct PieceEnds {
    double e[S::whole];                   // by end derivative, then by axis
    double scale[S::ends];                // from scaled knot derivatives
    double own[S::ends], other[S::ends];  // powers of the durations of this piece and of the neighbour at that side
    static constexpr int powers = S::half > condition_orders ? S::half : condition_orders;
    double duration, inverse[powers];  // T, and T^-q
};

template <class S>
class Chain {
public:
    Course<S> course;
    int pieces = 0, per_leg = 1;
    Buffer<double> sigma, w;  // (pieces,), (pieces + 1, half, dim)

    [[nodiscard]] bool allocate(int most) { return sigma.allocate(most) && w.allocate(static_cast<std::size_t>(most + 1) * S::knot); }

    void copy(const Chain &from) {
        course = from.course;
        pieces = from.pieces;
        per_leg = from.per_leg;
        for (int i = 0; i < pieces; ++i) sigma[i] = from.sigma[i];
        for (int j = 0; j < (pieces + 1) * S::knot; ++j) w[j] = from.w[j];
    }

    // Whether the time is given, so that the cost is what is minimised.
    bool held() const { return course.timed || course.total > 0.0; }

    // Whether knots k of the search may move there.
    bool varies(int knot, int entry) const {
        if (course.closed && knot == pieces) knot = 0;
        return knot % per_leg != 0 || course.is_free(knot / per_leg, entry);
    }

    double total() const {
        double sum = 0.0;
        for (int i = 0; i < pieces; ++i) sum += exponential(sigma[i]);
        return sum;
    }

    // Slow by a factor; where the total is given, come back to it.
    void slow(double factor) {
        const double change = logarithm(course.total > 0.0 ? course.total / total() : factor);
        for (int i = 0; i < pieces; ++i) sigma[i] += change;
    }

    int before(int i) const { return i > 0 ? i - 1 : course.closed ? pieces - 1 : -1; }
    int after(int i) const { return i + 1 < pieces ? i + 1 : course.closed ? 0 : -1; }

    void ends(int i, PieceEnds<S> &piece) const {
        piece.duration = exponential(sigma[i]);
        piece.inverse[0] = 1.0;
        for (int q = 1; q < PieceEnds<S>::powers; ++q) piece.inverse[q] = piece.inverse[q - 1] / piece.duration;
        side(i, 0, before(i), piece);
        side(i, 1, after(i), piece);
    }

    // Powers of the two durations in each derivative at one side, and what they make of the knot.
    void side(int i, int right, int neighbour, PieceEnds<S> &piece) const {
        const int knot = i + right, waypoint = knot % per_leg == 0 ? knot / per_leg : -1;
        const double *from = w.data() + static_cast<std::size_t>(course.closed && knot == pieces ? 0 : knot) * S::knot;
        const double ratio = neighbour < 0 ? 1.0 : exponential(0.5 * (sigma[i] - sigma[neighbour]));
        double shared = 1.0, physical = 1.0;
        for (int q = 0; q < S::half; ++q, shared *= ratio, physical *= piece.duration) {
            const int a = right * S::half + q;
            const bool pinned = waypoint >= 0 && !course.any_free(waypoint, q);
            piece.scale[a] = pinned ? physical : shared;
            piece.own[a] = pinned ? q : neighbour < 0 ? 0.0 : 0.5 * q;
            piece.other[a] = pinned || neighbour < 0 ? 0.0 : -0.5 * q;
            for (int c = 0; c < S::dim; ++c) piece.e[a * S::dim + c] = from[q * S::dim + c] * piece.scale[a];
        }
        turn(course.axes(waypoint), piece.e + right * S::knot);
    }

    // From a waypoint's own axes to the world's.
    static void turn(const double *axes, double *position) {
        if (axes == nullptr) return;
        double own[S::dim];
        for (int c = 0; c < S::dim; ++c) own[c] = position[c];
        for (int c = 0; c < S::dim; ++c) {
            position[c] = 0.0;
            for (int d = 0; d < S::dim; ++d) position[c] += axes[c * S::dim + d] * own[d];
        }
    }
    const double *axes_at(int i, int right) const { return (i + right) % per_leg == 0 ? course.axes((i + right) / per_leg) : nullptr; }

    // Change of the ends of a piece along a step in the unknowns; `step` holds (pieces,) and (pieces + 1, half, dim).
    void change(int i, const PieceEnds<S> &piece, const double *durations, const double *knots, double *changed) const {
        for (int right = 0; right < 2; ++right) {
            const int neighbour = right ? after(i) : before(i), knot = course.closed && i + right == pieces ? 0 : i + right;
            const double beside = neighbour < 0 ? 0.0 : durations[neighbour];
            for (int q = 0; q < S::half; ++q) {
                const int a = right * S::half + q;
                const double rate = piece.own[a] * durations[i] + piece.other[a] * beside;
                for (int c = 0; c < S::dim; ++c)
                    changed[a * S::dim + c] = rate * piece.e[a * S::dim + c] + piece.scale[a] * knots[knot * S::knot + q * S::dim + c];
            }
            turn(axes_at(i, right), changed + right * S::knot);
        }
    }
};

}  // namespace minsnap

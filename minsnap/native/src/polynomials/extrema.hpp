// The greatest value of polynomials on [0, 1], proved: by the convex hull of control points and halving.
//
// The largest control point bounds a polynomial from above, its end points from below; halving makes the two meet
// quadratically fast (J. M. Lane and R. F. Riesenfeld, "Bounds on a polynomial", BIT 21, 1981). A part that is concave
// but for rounding is settled sooner: by Taylor's theorem at a point s,
//     p(t) <= p(s) + p'(s) (t - s) + max(0, max p'') (t - s)^2 / 2,
// and Newton's method finds an s where the slope vanishes. Every control point carries a bound on its error.
#pragma once

#include <cstdint>

#include "arithmetic/rounding.hpp"

namespace minsnap {

constexpr int max_scalar_degree = 128;

// What is known of a maximum: it is at least `attained`, at row and s, and never more than `bound`.
struct Greatest {
    double attained;
    double bound;
    double s;
    std::int64_t row;

    void attain(double value, double where, std::int64_t which) {
        if (value <= attained) return;
        attained = value;
        s = where;
        row = which;
    }
    void admit(double upper) {
        if (upper > bound) bound = upper;
    }
    // Whether an upper bound is as good as attained: what is left comes from rounding.
    bool reaches(double upper) const { return is_as_good(attained, upper); }
    static bool is_as_good(double attained, double upper) { return upper <= attained + 16.0 * unit * std::fabs(attained); }
};

// Degree is the polynomials' degree n where it is known to the compiler, or -1 where it is at most Most.
template <int Degree, int Most = Degree < 0 ? max_scalar_degree : Degree>
class Climb {
public:
    explicit Climb(int degree) : degree_(degree) {}

    // Raise what is known by one more polynomial: n + 1 control points c with errors e.
    void raise(Greatest &best, const double *c, const double *e, std::int64_t row) {
        own_ = -__builtin_huge_val();
        if (settled_by_hull(best, c, e, 0.0, 1.0, row)) return;
        parts_ = 1;
        Part &whole = stack_[0];
        whole.low = 0.0;
        whole.width = 1.0;
        for (int j = 0; j <= n(); ++j) {
            whole.c[j] = c[j];
            whole.e[j] = e[j];
        }
        int halved = 0;
        while (parts_ > 0) {
            Part &part = stack_[parts_ - 1];
            if (settled_by_tangent(best, part, row)) {
                --parts_;
            } else if (parts_ > depth || ++halved > most_halved) {
                best.admit(hull(part.c, part.e));
                --parts_;
            } else {
                halve(best, row);
            }
        }
    }

private:
    static constexpr int size = Most + 1;
    static constexpr int depth = 44;
    static constexpr int most_halved = 4096;  // where a polynomial is level but for rounding, halving would not end

    struct Part {
        double low, width;
        double c[size], e[size];
    };

    int n() const { return Degree < 0 ? degree_ : Degree; }

    double hull(const double *c, const double *e) const {
        double highest = above(c[0], e[0]);
        for (int j = 1; j <= n(); ++j) {
            const double value = above(c[j], e[j]);
            if (value > highest) highest = value;
        }
        return highest;
    }

    void attain(Greatest &best, double value, double where, std::int64_t row) {
        if (value > own_) own_ = value;
        best.attain(value, where, row);
    }

    // Give a part up for whose values there is a proved bound, and one that leaves its rounding out: no finer part can
    // be told from the latter.
    bool settled(Greatest &best, double core, double bound) const {
        if (!best.reaches(bound) && !Greatest::is_as_good(own_, core)) return false;
        best.admit(bound);
        return true;
    }

    bool settled_by_hull(Greatest &best, const double *c, const double *e, double low, double width, std::int64_t row) {
        attain(best, below(c[0], e[0]), low, row);
        attain(best, below(c[n()], e[n()]), low + width, row);
        double core = c[0] - 3.0 * e[0];
        for (int j = 1; j <= n(); ++j) {
            const double value = c[j] - 3.0 * e[j];
            if (value > core) core = value;
        }
        return best.reaches(core) && settled(best, core, hull(c, e));
    }

    // Place of the top of a concave part that rises and falls, by Newton's method on the derivative.
    double top(const double *c) const {
        const double rise = c[1] - c[0], fall = c[n() - 1] - c[n()];
        double s = rise / (rise + fall);
        for (int step = 0; step < 6; ++step) {
            double q[size];
            for (int j = 0; j <= n(); ++j) q[j] = c[j];
            for (int level = 1; level <= n() - 2; ++level) {
                for (int j = 0; j <= n() - level; ++j) q[j] += s * (q[j + 1] - q[j]);
            }
            const double first = q[1] - q[0], second = q[2] - q[1], bend = second - first;
            if (!(bend < 0.0)) break;
            const double change = -(first + s * bend) / ((n() - 1) * bend);
            s += change;
            if (!(s > 0.0)) s = 0.0;
            if (s > 1.0) s = 1.0;
            if (std::fabs(change) < 1e-8) break;
        }
        return s;
    }

    // An upper bound, at least zero, on the second derivative over n (n - 1), or -1 where a part is certainly not concave.
    double bend(const Part &part) const {
        double largest = 0.0;
        for (int j = 0; j + 2 <= n(); ++j) {
            const double first = part.c[j + 1] - part.c[j], second = part.c[j + 2] - part.c[j + 1];
            const double value = second - first;
            const double error =
                part.e[j] + 2.0 * part.e[j + 1] + part.e[j + 2] + unit * (std::fabs(first) + std::fabs(second) + std::fabs(value));
            if (value > 2.0 * error) return -1.0;
            if (value + error > largest) largest = value + error;
        }
        return above(largest, unit * largest);
    }

    bool settled_by_tangent(Greatest &best, const Part &part, std::int64_t row) {
        const double *c = part.c;
        if (n() < 2 || !(c[1] > c[0]) || !(c[n() - 1] > c[n()])) return false;
        const double curvature = bend(part);
        if (curvature < 0.0) return false;
        const double s = top(c);
        double q[size], e[size];
        for (int j = 0; j <= n(); ++j) {
            q[j] = c[j];
            e[j] = part.e[j];
        }
        for (int level = 1; level < n(); ++level) step(q, e, n() - level, s);
        const double slope = std::fabs(q[1] - q[0]), slope_error = e[0] + e[1] + unit * slope;
        step(q, e, 0, s);
        attain(best, below(q[0], e[0]), part.low + s * part.width, row);
        const double away = s > 0.5 ? s : 1.0 - s;
        const double excess = n() * (slope * away + 0.5 * (n() - 1) * curvature * away * away);
        return settled(best, q[0] + excess - 4.0 * n() * (e[0] + slope_error), above(q[0], e[0] + n() * slope_error * away + excess));
    }

    // One level of de Casteljau's algorithm at s: fl(a + fl(s fl(b - a))) is off by at most u |result| + 3 u s |b - a|.
    static void step(double *q, double *e, int last, double s) {
        const double rest = 1.0 - s;
        for (int j = 0; j <= last; ++j) {
            const double climb = s * (q[j + 1] - q[j]);
            q[j] += climb;
            e[j] = rest * e[j] + s * e[j + 1] + unit * (3.0 * std::fabs(climb) + std::fabs(q[j]));
        }
    }

    // Replace the last part by those of its halves that are not settled. Halving itself is exact, so the mean of two
    // control points is off by at most u |mean|.
    void halve(Greatest &best, std::int64_t row) {
        Part &right = stack_[parts_ - 1];
        Part &left = stack_[parts_];
        for (int level = 1; level <= n(); ++level) {
            left.c[level - 1] = right.c[0];
            left.e[level - 1] = right.e[0];
            for (int j = 0; j <= n() - level; ++j) {
                right.c[j] = 0.5 * (right.c[j] + right.c[j + 1]);
                right.e[j] = 0.5 * (right.e[j] + right.e[j + 1]) + unit * std::fabs(right.c[j]);
            }
        }
        left.c[n()] = right.c[0];
        left.e[n()] = right.e[0];
        left.low = right.low;
        left.width = right.width = 0.5 * right.width;
        right.low += right.width;
        const bool rest = !settled_by_hull(best, left.c, left.e, left.low, left.width, row);
        if (!settled_by_hull(best, right.c, right.e, right.low, right.width, row)) {
            parts_ += rest;
        } else if (rest) {
            right = left;
        } else {
            --parts_;
        }
    }

    int degree_;
    int parts_ = 0;
    double own_ = 0.0;  // what the polynomial at hand attains
    Part stack_[depth + 2];
};

}  // namespace minsnap

// Local maxima of one polynomial on [0, 1], to working precision: control points whose differences change their sign
// at most once have at most one extremum between them (the variation diminishing property: R. T. Farouki, "The
// Bernstein polynomial basis: a centennial retrospective", Computer Aided Geometric Design 29, 2012); others are halved.
#pragma once

#include <cmath>

#include "polynomials/extrema.hpp"

namespace minsnap {

class Summits {
public:
    explicit Summits(int degree) : n_(degree) {}

    // Call found(s, value) for every local maximum higher than `level`, from left to right; false if it returns false.
    template <class Found>
    bool each(const double *c, double level, Found found) {
        Part *top = stack_;
        top->low = 0.0;
        top->width = 1.0;
        for (int j = 0; j <= n_; ++j) top->c[j] = c[j];
        rising_ = true;  // so that a maximum at 0 is seen where the polynomial falls
        for (int parts = 1; parts > 0;) {
            Part &part = stack_[parts - 1];
            if (parts <= depth && highest(part) > level && turns(part) > 1) {
                halve(part, stack_[parts]);
                ++parts;
                continue;
            }
            if (!visit(part, level, found)) return false;
            --parts;
        }
        if (rising_ && c[n_] > level) return found(1.0, c[n_]);
        return true;
    }

private:
    static constexpr int depth = 44;

    struct Part {
        double low, width;
        double c[max_scalar_degree + 1];
    };

    double highest(const Part &part) const {
        double value = part.c[0];
        for (int j = 1; j <= n_; ++j) value = part.c[j] > value ? part.c[j] : value;
        return value;
    }

    // How often the differences of the control points change their sign.
    int turns(const Part &part) const {
        int count = 0;
        double before = 0.0;
        for (int j = 0; j < n_; ++j) {
            const double rise = part.c[j + 1] - part.c[j];
            if (rise == 0.0) continue;
            count += before * rise < 0.0;
            before = rise > 0.0 ? 1.0 : -1.0;
        }
        return count;
    }

    // Tell the maximum at the left end, if the polynomial rose until there and falls from there, and the one inside.
    template <class Found>
    bool visit(const Part &part, double level, Found &found) {
        if (!(highest(part) > level)) {
            rising_ = false;
            return true;
        }
        int first = 0, last = n_ - 1;
        while (first < n_ && part.c[first + 1] == part.c[first]) ++first;
        if (first == n_) return true;  // constant here: the maximum is told where it falls, or at the end
        while (part.c[last + 1] == part.c[last]) --last;
        const bool starts_up = part.c[first + 1] > part.c[first], ends_up = part.c[last + 1] > part.c[last];
        if (rising_ && !starts_up && part.c[0] > level && !found(part.low, part.c[0])) return false;
        rising_ = ends_up;
        if (!starts_up || ends_up) return true;
        double value = 0.0;
        const double s = top(part.c, value);
        return !(value > level) || found(part.low + s * part.width, value);
    }

    // The one place inside where the slope turns from positive to negative: Newton's method, kept between bounds.
    double top(const double *c, double &value) const {
        double low = 0.0, high = 1.0, s = 0.5;
        for (int step = 0; step < 60; ++step) {
            double q[max_scalar_degree + 1];
            for (int j = 0; j <= n_; ++j) q[j] = c[j];
            for (int level = 1; level <= n_ - 2; ++level) {
                for (int j = 0; j <= n_ - level; ++j) q[j] += s * (q[j + 1] - q[j]);
            }
            const double first = q[1] - q[0], bend = q[2] - q[1] - first, slope = first + s * bend;
            const double left = q[0] + s * first, right = q[1] + s * (q[2] - q[1]);
            value = left + s * (right - left);
            (slope > 0.0 ? low : high) = s;
            double next = s - slope / ((n_ - 1) * bend);
            if (!(bend < 0.0 && next >= low && next <= high)) next = 0.5 * (low + high);
            const double change = std::fabs(next - s);
            s = next;
            if (change < 1e-13) break;
        }
        return s;
    }

    // The left half goes on top of the stack, so that parts come from left to right.
    void halve(Part &whole, Part &left) const {
        for (int level = 1; level <= n_; ++level) {
            left.c[level - 1] = whole.c[0];
            for (int j = 0; j <= n_ - level; ++j) whole.c[j] = 0.5 * (whole.c[j] + whole.c[j + 1]);
        }
        left.c[n_] = whole.c[0];
        left.low = whole.low;
        left.width = whole.width = 0.5 * whole.width;
        whole.low += whole.width;
    }

    int n_;
    bool rising_ = true;
    Part stack_[depth + 2];
};

}  // namespace minsnap

// Nesterov-Todd scaling of half-lines and second-order cones.
//
// For s and z inside a cone there is one symmetric W with W z = W^-1 s = lambda (Y. Nesterov and M. Todd, "Self-scaled
// barriers and interior-point methods for convex programming", 1997). For a second-order cone
//
//     W = eta [ w0  w1'                   ]     w'Jw = 1,     W^-2 = (2 (Jw)(Jw)' - J) / eta^2
//             [ w1  1 + w1 w1' / (1 + w0) ]
//
// as in L. Vandenberghe, "The CVXOPT linear and quadratic cone program solvers", 2010. A half-line is the case of one
// component with w0 = 1. The product of the algebra is u o v = (u'v, u0 v1 + v0 u1).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "lanes.hpp"

namespace minsnap {

MINSNAP_INLINE double tail_product(const double *u, const double *v, std::size_t count) {
    double sum = 0.0;
    for (std::size_t i = 1; i < count; ++i) sum += u[i] * v[i];
    return sum;
}

// u0^2 - |u1|^2, without cancellation.
MINSNAP_INLINE double cone_determinant(const double *u, std::size_t count) {
    const double norm = count == 1 ? 0.0 : std::sqrt(tail_product(u, u, count));
    return (u[0] - norm) * (u[0] + norm);
}

struct ConeScaling {
    double eta;
    double *w;       // count
    double *lambda;  // count

    // Find the scaling of a pair inside the cone; false where it is not.
    [[nodiscard]] MINSNAP_INLINE bool set(const double *s, const double *z, std::size_t count) {
        if (!(s[0] > 0.0) || !(z[0] > 0.0)) return false;
        if (count == 1) {
            eta = std::sqrt(s[0] / z[0]);
            w[0] = 1.0;
            lambda[0] = eta * z[0];
            return true;
        }
        const double size_s = std::sqrt(cone_determinant(s, count)), size_z = std::sqrt(cone_determinant(z, count));
        if (!(size_s > 0.0) || !(size_z > 0.0)) return false;
        eta = std::sqrt(size_s / size_z);
        const double product = s[0] * z[0] + tail_product(s, z, count);
        const double twice = 2.0 * std::sqrt(0.5 * (1.0 + product / (size_s * size_z)));
        const double first = 1.0 / (size_s * twice), second = 1.0 / (size_z * twice);
        w[0] = s[0] * first + z[0] * second;
        for (std::size_t i = 1; i < count; ++i) w[i] = s[i] * first - z[i] * second;
        multiply(z, lambda, count);
        return true;
    }

    // W u
    MINSNAP_INLINE void multiply(const double *u, double *out, std::size_t count) const { apply(u, out, count, 1.0, eta); }

    // W^-1 u
    MINSNAP_INLINE void divide(const double *u, double *out, std::size_t count) const { apply(u, out, count, -1.0, 1.0 / eta); }

    // W^2 u = eta^2 (2 w w' - J) u
    MINSNAP_INLINE void square(const double *u, double *out, std::size_t count) const {
        const double size = eta * eta, twice = 2.0 * (w[0] * u[0] + tail_product(w, u, count)), first = u[0];
        for (std::size_t i = 1; i < count; ++i) out[i] = size * (twice * w[i] + u[i]);
        out[0] = count == 1 ? size * first : size * (twice * w[0] - first);
    }

    // W^-2 u = (2 (Jw)(Jw)' - J) u / eta^2
    MINSNAP_INLINE void divide_square(const double *u, double *out, std::size_t count) const {
        const double size = 1.0 / (eta * eta), twice = 2.0 * (w[0] * u[0] - tail_product(w, u, count)), first = u[0];
        for (std::size_t i = 1; i < count; ++i) out[i] = size * (u[i] - twice * w[i]);
        out[0] = count == 1 ? size * first : size * (twice * w[0] - first);
    }

private:
    MINSNAP_INLINE void apply(const double *u, double *out, std::size_t count, double sign, double size) const {
        if (count == 1) {
            out[0] = size * u[0];
            return;
        }
        const double along = tail_product(w, u, count), first = u[0];
        const double share = sign * first + along / (1.0 + w[0]);
        for (std::size_t i = 1; i < count; ++i) out[i] = size * (u[i] + w[i] * share);
        out[0] = size * (w[0] * first + sign * along);
    }
};

// Solve lambda o u = r.
MINSNAP_INLINE void cone_quotient(const double *lambda, const double *r, double *u, std::size_t count) {
    if (count == 1) {
        u[0] = r[0] / lambda[0];
        return;
    }
    const double along = tail_product(lambda, r, count), share = 1.0 / lambda[0];
    const double first = (lambda[0] * r[0] - along) / cone_determinant(lambda, count);
    for (std::size_t i = 1; i < count; ++i) u[i] = (r[i] - first * lambda[i]) * share;
    u[0] = first;
}

// By how much the first component must grow for u to lie on the cone; negative inside.
MINSNAP_INLINE double cone_depth(const double *u, std::size_t count) {
    return count == 1 ? -u[0] : std::sqrt(tail_product(u, u, count)) - u[0];
}

// Whether u + step d is inside.
MINSNAP_INLINE bool cone_holds(const double *u, const double *d, std::size_t count, double step) {
    const double first = u[0] + step * d[0];
    double sum = 0.0;
    for (std::size_t i = 1; i < count; ++i) sum += (u[i] + step * d[i]) * (u[i] + step * d[i]);
    return first > 0.0 && sum < first * first;
}

// Largest step in [0, most] for which u + step d stays in the cone, u inside.
MINSNAP_INLINE double cone_step(const double *u, const double *d, std::size_t count, double most) {
    if (count == 1) return u[0] + most * d[0] < 0.0 ? -u[0] / d[0] : most;
    if (cone_holds(u, d, count, most)) return most;
    const double a = cone_determinant(d, count), c = cone_determinant(u, count);
    const double b = u[0] * d[0] - tail_product(u, d, count);
    double step = most;
    if (d[0] < 0.0) step = std::min(step, -u[0] / d[0]);
    const double root = b * b - a * c;
    if (root >= 0.0 && (a < 0.0 || b < 0.0)) {
        const double crossing = c / (std::sqrt(root) - b);
        if (crossing > 0.0) step = std::min(step, crossing);
    }
    return step;
}

}  // namespace minsnap

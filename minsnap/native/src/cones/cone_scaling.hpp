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

#include "arithmetic/lanes.hpp"

namespace minsnap {

MINSNAP_INLINE double square_root(double x) { return std::sqrt(x); }
MINSNAP_INLINE Quad square_root(Quad x) {
    for (int lane = 0; lane < 4; ++lane) x[lane] = std::sqrt(x[lane]);
    return x;
}

// Whether something holds in every lane.
MINSNAP_INLINE bool all(bool holds) { return holds; }
MINSNAP_INLINE bool all(decltype(Quad{} < Quad{}) holds) { return (holds[0] & holds[1] & holds[2] & holds[3]) != 0; }

template <class Real>
MINSNAP_INLINE Real tail_product(const Real *u, const Real *v, std::size_t count) {
    Real sum{};
    for (std::size_t i = 1; i < count; ++i) sum += u[i] * v[i];
    return sum;
}

// u0^2 - |u1|^2, without cancellation.
template <class Real>
MINSNAP_INLINE Real cone_determinant(const Real *u, std::size_t count) {
    const Real norm = count == 1 ? Real{} : square_root(tail_product(u, u, count));
    return (u[0] - norm) * (u[0] + norm);
}

// Solve lambda o u = r.
template <class Real>
MINSNAP_INLINE void cone_quotient(const Real *lambda, const Real *r, Real *u, std::size_t count) {
    if (count == 1) {
        u[0] = r[0] / lambda[0];
        return;
    }
    const Real along = tail_product(lambda, r, count), share = 1.0 / lambda[0];
    const Real first = (lambda[0] * r[0] - along) / cone_determinant(lambda, count);
    for (std::size_t i = 1; i < count; ++i) u[i] = (r[i] - first * lambda[i]) * share;
    u[0] = first;
}

// Of one cone, or of one in every lane.
template <class Real>
struct Scaling {
    Real eta;
    Real *w;       // count
    Real *lambda;  // count

    // Find the scaling of a pair inside the cone; false where it is not.
    [[nodiscard]] MINSNAP_INLINE bool set(const Real *s, const Real *z, std::size_t count) {
        const Real zero{};
        if (!all(s[0] > zero) || !all(z[0] > zero)) return false;
        if (count == 1) {
            eta = square_root(s[0] / z[0]);
            w[0] = filled<Real>(1.0);
            lambda[0] = eta * z[0];
            return true;
        }
        const Real size_s = square_root(cone_determinant(s, count)), size_z = square_root(cone_determinant(z, count));
        if (!all(size_s > zero) || !all(size_z > zero)) return false;
        eta = square_root(size_s / size_z);
        const Real product = s[0] * z[0] + tail_product(s, z, count);
        const Real twice = 2.0 * square_root(0.5 * (1.0 + product / (size_s * size_z)));
        const Real first = 1.0 / (size_s * twice), second = 1.0 / (size_z * twice);
        w[0] = s[0] * first + z[0] * second;
        for (std::size_t i = 1; i < count; ++i) w[i] = s[i] * first - z[i] * second;
        multiply(z, lambda, count);
        return true;
    }

    // W u
    MINSNAP_INLINE void multiply(const Real *u, Real *out, std::size_t count) const { apply(u, out, count, 1.0, eta); }

    // W^-1 u
    MINSNAP_INLINE void divide(const Real *u, Real *out, std::size_t count) const { apply(u, out, count, -1.0, 1.0 / eta); }

    // W^2 u = eta^2 (2 w w' - J) u
    MINSNAP_INLINE void square(const Real *u, Real *out, std::size_t count) const {
        const Real size = eta * eta, twice = 2.0 * (w[0] * u[0] + tail_product(w, u, count)), first = u[0];
        for (std::size_t i = 1; i < count; ++i) out[i] = size * (twice * w[i] + u[i]);
        out[0] = count == 1 ? size * first : size * (twice * w[0] - first);
    }

    // W^-2 u = (2 (Jw)(Jw)' - J) u / eta^2
    MINSNAP_INLINE void divide_square(const Real *u, Real *out, std::size_t count) const {
        const Real size = 1.0 / (eta * eta), twice = 2.0 * (w[0] * u[0] - tail_product(w, u, count)), first = u[0];
        for (std::size_t i = 1; i < count; ++i) out[i] = size * (u[i] - twice * w[i]);
        out[0] = count == 1 ? size * first : size * (twice * w[0] - first);
    }

    // W (lambda \ (center e - lambda o lambda - (W^-1 ds) o (W dz))), with room for three.
    MINSNAP_INLINE void correct(double center, const Real *ds, const Real *dz, Real *out, Real *a, Real *b, Real *right,
                                std::size_t count) const {
        divide(ds, a, count);
        multiply(dz, b, count);
        right[0] = center - lambda[0] * lambda[0] - tail_product(lambda, lambda, count) - a[0] * b[0] - tail_product(a, b, count);
        for (std::size_t i = 1; i < count; ++i) right[i] = -2.0 * lambda[0] * lambda[i] - a[0] * b[i] - b[0] * a[i];
        cone_quotient(lambda, right, a, count);
        multiply(a, out, count);
    }

private:
    MINSNAP_INLINE void apply(const Real *u, Real *out, std::size_t count, double sign, Real size) const {
        if (count == 1) {
            out[0] = size * u[0];
            return;
        }
        const Real along = tail_product(w, u, count), first = u[0];
        const Real share = sign * first + along / (1.0 + w[0]);
        for (std::size_t i = 1; i < count; ++i) out[i] = size * (u[i] + w[i] * share);
        out[0] = size * (w[0] * first + sign * along);
    }
};

using ConeScaling = Scaling<double>;

// By how much the first component must grow for u to lie on the cone; negative inside.
MINSNAP_INLINE double cone_depth(const double *u, std::size_t count) {
    return count == 1 ? -u[0] : std::sqrt(tail_product(u, u, count)) - u[0];
}

// Whether u + step d is inside.
template <class Real>
MINSNAP_INLINE auto cone_holds(const Real *u, const Real *d, std::size_t count, double step) {
    const Real first = u[0] + step * d[0], zero{};
    Real sum{};
    for (std::size_t i = 1; i < count; ++i) sum += (u[i] + step * d[i]) * (u[i] + step * d[i]);
    return (first > zero) & (sum < first * first);
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

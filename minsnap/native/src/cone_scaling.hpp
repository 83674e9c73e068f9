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

namespace minsnap {

inline double tail_product(const double *u, const double *v, std::size_t count) {
    double sum = 0.0;
    for (std::size_t i = 1; i < count; ++i) sum += u[i] * v[i];
    return sum;
}

// u0^2 - |u1|^2, without cancellation.
inline double cone_determinant(const double *u, std::size_t count) {
    const double norm = std::sqrt(tail_product(u, u, count));
    return (u[0] - norm) * (u[0] + norm);
}

struct ConeScaling {
    double eta;
    double *w;       // count
    double *lambda;  // count

    // Find the scaling of a pair inside the cone; false where it is not.
    [[nodiscard]] bool set(const double *s, const double *z, std::size_t count) {
        if (!(s[0] > 0.0) || !(z[0] > 0.0)) return false;
        const double size_s = std::sqrt(cone_determinant(s, count)), size_z = std::sqrt(cone_determinant(z, count));
        if (!(size_s > 0.0) || !(size_z > 0.0)) return false;
        eta = std::sqrt(size_s / size_z);
        const double product = s[0] * z[0] + tail_product(s, z, count);
        const double twice = 2.0 * std::sqrt(0.5 * (1.0 + product / (size_s * size_z)));
        w[0] = (s[0] / size_s + z[0] / size_z) / twice;
        for (std::size_t i = 1; i < count; ++i) w[i] = (s[i] / size_s - z[i] / size_z) / twice;
        multiply(z, lambda, count);
        return true;
    }

    // W u
    void multiply(const double *u, double *out, std::size_t count) const { apply(u, out, count, 1.0, eta); }

    // W^-1 u
    void divide(const double *u, double *out, std::size_t count) const { apply(u, out, count, -1.0, 1.0 / eta); }

private:
    void apply(const double *u, double *out, std::size_t count, double sign, double size) const {
        const double along = tail_product(w, u, count), first = u[0];
        const double share = sign * first + along / (1.0 + w[0]);
        for (std::size_t i = 1; i < count; ++i) out[i] = size * (u[i] + w[i] * share);
        out[0] = size * (w[0] * first + sign * along);
    }
};

// Solve lambda o u = r.
inline void cone_quotient(const double *lambda, const double *r, double *u, std::size_t count) {
    const double along = tail_product(lambda, r, count);
    const double first = (lambda[0] * r[0] - along) / cone_determinant(lambda, count);
    for (std::size_t i = 1; i < count; ++i) u[i] = (r[i] - first * lambda[i]) / lambda[0];
    u[0] = first;
}

// By how much the first component must grow for u to lie on the cone; negative inside.
inline double cone_depth(const double *u, std::size_t count) { return std::sqrt(tail_product(u, u, count)) - u[0]; }

// Largest step in [0, most] for which u + step d stays in the cone, u inside.
inline double cone_step(const double *u, const double *d, std::size_t count, double most) {
    if (count == 1) return d[0] < 0.0 ? std::min(most, -u[0] / d[0]) : most;
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

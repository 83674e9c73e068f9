// Cone programmes of few unknowns: minimise 1/2 x'Px + q'x where every s = h - G x has |(s1, s2, ...)| <= s0.
//
// Mehrotra's predictor and corrector with the scaling of Nesterov and Todd (L. Vandenberghe, "The CVXOPT linear and quadratic cone
// program solvers", 2010). For s and multipliers z inside a cone there is one symmetric W with W z = W^-1 s = lambda:
//
//     W = eta [ w0  w1'                   ]     with w0^2 - |w1|^2 = 1; W^-1 has 1 / eta and -w1
//             [ w1  1 + w1 w1' / (1 + w0) ]
//
// Steps are found in scaled form, ds~ = W^-1 ds and dz~ = W dz, where lambda stands for both s and z. The product of the
// algebra is u o v = (u'v, u0 v1 + v0 u1), its unit e = (1, 0, ...).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "arithmetic/dot.hpp"
#include "arithmetic/lanes.hpp"
#include "arithmetic/wide.hpp"
#include "basics/buffer.hpp"
#include "basics/status.hpp"

namespace minsnap {

struct WithinConesSettings {
    static constexpr int iterations = 60;
    static constexpr double tolerance = 1e-6;    // of the gap, relative to 1 and the cost, and of residuals
    static constexpr double to_boundary = 0.99;  // share of the way to the boundary of a cone that a step goes
    static constexpr double shortest = 1e-10;    // step that is none
    static constexpr double near = 1e2;          // tolerances within which an answer is one where steps end
    static constexpr double inside = 1e-8;       // depth in a cone that a start has without being moved
};

// One cone: where it begins among the components of all, and how many it has.
struct Cone {
    std::size_t begin, count;

    double tail(const double *u, const double *v) const { return dot(u + begin + 1, v + begin + 1, count - 1); }
    double norm(const double *u) const { return std::sqrt(tail(u, u)); }

    // u0^2 - |u1|^2, without cancellation.
    double determinant(const double *u) const {
        const double rest = norm(u);
        return (u[begin] - rest) * (u[begin] + rest);
    }

    // The scaling of s and z, and lambda; false where one of them is not inside.
    bool scale(const double *s, const double *z, double &eta, double *w, double *lambda) const {
        const double size_s = std::sqrt(determinant(s)), size_z = std::sqrt(determinant(z));
        if (!(s[begin] > 0.0 && z[begin] > 0.0 && size_s > 0.0 && size_z > 0.0)) return false;
        const double product = s[begin] * z[begin] + tail(s, z), twice = 2.0 * std::sqrt(0.5 * (1.0 + product / (size_s * size_z)));
        const double first = 1.0 / (size_s * twice), second = 1.0 / (size_z * twice);
        eta = std::sqrt(size_s / size_z);
        w[begin] = s[begin] * first + z[begin] * second;
        for (std::size_t i = begin + 1; i < begin + count; ++i) w[i] = s[i] * first - z[i] * second;
        apply(eta, 1.0, w, z, lambda);
        return true;
    }

    // W u, or W^-1 u for 1 / eta and the sign -1.
    void apply(double eta, double sign, const double *w, const double *u, double *out) const {
        const double along = tail(w, u), share = sign * u[begin] + along / (1.0 + w[begin]);
        out[begin] = eta * (w[begin] * u[begin] + sign * along);
        for (std::size_t i = begin + 1; i < begin + count; ++i) out[i] = eta * (u[i] + w[i] * share);
    }

    // The u with lambda o u = center e - lambda o lambda - a o b.
    void correct(double center, const double *lambda, const double *a, const double *b, double *u) const {
        const double own = lambda[begin], right = center - own * own - tail(lambda, lambda) - a[begin] * b[begin] - tail(a, b);
        for (std::size_t i = begin + 1; i < begin + count; ++i) u[i] = -2.0 * own * lambda[i] - a[begin] * b[i] - b[begin] * a[i];
        u[begin] = (own * right - tail(lambda, u)) / determinant(lambda);
        for (std::size_t i = begin + 1; i < begin + count; ++i) u[i] = (u[i] - u[begin] * lambda[i]) / own;
    }

    // Largest step in [0, most] for which u + step d stays inside, where u is.
    double longest(const double *u, const double *d, double most) const {
        const double a = determinant(d), b = u[begin] * d[begin] - tail(u, d), c = determinant(u), root = b * b - a * c;
        double step = d[begin] < 0.0 ? std::min(most, -u[begin] / d[begin]) : most;
        if (root >= 0.0 && (a < 0.0 || b < 0.0)) step = std::min(step, c / (std::sqrt(root) - b));
        return step;
    }
};

// What is asked; arrays of the caller.
struct ConeQuestion {
    std::size_t size, cones;         // numbers of unknowns and of cones
    const std::int64_t *first;       // (cones + 1,) where the rows of each begin
    const double *hessian, *linear;  // (size, size), (size,)
    const double *matrix, *bound;    // (rows, size), (rows,)
    double *x;                       // (size,) the solution
};

class WithinCones {
public:
    explicit WithinCones(const ConeQuestion &asked)
        : p_(asked), n_(asked.size), m_(asked.cones), rows_(static_cast<std::size_t>(asked.first[asked.cones])) {}

    Status solve() {
        if (!allocate()) return Status::no_memory;
        Status ended = Status::singular;
        widely([&]() MINSNAP_INLINED {
            if (begin()) ended = iterate();
        });
        return ended;
    }

private:
    using Settings = WithinConesSettings;
    using Vector = Buffer<double>;

    Status iterate() {
        for (int iteration = 0; iteration < Settings::iterations; ++iteration) {
            measure();
            if (within(Settings::tolerance)) return Status::done;
            if (!scale() || !factor() || !(advance() > Settings::shortest)) break;
        }
        measure();
        return within(Settings::near * Settings::tolerance) ? Status::done : Status::no_progress;
    }

    bool allocate() {
        bool made = matrix_.allocate(n_ * n_) && scaled_.allocate(rows_ * n_) && eta_.allocate(m_);
        for (Vector *v : {&dx_, &rx_}) made = made && v->allocate(n_);
        for (Vector *v : {&s_, &z_, &w_, &lambda_, &rz_, &shift_, &ds_, &dz_}) made = made && v->allocate(rows_);
        return made;
    }

    Cone cone(std::size_t k) const {
        return {static_cast<std::size_t>(p_.first[k]), static_cast<std::size_t>(p_.first[k + 1] - p_.first[k])};
    }

    // Start from the solution without boundaries of cones: W = 1 (Vandenberghe, section 7.3).
    bool begin() {
        std::copy(p_.matrix, p_.matrix + rows_ * n_, scaled_.data());
        if (!factor()) return false;
        for (std::size_t j = 0; j < n_; ++j) p_.x[j] = -p_.linear[j];
        add_transposed(scaled_.data(), p_.bound, p_.x);
        substitute(p_.x);
        for (std::size_t i = 0; i < rows_; ++i) {
            s_[i] = p_.bound[i] - dot(p_.matrix + i * n_, p_.x, n_);
            z_[i] = -s_[i];
        }
        inwards(s_.data());
        inwards(z_.data());
        return true;
    }

    // Move a point along the axes of the cones until it is inside all of them.
    void inwards(double *u) const {
        double depth = -1.0;
        for (std::size_t k = 0; k < m_; ++k) depth = std::max(depth, cone(k).norm(u) - u[cone(k).begin]);
        if (depth < -Settings::inside) return;
        for (std::size_t k = 0; k < m_; ++k) u[cone(k).begin] += 1.0 + std::max(depth, 0.0);
    }

    // rx = P x + q + G'z,  rz = G x + s - h,  gap = s'z
    void measure() {
        double cost = 0.0;
        for (std::size_t j = 0; j < n_; ++j) {
            const double rise = dot(p_.hessian + j * n_, p_.x, n_);
            cost += p_.x[j] * (0.5 * rise + p_.linear[j]);
            rx_[j] = rise + p_.linear[j];
        }
        add_transposed(p_.matrix, z_.data(), rx_.data());
        residual_ = 0.0;
        for (std::size_t i = 0; i < rows_; ++i) {
            rz_[i] = dot(p_.matrix + i * n_, p_.x, n_) + s_[i] - p_.bound[i];
            residual_ = std::max(residual_, std::fabs(rz_[i]));
        }
        for (std::size_t j = 0; j < n_; ++j) residual_ = std::max(residual_, std::fabs(rx_[j]));
        gap_ = dot(s_.data(), z_.data(), rows_);
        size_ = 1.0 + std::fabs(cost);
    }

    bool within(double tolerance) const { return residual_ <= tolerance && gap_ <= tolerance * size_; }

    // W of all cones, and the rows of W^-1 G; false where a pair is not inside.
    bool scale() {
        for (std::size_t k = 0; k < m_; ++k) {
            const Cone own = cone(k);
            if (!own.scale(s_.data(), z_.data(), eta_[k], w_.data(), lambda_.data())) return false;
            const double *g = p_.matrix + own.begin * n_, *w = &w_[own.begin], size = 1.0 / eta_[k];
            double *out = &scaled_[own.begin * n_];
            std::fill(dx_.data(), dx_.data() + n_, 0.0);
            for (std::size_t i = 1; i < own.count; ++i)
                for (std::size_t j = 0; j < n_; ++j) dx_[j] += w[i] * g[i * n_ + j];
            for (std::size_t i = 1; i < own.count; ++i)
                for (std::size_t j = 0; j < n_; ++j) out[i * n_ + j] = size * (g[i * n_ + j] + w[i] * (dx_[j] / (1.0 + w[0]) - g[j]));
            for (std::size_t j = 0; j < n_; ++j) out[j] = size * (w[0] * g[j] - dx_[j]);
        }
        return true;
    }

    // out += A'y for all rows.
    void add_transposed(const double *matrix, const double *y, double *out) const {
        for (std::size_t i = 0; i < rows_; ++i)
            for (std::size_t j = 0; j < n_; ++j) out[j] += y[i] * matrix[i * n_ + j];
    }

    // Normal equations P + (W^-1 G)'(W^-1 G), and their Cholesky factor in place.
    bool factor() {
        std::copy(p_.hessian, p_.hessian + n_ * n_, matrix_.data());
        for (std::size_t i = 0; i < rows_; ++i) {
            const double *row = &scaled_[i * n_];
            for (std::size_t a = 0; a < n_; ++a)
                if (row[a] != 0.0)
                    for (std::size_t b = 0; b <= a; ++b) matrix_[a * n_ + b] += row[a] * row[b];
        }
        for (std::size_t a = 0; a < n_; ++a) {
            double *own = &matrix_[a * n_];
            for (std::size_t b = 0; b < a; ++b) own[b] = (own[b] - dot(own, &matrix_[b * n_], b)) / matrix_[b * n_ + b];
            own[a] -= dot(own, own, a);
            if (!(own[a] > 0.0)) return false;
            own[a] = std::sqrt(own[a]);
        }
        return true;
    }

    // Solve the normal equations in place.
    void substitute(double *x) const {
        for (std::size_t a = 0; a < n_; ++a) x[a] = (x[a] - dot(&matrix_[a * n_], x, a)) / matrix_[a * n_ + a];
        for (std::size_t a = n_; a-- > 0;) {
            x[a] /= matrix_[a * n_ + a];
            for (std::size_t j = 0; j < a; ++j) x[j] -= matrix_[a * n_ + j] * x[a];
        }
    }

    // W u of all cones, or W^-1 u for the sign -1.
    void apply(double sign, const double *u, double *out) const {
        for (std::size_t k = 0; k < m_; ++k) cone(k).apply(sign > 0.0 ? eta_[k] : 1.0 / eta_[k], sign, w_.data(), u, out);
    }

    // dx and the scaled ds and dz that take all residuals away, where their sum is the shift.
    void direction() {
        apply(-1.0, rz_.data(), dz_.data());
        for (std::size_t i = 0; i < rows_; ++i) dz_[i] += shift_[i];
        std::fill(dx_.data(), dx_.data() + n_, 0.0);
        add_transposed(scaled_.data(), dz_.data(), dx_.data());
        for (std::size_t j = 0; j < n_; ++j) dx_[j] = -rx_[j] - dx_[j];
        substitute(dx_.data());
        for (std::size_t i = 0; i < rows_; ++i) {
            dz_[i] += dot(&scaled_[i * n_], dx_.data(), n_);
            ds_[i] = shift_[i] - dz_[i];
        }
    }

    // Largest step of both for which they stay inside.
    double longest(double most) const {
        for (std::size_t k = 0; k < m_; ++k)
            most = cone(k).longest(lambda_.data(), dz_.data(), cone(k).longest(lambda_.data(), ds_.data(), most));
        return most;
    }

    // Predict, correct, move; the step taken.
    double advance() {
        for (std::size_t i = 0; i < rows_; ++i) shift_[i] = -lambda_[i];
        direction();
        const double whole = longest(1.0), left = 1.0 - whole + whole * whole * dot(ds_.data(), dz_.data(), rows_) / gap_;
        const double share = std::min(1.0, std::max(0.0, left)), center = share * share * share * gap_ / static_cast<double>(m_);
        for (std::size_t k = 0; k < m_; ++k) cone(k).correct(center, lambda_.data(), ds_.data(), dz_.data(), shift_.data());
        direction();
        const double step = Settings::to_boundary * longest(1.0 / Settings::to_boundary);
        for (std::size_t j = 0; j < n_; ++j) p_.x[j] += step * dx_[j];
        apply(1.0, ds_.data(), shift_.data());
        for (std::size_t i = 0; i < rows_; ++i) s_[i] += step * shift_[i];
        apply(-1.0, dz_.data(), shift_.data());
        for (std::size_t i = 0; i < rows_; ++i) z_[i] += step * shift_[i];
        return step;
    }

    const ConeQuestion &p_;
    const std::size_t n_, m_, rows_;
    double residual_ = 0.0, gap_ = 0.0, size_ = 1.0;  // size of the cost, to which the gap is relative
    Vector matrix_, scaled_, eta_, dx_, rx_;
    Vector s_, z_, w_, lambda_, rz_, shift_, ds_, dz_;
};

}  // namespace minsnap

// A primal-dual interior-point method for the cone programmes of a chain of pieces.
//
//     minimise 1/2 x'Px + q'x   subject to   G x + s = h,  s in a product of half-lines and second-order cones
//
// Mehrotra's predictor and corrector with Nesterov-Todd scaling (L. Vandenberghe, "The CVXOPT linear and quadratic cone
// program solvers", 2010). The normal equations P + G'W^-2 G are formed piece by piece: every row of G belongs to one
// piece, so that they are banded but for unknowns that many pieces share.
//
// A start may be given: a point at which all cones leave about `start_room`. With the multipliers z = mu s^-1 of the
// central path it takes half as many iterations as from the usual start, where penalties make multipliers too large by
// thousands.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "basics/buffer.hpp"
#include "cones/cone_rows.hpp"
#include "cones/cone_product.hpp"
#include "arithmetic/dot.hpp"
#include "arithmetic/profile_matrix.hpp"
#include "basics/status.hpp"

namespace minsnap {

// What is asked; arrays of the caller. `columns` holds `size` where a piece has no unknown.
struct ChainProgramme {
    std::size_t size, pieces;
    const std::int64_t *columns;      // pieces x width
    const double *hessian;            // pieces x width x width
    const double *diagonal, *linear;  // size
    ConeRows *cones;                  // sorted by piece
    const double *bound;              // rows
    const double *start = nullptr;    // size, or none
};

constexpr double start_room = 0.02;  // in the cones at a start, and mu of its multipliers

class InteriorPoint {
public:
    // `seconds` from now on after which no iteration begins.
    InteriorPoint(const ChainProgramme &programme, double tolerance, std::int64_t most,
                  double seconds = std::numeric_limits<double>::infinity())
        : p_(programme), tolerance_(tolerance), most_(most), seconds_(seconds) {}

    std::int64_t iterations() const { return iterations_; }

    // Solve into x (size) and z (rows).
    Status solve(double *x, double *z) {
        if (!allocate()) return Status::no_memory;
        x_ = x;
        z_ = z;
        if (p_.start != nullptr) {
            begin_at(p_.start);
            if (iterate()) return Status::done;
            if (late()) return Status::no_progress;
        }
        if (!begin()) return Status::singular;
        return iterate() ? Status::done : Status::no_progress;
    }

private:
    using Vector = Buffer<double>;
    static constexpr double coarse = 1e-3;  // gap above which equations are not solved twice

    // From the present point to the solution; false where it is not found.
    bool iterate() {
        residuals();
        for (iterations_ = 0; iterations_ < most_; ++iterations_) {
            if (small()) return true;
            if (late()) break;
            if (!product_.scale(s_.data(), z_) || !form()) return close();
            const double step = advance();
            measure(step);
            if (!(step > 1e-10)) break;
        }
        return close();
    }

    bool late() const {
        const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - began_;
        return spent.count() >= seconds_;
    }

    bool allocate() {
        const std::size_t n = p_.size, m = rows();
        bool made = true;
        for (Vector *v : {&dx_, &rx_, &right_, &again_}) made = made && v->allocate(n + 1);
        for (Vector *v : {&s_, &ds_, &dz_, &rz_, &one_, &two_, &three_, &push_, &aim_}) made = made && v->allocate(m + 1);
        made = made && product_.set(cones(), m, [&](std::size_t k) { return p_.cones->size_of(k); });
        made = made && block_.allocate(width() * width()) && local_.allocate(width());
        return made && list_firsts() && matrix_.shape(n, first_.data());
    }

    std::size_t rows() const { return p_.cones->rows(p_.pieces); }
    std::size_t cones() const { return p_.cones->cones(); }
    std::size_t width() const { return p_.cones->shape().width(); }
    const std::int64_t *columns_of(std::size_t piece) const { return p_.columns + piece * width(); }

    // First unknown that each unknown meets in a piece.
    bool list_firsts() {
        if (!first_.allocate(p_.size + 1)) return false;
        for (std::size_t j = 0; j < p_.size; ++j) first_[j] = j;
        for (std::size_t i = 0; i < p_.pieces; ++i) {
            const std::int64_t *columns = columns_of(i), *end = columns + width();
            const auto least = static_cast<std::size_t>(*std::min_element(columns, end));
            for (const std::int64_t *column = columns; column != end; ++column) {
                const auto j = static_cast<std::size_t>(*column);
                if (j < p_.size) first_[j] = std::min(first_[j], least);
            }
        }
        return true;
    }

    // out = h - G x over all rows, or G x where `plain`.
    void rows_of(const double *x, double *out, bool plain) {
        for (std::size_t i = 0; i < p_.pieces; ++i) {
            gather(x, i);
            p_.cones->times(i, local_.data(), out + p_.cones->first_row(i));
        }
        if (plain) return;
        for (std::size_t row = 0; row < rows(); ++row) out[row] = p_.bound[row] - out[row];
    }

    void gather(const double *x, std::size_t piece) {
        const std::int64_t *columns = columns_of(piece);
        for (std::size_t j = 0; j < width(); ++j) {
            const auto column = static_cast<std::size_t>(columns[j]);
            local_[j] = column < p_.size ? x[column] : 0.0;
        }
    }

    // out += G' y
    void add_transposed(const double *y, double *out) {
        for (std::size_t i = 0; i < p_.pieces; ++i) {
            std::fill(local_.data(), local_.data() + width(), 0.0);
            p_.cones->add_transposed(i, y + p_.cones->first_row(i), local_.data());
            for (std::size_t j = 0; j < width(); ++j) {
                const auto column = static_cast<std::size_t>(columns_of(i)[j]);
                if (column < p_.size) out[column] += local_[j];
            }
        }
    }

    // out = P x
    void hessian_times(const double *x, double *out) {
        for (std::size_t j = 0; j < p_.size; ++j) out[j] = p_.diagonal[j] * x[j];
        for (std::size_t i = 0; i < p_.pieces; ++i) {
            gather(x, i);
            const double *block = p_.hessian + i * width() * width();
            for (std::size_t a = 0; a < width(); ++a) {
                const auto column = static_cast<std::size_t>(columns_of(i)[a]);
                if (column >= p_.size) continue;
                out[column] += dot(block + a * width(), local_.data(), width());
            }
        }
    }

    // Start from the solution without cones' boundaries: W = 1 (Vandenberghe, section 7.3).
    bool begin() {
        const std::size_t n = p_.size, m = rows();
        product_.unscale();
        if (!form()) return false;
        for (std::size_t j = 0; j < n; ++j) right_[j] = -p_.linear[j];
        add_transposed(p_.bound, right_.data());
        matrix_.solve(right_.data());
        std::copy(right_.data(), right_.data() + n, x_);
        rows_of(x_, s_.data(), false);
        for (std::size_t i = 0; i < m; ++i) z_[i] = -s_[i];
        inwards(s_.data());
        inwards(z_);
        return true;
    }

    // Start from a point, moved inwards in the cones that leave less room, and z = mu s^-1.
    void begin_at(const double *x) {
        std::copy(x, x + p_.size, x_);
        rows_of(x_, s_.data(), false);
        product_.center(s_.data(), z_, start_room);
    }

    // Move a point along the axes of the cones until it is inside.
    void inwards(double *u) const {
        const double depth = product_.depth(u);
        if (depth >= -1e-8) product_.raise(u, 1.0 + std::max(depth, 0.0));
    }

    // Residuals after a step. Far from the solution one with a share of the whole leaves the rest of them, and only where
    // they are small are they computed anew.
    void measure(double step) {
        gap_ = dot(s_.data(), z_, rows());
        if (gap_ < coarse || gap_ <= 2.0 * tolerance_ * (1.0 + std::abs(cost_))) return residuals();
        for (std::size_t j = 0; j < p_.size; ++j) rx_[j] *= 1.0 - step;
        for (std::size_t i = 0; i < rows(); ++i) rz_[i] *= 1.0 - step;
        primal_ *= 1.0 - step;
        dual_ *= 1.0 - step;
    }

    // rx = P x + q + G'z,  rz = G x + s - h,  gap = s'z
    void residuals() {
        hessian_times(x_, rx_.data());
        cost_ = 0.5 * dot(x_, rx_.data(), p_.size) + dot(x_, p_.linear, p_.size);
        for (std::size_t j = 0; j < p_.size; ++j) rx_[j] += p_.linear[j];
        add_transposed(z_, rx_.data());
        rows_of(x_, rz_.data(), false);
        for (std::size_t i = 0; i < rows(); ++i) rz_[i] = s_[i] - rz_[i];
        gap_ = dot(s_.data(), z_, rows());
        primal_ = largest(rz_.data(), rows());
        dual_ = largest(rx_.data(), p_.size);
    }

    static double largest(const double *u, std::size_t count) {
        double most = 0.0;
        for (std::size_t i = 0; i < count; ++i) most = std::max(most, std::abs(u[i]));
        return most;
    }

    bool within(double tolerance) const {
        return primal_ <= tolerance && dual_ <= tolerance && gap_ <= tolerance * (1.0 + std::abs(cost_));
    }
    bool small() const { return within(tolerance_); }
    bool close() const { return within(1e2 * tolerance_); }

    // Normal equations for the present scaling, factored.
    bool form() {
        matrix_.clear();
        for (std::size_t j = 0; j < p_.size; ++j) matrix_.row(j).add(j, p_.diagonal[j]);
        for (std::size_t i = 0; i < p_.pieces; ++i) {
            const double *hessian = p_.hessian + i * width() * width();
            std::copy(hessian, hessian + width() * width(), block_.data());
            p_.cones->add_squares(i, product_.scalings(), block_.data());
            scatter(i);
        }
        return matrix_.factor();
    }

    // Add the block of a piece to the matrix; an unknown that a piece names twice is met twice.
    void scatter(std::size_t piece) {
        const std::int64_t *columns = columns_of(piece);
        for (std::size_t a = 0; a < width(); ++a) {
            const auto row = static_cast<std::size_t>(columns[a]);
            if (row >= p_.size) continue;
            ProfileMatrix::Row line = matrix_.row(row);
            for (std::size_t b = 0; b < width(); ++b) {
                const auto column = static_cast<std::size_t>(columns[b]);
                if (column > row) continue;
                line.add(column, a >= b ? block_[a * width() + b] : block_[b * width() + a]);
            }
        }
    }

    // dx, dz, ds for the shift d_s of the complementarity: ds = d_s - W^2 dz, where the solution leaves W^2 dz in one_.
    void direction(const double *shift, bool precise) {
        solve_reduced(rx_.data(), rz_.data(), shift);
        if (precise && gap_ < coarse) {
            refine(shift);
            product_.square(dz_.data(), one_.data());
        }
        for (std::size_t i = 0; i < rows(); ++i) ds_[i] = shift[i] - one_[i];
    }

    // P dx + G'dz = -rx, G dx - W^2 dz = -rz - shift, into dx_ and dz_; W^2 dz into one_.
    void solve_reduced(const double *rx, const double *rz, const double *shift) {
        for (std::size_t i = 0; i < rows(); ++i) one_[i] = rz[i] + (shift != nullptr ? shift[i] : 0.0);
        product_.divide_square(one_.data(), two_.data());
        for (std::size_t j = 0; j < p_.size; ++j) dx_[j] = 0.0;
        add_transposed(two_.data(), dx_.data());
        for (std::size_t j = 0; j < p_.size; ++j) dx_[j] = -rx[j] - dx_[j];
        matrix_.solve(dx_.data());
        rows_of(dx_.data(), dz_.data(), true);
        for (std::size_t i = 0; i < rows(); ++i) one_[i] += dz_[i];
        product_.divide_square(one_.data(), dz_.data());
    }

    // One step of iterative refinement of both equations.
    void refine(const double *shift) {
        hessian_times(dx_.data(), again_.data());
        add_transposed(dz_.data(), again_.data());
        for (std::size_t j = 0; j < p_.size; ++j) again_[j] += rx_[j];
        rows_of(dx_.data(), three_.data(), true);
        product_.square(dz_.data(), one_.data());
        for (std::size_t i = 0; i < rows(); ++i) three_[i] += rz_[i] + shift[i] - one_[i];
        std::copy(dx_.data(), dx_.data() + p_.size, right_.data());
        std::copy(dz_.data(), dz_.data() + rows(), push_.data());
        solve_reduced(again_.data(), three_.data(), nullptr);
        for (std::size_t j = 0; j < p_.size; ++j) dx_[j] += right_[j];
        for (std::size_t i = 0; i < rows(); ++i) dz_[i] += push_[i];
    }

    // Predict, correct, move; the step taken.
    double advance() {
        for (std::size_t i = 0; i < rows(); ++i) aim_[i] = -s_[i];
        direction(aim_.data(), false);
        const double whole = std::min(product_.longest(s_.data(), ds_.data()), product_.longest(z_, dz_.data()));
        const double after = gap_ + whole * (dot(s_.data(), dz_.data(), rows()) + dot(z_, ds_.data(), rows())) +
                             whole * whole * dot(ds_.data(), dz_.data(), rows());
        const double share = std::min(1.0, std::max(0.0, after / gap_));
        product_.correct(share * share * share * gap_ / static_cast<double>(cones()), ds_.data(), dz_.data(), aim_.data());
        direction(aim_.data(), true);
        const double step =
            0.99 * std::min(product_.longest(s_.data(), ds_.data(), 1.0 / 0.99), product_.longest(z_, dz_.data(), 1.0 / 0.99));
        for (std::size_t j = 0; j < p_.size; ++j) x_[j] += step * dx_[j];
        for (std::size_t i = 0; i < rows(); ++i) {
            s_[i] += step * ds_[i];
            z_[i] += step * dz_[i];
        }
        return step;
    }

    const ChainProgramme &p_;
    const double tolerance_;
    const std::int64_t most_;
    const double seconds_;
    const std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
    std::int64_t iterations_ = 0;
    double *x_ = nullptr, *z_ = nullptr;
    double gap_ = 0.0, primal_ = 0.0, dual_ = 0.0, cost_ = 0.0;
    Vector s_, ds_, dz_, rz_, one_, two_, three_, push_, aim_;
    Vector dx_, rx_, right_, again_, block_, local_;
    ConeProduct product_;
    Buffer<std::size_t> first_;
    ProfileMatrix matrix_;
};

}  // namespace minsnap

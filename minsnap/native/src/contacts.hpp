// Moves the instants of all active rows at once to where the curve touches its walls.
//
// Adding rows at peaks creeps: a contact ends as two rows that close in on it. With the multipliers mu and rows a_k(s_k)
// the conditions of the optimum are z = -sum mu_k a_k, a_k . z = b_k and d_k = (d/ds) a_k . z = 0. Newton's method on
// them, the steps of mu eliminated (R. Hettich and K. O. Kortanek, SIAM Review 35, 1993, the reduction approach), is
//
//   (S + diag(-d''/mu)) y = d',   step of s_k = y_k / mu_k,
//
// where S is the Gram matrix of the rows' derivatives in s, made orthogonal to the rows.
#pragma once

#include "active_set.hpp"

namespace minsnap {

template <class Real, int Half>
class Contacts {
public:
    Contacts(const Chain<Real, Half> &chain, const Buffer<Wall<Real>> &walls, ActiveSet<Real, Half> &active)
        : chain_(chain), walls_(walls), active_(active) {}

    [[nodiscard]] bool allocate() {
        const std::size_t most = active_.layout().entries + 2;
        return rows_.allocate(most) && kept_.allocate(most) && right_.allocate(most);
    }

    // Keep the rows as they are, to come back to them.
    void remember() {
        kept_count_ = active_.count();
        for (int k = 0; k < kept_count_; ++k) kept_[k] = active_.row(k);
    }
    bool come_back(Real share) { return active_.replace(kept_.data(), kept_count_, share); }

    // Rows that belong to one contact become one. False if the rows are dependent then.
    bool merge(Real share) {
        const int count = active_.count();
        int left = 0;
        for (int k = 0; k < count; ++k) {
            const Row<Real> &own = active_.row(k);
            int same = 0;
            while (same < left && !one_contact(rows_[same], own)) ++same;
            if (same == left) {
                rows_[left++] = own;
                continue;
            }
            Row<Real> &other = rows_[same];
            const Real total = other.multiplier + own.multiplier;
            if (total > 0) other.s = (other.multiplier * other.s + own.multiplier * own.s) / total;
            other.multiplier = total;
        }
        return left == count || active_.replace(rows_.data(), left, share);
    }

    // One Newton step. False if it cannot be made.
    bool step(Real share) {
        const int count = active_.count();
        if (count == 0 || !make_system() || !solve_system()) return false;
        for (int k = 0; k < count; ++k) {
            rows_[k] = active_.row(k);
            if (is_fixed(k)) continue;
            const Real by = right_[k] / multiplier(k);
            const Real s = rows_[k].s + (by > most_step ? most_step : by < -most_step ? -most_step : by);
            rows_[k].s = s < ends ? ends : s > 1 - ends ? 1 - ends : s;
        }
        return active_.replace(rows_.data(), count, share);
    }

private:
    static constexpr Real most_step = Real(0.1), ends = Real(1e-3), near = Real(0.12);

    static bool one_contact(const Row<Real> &a, const Row<Real> &b) {
        return a.wall == b.wall && std::fabs(a.s - b.s) < near;
    }
    // Rows at the ends of a piece stay there.
    bool is_fixed(int k) const {
        const Row<Real> &row = active_.row(k);
        return row.s <= 0 || row.s >= 1 || walls_[row.wall].when != When::always;
    }
    Real multiplier(int k) const { return largest(active_.row(k).multiplier / active_.row(k).norm, Real(1e-300)); }

    // S = D'D - C'C with the rows' derivatives D and C = Q'D = R^-T A'D. Newton's matrix need not be precise.
    bool make_system() {
        const int count = active_.count(), entries = active_.layout().entries;
        const std::size_t square = std::size_t(count) * count, all = std::size_t(count) * entries;
        if (!system_.allocate(square) || !derivatives_.allocate(all) || !along_.allocate(square)) return false;
        for (int k = 0; k < count; ++k) {
            active_.whiten(active_.row(k).wall, active_.row(k).s, 1, derivative(k));
            for (int l = 0; l < count; ++l)
                along(k)[l] = active_.inner(active_.vector(l), wall(l), derivative(k), wall(k));
            active_.orthogonal().solve_transposed(along(k));
        }
        for (int k = 0; k < count; ++k) {
            Real *const own = &system_[std::size_t(k) * count];
            for (int l = 0; l <= k; ++l)
                own[l] = is_fixed(k) || is_fixed(l) ? Real(0)
                                                    : active_.inner(derivative(k), wall(k), derivative(l), wall(l)) -
                                                          dot(along(k), along(l), count);
            add_bend(k, own[k]);
        }
        return true;
    }

    void add_bend(int k, Real &diagonal) {
        const Row<Real> &row = active_.row(k);
        right_[k] = 0;
        if (is_fixed(k)) {
            diagonal = 1;
            return;
        }
        Real points[max_points];
        const int degree = along_normal(chain_, chain_.points.data(), walls_[row.wall], points);
        const Jet<Real> jet = jet_at(points, degree, row.s);
        Real bend = largest(-jet.curvature, 5 * std::fabs(jet.slope));
        bend = largest(bend, Real(1e-6) * walls_[row.wall].width);
        diagonal += bend / multiplier(k);
        right_[k] = jet.slope;
    }

    // Cholesky; the matrix is positive definite.
    bool solve_system() {
        const int count = active_.count();
        for (int j = 0; j < count; ++j) {
            Real *const own = &system_[std::size_t(j) * count];
            for (int i = 0; i <= j; ++i) {
                const Real *const other = &system_[std::size_t(i) * count];
                const Real left = own[i] - dot(own, other, i);
                if (i < j) own[i] = left / other[i];
                if (i == j && !(left > 0)) return false;
                if (i == j) own[i] = std::sqrt(left);
            }
            right_[j] = (right_[j] - dot(own, right_.data(), j)) / own[j];
        }
        for (int j = count - 1; j >= 0; --j) {
            right_[j] /= system_[std::size_t(j) * count + j];
            add_multiple(right_.data(), -right_[j], &system_[std::size_t(j) * count], j);
        }
        return true;
    }

    const Wall<Real> &wall(int k) const { return walls_[active_.row(k).wall]; }
    Real *along(int k) { return &along_[std::size_t(k) * active_.count()]; }
    Real *derivative(int k) { return &derivatives_[std::size_t(k) * active_.layout().entries]; }

    const Chain<Real, Half> &chain_;
    const Buffer<Wall<Real>> &walls_;
    ActiveSet<Real, Half> &active_;
    Buffer<Row<Real>> rows_, kept_;
    Buffer<Real> system_, derivatives_, right_, along_;
    int kept_count_ = 0;
};

}  // namespace minsnap

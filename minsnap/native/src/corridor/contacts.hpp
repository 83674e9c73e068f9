// Moves the instants of all active rows at once to where the curve touches its walls.
//
// Adding rows at peaks creeps: a contact ends as two rows that close in on it. With the multipliers mu and rows a_k(s_k)
// the conditions of the optimum are z = -sum mu_k a_k, a_k . z = b_k and d_k = (d/ds) a_k . z = 0. Newton's method on
// them, the steps of mu eliminated (R. Hettich and K. O. Kortanek, SIAM Review 35, 1993, the reduction approach), is
//
//   (S + diag(-d''/mu)) y = d',   step of s_k = y_k / mu_k,
//
// where S is the Gram matrix of the rows' derivatives in s, made orthogonal to the rows.
//
// A round wall |f| + n . r <= b, f = A r + c, is u . f + n . r <= b for all unit vectors u: its contacts have the direction u as
// further parameters, and d', d'' become the gradient and the matrix of second derivatives in s and u. All coordinates of
// u are parameters; the step along u itself is zero, since the row in that direction is active, and S is zero there.
#pragma once

#include "corridor/active_set.hpp"

namespace minsnap {

template <class Real, int Half>
class Contacts {
public:
    Contacts(const Chain<Real, Half> &chain, const Buffer<Wall<Real>> &walls, const Buffer<Ball<Real>> &balls,
             ActiveSet<Real, Half> &active)
        : chain_(chain), walls_(walls), balls_(balls), active_(active) {}

    [[nodiscard]] bool allocate() {
        const std::size_t most = active_.layout().entries + 2;
        return rows_.allocate(most) && kept_.allocate(most) && before_.allocate(length());
    }

    // Keep the rows as they are, to come back to them.
    void remember() {
        kept_count_ = active_.count();
        for (int k = 0; k < kept_count_; ++k) kept_[k] = active_.row(k);
        std::memcpy(before_.data(), chain_.points.data(), sizeof(Real) * length());
    }
    bool come_back(Real share) { return active_.replace(kept_.data(), kept_count_, share); }

    // Make rows that belong to one contact one, and take a Newton step. False if it cannot be made.
    bool step(Real share) {
        const int count = merge();
        if (count < active_.count() && !active_.hold(rows_.data(), count, share)) return false;
        if (count != active_.count() || !list_parameters() || !make_system() || !solve_system()) return false;
        for (int p = 0; p < parameter_count_; p += parameters_[p].count) {
            Row<Real> &row = rows_[parameters_[p].row];
            for (int i = p; i < p + parameters_[p].count; ++i) right_[i] /= pressure(parameters_[p].row);
            if (parameters_[p].part == instant) row.s = moved(row.s, right_[p]);
            if (is_ball(parameters_[p].row)) turn(row, p + (parameters_[p].part == instant ? 1 : 0));
        }
        return active_.replace(rows_.data(), count, share);
    }

private:
    // Fill ``rows_`` with one row for each contact, with the multipliers of all its rows; returns how many.
    int merge() {
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
            if (total > 0) {
                const Real share = own.multiplier / total;
                other.s += share * (own.s - other.s);
                for (int q = 0; q < chain_.dim; ++q) other.direction[q] += share * (own.direction[q] - other.direction[q]);
            }
            other.multiplier = total;
        }
        return left;
    }

    static constexpr Real most_step = Real(0.1), most_turn = Real(0.3), ends = Real(1e-3), near = Real(0.12);
    static constexpr Real flattest = Real(1e-3);  // least height, in widths, of which the bend of a cone is taken
    static constexpr int instant = -1;

    // What may vary about a row: its instant, or a coordinate of its direction.
    struct Parameter {
        int row, part, count;  // the count of parameters of that row, in the first of them
        Plane<Real> plane;     // whose value's derivative in s, or whose value, is what the row's changes by
    };

    std::size_t length() const { return std::size_t(chain_.pieces) * chain_.dim * chain_.size.points(); }

    // Rows near each other on one wall, of a ball on the same side, with no turn away from it between them.
    bool one_contact(const Row<Real> &a, const Row<Real> &b) const {
        if (a.wall != b.wall || !(fabs(a.s - b.s) < near)) return false;
        if (walls_[a.wall].ball >= 0) return dot(a.direction, b.direction, chain_.dim) > Real(0.5) && !parted(a, b);
        const Real between = jet_of(chain_.points, a.plane, (a.s + b.s) / 2).value - active_.outwards(walls_[a.wall]),
                   limits = (a.limit + b.limit) / 2;
        return between > limits - Real(1e-12) * walls_[a.wall].width;
    }
    // Whether the curve is farther inside a ball between two rows than the tangent planes of both at their own instants.
    bool parted(const Row<Real> &a, const Row<Real> &b) const {
        const Wall<Real> &wall = walls_[a.wall];
        Real place[max_dim], points[max_points];
        place_in_ball(chain_, wall, balls_[wall.ball], (a.s + b.s) / 2, place);
        const int degree = along_normal(chain_, chain_.points.data(), wall, points);
        const Real height = wall.bound + active_.outwards(wall) - jet_at(points, degree, (a.s + b.s) / 2).value;
        const Real inwards = (a.plane.bound - a.limit + b.plane.bound - b.limit) / 2;
        return sqrt(dot(place, place, balls_[wall.ball].rows)) < height - inwards - Real(1e-12) * wall.width;
    }
    // Rows at the ends of a piece stay there.
    bool is_fixed(int k) const {
        const Row<Real> &row = active_.row(k);
        return row.s <= 0 || row.s >= 1 || walls_[row.wall].when != When::always;
    }
    bool is_ball(int k) const { return walls_[active_.row(k).wall].ball >= 0; }
    Real pressure(int k) const { return largest(rows_[k].multiplier / rows_[k].norm, Real(1e-300)); }

    static Real moved(Real s, Real by) {
        s += by > most_step ? most_step : by < -most_step ? -most_step : by;
        return s < ends ? ends : s > 1 - ends ? 1 - ends : s;
    }
    void turn(Row<Real> &row, int first) const {
        const int rows = balls_[walls_[row.wall].ball].rows;
        const Real size = sqrt(dot(&right_[first], &right_[first], rows));
        const Real share = size > most_turn ? most_turn / size : Real(1);
        for (int q = 0; q < rows; ++q) row.direction[q] += share * right_[first + q];
    }

    // False if there are none.
    bool list_parameters() {
        const int count = active_.count();
        if (!parameters_.allocate(std::size_t(count) * (1 + max_dim) + 1)) return false;
        parameter_count_ = 0;
        for (int k = 0; k < count; ++k) {
            const Row<Real> &row = active_.row(k);
            const int first = parameter_count_;
            if (!is_fixed(k)) parameters_[parameter_count_++] = {k, instant, 0, row.plane};
            const int ball = walls_[row.wall].ball;
            for (int q = 0; ball >= 0 && q < balls_[ball].rows; ++q)
                parameters_[parameter_count_++] = {k, q, 0, coordinate(walls_[row.wall], balls_[ball], chain_.dim, q)};
            if (parameter_count_ > first) parameters_[first].count = parameter_count_ - first;
        }
        return parameter_count_ > 0;
    }

    // S = P'P with the rows' derivatives made orthogonal to the rows, P = D - Q Q'D: the difference of the Gram matrices of
    // D and Q'D would cancel where derivatives depend on the rows. One pass is exact enough for a step.
    bool make_system() {
        const int all = parameter_count_;
        const std::size_t size = all;
        if (!system_.allocate(size * size) || !derivatives_.allocate(size * active_.layout().entries) ||
            !along_.allocate(active_.count()) || !right_.allocate(size) || !reach_.allocate(size))
            return false;
        Orthogonal<Real> &orthogonal = active_.orthogonal();
        for (int p = 0; p < all; ++p) {
            const Parameter &own = parameters_[p];
            reach_[p] = active_.whiten(own.plane, active_.row(own.row).s, own.part == instant ? 1 : 0, derivative(p));
            orthogonal.project(derivative(p), reach_[p], along_.data(), 1);
            for (int o = 0; o <= p; ++o) entry(p, o) = orthogonal.inner(derivative(p), reach_[p], derivative(o), reach_[o]);
        }
        for (int p = 0; p < all; p += parameters_[p].count) add_bend(p);
        return true;
    }

    // Gradient and second derivatives of the value of the row whose parameters begin at p. The gradient is that of the
    // curve that the rows make; where they were merged, that curve may be far from its walls, and the second derivatives
    // are those of the curve before. That of |f| in s is u . f'' + |g|^2 / |f|, g being the part of f' across u.
    void add_bend(int p) {
        const int k = parameters_[p].row;
        const Row<Real> &row = active_.row(k);
        const Wall<Real> &wall = walls_[row.wall];
        const bool moves = parameters_[p].part == instant;
        const Real weight = 1 / pressure(k);
        const Jet<Real> jet = jet_of(before_, row.plane, row.s);
        Real across = 0, away = jet.slope, height = wall.bound + active_.outwards(wall);  // u . f' and |f|
        if (wall.ball >= 0) {
            away -= jet_of(before_, wall, row.s).slope;
            height = largest(height - jet_of(chain_.points, wall, row.s).value, flattest * wall.width);
        }
        for (int q = p + (moves ? 1 : 0); q < p + parameters_[p].count; ++q) {
            const Real own = row.direction[parameters_[q].part], offset = balls_[wall.ball].offset[parameters_[q].part];
            const Real slope = jet_of(before_, parameters_[q].plane, row.s).slope - away * own;
            right_[q] = jet_of(chain_.points, parameters_[q].plane, row.s).value + offset - height * own;
            entry(q, q) += weight * height;
            if (moves) entry(q, p) -= weight * slope;
            across += slope * slope / height;
        }
        if (!moves) return;
        const Real bend = largest(-jet.curvature - across, 5 * fabs(jet.slope));
        entry(p, p) += weight * (largest(bend, Real(1e-6) * wall.width) + across);
        right_[p] = jet_of(chain_.points, row.plane, row.s).slope;
    }

    Jet<Real> jet_of(const Buffer<Real> &all, const Plane<Real> &plane, Real s) const {
        Real points[max_points];
        const int degree = along_normal(chain_, all.data(), plane, points);
        return jet_at(points, degree, s);
    }

    // Cholesky; the matrix is positive definite.
    bool solve_system() {
        const int count = parameter_count_;
        for (int j = 0; j < count; ++j) {
            Real *const own = &system_[std::size_t(j) * count];
            for (int i = 0; i <= j; ++i) {
                const Real *const other = &system_[std::size_t(i) * count];
                const Real left = own[i] - dot(own, other, i);
                if (i < j) own[i] = left / other[i];
                if (i == j && !(left > 0)) return false;
                if (i == j) own[i] = sqrt(left);
            }
            right_[j] = (right_[j] - dot(own, right_.data(), j)) / own[j];
        }
        for (int j = count - 1; j >= 0; --j) {
            right_[j] /= system_[std::size_t(j) * count + j];
            add_multiple(right_.data(), -right_[j], &system_[std::size_t(j) * count], j);
        }
        return true;
    }

    Real &entry(int p, int o) { return system_[std::size_t(p) * parameter_count_ + o]; }
    Real *derivative(int p) { return &derivatives_[std::size_t(p) * active_.layout().entries]; }

    const Chain<Real, Half> &chain_;
    const Buffer<Wall<Real>> &walls_;
    const Buffer<Ball<Real>> &balls_;
    ActiveSet<Real, Half> &active_;
    Buffer<Row<Real>> rows_, kept_;
    Buffer<Real> system_, derivatives_, right_, along_, before_;
    Buffer<Parameter> parameters_;
    Buffer<Reach> reach_;
    int kept_count_ = 0, parameter_count_ = 0;
};

}  // namespace minsnap

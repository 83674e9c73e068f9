// A dual active set for the least-distance problem min |z|^2 subject to a_k . z <= b_k, where z are the deviations from
// the optimum without walls in coordinates that make the cost a sum of squares.
//
// D. Goldfarb and A. Idnani, "A numerically stable dual method for solving strictly convex quadratic programs",
// Mathematical Programming 27, 1983. Rows have unit length; z = -sum mu_k a_k at every step, mu >= 0. The values of rows
// are taken from the current curve, and only increments go through the triangular factor: values from z itself are off
// by the condition of that factor.
#pragma once

#include <cmath>
#include <limits>

#include "corridor/balls.hpp"
#include "corridor/contact.hpp"
#include "arithmetic/orthogonal.hpp"
#include "arithmetic/square_root.hpp"

namespace minsnap {

template <class Real>
struct Row {
    int wall, slot;
    Real s;
    Plane<Real> plane;        // the wall, or its tangent plane
    Real direction[max_dim];  // of a ball's tangent plane; of an equality the side it is left on, 1 or -1
    Real limit;               // of n.r, the wall moved inwards
    Real norm;                // length of the row in z before it is made one
    Real value;               // of n.r on the curve as last placed, less what its wall is moved outwards
    Real multiplier;          // for the row of unit length and the cost without 1/2, halved
    Reach reach;
};

enum class Entered { added, kept_already, infeasible, stalled };

template <class Real, int Half>
class ActiveSet {
public:
    ActiveSet(Chain<Real, Half> &chain, const Buffer<Wall<Real>> &walls, const Buffer<Ball<Real>> &balls,
              const SquareRoot<Real, Half> *const *factors)
        : chain_(chain), walls_(walls), balls_(balls), factors_(factors) {}

    // With slacks: unknowns behind those of the curve, each worth ``price`` times its value in the distance.
    [[nodiscard]] bool allocate(int slacks = 0, Real price = 1) {
        slacks_ = slacks, price_ = price, placed_ = 0.0;
        if (!lay_out() || !slack_.allocate(slacks + 1)) return false;
        const std::size_t n = layout_.entries, most = n + 2;
        return rows_.allocate(most) && vectors_.allocate(most * n + 1) && free_.allocate(most) && z_.allocate(n + 1) &&
               step_.allocate(n + 1) && rest_.allocate(n + 1) && along_.allocate(most) && factor_.allocate(layout_.entries) &&
               orthogonal_.allocate(layout_, int(n) + 1);
    }

    void clear() {
        for (int i = 0; i < layout_.entries; ++i) z_[i] = step_[i] = 0;
        for (int i = 0; i < slacks_; ++i) slack_[i] = 0;
        forget();
    }

    Real slack(int i) const { return slack_[i]; }

    // By how much a wall is moved outwards.
    Real outwards(const Wall<Real> &wall) const { return wall.slack < 0 ? Real(0) : wall.give[0] * slack_[wall.slack]; }

    int count() const { return count_; }
    double work() const { return orthogonal_.products() + placed_; }  // products of entries since it was allocated, about
    Row<Real> &row(int k) { return rows_[k]; }
    const Row<Real> &row(int k) const { return rows_[k]; }
    bool is_equality(int k) const { return walls_[rows_[k].wall].equality; }
    const Layout &layout() const { return layout_; }
    Orthogonal<Real> &orthogonal() { return orthogonal_; }
    // Whether the distance is that of slacks, but for a share: rows hold them up then, and not what the curve costs.
    bool carries_slacks(Real share) const {
        const Real *const slacks = z_.data() + layout_.offset[chain_.dim];
        return dot(z_.data(), z_.data(), layout_.offset[chain_.dim]) < share * dot(slacks, slacks, slacks_);
    }
    Real squared_distance() const { return dot(z_.data(), z_.data(), layout_.entries); }

    // Make a row the candidate: it stands behind the active ones. A ball's row is a tangent plane, with the direction in
    // which the curve lies unless another is given. False if the unknowns cannot change its value.
    template <class Number = Real>
    bool propose(int wall, Real s, Real share, const Number *direction = nullptr) {
        if (count_ > layout_.entries) return false;
        if (slacks_ > 0) s = double(s);  // what is written can be proved exactly only as it is used
        Row<Real> &row = rows_[count_];
        row = {};
        row.wall = wall, row.s = s, row.slot = free_[count_];
        if (!choose_plane(row, direction)) return false;
        row.limit = row.plane.bound - inwards_at(walls_[wall], share, s);
        Real *const a = own_vector(count_);
        row.reach = whiten(row.plane, s, 0, a);
        if (const int slack = walls_[wall].slack; slack >= 0) {
            a[layout_.offset[chain_.dim] + slack] = -walls_[wall].give[0] / price_;
            row.reach.axes |= 1U << chain_.dim;
        }
        row.norm = sqrt(orthogonal_.inner(a, row.reach, a, row.reach));
        if (!(row.norm > 0)) return false;
        for (int i = 0; i < layout_.entries; ++i) a[i] /= row.norm;
        measure(row);
        return true;
    }

    // Value of a row on the curve, the steps not yet placed included.
    Real value(int k) const {
        const Row<Real> &row = rows_[k];
        return row.value + row.norm * orthogonal_.inner(vector(k), row.reach, step_.data(), everywhere());
    }

    // Take the candidate in, dropping rows that give way to it.
    Entered enter() {
        const Row<Real> candidate = rows_[count_];
        std::memcpy(rest_.data(), vector(count_), sizeof(Real) * layout_.entries);
        Reach reach = candidate.reach;
        Real squared = orthogonal_.project(rest_.data(), reach, along_.data()), taken = 0;
        for (int turn = 0; turn < 4 * layout_.entries + 40; ++turn) {
            const Real violation = (value(count_) - candidate.limit) / candidate.norm;
            if (violation <= 0 && turn == 0 && !is_equality(count_)) return Entered::kept_already;
            const bool independent = squared > dependence() && count_ < layout_.entries;
            const Real full = independent ? largest(violation, Real(0)) / squared : infinity();
            std::memcpy(factor_.data(), along_.data(), sizeof(Real) * count_);
            orthogonal_.solve(factor_.data());
            Real partial = infinity();
            const int gives_way = first_to_vanish(partial);
            const Real length = smallest(full, partial);
            if (!(length < infinity())) return Entered::infeasible;
            for (int k = 0; k < count_; ++k) rows_[k].multiplier -= length * factor_[k];
            if (independent) move(-length, rest_.data(), reach);
            taken += length;
            if (full <= partial) return append(reach, squared, taken);
            const Real freed = remove(gives_way, reach);
            squared = independent ? squared + freed * freed : freed * freed;
        }
        return Entered::stalled;
    }

    // Bring the curve to where the steps lead, and measure all rows on it.
    void place() {
        for (int axis = 0; axis < chain_.dim; ++axis) {
            Real *const x = step_.data() + layout_.offset[axis];
            factors_[axis]->backward(x);
            factors_[axis]->add(chain_, axis, x);
        }
        for (int i = 0; i < slacks_; ++i) slack_[i] += step_[layout_.offset[chain_.dim] + i] / price_;
        for (int i = 0; i < layout_.entries; ++i) step_[i] = 0;
        chain_.place();
        for (int k = 0; k < count_; ++k) measure(rows_[k]);
        const double points = 2.0 * Half;
        placed_ += 1.5 * points * layout_.entries + points * points * (double(chain_.pieces) * chain_.dim + count_);
    }

    // Refine until the active rows hold with equality on the curve itself.
    void settle() {
        Real before = 0;
        for (int pass = 0; pass < 5; ++pass) {
            Real worst = 0;
            for (int k = 0; k < count_; ++k) {
                const Real residual = rows_[k].value - rows_[k].limit;
                worst = largest(worst, fabs(residual) / walls_[rows_[k].wall].width);
                along_[k] = residual / rows_[k].norm;
            }
            if (worst < fine() || (pass > 0 && !(worst < before / 2))) return;
            before = worst;
            orthogonal_.solve_transposed(along_.data());
            orthogonal_.subtract(z_.data(), along_.data());
            orthogonal_.subtract(step_.data(), along_.data());
            orthogonal_.solve(along_.data());
            for (int k = 0; k < count_; ++k) rows_[k].multiplier += along_[k];
            place();
        }
    }

    // Rows with a negative multiplier leave, the worst first, with their share of z. False if that does not end.
    bool drop_negative() {
        for (int turn = 0; turn <= layout_.entries + 1; ++turn) {
            int worst = -1;
            for (int k = 0; k < count_; ++k)
                if (!is_equality(k) && rows_[k].multiplier < (worst < 0 ? Real(0) : rows_[worst].multiplier)) worst = k;
            if (worst < 0) return true;
            move(rows_[worst].multiplier, vector(worst), rows_[worst].reach);
            Reach unused;
            for (int k = 0; k < count_; ++k) along_[k] = 0;
            remove(worst, unused);
            place();
            settle();
        }
        return false;
    }

    // Replace all rows by others, given by wall, s, direction and multiplier, those that do not press left out. False if
    // they are dependent.
    bool replace(const Row<Real> *others, int count, Real share) { return hold(others, count, share) && drop_negative(); }

    // The same with equality for all of them, whether they press or not.
    bool hold(const Row<Real> *others, int count, Real share) {
        for (int i = 0; i < layout_.entries; ++i) step_[i] = step_[i] - z_[i], z_[i] = 0;
        forget();
        bool independent = true;
        for (int k = 0; k < count && independent; ++k) {
            if (!propose(others[k].wall, others[k].s, share, others[k].direction)) continue;
            independent = join(others[k].multiplier);
        }
        place();
        if (independent) settle();
        return independent;
    }

    // Begin with rows at contacts, as far as they are independent and press.
    bool begin_with(const Contact *contacts, int count) {
        for (int k = 0; k < count; ++k)
            if (propose(contacts[k].wall, Real(contacts[k].s), 0, contacts[k].direction)) join(contacts[k].pressure * rows_[count_].norm);
        place();
        settle();
        return drop_negative();
    }

    // Give all rows the limits of walls moved inwards by a share of their widths, and solve again.
    bool tighten(Real share) {
        for (int k = 0; k < count_; ++k) rows_[k].limit = rows_[k].plane.bound - inwards_at(walls_[rows_[k].wall], share, rows_[k].s);
        settle();
        return drop_negative();
    }

    // What the cost rises by for each share of their widths that the walls move inwards.
    Real slope() const {
        Real total = 0;
        for (int k = 0; k < count_; ++k) {
            const Row<Real> &row = rows_[k];
            total += 2 * row.multiplier / row.norm * give_at(walls_[row.wall], row.s);
        }
        return total;
    }

    // The row of the ``further``-th derivative in s of a plane's value at s, whitened: what it reaches.
    Reach whiten(const Plane<Real> &own, Real s, int further, Real *a) {
        Real factors[max_points];
        row_factors(chain_.size, *chain_.tables, chain_.durations[own.piece], own.order + further, s, factors);
        for (int i = 0; i < layout_.entries; ++i) a[i] = 0;
        int known = -1;
        for (int axis = 0; axis < chain_.dim; ++axis) {
            if (!(own.axes >> axis & 1U)) continue;
            Real *const out = a + layout_.offset[axis];
            const int from = layout_.first(axis, own.piece) - layout_.offset[axis];
            const int length = factors_[axis]->unknowns();
            if (known >= 0 && factors_[known] == factors_[axis]) {
                const Real ratio = own.normal[axis] / own.normal[known];
                const Real *const same = a + layout_.offset[known];
                for (int i = from; i < length; ++i) out[i] = ratio * same[i];
                continue;
            }
            factors_[axis]->forward(own.piece, factors, out);
            Real scale = own.normal[axis];
            for (int q = 0; q < further; ++q) scale *= chain_.durations[own.piece];
            for (int i = from; i < length; ++i) out[i] *= scale;
            known = axis;
        }
        return {own.axes, own.piece};
    }

    const Real *vector(int k) const { return &vectors_[std::size_t(rows_[k].slot) * layout_.entries]; }

private:
    static Real infinity() { return std::numeric_limits<Real>::infinity(); }
    static Real epsilon() { return std::numeric_limits<Real>::epsilon(); }
    static Real dependence() { return Real(1e-18) * (epsilon() / Real(2.2e-16)); }  // of a squared length
    static Real fine() { return Real(1e-11) * (epsilon() / Real(2.2e-16)); }        // residual, in widths
    static Reach everywhere() { return {~0U, 0}; }
    Real *own_vector(int k) { return &vectors_[std::size_t(rows_[k].slot) * layout_.entries]; }

    bool lay_out() {
        layout_.dim = chain_.dim + (slacks_ > 0), layout_.pieces = chain_.pieces;
        if (!layout_.begin.allocate(std::size_t(layout_.dim) * chain_.pieces)) return false;
        layout_.offset[0] = 0;
        for (int axis = 0; axis < chain_.dim; ++axis) {
            layout_.offset[axis + 1] = layout_.offset[axis] + factors_[axis]->unknowns();
            for (int piece = 0; piece < chain_.pieces; ++piece)
                layout_.begin[std::size_t(axis) * chain_.pieces + piece] = layout_.offset[axis] + factors_[axis]->start(piece);
        }
        layout_.entries = layout_.offset[chain_.dim] + slacks_;
        if (slacks_ == 0) return true;
        layout_.offset[layout_.dim] = layout_.entries;
        for (int piece = 0; piece < chain_.pieces; ++piece)
            layout_.begin[std::size_t(chain_.dim) * chain_.pieces + piece] = layout_.offset[chain_.dim];
        return true;
    }

    void forget() {
        count_ = 0;
        orthogonal_.clear();
        for (int i = 0; i < layout_.entries + 2; ++i) free_[i] = i, rows_[i] = {};
    }

    template <class Number>
    bool choose_plane(Row<Real> &row, const Number *direction) const {
        const Wall<Real> &wall = walls_[row.wall];
        if (wall.ball < 0) {
            row.plane = wall;
            if (!wall.equality) return true;
            measure(row);
            const bool back = direction == nullptr ? row.value < wall.bound : direction[0] < 0;
            row.direction[0] = back ? -1 : 1;
            for (int axis = 0; axis < chain_.dim; ++axis) row.plane.normal[axis] *= row.direction[0];
            row.plane.bound *= row.direction[0];
            return true;
        }
        const Ball<Real> &ball = balls_[wall.ball];
        if (direction == nullptr)
            place_in_ball(chain_, wall, ball, row.s, row.direction);
        else
            for (int q = 0; q < ball.rows; ++q) row.direction[q] = Real(direction[q]);
        if (!normalise(row.direction, ball.rows)) return false;
        for (int q = 0; q < ball.rows && slacks_ > 0; ++q) row.direction[q] = double(row.direction[q] * Real(1 - 1e-15));
        row.plane = tangent(wall, ball, chain_.dim, row.direction);
        return true;
    }

    void measure(Row<Real> &row) const {
        Real points[max_points];
        const int degree = along_normal(chain_, chain_.points.data(), row.plane, points);
        row.value = jet_at(points, degree, row.s).value - outwards(walls_[row.wall]);
    }

    void move(Real length, const Real *direction, Reach reach) {
        orthogonal_.add(z_.data(), length, direction, reach);
        orthogonal_.add(step_.data(), length, direction, reach);
    }

    int first_to_vanish(Real &length) const {
        int first = -1;
        for (int k = 0; k < count_; ++k)
            if (!is_equality(k) && factor_[k] > 0 && (first < 0 || rows_[k].multiplier < length * factor_[k])) {
                length = largest(rows_[k].multiplier, Real(0)) / factor_[k];
                first = k;
            }
        return first;
    }

    // Add the candidate with a given multiplier, whatever its value.
    bool join(Real multiplier) {
        std::memcpy(rest_.data(), vector(count_), sizeof(Real) * layout_.entries);
        Reach reach = rows_[count_].reach;
        const Real squared = orthogonal_.project(rest_.data(), reach, along_.data());
        if (!(squared > dependence())) return false;
        move(-multiplier, vector(count_), rows_[count_].reach);
        return append(reach, squared, multiplier) == Entered::added;
    }

    Entered append(Reach reach, Real squared, Real multiplier) {
        orthogonal_.append(rest_.data(), reach, squared, along_.data());
        rows_[count_++].multiplier = multiplier;
        return Entered::added;
    }

    // Take an active row out; the candidate moves up with the rows behind it. Returns what the candidate's rest gains.
    Real remove(int k, Reach &reach) {
        const int slot = rows_[k].slot;
        const Real freed = orthogonal_.remove(k, along_.data(), rest_.data(), reach);
        for (int j = k; j < count_; ++j) rows_[j] = rows_[j + 1];
        free_[count_ - 1] = free_[count_];  // the candidate's place
        free_[count_--] = slot;
        return freed;
    }

    Chain<Real, Half> &chain_;
    const Buffer<Wall<Real>> &walls_;
    const Buffer<Ball<Real>> &balls_;
    const SquareRoot<Real, Half> *const *factors_;  // one for each coordinate
    Layout layout_;
    Orthogonal<Real> orthogonal_;
    Buffer<Row<Real>> rows_;
    Buffer<Real> vectors_, z_, step_, rest_, along_, factor_, slack_;
    int slacks_ = 0;
    Real price_ = 1;
    double placed_ = 0.0;  // products by which the curve was placed
    Buffer<int> free_;
    int count_ = 0;
};

}  // namespace minsnap

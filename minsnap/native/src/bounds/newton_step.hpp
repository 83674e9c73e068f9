// Newton's step for a rounded bound. The times of legs, at which it is least, are unknowns too, with pivots below zero; shares of sets are eliminated
// where they stand. What is left is a chain of costates, with rates and time of a leg after its inner cells.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "basics/buffer.hpp"
#include "bounds/envelope.hpp"
#include "bounds/local_system.hpp"
#include "bounds/rounded_bound.hpp"

namespace minsnap {

class NewtonStep {
    using Settings = CostateSettings;
    static constexpr int most = 3 * Settings::sets + 1;
    using Local = LocalSystem<most>;
    using Block = double[3][3];

public:
    NewtonStep(const CostateSearch &asked, const RoundedBound &bound) : q_(asked), bound_(bound), l_(bound.layout) {}

    // Lay the system out for the bound's layout.
    [[nodiscard]] bool lay_out() {
        const auto rows = std::size_t(3 * l_.nodes() + 4 * l_.legs);
        if (!node_at_.allocate(std::size_t(l_.nodes())) || !leg_at_.allocate(std::size_t(l_.legs)) || !first_.allocate(rows) ||
            !right_.allocate(rows) || !slope_.allocate(rows))
            return false;
        rows_ = 0;
        if (!l_.closed) put_node(0);
        for (int k = 0; k < l_.legs; ++k) {
            for (int j = 1; j < l_.cells; ++j) put_node(l_.node(k, j));
            leg_at_[k] = rows_, rows_ += 4;
            put_node(l_.node(k, l_.cells));
        }
        for (int i = 0; i < rows_; ++i) first_[i] = i;
        for (int k = 0; k < l_.legs; ++k) {
            for (int j = 0; j < l_.cells; ++j) {
                const int a = node_at_[l_.node(k, j)], b = node_at_[l_.node(k, j + 1)];
                join(a, 3, b, 3), join(a, 3, leg_at_[k], 4), join(b, 3, leg_at_[k], 4);
            }
            if (bound_.before(k) >= 0) join(leg_at_[bound_.before(k)], 4, leg_at_[k], 4);
        }
        return matrix_.allocate(first_.data(), rows_);
    }

    // Find the step from a point; false where there is none. Gives what it promises to gain.
    [[nodiscard]] bool find(double *y, double *step, double &promised) {
        assemble(y);
        for (int i = 0; i < rows_; ++i) slope_[i] = right_[i];
        if (!matrix_.factor()) return false;
        matrix_.solve(right_.data());
        promised = 0.0;
        for (int i = 0; i < rows_; ++i) promised += slope_[i] * right_[i];
        for (int at = 0; at < l_.nodes(); ++at)
            for (int d = 0; d < 3; ++d) l_.costate(step, at)[d] = right_[node_at_[at] + d];
        for (int k = 0; k < l_.legs; ++k)
            for (int d = 0; d < 3; ++d) l_.rate(step, k)[d] = right_[leg_at_[k] + d];
        for (int k = 0; k < l_.legs && (l_.more > 0 || l_.more_rates > 0); ++k)
            for (int j = 0; j < l_.cells; ++j) promised += put_shares(y, step, k, j);
        return promised == promised;
    }

private:
    void put_node(int at) { node_at_[at] = rows_, rows_ += 3; }

    void join(int one, int count, int other, int others) {
        const int least = one < other ? one : other;
        for (int i = one; i < one + count; ++i) first_[i] = first_[i] < least ? first_[i] : least;
        for (int i = other; i < other + others; ++i) first_[i] = first_[i] < least ? first_[i] : least;
    }

    void assemble(double *y) {
        matrix_.clear();
        for (int i = 0; i < rows_; ++i) right_[i] = 0.0;
        for (int k = 0; k < l_.legs; ++k) {
            for (int j = 0; j < l_.cells; ++j) add_cell(y, k, j);
            add_leg(y, k);
        }
        for (int knot = 0; knot < bound_.knots(); ++knot) add_knot(y, knot);
        for (int d = 0; d < 3 && !l_.closed; ++d) {
            right_[node_at_[0] + d] -= q_.ends[d];
            right_[node_at_[l_.nodes() - 1] + d] += q_.ends[3 + d];
        }
        for (int at = 0; at < l_.nodes(); ++at) hold(node_at_[at], q_.costate_axes);
        for (int k = 0; k < l_.legs; ++k) hold(leg_at_[k], q_.rate_axes);
    }

    // Shares of the sets at an instant, the costate there, and the time of the leg; own unknowns are eliminated.
    void put_instant(Local &local, double *y, int leg, int j, int i) const {
        double x[3];
        l_.at_instant(y, leg, j, i, x);
        put_divided(local, bound_.accelerations, l_.more, x, l_.split(y, leg, j, i), bound_.costate_width(),
                    bound_.times[leg] * bound_.weight(leg, j, i));
        const int time = local.size++;
        for (int k = 0; k < time; ++k) local.matrix[time][k] = local.matrix[k][time] = -local.right[k] / bound_.times[leg];
        hold_uncovered(local, bound_.accelerations, l_.more);
        local.eliminate(tiny);
    }

    // Shares of the sets in a cell, and the rate there.
    void put_rate(Local &local, double *y, int leg, int j) const {
        double x[3];
        l_.in_cell(y, leg, j, bound_.length(leg, j), x);
        put_divided(local, bound_.velocities, l_.more_rates, x, l_.rate_split(y, leg, j), bound_.rate_width(leg), bound_.length(leg, j));
        hold_uncovered(local, bound_.velocities, l_.more_rates);
        local.eliminate(tiny);
    }

    static void put_divided(Local &local, const SupportSet *sets, int more, const double *whole, const double *own, double width,
                            double factor) {
        double rest[3] = {whole[0], whole[1], whole[2]};
        const int at = 3 * more;
        local.begin(at, at + 3);
        for (int m = 0; m < more; ++m)
            for (int d = 0; d < 3; ++d) rest[d] -= own[3 * m + d];
        Convex first;
        sets[0].add(rest, width, first);
        local.add(at, at, factor, first.curve);
        for (int d = 0; d < 3; ++d) local.right[at + d] = -factor * first.slope[d];
        for (int m = 0; m < more; ++m) {
            Convex other;
            sets[m + 1].add(own + 3 * m, width, other);
            local.add(3 * m, at, -factor, first.curve);
            local.add(3 * m, 3 * m, factor, other.curve);
            for (int n = 0; n <= m; ++n) local.add(3 * m, 3 * n, factor, first.curve);
            for (int d = 0; d < 3; ++d) local.right[3 * m + d] = -factor * (other.slope[d] - first.slope[d]);
        }
    }

    static void hold_uncovered(Local &local, const SupportSet *sets, int more) {
        for (int m = 0; m < more; ++m)
            for (int d = 0; d < 3; ++d)
                if (!(sets[m + 1].covered() >> d & 1)) local.hold(3 * m + d);
    }

    void add_block(int row, int column, double factor, const Block &block) {
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c)
                if (row != column || c <= r) matrix_.at(row + r, column + c) += factor * block[r][c];
    }

    void add_cell(double *y, int leg, int j) {
        const int places[3] = {node_at_[l_.node(leg, j)], node_at_[l_.node(leg, j + 1)], leg_at_[leg]}, time = places[2] + 3;
        Local local;
        Block block;
        for (int i = 0; i <= l_.parts; ++i) {
            put_instant(local, y, leg, j, i);
            const int at = local.own;
            const double shares[2] = {1.0 - double(i) / l_.parts, double(i) / l_.parts};
            add_shared(local, block, places, shares, 2);
            for (int one = 0; one < 2; ++one)
                for (int d = 0; d < 3; ++d) matrix_.at(time, places[one] + d) += shares[one] * local.matrix[at + 3][at + d];
            matrix_.at(time, time) += local.matrix[at + 3][at + 3];
            right_[time] += local.right[at + 3];
        }
        put_rate(local, y, leg, j);
        const double inverse = 1.0 / bound_.length(leg, j), shares[3] = {-inverse, inverse, 1.0};
        add_shared(local, block, places, shares, 3);
    }

    // Add what a local system leaves of a vector that is the sum of shares of others.
    void add_shared(const Local &local, Block &block, const int *places, const double *shares, int count) {
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) block[r][c] = local.matrix[local.own + r][local.own + c];
        for (int one = 0; one < count; ++one) {
            if (shares[one] == 0.0) continue;
            for (int other = 0; other <= one; ++other) add_block(places[one], places[other], shares[one] * shares[other], block);
            for (int d = 0; d < 3; ++d) right_[places[one] + d] += shares[one] * local.right[local.own + d];
        }
    }

    void add_leg(double *y, int leg) {
        const RoundedBound::Step step = bound_.step_of(y, leg);
        const double T = bound_.times[leg];
        const int rates = leg_at_[leg], time = rates + 3;
        add_block(rates, rates, -1.0 / T, step.mean.curve);
        for (int d = 0; d < 3; ++d) {
            right_[rates + d] += step.mean.slope[d] / T;
            matrix_.at(time, rates + d) += step.mean.slope[d] / (T * T);
        }
        matrix_.at(time, time) -= 2.0 * step.mean.value / (T * T * T);
    }

    void add_knot(double *y, int knot) {
        double x[3];
        bound_.turn(y, knot, x);
        const Convex sum = bound_.reach(knot, x, bound_.knot_width(bound_.beside(knot)));
        const int legs[2] = {bound_.before(knot), bound_.after(knot)};
        const double shares[2] = {legs[0] < 0 ? 0.0 : -bound_.chords[legs[0]], legs[1] < 0 ? 0.0 : bound_.chords[legs[1]]};
        for (int one = 0; one < 2; ++one) {
            if (legs[one] < 0) continue;
            for (int d = 0; d < 3; ++d) right_[leg_at_[legs[one]] + d] -= shares[one] * sum.slope[d];
            for (int other = 0; other <= one; ++other)
                if (legs[other] >= 0) add_block(leg_at_[legs[one]], leg_at_[legs[other]], shares[one] * shares[other], sum.curve);
        }
    }

    // Hold coordinates that must stay zero.
    void hold(int row, std::int64_t axes) {
        for (int d = 0; d < 3; ++d) {
            double &diagonal = matrix_.at(row + d, row + d);
            if (axes >> d & 1) {
                diagonal += Settings::trifle * (1.0 + diagonal);
            } else {
                diagonal = stiff;
                right_[row + d] = 0.0;
            }
        }
    }

    // Steps of the shares in a cell; returns what they promise besides.
    double put_shares(double *y, double *step, int leg, int j) {
        Local local;
        double x[most], more = 0.0;
        for (int i = 0; l_.more > 0 && i <= l_.parts; ++i) {
            put_instant(local, y, leg, j, i);
            l_.at_instant(step, leg, j, i, x + local.own);
            x[local.own + 3] = right_[leg_at_[leg] + 3];
            more += local.substitute(x, l_.split(step, leg, j, i));
        }
        if (l_.more_rates == 0) return more;
        put_rate(local, y, leg, j);
        l_.in_cell(step, leg, j, bound_.length(leg, j), x + local.own);
        return more + local.substitute(x, l_.rate_split(step, leg, j));
    }

    static constexpr double stiff = 1e30, tiny = 1e-13;

    const CostateSearch &q_;
    const RoundedBound &bound_;
    const Layout &l_;
    int rows_ = 0;
    Envelope matrix_;
    Buffer<double> right_, slope_;
    Buffer<int> node_at_, leg_at_, first_;
};

}  // namespace minsnap

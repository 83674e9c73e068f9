// The costate that proves the greatest bound of the flight time, by Newton's method on a concave problem whose norms are rounded, less and less.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "basics/buffer.hpp"
#include "basics/status.hpp"
#include "bounds/newton_step.hpp"

namespace minsnap {

class Costate {
    using Settings = CostateSettings;

public:
    explicit Costate(CostateSearch &asked) : q_(asked), bound_(asked), newton_(asked, bound_) {}

    Status find() {
        const Layout coarse = {int(q_.legs),           int(q_.cells), int(q_.parts), int(q_.accelerations) - 1,
                               int(q_.velocities) - 1, q_.closed != 0};
        if (!reserve(coarse) || !begin(coarse)) return Status::no_memory;
        q_.iterations = 0;
        for (bound_.width = Settings::first_width;; bound_.width = std::fmax(bound_.width * Settings::narrower, Settings::last_width)) {
            if (bound_.layout.cells < q_.fine && bound_.width <= Settings::refined_width && !divide()) return Status::no_memory;
            if (!settle()) return Status::singular;
            if (bound_.width <= Settings::last_width) break;
        }
        put();
        return Status::done;
    }

private:
    [[nodiscard]] bool reserve(Layout largest) {
        largest.cells = int(q_.fine);
        const auto count = std::size_t(largest.unknowns()), legs = std::size_t(largest.legs);
        if (!y_.allocate(count) || !trial_.allocate(count) || !step_.allocate(count) ||
            !grid_.allocate(legs * std::size_t(largest.cells + 1)) || !by_leg_.allocate(3 * legs))
            return false;
        bound_.times = by_leg_.data(), bound_.chords = bound_.times + legs, bound_.products = bound_.chords + legs;
        return true;
    }

    [[nodiscard]] bool begin(const Layout &coarse) {
        bound_.layout = coarse, bound_.grid = grid_.data();
        for (int i = 0; i < coarse.unknowns(); ++i) y_[i] = 0.0;
        for (int k = 0; k < coarse.legs; ++k) {
            bound_.products[k] = 0.0;
            for (int d = 0; d < 3; ++d) {
                coarse.rate(y_.data(), k)[d] = q_.rate[3 * k + d];
                bound_.products[k] += q_.rate[3 * k + d] * q_.steps[3 * k + d];
            }
            for (int j = 0; j <= coarse.cells; ++j) {
                grid_[k * (coarse.cells + 1) + j] = q_.grid[k * (q_.fine + 1) + j];
                for (int d = 0; d < 3; ++d) coarse.costate(y_.data(), k, j)[d] = q_.costate[(k * (q_.fine + 1) + j) * 3 + d];
            }
            for (int j = 0; j < coarse.cells; ++j)
                for (int i = 0; i <= coarse.parts; ++i) share_evenly(k, j, i);
        }
        return newton_.lay_out();
    }

    // Give each set the same share of the costate, in the coordinates that it covers.
    void share_evenly(int leg, int j, int i) {
        const Layout &l = bound_.layout;
        double x[3];
        l.at_instant(y_.data(), leg, j, i, x);
        for (int m = 0; m < l.more; ++m)
            for (int d = 0; d < 3; ++d)
                l.split(y_.data(), leg, j, i)[3 * m + d] = bound_.accelerations[m + 1].covered() >> d & 1 ? x[d] / (l.more + 1) : 0.0;
    }

    [[nodiscard]] bool divide() {
        Layout fine = bound_.layout;
        fine.cells = int(q_.fine);
        Buffer<double> finer, ends;
        if (!finer.allocate(std::size_t(fine.unknowns())) || !ends.allocate(std::size_t(fine.legs * (fine.cells + 1)))) return false;
        FinerCells(bound_.layout, y_.data(), grid_.data(), fine, finer.data(), ends.data()).put();
        y_.swap(finer), grid_.swap(ends);
        bound_.layout = fine, bound_.grid = grid_.data();
        return newton_.lay_out();
    }

    // Newton's method at one width.
    [[nodiscard]] bool settle() {
        double now = bound_.value(y_.data(), true);
        if (!(now > -RoundedBound::infinity)) return false;
        for (int round = 0; round < Settings::iterations; ++round) {
            double promised = 0.0;
            if (!newton_.find(y_.data(), step_.data(), promised)) return false;
            ++q_.iterations;
            if (!advance(now, promised)) return true;  // as far as rounding lets it
            now = bound_.value(y_.data(), true);
            if (promised < Settings::settled * bound_.width * std::fabs(now)) return true;
        }
        return true;
    }

    // Go the longest of halved steps that gains a share of what it promises; false where none does.
    bool advance(double now, double promised) {
        double share = 1.0;
        for (int halving = 0; halving < Settings::halvings; ++halving, share *= 0.5) {
            for (int i = 0; i < bound_.layout.unknowns(); ++i) trial_[i] = y_[i] + share * step_[i];
            if (bound_.value(trial_.data(), false) >= now + Settings::rise * share * promised) {
                y_.swap(trial_);
                return true;
            }
        }
        return false;
    }

    void put() {
        const Layout &l = bound_.layout;
        for (int k = 0; k < l.legs; ++k) {
            for (int j = 0; j <= l.cells; ++j) {
                q_.grid[k * (l.cells + 1) + j] = grid_[k * (l.cells + 1) + j];
                for (int d = 0; d < 3; ++d) q_.costate[(k * (l.cells + 1) + j) * 3 + d] = l.costate(y_.data(), k, j)[d];
            }
            for (int d = 0; d < 3; ++d) q_.rate[3 * k + d] = l.rate(y_.data(), k)[d];
        }
        for (int i = 0; i < 3 * l.instants() * l.more; ++i) q_.splits[i] = l.split(y_.data(), 0, 0, 0)[i];
        for (int i = 0; i < 3 * l.legs * l.cells * l.more_rates; ++i) q_.rate_splits[i] = l.rate_split(y_.data(), 0, 0)[i];
    }

    CostateSearch &q_;
    RoundedBound bound_;
    NewtonStep newton_;
    Buffer<double> y_, trial_, step_, grid_, by_leg_;
};

}  // namespace minsnap

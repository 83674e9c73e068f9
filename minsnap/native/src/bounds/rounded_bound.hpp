// The bound of the flight time that a costate proves, with norms that are rounded, and how it is the sum of legs and knots.
//
// Unknown are a costate p, linear in every cell of a leg, and for each leg a rate l. With D a step between waypoints, h_A and h_V the support functions
// of the sets of accelerations and velocities, and a prime for the derivative on [0, 1], every flight takes at least
//
//     sum over legs of 2 ((1 - int h_A(p)) (l . D))^(1/2) - int h_V(p' + l),   less p . v at its start, and p . v at its end more
//
// (derived in minsnap/bounds/costate_proof.py). Where several sets bound a derivative, p or p' + l is divided among them. Where knots lie in regions,
// l . D may change by up to X either way, and the root of l . D is replaced by the chord between its ends, which is linear in where knots are: that
// costs h_B(s l - s' l') at each knot, with the slopes s of the chords, which are held during a step.
#pragma once

#include <cmath>
#include <cstdint>

#include "bounds/border.hpp"
#include "bounds/layout.hpp"
#include "bounds/settings.hpp"
#include "bounds/supports.hpp"

namespace minsnap {

class RoundedBound {
    using Settings = CostateSettings;

public:
    explicit RoundedBound(const CostateSearch &asked)
        : q_(asked), accelerations(reinterpret_cast<const SupportSet *>(asked.sets)), velocities(accelerations + asked.accelerations) {}

    Layout layout;
    double width = 1.0;                                               // of the rounding, relative
    const double *grid = nullptr;                                     // (legs, cells + 1)
    double *times = nullptr, *chords = nullptr, *products = nullptr;  // (legs,) each; the last to begin with

    double length(int leg, int j) const { return grid[leg * (layout.cells + 1) + j + 1] - grid[leg * (layout.cells + 1) + j]; }

    // Weight of an instant in the mean over a leg.
    double weight(int leg, int j, int i) const { return length(leg, j) / layout.parts * (i == 0 || i == layout.parts ? 0.5 : 1.0); }

    // Rounding of norms, such that all of it in a mean is a share of 1, or of the leg's time.
    double costate_width() const { return spread(accelerations, layout.more, Settings::in_costate); }
    double rate_width(int leg) const { return spread(velocities, layout.more_rates, Settings::in_rate) * q_.times[leg]; }
    double knot_width(int leg) const { return width * Settings::in_knots * q_.times[leg]; }

    // How far a region reaches from its center.
    Convex reach(int knot, const double *x, double rounding) const {
        Convex sum;
        if (!zero(q_.rounds + 9 * knot, 9)) sum.add_mapped(q_.rounds + 9 * knot, x, rounding);
        for (int g = 0; g < 3; ++g)
            if (const double *const side = q_.sides + 9 * knot + 3 * g; !zero(side, 3)) sum.add_absolute(side, x, rounding);
        return sum;
    }

    // What stands for the product b of a leg's rate and step: (b + (b^2 - X^2)^(1/2))/2, or -1 where b is not above X.
    struct Step {
        Convex mean;
        double product, change;
    };
    Step step_of(double *y, int leg) const {
        const double *const l = layout.rate(y, leg), *const along = q_.steps + 3 * leg,
                            rounding = width * Settings::in_products * products[leg];
        const Convex from = reach(leg, l, rounding), to = reach(leg + 1, l, rounding);
        Step found;
        const double b = along[0] * l[0] + along[1] * l[1] + along[2] * l[2], change = from.value + to.value;
        const double squared = b * b - change * change, root = squared > 0.0 && b > 0.0 ? std::sqrt(squared) : -1.0;
        found.product = b, found.change = change;
        found.mean.value = root > 0.0 ? 0.5 * (b + root) : -1.0;
        double slope[3], lean[3];
        for (int i = 0; i < 3; ++i) {
            slope[i] = from.slope[i] + to.slope[i];
            lean[i] = (b * along[i] - change * slope[i]) / root;
            found.mean.slope[i] = 0.5 * (along[i] + lean[i]);
        }
        for (int i = 0; i < 3 && change > 0.0; ++i)
            for (int j = 0; j < 3; ++j) {
                const double turned = slope[i] * slope[j] + change * (from.curve[i][j] + to.curve[i][j]);
                found.mean.curve[i][j] = 0.5 * (along[i] * along[j] - turned - lean[i] * lean[j]) / root;
            }
        return found;
    }

    // Legs before and after a knot, and what the place of the knot is multiplied by; those at the ends have one leg.
    int knots() const { return layout.legs + (layout.closed ? 0 : 1); }
    int before(int knot) const { return knot > 0 ? knot - 1 : layout.closed ? layout.legs - 1 : -1; }
    int after(int knot) const { return knot < layout.legs ? knot : -1; }
    int beside(int knot) const { return after(knot) >= 0 ? after(knot) : before(knot); }
    void turn(double *y, int knot, double *x) const {
        const int one = before(knot), other = after(knot);
        for (int d = 0; d < 3; ++d)
            x[d] = (other < 0 ? 0.0 : chords[other] * layout.rate(y, other)[d]) - (one < 0 ? 0.0 : chords[one] * layout.rate(y, one)[d]);
    }

    // The rounded bound, or minus infinity.
    double value(double *y, bool renew) {
        double sum = 0.0;
        for (int k = 0; k < layout.legs; ++k) {
            const LegSums sums = leg_sums(y, k);
            const Step step = step_of(y, k);
            if (!(sums.room > 0.0) || !(step.mean.value > 0.0)) return -infinity;
            if (renew) put_time(k, sums.room, step);
            sum += 2.0 * std::sqrt(sums.room * step.mean.value) - sums.lost;
        }
        for (int knot = 0; knot < knots(); ++knot) {
            double x[3];
            turn(y, knot, x);
            sum -= reach(knot, x, knot_width(beside(knot))).value;
        }
        for (int d = 0; d < 3 && !layout.closed; ++d)
            sum += layout.costate(y, layout.nodes() - 1)[d] * q_.ends[3 + d] - layout.costate(y, 0)[d] * q_.ends[d];
        return sum;
    }

    static constexpr double infinity = __builtin_huge_val();

protected:
    const CostateSearch &q_;

private:
    struct LegSums {
        double room, lost;  // what is left of 1, and the integral of the velocities' support
    };
    LegSums leg_sums(double *y, int leg) const {
        LegSums sums = {1.0, 0.0};
        const double wide = costate_width(), rate_wide = rate_width(leg);
        for (int j = 0; j < layout.cells; ++j) {
            double x[3];
            for (int i = 0; i <= layout.parts; ++i) {
                layout.at_instant(y, leg, j, i, x);
                sums.room -= weight(leg, j, i) * divided(accelerations, layout.more, x, layout.split(y, leg, j, i), wide);
            }
            layout.in_cell(y, leg, j, length(leg, j), x);
            sums.lost += length(leg, j) * divided(velocities, layout.more_rates, x, layout.rate_split(y, leg, j), rate_wide);
        }
        return sums;
    }

    // The time of a leg at the bound, and the slope of its chord.
    void put_time(int leg, double room, const Step &step) {
        times[leg] = std::sqrt(step.mean.value / room);
        const double twice = 4.0 * (step.product - step.mean.value);  // 2 (b - (b^2 - X^2)^(1/2))
        const bool wide = step.change > 1e-6 * step.product;
        chords[leg] = wide ? std::sqrt(room * twice) / step.change : std::sqrt(room / step.product);
    }

    double spread(const SupportSet *sets, int more, double share) const {
        int roots = 0;
        for (int m = 0; m <= more; ++m) roots += sets[m].roots();
        return width * share / (roots > 0 ? roots : 1);
    }

    // Value of what is divided among sets, where the first has the rest.
    static double divided(const SupportSet *sets, int more, const double *whole, const double *own, double rounding) {
        double rest[3] = {whole[0], whole[1], whole[2]};
        Convex sum;
        for (int m = 0; m < more; ++m) {
            for (int d = 0; d < 3; ++d) rest[d] -= own[3 * m + d];
            sets[m + 1].add(own + 3 * m, rounding, sum);
        }
        sets[0].add(rest, rounding, sum);
        return sum.value;
    }

    static bool zero(const double *values, int count) {
        for (int i = 0; i < count; ++i)
            if (values[i] != 0.0) return false;
        return true;
    }

public:
    const SupportSet *const accelerations, *const velocities;
};

}  // namespace minsnap

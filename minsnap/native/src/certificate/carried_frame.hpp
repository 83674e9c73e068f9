// The axes of a body that never spins about its thrust axis: the least rotation from upright at the start, carried along a curve (R. L. Bishop, "There is
// more than one way to frame a curve", 1975). In H(z) R_z(angle), with H the least rotation from upright to the thrust axis z = f / |f|, the angle turns by
//
//     angle' = (f_1 f_2' - f_2 f_1') / (|f| (|f| + f_3)),
//
// integrated on cells by Legendre series. H is singular only upside down: there the same holds after half a turn about x.
#pragma once

#include <algorithm>
#include <cmath>

#include "basics/growing.hpp"
#include "basics/status.hpp"
#include "polynomials/evaluate.hpp"
#include "vehicle/lift.hpp"

namespace minsnap {

struct CarriedSettings {
    static constexpr int nodes = 16;             // of the series on a cell
    static constexpr double tail_angle = 1e-12;  // that the last coefficients of a cell may make up [rad]
    static constexpr int most_halvings = 24;     // of a cell
    static constexpr double chart_cosine = 0.8;  // of the tilt up to which a cell may reach on the far side of the horizon of its chart
    static constexpr double free_fall = 1e-6;    // share of gravity below which thrust has no direction: it is taken as upright there
};

struct Frame {
    Space<double> x, y;  // of the body, in the world
};

class CarriedFrame {
    using S = CarriedSettings;

public:
    CarriedFrame(const PiecewiseCurve &curve, const Medium &medium) : curve_(curve), medium_(medium) { make_coefficients(); }

    // Carry it along the whole curve, from an angle about the thrust axis at the start.
    Status carry(double angle) {
        for (std::int64_t piece = 0; piece < curve_.pieces; ++piece) {
            const Status status = carry(curve_.breaks[piece], curve_.breaks[piece + 1] - curve_.breaks[piece], 0);
            if (status != Status::done) return status;
        }
        double turned = angle;
        for (std::size_t i = 0; i < cells_.size(); ++i) {
            Cell &cell = cells_[i];
            if (cell.below != (i > 0 && cells_[i - 1].below)) {
                Space<double> force;
                if (const Status status = lift(&cell.start, 1, &force, nullptr); status != Status::done) return status;
                const Frame before = least_rotation(force, !cell.below), here = least_rotation(force, cell.below);
                turned += std::atan2(inner(before.x, here.y), inner(before.x, here.x));
            }
            cell.angle = turned;
            turned += cell.width * integral(cell.series, 1.0);
        }
        return Status::done;
    }

    // The axes at an instant, where the thrust is known; instants that rise find their cell at once.
    Frame at(double t, const Space<double> &force) {
        if (t < cells_[cell_].start) cell_ = 0;
        while (cell_ + 1 < cells_.size() && cells_[cell_ + 1].start <= t) ++cell_;
        const Cell &cell = cells_[cell_];
        const double angle = cell.angle + cell.width * integral(cell.series, 2.0 * ((t - cell.start) / cell.width) - 1.0);
        const Frame level = least_rotation(force, cell.below);
        const double cosine = std::cos(angle), sine = std::sin(angle);
        return {cosine * level.x + sine * level.y, cosine * level.y - sine * level.x};
    }

private:
    struct Cell {
        double start, width, angle, series[S::nodes];
        bool below;
    };

    // A cell, halved until its series converges and its chart is far from where it is singular.
    Status carry(double start, double width, int depth) {
        double t[S::nodes], rates[S::nodes], steepest = 1.0;
        Space<double> force[S::nodes], change[S::nodes];
        for (int k = 0; k < S::nodes; ++k) t[k] = start + width * (node(k) + 1.0) / 2.0;
        if (const Status status = lift(t, S::nodes, force, change); status != Status::done) return status;
        Cell cell = {start, width, 0.0, {}, force[S::nodes / 2].z < 0.0};
        for (int k = 0; k < S::nodes; ++k) {
            const double size = norm(force[k], 0.0), up = cell.below ? -force[k].z : force[k].z;
            const double area = force[k].x * change[k].y - force[k].y * change[k].x;
            rates[k] = (cell.below ? -area : area) / (size * std::max(size + up, S::free_fall * size));
            steepest = std::min(steepest, up / size);
        }
        for (int l = 0; l < S::nodes; ++l)
            for (int k = 0; k < S::nodes; ++k) cell.series[l] += coefficients_[l][k] * rates[k];
        double tail = 0.0;
        for (int l = S::nodes - 3; l < S::nodes; ++l) tail = std::max(tail, std::fabs(cell.series[l]) * width);
        if (depth == S::most_halvings || !(tail > S::tail_angle || steepest < -S::chart_cosine))
            return cells_.add(cell) ? Status::done : Status::no_memory;
        const double half = width / 2.0;
        const Status status = carry(start, half, depth + 1);
        return status == Status::done ? carry(start + half, half, depth + 1) : status;
    }

    // The force along the thrust axis at instants, upright where it vanishes, and its derivative if wanted.
    Status lift(const double *t, int count, Space<double> *force, Space<double> *change) const {
        double motion[3][3 * S::nodes] = {};
        for (int order = medium_.drag() ? 1 : 2; order <= (change == nullptr ? 2 : 3); ++order)
            if (const Status status = evaluate_curve(curve_, order, t, count, motion[order - 1]); status != Status::done) return status;
        for (int k = 0; k < count; ++k) {
            Space<double> x[4] = {};
            for (int q = 0; q < 3; ++q) x[q] = {motion[q][3 * k], motion[q][3 * k + 1], motion[q][3 * k + 2]};
            const Lift<double> f(medium_, x, change == nullptr ? 0 : 1);
            force[k] = norm(f.force, 0.0) > S::free_fall * medium_.gravity ? f.force : Space<double>{0.0, 0.0, medium_.gravity};
            if (change != nullptr) change[k] = f.change;
        }
        return Status::done;
    }

    static Frame least_rotation(const Space<double> &force, bool below) {
        const double turn = below ? -1.0 : 1.0, size = norm(force, 0.0);
        const double a = force.x / size, b = turn * (force.y / size), c = turn * (force.z / size), share = 1.0 / std::max(1.0 + c, 1e-300);
        return {{1.0 - a * a * share, -a * b * share * turn, -a * turn}, {-a * b * share, (1.0 - b * b * share) * turn, -b * turn}};
    }

    // Half the integral from -1 to x of a Legendre series: that of P_l is (P_{l+1} - P_{l-1}) / (2 l + 1).
    static double integral(const double *series, double x) {
        double before = 1.0, here = x, sum = series[0] * (x + 1.0);
        for (int l = 1; l < S::nodes; ++l) {
            const double next = ((2 * l + 1) * x * here - l * before) / (l + 1);
            sum += series[l] * ((next - before) / (2 * l + 1));
            before = here, here = next;
        }
        return 0.5 * sum;
    }

    // From values at the nodes of Gauss to Legendre coefficients.
    void make_coefficients() {
        for (int k = 0; k < S::nodes; ++k) {
            double before = 0.0, here = 1.0;
            for (int l = 0; l < S::nodes; ++l) {
                coefficients_[l][k] = here * weights[k < S::nodes / 2 ? S::nodes / 2 - 1 - k : k - S::nodes / 2] * (l + 0.5);
                const double next = ((2 * l + 1) * node(k) * here - l * before) / (l + 1);
                before = here, here = next;
            }
        }
    }

    static constexpr double places[S::nodes / 2] = {0.09501250983763744, 0.2816035507792589, 0.45801677765722737, 0.6178762444026438,
                                                    0.755404408355003,   0.8656312023878318, 0.9445750230732326,  0.9894009349916499};
    static constexpr double weights[S::nodes / 2] = {0.18945061045506864, 0.18260341504492364, 0.16915651939500265,  0.1495959888165767,
                                                     0.12462897125553407, 0.0951585116824926,  0.062253523938647456, 0.027152459411754176};
    static double node(int k) { return k < S::nodes / 2 ? -places[S::nodes / 2 - 1 - k] : places[k - S::nodes / 2]; }

    const PiecewiseCurve &curve_;
    const Medium &medium_;
    double coefficients_[S::nodes][S::nodes];
    Growing<Cell> cells_;
    std::size_t cell_ = 0;
};

}  // namespace minsnap

// Where the unknowns of a costate stand: its values at the ends of cells, a rate for each leg, and what further sets share of them.
#pragma once

#include <cmath>
#include <cstddef>

#include "basics/buffer.hpp"

namespace minsnap {

struct Layout {
    static constexpr int most_cells = 512;

    int legs, cells, parts;  // cells of each leg, and parts of a cell between its instants
    int more, more_rates;    // sets after the first
    bool closed;

    int nodes() const { return legs * cells + (closed ? 0 : 1); }
    int node(int leg, int j) const { return closed ? (leg * cells + j) % (legs * cells) : leg * cells + j; }
    int instants() const { return legs * cells * (parts + 1); }
    int unknowns() const { return 3 * (nodes() + legs + instants() * more + legs * cells * more_rates); }

    double *costate(double *y, int at) const { return y + 3 * at; }
    double *costate(double *y, int leg, int j) const { return costate(y, node(leg, j)); }
    double *rate(double *y, int leg) const { return y + 3 * (nodes() + leg); }
    double *split(double *y, int leg, int j, int i) const {
        return y + 3 * (nodes() + legs + ((leg * cells + j) * (parts + 1) + i) * more);
    }
    double *rate_split(double *y, int leg, int j) const {
        return y + 3 * (nodes() + legs + instants() * more + (leg * cells + j) * more_rates);
    }

    // The costate at an instant of a cell.
    void at_instant(double *y, int leg, int j, int i, double *x) const {
        const double *const a = costate(y, leg, j), *const b = costate(y, leg, j + 1), share = double(i) / parts;
        for (int d = 0; d < 3; ++d) x[d] = (1.0 - share) * a[d] + share * b[d];
    }

    // Its derivative in a cell of that length, and the rate of the leg.
    void in_cell(double *y, int leg, int j, double length, double *x) const {
        const double *const a = costate(y, leg, j), *const b = costate(y, leg, j + 1), *const l = rate(y, leg);
        for (int d = 0; d < 3; ++d) x[d] = (b[d] - a[d]) / length + l[d];
    }
};

// Cells of one layout in the place of those of another: short where the rate of the costate changes most.
class FinerCells {
public:
    FinerCells(const Layout &from, double *values, const double *grid, const Layout &to, double *finer, double *ends)
        : from_(from), to_(to), y_(values), z_(finer), grid_(grid), ends_(ends) {}

    void put() {
        for (int leg = 0; leg < to_.legs; ++leg) {
            spread(leg);
            for (int d = 0; d < 3; ++d) to_.rate(z_, leg)[d] = from_.rate(y_, leg)[d];
            for (int j = 0; j <= to_.cells; ++j) put_costate(leg, j);
            for (int j = 0; j < to_.cells; ++j) put_shares(leg, j);
        }
    }

private:
    const double *old_ends(int leg) const { return grid_ + leg * (from_.cells + 1); }
    double *new_ends(int leg) const { return ends_ + leg * (to_.cells + 1); }

    // The cell of the old layout in which a place is, and where in it.
    int cell_of(int leg, double s, double &share) const {
        const double *const old = old_ends(leg);
        int cell = 0;
        while (cell < from_.cells - 1 && old[cell + 1] < s) ++cell;
        share = (s - old[cell]) / (old[cell + 1] - old[cell]);
        return cell;
    }

    void put_costate(int leg, int j) {
        double share;
        const int cell = cell_of(leg, new_ends(leg)[j], share);
        const double *const a = from_.costate(y_, leg, cell), *const b = from_.costate(y_, leg, cell + 1);
        for (int d = 0; d < 3; ++d) to_.costate(z_, leg, j)[d] = (1.0 - share) * a[d] + share * b[d];
    }

    void put_shares(int leg, int j) {
        const double low = new_ends(leg)[j], high = new_ends(leg)[j + 1];
        double share;
        for (int i = 0; i <= to_.parts; ++i) {
            const int cell = cell_of(leg, low + (high - low) * i / to_.parts, share);
            const int part = share * from_.parts < from_.parts - 1 ? int(share * from_.parts) : from_.parts - 1;
            const double along = share * from_.parts - part;
            const double *const a = from_.split(y_, leg, cell, part), *const b = from_.split(y_, leg, cell, part + 1);
            for (int m = 0; m < 3 * to_.more; ++m) to_.split(z_, leg, j, i)[m] = (1.0 - along) * a[m] + along * b[m];
        }
        const double *const old = from_.rate_split(y_, leg, cell_of(leg, 0.5 * (low + high), share));
        for (int m = 0; m < 3 * to_.more_rates; ++m) to_.rate_split(z_, leg, j)[m] = old[m];
    }

    // Change of the costate's derivative at an inner end of old cells.
    double bend(int leg, int j) const {
        const double *const before = from_.costate(y_, leg, j - 1), *const at = from_.costate(y_, leg, j),
                            *const after = from_.costate(y_, leg, j + 1);
        const double *const old = old_ends(leg);
        double squares = 0.0;
        for (int d = 0; d < 3; ++d) {
            const double change = (after[d] - at[d]) / (old[j + 1] - old[j]) - (at[d] - before[d]) / (old[j] - old[j - 1]);
            squares += change * change;
        }
        return std::sqrt(squares);
    }

    // Half of the cells are spread evenly, and half by the root of the bends at the ends of old ones.
    void spread(int leg) {
        double weight[Layout::most_cells], sum = 0.0;
        for (int j = 0; j < from_.cells; ++j) weight[j] = 0.0;
        for (int j = 1; j < from_.cells; ++j) {
            const double size = std::sqrt(bend(leg, j));
            weight[j - 1] += size, weight[j] += size, sum += 2.0 * size;
        }
        const double *const old = old_ends(leg);
        const auto own = [&](int j) { return 0.5 * (old[j + 1] - old[j]) + 0.5 * (sum > 0.0 ? weight[j] / sum : old[j + 1] - old[j]); };
        double *const ends = new_ends(leg), passed = 0.0;
        int cell = 0;
        ends[0] = 0.0, ends[to_.cells] = 1.0;
        for (int j = 1; j < to_.cells; ++j) {
            const double wanted = double(j) / to_.cells;
            while (cell < from_.cells - 1 && passed + own(cell) < wanted) passed += own(cell), ++cell;
            ends[j] = old[cell] + (old[cell + 1] - old[cell]) * (wanted - passed) / own(cell);
        }
    }

    const Layout &from_, &to_;
    double *const y_, *const z_;
    const double *const grid_;
    double *const ends_;
};

}  // namespace minsnap

// Where a curve sticks out of its walls: local maxima of the excess, from a grid and Newton's method.
//
// Two maxima within a cell of the grid may be taken for one. Nothing relies on finding all: the proof does not use peaks,
// and where it fails it names an instant.
#pragma once

#include <cmath>

#include "corridor/walls.hpp"

namespace minsnap {

template <class Real>
struct Peak {
    int wall;
    Real s, excess;  // beyond the wall moved inwards, in units of unit_at

    // Whether it comes before another one: worst first, and of equal ones the wall and the instant decide, since libraries
    // sort equals in their own orders.
    bool before(const Peak &other) const {
        if (excess != other.excess) return excess > other.excess;
        return wall != other.wall ? wall < other.wall : s < other.s;
    }
};

constexpr int cells = 28;

// Basis polynomials of all degrees at the grid's instants.
template <class Real>
struct Grid {
    Real basis[max_products][max_products][cells + 4];  // [degree][j][instant], padded by the last instant
    Grid() {
        for (int degree = 0; degree < max_products; ++degree)
            for (int i = 0; i < cells + 4; ++i) {
                Real values[max_products];
                bernstein_basis(degree, Real(i < cells ? i : cells) / cells, values);
                for (int j = 0; j <= degree; ++j) basis[degree][j][i] = values[j];
            }
    }
};

template <class Real>
const Grid<Real> &grid() {
    static const Grid<Real> made;
    return made;
}

// Newton's method for the maximum of a polynomial near s, kept within a cell to both sides: s moves there; its value.
template <class Real>
inline Real climb(const Real *points, int degree, Real &s) {
    const Real low = s - Real(1) / cells, high = s + Real(1) / cells;
    const Real least = low > 0 ? low : Real(0), most = high < 1 ? high : Real(1);
    for (int step = 0; step < 5; ++step) {
        const Jet<Real> jet = jet_at(points, degree, s);
        if (!(jet.curvature < 0)) return jet.value;
        const Real next = s - jet.slope / jet.curvature, inside = next < least ? least : next > most ? most : next;
        const Real change = inside - s;
        s = inside;
        if (fabs(change) < Real(1e-5))  // the next one would be about its square, what Taylor leaves out its cube
            return jet.value + change * (jet.slope + change * jet.curvature / 2);
    }
    return jet_at(points, degree, s).value;
}

// Peaks of one polynomial above ``floor``, each handed to ``take(s, value)``.
template <class Real, class Take>
inline void peaks_of(const Real *points, int degree, Real floor, Take take) {
    Real highest = points[0], lowest = points[0];
    for (int j = 1; j <= degree; ++j) {
        highest = points[j] > highest ? points[j] : highest;
        lowest = points[j] < lowest ? points[j] : lowest;
    }
    if (!(highest > floor)) return;
    Real values[cells + 4] = {};
    for (int j = 0; j <= degree; ++j) {
        const Real *const basis = grid<Real>().basis[degree][j], factor = points[j];
        for (int i = 0; i < cells + 4; ++i) values[i] += factor * basis[i];
    }
    const Real near = floor - Real(0.04) * (highest - lowest);  // the top of a cell may lie above its corners
    for (int i = 0; i <= cells; ++i) {
        const bool rises = i == 0 || values[i] >= values[i - 1], falls = i == cells || values[i] > values[i + 1];
        if (!(rises && falls && values[i] > near)) continue;
        const Real bend = i > 0 && i < cells ? 2 * values[i] - values[i - 1] - values[i + 1] : Real(0);
        const Real guess = bend > 0 ? i + (values[i + 1] - values[i - 1]) / (2 * bend) : Real(i);  // of the parabola
        Real s = guess / cells;
        const Real value = climb(points, degree, s);
        if (value > floor) take(s, value);
    }
}

}  // namespace minsnap

// Several vehicles on a common clock, and parts of their pieces as control points with running error bounds.
//
// A piece runs from break to break; all breaks begin at 0 and end at the same instant. A part of a piece comes from de Casteljau's algorithm
// (G. Farin, "Curves and Surfaces for CAGD", section 4.6), whose every step adds its rounding to the error.
#pragma once

#include <cmath>
#include <cstdint>

#include "arithmetic/rounding.hpp"
#include "basics/record.hpp"
#include "polynomials/enclosure.hpp"

namespace minsnap {

using Integer = std::int64_t;

constexpr int max_fleet_degree = 15;
constexpr int fleet_axes = 3;

// What Python hands over.
MINSNAP_RECORD(FleetCurves, {
    const double *points;        // of all vehicles, one after the other: each (pieces, degree + 1, 3) [m]
    const double *breaks;        // each (pieces + 1,) [s]
    const Integer *point_start;  // (vehicles,): index of the first value
    const Integer *break_start;
    const Integer *pieces;
    const Integer *degree;
    Integer vehicles;
});

inline const double *piece_of(const FleetCurves &fleet, Integer vehicle, Integer i) {
    return fleet.points + fleet.point_start[vehicle] + i * (fleet.degree[vehicle] + 1) * fleet_axes;
}

inline const double *clock_of(const FleetCurves &fleet, Integer vehicle) { return fleet.breaks + fleet.break_start[vehicle]; }

// Whether all numbers are finite and of sizes for which nothing overflows, and all clocks ascend to one end.
inline bool sound(const FleetCurves &fleet) {
    const double end = clock_of(fleet, 0)[fleet.pieces[0]];
    for (Integer v = 0; v < fleet.vehicles; ++v) {
        const Integer pieces = fleet.pieces[v], degree = fleet.degree[v];
        if (pieces < 1 || degree < 0 || degree > max_fleet_degree) return false;
        if (!within(piece_of(fleet, v, 0), pieces * (degree + 1) * fleet_axes, 0x1p100)) return false;
        const double *t = clock_of(fleet, v);
        if (t[0] != 0.0 || t[pieces] != end) return false;
        for (Integer i = 0; i < pieces; ++i)
            if (!(t[i] < t[i + 1] && t[i + 1] <= longest_duration)) return false;
    }
    return true;
}

// Index of the piece that holds an instant, the last one at the end.
inline Integer piece_at(const double *breaks, Integer pieces, double instant) {
    Integer low = 0, high = pieces;
    while (high - low > 1) {
        const Integer middle = (low + high) / 2;
        (breaks[middle] <= instant ? low : high) = middle;
    }
    return low;
}

// One level of de Casteljau's algorithm at s.
inline void cut_step(double *value, double *error, int last, double s) {
    const double rest = 1.0 - s;
    for (int j = 0; j <= last; ++j) {
        const double climb = s * (value[j + 1] - value[j]);
        value[j] += climb;
        error[j] = rest * error[j] + s * error[j + 1] + unit * (3.0 * std::fabs(climb) + std::fabs(value[j]));
    }
}

// Keep what comes after s, or before it. The parameter is off by a few units of its own size, which moves each point by the longest step of its neighbours.
inline void cut(Curve &arc, double s, bool keep_after) {
    const int n = arc.degree;
    for (int d = 0; d < arc.dim; ++d) {
        double *value = arc.value[d], *error = arc.error[d], first_value[max_curve_degree + 1], first_error[max_curve_degree + 1],
               longest = 0.0;
        for (int j = 0; j < n; ++j) longest = std::fmax(longest, std::fabs(value[j + 1] - value[j]) + error[j] + error[j + 1]);
        const double moved = 8.0 * unit * n * longest;
        for (int level = 0; level <= n; ++level) {
            first_value[level] = value[0];
            first_error[level] = error[0];
            if (level < n) cut_step(value, error, n - level - 1, s);
        }
        for (int j = 0; j <= n; ++j) {
            if (!keep_after) {
                value[j] = first_value[j];
                error[j] = first_error[j];
            }
            error[j] += moved;
        }
    }
}

// The part of a vehicle's piece between two instants, both within the piece.
inline void part_of(const FleetCurves &fleet, Integer vehicle, Integer i, double from, double to, Curve &arc) {
    const int n = arc.degree = int(fleet.degree[vehicle]);
    const double *stored = piece_of(fleet, vehicle, i), *t = clock_of(fleet, vehicle) + i;
    arc.dim = fleet_axes;
    for (int d = 0; d < fleet_axes; ++d)
        for (int j = 0; j <= n; ++j) {
            arc.value[d][j] = stored[j * fleet_axes + d];
            arc.error[d][j] = 0.0;
        }
    if (from > t[0]) cut(arc, (from - t[0]) / (t[1] - t[0]), true);
    if (to < t[1]) cut(arc, (to - from) / (t[1] - from), false);
}

// Raise the degree: a mean of two neighbours with weights k / (n + 1), whose roundings are at most 4 units of the larger one.
inline void elevate(Curve &arc, int degree) {
    for (; arc.degree < degree; ++arc.degree) {
        const int n = arc.degree + 1;
        for (int d = 0; d < arc.dim; ++d) {
            double *value = arc.value[d], *error = arc.error[d];
            value[n] = value[n - 1];
            error[n] = error[n - 1];
            for (int k = n - 1; k > 0; --k) {
                const double share = double(k) / n, size = std::fmax(std::fabs(value[k - 1]), std::fabs(value[k]));
                value[k] = share * value[k - 1] + (1.0 - share) * value[k];
                error[k] = share * error[k - 1] + (1.0 - share) * error[k] + 4.0 * unit * size;
            }
        }
    }
}

}  // namespace minsnap

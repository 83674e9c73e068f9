// Cells of time, in each of which every vehicle is near a chord: the straight motion between where it is at the cell's ends.
//
// A curve less its chord has as control points those of the curve less the chord at their own instants (linear precision of Bernstein polynomials), so the
// largest of them bounds how far the vehicle is from its chord. Heights are divided by the downwash. Bounds hold with all rounding: `spread` includes it.
#pragma once

#include <cmath>

#include "basics/buffer.hpp"
#include "fleet/curves.hpp"

namespace minsnap {

struct Chord {
    double from[fleet_axes], move[fleet_axes];
    double spread;  // never farther from the chord
};

struct Sorted {
    double low[fleet_axes] = {}, high[fleet_axes] = {};
    Integer vehicle;
};

inline double scaled(double value, int axis, double downwash) { return axis == 2 ? value / downwash : value; }

// The chord of a vehicle in a cell.
inline Chord chord_of(const FleetCurves &fleet, Integer v, double a, double b, double downwash, Curve &arc) {
    const double *t = clock_of(fleet, v);
    const Integer count = fleet.pieces[v], first = piece_at(t, count, a);
    Chord chord{};
    double size = 0.0, farthest = 0.0, last[fleet_axes] = {};
    for (int pass = 0; pass < 2; ++pass) {  // the ends first, then what is between them
        for (Integer i = first; i < count && t[i] < b; ++i) {
            const double from = std::fmax(a, t[i]), to = std::fmin(b, t[i + 1]);
            if (pass == 0 && i > first && t[i + 1] < b) continue;
            part_of(fleet, v, i, from, to, arc);
            const int n = arc.degree;
            for (int d = 0; d < fleet_axes; ++d) {
                if (pass == 0 && i == first) chord.from[d] = scaled(arc.value[d][0], d, downwash);
                last[d] = scaled(arc.value[d][n], d, downwash);
            }
            if (pass == 0) continue;
            for (int j = 0; j <= n; ++j) {
                const double share = (from - a + (to - from) * (n > 0 ? double(j) / n : 0.0)) / (b - a);
                double square = 0.0;
                for (int d = 0; d < fleet_axes; ++d) {
                    const double value = scaled(arc.value[d][j], d, downwash);
                    const double away = std::fabs(value - (chord.from[d] + share * chord.move[d])) + arc.error[d][j];
                    square += away * away;
                    size = std::fmax(size, std::fabs(value));
                }
                farthest = std::fmax(farthest, square);
            }
        }
        if (pass == 0)
            for (int d = 0; d < fleet_axes; ++d) chord.move[d] = last[d] - chord.from[d];
    }
    chord.spread = std::sqrt(farthest) * (1.0 + 16.0 * unit) + 256.0 * unit * size;
    return chord;
}

// All chords of a cell, (vehicles,), and their boxes.
inline void fill_cell(const FleetCurves &fleet, double a, double b, double downwash, Curve &arc, Chord *chords, Sorted *boxes) {
    for (Integer v = 0; v < fleet.vehicles; ++v) {
        const Chord &chord = chords[v] = chord_of(fleet, v, a, b, downwash, arc);
        boxes[v].vehicle = v;
        for (int d = 0; d < fleet_axes; ++d) {
            const double from = chord.from[d], to = from + chord.move[d];
            boxes[v].low[d] = std::fmin(from, to) - chord.spread;
            boxes[v].high[d] = std::fmax(from, to) + chord.spread;
        }
    }
}

// Least distance of two chords.
inline double chord_distance(const Chord &one, const Chord &two) {
    double apart[fleet_axes], move[fleet_axes], along = 0.0, square = 0.0;
    for (int d = 0; d < fleet_axes; ++d) {
        apart[d] = one.from[d] - two.from[d];
        move[d] = one.move[d] - two.move[d];
        along += apart[d] * move[d];
        square += move[d] * move[d];
    }
    const double share = square > 0.0 ? std::fmin(1.0, std::fmax(0.0, -along / square)) : 0.0;
    double sum = 0.0;
    for (int d = 0; d < fleet_axes; ++d) {
        const double value = apart[d] + share * move[d];
        sum += value * value;
    }
    return std::sqrt(sum);
}

}  // namespace minsnap

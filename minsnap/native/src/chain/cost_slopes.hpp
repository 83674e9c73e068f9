// Cost of a leg, and how it changes with the leg's duration and displacement while the physical derivatives at its knots
// are held: by the envelope theorem that is how the optimal cost changes (J. M. Danskin, "The theory of max-min", 1967).
//
// With scaled ends e (leg.hpp) and A the orders of their entries, the cost is c = T^(1-2k) |R e|^2, and
//     T dc/dT = T^(1-2k) 2 (R e) . R ((1 - 2k) / 2 + A) e:
// sums of squares and of products of small numbers, in which nothing cancels.
#pragma once

#include "polynomials/leg.hpp"

namespace minsnap {

struct LegSlopes {
    double cost = 0.0;
    double time = 0.0;  // T dc/dT
};

// One axis of a leg: derivatives 1 ... k - 1 at its start and end, each `stride` apart. Adds to the slopes; returns dc/dd
// for the displacement d.
template <int half>
inline double add_axis(const LegTables<double> &tables, const double (&powers)[half + 1], const double *start, const double *end,
                       int stride, double displacement, LegSlopes &slopes) {
    double cost = 0.0, time = 0.0, force = 0.0, left[half], right[half];
    for (int a = 1; a < half; ++a) {
        left[a] = start[(a - 1) * stride] * powers[a];
        right[a] = end[(a - 1) * stride] * powers[a];
    }
    for (int i = 0; i < half; ++i) {
        const double *row = tables.root[i];
        double value = row[half] * displacement, slope = (1 - 2 * half) * value;
        for (int a = 1; a < half; ++a) {
            const double part = row[a] * left[a] + row[half + a] * right[a];
            value += part;
            slope += (1 - 2 * half + 2 * a) * part;
        }
        cost += value * value;
        time += value * slope;
        force += value * row[half];
    }
    slopes.cost += powers[half] * cost;
    slopes.time += powers[half] * time;
    return 2.0 * powers[half] * force;
}

// T^0 ... T^(k-1), and T^(1-2k) as the last.
template <int half>
inline void duration_powers(double duration, double (&powers)[half + 1]) {
    powers[0] = 1.0;
    for (int a = 1; a < half; ++a) powers[a] = powers[a - 1] * duration;
    powers[half] = 1.0 / (powers[half - 1] * powers[half - 1] * duration);
}

}  // namespace minsnap

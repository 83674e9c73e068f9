// Banded Cholesky factorisations of four vehicles at once, one in each lane.
//
// Rows of the lower band, [row][half + 1], the diagonal last (G. H. Golub and C. F. Van Loan, "Matrix Computations", 4th ed., section 4.3).
#pragma once

#include "arithmetic/lanes.hpp"

namespace minsnap {

constexpr int fleet_lanes = 4;
constexpr int half_band = 23, band = half_band + 1;

inline Quad lane_root(Quad value) {
    Quad root;
    for (int lane = 0; lane < fleet_lanes; ++lane) root[lane] = std::sqrt(value[lane]);
    return root;
}

// Factor in place; the diagonal becomes its inverse. False if a pivot is not positive.
inline bool lane_factor(Quad *matrix, int size) {
    bool positive = true;
    for (int r = 0; r < size; ++r) {
        Quad *row = matrix + r * band;
        const int first = r > half_band ? r - half_band : 0;
        for (int c = first; c <= r; ++c) {
            const Quad *other = matrix + c * band;
            const int begin = c > half_band + first ? c - half_band : first;
            const Quad *p = row + (begin - r + half_band), *q = other + (begin - c + half_band);
            Quad sum = row[c - r + half_band];
            for (int k = 0; k < c - begin; ++k) sum -= p[k] * q[k];
            if (c < r) {
                row[c - r + half_band] = sum * other[half_band];
                continue;
            }
            for (int lane = 0; lane < fleet_lanes; ++lane) positive = positive && sum[lane] > 0.0;
            row[half_band] = 1.0 / lane_root(sum);
        }
    }
    return positive;
}

// Solve in place with a factorisation.
inline void lane_solve(const Quad *matrix, int size, Quad *x) {
    for (int r = 0; r < size; ++r) {
        const Quad *row = matrix + r * band;
        const int first = r > half_band ? r - half_band : 0;
        Quad sum = x[r];
        for (int c = first; c < r; ++c) sum -= row[c - r + half_band] * x[c];
        x[r] = sum * row[half_band];
    }
    for (int r = size - 1; r >= 0; --r) {
        const Quad *row = matrix + r * band;
        const int first = r > half_band ? r - half_band : 0;
        const Quad value = x[r] *= row[half_band];
        for (int c = first; c < r; ++c) x[c] -= row[c - r + half_band] * value;
    }
}

}  // namespace minsnap

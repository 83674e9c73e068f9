// The inverse of a small matrix, by Gauss-Jordan elimination with pivots of the largest size in a column.
#pragma once

#include <cmath>
#include <cstddef>
#include <utility>

namespace minsnap {

// Of the first n rows and columns, which are lost; false where a pivot is not above the least.
template <std::size_t most>
bool invert(std::size_t n, double (&left)[most][most], double (&inverse)[most][most], double least) {
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j < n; ++j) inverse[i][j] = i == j ? 1.0 : 0.0;
    for (std::size_t k = 0; k < n; ++k) {
        std::size_t pivot = k;
        for (std::size_t i = k + 1; i < n; ++i)
            if (std::fabs(left[i][k]) > std::fabs(left[pivot][k])) pivot = i;
        if (!(std::fabs(left[pivot][k]) > least)) return false;
        for (std::size_t j = 0; j < n; ++j) {
            std::swap(left[k][j], left[pivot][j]);
            std::swap(inverse[k][j], inverse[pivot][j]);
        }
        const double scale = 1.0 / left[k][k];
        for (std::size_t j = 0; j < n; ++j) {
            left[k][j] *= scale;
            inverse[k][j] *= scale;
        }
        for (std::size_t i = 0; i < n; ++i) {
            const double share = left[i][k];
            if (i == k || share == 0.0) continue;
            for (std::size_t j = 0; j < n; ++j) {
                left[i][j] -= share * left[k][j];
                inverse[i][j] -= share * inverse[k][j];
            }
        }
    }
    return true;
}

}  // namespace minsnap

// Eigenvalues and eigenvectors of a small symmetric matrix, by Jacobi's rotations.
#pragma once

#include <cmath>
#include <cstddef>

namespace minsnap {

// a (n x n) becomes diagonal, the columns of v its eigenvectors (G. Golub and C. Van Loan, "Matrix Computations", 8.5).
template <std::size_t n>
void spectrum(double (&a)[n][n], double (&v)[n][n]) {
    double size = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < n; ++j) {
            v[i][j] = i == j ? 1.0 : 0.0;
            size += a[i][j] * a[i][j];
        }
    }
    for (int sweep = 0; sweep < 30; ++sweep) {
        double off = 0.0;
        for (std::size_t p = 0; p < n; ++p) {
            for (std::size_t q = p + 1; q < n; ++q) off += a[p][q] * a[p][q];
        }
        if (!(off > 1e-30 * size)) return;
        for (std::size_t p = 0; p < n; ++p) {
            for (std::size_t q = p + 1; q < n; ++q) {
                if (a[p][q] == 0.0) continue;
                const double ratio = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                const double t = (ratio >= 0.0 ? 1.0 : -1.0) / (std::abs(ratio) + std::sqrt(1.0 + ratio * ratio));
                const double c = 1.0 / std::sqrt(1.0 + t * t), s = t * c;
                for (std::size_t k = 0; k < n; ++k) {
                    const double x = a[k][p], y = a[k][q];
                    a[k][p] = c * x - s * y, a[k][q] = s * x + c * y;
                }
                for (std::size_t k = 0; k < n; ++k) {
                    const double x = a[p][k], y = a[q][k];
                    a[p][k] = c * x - s * y, a[q][k] = s * x + c * y;
                    const double left = v[k][p], right = v[k][q];
                    v[k][p] = c * left - s * right, v[k][q] = s * left + c * right;
                }
            }
        }
    }
}

}  // namespace minsnap

// Positive part of the second derivative of the Lagrangian in scaled derivatives and durations, piece by piece.
//
// The same formulas in Python, with their meaning, are time_allocation/curvature.py.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "shortest_time/joint_terms.hpp"
#include "arithmetic/small_spectrum.hpp"

namespace minsnap {

constexpr std::size_t neighbours = 3;

// What bends on one piece; arrays of the caller.
struct PieceForces {
    const double *ends, *scales, *exponents;  // ends x dim, ends, ends x 3
    const double *force;                      // ends x dim
    double own, length;
    const bool *free, *present;               // ends x dim, 3
};

class PositiveCurvature {
public:
    PositiveCurvature(std::size_t ends, std::size_t dim) : ends_(ends), dim_(dim), size_(ends * dim) {}

    // Add a share of it to a block of rows of `width` unknowns: the ends, then the durations.
    void add(const PieceForces &f, double share, double *block, std::size_t width) {
        couple(f);
        double times[neighbours][neighbours] = {};
        pull(f, times);
        orthogonalise();
        double small[2 * neighbours][2 * neighbours] = {}, vectors[2 * neighbours][2 * neighbours];
        for (std::size_t q = 0; q < neighbours; ++q) {
            for (std::size_t r = 0; r < neighbours; ++r) {
                small[q][neighbours + r] = small[neighbours + r][q] = triangle_[q][r];
                small[neighbours + q][neighbours + r] = times[q][r];
            }
        }
        spectrum(small, vectors);
        for (std::size_t k = 0; k < 2 * neighbours; ++k) {
            if (small[k][k] > 0.0) add_square(share * small[k][k], vectors, k, block, width);
        }
    }

private:
    static constexpr std::size_t most = joint_ends * joint_dim;

    // Size of a change of each end that counts as large.
    static double natural(std::size_t order) {
        constexpr double peaks[] = {1.0, 1.0, 8.0, 60.0, 500.0, 5000.0};
        return peaks[order];
    }

    // Between scaled ends and durations.
    void couple(const PieceForces &f) {
        for (std::size_t j = 0; j < ends_; ++j) {
            const double unit = f.length / natural(j % (ends_ / 2)) / f.scales[j];
            for (std::size_t d = 0; d < dim_; ++d) {
                const std::size_t at = j * dim_ + d;
                unit_[at] = unit;
                const double force = f.free[at] ? f.force[at] * f.scales[j] * unit : 0.0;
                for (std::size_t q = 0; q < neighbours; ++q) {
                    mixed_[q][at] = f.present[q] ? force * f.exponents[j * neighbours + q] : 0.0;
                }
            }
        }
    }

    // Between durations.
    void pull(const PieceForces &f, double (&times)[neighbours][neighbours]) const {
        for (std::size_t j = 0; j < ends_; ++j) {
            double pulled = 0.0;
            for (std::size_t d = 0; d < dim_; ++d) pulled += f.force[j * dim_ + d] * f.ends[j * dim_ + d];
            const double *e = f.exponents + j * neighbours;
            for (std::size_t q = 0; q < neighbours; ++q) {
                for (std::size_t r = 0; r < neighbours; ++r) times[q][r] += pulled * e[q] * e[r];
                times[q][q] -= pulled * e[q];
            }
        }
        times[1][1] += f.own;
        for (std::size_t q = 0; q < neighbours; ++q) {
            for (std::size_t r = 0; r < neighbours; ++r) times[q][r] = f.present[q] && f.present[r] ? times[q][r] : 0.0;
        }
    }

    // mixed = frame . triangle, twice as Gram and Schmidt; a column that depends on others leaves none in the frame.
    void orthogonalise() {
        for (std::size_t q = 0; q < neighbours; ++q) {
            double *column = mixed_[q];
            for (std::size_t r = 0; r < neighbours; ++r) triangle_[r][q] = 0.0;
            const double before = length(column);
            for (int round = 0; round < 2; ++round) {
                for (std::size_t r = 0; r < q; ++r) {
                    double share = 0.0;
                    for (std::size_t i = 0; i < size_; ++i) share += mixed_[r][i] * column[i];
                    for (std::size_t i = 0; i < size_; ++i) column[i] -= share * mixed_[r][i];
                    triangle_[r][q] += share;
                }
            }
            const double rest = length(column);
            const bool kept = rest > 1e-14 * before;
            triangle_[q][q] = kept ? rest : 0.0;
            for (std::size_t i = 0; i < size_; ++i) column[i] = kept ? column[i] / rest : 0.0;
        }
    }

    double length(const double *column) const {
        double sum = 0.0;
        for (std::size_t i = 0; i < size_; ++i) sum += column[i] * column[i];
        return std::sqrt(sum);
    }

    void add_square(double value, const double (&vectors)[2 * neighbours][2 * neighbours], std::size_t k, double *block,
                    std::size_t width) {
        double u[most + neighbours];
        for (std::size_t i = 0; i < size_; ++i) {
            double sum = 0.0;
            for (std::size_t q = 0; q < neighbours; ++q) sum += mixed_[q][i] * vectors[q][k];
            u[i] = sum / unit_[i];
        }
        for (std::size_t q = 0; q < neighbours; ++q) u[size_ + q] = vectors[neighbours + q][k];
        for (std::size_t a = 0; a < size_ + neighbours; ++a) {
            const double factor = value * u[a];
            for (std::size_t b = 0; b < size_ + neighbours; ++b) block[a * width + b] += factor * u[b];
        }
    }

    std::size_t ends_, dim_, size_;
    double mixed_[neighbours][most], unit_[most], triangle_[neighbours][neighbours];
};

}  // namespace minsnap

// A symmetric matrix that is zero before a first column of each row, and its factors L D L' without pivoting, which exist in any order for quasi-definite
// matrices (R. J. Vanderbei, "Symmetric quasi-definite matrices", SIAM J. Optim. 5, 1995; envelopes: A. George and J. Liu, 1981).
#pragma once

#include <cstddef>

#include "basics/buffer.hpp"

namespace minsnap {

class Envelope {
public:
    // Lay the matrix out: ``first`` has the first column of each row.
    [[nodiscard]] bool allocate(const int *first, int size) {
        size_ = size;
        if (!first_.allocate(std::size_t(size)) || !start_.allocate(std::size_t(size) + 1)) return false;
        start_[0] = 0;
        for (int i = 0; i < size; ++i) {
            first_[i] = first[i];
            start_[i + 1] = start_[i] + std::size_t(i - first[i] + 1);
        }
        return values_.allocate(start_[size]);
    }

    void clear() {
        for (std::size_t k = 0; k < start_[size_]; ++k) values_[k] = 0.0;
    }

    double &at(int row, int column) { return row < column ? at(column, row) : values_[start_[row] + std::size_t(column - first_[row])]; }

    // Replace the matrix by its factors; false where a pivot is zero.
    [[nodiscard]] bool factor() {
        for (int i = 0; i < size_; ++i) {
            double *const row = shifted(i);
            for (int j = first_[i]; j < i; ++j) {
                const double *const other = shifted(j);
                const int from = first_[i] > first_[j] ? first_[i] : first_[j];
                double sum = row[j];
                for (int k = from; k < j; ++k) sum -= row[k] * other[k];
                row[j] = sum;  // times the pivot of j, until below
            }
            double pivot = row[i];
            for (int j = first_[i]; j < i; ++j) {
                const double scaled = row[j] / shifted(j)[j];
                pivot -= row[j] * scaled;
                row[j] = scaled;
            }
            if (pivot == 0.0 || pivot != pivot) return false;
            row[i] = pivot;
        }
        return true;
    }

    void solve(double *x) const {
        for (int i = 0; i < size_; ++i) {
            const double *const row = shifted(i);
            for (int k = first_[i]; k < i; ++k) x[i] -= row[k] * x[k];
        }
        for (int i = 0; i < size_; ++i) x[i] /= shifted(i)[i];
        for (int i = size_ - 1; i >= 0; --i) {
            const double *const row = shifted(i);
            for (int k = first_[i]; k < i; ++k) x[k] -= row[k] * x[i];
        }
    }

private:
    double *shifted(int row) { return values_.data() + start_[row] - first_[row]; }
    const double *shifted(int row) const { return values_.data() + start_[row] - first_[row]; }

    int size_ = 0;
    Buffer<int> first_;
    Buffer<std::size_t> start_;
    Buffer<double> values_;
};

}  // namespace minsnap

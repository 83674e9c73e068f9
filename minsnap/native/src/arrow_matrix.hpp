// A symmetric positive definite matrix that is banded but for a dense border, and its Cholesky factor.
//
//     [ B  E' ]     B banded, rows of lower half-bandwidth `reach`
//     [ E  D  ]     E, D: the last `border` unknowns
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "buffer.hpp"
#include "dot.hpp"

namespace minsnap {

class ArrowMatrix {
public:
    // Make room; false if there is no memory.
    [[nodiscard]] bool shape(std::size_t size, std::size_t border, std::size_t reach) {
        inner_ = size - border;
        border_ = border;
        reach_ = reach;
        return band_.allocate(inner_ * (reach + 1) + 1) && edge_.allocate(border * size + 1);
    }

    void clear() {
        std::fill(band_.data(), band_.data() + inner_ * (reach_ + 1), 0.0);
        std::fill(edge_.data(), edge_.data() + border_ * (inner_ + border_), 0.0);
    }

    // Add to the entry at row >= column; the row's band must reach the column.
    void add(std::size_t row, std::size_t column, double value) {
        if (row < inner_) {
            band_[row * (reach_ + 1) + reach_ + column - row] += value;
        } else {
            edge(row - inner_)[column] += value;
        }
    }

    // Factor in place: LL' with the rows of L where those of the matrix were. False where a pivot is not positive.
    [[nodiscard]] bool factor() {
        for (std::size_t i = 0; i < inner_; ++i) {
            if (!factor_row(band_row(i), i, first_of(i))) return false;
        }
        for (std::size_t k = 0; k < border_; ++k) {
            if (!factor_row(edge(k), inner_ + k, 0)) return false;
        }
        return true;
    }

    // Solve LL' x = b in place.
    void solve(double *x) const {
        const std::size_t size = inner_ + border_;
        for (std::size_t i = 0; i < size; ++i) {
            const double *row = row_of(i);
            const std::size_t first = first_of(i);
            x[i] = (x[i] - dot(row + first, x + first, i - first)) / row[i];
        }
        for (std::size_t i = size; i-- > 0;) {
            const double *row = row_of(i);
            x[i] /= row[i];
            for (std::size_t j = first_of(i); j < i; ++j) x[j] -= row[j] * x[i];
        }
    }

private:
    std::size_t first_of(std::size_t i) const { return i < inner_ && i > reach_ ? i - reach_ : 0; }

    // Pointers such that [column] is the entry in that column of the row.
    double *band_row(std::size_t i) { return band_.data() + i * (reach_ + 1) + reach_ - i; }
    const double *band_row(std::size_t i) const { return band_.data() + i * (reach_ + 1) + reach_ - i; }
    double *edge(std::size_t k) { return edge_.data() + k * (inner_ + border_); }
    const double *edge(std::size_t k) const { return edge_.data() + k * (inner_ + border_); }
    const double *row_of(std::size_t i) const { return i < inner_ ? band_row(i) : edge(i - inner_); }

    bool factor_row(double *row, std::size_t i, std::size_t first) {
        for (std::size_t j = first; j < i; ++j) {
            const double *other = row_of(j);
            const std::size_t begin = std::max(first, first_of(j));
            row[j] = (row[j] - dot(row + begin, other + begin, j - begin)) / other[j];
        }
        const double pivot = row[i] - dot(row + first, row + first, i - first);
        if (!(pivot > 0.0)) return false;
        row[i] = std::sqrt(pivot);
        return true;
    }

    Buffer<double> band_, edge_;
    std::size_t inner_ = 0, border_ = 0, reach_ = 0;
};

}  // namespace minsnap

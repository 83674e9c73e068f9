// Linear programmes of few unknowns: minimise c'x over A x <= b, within a large cube.
//
// A dual simplex method over bases of n rows (C. E. Lemke, "The dual method of solving the linear programming problem",
// Naval Research Logistics Quarterly 1, 1954). It begins at the corner of the cube where c'x is least, and exchanges rows of
// the basis until no row is violated. The rule takes the most violated row, and after many steps the first one (R. G. Bland,
// "New finite pivoting rules for the simplex method", Mathematics of Operations Research 2, 1977), which cannot cycle.
// Every step inverts its basis anew, with pivots and one step of refinement, so that rounding does not add up. A row is
// violated where its excess is above `rounding` times the sum of the sizes of its terms.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "basics/buffer.hpp"
#include "linear/inverse.hpp"

namespace minsnap {

class FewUnknowns {
public:
    static constexpr std::size_t most = 8;
    enum class End { least, empty, undecided };

    // Begin a programme of n unknowns and up to `rows` rows; false if there is no memory.
    bool begin(std::size_t n, std::size_t rows) {
        n_ = n;
        return rows_.allocate((rows + 2 * n) * n) && sides_.allocate(rows + 2 * n);
    }

    // The cube |x| <= reach, row after row; `add` follows.
    void within(double reach) {
        count_ = 0;
        for (std::size_t i = 0; i < n_; ++i)
            for (const double sign : {1.0, -1.0}) {
                double *row = add(reach);
                for (std::size_t j = 0; j < n_; ++j) row[j] = j == i ? sign : 0.0;
            }
    }

    // A row, of which the caller fills the n coefficients.
    double *add(double side) {
        sides_[count_] = side;
        return rows_.data() + n_ * count_++;
    }

    // Least value of c'x. Where that does not tell, the first corner is at the end `side` (1 or -1) of the cube, and of rows that may leave
    // the first or the last does: two opposite sides lead to opposite corners where the least value has several.
    End solve(const double *c, double side) {
        for (std::size_t i = 0; i < n_; ++i) basis_[i] = 2 * i + ((c[i] != 0.0 ? -c[i] : side) > 0.0 ? 0 : 1);
        for (std::size_t step = 0; step < patience * 10; ++step) {
            if (!invert_basis()) return End::undecided;
            place();
            const std::size_t entering = violated(step >= patience);
            if (entering == count_) return End::least;
            const std::size_t leaving = exchanged(entering, c, step >= patience ? 0.0 : side);
            if (leaving == n_) return End::empty;
            basis_[leaving] = entering;
        }
        return End::undecided;
    }

    const double *x() const { return x_; }

    // Whether the corner that was found lies on the cube.
    bool on_cube() const {
        return std::any_of(basis_, basis_ + n_, [&](std::size_t row) { return row < 2 * n_; });
    }

private:
    static constexpr std::size_t patience = 200;  // steps after which the first violated row enters
    static constexpr double rounding = 0x1p-46;   // share of the terms of a row that is none
    static constexpr double dependent = 0x1p-34;  // share of the largest coefficient in the basis that is none
    static constexpr double singular = 0x1p-48;   // of the row, a pivot of the basis that is none

    const double *row(std::size_t i) const { return rows_.data() + n_ * i; }

    bool invert_basis() {
        double left[most][most];
        for (std::size_t i = 0; i < n_; ++i)
            for (std::size_t j = 0; j < n_; ++j) left[i][j] = row(basis_[i])[j];
        return invert(n_, left, inverse_, singular);
    }

    // The corner of the basis, refined once.
    void place() {
        std::fill(x_, x_ + n_, 0.0);
        for (int pass = 0; pass < 2; ++pass) {
            double left[most];
            for (std::size_t i = 0; i < n_; ++i) {
                left[i] = sides_[basis_[i]];
                for (std::size_t j = 0; j < n_; ++j) left[i] -= row(basis_[i])[j] * x_[j];
            }
            for (std::size_t i = 0; i < n_; ++i)
                for (std::size_t j = 0; j < n_; ++j) x_[i] += inverse_[i][j] * left[j];
        }
    }

    // The row that is violated most, or the first one; the number of rows where none is.
    std::size_t violated(bool first) const {
        std::size_t worst = count_;
        double most_excess = 0.0;
        for (std::size_t i = 0; i < count_; ++i) {
            double sum = 0.0, size = std::fabs(sides_[i]);
            for (std::size_t j = 0; j < n_; ++j) {
                const double term = row(i)[j] * x_[j];
                sum += term;
                size += std::fabs(term);
            }
            const double excess = sum - sides_[i];
            if (!(excess > rounding * size) || !(excess > most_excess) || in_basis(i)) continue;
            if (first) return i;
            most_excess = excess;
            worst = i;
        }
        return worst;
    }

    bool in_basis(std::size_t i) const { return std::find(basis_, basis_ + n_, i) != basis_ + n_; }

    // The place of the row that leaves for another, whose multiplier falls to zero first; n where none does: no point satisfies
    // all rows then.
    std::size_t exchanged(std::size_t entering, const double *c, double side) const {
        double shares[most], multipliers[most], largest = 0.0;
        for (std::size_t j = 0; j < n_; ++j) {
            shares[j] = multipliers[j] = 0.0;
            for (std::size_t i = 0; i < n_; ++i) {
                shares[j] += row(entering)[i] * inverse_[i][j];
                multipliers[j] -= c[i] * inverse_[i][j];
            }
            largest = std::max(largest, std::fabs(shares[j]));
        }
        std::size_t leaving = n_;
        double least = 0.0;
        for (std::size_t j = 0; j < n_; ++j) {
            if (!(shares[j] > dependent * largest)) continue;
            const double ratio = std::max(multipliers[j], 0.0) / shares[j];
            if (leaving < n_ && !(ratio < least) && !(ratio == least && preferred(shares, leaving, j, side))) continue;
            leaving = j;
            least = ratio;
        }
        return leaving;
    }

    // Of two rows that may leave the one with the larger share, unless they are alike; by the rule that cannot cycle the first one.
    bool preferred(const double *shares, std::size_t known, std::size_t other, double side) const {
        const bool before = basis_[other] < basis_[known];
        if (side == 0.0) return before;
        if (shares[other] > 2.0 * shares[known] || shares[known] > 2.0 * shares[other]) return shares[other] > shares[known];
        return before == (side < 0.0);
    }

    Buffer<double> rows_, sides_;
    std::size_t n_ = 0, count_ = 0, basis_[most];
    double inverse_[most][most], x_[most];
};

}  // namespace minsnap

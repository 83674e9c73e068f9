// A symmetric positive definite matrix whose rows begin at different columns, and its factor LL' in the same places.
//
// L has no entries left of the first one of a row, so that the unknowns of neighbouring pieces make a band, and an
// unknown that meets many others, such as a slack, a whole row. Four rows make a block, kept column by column from the
// first column of the four: a product of blocks is then a sum over lanes of four rows, without sums across lanes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "basics/buffer.hpp"
#include "arithmetic/lanes.hpp"
#include "arithmetic/wide.hpp"

namespace minsnap {

class ProfileMatrix {
public:
    // Make room for rows that begin at the columns `first` (size), none right of the diagonal; false if there is no memory.
    [[nodiscard]] bool shape(std::size_t size, const std::size_t *first) {
        size_ = size;
        blocks_ = (size + side - 1) / side;
        if (!first_.allocate(blocks_ + 1) || !begin_.allocate(blocks_ + 1) || !inverse_.allocate(side * blocks_ + 1)) return false;
        count_ = 0;
        for (std::size_t b = 0; b < blocks_; ++b) {
            std::size_t least = side * b;
            for (std::size_t i = side * b; i < std::min(size, side * (b + 1)); ++i) least = std::min(least, first[i]);
            first_[b] = least / side * side;
            begin_[b] = count_;
            count_ += side * (b + 1) - first_[b];
        }
        return values_.allocate(count_ + 1);
    }

    void clear() {
        std::fill(values_.data(), values_.data() + count_, Quad{});
        for (std::size_t i = size_; i < side * blocks_; ++i) row(i).add(i, 1.0);
    }

    // The entries of a row from its diagonal to the left: add to those not left of its first column.
    class Row {
    public:
        void add(std::size_t column, double value) { diagonal_[-static_cast<std::ptrdiff_t>(side * (row_ - column))] += value; }

    private:
        friend class ProfileMatrix;
        Row(double *diagonal, std::size_t row) : diagonal_(diagonal), row_(row) {}
        double *diagonal_;
        std::size_t row_;
    };

    Row row(std::size_t i) {
        const std::size_t b = i / side;
        Quad &diagonal = values_[begin_[b] + i - first_[b]];
        return {reinterpret_cast<double *>(&diagonal) + i % side, i};
    }

    // Factor in place. False where a pivot is not positive.
    [[nodiscard]] bool factor() { return wide() ? factor_wide() : factor_in(); }

    // Solve LL' x = b in place.
    void solve(double *x) const { wide() ? solve_wide(x) : solve_in(x); }

private:
    static constexpr std::size_t side = 4;

    MINSNAP_WIDE bool factor_wide() { return factor_in(); }
    MINSNAP_WIDE void solve_wide(double *x) const { solve_in(x); }

    MINSNAP_INLINE bool factor_in() {
        for (std::size_t b = 0; b < blocks_; ++b) {
            Quad *mine = &values_[begin_[b]];
            const std::size_t first = first_[b];
            for (std::size_t c = first / side; c < b; ++c) take_off(mine, first, c);
            Quad *own = mine + (side * b - first);
            take_squares(mine, own);
            for (std::size_t j = 0; j < side; ++j) {
                const double pivot = own[j][static_cast<int>(j)];
                if (!(pivot > 0.0)) return false;
                const double inverse = inverse_[side * b + j] = 1.0 / std::sqrt(pivot);
                own[j] *= inverse;
                for (std::size_t k = j + 1; k < side; ++k) own[k] -= own[j] * own[j][static_cast<int>(k)];
            }
        }
        return true;
    }

    // Columns of block c in the rows of a block that begins at a column: less the products with rows c, then divided by
    // the triangle of c.
    MINSNAP_INLINE void take_off(Quad *mine, std::size_t first, std::size_t c) const {
        const std::size_t begin = std::max(first, first_[c]), end = side * c;
        const Quad *left = mine + (begin - first), *other = &values_[begin_[c] + begin - first_[c]];
        Quad *found = mine + (end - first);
        Quad p = found[0], q = found[1], r = found[2], s = found[3];
        for (std::size_t k = 0; k < end - begin; ++k) {
            p -= left[k] * other[k][0];
            q -= left[k] * other[k][1];
            r -= left[k] * other[k][2];
            s -= left[k] * other[k][3];
        }
        const Quad *triangle = other + (end - begin);
        const double *inverse = &inverse_[end];
        p *= inverse[0];
        q = (q - p * triangle[0][1]) * inverse[1];
        r = ((r - p * triangle[0][2]) - q * triangle[1][2]) * inverse[2];
        s = (((s - p * triangle[0][3]) - q * triangle[1][3]) - r * triangle[2][3]) * inverse[3];
        found[0] = p, found[1] = q, found[2] = r, found[3] = s;
    }

    // The square on the diagonal less the products of the rows with each other.
    MINSNAP_INLINE void take_squares(const Quad *mine, Quad *own) const {
        Quad p = own[0], q = own[1], r = own[2], s = own[3];
        for (const Quad *left = mine; left != own; ++left) {
            p -= *left * (*left)[0];
            q -= *left * (*left)[1];
            r -= *left * (*left)[2];
            s -= *left * (*left)[3];
        }
        own[0] = p, own[1] = q, own[2] = r, own[3] = s;
    }

    MINSNAP_INLINE void solve_in(double *x) const {
        for (std::size_t b = 0; b < blocks_; ++b) {
            const Quad *mine = &values_[begin_[b]];
            const std::size_t first = first_[b], begin = side * b;
            Quad p = read(x, b), q{}, r{}, s{};
            for (std::size_t k = first; k < begin; k += side, mine += side) {
                p -= mine[0] * x[k];
                q -= mine[1] * x[k + 1];
                r -= mine[2] * x[k + 2];
                s -= mine[3] * x[k + 3];
            }
            p = (p + q) + (r + s);
            for (std::size_t j = 0; j < side; ++j) {
                const double value = p[static_cast<int>(j)] * inverse_[begin + j];
                p -= mine[j] * value;
                if (begin + j < size_) x[begin + j] = value;
            }
        }
        for (std::size_t b = blocks_; b-- > 0;) {
            const Quad *mine = &values_[begin_[b]];
            const std::size_t first = first_[b], begin = side * b;
            const Quad *own = mine + (begin - first);
            Quad y = read(x, b);
            for (std::size_t j = side; j-- > 0;) {
                double value = y[static_cast<int>(j)];
                for (std::size_t i = j + 1; i < side; ++i) value -= own[j][static_cast<int>(i)] * y[static_cast<int>(i)];
                y[static_cast<int>(j)] = value * inverse_[begin + j];
                if (begin + j < size_) x[begin + j] = y[static_cast<int>(j)];
            }
            for (std::size_t k = first; k < begin; ++k, ++mine) {
                const Quad product = *mine * y;
                x[k] -= (product[0] + product[1]) + (product[2] + product[3]);
            }
        }
    }

    // Values of a block, 0 beyond the last one.
    MINSNAP_INLINE Quad read(const double *x, std::size_t b) const {
        Quad found{};
        for (std::size_t j = side * b; j < std::min(size_, side * (b + 1)); ++j) found[static_cast<int>(j % side)] = x[j];
        return found;
    }

    std::size_t size_ = 0, blocks_ = 0, count_ = 0;
    Buffer<std::size_t> first_, begin_;
    Buffer<Quad> values_;
    Buffer<double> inverse_;
};

}  // namespace minsnap

// A symmetric matrix with a band and a dense border, as of a chain or of a ring of pieces, and its Cholesky factor (G. H. Golub and
// C. F. Van Loan, "Matrix Computations", section 4.3.5). Sums have one order; loops run along contiguous columns.
#pragma once

#include <algorithm>
#include <cmath>

#include "arithmetic/lanes.hpp"
#include "basics/buffer.hpp"

namespace minsnap {

template <int width>  // half bandwidth
class BorderedBand {
public:
    static constexpr int together = Lanes<Quad>::count, lead = (width / together + 2) * together;  // columns end with zeros for whole steps

    int size = 0, banded = 0;  // unknowns, and those of them in the band

    [[nodiscard]] bool allocate(int most, int border) {
        const auto count = static_cast<std::size_t>(most);
        return band_.allocate(count * lead + lead * (width + 1)) && rows_.allocate(count * border + border * border + 1);
    }

    void clear(int unknowns, int in_band) {
        size = unknowns;
        banded = in_band;
        for (std::size_t k = 0; k < band_count(); ++k) band_[k] = 0.0;
        for (std::size_t k = 0; k < row_count(); ++k) rows_[k] = 0.0;
    }

    // Add to an entry and to its mirror image.
    void add(int row, int column, double value) { at(row, column) += value; }

    // Add a symmetric block, given by columns below its diagonal, at places of which some may be the same, or none (below zero).
    template <int count>
    void add(const int *place, const double (&block)[count][count]) {
        for (int k = 0; k < count; ++k)
            for (int m = k; m < count; ++m)
                if (place[k] >= 0 && place[m] >= 0) add(place[m], place[k], (place[k] == place[m] && m != k ? 2.0 : 1.0) * block[k][m]);
    }

    // The same at places that follow each other in a band without a border; what is outside of it is left out.
    template <int count>
    void add(int first, const double (&block)[count][count]) {
        for (int k = std::max(0, -first); k < count && first + k < size; ++k) {
            double *column = band_.data() + static_cast<std::size_t>(first + k) * lead - k;
            for (int m = k; m < count && first + m < size; ++m) column[m] += block[k][m];
        }
    }

    // Hold an unknown where it is: nothing moves it, and it moves nothing.
    void hold(int place) {
        for (int k = 0; k < size; ++k)
            if (std::abs(k - place) <= width || std::max(k, place) >= banded) at(place, k) = k == place ? 1.0 : 0.0;
    }

    double &at(int row, int column) {
        if (row < column) {
            const int kept = row;
            row = column;
            column = kept;
        }
        return row < banded ? band_[static_cast<std::size_t>(column) * lead + (row - column)]
                            : rows_[static_cast<std::size_t>(row - banded) * size + column];
    }

    // This = one + factor * other; with factor 0 the diagonal grows by a trifle instead.
    void combine(const BorderedBand &one, double factor, const BorderedBand &other) {
        constexpr double trifle = 1e-11;
        size = one.size;
        banded = one.banded;
        for (std::size_t k = 0; k < band_count(); ++k) band_[k] = factor > 0.0 ? one.band_[k] + factor * other.band_[k] : one.band_[k];
        for (std::size_t k = 0; k < row_count(); ++k) rows_[k] = factor > 0.0 ? one.rows_[k] + factor * other.rows_[k] : one.rows_[k];
        if (factor == 0.0)
            for (int k = 0; k < size; ++k) at(k, k) *= 1.0 + trifle;
    }

    // Replace the matrix by its factor; false where a pivot is not positive.
    [[nodiscard]] bool factor() {
        for (int j = 0; j < banded; ++j) {
            double *column = band_.data() + static_cast<std::size_t>(j) * lead;
            if (!(column[0] > 0.0)) return false;
            const double pivot = std::sqrt(column[0]), inverse = 1.0 / pivot;
            column[0] = pivot;
            for (int c = 1; c <= width; ++c) column[c] *= inverse;
            for (int c = 1; c <= width; ++c) {
                const double share = column[c];
                if (share == 0.0) continue;
                double *later = column + static_cast<std::size_t>(c) * lead;
                for (int d = 0; d <= width - c; d += together) put_four(later + d, four(later + d) - share * four(column + c + d));
            }
        }
        return factor_border();
    }

    void solve(double *x) const {
        forward(x);
        for (int b = 0; b < size - banded; ++b) {
            const double *row = border(b);
            double sum = x[banded + b];
            for (int k = 0; k < banded + b; ++k) sum -= row[k] * x[k];
            x[banded + b] = sum / row[banded + b];
        }
        for (int b = size - banded - 1; b >= 0; --b) {
            const double *row = border(b);
            x[banded + b] /= row[banded + b];
            for (int k = 0; k < banded + b; ++k) x[k] -= row[k] * x[banded + b];
        }
        for (int j = banded - 1; j >= 0; --j) {
            const double *column = band_.data() + static_cast<std::size_t>(j) * lead;
            const int last = width < banded - 1 - j ? width : banded - 1 - j;
            Quad sum{};
            int c = 1;
            for (; c + together <= last + 1; c += together) sum += four(column + c) * four(x + j + c);
            double rest = total(sum);
            for (; c <= last; ++c) rest += column[c] * x[j + c];
            x[j] = (x[j] - rest) / column[0];
        }
    }

private:
    std::size_t band_count() const { return static_cast<std::size_t>(banded) * lead + lead * width; }
    std::size_t row_count() const { return static_cast<std::size_t>(size - banded) * size; }
    const double *border(int b) const { return rows_.data() + static_cast<std::size_t>(b) * size; }

    void forward(double *x) const {
        for (int j = 0; j < banded; ++j) {
            const double *column = band_.data() + static_cast<std::size_t>(j) * lead;
            const int last = width < banded - 1 - j ? width : banded - 1 - j;
            x[j] /= column[0];
            for (int c = 1; c <= last; ++c) x[j + c] -= column[c] * x[j];
        }
    }

    bool factor_border() {
        for (int b = 0; b < size - banded; ++b) {
            double *row = rows_.data() + static_cast<std::size_t>(b) * size;
            forward(row);
            for (int other = 0; other <= b; ++other) {
                const double *above = border(other);
                double sum = row[banded + other];
                for (int k = 0; k < banded + other; ++k) sum -= row[k] * above[k];
                if (other < b) {
                    row[banded + other] = sum / above[banded + other];
                } else {
                    if (!(sum > 0.0)) return false;
                    row[banded + b] = std::sqrt(sum);
                }
            }
        }
        return true;
    }

    Buffer<double> band_, rows_;
};

}  // namespace minsnap

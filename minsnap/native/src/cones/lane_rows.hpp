// Rows of cones on pieces of degree 7 with at most three axes, in lanes of four numbers.
//
// The small matrix of a cone has eight columns, the axes and the rest.  With G'W^-2 G = (2 v v' - G'JG) / eta^2, v = G'Jw,
// the products of a piece are two products of matrices over its cones: of the factors' squares, which do not change
// while a programme is solved, with six numbers a cone, and of the factors with fifteen.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "basics/buffer.hpp"
#include "cones/cone_entry.hpp"
#include "arithmetic/dot.hpp"
#include "arithmetic/lanes.hpp"
#include "arithmetic/wide.hpp"

namespace minsnap {

class LaneRows {
public:
    static bool suits(const PieceShape &shape, std::size_t widest) {
        return shape.ends == ends && shape.dim <= axes && shape.dim > 0 && shape.rest == rest && widest <= columns;
    }

    bool used() const { return cones_ != nullptr; }

    // False if there is no memory.
    [[nodiscard]] bool set(const PieceShape &shape, const std::size_t *first, std::size_t pieces, const ConeEntry *cones) {
        dim_ = shape.dim;
        cones_ = cones;
        std::size_t rows = 0, longest = 0;
        const std::size_t count = first[pieces];
        for (std::size_t i = 0; i < pieces; ++i) longest = std::max(longest, first[i + 1] - first[i]);
        if (!row_.allocate(count + 1)) return false;
        for (std::size_t k = 0; k < count; ++k) {
            row_[k] = rows;
            if (cones[k].form == RowForm::factored) rows += cones[k].size;
        }
        if (!matrix_.allocate(2 * rows + 2) || !fixed_.allocate(2 * columns * count + 1)) return false;
        if (!squares_.allocate(chunks * count + 1) || !factors_.allocate(2 * count + 1)) return false;
        if (!small_.allocate(small_size * longest + 1) || !listed_.allocate(longest + 1)) return false;
        if (!panel_.allocate((panel_rows + 4) * shape.width())) return false;
        wide() ? take_wide(count) : take_in(count);
        return true;
    }

    void times(std::size_t first, std::size_t last, const double *x, double *out) const {
        wide() ? times_wide(first, last, x, out) : times_in(first, last, x, out);
    }

    void add_transposed(std::size_t first, std::size_t last, const double *y, double *x) const {
        wide() ? add_transposed_wide(first, last, y, x) : add_transposed_in(first, last, y, x);
    }

    void add_squares(std::size_t first, std::size_t last, const ConeScaling *scalings, double *block) {
        wide() ? add_squares_wide(first, last, scalings, block) : add_squares_in(first, last, scalings, block);
    }

private:
    static constexpr std::size_t ends = 8, axes = 3, rest = 5, columns = 8, chunks = 9, panel_rows = 32;
    static constexpr std::size_t pairs = 6, mixed = 15, small_size = pairs + mixed + 3;

    MINSNAP_WIDE void take_wide(std::size_t count) { take_in(count); }
    MINSNAP_WIDE void times_wide(std::size_t first, std::size_t last, const double *x, double *out) const { times_in(first, last, x, out); }
    MINSNAP_WIDE void add_transposed_wide(std::size_t first, std::size_t last, const double *y, double *x) const {
        add_transposed_in(first, last, y, x);
    }
    MINSNAP_WIDE void add_squares_wide(std::size_t first, std::size_t last, const ConeScaling *scalings, double *block) {
        add_squares_in(first, last, scalings, block);
    }

    static MINSNAP_INLINE double sum(Quad q) { return (q[0] + q[1]) + (q[2] + q[3]); }

    MINSNAP_INLINE void take_in(std::size_t count) {
        for (std::size_t k = 0; k < count; ++k) {
            if (cones_[k].form == RowForm::factored) take(k);
        }
    }

    // Bring a cone into lanes: rows of eight columns, G'JG, and the squares of the factors.
    MINSNAP_INLINE void take(std::size_t k) {
        const ConeEntry &cone = cones_[k];
        Quad *fixed = &fixed_[2 * columns * k];
        std::fill(fixed, fixed + 2 * columns, Quad{});
        for (std::size_t c = 0; c < cone.size; ++c) {
            double row[columns] = {};
            const double *given = cone.matrix + c * (dim_ + rest);
            std::copy(given, given + dim_, row);
            std::copy(given + dim_, given + dim_ + rest, row + axes);
            Quad *lines = &matrix_[2 * (row_[k] + c)];
            std::memcpy(lines, row, sizeof row);
            for (std::size_t a = 0; a < columns; ++a) {
                const double factor = c == 0 ? row[a] : -row[a];
                fixed[2 * a] += factor * lines[0];
                fixed[2 * a + 1] += factor * lines[1];
            }
        }
        double packed[4 * chunks];
        for (std::size_t i = 0, at = 0; i < ends; ++i) {
            for (std::size_t j = 0; j <= i; ++j) packed[at++] = cone.factors[i] * cone.factors[j];
        }
        std::memcpy(&squares_[chunks * k], packed, sizeof packed);
        std::memcpy(&factors_[2 * k], cone.factors, ends * sizeof(double));
    }

    MINSNAP_INLINE void spread_out(const double *x, Quad *wide) const {
        for (std::size_t j = 0; j < ends; ++j) {
            wide[j] = Quad{};
            for (std::size_t d = 0; d < dim_; ++d) wide[j][static_cast<int>(d)] = x[j * dim_ + d];
        }
    }

    MINSNAP_INLINE void times_in(std::size_t first, std::size_t last, const double *x, double *out) const {
        const std::size_t bound = ends * dim_;
        const double *others = x + bound;
        Quad along[ends];
        spread_out(x, along);
        const Quad tail{others[1], others[2], others[3], others[4]};
        for (std::size_t k = first; k < last; ++k) {
            const ConeEntry &cone = cones_[k];
            if (cone.form != RowForm::factored) {
                const bool whole = cone.form == RowForm::whole;
                const std::size_t width = whole ? bound + rest : rest;
                for (std::size_t c = 0; c < cone.size; ++c) *out++ = dot(cone.matrix + c * width, whole ? x : others, width);
                continue;
            }
            const double *f = cone.factors;
            Quad head = (f[0] * along[0] + f[1] * along[1]) + (f[2] * along[2] + f[3] * along[3]);
            head += (f[4] * along[4] + f[5] * along[5]) + (f[6] * along[6] + f[7] * along[7]);
            head[3] = others[0];
            const Quad *row = &matrix_[2 * row_[k]];
            for (std::size_t c = 0; c < cone.size; ++c, row += 2) *out++ = sum(row[0] * head + row[1] * tail);
        }
    }

    MINSNAP_INLINE void add_transposed_in(std::size_t first, std::size_t last, const double *y, double *x) const {
        const std::size_t bound = ends * dim_;
        double *others = x + bound;
        Quad along[ends] = {}, low{}, high{};
        for (std::size_t k = first; k < last; y += cones_[k].size, ++k) {
            const ConeEntry &cone = cones_[k];
            if (cone.form != RowForm::factored) {
                const bool whole = cone.form == RowForm::whole;
                const std::size_t width = whole ? bound + rest : rest;
                double *target = whole ? x : others;
                for (std::size_t c = 0; c < cone.size; ++c) {
                    for (std::size_t j = 0; j < width; ++j) target[j] += cone.matrix[c * width + j] * y[c];
                }
                continue;
            }
            const Quad *row = &matrix_[2 * row_[k]];
            Quad head = y[0] * row[0], tail = y[0] * row[1];
            for (std::size_t c = 1; c < cone.size; ++c) {
                head += y[c] * row[2 * c];
                tail += y[c] * row[2 * c + 1];
            }
            low += head;
            high += tail;
            for (std::size_t j = 0; j < ends; ++j) along[j] += cone.factors[j] * head;
        }
        for (std::size_t j = 0; j < ends; ++j) {
            for (std::size_t d = 0; d < dim_; ++d) x[j * dim_ + d] += along[j][static_cast<int>(d)];
        }
        others[0] += low[3];
        for (int q = 0; q < 4; ++q) others[q + 1] += high[q];
    }

    MINSNAP_INLINE void add_squares_in(std::size_t first, std::size_t last, const ConeScaling *scalings, double *block) {
        const std::size_t width = ends * dim_ + rest;
        std::size_t waiting = 0, listed = 0;
        Quad low[rest] = {}, high[rest] = {};
        for (std::size_t k = first; k < last; ++k) {
            const ConeEntry &cone = cones_[k];
            if (cone.form == RowForm::factored) {
                shrink(k, scalings[k], small_.data() + small_size * listed, low, high);
                listed_[listed++] = k;
            } else if (cone.form == RowForm::whole && cone.size == 1) {
                if (waiting == panel_rows) waiting = flush(waiting, width, block);
                const double size = 1.0 / scalings[k].eta;
                double *row = panel_.data() + waiting++ * width;
                for (std::size_t j = 0; j < width; ++j) row[j] = size * cone.matrix[j];
            } else {
                add_other(cone, scalings[k], width, block);
            }
        }
        flush(waiting, width, block);
        add_pairs(listed, width, block);
        add_mixed(listed, width, block);
        for (std::size_t q = 0; q < rest; ++q) {
            double *line = block + (ends * dim_ + q) * width + ends * dim_;
            line[0] += low[q][3];
            for (std::size_t r = 1; r <= q; ++r) line[r] += high[q][static_cast<int>(r) - 1];
        }
    }

    // The small matrix of a cone: six numbers for the axes, fifteen between these and the rest, and the rest summed.
    MINSNAP_INLINE void shrink(std::size_t k, const ConeScaling &scaling, double *out, Quad *low, Quad *high) const {
        const std::size_t size = cones_[k].size;
        const Quad *row = &matrix_[2 * row_[k]], *fixed = &fixed_[2 * columns * k];
        Quad v = scaling.w[0] * row[0], u = scaling.w[0] * row[1];
        for (std::size_t c = 1; c < size; ++c) {
            v -= scaling.w[c] * row[2 * c];
            u -= scaling.w[c] * row[2 * c + 1];
        }
        const double share = 1.0 / (scaling.eta * scaling.eta);
        const Quad twice = (2.0 * share) * v, second = (2.0 * share) * u;
        const double factor[columns] = {twice[0], twice[1], twice[2], twice[3], second[0], second[1], second[2], second[3]};
        std::size_t at = 0;
        for (std::size_t d = 0; d < axes; ++d) {
            const Quad line = factor[d] * v - share * fixed[2 * d];
            for (std::size_t e = 0; e <= d; ++e) out[at++] = line[static_cast<int>(e)];
        }
        for (std::size_t q = 0; q < rest; ++q) {
            const Quad line = factor[axes + q] * v - share * fixed[2 * (axes + q)];
            low[q] += line;
            high[q] += factor[axes + q] * u - share * fixed[2 * (axes + q) + 1];
            for (std::size_t d = 0; d < axes; ++d) out[at++] = line[static_cast<int>(d)];
        }
    }

    MINSNAP_INLINE void add_pairs(std::size_t listed, std::size_t width, double *block) const {
        double sums[pairs][4 * chunks];
        for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
            Quad found[pairs] = {};
            const double *small = small_.data();
            for (std::size_t n = 0; n < listed; ++n, small += small_size) {
                const Quad square = squares_[chunks * listed_[n] + chunk];
                MINSNAP_UNROLL
                for (std::size_t i = 0; i < pairs; ++i) found[i] += small[i] * square;
            }
            for (std::size_t i = 0; i < pairs; ++i) std::memcpy(sums[i] + 4 * chunk, &found[i], sizeof(Quad));
        }
        std::size_t pair = 0;
        for (std::size_t d = 0; d < axes; ++d) {
            for (std::size_t e = 0; e <= d; ++e, ++pair) {
                if (d < dim_) place(sums[pair], d, e, width, block);
            }
        }
    }

    // Put the sums of two axes into the lower triangle.
    MINSNAP_INLINE void place(const double *packed, std::size_t d, std::size_t e, std::size_t width, double *block) const {
        for (std::size_t i = 0; i < ends; ++i) {
            for (std::size_t j = 0; j <= i; ++j, ++packed) {
                block[(i * dim_ + d) * width + j * dim_ + e] += *packed;
                if (i != j && d != e) block[(i * dim_ + e) * width + j * dim_ + d] += *packed;
            }
        }
    }

    MINSNAP_INLINE void add_mixed(std::size_t listed, std::size_t width, double *block) const {
        for (std::size_t half = 0; half < 2; ++half) {
            for (std::size_t part = 0; part < mixed; part += rest) {
                Quad found[rest] = {};
                const double *small = small_.data() + pairs + part;
                for (std::size_t n = 0; n < listed; ++n, small += small_size) {
                    const Quad factors = factors_[2 * listed_[n] + half];
                    MINSNAP_UNROLL
                    for (std::size_t i = 0; i < rest; ++i) found[i] += small[i] * factors;
                }
                for (std::size_t i = 0; i < rest; ++i) {
                    const std::size_t q = (part + i) / axes, d = (part + i) % axes;
                    if (d >= dim_) continue;
                    double *line = block + (ends * dim_ + q) * width + 4 * half * dim_ + d;
                    for (std::size_t j = 0; j < 4; ++j) line[j * dim_] += found[i][static_cast<int>(j)];
                }
            }
        }
    }

    MINSNAP_INLINE std::size_t flush(std::size_t rows, std::size_t width, double *block) {
        const std::size_t even = (rows + 3) / 4 * 4;
        std::fill(panel_.data() + rows * width, panel_.data() + even * width, 0.0);
        add_lower_squares(panel_.data(), even, width, block);
        return 0;
    }

    // Cones of several whole rows, and bounds of the rest.
    void add_other(const ConeEntry &cone, const ConeScaling &scaling, std::size_t width, double *block) {
        const std::size_t count = cone.form == RowForm::whole ? width : rest, shift = width - count;
        double one[columns * (ends * axes + rest)];
        scale_columns(scaling, cone.matrix, cone.size, count, one);
        for (std::size_t c = 0; c < cone.size; ++c) {
            const double *row = one + c * count;
            for (std::size_t a = 0; a < count; ++a) {
                if (row[a] == 0.0) continue;
                double *line = block + (shift + a) * width + shift;
                for (std::size_t b = 0; b <= a; ++b) line[b] += row[a] * row[b];
            }
        }
    }

    std::size_t dim_ = 0;
    const ConeEntry *cones_ = nullptr;
    Buffer<std::size_t> row_, listed_;
    Buffer<Quad> matrix_, fixed_, squares_, factors_;
    Buffer<double> small_, panel_;
};

}  // namespace minsnap

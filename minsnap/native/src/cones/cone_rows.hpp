// The rows of the cones of a chain of pieces, each kept in the form that costs least.
//
// The unknowns of a piece are its ends, `ends` values for each of `dim` axes, and `rest` others.  A row on a derivative
// at one instant is (A (x) f) on the ends, with the factors f of the derivative shared by all rows of a cone: then
// G'SG = (A'SA) (x) (ff') costs a fraction of the product of whole rows.  Other cones have whole rows, or rows on the
// rest alone.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "basics/buffer.hpp"
#include "cones/cone_entry.hpp"
#include "cones/cone_scaling.hpp"
#include "arithmetic/dot.hpp"
#include "cones/lane_rows.hpp"

namespace minsnap {

class ConeRows {
public:
    // Take cones sorted by piece. False if there is no memory.
    [[nodiscard]] bool set(const PieceShape &shape, std::size_t pieces, const ConeEntry *cones, std::size_t count) {
        shape_ = shape;
        cones_ = cones;
        count_ = count;
        if (!first_cone_.allocate(pieces + 1) || !first_row_.allocate(pieces + 1)) return false;
        std::fill(first_cone_.data(), first_cone_.data() + pieces + 1, std::size_t{0});
        std::fill(first_row_.data(), first_row_.data() + pieces + 1, std::size_t{0});
        widest_ = 1;
        for (std::size_t k = 0; k < count; ++k) {
            first_cone_[cones[k].piece + 1] += 1;
            first_row_[cones[k].piece + 1] += cones[k].size;
            widest_ = std::max(widest_, cones[k].size);
        }
        for (std::size_t i = 0; i < pieces; ++i) {
            first_cone_[i + 1] += first_cone_[i];
            first_row_[i + 1] += first_row_[i];
        }
        return LaneRows::suits(shape, widest_) ? lanes_.set(shape, first_cone_.data(), pieces, cones) : make_room();
    }

    const PieceShape &shape() const { return shape_; }
    std::size_t cones() const { return count_; }
    std::size_t rows(std::size_t pieces) const { return first_row_[pieces]; }
    std::size_t first_row(std::size_t piece) const { return first_row_[piece]; }
    std::size_t size_of(std::size_t cone) const { return cones_[cone].size; }

    // out = G x over the rows of a piece, for its unknowns x.
    void times(std::size_t piece, const double *x, double *out) const {
        if (lanes_.used()) return lanes_.times(first_cone_[piece], first_cone_[piece + 1], x, out);
        times_of(piece, x, out);
    }

    // x += G'y for the rows of a piece.
    void add_transposed(std::size_t piece, const double *y, double *x) const {
        if (lanes_.used()) return lanes_.add_transposed(first_cone_[piece], first_cone_[piece + 1], y, x);
        add_transposed_of(piece, y, x);
    }

    // Add G'W^-2 G of a piece to the lower triangle of a square block of its unknowns.
    void add_squares(std::size_t piece, const ConeScaling *scalings, double *block) {
        if (lanes_.used()) return lanes_.add_squares(first_cone_[piece], first_cone_[piece + 1], scalings, block);
        add_squares_of(piece, scalings, block);
    }

private:
    static constexpr std::size_t most_axes_here = 64, panel_rows_ = 32;

    bool make_room() {
        const std::size_t dim = shape_.dim, small = dim + shape_.rest;
        return pairs_.allocate(shape_.ends * shape_.ends * dim * (dim + 1) / 2 + 1) && scaled_.allocate(widest_ * small + 1) &&
               small_.allocate(small * small + 1) && square_.allocate(shape_.ends * shape_.ends + 1) &&
               panel_.allocate((panel_rows_ + widest_ + 4) * shape_.width());
    }

    void times_of(std::size_t piece, const double *x, double *out) const {
        const PieceShape &shape = shape_;
        const std::size_t dim = shape.dim, rest = shape.rest, bound = shape.bound();
        double along[most_axes_here];
        for (std::size_t k = first_cone_[piece]; k < first_cone_[piece + 1]; ++k) {
            const ConeEntry &cone = cones_[k];
            if (cone.form == RowForm::factored) {
                for (std::size_t d = 0; d < dim; ++d) along[d] = 0.0;
                for (std::size_t j = 0; j < shape.ends; ++j) {
                    for (std::size_t d = 0; d < dim; ++d) along[d] += cone.factors[j] * x[j * dim + d];
                }
                for (std::size_t c = 0; c < cone.size; ++c) {
                    const double *row = cone.matrix + c * (dim + rest);
                    double sum = 0.0, more = 0.0;
                    for (std::size_t d = 0; d < dim; ++d) sum += row[d] * along[d];
                    for (std::size_t q = 0; q < rest; ++q) more += row[dim + q] * x[bound + q];
                    *out++ = sum + more;
                }
            } else {
                const bool whole = cone.form == RowForm::whole;
                const std::size_t width = whole ? shape.width() : rest;
                for (std::size_t c = 0; c < cone.size; ++c) *out++ = dot(cone.matrix + c * width, whole ? x : x + bound, width);
            }
        }
    }

    void add_transposed_of(std::size_t piece, const double *__restrict y, double *__restrict x) const {
        const PieceShape &shape = shape_;
        const std::size_t dim = shape.dim, rest = shape.rest, bound = shape.bound();
        double along[most_axes_here];
        for (std::size_t k = first_cone_[piece]; k < first_cone_[piece + 1]; y += cones_[k].size, ++k) {
            const ConeEntry &cone = cones_[k];
            if (cone.form == RowForm::factored) {
                for (std::size_t d = 0; d < dim; ++d) along[d] = 0.0;
                for (std::size_t c = 0; c < cone.size; ++c) {
                    const double *row = cone.matrix + c * (dim + rest);
                    for (std::size_t d = 0; d < dim; ++d) along[d] += row[d] * y[c];
                    for (std::size_t q = 0; q < rest; ++q) x[bound + q] += row[dim + q] * y[c];
                }
                for (std::size_t j = 0; j < shape.ends; ++j) {
                    for (std::size_t d = 0; d < dim; ++d) x[j * dim + d] += cone.factors[j] * along[d];
                }
            } else {
                const bool whole = cone.form == RowForm::whole;
                const std::size_t width = whole ? shape.width() : rest;
                double *target = whole ? x : x + bound;
                for (std::size_t c = 0; c < cone.size; ++c) {
                    for (std::size_t j = 0; j < width; ++j) target[j] += cone.matrix[c * width + j] * y[c];
                }
            }
        }
    }

    void add_squares_of(std::size_t piece, const ConeScaling *scalings, double *block) {
        const PieceShape &shape = shape_;
        const std::size_t width = shape.width(), dim = shape.dim;
        std::fill(pairs_.data(), pairs_.data() + shape.ends * shape.ends * dim * (dim + 1) / 2, 0.0);
        std::size_t waiting = 0;
        for (std::size_t k = first_cone_[piece]; k < first_cone_[piece + 1]; ++k) {
            const ConeEntry &cone = cones_[k];
            if (cone.form == RowForm::whole) {
                if (waiting + cone.size > panel_rows_) waiting = flush(waiting, width, block);
                scale_columns(scalings[k], cone.matrix, cone.size, width, panel_.data() + waiting * width);
                waiting += cone.size;
            } else if (cone.form == RowForm::factored) {
                add_factored(shape, cone, scalings[k], block);
            } else {
                add_rest(shape, cone, scalings[k], block);
            }
        }
        flush(waiting, width, block);
        gather_pairs(shape, block);
    }

    std::size_t flush(std::size_t rows, std::size_t width, double *block) {
        const std::size_t even = (rows + 3) / 4 * 4;
        std::fill(panel_.data() + rows * width, panel_.data() + even * width, 0.0);
        add_lower_squares(panel_.data(), even, width, block);
        return 0;
    }

    void add_rest(const PieceShape &shape, const ConeEntry &cone, const ConeScaling &scaling, double *block) {
        const std::size_t rest = shape.rest, width = shape.width(), bound = shape.bound();
        scale_columns(scaling, cone.matrix, cone.size, rest, scaled_.data());
        for (std::size_t c = 0; c < cone.size; ++c) {
            const double *row = scaled_.data() + c * rest;
            for (std::size_t a = 0; a < rest; ++a) {
                if (row[a] == 0.0) continue;
                double *line = block + (bound + a) * width + bound;
                for (std::size_t b = 0; b <= a; ++b) line[b] += row[a] * row[b];
            }
        }
    }

    // Small Gram matrix of a cone, (dim + rest) squared.
    void small_gram(std::size_t count, const ConeEntry &cone, const ConeScaling &scaling) {
        double *__restrict scaled = scaled_.data(), *__restrict small = small_.data();
        scale_columns(scaling, cone.matrix, cone.size, count, scaled);
        for (std::size_t a = 0; a < count; ++a) {
            for (std::size_t b = 0; b < count; ++b) small[a * count + b] = scaled[a] * scaled[b];
        }
        for (std::size_t c = 1; c < cone.size; ++c) {
            const double *row = scaled + c * count;
            for (std::size_t a = 0; a < count; ++a) {
                for (std::size_t b = 0; b < count; ++b) small[a * count + b] += row[a] * row[b];
            }
        }
    }

    void add_factored(const PieceShape &shape, const ConeEntry &cone, const ConeScaling &scaling, double *block) {
        const std::size_t ends = shape.ends, dim = shape.dim, count = dim + shape.rest, width = shape.width();
        small_gram(count, cone, scaling);
        const double *f = cone.factors;
        double *__restrict square = square_.data(), *__restrict pair = pairs_.data();
        const double *__restrict small = small_.data();
        for (std::size_t i = 0; i < ends; ++i) {
            for (std::size_t j = 0; j < ends; ++j) square[i * ends + j] = f[i] * f[j];
        }
        for (std::size_t d = 0; d < dim; ++d) {
            for (std::size_t e = 0; e <= d; ++e, pair += ends * ends) {
                const double factor = small[d * count + e];
                for (std::size_t i = 0; i < ends * ends; ++i) pair[i] += factor * square[i];
            }
        }
        for (std::size_t q = 0; q < shape.rest; ++q) {
            const double *line = small + (dim + q) * count;
            double *__restrict target = block + (shape.bound() + q) * width;
            for (std::size_t j = 0; j < ends; ++j) {
                for (std::size_t d = 0; d < dim; ++d) target[j * dim + d] += f[j] * line[d];
            }
            for (std::size_t r = 0; r <= q; ++r) target[shape.bound() + r] += line[dim + r];
        }
    }

    // Put the sums of factored cones into the block.
    void gather_pairs(const PieceShape &shape, double *block) const {
        const std::size_t ends = shape.ends, dim = shape.dim, width = shape.width();
        const double *pair = pairs_.data();
        for (std::size_t d = 0; d < dim; ++d) {
            for (std::size_t e = 0; e <= d; ++e, pair += ends * ends) {
                for (std::size_t i = 0; i < ends; ++i) {
                    for (std::size_t j = 0; j < ends; ++j) {
                        const std::size_t a = i * dim + d, b = j * dim + e;
                        if (b <= a) block[a * width + b] += pair[i * ends + j];
                        if (d != e && i < j) block[(j * dim + e) * width + a] += pair[i * ends + j];
                    }
                }
            }
        }
    }

    PieceShape shape_{};
    const ConeEntry *cones_ = nullptr;
    std::size_t count_ = 0, widest_ = 1;
    Buffer<std::size_t> first_cone_, first_row_;
    Buffer<double> pairs_, scaled_, small_, square_, panel_;
    LaneRows lanes_;
};

}  // namespace minsnap

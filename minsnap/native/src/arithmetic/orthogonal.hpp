// A thin factorisation A = Q R of a set of columns that grows and shrinks by one.
//
// Gram-Schmidt with reorthogonalisation keeps Q orthogonal to working precision (J. W. Daniel, W. B. Gragg, L. Kaufman
// and G. W. Stewart, "Reorthogonalization and stable algorithms for updating the Gram-Schmidt QR factorization",
// Mathematics of Computation 30, 1976). A Gram matrix A'A would square the condition of rows that are nearly equal.
//
// A column holds one stretch for each coordinate of the curve. ``Reach`` says which stretches may be non-zero, and from
// where on, so that coordinates that nothing couples cost nothing.
#pragma once

#include <cmath>
#include <cstring>

#include "polynomials/bernstein.hpp"
#include "basics/buffer.hpp"
#include "arithmetic/vectors.hpp"

namespace minsnap {

struct Reach {
    unsigned axes = 0;
    int piece = 0;  // entries of the knots before this piece are zero
};

// How the entries of a column lie: a stretch for each coordinate, ``begin[piece]`` being its first entry for a piece.
struct Layout {
    int dim = 0, entries = 0, pieces = 0;
    int offset[max_dim + 2] = {};                      // there may be a stretch of other unknowns behind the coordinates
    Buffer<int> begin;                                 // (dim, pieces)
    unsigned all() const { return (1U << dim) - 1U; }  // bits of the coordinates
    int first(int axis, int piece) const { return begin[std::size_t(axis) * pieces + piece]; }
};

template <class Real>
class Orthogonal {
public:
    [[nodiscard]] bool allocate(const Layout &layout, int most) {
        layout_ = &layout, most_ = most, count_ = 0, products_ = 0.0;
        const std::size_t columns = most;
        return q_.allocate(columns * layout.entries + 1) && r_.allocate(columns * columns + 1) && reach_.allocate(columns + 1) &&
               more_.allocate(columns + 1);
    }

    int count() const { return count_; }
    double products() const { return products_; }  // of entries of columns, since it was allocated
    void clear() { count_ = 0; }

    // Inner product of two columns, of which the second is reached like ``b``.
    Real inner(const Real *x, Reach a, const Real *y, Reach b) const {
        const int piece = a.piece > b.piece ? a.piece : b.piece;
        Real sum = 0;
        for (unsigned left = a.axes & b.axes & layout_->all(); left != 0; left &= left - 1) {
            const int axis = __builtin_ctz(left), from = layout_->first(axis, piece), length = layout_->offset[axis + 1] - from;
            sum += dot(x + from, y + from, length);
            products_ += length;
        }
        return sum;
    }

    void add(Real *x, Real factor, const Real *y, Reach b) const {
        for (unsigned left = b.axes & layout_->all(); left != 0; left &= left - 1) {
            const int axis = __builtin_ctz(left), from = layout_->first(axis, b.piece), length = layout_->offset[axis + 1] - from;
            add_multiple(x + from, factor, y + from, length);
            products_ += length;
        }
    }

    // Replace a column by its part orthogonal to Q, with Q'x in ``along`` (count,); returns the squared norm left. After one
    // pass the part is off by rounding of x, after more by rounding of itself.
    Real project(Real *x, Reach &reach, Real *along, int passes = 3) {
        Real before = inner(x, reach, x, reach);
        for (int k = 0; k < count_; ++k) along[k] = 0;
        for (int pass = 0; pass < passes; ++pass) {
            const Reach had = reach;
            for (int k = 0; k < count_; ++k) more_[k] = inner(x, had, column(k), reach_[k]);
            for (int k = 0; k < count_; ++k) {
                if (more_[k] == 0) continue;
                add(x, -more_[k], column(k), reach_[k]);
                along[k] += more_[k];
                reach = joined(reach, reach_[k]);
            }
            const Real after = inner(x, reach, x, reach);
            if (after > Real(0.3) * before || after == 0) return after;
            before = after;
        }
        return before;
    }

    // Append a column given as its projection: what ``project`` left, its squared norm, and its inner products.
    void append(const Real *rest, Reach reach, Real squared, const Real *along) {
        Real *const q = column(count_), scale = 1 / sqrt(squared);
        for (int i = 0; i < layout_->entries; ++i) q[i] = rest[i] * scale;
        for (int k = 0; k < count_; ++k) triangle(count_)[k] = along[k];
        triangle(count_)[count_] = sqrt(squared);
        reach_[count_++] = reach;
    }

    // Take column k of A out: rotations make R triangular again. ``along`` = Q'x turns with Q, and what is left of x
    // grows by its part along the direction that leaves Q: returns that part.
    Real remove(int k, Real *along, Real *rest, Reach &reach) {
        for (int j = k; j + 1 < count_; ++j) std::memcpy(triangle(j), triangle(j + 1), sizeof(Real) * (j + 2));
        --count_;
        for (int j = k; j < count_; ++j) rotate(j, along);
        const Real freed = along[count_];
        if (freed != 0) {
            add(rest, freed, column(count_), reach_[count_]);
            reach = joined(reach, reach_[count_]);
        }
        return freed;
    }

    // y = R^-T b and b = R^-1 y, in place.
    void solve_transposed(Real *b) const {
        for (int j = 0; j < count_; ++j) b[j] = (b[j] - dot(triangle(j), b, j)) / triangle(j)[j];
    }
    void solve(Real *y) const {
        for (int j = count_ - 1; j >= 0; --j) {
            y[j] /= triangle(j)[j];
            add_multiple(y, -y[j], triangle(j), j);
        }
    }

    // x -= Q y.
    void subtract(Real *x, const Real *y) const {
        for (int k = 0; k < count_; ++k) add(x, -y[k], column(k), reach_[k]);
    }

private:
    Real *column(int k) { return &q_[std::size_t(k) * layout_->entries]; }
    const Real *column(int k) const { return &q_[std::size_t(k) * layout_->entries]; }
    Real *triangle(int j) { return &r_[std::size_t(j) * most_]; }  // column j of R
    const Real *triangle(int j) const { return &r_[std::size_t(j) * most_]; }

    static Reach joined(Reach a, Reach b) { return {a.axes | b.axes, a.piece < b.piece ? a.piece : b.piece}; }

    // Make entry j + 1 of column j of R zero by a rotation of rows j and j + 1, of these columns of
    // Q, and of Q'x.
    void rotate(int j, Real *along) {
        const Real a = triangle(j)[j], b = triangle(j)[j + 1], norm = sqrt(a * a + b * b);
        const Real c = a / norm, s = b / norm;
        for (int i = j; i < count_; ++i) {
            Real &upper = triangle(i)[j], &lower = triangle(i)[j + 1], was = upper;
            upper = c * was + s * lower;
            lower = c * lower - s * was;
        }
        const Real first_along = along[j];
        along[j] = c * first_along + s * along[j + 1];
        along[j + 1] = c * along[j + 1] - s * first_along;
        Real *const p = column(j), *const q = column(j + 1);
        for (int i = 0; i < layout_->entries; ++i) {
            const Real was = p[i];
            p[i] = c * was + s * q[i];
            q[i] = c * q[i] - s * was;
        }
        products_ += 4.0 * layout_->entries;
        const Reach first = reach_[j], second = reach_[j + 1], both = joined(first, second);
        reach_[j] = a == 0 ? second : b == 0 ? first : both;
        reach_[j + 1] = a == 0 ? first : b == 0 ? second : both;
    }

    const Layout *layout_ = nullptr;
    int most_ = 0, count_ = 0;
    mutable double products_ = 0.0;
    Buffer<Real> q_, r_, more_;
    Buffer<Reach> reach_;
};

}  // namespace minsnap

// The cost as a sum of squares |R x + q|^2 + rest, R block upper bidiagonal: what a Cholesky factor of the Hessian would
// be, found by orthogonal transformations of the pieces' own square roots.
//
// The Hessian is never formed: forming it squares the condition (G. J. Bierman, "Factorization Methods for Discrete
// Sequential Estimation", 1977, the square-root information filter; A. Bjorck, "Numerical Methods for Least Squares
// Problems", 1996, chapter 6). One factor serves all coordinates whose knots are pinned alike. In a closed chain the
// first knot is eliminated last and couples to every block by a border.
#pragma once

#include <cmath>

#include "basics/buffer.hpp"
#include "chain/chain.hpp"
#include "basics/status.hpp"

namespace minsnap {

template <class Real, int Half>
class SquareRoot {
public:
    [[nodiscard]] bool allocate(const Chain<Real, Half> &chain) {
        const std::size_t knots = chain.pieces + 1, state = chain.size.half();
        stride_ = int(state * state);
        return offset_.allocate(knots + 1) && free_.allocate(knots * state) && diagonal_.allocate(knots * stride_) &&
               next_.allocate(knots * stride_) && border_.allocate(chain.closed ? knots * stride_ : 1) &&
               shift_.allocate(knots * state * chain.dim);
    }

    // Factor the cost of the axes that are free like ``axis``; what is pinned is in the chain's values, zero where free.
    // ``pull`` (pieces,), or null: to it come the squares of pull times the position of the knot where a piece starts.
    Status factorise(const Chain<Real, Half> &chain, const int *axes, int count, const Real *pull = nullptr) {
        number(chain, axes[0]);
        pull_ = pull;
        rest_ = 0, carried_ = 0, columns_ = count;
        for (int piece = 0; piece < chain.pieces; ++piece)
            if (!eliminate(chain, piece, axes)) return Status::singular;
        return last_block() ? Status::done : Status::singular;
    }

    int unknowns() const { return unknowns_; }
    Real rest() const { return rest_; }  // the cost of the optimum, over all its axes
    // First unknown that a piece touches.
    int start(int piece) const { return offset_[piece == 0 && closed_ ? 1 : piece]; }

    // z = R^-T f from start(piece) on, f having the entries ``factors`` (2k,) of the ends of one piece.
    void forward(int piece, const Real *factors, Real *z) const {
        const int first = piece == 0 && closed_ ? 1 : piece;
        for (int block = first; block < chain_blocks_; ++block) {
            Real *const out = z + offset_[block];
            gather(piece, block, factors, out);
            if (block > first) subtract(&next_[std::size_t(block - 1) * stride_], size(block - 1), out - size(block - 1),
                                        size(block), out);
            divide_transposed(block, out);
        }
        if (!closed_) return;
        Real *const out = z + offset_[chain_blocks_];
        gather(piece, chain_blocks_, factors, out);
        for (int block = first; block < chain_blocks_; ++block)
            subtract(&border_[std::size_t(block) * stride_], size(block), z + offset_[block], size(chain_blocks_), out);
        divide_transposed(chain_blocks_, out);
    }

    // Add a multiple of the factors (2k,) of the ends of a piece to a vector of all unknowns.
    void scatter(int piece, const Real *factors, Real scale, Real *f) const {
        const bool from_seam = closed_ && piece == 0, to_seam = closed_ && piece + 2 == blocks_;
        const int places[] = {from_seam ? chain_blocks_ : piece, to_seam ? chain_blocks_ : piece + 1};
        for (int end = 0; end < 2; ++end)
            for (int i = 0; i < size(places[end]); ++i)
                f[offset_[places[end]] + i] +=
                    scale * factors[end * half_ + free_[std::size_t(places[end]) * half_ + i]];
    }

    // z = R^-T f in place.
    void forward_all(Real *f) const {
        Real *const seam = f + offset_[chain_blocks_];
        for (int block = 0; block < chain_blocks_; ++block) {
            Real *const out = f + offset_[block];
            if (block > 0)
                subtract(&next_[std::size_t(block - 1) * stride_], size(block - 1), out - size(block - 1), size(block),
                         out);
            divide_transposed(block, out);
            if (closed_) subtract(&border_[std::size_t(block) * stride_], size(block), out, size(chain_blocks_), seam);
        }
        if (closed_) divide_transposed(chain_blocks_, seam);
    }

    // x = R^-1 u, in place.
    void backward(Real *u) const {
        Real *const seam = u + offset_[chain_blocks_];
        if (closed_) divide(chain_blocks_, seam);
        for (int block = chain_blocks_ - 1; block >= 0; --block) {
            Real *const out = u + offset_[block];
            if (block + 1 < chain_blocks_)
                take_away(&next_[std::size_t(block) * stride_], size(block), out, size(block + 1), out + size(block));
            if (closed_)
                take_away(&border_[std::size_t(block) * stride_], size(block), out, size(chain_blocks_), seam);
            divide(block, out);
        }
    }

    // The optimum of one of the axes, counted as given to ``factorise``: x = -R^-1 q.
    void optimum(int column, Real *x) const {
        for (int i = 0; i < unknowns_; ++i) x[i] = -shift_[std::size_t(i) * columns_ + column];
        backward(x);
    }

    // Add unknowns (unknowns(),) times a factor to the values of an axis at the knots.
    void add(Chain<Real, Half> &chain, int axis, const Real *x) const {
        for (int block = 0; block < blocks_; ++block)
            for (int i = 0; i < size(block); ++i)
                chain.values[chain.at(knot(block), free_[std::size_t(block) * half_ + i], axis)] += x[offset_[block] + i];
    }

private:
    static constexpr int max_rows = 3 * max_half + 1, max_columns = 3 * max_half + max_dim;

    int size(int block) const { return offset_[block + 1] - offset_[block]; }
    int knot(int block) const { return closed_ && block == chain_blocks_ ? 0 : block; }

    // Blocks are the knots in their order; in a closed chain block 0 is empty and the last one is the first knot.
    void number(const Chain<Real, Half> &chain, int axis) {
        half_ = chain.size.half(), closed_ = chain.closed;
        blocks_ = chain.pieces + 1, chain_blocks_ = closed_ ? chain.pieces : blocks_;
        offset_[0] = 0;
        for (int block = 0; block < blocks_; ++block) {
            int count = 0;
            for (int order = 0; order < half_; ++order)
                if (!(closed_ && block == 0) && chain.is_free(knot(block), order, axis))
                    free_[std::size_t(block) * half_ + count++] = order;
            offset_[block + 1] = offset_[block] + count;
        }
        unknowns_ = offset_[blocks_];
    }

    // Take a piece in and eliminate the knot at its start: Householder on what is carried over and the piece's rows.
    bool eliminate(const Chain<Real, Half> &chain, int piece, const int *axes) {
        const int start = size(piece), end = piece + 1 < chain_blocks_ ? size(piece + 1) : 0;
        const int seam = closed_ ? size(chain_blocks_) : 0, unknown = start + end + seam;
        const int rows = carried_ + half_ + (pull_ != nullptr);
        Real work[max_rows][max_columns] = {};
        for (int i = 0; i < carried_; ++i) {  // columns of the start, the seam, and right-hand sides
            for (int j = 0; j < start; ++j) work[i][j] = carry_[i][j];
            for (int j = 0; j < seam + columns_; ++j) work[i][start + end + j] = carry_[i][start + j];
        }
        add_piece(chain, piece, axes, start, end, seam, work);
        for (int t = 0; t < unknown && t < rows; ++t) reflect(work, t, rows, unknown + columns_);
        if (!keep_block(piece, start, end, seam, rows, work)) return false;
        carried_ = (rows < unknown ? rows : unknown) - start;
        for (int i = 0; i < carried_; ++i)
            for (int j = 0; j < end + seam + columns_; ++j) carry_[i][j] = work[start + i][start + j];
        for (int i = unknown; i < rows; ++i)
            for (int j = 0; j < columns_; ++j) rest_ += work[i][unknown + j] * work[i][unknown + j];
        return true;
    }

    void add_piece(const Chain<Real, Half> &chain, int piece, const int *axes, int start, int end, int seam,
                   Real work[max_rows][max_columns]) {
        const Real duration = chain.durations[piece];
        Real weight = 1 / std::sqrt(duration), powers[max_half], ends[max_points] = {};
        powers[0] = 1;
        for (int a = 1; a < half_; ++a) powers[a] = powers[a - 1] * duration, weight /= duration;
        const bool from_seam = closed_ && piece == 0, to_seam = closed_ && piece + 1 == chain.pieces;
        const int first = from_seam ? chain_blocks_ : piece, second = to_seam ? chain_blocks_ : piece + 1;
        const int first_column = from_seam ? start + end : 0, second_column = to_seam ? start + end : start;
        for (int i = 0; i < half_; ++i) {
            Real *const row = work[carried_ + i];
            const Real *const root = chain.tables->root[i];
            for (int j = 0; j < size(first); ++j) {
                const int order = free_[std::size_t(first) * half_ + j];
                row[first_column + j] += weight * powers[order] * root[order];
            }
            for (int j = 0; j < size(second); ++j) {
                const int order = free_[std::size_t(second) * half_ + j];
                row[second_column + j] += weight * powers[order] * root[half_ + order];
            }
        }
        if (pull_ != nullptr && size(first) > 0 && free_[std::size_t(first) * half_] == 0)
            work[carried_ + half_][first_column] = pull_[piece];
        for (int column = 0; column < columns_; ++column) {
            chain.ends_of(piece, axes[column], ends);
            for (int i = 0; i < half_; ++i) {
                Real sum = 0;
                for (int j = 0; j < 2 * half_; ++j) sum += chain.tables->root[i][j] * ends[j];
                work[carried_ + i][start + end + seam + column] = weight * sum;
            }
        }
    }

    // Make column t zero below its diagonal.
    static void reflect(Real work[max_rows][max_columns], int t, int rows, int columns) {
        Real squares = 0;
        for (int i = t + 1; i < rows; ++i) squares += work[i][t] * work[i][t];
        if (squares == 0) return;
        const Real head = work[t][t], norm = std::sqrt(head * head + squares);
        const Real pivot = head > 0 ? head + norm : head - norm, scale = 1 / (norm * (norm + std::fabs(head)));
        work[t][t] = pivot;
        for (int j = t + 1; j < columns; ++j) {
            Real sum = 0;
            for (int i = t; i < rows; ++i) sum += work[i][t] * work[i][j];
            sum *= scale;
            for (int i = t; i < rows; ++i) work[i][j] -= sum * work[i][t];
        }
        work[t][t] = head > 0 ? -norm : norm;
        for (int i = t + 1; i < rows; ++i) work[i][t] = 0;
    }

    bool keep_block(int block, int start, int end, int seam, int rows, const Real work[max_rows][max_columns]) {
        if (start > rows || !keep_diagonal(block, start, work)) return false;
        Real *const next = &next_[std::size_t(block) * stride_];
        for (int i = 0; i < start; ++i) {
            for (int j = 0; j < end; ++j) next[i * half_ + j] = work[i][start + j];
            if (closed_)
                for (int j = 0; j < seam; ++j)
                    border_[std::size_t(block) * stride_ + i * half_ + j] = work[i][start + end + j];
            for (int j = 0; j < columns_; ++j)
                shift_[std::size_t(offset_[block] + i) * columns_ + j] = work[i][start + end + seam + j];
        }
        return true;
    }

    // The triangle of a block, with the inverse of its diagonal; a diagonal that is rounding means a singular cost.
    bool keep_diagonal(int block, int count, const Real work[max_rows][max_columns]) {
        Real *const diagonal = &diagonal_[std::size_t(block) * stride_];
        for (int j = 0; j < count; ++j) {
            Real largest = 0;
            for (int i = 0; i <= j; ++i) {
                const Real size = std::fabs(work[i][j]);
                if (!(size < 1e150)) return false;
                largest = size > largest ? size : largest;
                diagonal[i * half_ + j] = work[i][j];
            }
            if (!(std::fabs(work[j][j]) > Real(1e-13) * largest)) return false;
            diagonal[j * half_ + j] = 1 / work[j][j];
        }
        return true;
    }

    // What is carried over after the last piece: the last knot, or the first one of a closed chain.
    bool last_block() {
        const int block = blocks_ - 1, count = size(block);
        if (carried_ < count) return false;
        Real work[max_rows][max_columns] = {};
        for (int i = 0; i < count; ++i)
            for (int j = 0; j < count + columns_; ++j) work[i][j] = carry_[i][j];
        if (!keep_diagonal(block, count, work)) return false;
        for (int i = 0; i < count; ++i)
            for (int j = 0; j < columns_; ++j)
                shift_[std::size_t(offset_[block] + i) * columns_ + j] = work[i][count + j];
        return true;
    }

    void gather(int piece, int block, const Real *factors, Real *out) const {
        const bool from_seam = closed_ && piece == 0, to_seam = closed_ && piece + 2 == blocks_;
        const int first = from_seam ? chain_blocks_ : piece, second = to_seam ? chain_blocks_ : piece + 1;
        for (int i = 0; i < size(block); ++i) {
            const int order = free_[std::size_t(block) * half_ + i];
            out[i] = (block == first ? factors[order] : 0) + (block == second ? factors[half_ + order] : 0);
        }
    }

    // out -= M'z for a block M (rows, columns).
    void subtract(const Real *matrix, int rows, const Real *z, int columns, Real *out) const {
        for (int i = 0; i < rows; ++i)
            for (int j = 0; j < columns; ++j) out[j] -= matrix[i * half_ + j] * z[i];
    }

    // out -= M x for a block M (rows, columns).
    void take_away(const Real *matrix, int rows, Real *out, int columns, const Real *x) const {
        for (int i = 0; i < rows; ++i)
            for (int j = 0; j < columns; ++j) out[i] -= matrix[i * half_ + j] * x[j];
    }

    void divide_transposed(int block, Real *out) const {
        const Real *const diagonal = &diagonal_[std::size_t(block) * stride_];
        for (int i = 0; i < size(block); ++i) {
            out[i] *= diagonal[i * half_ + i];
            for (int j = i + 1; j < size(block); ++j) out[j] -= diagonal[i * half_ + j] * out[i];
        }
    }

    void divide(int block, Real *out) const {
        const Real *const diagonal = &diagonal_[std::size_t(block) * stride_];
        for (int i = size(block) - 1; i >= 0; --i) {
            for (int j = i + 1; j < size(block); ++j) out[i] -= diagonal[i * half_ + j] * out[j];
            out[i] *= diagonal[i * half_ + i];
        }
    }

    Buffer<int> offset_, free_;                        // (blocks + 1,); (blocks, k) orders that are free
    Buffer<Real> diagonal_, next_, border_, shift_;    // blocks of R, (k, k) each, and q (unknowns, axes)
    Real carry_[2 * max_half][2 * max_half + max_dim];  // rows on the next knot and the seam
    const Real *pull_ = nullptr;
    Real rest_ = 0;
    int half_ = 0, blocks_ = 0, chain_blocks_ = 0, stride_ = 0, unknowns_ = 0, carried_ = 0, columns_ = 0;
    bool closed_ = false;
};

}  // namespace minsnap

// The cost as a sum of squares |R x + q|^2 + rest, R block upper bidiagonal: what a Cholesky factor of the Hessian would
// be, found by orthogonal transformations of the pieces' own square roots.
//
// The Hessian is never formed: forming it squares the condition (G. J. Bierman, "Factorization Methods for Discrete
// Sequential Estimation", 1977, the square-root information filter; A. Bjorck, "Numerical Methods for Least Squares
// Problems", 1996, chapter 6). One factor serves all coordinates whose knots are pinned alike. In a closed chain the
// first knot is eliminated last and couples to every block by a border.
//
// Derivatives above k - 1 that are continuous too are further unknowns of a knot, to which each of its two pieces holds
// its own derivative by an equation. Equations are eliminated first, like rows of infinite weight, by complete pivoting
// (A. Bjorck, chapter 5.1): their rows of R come first in a block, and their entries of z are zero.
#pragma once

#include <cmath>
#include <limits>

#include "basics/buffer.hpp"
#include "chain/chain.hpp"
#include "basics/status.hpp"

namespace minsnap {

template <class Real, int Half>
class SquareRoot {
public:
    [[nodiscard]] bool allocate(const Chain<Real, Half> &chain) {
        const std::size_t knots = chain.pieces + 1, state = chain.state();
        state_ = int(state), stride_ = int(state * state);
        return offset_.allocate(knots + 1) && free_.allocate(knots * state) && held_.allocate(knots) &&
               diagonal_.allocate(knots * stride_) && next_.allocate(knots * stride_) &&
               border_.allocate(chain.closed ? knots * stride_ : 1) && shift_.allocate(knots * state * chain.dim);
    }

    // Factor the cost of the axes that are free like ``axis``; what is pinned is in the chain's values, zero where free.
    // ``pull`` (pieces,), or null: to it come the squares of pull times the position of the knot where a piece starts.
    Status factorise(const Chain<Real, Half> &chain, const int *axes, int count, const Real *pull = nullptr) {
        number(chain, axes[0]);
        pull_ = pull;
        rest_ = 0, products_ = 0, carried_ = equations_ = 0, columns_ = count;
        return state_ == slots_ ? eliminate_all<false>(chain, axes) : eliminate_all<true>(chain, axes);
    }

    int unknowns() const { return unknowns_; }
    double products() const { return products_; }  // of entries in the last factor, about
    Real rest() const { return rest_; }            // the cost of the optimum, over all its axes
    // First unknown that a piece touches.
    int start(int piece) const { return offset_[piece == 0 && closed_ ? 1 : piece]; }

    // z = R^-T f from start(piece) on, f having the entries ``factors`` (2k,) of the ends of one piece.
    void forward(int piece, const Real *factors, Real *z) const {
        const int first = piece == 0 && closed_ ? 1 : piece;
        for (int block = first; block < chain_blocks_; ++block) {
            Real *const out = z + offset_[block];
            gather(piece, block, factors, out);
            if (block > first) subtract(&next_[std::size_t(block - 1) * stride_], size(block - 1), out - size(block - 1), size(block), out);
            divide_transposed(block, out);
        }
        if (closed_) {
            Real *const out = z + offset_[chain_blocks_];
            gather(piece, chain_blocks_, factors, out);
            for (int block = first; block < chain_blocks_; ++block)
                subtract(&border_[std::size_t(block) * stride_], size(block), z + offset_[block], size(chain_blocks_), out);
            divide_transposed(chain_blocks_, out);
        }
        clear_equations(first, z);
    }

    // Add a multiple of the factors (2k,) of the ends of a piece to a vector of all unknowns.
    void scatter(int piece, const Real *factors, Real scale, Real *f) const {
        const bool from_seam = closed_ && piece == 0, to_seam = closed_ && piece + 2 == blocks_;
        const int places[] = {from_seam ? chain_blocks_ : piece, to_seam ? chain_blocks_ : piece + 1};
        for (int end = 0; end < 2; ++end)
            for (int i = 0; i < size(places[end]); ++i) {
                const int at = place_of(places[end], i, end);
                if (at >= 0) f[offset_[places[end]] + i] += scale * factors[at];
            }
    }

    // z = R^-T f in place.
    void forward_all(Real *f) const {
        Real *const seam = f + offset_[chain_blocks_];
        for (int block = 0; block < chain_blocks_; ++block) {
            Real *const out = f + offset_[block];
            if (block > 0) subtract(&next_[std::size_t(block - 1) * stride_], size(block - 1), out - size(block - 1), size(block), out);
            divide_transposed(block, out);
            if (closed_) subtract(&border_[std::size_t(block) * stride_], size(block), out, size(chain_blocks_), seam);
        }
        if (closed_) divide_transposed(chain_blocks_, seam);
        clear_equations(0, f);
    }

    // x = R^-1 u, in place.
    void backward(Real *u) const {
        Real *const seam = u + offset_[chain_blocks_];
        if (closed_) divide(chain_blocks_, seam);
        for (int block = chain_blocks_ - 1; block >= 0; --block) {
            Real *const out = u + offset_[block];
            if (block + 1 < chain_blocks_)
                take_away(&next_[std::size_t(block) * stride_], size(block), out, size(block + 1), out + size(block));
            if (closed_) take_away(&border_[std::size_t(block) * stride_], size(block), out, size(chain_blocks_), seam);
            divide(block, out);
        }
    }

    // The optimum of one of the axes, counted as given to ``factorise``: x = -R^-1 q.
    void optimum(int column, Real *x) const {
        for (int i = 0; i < unknowns_; ++i) x[i] = -shift_[std::size_t(i) * columns_ + column];
        backward(x);
    }

    // Take away what rounding left of jumps at the knots, by the change that has no part in z; ``x`` is scratch
    // (unknowns(),). The factor stays, but not its optimum.
    Status join(Chain<Real, Half> &chain, const int *axes, int count, const Real *pull, Real *x) {
        const Status status = factorise(chain, axes, count, pull);
        for (int column = 0; column < count && status == Status::done; ++column) {
            for (int i = 0; i < unknowns_; ++i) x[i] = 0;
            for (int block = 0; block < blocks_; ++block)
                for (int i = offset_[block]; i < offset_[block] + held_[block]; ++i) x[i] = -shift_[std::size_t(i) * columns_ + column];
            backward(x);
            add(chain, axes[column], x);
        }
        return status;
    }

    // Add unknowns (unknowns(),) times a factor to the values of an axis at the knots.
    void add(Chain<Real, Half> &chain, int axis, const Real *x) const {
        for (int block = 0; block < blocks_; ++block)
            for (int i = 0; i < size(block); ++i)
                if (order_of(block, i) < slots_) chain.values[chain.at(knot(block), order_of(block, i), axis)] += x[offset_[block] + i];
    }

private:
    static constexpr int max_state = 2 * max_half - 1, max_extra = max_half - 1;
    static Real zero() { return 256 * std::numeric_limits<Real>::epsilon(); }  // of an equation's entries

    // Rows of a block and of the next ones: equations and the cost, with columns of the start, the end, the seam, and
    // right-hand sides.
    template <bool joined>
    struct Work {
        static constexpr int state = joined ? max_state : max_half + 1;
        static constexpr int columns = 3 * state + max_dim, rows = 2 * state + max_half + 1;
        static constexpr int equations = joined ? 2 * state + 2 * max_extra : 1;
        Real cost[rows][columns] = {};
        Real equation[equations][columns] = {};
    };

    int size(int block) const { return offset_[block + 1] - offset_[block]; }
    int knot(int block) const { return closed_ && block == chain_blocks_ ? 0 : block; }
    int order_of(int block, int i) const { return free_[std::size_t(block) * state_ + i]; }
    // Where an unknown stands among the ends of the piece that starts (0) or ends (1) at its knot; less than 0 if it is none.
    int place_of(int block, int i, int end) const {
        const int slot = order_of(block, i), highest = half_ - 1;
        if (slots_ > half_ && slot >= highest) return slot - highest == end ? -1 : end * half_ + highest;
        return slot < half_ ? end * half_ + slot : -1;
    }
    bool is_joined(int block) const { return closed_ || (block > 0 && block + 1 < blocks_); }

    // Blocks are the knots in their order; in a closed chain block 0 is empty and the last one is the first knot.
    void number(const Chain<Real, Half> &chain, int axis) {
        half_ = chain.size.half(), slots_ = chain.slots(), closed_ = chain.closed;
        blocks_ = chain.pieces + 1, chain_blocks_ = closed_ ? chain.pieces : blocks_;
        offset_[0] = 0;
        for (int block = 0; block < blocks_; ++block) {
            int count = 0;
            for (int order = 0; order < state_; ++order)
                if (!(closed_ && block == 0) && (order < slots_ ? chain.is_free(knot(block), order, axis) : is_joined(block)))
                    free_[std::size_t(block) * state_ + count++] = order;
            offset_[block + 1] = offset_[block] + count;
            held_[block] = 0;
        }
        unknowns_ = offset_[blocks_];
    }

    template <bool joined>
    Status eliminate_all(const Chain<Real, Half> &chain, const int *axes) {
        for (int piece = 0; piece < chain.pieces; ++piece)
            if (!eliminate<joined>(chain, piece, axes)) return Status::singular;
        return last_block<joined>(chain) ? Status::done : Status::singular;
    }

    // Take a piece in and eliminate the knot at its start: Householder on what is carried over and the piece's rows.
    template <bool joined>
    bool eliminate(const Chain<Real, Half> &chain, int piece, const int *axes) {
        const int start = size(piece), end = piece + 1 < chain_blocks_ ? size(piece + 1) : 0;
        const int seam = closed_ ? size(chain_blocks_) : 0, unknown = start + end + seam;
        const int rows = carried_ + half_ + (pull_ != nullptr);
        Work<joined> work;
        take_over(carry_, carried_, start, end, seam, work.cost);
        add_piece(chain, piece, axes, start, end, seam, work.cost);
        int held = 0, equations = equations_;
        if (joined) {
            take_over(carried_equations_, equations_, start, end, seam, work.equation);
            equations = add_equations(chain, piece, axes, start, end, seam, work.equation);
            held = use_equations(chain, piece, start, rows, equations, unknown + columns_, work);
        }
        products_ += double(rows + equations) * unknown * (unknown + columns_);
        for (int t = held; t < unknown && t - held < rows; ++t) reflect(work.cost, t - held, t, rows, unknown + columns_);
        if (!keep_block(piece, start, end, seam, rows, held, work)) return false;
        const int left = unknown - held;
        carried_ = (rows < left ? rows : left) - (start - held);
        hand_over(work.cost, start - held, carried_, start, end + seam + columns_, carry_);
        for (int i = left; i < rows; ++i)
            for (int j = 0; j < columns_; ++j) rest_ += work.cost[i][unknown + j] * work.cost[i][unknown + j];
        if (joined) {
            equations_ = equations - held;
            hand_over(work.equation, held, equations_, start, end + seam + columns_, carried_equations_);
        }
        return true;
    }

    template <class From, class To>
    void take_over(const From &from, int count, int start, int end, int seam, To &to) const {
        for (int i = 0; i < count; ++i) {
            for (int j = 0; j < start; ++j) to[i][j] = from[i][j];
            for (int j = 0; j < seam + columns_; ++j) to[i][start + end + j] = from[i][start + j];
        }
    }

    template <class From, class To>
    static void hand_over(const From &from, int first, int count, int column, int columns, To &to) {
        for (int i = 0; i < count; ++i)
            for (int j = 0; j < columns; ++j) to[i][j] = from[first + i][column + j];
    }

    // The equations by which a piece's own derivatives above k - 1 are those of the knots at its ends; returns how many
    // there are with those carried over.
    template <class Rows>
    int add_equations(const Chain<Real, Half> &chain, int piece, const int *axes, int start, int end, int seam, Rows &rows) const {
        const bool from_seam = closed_ && piece == 0, to_seam = closed_ && piece + 1 == chain.pieces;
        const int blocks[] = {from_seam ? chain_blocks_ : piece, to_seam ? chain_blocks_ : piece + 1};
        const int places[] = {from_seam ? start + end : 0, to_seam ? start + end : start};
        int count = equations_;
        for (int side = 0; side < 2; ++side)
            for (int i = 0; i < size(blocks[side]); ++i) {
                const int order = order_of(blocks[side], i);
                if (order < half_) continue;
                Real factors[max_points], unit = 1;
                row_factors(chain.size, *chain.tables, chain.durations[piece], order, Real(side), factors);
                for (int q = 0; q < order; ++q) unit *= chain.durations[piece] / (2 * half_ - 1 - q);
                auto &row = rows[count++];
                row[places[side] + i] -= unit;
                for (int knot = 0; knot < 2; ++knot)
                    for (int j = 0; j < size(blocks[knot]); ++j) {
                        const int own = order_of(blocks[knot], j);
                        if (own < half_) row[places[knot] + j] += unit * factors[knot * half_ + own];
                    }
                for (int column = 0; side == 1 && column < columns_; ++column)
                    row[start + end + seam + column] = unit * jump(chain, piece, axes[column], order, factors);
            }
        return count;
    }

    // By how much a derivative at the end of a piece, of these factors, is above that of the next piece: the unknown that
    // stands for both counts from the latter.
    Real jump(const Chain<Real, Half> &chain, int piece, int axis, int order, const Real *factors) const {
        const int next = piece + 1 < chain.pieces ? piece + 1 : 0;
        Real others[max_points];
        row_factors(chain.size, *chain.tables, chain.durations[next], order, Real(0), others);
        return known_part(chain, piece, axis, factors) - known_part(chain, next, axis, others);
    }

    // What the values at the ends of a piece make of a row with these factors.
    Real known_part(const Chain<Real, Half> &chain, int piece, int axis, const Real *factors) const {
        Real sum = factors[half_] * chain.steps[std::size_t(piece) * chain.dim + axis];
        for (int side = 0; side < 2; ++side)
            for (int a = 0; a < half_; ++a) sum += factors[side * half_ + a] * chain.values[chain.at(piece + side, a, axis)];
        return sum;
    }

    // Eliminate unknowns of a block by equations, pivots first, from the other equations and from the cost; returns how
    // many. What is left of an equation does not touch the block.
    template <class Rows>
    int use_equations(const Chain<Real, Half> &chain, int block, int start, int rows, int equations, int columns, Rows &work) {
        Real unit[Rows::columns], own[Rows::equations];
        const bool seam = closed_ && block < chain_blocks_;
        const int end = block + 1 < chain_blocks_ ? size(block + 1) : 0;
        units_of(chain, block, unit);
        if (end > 0) units_of(chain, block + 1, unit + start);
        if (seam) units_of(chain, chain_blocks_, unit + start + end);
        for (int i = 0; i < equations; ++i) {
            own[i] = 0;
            for (int j = 0; j < columns - columns_; ++j) own[i] = largest_of(own[i], fabs(work.equation[i][j]) / unit[j]);
        }
        int held = 0;
        for (; held < equations && held < start; ++held) {
            int row = -1, column = -1;
            Real best = zero();
            for (int i = held; i < equations; ++i)
                for (int j = held; j < start; ++j) {
                    const Real share = own[i] > 0 ? fabs(work.equation[i][j]) / (unit[j] * own[i]) : Real(0);
                    if (share > best) best = share, row = i, column = j;
                }
            if (row < 0) break;
            swap_rows(work.equation[row], work.equation[held], columns), swap(own[row], own[held]);
            if (column != held) swap_unknowns(block, held, column, rows, equations, work), swap(unit[held], unit[column]);
            for (int i = held + 1; i < equations; ++i) clear_entry(work.equation[i], work.equation[held], held, columns);
            for (int i = 0; i < rows; ++i) clear_entry(work.cost[i], work.equation[held], held, columns);
        }
        for (int i = held; i < equations; ++i)
            for (int j = 0; j < start; ++j) work.equation[i][j] = 0;
        return held;
    }

    static Real largest_of(Real a, Real b) { return a > b ? a : b; }
    static void swap(Real &a, Real &b) {
        const Real was = a;
        a = b, b = was;
    }
    static void swap_rows(Real *a, Real *b, int columns) {
        for (int j = 0; a != b && j < columns; ++j) swap(a[j], b[j]);
    }
    static void clear_entry(Real *row, const Real *pivot, int at, int columns) {
        if (row[at] == 0) return;
        const Real factor = row[at] / pivot[at];
        row[at] = 0;
        for (int j = at + 1; j < columns; ++j) row[j] -= factor * pivot[j];
    }

    // By how much one of each unknown of a block moves the curve, about: powers of the longer piece beside it.
    void units_of(const Chain<Real, Half> &chain, int block, Real *unit) const {
        const int at = knot(block), before = at > 0 ? at - 1 : chain.closed ? chain.pieces - 1 : 0;
        const int after = at < chain.pieces ? at : before;
        const Real time = largest_of(chain.durations[before], chain.durations[after]);
        for (int i = 0; i < size(block); ++i) {
            unit[i] = 1;
            for (int q = 0; q < order_of(block, i); ++q) unit[i] *= time / (2 * half_ - 1 - q);
        }
    }

    template <class Rows>
    void swap_unknowns(int block, int one, int other, int rows, int equations, Rows &work) {
        const std::size_t from = std::size_t(block) * state_;
        const int order = free_[from + one];
        free_[from + one] = free_[from + other], free_[from + other] = order;
        for (int i = 0; i < rows; ++i) swap(work.cost[i][one], work.cost[i][other]);
        for (int i = 0; i < equations; ++i) swap(work.equation[i][one], work.equation[i][other]);
        const bool seam = closed_ && block == chain_blocks_;
        for (int before = seam ? 0 : block - 1; before >= 0 && before < (seam ? chain_blocks_ : block); ++before) {
            Real *const matrix = &(seam ? border_ : next_)[std::size_t(before) * stride_];
            for (int i = 0; i < size(before); ++i) swap(matrix[i * state_ + one], matrix[i * state_ + other]);
        }
    }

    template <class Rows>
    void add_piece(const Chain<Real, Half> &chain, int piece, const int *axes, int start, int end, int seam, Rows &work) {
        const Real duration = chain.durations[piece];
        Real weight = 1 / sqrt(duration), powers[max_half], ends[max_points] = {};
        powers[0] = 1;
        for (int a = 1; a < half_; ++a) powers[a] = powers[a - 1] * duration, weight /= duration;
        const bool from_seam = closed_ && piece == 0, to_seam = closed_ && piece + 1 == chain.pieces;
        const int first = from_seam ? chain_blocks_ : piece, second = to_seam ? chain_blocks_ : piece + 1;
        const int first_column = from_seam ? start + end : 0, second_column = to_seam ? start + end : start;
        for (int i = 0; i < half_; ++i) {
            Real *const row = work[carried_ + i];
            const Real *const root = chain.tables->root[i];
            for (int j = 0; j < size(first); ++j) {
                const int at = place_of(first, j, 0);
                if (at >= 0) row[first_column + j] += weight * powers[at] * root[at];
            }
            for (int j = 0; j < size(second); ++j) {
                const int at = place_of(second, j, 1);
                if (at >= 0) row[second_column + j] += weight * powers[at - half_] * root[at];
            }
        }
        if (pull_ != nullptr && size(first) > 0 && order_of(first, 0) == 0) work[carried_ + half_][first_column] = pull_[piece];
        for (int column = 0; column < columns_; ++column) {
            chain.ends_of(piece, axes[column], ends);
            for (int i = 0; i < half_; ++i) {
                Real sum = 0;
                for (int j = 0; j < 2 * half_; ++j) sum += chain.tables->root[i][j] * ends[j];
                work[carried_ + i][start + end + seam + column] = weight * sum;
            }
        }
    }

    // Make column t zero below row h.
    template <class Rows>
    static void reflect(Rows &work, int h, int t, int rows, int columns) {
        Real squares = 0;
        for (int i = h + 1; i < rows; ++i) squares += work[i][t] * work[i][t];
        if (squares == 0) return;
        const Real head = work[h][t], norm = sqrt(head * head + squares);
        const Real pivot = head > 0 ? head + norm : head - norm, scale = 1 / (norm * (norm + fabs(head)));
        work[h][t] = pivot;
        for (int j = t + 1; j < columns; ++j) {
            Real sum = 0;
            for (int i = h; i < rows; ++i) sum += work[i][t] * work[i][j];
            sum *= scale;
            for (int i = h; i < rows; ++i) work[i][j] -= sum * work[i][t];
        }
        work[h][t] = head > 0 ? -norm : norm;
        for (int i = h + 1; i < rows; ++i) work[i][t] = 0;
    }

    template <class Rows>
    bool keep_block(int block, int start, int end, int seam, int rows, int held, const Rows &work) {
        if (start - held > rows || !keep_diagonal(block, start, held, work)) return false;
        Real *const next = &next_[std::size_t(block) * stride_];
        for (int i = 0; i < start; ++i) {
            const Real *const row = i < held ? work.equation[i] : work.cost[i - held];
            for (int j = 0; j < end; ++j) next[i * state_ + j] = row[start + j];
            if (closed_)
                for (int j = 0; j < seam; ++j) border_[std::size_t(block) * stride_ + i * state_ + j] = row[start + end + j];
            for (int j = 0; j < columns_; ++j) shift_[std::size_t(offset_[block] + i) * columns_ + j] = row[start + end + seam + j];
        }
        return true;
    }

    // The triangle of a block, with the inverse of its diagonal; a diagonal that is rounding means a singular cost.
    template <class Rows>
    bool keep_diagonal(int block, int count, int held, const Rows &work) {
        Real *const diagonal = &diagonal_[std::size_t(block) * stride_];
        held_[block] = held;
        for (int j = 0; j < count; ++j) {
            Real largest = 0, last = 0;
            for (int i = 0; i <= j; ++i) {
                const Real entry = i < held ? work.equation[i][j] : work.cost[i - held][j], size = fabs(entry);
                if (!(size < 1e150)) return false;
                if (i >= held || j < held) largest = size > largest ? size : largest;
                diagonal[i * state_ + j] = last = entry;
            }
            if (!(fabs(last) > Real(1e-13) * (j < held ? Real(0) : largest))) return false;
            diagonal[j * state_ + j] = 1 / last;
        }
        return true;
    }

    // What is carried over after the last piece: the last knot, or the first one of a closed chain. Equations that
    // nothing is left to meet must hold as they are.
    template <bool joined>
    bool last_block(const Chain<Real, Half> &chain) {
        const int block = blocks_ - 1, count = size(block);
        Work<joined> work;
        hand_over(carry_, 0, carried_, 0, count + columns_, work.cost);
        int held = 0;
        if (joined) {
            hand_over(carried_equations_, 0, equations_, 0, count + columns_, work.equation);
            held = use_equations(chain, block, count, carried_, equations_, count + columns_, work);
            if (held < equations_) return false;
            for (int t = held; t < count && t - held < carried_; ++t) reflect(work.cost, t - held, t, carried_, count + columns_);
            for (int i = count - held; i < carried_; ++i)
                for (int j = 0; j < columns_; ++j) rest_ += work.cost[i][count + j] * work.cost[i][count + j];
        }
        if (carried_ < count - held || !keep_diagonal(block, count, held, work)) return false;
        for (int i = 0; i < count; ++i)
            for (int j = 0; j < columns_; ++j)
                shift_[std::size_t(offset_[block] + i) * columns_ + j] = (i < held ? work.equation[i] : work.cost[i - held])[count + j];
        return true;
    }

    // Equations have no entries of z.
    void clear_equations(int first, Real *z) const {
        if (state_ == slots_) return;
        for (int block = first; block < blocks_; ++block)
            for (int i = 0; i < held_[block]; ++i) z[offset_[block] + i] = 0;
    }

    void gather(int piece, int block, const Real *factors, Real *out) const {
        const bool from_seam = closed_ && piece == 0, to_seam = closed_ && piece + 2 == blocks_;
        const int first = from_seam ? chain_blocks_ : piece, second = to_seam ? chain_blocks_ : piece + 1;
        for (int i = 0; i < size(block); ++i) out[i] = 0;
        for (int i = 0; (block == first || block == second) && i < size(block); ++i) {
            const int start = block == first ? place_of(block, i, 0) : -1, end = block == second ? place_of(block, i, 1) : -1;
            out[i] = (start < 0 ? Real(0) : factors[start]) + (end < 0 ? Real(0) : factors[end]);
        }
    }

    // out -= M'z for a block M (rows, columns).
    void subtract(const Real *matrix, int rows, const Real *z, int columns, Real *out) const {
        for (int i = 0; i < rows; ++i)
            for (int j = 0; j < columns; ++j) out[j] -= matrix[i * state_ + j] * z[i];
    }

    // out -= M x for a block M (rows, columns).
    void take_away(const Real *matrix, int rows, Real *out, int columns, const Real *x) const {
        for (int i = 0; i < rows; ++i)
            for (int j = 0; j < columns; ++j) out[i] -= matrix[i * state_ + j] * x[j];
    }

    void divide_transposed(int block, Real *out) const {
        const Real *const diagonal = &diagonal_[std::size_t(block) * stride_];
        for (int i = 0; i < size(block); ++i) {
            out[i] *= diagonal[i * state_ + i];
            for (int j = i + 1; j < size(block); ++j) out[j] -= diagonal[i * state_ + j] * out[i];
        }
    }

    void divide(int block, Real *out) const {
        const Real *const diagonal = &diagonal_[std::size_t(block) * stride_];
        for (int i = size(block) - 1; i >= 0; --i) {
            for (int j = i + 1; j < size(block); ++j) out[i] -= diagonal[i * state_ + j] * out[j];
            out[i] *= diagonal[i * state_ + i];
        }
    }

    Buffer<int> offset_, free_, held_;                    // (blocks + 1,); (blocks, state) values that are free; equations
    Buffer<Real> diagonal_, next_, border_, shift_;       // blocks of R, (state, state) each, and q (unknowns, axes)
    Real carry_[2 * max_state][2 * max_state + max_dim];  // rows on the next knot and the seam
    Real carried_equations_[2 * max_state][2 * max_state + max_dim];
    const Real *pull_ = nullptr;
    Real rest_ = 0;
    double products_ = 0;
    int half_ = 0, slots_ = 0, state_ = 0, blocks_ = 0, chain_blocks_ = 0, stride_ = 0, unknowns_ = 0, carried_ = 0, equations_ = 0,
        columns_ = 0;
    bool closed_ = false;
};

}  // namespace minsnap

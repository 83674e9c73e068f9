// Elimination of the block tridiagonal system of a chain of legs, knot by knot, from one end.
//
// The unknowns of a knot are its derivatives 1 ... k - 1.  A leg of duration T = 1/rate and displacement d couples the
// states x, z of its two knots by the quadratic form of gram.hpp, whose entry for orders a and b is
// Q[a][b] rate^(2k-1-a-b).  What the legs before a knot mean for it is a quadratic form (a Schur complement) with a
// right-hand side, the front.  All axes share the matrices.  With A the front's matrix and the start block of the next
// leg, E its coupling and C its end block:
//
//     gain = A^-1 E,   offset = A^-1 right,   next matrix = C - E' gain,   next right = c - E' offset,
//
// and backwards x = offset - gain z.  A = L D L' without roots, so a step costs k - 1 divisions.
#pragma once

#include "polynomials/gram.hpp"
#include "arithmetic/lanes.hpp"

namespace minsnap {

// L D L' of a symmetric matrix of n rows, of which the lower half is read.
template <int n, class Real>
struct Factor {
    Real lower[n][n];
    Real inverse[n];

    // Keeps the least pivot of all seen so far in smallest.
    MINSNAP_INLINE void compute(const Real (&matrix)[n][n], Real &smallest) {
        Real scaled[n][n];  // L D
        MINSNAP_UNROLL
        for (int j = 0; j < n; ++j) {
            Real pivot = matrix[j][j];
            MINSNAP_UNROLL
            for (int m = 0; m < j; ++m) pivot -= lower[j][m] * scaled[j][m];
            smallest = lesser(pivot, smallest);
            inverse[j] = 1.0 / pivot;
            MINSNAP_UNROLL
            for (int i = j + 1; i < n; ++i) {
                Real value = matrix[i][j];
                MINSNAP_UNROLL
                for (int m = 0; m < j; ++m) value -= lower[i][m] * scaled[j][m];
                scaled[i][j] = value;
                lower[i][j] = value * inverse[j];
            }
        }
    }

    // Solve for the columns of right (n rows), in place.
    template <int columns>
    MINSNAP_INLINE void solve(Real (&right)[n][columns]) const {
        MINSNAP_UNROLL
        for (int c = 0; c < columns; ++c) {
            MINSNAP_UNROLL
            for (int i = 1; i < n; ++i) {
                MINSNAP_UNROLL
                for (int m = 0; m < i; ++m) right[i][c] -= lower[i][m] * right[m][c];
            }
            MINSNAP_UNROLL
            for (int i = n - 1; i >= 0; --i) {
                right[i][c] *= inverse[i];
                MINSNAP_UNROLL
                for (int m = i + 1; m < n; ++m) right[i][c] -= lower[m][i] * right[m][c];
            }
        }
    }
};

// Values that a knot must have: bit a of mask stands for order a, value(a, axis) for what it is.
struct Pin {
    unsigned mask = 0;
    const double *values = nullptr;  // orders 1 ... k - 1, each of stride values
    int stride = 0;

    double value(int order, int axis) const { return values[(order - 1) * stride + axis]; }
};

template <int half, int dim, class Real>
struct Elimination {
    static constexpr int n = half - 1;
    static constexpr int lanes = Lanes<Real>::count;
    using State = Real[n][dim];

    struct Front {
        Real matrix[n][n];  // its lower half
        Real right[n][dim];
    };

    struct Record {
        Real gain[n][n];
        Real offset[n][dim];
    };

    // Powers 0 ... 2k - 2 of the rate.
    struct Powers {
        Real of[2 * half - 1];

        explicit MINSNAP_INLINE Powers(Real rate) {
            of[1] = rate;
            MINSNAP_UNROLL
            for (int p = 2; p < 2 * half - 1; ++p) of[p] = of[p / 2] * of[p - p / 2];
        }
    };

    // Entry of the leg's form between orders a of its start and b, of its start or (column k + b) of its end.
    static MINSNAP_INLINE Real entry(const Powers &rate, int a, int b, bool end) {
        return Gram<half>::rows[a][end ? half + b : b] * rate.of[2 * half - 1 - a - b];
    }

    // The leg's end block and its right-hand side for a displacement.
    static MINSNAP_INLINE void begin(Front &front, const Powers &rate, const Real (&step)[dim]) {
        MINSNAP_UNROLL
        for (int a = 1; a < half; ++a) {
            MINSNAP_UNROLL
            for (int b = 1; b <= a; ++b) front.matrix[a - 1][b - 1] = sign_of(a + b) * entry(rate, a, b, false);
            const Real pull = -sign_of(a) * entry(rate, a, 0, false);
            MINSNAP_UNROLL
            for (int d = 0; d < dim; ++d) front.right[a - 1][d] = pull * step[d];
        }
    }

    // Front at the end of the first leg, whose start has a known state; rest if it is null.
    static MINSNAP_INLINE void start(Front &front, Real rate, const Real (&step)[dim], const State *state) {
        const Powers powers(rate);
        begin(front, powers, step);
        if (state == nullptr) return;
        for (int a = 1; a < half; ++a)
            for (int b = 1; b < half; ++b)
                for (int d = 0; d < dim; ++d) front.right[b - 1][d] -= entry(powers, a, b, true) * (*state)[a - 1][d];
    }

    // Eliminate the knot of the front: record how it follows from the next one, and move the front there.
    static MINSNAP_INLINE void advance(Front &front, Real rate, const Real (&step)[dim], Record &record, Real &smallest) {
        Real coupling[n][n], matrix[n][n];
        assemble(front, rate, step, matrix, coupling, record);
        eliminate(front, matrix, coupling, record, smallest);
    }

    // The same for a knot that is pinned, in some lanes at least; rare, and kept out of the way of the other.
    static MINSNAP_APART void advance_pinned(Front &front, Real rate, const Real (&step)[dim], const Pin *const (&pins)[lanes], int axis,
                                             const double (&sign)[lanes], Record &record, Real &smallest) {
        Real coupling[n][n], matrix[n][n];
        assemble(front, rate, step, matrix, coupling, record);
        for (int lane = 0; lane < lanes; ++lane)
            if (pins[lane] != nullptr) fix(matrix, coupling, record.offset, front.right, *pins[lane], lane, axis, sign[lane]);
        eliminate(front, matrix, coupling, record, smallest);
    }

    // The state of a knot from that of the next one.
    static MINSNAP_INLINE void recover(const Record &record, const State &next, State &state) {
        MINSNAP_UNROLL
        for (int a = 0; a < n; ++a) {
            MINSNAP_UNROLL
            for (int d = 0; d < dim; ++d) {
                Real value = record.offset[a][d];
                MINSNAP_UNROLL
                for (int b = 0; b < n; ++b) value -= record.gain[a][b] * next[b][d];
                state[a][d] = value;
            }
        }
    }

    // Turn the rows of pinned orders into those of the identity, in one lane; what they meant goes to the right.
    static MINSNAP_APART void fix(Real (&matrix)[n][n], Real (&coupling)[n][n], State &right, State &next, const Pin &pin, int lane,
                                  int axis, double sign) {
        for (int order = 1; order < half; ++order) {
            if (!(pin.mask >> order & 1u)) continue;
            const int row = order - 1;
            for (int d = 0; d < dim; ++d) {
                const double value = (order % 2 ? sign : 1.0) * pin.value(order, axis + d);
                for (int a = 0; a < n; ++a) {
                    take(right[a][d], matrix[a > row ? a : row][a > row ? row : a], value, lane);
                    take(next[a][d], coupling[row][a], value, lane);
                }
                Lanes<Real>::set(right[row][d], lane, value);
            }
            for (int a = 0; a < n; ++a) {
                Lanes<Real>::set(matrix[a > row ? a : row][a > row ? row : a], lane, a == row ? 1.0 : 0.0);
                Lanes<Real>::set(coupling[row][a], lane, 0.0);
            }
        }
    }

private:
    static MINSNAP_INLINE void take(Real &total, const Real &factor, double value, int lane) {
        if constexpr (lanes == 1)
            total -= value * factor;
        else
            total[lane] -= value * factor[lane];
    }

    // Matrix and coupling of the front's knot, its right-hand side, and what the leg means for the next knot.
    static MINSNAP_INLINE void assemble(Front &front, Real rate, const Real (&step)[dim], Real (&matrix)[n][n], Real (&coupling)[n][n],
                                        Record &record) {
        const Powers powers(rate);
        MINSNAP_UNROLL
        for (int a = 1; a < half; ++a) {
            MINSNAP_UNROLL
            for (int b = 1; b < half; ++b) coupling[a - 1][b - 1] = entry(powers, a, b, true);
            MINSNAP_UNROLL
            for (int b = 1; b <= a; ++b) matrix[a - 1][b - 1] = front.matrix[a - 1][b - 1] + entry(powers, a, b, false);
            const Real pull = entry(powers, a, 0, false);
            MINSNAP_UNROLL
            for (int d = 0; d < dim; ++d) record.offset[a - 1][d] = front.right[a - 1][d] + pull * step[d];
        }
        begin(front, powers, step);
    }

    static MINSNAP_INLINE void eliminate(Front &front, const Real (&matrix)[n][n], const Real (&coupling)[n][n], Record &record,
                                         Real &smallest) {
        Factor<n, Real> factor;
        factor.compute(matrix, smallest);
        MINSNAP_UNROLL
        for (int a = 0; a < n; ++a) {
            MINSNAP_UNROLL
            for (int b = 0; b < n; ++b) record.gain[a][b] = coupling[a][b];
        }
        factor.solve(record.gain);
        factor.solve(record.offset);
        MINSNAP_UNROLL
        for (int a = 0; a < n; ++a) {
            MINSNAP_UNROLL
            for (int m = 0; m < n; ++m) {
                MINSNAP_UNROLL
                for (int b = 0; b <= a; ++b) front.matrix[a][b] -= coupling[m][a] * record.gain[m][b];
                MINSNAP_UNROLL
                for (int d = 0; d < dim; ++d) front.right[a][d] -= coupling[m][a] * record.offset[m][d];
            }
        }
    }
};

}  // namespace minsnap

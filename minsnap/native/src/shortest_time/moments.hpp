// Sums over the instants of a piece of products of its derivatives, brought to its end derivatives.
//
// Products of Bernstein polynomials are Bernstein polynomials but for a factor (R. T. Farouki, "The Bernstein polynomial basis: a centennial
// retrospective", Computer Aided Geometric Design 29, 2012). So a weighted sum of products of two derivatives is, in their control points, a Hankel
// matrix of few moments. Transposed differences bring it to the derivative below, and at last to the ends of the curve.
#pragma once

#include <algorithm>

#include "shortest_time/rows.hpp"

namespace minsnap {

// Weighted sums over the conditions and limits of a piece at all its instants, four by four; those where all sleep are not used.
template <class S>
struct InstantSums {
    static constexpr int together = InstantTerms::together, groups = S::instants / together, orders = condition_orders;
    static constexpr int kinds = 3;  // slopes, pulls (weighted as Hessians are), turns (derivatives of the gradient in the own duration)

    Quad bend[orders][orders][S::pairs][groups];  // of an order of the first axis of a pair, and one of the second
    Quad vector[orders][kinds * S::dim][groups];  // by kind, then by axis
    Quad own_slope{}, own_bend{};                 // of headings, in the own duration
    bool used[orders][orders][groups];

    InstantSums() {
        for (auto &row : used)
            for (auto &block : row)
                for (bool &group : block) group = false;
    }

    // Make room for sums of two orders at a group of instants.
    MINSNAP_INLINE void use(int q, int r, int n) {
        if (used[q][r][n]) return;
        used[q][r][n] = true;
        for (auto &pair : bend[q][r]) pair[n] = Quad{};
        for (int k = 0; q == r && k < kinds * S::dim; ++k) vector[q][k][n] = Quad{};
    }

    MINSNAP_INLINE void add(const Condition<S::dim> &condition, const double (&x)[S::dim][S::instants], int g, const RowWeights &weights) {
        const int q = condition.order, n = g / together;
        use(q, q, n);
        const Quad hessian = four(weights.hessian), outer = four(weights.outer), gradient = four(weights.gradient);
        Quad y[S::dim];
        Rows<S>::gradients(condition, x, g, y);
        for (int c = 0, t = 0; c < S::dim; ++c) {
            vector[q][c][n] += gradient * y[c];
            vector[q][S::dim + c][n] += hessian * y[c];
            const Quad scaled = outer * y[c];
            for (int d = 0; d <= c; ++d, ++t) {
                bend[q][q][t][n] += scaled * y[d];
                if (condition.curved && condition.curvature[t] != 0.0) bend[q][q][t][n] += hessian * condition.curvature[t];
            }
        }
    }

    MINSNAP_INLINE void add(const InstantLimit &limit, const InstantTerms &terms, int n) {
        const int low = limit.span.low, axes = limit.axes;
        for (int q = low; q <= limit.span.high; ++q) {
            const int from = (q - low) * axes;
            use(q, q, n);
            for (int c = 0; c < axes; ++c) {
                vector[q][c][n] += terms.slope[from + c];
                vector[q][S::dim + c][n] += terms.pull[from + c];
            }
            for (int c = 0; limit.headed() && c < axes; ++c) vector[q][2 * S::dim + c][n] += terms.crossed[from + c];
            for (int r = low; r <= limit.span.high; ++r) {
                use(q, r, n);
                for (int c = 0, t = 0; c < axes; ++c)
                    for (int d = 0; d <= c; ++d, ++t) bend[q][r][t][n] += terms.bend[from + c][(r - low) * axes + d];
            }
        }
        if (!limit.headed()) return;
        own_slope += terms.own_slope;
        own_bend += terms.own_bend;
    }

    // Find turns, and add what the own duration makes of all sums: x goes as T^-q.
    MINSNAP_INLINE void turn(const typename Rows<S>::Jets &jet, double &own_gradient, double &own) {
        for (int q = 0; q < orders; ++q)
            for (int n = 0; n < groups; ++n) {
                if (!used[q][q][n]) continue;
                Quad sum[S::dim], sloped{}, turned{};
                for (int c = 0; c < S::dim; ++c) sum[c] = static_cast<double>(q) * vector[q][S::dim + c][n];
                for (int r = 1; r < orders; ++r) {
                    if (!used[q][r][n]) continue;
                    for (int c = 0; c < S::dim; ++c)
                        for (int d = 0; d < S::dim; ++d) {
                            const Quad &entry = c > d ? bend[q][r][c * (c + 1) / 2 + d][n] : bend[r][q][d * (d + 1) / 2 + c][n];
                            sum[c] += entry * (static_cast<double>(r) * four(jet[r][d] + n * together));
                        }
                }
                for (int c = 0; c < S::dim; ++c) {
                    const Quad x = four(jet[q][c] + n * together), headed = vector[q][2 * S::dim + c][n];
                    sloped += x * vector[q][c][n];
                    turned += x * (sum[c] - 2.0 * headed);
                    vector[q][2 * S::dim + c][n] = headed - sum[c];
                }
                own_gradient -= q * total(sloped);
                own += q * total(turned);
            }
        own_gradient += total(own_slope);
        own += total(own_bend);
    }
};

// So many numbers in fours.
template <int count>
struct Fours {
    static constexpr int fours = (count + 3) / 4;
    Quad four[fours] = {};

    MINSNAP_INLINE double get(int k) const { return four[k / 4][k % 4]; }
    MINSNAP_INLINE void add(double factor, const Fours &other) {
        for (int m = 0; m < fours; ++m) four[m] += factor * other.four[m];
    }
    MINSNAP_INLINE void add(const Fours &other) {
        for (int m = 0; m < fours; ++m) four[m] += other.four[m];
    }
    MINSNAP_INLINE void scale(double factor) {
        for (int m = 0; m < fours; ++m) four[m] *= factor;
    }
    // Become a multiple of what another has more; the difference comes first, as two products round too much for hard questions.
    MINSNAP_INLINE void lessen(double factor, const Fours &other) {
        for (int m = 0; m < fours; ++m) four[m] = factor * (other.four[m] - four[m]);
    }
};

// The same for the end derivatives of a piece.
template <class S>
class EndSums {
public:
    using Sums = InstantSums<S>;
    static constexpr int ends = S::ends, kinds = Sums::kinds * S::dim;
    using Bends = Fours<S::pairs>;
    using Vectors = Fours<kinds>;

    Bends bend[ends][ends];  // of ends of the first and of the second axis of a pair
    Vectors vector[ends];

    explicit MINSNAP_INLINE EndSums(const Instants<S::half, S::instants> &instants, const Sums &sums, double inverse)
        : instants_(instants), sums_(sums), inverse_(inverse) {
        int size = 0;  // control points of the derivative of that order
        for (int q = std::min(condition_orders - 1, S::degree); q >= 0; --q) {
            if (size > 0) {
                for (int a = 0; a < size; ++a) lower(bend[a], 1, q);
                for (int b = 0; b <= size; ++b) lower(bend[0] + b, ends, q);
                lower(vector, 1, q);
            }
            size = add(q) || size > 0 ? ends - q : 0;
        }
        for (int a = 0; a < ends; ++a) turn(bend[a], 1);
        for (int b = 0; b < ends; ++b) turn(bend[0] + b, ends);
        turn(vector, 1);
    }

private:
    // From sums with control points of the derivative after an order to sums with those of that order: transposed differences.
    template <class Line>
    MINSNAP_INLINE void lower(Line *line, int stride, int order) const {
        const int size = S::degree - order;
        const double factor = size * inverse_;
        line[size * stride] = line[(size - 1) * stride];
        line[size * stride].scale(factor);
        for (int i = size - 1; i > 0; --i) line[i * stride].lessen(factor, line[(i - 1) * stride]);
        line[0].scale(-factor);
    }

    // From control points of the curve to its ends.
    template <class Line>
    MINSNAP_INLINE void turn(Line *line, int stride) const {
        Line turned[ends];
        for (int a = 0; a < ends; ++a) {
            const int first = a < S::half ? a : S::half, last = a < S::half ? S::half - 1 : S::degree + S::half - a;
            for (int j = first; j <= last; ++j) turned[a].add(instants_.control[j][a], line[j * stride]);
        }
        for (int a = 0; a < ends; ++a) line[a * stride] = turned[a];
    }

    // Add sums of a derivative and of those above it with it; false where there are none.
    MINSNAP_INLINE bool add(int q) {
        int groups[Sums::groups], count = list(q, q, groups);
        if (count == 0) return false;
        Bends moment[2 * ends - 1];
        moments<S::pairs>(sums_.bend[q][q], 2 * (S::degree - q), groups, count, moment);
        for (int i = 0; i < ends - q; ++i)
            for (int j = 0; j < ends - q; ++j) bend[i][j].add(chosen(q, i) * chosen(q, j), moment[i + j]);
        Vectors straight[ends];
        moments<kinds>(sums_.vector[q], S::degree - q, groups, count, straight);
        for (int i = 0; i < ends - q; ++i) vector[i].add(chosen(q, i), straight[i]);
        for (int r = q + 1; r < condition_orders && r <= S::degree; ++r) {
            count = list(q, r, groups);
            if (count == 0) continue;
            Bends block[ends][ends];
            cross(sums_.bend[r][q], r, q, groups, count, block);
            for (int i = 0; i < ends - q; ++i)
                for (int j = 0; j < ends - q; ++j) bend[i][j].add(block[i][j]);
            cross(sums_.bend[q][r], r, q, groups, count, block);
            for (int i = 0; i < ends - q; ++i)
                for (int j = 0; j < ends - q; ++j) bend[j][i].add(block[i][j]);
        }
        return true;
    }

    // Sums of a derivative r by rows and a lower one q by columns, with control points of the lower one.
    MINSNAP_INLINE void cross(const Quad (&sums)[S::pairs][Sums::groups], int r, int q, const int *groups, int count,
                              Bends (&block)[ends][ends]) const {
        Bends moment[2 * ends - 1];
        moments<S::pairs>(sums, 2 * S::degree - q - r, groups, count, moment);
        for (int j = 0; j < ends - q; ++j) {
            for (int i = 0; i < ends - r; ++i) {
                block[i][j] = {};
                block[i][j].add(chosen(r, i) * chosen(q, j), moment[i + j]);
            }
            for (int order = r - 1; order >= q; --order) lower(block[0] + j, ends, order);
        }
    }

    // Sums over the instants with s^k (1 - s)^(degree - k).
    template <int count>
    MINSNAP_INLINE void moments(const Quad (&sums)[count][Sums::groups], int degree, const int *groups, int number,
                                Fours<count> *found) const {
        for (int k = 0; k <= degree; ++k) {
            Quad sum[4 * Fours<count>::fours] = {};
            for (int m = 0; m < number; ++m) {
                const Quad power = four(instants_.powers[degree][k] + groups[m] * Sums::together);
                for (int t = 0; t < count; ++t) sum[t] += sums[t][groups[m]] * power;
            }
            for (int m = 0; m < Fours<count>::fours; ++m) {
                const Quad *own = sum + 4 * m;
                found[k].four[m] = totals(own[0], own[1], own[2], own[3]);
            }
        }
    }

    MINSNAP_INLINE double chosen(int order, int i) const { return instants_.choose[S::degree - order][i]; }

    // Groups of instants with sums of two derivatives.
    MINSNAP_INLINE int list(int q, int r, int *groups) const {
        int count = 0;
        for (int n = 0; n < Sums::groups; ++n)
            if (sums_.used[q][r][n]) groups[count++] = n;
        return count;
    }

    const Instants<S::half, S::instants> &instants_;
    const Sums &sums_;
    const double inverse_;
};

}  // namespace minsnap

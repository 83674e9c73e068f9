// The quadratic model of the barrier problem: exact Hessian of the Lagrangian plus the barrier's, its gradient, and the metric that damps steps.
//
// A row c(v), v = X_q / T^q, has dv/ds = -q v in the logarithm s of the piece's own duration; the ends of a piece are products of powers of
// durations and unknowns (`chain.hpp`). Both are applied one after the other, first and second derivatives alike.
#pragma once

#include "shortest_time/bordered_band.hpp"
#include "shortest_time/objective.hpp"
#include "shortest_time/rows.hpp"

namespace minsnap {

// Second and first derivatives of a weighted sum in the ends and in the own duration of one piece.
template <class S>
struct PieceModel {
    static constexpr int count_at = S::instants, together = InstantTerms::together;

    double blocks[S::pairs][S::packed];                              // in the ends, for every pair of axes
    double cross[S::whole], own;                                     // of ends and duration; of the duration
    double gradient[S::whole], force[S::whole], own_gradient = 0.0;  // force: weighted as the Hessians are
    double dense[S::pairs][S::ends][S::ends];                        // of limits on several derivatives: by ends of the first axis
    bool dense_used = false;

    void clear() {
        for (auto &block : blocks)
            for (double &entry : block) entry = 0.0;
        for (int a = 0; a < S::whole; ++a) cross[a] = gradient[a] = force[a] = 0.0;
        own = own_gradient = 0.0;
    }

    // Add all rows of a piece.
    void add_rows(const Rows<S> &rows, const Chain<S> &chain, int i, const PieceEnds<S> &piece, const typename Rows<S>::Jets &jet,
                  const RowWeights &weights) {
        const int leg = i / chain.per_leg, begin = rows.first[i];
        const Condition<S::dim> *condition = rows.legs.begin(leg);
        int row = begin;
        for (int k = 0, q = 0; q < condition_orders; ++q) {
            if (k == rows.legs.count(leg) || condition->order != q) continue;
            Gathered sums;
            for (; k < rows.legs.count(leg) && condition->order == q; ++k, ++condition, row += count_at)
                for (int g = 0; g < count_at; g += together)
                    if (rows.is_awake(row + g)) add_condition(*condition, jet[q], g, weights.from(row + g), sums);
            put(rows.instants, q, piece.inverse[q], jet[q], sums);
        }
        add_limits(rows, chain, i, piece, jet, weights, row);
        rows.knot_rows(chain, i, piece,
                       [&](const Condition<S::dim> &at_knot, int a, const double *x) { add_knot(at_knot, a, x, piece, row++, weights); });
        if (!rows.floored) return;
        own_gradient -= weights.gradient[row];
        own += weights.outer[row];
    }

    // Add a multiple of the integral of a squared derivative over the unit interval, where the multiple goes as T^power.
    void add_square(const double *gram, const double *e, double weight, double power) {
        double value = 0.0;
        for (int c = 0, t = 0; c < S::dim; ++c) {
            t += c;
            for (int k = 0; k < S::packed; ++k) blocks[t][k] += weight * gram[k];
            t += 1;
            for (int a = 0; a < S::ends; ++a) {
                double sum = 0.0;
                for (int b = 0; b < S::ends; ++b) sum += gram[a > b ? a * (a + 1) / 2 + b : b * (b + 1) / 2 + a] * e[b * S::dim + c];
                sum *= weight;
                gradient[a * S::dim + c] += sum;
                force[a * S::dim + c] += sum;
                cross[a * S::dim + c] += power * sum;
                value += 0.5 * sum * e[a * S::dim + c];
            }
        }
        own_gradient += power * value;
        own += power * power * value;
    }

private:
    // Sums over the conditions on one derivative at all instants, four by four; those whose conditions all sleep are not used.
    struct Gathered {
        struct Group {
            Quad bend[S::pairs], slope[S::dim], pull[S::dim];
        } groups[count_at / together];
        bool used[count_at / together] = {};
    };

    // Slopes, pulls and turns of limits at instants, brought to the ends.
    using Sums = double[S::dim][3][S::ends];

    // Add all limits on several derivatives, which tie them to each other.
    void add_limits(const Rows<S> &rows, const Chain<S> &chain, int i, const PieceEnds<S> &piece, const typename Rows<S>::Jets &jet,
                    const RowWeights &weights, int &row) {
        dense_used = rows.limit_count > 0;
        if (!dense_used) return;
        for (auto &block : dense)
            for (auto &line : block)
                for (double &entry : line) entry = 0.0;
        Sums sums = {};
        for (const int axes : {2, 3}) {
            const Span span = rows.limited(axes);
            if (span.high < span.low) continue;
            for (int g = 0; g < count_at; g += together) {
                Quad u[InstantLimit::most_inputs];
                InstantTerms own, all;
                all.clear(span.count() * axes);
                bool used = false;
                int from = row + g;
                for (int k = 0; k < rows.limit_count; from += rows.limits[k++].functions * count_at) {
                    const InstantLimit &limit = rows.limits[k];
                    if (limit.axes != axes || !rows.is_awake(limit, from)) continue;
                    used = true;
                    rows.inputs(limit.span, axes, jet, g, u);
                    limit.gather(u, weights.from(from), count_at, own);
                    if (g == 0 && rows.pinned(chain, i, 0, limit)) own.silence(limit.inputs(), 0);
                    if (g + together == count_at && rows.pinned(chain, i, 1, limit)) own.silence(limit.inputs(), together - 1);
                    all.add(own, limit.inputs(), (limit.span.low - span.low) * axes);
                }
                if (!used) continue;
                rows.inputs(span, axes, jet, g, u);
                put(rows.instants, span, axes, g, piece, u, all, sums);
            }
        }
        for (int k = 0; k < rows.limit_count; ++k) row += rows.limits[k].functions * count_at;
        for (int c = 0; c < S::dim; ++c)
            for (int a = 0; a < S::ends; ++a) {
                gradient[a * S::dim + c] += sums[c][0][a];
                force[a * S::dim + c] += sums[c][1][a];
                cross[a * S::dim + c] += sums[c][2][a];
            }
    }

    // What the ends make of a derivative at the instants of all lanes.
    using Factors = double[together][condition_orders][S::ends];

    // Bring terms at the instants of all lanes to the ends.
    MINSNAP_INLINE void put(const Instants<S::half, S::instants> &instants, const Span &span, int axes, int g, const PieceEnds<S> &piece,
                            const Quad *u, const InstantTerms &terms, Sums &sums) {
        const int orders = span.count(), count = orders * axes;
        Factors factor;
        for (int lane = 0; lane < together; ++lane)
            for (int q = 0; q < orders; ++q)
                for (int a = 0; a < S::ends; ++a)
                    factor[lane][q][a] = instants.by_instant[span.low + q][g + lane][a] * piece.inverse[span.low + q];
        for (int n = 0; n < count; ++n) {
            const double q = span.low + n / axes;
            Quad sum = q * terms.pull[n];
            for (int m = 0; m < count; ++m) sum += terms.bend[n][m] * (static_cast<double>(span.low + m / axes) * u[m]);
            const Quad sloped = q * u[n] * terms.slope[n], bent = q * u[n] * sum;
            auto &mine = sums[n % axes];
            for (int lane = 0; lane < together; ++lane) {
                own_gradient -= sloped[lane];
                own += bent[lane];
                const double *share = factor[lane][n / axes];
                const double slope = terms.slope[n][lane], pull = terms.pull[n][lane], turn = sum[lane];
                for (int a = 0; a < S::ends; ++a) mine[0][a] += slope * share[a];
                for (int a = 0; a < S::ends; ++a) mine[1][a] += pull * share[a];
                for (int a = 0; a < S::ends; ++a) mine[2][a] -= turn * share[a];
            }
        }
        for (int c = 0, t = 0; c < axes; ++c)
            for (int d = 0; d <= c; ++d, ++t) {
                if (orders == 2) put_bends<2>(factor, axes, c, d, terms, dense[t]);
                if (orders == 3) put_bends<3>(factor, axes, c, d, terms, dense[t]);
                if (orders == 4) put_bends<4>(factor, axes, c, d, terms, dense[t]);
            }
    }

    // Of two axes.
    template <int orders>
    static MINSNAP_INLINE void put_bends(const Factors &factor, int axes, int c, int d, const InstantTerms &terms,
                                         double (*block)[S::ends]) {
        double line[together][orders][S::ends];
        for (int lane = 0; lane < together; ++lane)
            for (int q = 0; q < orders; ++q) {
                for (int b = 0; b < S::ends; ++b) line[lane][q][b] = 0.0;
                for (int r = 0; r < orders; ++r) {
                    const double bend = terms.bend[q * axes + c][r * axes + d][lane];
                    for (int b = 0; b < S::ends; ++b) line[lane][q][b] += bend * factor[lane][r][b];
                }
            }
        for (int a = 0; a < S::ends; ++a) {
            double sum[S::ends];
            for (int b = 0; b < S::ends; ++b) sum[b] = block[a][b];
            for (int lane = 0; lane < together; ++lane)
                for (int q = 0; q < orders; ++q) {
                    const double share = factor[lane][q][a];
                    for (int b = 0; b < S::ends; ++b) sum[b] += share * line[lane][q][b];
                }
            for (int b = 0; b < S::ends; ++b) block[a][b] = sum[b];
        }
    }

    static MINSNAP_INLINE void add_condition(const Condition<S::dim> &condition, const double (&x)[S::dim][count_at], int g,
                                             const RowWeights &weights, Gathered &sums) {
        auto &to = sums.groups[g / together];
        if (!sums.used[g / together]) to = {};
        sums.used[g / together] = true;
        const Quad hessian = four(weights.hessian), outer = four(weights.outer), gradient = four(weights.gradient);
        Quad y[S::dim];
        Rows<S>::gradients(condition, x, g, y);
        for (int c = 0, t = 0; c < S::dim; ++c) {
            to.slope[c] += gradient * y[c];
            to.pull[c] += hessian * y[c];
            const Quad scaled = outer * y[c];
            for (int d = 0; d <= c; ++d, ++t) {
                to.bend[t] += scaled * y[d];
                if (condition.curved && condition.curvature[t] != 0.0) to.bend[t] += hessian * condition.curvature[t];
            }
        }
    }

    // Bring what was gathered at the instants for one order to the ends.
    MINSNAP_INLINE void put(const Instants<S::half, S::instants> &instants, int q, double inverse, const double (&x)[S::dim][count_at],
                            const Gathered &sums) {
        constexpr int groups = count_at / together;
        Quad turn[S::dim][groups], sloped = {}, turned = {};  // turn: minus the derivative of the gradient in the own duration
        int used[groups], count = 0;
        for (int n = 0; n < groups; ++n) {
            if (!sums.used[n]) continue;
            used[count++] = n;
            const auto &from = sums.groups[n];
            for (int c = 0; c < S::dim; ++c) {
                Quad sum = from.pull[c];
                for (int d = 0; d < S::dim; ++d)
                    sum += from.bend[c > d ? c * (c + 1) / 2 + d : d * (d + 1) / 2 + c] * four(x[d] + n * together);
                turn[c][n] = sum;
                sloped += four(x[c] + n * together) * from.slope[c];
                turned += four(x[c] + n * together) * sum;
            }
        }
        own_gradient -= q * total(sloped);
        own += q * q * total(turned);
        for (int t = 0; t < S::pairs; ++t)
            for (int m = 0; m < count; ++m) {
                const Quad weight = sums.groups[used[m]].bend[t] * (inverse * inverse);
                const auto *product = instants.products[q] + used[m] * together;
                for (int k = 0; k < S::packed; ++k)
                    blocks[t][k] +=
                        (weight[0] * product[0][k] + weight[1] * product[1][k]) + (weight[2] * product[2][k] + weight[3] * product[3][k]);
            }
        for (int c = 0; c < S::dim; ++c)
            for (int a = 0; a < S::ends; ++a) {
                Quad slopes = {}, pulls = {}, turns = {};
                for (int m = 0; m < count; ++m) {
                    const int n = used[m];
                    const Quad factor = four(instants.by_end[q][a] + n * together);
                    slopes += factor * sums.groups[n].slope[c];
                    pulls += factor * sums.groups[n].pull[c];
                    turns += factor * turn[c][n];
                }
                gradient[a * S::dim + c] += inverse * total(slopes);
                force[a * S::dim + c] += inverse * total(pulls);
                cross[a * S::dim + c] -= q * inverse * total(turns);
            }
    }

    void add_knot(const Condition<S::dim> &condition, int a, const double *x, const PieceEnds<S> &piece, int row,
                  const RowWeights &weights) {
        const int q = condition.order, place = a * (a + 1) / 2 + a;
        const double inverse = piece.inverse[q], hessian = weights.hessian[row], outer = weights.outer[row];
        double y[S::dim], turn[S::dim];
        condition.at(x, y);
        for (int c = 0; c < S::dim; ++c) turn[c] = -q * hessian * y[c];
        for (int c = 0, t = 0; c < S::dim; ++c)
            for (int d = 0; d <= c; ++d, ++t) {
                const double bend = outer * y[c] * y[d] + (condition.curved ? hessian * condition.curvature[t] : 0.0);
                blocks[t][place] += bend * inverse * inverse;
                turn[c] -= q * bend * x[d];
                if (c != d) turn[d] -= q * bend * x[c];
            }
        for (int c = 0; c < S::dim; ++c) {
            gradient[a * S::dim + c] += weights.gradient[row] * y[c] * inverse;
            force[a * S::dim + c] += hessian * y[c] * inverse;
            cross[a * S::dim + c] += turn[c] * inverse;
            own_gradient -= q * x[c] * weights.gradient[row] * y[c];
            own -= q * x[c] * turn[c];
        }
    }
};

}  // namespace minsnap

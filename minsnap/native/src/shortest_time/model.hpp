// The quadratic model of the barrier problem: exact Hessian of the Lagrangian plus the barrier's, its gradient, and the metric that damps steps.
//
// A row c(v), v = X_q / T^q, has dv/ds = -q v in the logarithm s of the piece's own duration; the ends of a piece are products of powers of
// durations and unknowns (`chain.hpp`). Both are applied one after the other, first and second derivatives alike.
#pragma once

#include "shortest_time/bordered_band.hpp"
#include "shortest_time/moments.hpp"
#include "shortest_time/objective.hpp"

namespace minsnap {

// Second and first derivatives of a weighted sum in the ends and in the own duration of one piece.
template <class S>
struct PieceModel {
    static constexpr int count_at = S::instants, together = InstantTerms::together;

    double whole[S::whole][S::whole];                                // in the ends: symmetric
    double cross[S::whole], own = 0.0;                               // of ends and duration; of the duration
    double gradient[S::whole], force[S::whole], own_gradient = 0.0;  // force: weighted as the Hessians are

    // Of all rows of a piece.
    MINSNAP_INLINE PieceModel(const Rows<S> &rows, const Chain<S> &chain, int i, const PieceState<S> &state, const RowWeights &weights) {
        InstantSums<S> sums;
        int row = rows.first[i];
        add_conditions(rows, i / chain.per_leg, state.jets, weights, row, sums);
        add_limits(rows, chain, i, state.ends.inverse, state.jets, weights, row, sums);
        sums.turn(state.jets, own_gradient, own);
        take(EndSums<S>(rows.instants, sums, state.ends.inverse[1]));
        rows.knot_rows(chain, i, state.ends, [&](const Condition<S::dim> &at_knot, int a, const double *x) {
            add_knot(at_knot, a, x, state.ends, row++, weights);
        });
        if (!rows.comes_back(i)) return;
        own_gradient += weights.gradient[row];
        own += weights.outer[row];
    }

    // Add a multiple of the integral of a squared derivative over the unit interval, where the multiple goes as T^power.
    void add_square(const double *gram, const double *e, double weight, double power) {
        double value = 0.0;
        for (int a = 0; a < S::ends; ++a)
            for (int c = 0; c < S::dim; ++c) {
                const int r = a * S::dim + c;
                double sum = 0.0;
                for (int b = 0; b < S::ends; ++b) {
                    const double entry = weight * gram[a > b ? a * (a + 1) / 2 + b : b * (b + 1) / 2 + a];
                    whole[r][b * S::dim + c] += entry;
                    sum += entry * e[b * S::dim + c];
                }
                gradient[r] += sum;
                force[r] += sum;
                cross[r] += power * sum;
                value += 0.5 * sum * e[r];
            }
        own_gradient += power * value;
        own += power * power * value;
    }

    // Add a multiple of half the integral of the squared derivative of order half, where the multiple goes as T^power.
    void add_cost(const Instants<S::half, S::instants> &tables, const double *e, double weight, double power) {
        const TopDerivative<S> top(e, tables);
        const double value = 0.5 * weight * top.square;
        for (int a = 0; a < S::ends; ++a)
            for (int c = 0; c < S::dim; ++c) {
                const int r = a * S::dim + c;
                const double slope = weight * top.slope(tables, a, c);
                for (int b = 0; b < S::ends; ++b)
                    whole[r][b * S::dim + c] += weight * tables.gram[S::half][a > b ? a * (a + 1) / 2 + b : b * (b + 1) / 2 + a];
                gradient[r] += slope;
                force[r] += slope;
                cross[r] += power * slope;
            }
        own_gradient += power * value;
        own += power * power * value;
    }

private:
    static MINSNAP_INLINE void add_conditions(const Rows<S> &rows, int leg, const typename Rows<S>::Jets &jet, const RowWeights &weights,
                                              int &row, InstantSums<S> &sums) {
        const Condition<S::dim> *condition = rows.legs.begin(leg);
        for (int k = 0; k < rows.legs.count(leg); ++k, ++condition, row += count_at)
            for (int g = 0; g < count_at; g += together)
                if (rows.is_awake(row + g)) sums.add(*condition, jet[condition->order], g, weights.from(row + g));
    }

    // Those on several derivatives, which tie them to each other.
    static MINSNAP_INLINE void add_limits(const Rows<S> &rows, const Chain<S> &chain, int i, const double *inverse,
                                          const typename Rows<S>::Jets &jet, const RowWeights &weights, int &row, InstantSums<S> &sums) {
        Quad u[InstantLimit::most_inputs];
        InstantTerms terms;
        for (int k = 0; k < rows.limit_count; row += rows.limits[k++].functions * count_at) {
            const InstantLimit &limit = rows.limits[k];
            for (int g = 0; g < count_at; g += together) {
                if (!rows.is_awake(limit, row + g)) continue;
                rows.inputs(limit, i, inverse, jet, g, u);
                limit.gather(u, weights.from(row + g), count_at, terms);
                if (g == 0 && rows.pinned(chain, i, 0, limit)) terms.silence(limit.inputs(), 0);
                if (g + together == count_at && rows.pinned(chain, i, 1, limit)) terms.silence(limit.inputs(), together - 1);
                sums.add(limit, terms, g / together);
            }
        }
    }

    // Symmetric to the last bit.
    MINSNAP_INLINE void take(const EndSums<S> &sums) {
        for (int a = 0; a < S::ends; ++a)
            for (int c = 0, t = 0; c < S::dim; ++c) {
                const int r = a * S::dim + c;
                gradient[r] = sums.vector[a].get(c);
                force[r] = sums.vector[a].get(S::dim + c);
                cross[r] = sums.vector[a].get(2 * S::dim + c);
                for (int d = 0; d <= c; ++d, ++t)
                    for (int b = 0; b < (c == d ? a + 1 : S::ends); ++b)
                        whole[r][b * S::dim + d] = whole[b * S::dim + d][r] = sums.bend[a][b].get(t);
            }
    }

    void add_knot(const Condition<S::dim> &condition, int a, const double *x, const PieceEnds<S> &piece, int row,
                  const RowWeights &weights) {
        const int q = condition.order, r = a * S::dim;
        const double inverse = piece.inverse[q], hessian = weights.hessian[row], outer = weights.outer[row];
        double y[S::dim], turn[S::dim];
        condition.at(x, y);
        for (int c = 0; c < S::dim; ++c) turn[c] = -q * hessian * y[c];
        for (int c = 0, t = 0; c < S::dim; ++c)
            for (int d = 0; d <= c; ++d, ++t) {
                const double bend = outer * y[c] * y[d] + (condition.curved ? hessian * condition.curvature[t] : 0.0);
                whole[r + c][r + d] += bend * inverse * inverse;
                turn[c] -= q * bend * x[d];
                if (c == d) continue;
                whole[r + d][r + c] += bend * inverse * inverse;
                turn[d] -= q * bend * x[c];
            }
        for (int c = 0; c < S::dim; ++c) {
            gradient[r + c] += weights.gradient[row] * y[c] * inverse;
            force[r + c] += hessian * y[c] * inverse;
            cross[r + c] += turn[c] * inverse;
            own_gradient -= q * x[c] * weights.gradient[row] * y[c];
            own -= q * x[c] * turn[c];
        }
    }
};

}  // namespace minsnap

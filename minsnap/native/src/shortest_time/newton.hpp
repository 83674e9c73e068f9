// One damped Newton step of the barrier problem: assembly over the pieces, a banded factorisation, more damping as long as a pivot is not positive.
//
// Unknowns stand along the chain, K0 s0 K1 s1 ... KN; the knots at the ends only where they may move. A ring has K0, s0 and
// its last duration in the border, which the first piece ties to K1.
#pragma once

#include "arithmetic/wide.hpp"
#include "shortest_time/model.hpp"

namespace minsnap {

template <class S>
class NewtonSystem {
public:
    int size = 0;
    Buffer<double> gradient, step;              // (size,)
    Buffer<double> step_durations, step_knots;  // (pieces,), (pieces + 1, half, dim)

    [[nodiscard]] bool allocate(int pieces) {
        const int most = (pieces + 1) * S::block;
        return hessian_.allocate(most, S::block + 1) && metric_.allocate(most, S::block + 1) && factor_.allocate(most, S::block + 1) &&
               gradient.allocate(most) && step.allocate(most) && step_durations.allocate(pieces) && step_knots.allocate(most);
    }

    void lay_out(const Chain<S> &chain) {
        const bool closed = chain.course.closed;
        skipped_ = closed ? S::block : moves(chain, 0) ? 0 : S::knot;
        const int knots = closed ? chain.pieces : chain.pieces + (moves(chain, chain.pieces) ? 1 : 0);
        size = closed ? knots * S::block : (chain.pieces * S::block + (knots > chain.pieces ? S::knot : 0)) - skipped_;
        banded_ = closed ? size - S::block - 1 : size;
    }

    // Fill the matrix, the metric and the gradient for weights of the rows.
    void assemble(const Chain<S> &chain, const Rows<S> &rows, const TimeObjective<S> &objective, const PieceState<S> *states,
                  const RowWeights &weights) {
        widely([&]() MINSNAP_INLINED { add_pieces(chain, rows, objective, states, weights); });
    }

    // Solve with at least so much damping; false where none suffices. `damping` becomes what was used.
    [[nodiscard]] bool solve(const Chain<S> &chain, double &damping) {
        for (int attempt = 0; attempt < ShortestSettings::tries; ++attempt) {
            bool solved = false;
            widely([&]() MINSNAP_INLINED {
                factor_.combine(hessian_, damping, metric_);
                solved = factor_.factor();
                if (!solved) return;
                for (int k = 0; k < size; ++k) step[k] = -gradient[k];
                factor_.solve(step.data());
                spread(chain);
            });
            if (solved) return true;
            damping = damping == 0.0 ? ShortestSettings::damping : damping * ShortestSettings::damping_growth;
        }
        return false;
    }

    // Slope of the merit along the step; negative where it descends.
    double slope() const {
        double sum = 0.0;
        for (int k = 0; k < size; ++k) sum += gradient[k] * step[k];
        return sum;
    }

private:
    void add_pieces(const Chain<S> &chain, const Rows<S> &rows, const TimeObjective<S> &objective, const PieceState<S> *states,
                    const RowWeights &weights) {
        hessian_.clear(size, banded_);
        metric_.clear(size, banded_);
        for (int k = 0; k < size; ++k) gradient[k] = 0.0;
        PieceModel<S> model;
        for (int i = 0; i < chain.pieces; ++i) {
            const PieceEnds<S> &piece = states[i].ends;
            model.clear();
            model.add_rows(rows, chain, i, piece, states[i].jets, weights);
            model.add_square(rows.instants.gram[objective.smoothed], piece.e, objective.smoothing(piece), objective.smoothing_power);
            if (objective.price > 0.0)
                model.add_square(rows.instants.gram[S::half], piece.e, objective.costing(piece), objective.costing_power);
            model.own_gradient += piece.duration / objective.unit;
            model.own += piece.duration / objective.unit;
            int place[S::local];
            places(chain, i, place);
            scatter(chain, i, piece, model, place);
            add_balance(chain, objective, i, place);
            add_metric(rows.instants, objective, piece, place);
        }
        for (int knot = 0; knot <= chain.pieces; ++knot) pin(chain, knot);
    }

    static bool moves(const Chain<S> &chain, int knot) {
        bool found = false;
        for (int entry = 0; entry < S::knot; ++entry) found = found || chain.varies(knot, entry);
        return found;
    }

    int knot_place(const Chain<S> &chain, int knot) const {
        if (chain.course.closed && knot % chain.pieces == 0) return banded_;
        const int place = knot * S::block - skipped_;
        return place < 0 || place >= size ? -1 : place;
    }
    int duration_place(const Chain<S> &chain, int i) const {
        if (chain.course.closed && i == 0) return banded_ + S::knot;
        if (chain.course.closed && i + 1 == chain.pieces) return banded_ + S::block;
        return i * S::block + S::knot - skipped_;
    }

    // Where the unknowns of a piece stand: the duration before, the knot before, its own duration, the knot after, the duration after; -1 for none.
    void places(const Chain<S> &chain, int i, int *place) const {
        const int before = chain.before(i), after = chain.after(i);
        place[0] = before < 0 ? -1 : duration_place(chain, before);
        place[S::knot + 1] = duration_place(chain, i);
        place[S::local - 1] = after < 0 ? -1 : duration_place(chain, after);
        for (int right = 0; right < 2; ++right) {
            const int from = knot_place(chain, i + right);
            for (int entry = 0; entry < S::knot; ++entry)
                place[right * (S::knot + 1) + 1 + entry] = from < 0 || !chain.varies(i + right, entry) ? -1 : from + entry;
        }
    }

    // From ends and the own duration to the unknowns.
    void scatter(const Chain<S> &chain, int i, const PieceEnds<S> &piece, PieceModel<S> &model, const int *place) {
        static constexpr int logs[3] = {0, S::knot + 1, S::local - 1};
        double whole[S::whole][S::whole], rate[3][S::whole] = {}, times[3][S::whole] = {}, scale[S::whole];
        for (int a = 0; a < S::ends; ++a)
            for (int c = 0; c < S::dim; ++c) {
                const int r = a * S::dim + c;
                scale[r] = piece.scale[a];
                rate[1][r] = piece.own[a] * piece.e[r];
                rate[a < S::half ? 0 : 2][r] = piece.other[a] * piece.e[r];
                for (int b = 0; b < S::ends; ++b)
                    for (int d = 0; d < S::dim; ++d)
                        whole[r][b * S::dim + d] = model.blocks[c > d ? c * (c + 1) / 2 + d : d * (d + 1) / 2 + c]
                                                               [a > b ? a * (a + 1) / 2 + b : b * (b + 1) / 2 + a];
            }
        if (model.dense_used) add_dense(model, whole);
        turn(chain, i, model, whole);
        for (int m = 0; m < 3; ++m)
            for (int r = 0; r < S::whole; ++r) {
                if (rate[m][r] == 0.0) continue;
                for (int s = 0; s < S::whole; ++s) times[m][s] += rate[m][r] * whole[r][s];
            }
        auto row_of = [](int r) { return r < S::knot ? 1 + r : 2 + r; };
        for (int r = 0; r < S::whole; ++r) {
            const int row = place[row_of(r)];
            if (row < 0) continue;
            gradient[row] += scale[r] * model.gradient[r];
            for (int s = 0; s <= r; ++s) {
                const int column = place[row_of(s)];
                if (column >= 0) hessian_.add(row, column, (row == column && r != s ? 2.0 : 1.0) * scale[r] * scale[s] * whole[r][s]);
            }
        }
        for (int m = 0; m < 3; ++m) {
            const int row = place[logs[m]];
            if (row < 0) continue;
            const double direct = m == 1 ? 1.0 : 0.0;
            double sum = direct * model.own_gradient;
            for (int r = 0; r < S::whole; ++r) sum += rate[m][r] * model.gradient[r];
            gradient[row] += sum;
            for (int r = 0; r < S::whole; ++r) {
                const int column = place[row_of(r)], a = r / S::dim;
                if (column < 0) continue;
                const double power = m == 1 ? piece.own[a] : (m == 0) == (a < S::half) ? piece.other[a] : 0.0;
                hessian_.add(row, column, scale[r] * (times[m][r] + direct * model.cross[r] + power * model.force[r]));
            }
            for (int n = 0; n <= m; ++n) {
                const int column = place[logs[n]];
                if (column < 0) continue;
                const double other = n == 1 ? 1.0 : 0.0;
                double value = direct * other * model.own;
                for (int r = 0; r < S::whole; ++r) {
                    const int a = r / S::dim;
                    const double power = n == 1 ? piece.own[a] : (n == 0) == (a < S::half) ? piece.other[a] : 0.0;
                    value += rate[n][r] * (times[m][r] + direct * model.cross[r]) + other * rate[m][r] * model.cross[r] +
                             power * rate[m][r] * model.force[r];
                }
                hessian_.add(row, column, row == column && m != n ? 2.0 * value : value);
            }
        }
    }

    // Symmetric to the last bit.
    static void add_dense(const PieceModel<S> &model, double (&whole)[S::whole][S::whole]) {
        for (int c = 0, t = 0; c < S::dim; ++c)
            for (int d = 0; d <= c; ++d, ++t)
                for (int a = 0; a < S::ends; ++a)
                    for (int b = 0; b < (c == d ? a + 1 : S::ends); ++b) {
                        const int r = a * S::dim + c, s = b * S::dim + d;
                        whole[r][s] += model.dense[t][a][b];
                        if (r != s) whole[s][r] += model.dense[t][a][b];
                    }
    }

    // To the axes of the waypoints' positions: these do not depend on durations.
    static void turn(const Chain<S> &chain, int i, PieceModel<S> &model, double (&whole)[S::whole][S::whole]) {
        for (int right = 0; right < 2; ++right) {
            const double *axes = chain.axes_at(i, right);
            if (axes == nullptr) continue;
            const int begin = right * S::knot;
            const auto along = [axes](double *first, int stride) {
                double world[S::dim];
                for (int c = 0; c < S::dim; ++c) world[c] = first[c * stride];
                for (int c = 0; c < S::dim; ++c) {
                    first[c * stride] = 0.0;
                    for (int d = 0; d < S::dim; ++d) first[c * stride] += axes[d * S::dim + c] * world[d];
                }
            };
            for (int s = 0; s < S::whole; ++s) along(&whole[begin][s], S::whole);
            for (int r = 0; r < S::whole; ++r) along(&whole[r][begin], 1);
            along(model.gradient + begin, 1);
            along(model.cross + begin, 1);
            along(model.force + begin, 1);
        }
    }

    void add_balance(const Chain<S> &chain, const TimeObjective<S> &objective, int i, const int *place) {
        const double weight = objective.balance(chain, i);
        if (weight == 0.0) return;
        const double force = weight * objective.deviation(chain, i);
        const int own = place[S::knot + 1], next = place[S::local - 1];
        gradient[own] += force;
        gradient[next] -= force;
        hessian_.add(own, own, weight);
        hessian_.add(next, next, weight);
        hessian_.add(own, next, -weight);
    }

    // Squares of speed, acceleration and jerk in units of what counts as large, and of the logarithm of the duration.
    void add_metric(const Instants<S::half, S::instants> &instants, const TimeObjective<S> &objective, const PieceEnds<S> &piece,
                    const int *place) {
        double sum[S::packed] = {};
        for (int q = 1; q < 4 && q < 2 * S::half; ++q) {
            const double size = objective.sizes[q - 1] / piece.inverse[q], weight = piece.duration / (objective.unit * size * size);
            for (int k = 0; k < S::packed; ++k) sum[k] += weight * instants.gram[q][k];
        }
        for (int a = 0, k = 0; a < S::ends; ++a)
            for (int b = 0; b <= a; ++b, ++k)
                for (int c = 0; c < S::dim; ++c) {
                    const int row = place[(a < S::half ? 1 : 2) + a * S::dim + c], column = place[(b < S::half ? 1 : 2) + b * S::dim + c];
                    if (row >= 0 && column >= 0)
                        metric_.add(row, column, (row == column && a != b ? 2.0 : 1.0) * sum[k] * piece.scale[a] * piece.scale[b]);
                }
        metric_.add(place[S::knot + 1], place[S::knot + 1], piece.duration / objective.unit);
    }

    void pin(const Chain<S> &chain, int knot) {
        if (chain.course.closed && knot == chain.pieces) return;
        const int from = knot_place(chain, knot);
        for (int entry = 0; from >= 0 && entry < S::knot; ++entry)
            if (!chain.varies(knot, entry)) hessian_.add(from + entry, from + entry, 1.0);
    }

    void spread(const Chain<S> &chain) {
        for (int i = 0; i < chain.pieces; ++i) step_durations[i] = step[duration_place(chain, i)];
        for (int knot = 0; knot <= chain.pieces; ++knot) {
            const int from = knot_place(chain, knot);
            for (int entry = 0; entry < S::knot; ++entry) step_knots[knot * S::knot + entry] = from < 0 ? 0.0 : step[from + entry];
        }
    }

    BorderedBand<2 * S::block> hessian_, metric_, factor_;
    int skipped_ = 0, banded_ = 0;
};

}  // namespace minsnap

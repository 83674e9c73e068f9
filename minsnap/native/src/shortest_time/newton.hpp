// One damped Newton step of the barrier problem: assembly over the pieces, a banded factorisation, more damping as long as a pivot is not positive.
//
// Unknowns stand along the chain, K0 s0 K1 s1 ... KN; the knots at the ends only where they may move. A ring has K0, s0 and
// its last duration in the border, which the first piece ties to K1.
#pragma once

#include "arithmetic/wide.hpp"
#include "shortest_time/leg_coupling.hpp"
#include "shortest_time/model.hpp"

namespace minsnap {

template <class S>
class NewtonSystem {
public:
    int size = 0;
    Buffer<double> gradient, step, lengthened;  // (size,); lengthened: of the total, by every unknown
    Buffer<double> step_durations, step_knots;  // (pieces,), (pieces + 1, half, dim)
    LegCoupling<S> coupling;

    [[nodiscard]] bool allocate(int pieces) {
        const int most = (pieces + 1) * S::block;
        return hessian_.allocate(most, S::block + 1) && metric_.allocate(most, S::block + 1) && factor_.allocate(most, S::block + 1) &&
               gradient.allocate(most) && step.allocate(most) && lengthened.allocate(most) && step_durations.allocate(pieces) &&
               step_knots.allocate(most);
    }

    [[nodiscard]] bool lay_out(const Chain<S> &chain, bool coupled) {
        const bool closed = chain.course.closed;
        skipped_ = closed ? S::block : moves(chain, 0) ? 0 : S::knot;
        const int knots = closed ? chain.pieces : chain.pieces + (moves(chain, chain.pieces) ? 1 : 0);
        size = closed ? knots * S::block : (chain.pieces * S::block + (knots > chain.pieces ? S::knot : 0)) - skipped_;
        banded_ = closed ? size - S::block - 1 : size;
        return coupling.lay_out(coupled ? chain.course.legs : 0, size);
    }

    // Fill the matrix, the metric and the gradient for weights of the rows.
    void assemble(const Chain<S> &chain, Rows<S> &rows, const TimeObjective<S> &objective, const PieceState<S> *states,
                  const RowWeights &weights) {
        widely([&]() MINSNAP_INLINED { add_pieces(chain, rows, objective, states, weights); });
        if (!rows.coupled()) return;
        coupling.assemble(chain, rows, states, weights);
        for (int i = 0; i < chain.pieces; ++i) gradient[duration_place(chain, i)] += coupling.gradient(chain, i);
    }

    // Solve with at least so much damping; false where none suffices. `damping` becomes what was used.
    [[nodiscard]] bool solve(const Chain<S> &chain, double &damping) {
        for (int attempt = 0; attempt < ShortestSettings::tries; ++attempt) {
            bool solved = false;
            widely([&]() MINSNAP_INLINED {
                factor_.combine(hessian_, damping, metric_);
                solved = factor_.factor();
                if (!solved) return;
                if (coupling.given()) coupling.factor(chain, factor_, [&](int i) MINSNAP_INLINED { return duration_place(chain, i); });
                for (int k = 0; k < size; ++k) step[k] = -gradient[k];
                solve_whole(step.data());
                if (chain.course.total > 0.0) keep_total(chain);
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
        for (int i = 0; i < chain.pieces; ++i) {
            const PieceEnds<S> &piece = states[i].ends;
            PieceModel<S> model(rows, chain, i, states[i], weights);
            model.add_square(rows.instants.gram[objective.smoothed], piece.e, objective.smoothing(piece), objective.smoothing_power);
            if (objective.price > 0.0) model.add_cost(rows.instants, piece.e, objective.costing(piece), objective.costing_power);
            model.own_gradient += piece.duration / objective.unit;
            model.own += piece.duration / objective.unit;
            int place[S::local];
            places(chain, i, place);
            scatter(chain, i, piece, model, place);
            add_balance(chain, objective, i, place);
            add_metric(rows.instants, objective, piece, place);
        }
        for (int knot = 0; knot <= chain.pieces; ++knot) pin(chain, knot);
        for (int i = 0; chain.course.timed && i < chain.pieces; ++i) {
            const int place = duration_place(chain, i);
            hessian_.hold(place);
            metric_.hold(place);
            gradient[place] = 0.0;
        }
        if (chain.course.total > 0.0) add_total(chain, objective, states);
    }

    // Steps keep the total to first order, and all durations are scaled back to it afterwards: what that changes to second order is the
    // slope of the merit along it, times the durations. Where it is steeper than time is worth, less of it keeps the matrix positive definite.
    void add_total(const Chain<S> &chain, const TimeObjective<S> &objective, const PieceState<S> *states) {
        double pull = 0.0;
        for (int i = 0; i < chain.pieces; ++i) pull += gradient[duration_place(chain, i)];
        for (int i = 0; i < chain.pieces; ++i) {
            const int place = duration_place(chain, i);
            hessian_.add(place, place, -std::min(pull / chain.course.total, 1.0 / objective.unit) * states[i].ends.duration);
        }
    }

    // Take out of a step what changes the total.
    void keep_total(const Chain<S> &chain) {
        for (int k = 0; k < size; ++k) lengthened[k] = 0.0;
        for (int i = 0; i < chain.pieces; ++i) lengthened[duration_place(chain, i)] = exponential(chain.sigma[i]);
        solve_whole(lengthened.data());
        double along = 0.0, across = 0.0;
        for (int i = 0; i < chain.pieces; ++i) {
            const int place = duration_place(chain, i);
            const double duration = exponential(chain.sigma[i]);
            along += duration * step[place];
            across += duration * lengthened[place];
        }
        for (int k = 0; k < size; ++k) step[k] -= along / across * lengthened[k];
    }

    void solve_whole(double *x) {
        factor_.solve(x);
        if (coupling.given()) coupling.correct(x);
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

    // From ends and the own duration to the unknowns. Those that are pinned get zeros.
    void scatter(const Chain<S> &chain, int i, const PieceEnds<S> &piece, PieceModel<S> &model, const int *place) {
        static constexpr int logs[3] = {0, S::knot + 1, S::local - 1};
        const auto place_of = [](int r) { return r < S::knot ? 1 + r : 2 + r; };
        turn(chain, i, model);
        double power[3][S::whole] = {}, rate[3][S::whole], times[3][S::whole] = {}, scale[S::whole];
        double local[S::local][S::local], slope[S::local] = {};  // local: by columns, below the diagonal
        for (int r = 0; r < S::whole; ++r) {
            const int a = r / S::dim;
            scale[r] = place[place_of(r)] < 0 ? 0.0 : piece.scale[a];
            power[1][r] = piece.own[a];
            power[a < S::half ? 0 : 2][r] = piece.other[a];
            times[1][r] = model.cross[r];
            slope[place_of(r)] = scale[r] * model.gradient[r];
        }
        for (int s = 0; s < S::whole; ++s) {
            double *column = local[place_of(s)];
            for (int r = s; r < S::knot; ++r) column[1 + r] = scale[r] * scale[s] * model.whole[s][r];
            for (int r = std::max(s, S::knot); r < S::whole; ++r) column[2 + r] = scale[r] * scale[s] * model.whole[s][r];
        }
        for (int m = 0; m < 3; ++m) {
            for (int r = 0; r < S::whole; ++r) {
                rate[m][r] = power[m][r] * piece.e[r];
                slope[logs[m]] += rate[m][r] * model.gradient[r];
                if (rate[m][r] == 0.0) continue;
                for (int s = 0; s < S::whole; ++s) times[m][s] += rate[m][r] * model.whole[r][s];
            }
            for (int r = 0; r < S::whole; ++r) {
                const int k = place_of(r);
                local[std::min(k, logs[m])][std::max(k, logs[m])] = scale[r] * (times[m][r] + power[m][r] * model.force[r]);
            }
            for (int n = 0; n <= m; ++n) {
                double &value = local[logs[n]][logs[m]];
                value = m == 1 && n == 1 ? model.own : 0.0;
                for (int r = 0; r < S::whole; ++r)
                    value += rate[n][r] * times[m][r] + rate[m][r] * ((n == 1 ? model.cross[r] : 0.0) + power[n][r] * model.force[r]);
            }
        }
        slope[logs[1]] += model.own_gradient;
        for (int k = 0; k < S::local; ++k)
            if (place[k] >= 0) gradient[place[k]] += slope[k];
        if (chain.course.closed)
            hessian_.add(place, local);
        else
            hessian_.add(i * S::block - skipped_ - 1, local);
    }

    // To the axes of the waypoints' positions: these do not depend on durations.
    static void turn(const Chain<S> &chain, int i, PieceModel<S> &model) {
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
            for (int s = 0; s < S::whole; ++s) along(&model.whole[begin][s], S::whole);
            for (int r = 0; r < S::whole; ++r) along(&model.whole[r][begin], 1);
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

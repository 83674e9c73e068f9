// What a yaw through angles adds to a Newton step: rows on its rate and on rotors depend through it on the durations of all legs, which no band holds.
//
// The matrix of a step is that of the band and U M U', where a column of U is what lengthens one leg as it is, and M sums products of the rows'
// changes with the legs' durations. It has first derivatives alone, so that it stays positive definite, and no products with what is in the band:
// changes along the path and, of rotors' rows, with a piece's own duration. The gradient has all. It is solved by the formula of Sherman, Morrison and
// Woodbury (G. H. Golub and C. F. Van Loan, "Matrix Computations", section 2.1.4).
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "shortest_time/bordered_band.hpp"
#include "shortest_time/rows.hpp"

namespace minsnap {

template <class S>
class LegCoupling {
public:
    bool given() const { return legs_ > 0; }

    [[nodiscard]] bool lay_out(int legs, int size) {
        legs_ = legs, size_ = size;
        const auto count = static_cast<std::size_t>(legs);
        return legs == 0 || (matrix_.allocate(count * count) && solved_.allocate(count * static_cast<std::size_t>(size)) &&
                             mixed_.allocate(count * (count + 1)) && pull_.allocate(count) && along_.allocate(count) &&
                             places_.allocate(static_cast<std::size_t>(size)) && shares_.allocate(static_cast<std::size_t>(size)));
    }

    // Sum the rows that are awake.
    void assemble(const Chain<S> &chain, Rows<S> &rows, const PieceState<S> *states, const RowWeights &weights) {
        rows.spline().differentiate();
        for (int k = 0; k < legs_ * legs_; ++k) matrix_[k] = 0.0;
        for (int m = 0; m < legs_; ++m) pull_[m] = 0.0;
        for (int i = 0; i < chain.pieces; ++i) {
            const int leg = i / chain.per_leg;
            shares_[i] = exponential(chain.sigma[i]) / rows.spline().durations[leg];
            if (i % chain.per_leg == 0) list_near(chain.course.closed, leg);
            int row = rows.first[i] + rows.legs.count(leg) * rows.count_at;
            for (int k = 0; k < rows.limit_count; row += rows.limits[k++].functions * rows.count_at)
                for (int g = 0; rows.limits[k].headed() && g < rows.count_at; g += rows.together)
                    if (rows.is_awake(rows.limits[k], row + g)) add(rows, rows.limits[k], i, leg, states[i], g, row + g, weights);
        }
    }

    // Of the objective in the logarithm of the duration of a piece.
    double gradient(const Chain<S> &chain, int i) const { return shares_[i] * pull_[i / chain.per_leg]; }

    // Steps of the logarithms of the legs' durations.
    const double *leg_steps(const double *step) {
        for (int m = 0; m < legs_; ++m) along_[m] = lengthening(m, step);
        return along_.data();
    }

    // Solve for what lengthens each leg with the factor of the band.
    template <int width, class Place>
    void factor(const Chain<S> &chain, const BorderedBand<width> &band, Place &&place) {
        pieces_ = chain.pieces, per_leg_ = chain.per_leg;
        for (int i = 0; i < pieces_; ++i) places_[i] = place(i);
        for (int m = 0; m < legs_; ++m) {
            double *column = solved_.data() + static_cast<std::size_t>(m) * size_;
            for (int k = 0; k < size_; ++k) column[k] = 0.0;
            for (int i = m * per_leg_; i < (m + 1) * per_leg_; ++i) column[places_[i]] = shares_[i];
            band.solve(column);
        }
    }

    // Bring the solution of the band to that of both: less Z M (1 + U'Z M)^-1 U'x, where Z solves for U.
    void correct(double *x) {
        const int wide = legs_ + 1;
        double *mixed = mixed_.data();
        for (int m = 0; m < legs_; ++m) {
            for (int n = 0; n < legs_; ++n) mixed[m * wide + n] = m == n ? 1.0 : 0.0;
            for (int k = 0; k < legs_; ++k) {
                const double share = lengthening(m, solved_.data() + static_cast<std::size_t>(k) * size_);
                for (int n = 0; n < legs_; ++n) mixed[m * wide + n] += share * matrix_[k * legs_ + n];
            }
            mixed[m * wide + legs_] = lengthening(m, x);
        }
        eliminate();
        for (int k = 0; k < legs_; ++k) {
            double share = 0.0;
            for (int n = 0; n < legs_; ++n) share += matrix_[k * legs_ + n] * mixed[n * wide + legs_];
            const double *column = solved_.data() + static_cast<std::size_t>(k) * size_;
            for (int j = 0; j < size_; ++j) x[j] -= share * column[j];
        }
    }

private:
    static constexpr int reach = 8, most_near = 2 * reach + 1;

    // A limit at four instants of a piece.
    void add(const Rows<S> &rows, const InstantLimit &limit, int i, int leg, const PieceState<S> &state, int g, int row,
             const RowWeights &weights) {
        Quad u[InstantLimit::most_inputs], found[InstantLimit::most_functions][3];
        rows.inputs(limit, i, state.ends.inverse, state.jets, g, u);
        limit.by_angle(u, found);
        for (int lane = 0; lane < rows.together; ++lane) {
            for (int k = 0; k < near_count_; ++k)
                rows.spline().changes_at(leg, rows.share_at(i, g + lane), near_[k], rows.whole(limit), turns_ + 3 * k);
            for (int f = 0; f < limit.functions; ++f) {
                const int at = row + f * rows.count_at + lane;
                double change[most_near];
                for (int k = 0; k < near_count_; ++k) {
                    const double *turn = turns_ + 3 * k;
                    change[k] = found[f][0][lane] * turn[0] + found[f][1][lane] * turn[1] + found[f][2][lane] * turn[2];
                    pull_[near_[k]] += weights.gradient[at] * change[k];
                }
                for (int k = 0; k < near_count_; ++k)
                    for (int l = 0; l <= k; ++l) {
                        const int m = near_[k], n = near_[l];
                        const double product = weights.outer[at] * (change[k] * change[l]);
                        matrix_[m * legs_ + n] += product;
                        if (m != n) matrix_[n * legs_ + m] += product;
                    }
            }
        }
    }

    // List the legs on whose durations the yaw of one depends; those further away change it by less than a ten-thousandth of that.
    void list_near(bool ring, int leg) {
        near_count_ = std::min(legs_, most_near);
        const int low = ring ? leg - reach : std::min(std::max(leg - reach, 0), legs_ - near_count_);
        for (int k = 0; k < near_count_; ++k) near_[k] = (low + k + reach * legs_) % legs_;
    }

    double lengthening(int leg, const double *x) const {
        double sum = 0.0;
        for (int i = leg * per_leg_; i < (leg + 1) * per_leg_; ++i) sum += shares_[i] * x[places_[i]];
        return sum;
    }

    // Gauss's elimination with row pivots; the solution stands in the last column.
    void eliminate() {
        const int wide = legs_ + 1;
        double *a = mixed_.data();
        for (int k = 0; k < legs_; ++k) {
            int best = k;
            for (int m = k + 1; m < legs_; ++m)
                if (std::abs(a[m * wide + k]) > std::abs(a[best * wide + k])) best = m;
            for (int n = k; n <= legs_ && best != k; ++n) std::swap(a[k * wide + n], a[best * wide + n]);
            for (int m = k + 1; m < legs_; ++m) {
                const double share = a[m * wide + k] / a[k * wide + k];
                for (int n = k; n <= legs_; ++n) a[m * wide + n] -= share * a[k * wide + n];
            }
        }
        for (int k = legs_ - 1; k >= 0; --k) {
            for (int n = k + 1; n < legs_; ++n) a[k * wide + legs_] -= a[k * wide + n] * a[n * wide + legs_];
            a[k * wide + legs_] /= a[k * wide + k];
        }
    }

    int legs_ = 0, size_ = 0, pieces_ = 0, per_leg_ = 1;
    Buffer<double> matrix_, solved_;        // M, and Z by columns
    Buffer<double> pull_, along_;           // (legs,) of the gradient, of a step
    int near_[most_near], near_count_ = 0;  // legs near that of a piece
    double turns_[3 * most_near];           // their changes of its angle and of the derivatives
    Buffer<double> shares_;                 // (pieces,) of the time of their leg
    Buffer<int> places_;                    // (pieces,) of their durations among the unknowns
    Buffer<double> mixed_;                  // what is eliminated
};

}  // namespace minsnap

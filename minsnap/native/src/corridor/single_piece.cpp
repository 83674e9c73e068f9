// One polynomial from a moving state, as far inside its conditions at instants as it can be.
//
// The unknowns are some derivatives at its end, as deviations from a guess, and two slacks in widths: one of the conditions that must
// hold, and one of those that may be exceeded, which costs less. The squared highest derivative tells curves apart that exceed as little.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "basics/dispatch.hpp"
#include "basics/export.hpp"
#include "corridor/request.hpp"
#include "linear/within_cones.hpp"
#include "polynomials/leg.hpp"

namespace minsnap {
namespace {

struct PieceSettings {
    static constexpr double smooth = 1e-6;    // weight of the squared highest derivative, beside a slack of one width
    static constexpr double unique = 1e-9;    // weight of the squares of all unknowns: that derivative does not see all of them
    static constexpr double exceeded = 1e-4;  // price of the slack of conditions that may be exceeded, over the price of the other one
    static constexpr double feasible = 1e-6;  // slack of the others that counts as none, in widths
};

class SinglePiece {
public:
    explicit SinglePiece(const PieceRecord &asked) : p_(asked), size_(int(asked.half)), tables_(leg_tables<double>(int(asked.half))) {
        for (int order = 0; order < size_.half(); ++order)
            if (asked.free >> order & 1) places_[chosen_++] = size_.half() + order;
        unknowns_ = std::size_t(chosen_) * std::size_t(p_.dim) + 2;
    }

    Status solve() {
        const auto cones = std::size_t(p_.conditions) + 2, rows = std::size_t(p_.first[p_.conditions]) + 2, n = unknowns_;
        if (!first_.allocate(cones + 1) || !hessian_.allocate(n * n) || !linear_.allocate(n) || !matrix_.allocate(rows * n) ||
            !bound_.allocate(rows) || !x_.allocate(n) || !ends_.allocate(std::size_t(size_.points())))
            return Status::no_memory;
        put_costs();
        put_rows();
        const Status status =
            WithinCones({n, cones, first_.data(), hessian_.data(), linear_.data(), matrix_.data(), bound_.data(), x_.data()}).solve();
        if (status != Status::done) return status;
        if (!(x_[n - 2] <= Settings::feasible)) return Status::infeasible;
        write();
        return Status::done;
    }

private:
    using Settings = PieceSettings;

    double unit() const { return p_.acceleration * p_.duration * p_.duration; }  // of the unknowns [m]
    double end(int place, std::int64_t axis) const { return p_.ends[place * p_.dim + axis]; }

    // Weight of the product of two end derivatives in the cost.
    double weight(int one, int other) const {
        double sum = 0.0, largest = 0.0;
        for (int i = 0; i < size_.half(); ++i) {
            sum += tables_.root[i][one] * tables_.root[i][other];
            largest += tables_.root[i][0] * tables_.root[i][0];
        }
        return Settings::smooth * sum / largest;
    }

    void put_costs() {
        std::fill(hessian_.data(), hessian_.data() + unknowns_ * unknowns_, 0.0);
        for (std::size_t j = 0; j < unknowns_; ++j) hessian_[j * unknowns_ + j] = Settings::unique;
        for (int a = 0; a < chosen_; ++a)
            for (std::int64_t axis = 0; axis < p_.dim; ++axis) {
                const std::size_t own = std::size_t(a * p_.dim + axis);
                for (int b = 0; b < chosen_; ++b)
                    hessian_[own * unknowns_ + std::size_t(b * p_.dim + axis)] += weight(places_[a], places_[b]);
                linear_[own] = 0.0;
                for (int j = 0; j < size_.points(); ++j) linear_[own] += weight(places_[a], j) * end(j, axis) / unit();
            }
        linear_[unknowns_ - 2] = 1.0;
        linear_[unknowns_ - 1] = Settings::exceeded;
    }

    // Add the factors (2k,) of the ends in a derivative at s.
    void add_factors(std::int64_t order, double s, double share, double *factors) const {
        if (share == 0.0 || order > size_.degree()) return;
        double own[max_points];
        row_factors(size_, tables_, 1.0, int(order), s, own);
        for (std::int64_t q = 0; q < order; ++q) share /= p_.duration;
        for (int j = 0; j < size_.points(); ++j) factors[j] += share * own[j];
    }

    void put_rows() {
        for (std::int64_t k = 0; k < p_.conditions; ++k) {
            double factors[max_points] = {};
            add_factors(p_.order[k], p_.s[k], 1.0, factors);
            add_factors(p_.order[k] + 1, p_.s[k], p_.ahead[k], factors);
            first_[k] = p_.first[k];
            for (std::int64_t row = p_.first[k]; row < p_.first[k + 1]; ++row) put_row(row, factors);
            matrix_[std::size_t(p_.first[k]) * unknowns_ + unknowns_ - (p_.soft[k] ? 1 : 2)] = -1.0;
        }
        const std::int64_t last = p_.first[p_.conditions];
        for (std::int64_t slack = 0; slack < 2; ++slack) {  // neither is negative
            first_[p_.conditions + slack] = last + slack;
            double *const row = &matrix_[std::size_t(last + slack) * unknowns_];
            std::fill(row, row + unknowns_, 0.0);
            row[unknowns_ - 2 + slack] = -1.0;
            bound_[last + slack] = 0.0;
        }
        first_[p_.conditions + 2] = last + 2;
    }

    void put_row(std::int64_t index, const double *factors) {
        double *const row = &matrix_[std::size_t(index) * unknowns_];
        std::fill(row, row + unknowns_, 0.0);
        bound_[index] = p_.bound[index];
        for (std::int64_t axis = 0; axis < p_.dim; ++axis) {
            const double component = p_.matrix[index * p_.dim + axis];
            if (component == 0.0) continue;
            double value = 0.0;
            for (int j = 0; j < size_.points(); ++j) value += factors[j] * end(j, axis);
            bound_[index] += component * value;
            for (int a = 0; a < chosen_; ++a) row[a * p_.dim + axis] = -unit() * component * factors[places_[a]];
        }
    }

    void write() {
        double points[max_points];
        for (std::int64_t axis = 0; axis < p_.dim; ++axis) {
            for (int j = 0; j < size_.points(); ++j) ends_[j] = end(j, axis);
            for (int a = 0; a < chosen_; ++a) ends_[places_[a]] += unit() * x_[a * p_.dim + axis];
            points_from_ends(size_, tables_, ends_.data(), points);
            for (int j = 0; j < size_.points(); ++j) p_.points[j * p_.dim + axis] = points[j];
        }
    }

    const PieceRecord &p_;
    const Degree<0> size_;
    const LegTables<double> &tables_;
    int places_[max_half], chosen_ = 0;  // of the derivatives to be chosen among the ends
    std::size_t unknowns_;
    Buffer<std::int64_t> first_;
    Buffer<double> hessian_, linear_, matrix_, bound_, x_, ends_;
};

constexpr std::int64_t most_values = std::int64_t{1} << 27;

bool fits(const PieceRecord &asked) {
    if (asked.half < 2 || asked.half > max_half || asked.dim < 1 || asked.dim > most_axes || asked.free < 1 ||
        asked.free >> asked.half != 0 || asked.conditions < 1 || asked.conditions > most_values || asked.first[0] != 0)
        return false;
    for (std::int64_t k = 0; k < asked.conditions; ++k)
        if (asked.order[k] < 0 || asked.first[k + 1] <= asked.first[k] || asked.first[k + 1] > most_values / (asked.half * asked.dim + 2))
            return false;
    return true;
}

bool numbers_fit(const PieceRecord &asked) {
    const std::int64_t rows = asked.first[asked.conditions];
    return asked.duration > 0.0 && asked.acceleration > 0.0 && std::isfinite(asked.duration) && std::isfinite(asked.acceleration) &&
           all_finite(asked.s, asked.conditions) && all_finite(asked.ahead, asked.conditions) &&
           all_finite(asked.matrix, rows * asked.dim) && all_finite(asked.bound, rows) &&
           all_finite(asked.ends, 2 * asked.half * asked.dim);
}

}  // namespace
}  // namespace minsnap

// Choose derivatives at the end of a piece: see PieceRecord; infeasible where conditions that must hold cannot.
MINSNAP_EXPORT std::int32_t minsnap_single_piece(const minsnap::PieceRecord *asked) {
    using namespace minsnap;
    if (!fits(*asked)) return std::int32_t(Status::bad_size);
    if (!numbers_fit(*asked)) return std::int32_t(Status::bad_number);
    return std::int32_t(SinglePiece(*asked).solve());
}

// What a joint search for a curve and its durations asks: the pieces, and the conditions of each kind on them.
//
// Derivatives at an instant come from the ends of a piece, `ends` values for each axis on the unit interval, by factors
// that depend on the order and the place alone.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "shortest_time/momentary.hpp"

namespace minsnap {

constexpr std::size_t joint_orders = 5, joint_ends = 12, joint_dim = 8, joint_parts = 9;

// Arrays of the caller, described in joint_search.py.
struct JointTerms {
    std::size_t pieces, ends, dim, blocks;
    const std::int64_t *table;         // blocks x 8
    const std::int64_t *condition_piece;
    const double *values;
    const double *maps[joint_orders];  // (degree + 1 - order) x ends; none beyond the degree
    const double *state_ends;          // pieces x ends x dim
    const double *durations;           // pieces

    std::size_t degree() const { return ends - 1; }

    // The same conditions on another curve.
    JointTerms with(const double *other_ends, const double *other_durations) const {
        JointTerms other = *this;
        other.state_ends = other_ends;
        other.durations = other_durations;
        return other;
    }

    // Factors of the ends in a derivative at s of [0, 1].
    void factors(std::size_t order, double s, double *out) const {
        std::fill(out, out + ends, 0.0);
        if (order > degree()) return;
        const std::size_t n = degree() - order;
        double bernstein[joint_ends];
        bernstein[0] = 1.0;
        for (std::size_t m = 1; m <= n; ++m) {
            bernstein[m] = s * bernstein[m - 1];
            for (std::size_t i = m; i-- > 1;) bernstein[i] = s * bernstein[i - 1] + (1.0 - s) * bernstein[i];
            bernstein[0] *= 1.0 - s;
        }
        for (std::size_t i = 0; i <= n; ++i) {
            const double *row = maps[order] + i * ends;
            for (std::size_t j = 0; j < ends; ++j) out[j] += bernstein[i] * row[j];
        }
    }

    // A derivative from its factors, (dim,).
    void derivative(std::size_t piece, std::size_t order, const double *f, double *out) const {
        const double *end = state_ends + piece * ends * dim;
        std::fill(out, out + dim, 0.0);
        for (std::size_t j = 0; j < ends; ++j, end += dim) {
            for (std::size_t d = 0; d < dim; ++d) out[d] += f[j] * end[d];
        }
        const double share = power(durations[piece], order);
        for (std::size_t d = 0; d < dim; ++d) out[d] /= share;
    }

    static double power(double base, std::size_t exponent) {
        double found = 1.0;
        while (exponent-- > 0) found *= base;
        return found;
    }
};

// Derivatives at one instant by order, normalised.
struct Derivatives {
    double x[joint_orders][joint_dim];
};

// The conditions of one kind. Rows of the table: kind, first order, last order, components, conditions, slack, place of
// the pieces, place of the values (weight, band, then rows and offsets of walls, or units of orders and parameters).
class JointBlock {
public:
    JointBlock(const JointTerms &terms, std::size_t number) : dim_(terms.dim) {
        const std::int64_t *row = terms.table + 8 * number;
        kind = static_cast<Kind>(row[0]);
        first_order = static_cast<std::size_t>(row[1]);
        last_order = static_cast<std::size_t>(row[2]);
        components = static_cast<std::size_t>(row[3]);
        conditions = static_cast<std::size_t>(row[4]);
        slack = static_cast<std::size_t>(row[5]);
        piece = terms.condition_piece + row[6];
        weight = terms.values[row[7]];
        band = terms.values[row[7] + 1];
        rest_ = terms.values + row[7] + 2;
        functions = kind == Kind::wall ? 1 : conditions / terms.pieces;
    }

    Kind kind;
    std::size_t first_order, last_order, components, conditions, slack, functions;
    const std::int64_t *piece;
    double weight, band;

    bool flat() const { return kind == Kind::wall; }
    const double *rows(std::size_t condition) const { return rest_ + condition * components * dim_; }
    const double *offset(std::size_t condition) const { return rest_ + conditions * components * dim_ + condition * components; }

    // M x + m with the axis of the cone first.
    void parts(std::size_t condition, const double *x, double *out) const {
        const double *row = rows(condition), *shift = offset(condition);
        for (std::size_t c = 0; c < components; ++c, row += dim_) {
            double sum = shift[c];
            for (std::size_t d = 0; d < dim_; ++d) sum += row[d] * x[d];
            out[c] = sum;
        }
    }

    // Excess of a condition at an instant.
    double excess(std::size_t condition, const Derivatives &at) const {
        if (flat()) {
            double found[joint_parts];
            parts(condition, at.x[first_order], found);
            return beyond(found);
        }
        double found[most_functions];
        all(at, found);
        return found[condition % functions];
    }

    // Excess of all functions of a momentary kind, or of its cone.
    void all(const Derivatives &at, double *found) const {
        Space<double> x[joint_orders] = {};
        for (std::size_t p = first_order; p <= last_order; ++p) {
            x[p] = {at.x[p][0] * rest_[p], at.x[p][1] * rest_[p], at.x[p][2] * rest_[p]};
        }
        momentary(kind, rest_ + joint_orders, x, found);
        if (components > 1) found[0] = beyond(found);
    }

    // Value of a function or of a part of a cone, and its gradient in the derivatives from the first to the last order, three each.
    double slopes(std::size_t number, const Derivatives &at, double *gradient) const {
        switch (last_order - first_order) {
            case 0: return seeded<3>(number, at, gradient);
            case 1: return seeded<6>(number, at, gradient);
            case 2: return seeded<9>(number, at, gradient);
            default: return seeded<12>(number, at, gradient);
        }
    }

    double beyond(const double *parts) const {
        double sum = 0.0;
        for (std::size_t c = 1; c < components; ++c) sum += parts[c] * parts[c];
        return std::sqrt(sum) - parts[0];
    }

private:
    template <int count>
    double seeded(std::size_t number, const Derivatives &at, double *gradient) const {
        Space<Dual<count>> x[joint_orders];
        int direction = 0;
        for (std::size_t p = first_order; p <= last_order; ++p, direction += 3) {
            Dual<count> *axes[3] = {&x[p].x, &x[p].y, &x[p].z};
            for (int d = 0; d < 3; ++d) {
                axes[d]->value = at.x[p][d] * rest_[p];
                axes[d]->slope[direction + d] = rest_[p];
            }
        }
        Dual<count> found[most_functions];
        momentary(kind, rest_ + joint_orders, x, found);
        const Dual<count> &one = found[number];
        std::copy(one.slope, one.slope + count, gradient);
        return one.value;
    }

    std::size_t dim_;
    const double *rest_;
};

// Derivatives of a block's orders at an instant of a piece.
inline void fill_derivatives(const JointTerms &terms, const JointBlock &block, std::size_t piece, double s, Derivatives &at) {
    double f[joint_ends];
    for (std::size_t p = block.first_order; p <= block.last_order; ++p) {
        terms.factors(p, s, f);
        terms.derivative(piece, p, f, at.x[p]);
    }
}

}  // namespace minsnap

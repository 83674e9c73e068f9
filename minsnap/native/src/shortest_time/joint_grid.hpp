// Excesses of a block on the same grid of instants on every piece.
#pragma once

#include <cmath>
#include <cstddef>

#include "basics/buffer.hpp"
#include "shortest_time/joint_terms.hpp"
#include "arithmetic/lanes.hpp"
#include "arithmetic/wide.hpp"

namespace minsnap {

class JointGrid {
public:
    // Take equally spaced instants. False if there is no memory.
    [[nodiscard]] bool set(const JointTerms &terms, std::size_t instants) {
        terms_ = &terms;
        instants_ = instants;
        const std::size_t line = terms.pieces * instants * terms.dim;
        if (!factors_.allocate(instants * terms.ends) || !x_.allocate(joint_orders * line + 1)) return false;
        if (!values_.allocate(most_functions * instants) || !part_.allocate(instants) || !squares_.allocate(instants)) return false;
        for (std::size_t p = 0; p < joint_orders; ++p) known_[p] = false;
        return true;
    }

    double at(std::size_t g) const { return static_cast<double>(g) / static_cast<double>(instants_ - 1); }
    std::size_t instants() const { return instants_; }

    // Excesses of one condition, (instants,); conditions of a momentary kind must be asked for in turn.
    const double *row(const JointBlock &block, std::size_t condition) {
        for (std::size_t p = block.first_order; p <= block.last_order; ++p) know(p);
        const auto piece = static_cast<std::size_t>(block.piece[condition]);
        if (!block.flat()) return momentary_row(block, condition, piece);
        wide() ? flat_wide(block, condition, piece) : flat_in(block, condition, piece);
        return values_.data();
    }

private:
    MINSNAP_WIDE void flat_wide(const JointBlock &block, std::size_t condition, std::size_t piece) {
        flat_in(block, condition, piece);
    }

    // Excesses of a wall: part by part over all instants.
    MINSNAP_INLINE void flat_in(const JointBlock &block, std::size_t condition, std::size_t piece) {
        const std::size_t count = instants_, dim = terms_->dim;
        const double *row = block.rows(condition), *shift = block.offset(condition), *x = place(block.first_order, piece);
        double *__restrict values = values_.data(), *__restrict part = part_.data(), *__restrict squares = squares_.data();
        for (std::size_t g = 0; g < count; ++g) squares[g] = 0.0;
        for (std::size_t c = 0; c < block.components; ++c, row += dim) {
            double *__restrict out = c == 0 ? values : part;
            for (std::size_t g = 0; g < count; ++g) out[g] = shift[c];
            for (std::size_t d = 0; d < dim; ++d) {
                for (std::size_t g = 0; g < count; ++g) out[g] += row[d] * x[d * count + g];
            }
            if (c == 0) continue;
            for (std::size_t g = 0; g < count; ++g) squares[g] += part[g] * part[g];
        }
        for (std::size_t g = 0; g < count; ++g) values[g] = std::sqrt(squares[g]) - values[g];
    }

    const double *momentary_row(const JointBlock &block, std::size_t condition, std::size_t piece) {
        if (condition % block.functions == 0) {
            for (std::size_t g = 0; g < instants_; ++g) {
                Derivatives at;
                double found[most_functions];
                for (std::size_t p = block.first_order; p <= block.last_order; ++p) {
                    const double *x = place(p, piece) + g;
                    for (std::size_t d = 0; d < 3; ++d) at.x[p][d] = x[d * instants_];
                }
                block.all(at, found);
                for (std::size_t k = 0; k < block.functions; ++k) values_[k * instants_ + g] = found[k];
            }
        }
        return values_.data() + condition % block.functions * instants_;
    }

    // One derivative on a piece, (dim, instants).
    double *place(std::size_t order, std::size_t piece) {
        return x_.data() + (order * terms_->pieces + piece) * instants_ * terms_->dim;
    }

    void know(std::size_t order) {
        if (known_[order]) return;
        known_[order] = true;
        double one[joint_ends];
        for (std::size_t g = 0; g < instants_; ++g) {
            terms_->factors(order, at(g), one);
            for (std::size_t j = 0; j < terms_->ends; ++j) factors_[j * instants_ + g] = one[j];
        }
        wide() ? spread_wide(order) : spread_in(order);
    }

    MINSNAP_WIDE void spread_wide(std::size_t order) { spread_in(order); }

    // A derivative on all pieces, over all instants at once.
    MINSNAP_INLINE void spread_in(std::size_t order) {
        const std::size_t count = instants_, dim = terms_->dim;
        for (std::size_t i = 0; i < terms_->pieces; ++i) {
            const double *end = terms_->state_ends + i * terms_->ends * dim;
            const double share = JointTerms::power(terms_->durations[i], order);
            for (std::size_t d = 0; d < dim; ++d) {
                double *__restrict x = place(order, i) + d * count;
                for (std::size_t g = 0; g < count; ++g) x[g] = 0.0;
                for (std::size_t j = 0; j < terms_->ends; ++j) {
                    const double *f = &factors_[j * count];
                    for (std::size_t g = 0; g < count; ++g) x[g] += f[g] * end[j * dim + d];
                }
                for (std::size_t g = 0; g < count; ++g) x[g] /= share;
            }
        }
    }

    const JointTerms *terms_ = nullptr;
    std::size_t instants_ = 0;
    bool known_[joint_orders] = {};
    Buffer<double> factors_, x_, values_, part_, squares_;
};

}  // namespace minsnap

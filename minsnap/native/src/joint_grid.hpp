// Excesses of a block on the same grid of instants on every piece.
#pragma once

#include <cstddef>

#include "buffer.hpp"
#include "joint_terms.hpp"

namespace minsnap {

class JointGrid {
public:
    // Take equally spaced instants. False if there is no memory.
    [[nodiscard]] bool set(const JointTerms &terms, std::size_t instants) {
        terms_ = &terms;
        instants_ = instants;
        const std::size_t line = terms.pieces * instants * terms.dim;
        if (!factors_.allocate(joint_orders * instants * terms.ends) || !x_.allocate(joint_orders * line + 1)) return false;
        if (!values_.allocate(most_functions * instants)) return false;
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
        const double *x = place(block.first_order, piece);
        double found[joint_parts];
        for (std::size_t g = 0; g < instants_; ++g, x += terms_->dim) {
            block.parts(condition, x, found);
            values_[g] = block.beyond(found);
        }
        return values_.data();
    }

private:
    const double *momentary_row(const JointBlock &block, std::size_t condition, std::size_t piece) {
        if (condition % block.functions == 0) {
            for (std::size_t g = 0; g < instants_; ++g) {
                Derivatives at;
                double found[most_functions];
                for (std::size_t p = block.first_order; p <= block.last_order; ++p) {
                    const double *x = place(p, piece) + g * terms_->dim;
                    for (std::size_t d = 0; d < 3; ++d) at.x[p][d] = x[d];
                }
                block.all(at, found);
                for (std::size_t k = 0; k < block.functions; ++k) values_[k * instants_ + g] = found[k];
            }
        }
        return values_.data() + condition % block.functions * instants_;
    }

    double *place(std::size_t order, std::size_t piece) {
        return x_.data() + (order * terms_->pieces + piece) * instants_ * terms_->dim;
    }

    void know(std::size_t order) {
        if (known_[order]) return;
        known_[order] = true;
        double *f = factors_.data() + order * instants_ * terms_->ends;
        for (std::size_t g = 0; g < instants_; ++g) terms_->factors(order, at(g), f + g * terms_->ends);
        for (std::size_t i = 0; i < terms_->pieces; ++i) {
            double *x = place(order, i);
            for (std::size_t g = 0; g < instants_; ++g) terms_->derivative(i, order, f + g * terms_->ends, x + g * terms_->dim);
        }
    }

    const JointTerms *terms_ = nullptr;
    std::size_t instants_ = 0;
    bool known_[joint_orders] = {};
    Buffer<double> factors_, x_, values_;
};

}  // namespace minsnap

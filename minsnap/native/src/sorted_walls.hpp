// Walls in the order of their pieces, so that those of a stretch of pieces lie together.
#pragma once

#include "walls.hpp"

namespace minsnap {

class SortedWalls {
public:
    [[nodiscard]] bool take(const GivenWalls &all, std::int64_t pieces, int dim) {
        dim_ = dim;
        const std::size_t count = all.count;
        if (!first_.allocate(pieces + 2) || !source_.allocate(count + 1) || !piece_.allocate(count + 1) ||
            !order_.allocate(count + 1) || !normal_.allocate(count * dim + 1) || !anchor_.allocate(count * dim + 1) ||
            !bound_.allocate(count + 1) || !width_.allocate(count + 1) || !ball_.allocate(count + 1))
            return false;
        matrix_ = all.matrix;
        for (std::int64_t i = 0; i <= pieces + 1; ++i) first_[i] = 0;
        for (std::int64_t i = 0; i < all.count; ++i) ++first_[all.piece[i] + 2];
        for (std::int64_t i = 0; i < pieces; ++i) first_[i + 2] += first_[i + 1];
        for (std::int64_t i = 0; i < all.count; ++i) put(all, i, first_[all.piece[i] + 1]++);
        return true;
    }

    // Walls of the pieces from ``begin`` up to ``end``, pieces counted from ``begin``.
    GivenWalls between(std::int64_t begin, std::int64_t end) const {
        const std::int64_t from = first_[begin];
        return {first_[end] - from,      piece_.data() + from,          order_.data() + from,
                normal_.data() + from * dim_, anchor_.data() + from * dim_, bound_.data() + from,
                width_.data() + from,    nullptr,                       begin,
                ball_.data() + from,     matrix_};
    }

    // Index of a wall of ``between(begin, ...)`` among all sorted ones, and among those given.
    std::int64_t sorted(std::int64_t begin, std::int64_t wall) const { return first_[begin] + wall; }
    std::int64_t source(std::int64_t sorted) const { return source_[sorted]; }

private:
    void put(const GivenWalls &all, std::int64_t from, std::int64_t to) {
        source_[to] = from, piece_[to] = all.piece[from], order_[to] = all.order[from];
        bound_[to] = all.bound[from], width_[to] = all.width[from];
        ball_[to] = all.ball == nullptr ? -1 : all.ball[from];
        for (int axis = 0; axis < dim_; ++axis) {
            normal_[to * dim_ + axis] = all.normal[from * dim_ + axis];
            anchor_[to * dim_ + axis] = all.anchor[from * dim_ + axis];
        }
    }

    int dim_ = 0;
    const double *matrix_ = nullptr;
    Buffer<std::int64_t> first_, source_, piece_, order_, ball_;
    Buffer<double> normal_, anchor_, bound_, width_;
};

}  // namespace minsnap

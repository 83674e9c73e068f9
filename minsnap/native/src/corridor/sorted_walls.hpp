// Walls in the order of their pieces, so that those of a stretch of pieces lie together. Behind the last piece of a closed
// chain the first ones follow again, with their walls.
#pragma once

#include "corridor/walls.hpp"

namespace minsnap {

class SortedWalls {
public:
    // ``repeated`` pieces follow again behind the last one.
    [[nodiscard]] bool take(const GivenWalls &all, std::int64_t pieces, std::int64_t repeated, int dim) {
        dim_ = dim, matrix_ = all.matrix;
        const std::int64_t last = pieces + repeated;
        std::size_t count = all.count;
        for (std::int64_t i = 0; i < all.count; ++i) count += all.piece[i] < repeated;
        if (!first_.allocate(last + 2) || !source_.allocate(count + 1) || !piece_.allocate(count + 1) || !order_.allocate(count + 1) ||
            !normal_.allocate(count * dim + 1) || !anchor_.allocate(count * dim + 1) || !bound_.allocate(count + 1) ||
            !width_.allocate(count + 1) || !ball_.allocate(count + 1) || !when_.allocate(count + 1))
            return false;
        for (std::int64_t i = 0; i <= last + 1; ++i) first_[i] = 0;
        for (std::int64_t i = 0; i < all.count; ++i)
            for (std::int64_t piece = all.piece[i]; piece < last; piece += pieces) ++first_[piece + 2];
        for (std::int64_t i = 0; i < last; ++i) first_[i + 2] += first_[i + 1];
        for (std::int64_t i = 0; i < all.count; ++i)
            for (std::int64_t piece = all.piece[i]; piece < last; piece += pieces) put(all, i, piece, first_[piece + 1]++);
        return true;
    }

    // Walls of the pieces from ``begin`` up to ``end``, pieces counted from ``begin``.
    GivenWalls between(std::int64_t begin, std::int64_t end) const {
        const std::int64_t from = first_[begin];
        return {first_[end] - from,
                piece_.data() + from,
                order_.data() + from,
                normal_.data() + from * dim_,
                anchor_.data() + from * dim_,
                bound_.data() + from,
                width_.data() + from,
                when_.data() + from,
                begin,
                ball_.data() + from,
                matrix_};
    }

    // Index of the first wall of a piece among all sorted ones; piece of a sorted one; its index among those given.
    std::int64_t first(std::int64_t piece) const { return first_[piece]; }
    std::int64_t piece(std::int64_t sorted) const { return piece_[sorted]; }
    std::int64_t source(std::int64_t sorted) const { return source_[sorted]; }

private:
    void put(const GivenWalls &all, std::int64_t from, std::int64_t piece, std::int64_t to) {
        source_[to] = from, piece_[to] = piece, order_[to] = all.order[from];
        when_[to] = all.when == nullptr ? int(When::always) : all.when[from];
        bound_[to] = all.bound[from], width_[to] = all.width[from];
        ball_[to] = all.ball == nullptr ? -1 : all.ball[from];
        for (int axis = 0; axis < dim_; ++axis) {
            normal_[to * dim_ + axis] = all.normal[from * dim_ + axis];
            anchor_[to * dim_ + axis] = all.anchor[from * dim_ + axis];
        }
    }

    int dim_ = 0;
    const double *matrix_ = nullptr;
    Buffer<std::int64_t> first_, source_, piece_, order_, ball_, when_;
    Buffer<double> normal_, anchor_, bound_, width_;
};

}  // namespace minsnap

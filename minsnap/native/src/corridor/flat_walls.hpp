// The walls of records of the border one after the other, as walls.hpp has them.
#pragma once

#include "basics/buffer.hpp"
#include "basics/status.hpp"
#include "basics/walls_record.hpp"
#include "corridor/walls.hpp"

namespace minsnap {

class FlatWalls {
public:
    static constexpr std::int64_t most = 10'000'000, all_legs = -1;

    // Those of all legs, or of one, which is piece 0 then. Balls are larger by the share ``kept``; there is room for one plane more.
    [[nodiscard]] Status take(const WallsRecord *records, std::int64_t groups, int dim, std::int64_t leg = all_legs, double kept = 0.0) {
        std::int64_t room = 1, matrices = 0;
        for (std::int64_t g = 0; g < groups; ++g) {
            if (records[g].count < 0 || records[g].count > most || records[g].rows < 0 || records[g].rows > dim) return Status::bad_size;
            const std::int64_t own = count_on(records[g], leg);
            room += own, matrices += records[g].rows > 0 ? own : 0;
        }
        if (room > most + 1) return Status::bad_size;
        dim_ = dim, count_ = balls_ = 0;
        const auto vectors = std::size_t(room * dim);
        if (!piece_.allocate(room) || !order_.allocate(room) || !ball_.allocate(room) || !when_.allocate(room) ||
            !normal_.allocate(vectors) || !anchor_.allocate(vectors) || !bound_.allocate(room) || !width_.allocate(room) ||
            !matrix_.allocate(matrices * dim * dim))
            return Status::no_memory;
        for (std::int64_t g = 0; g < groups; ++g)
            for (std::int64_t i = 0; i < records[g].count; ++i)
                if (leg == all_legs || records[g].leg[i] == leg) add(records[g], i, leg == all_legs ? records[g].leg[i] : 0, kept);
        return Status::done;
    }

    // The plane normal . (x - anchor) <= width.
    void add_plane(const double *normal, const double *anchor, double width) {
        for (int d = 0; d < dim_; ++d) normal_[count_ * dim_ + d] = normal[d], anchor_[count_ * dim_ + d] = anchor[d];
        put(0, 0, int(When::always), -1, width, width);
    }

    GivenWalls walls() const {
        return {count_, piece_.data(), order_.data(),  normal_.data(), anchor_.data(), bound_.data(), width_.data(), when_.data(),
                0,      ball_.data(),  matrix_.data(), balls_};
    }

private:
    static std::int64_t count_on(const WallsRecord &record, std::int64_t leg) {
        if (leg == all_legs) return record.count;
        std::int64_t count = 0;
        for (std::int64_t i = 0; i < record.count; ++i) count += record.leg[i] == leg;
        return count;
    }

    void add(const WallsRecord &from, std::int64_t i, std::int64_t piece, double kept) {
        bool cone = false;
        for (int d = 0; d < dim_; ++d) {
            cone = cone || from.slope[i * dim_ + d] != 0.0;
            normal_[count_ * dim_ + d] = -from.slope[i * dim_ + d];
            anchor_[count_ * dim_ + d] = from.anchor[i * dim_ + d];
        }
        double *const matrix = matrix_.data() + balls_ * dim_ * dim_;
        const std::int64_t size = from.rows * dim_;
        for (std::int64_t j = 0; size > 0 && j < dim_ * dim_; ++j) matrix[j] = j < size ? from.matrix[i * size + j] : 0.0;
        const std::int64_t when = from.at == nullptr ? int(When::always) : from.at[i] + (from.equal != 0 ? equal : 0);
        const double bound = size > 0 && !cone ? (1.0 + kept) * from.radius[i] : from.radius[i];
        put(piece, from.order, when, size > 0 ? balls_++ : -1, bound, from.width[i]);
    }

    void put(std::int64_t piece, std::int64_t order, std::int64_t when, std::int64_t ball, double bound, double width) {
        piece_[count_] = piece, order_[count_] = order, when_[count_] = when, ball_[count_] = ball;
        bound_[count_] = bound, width_[count_++] = width;
    }

    int dim_ = 0;
    std::int64_t count_ = 0, balls_ = 0;
    Buffer<std::int64_t> piece_, order_, when_, ball_;
    Buffer<double> normal_, anchor_, bound_, width_, matrix_;
};

}  // namespace minsnap

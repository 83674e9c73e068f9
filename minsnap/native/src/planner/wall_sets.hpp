// Walls as sets of one kind, in memory of their own.
#pragma once

#include <cstdint>

#include "basics/buffer.hpp"
#include "basics/walls_record.hpp"

namespace minsnap {

// Where the numbers of a new set are written; all zero before.
struct WallRows {
    std::int64_t *leg = nullptr, *at = nullptr;
    double *matrix = nullptr, *anchor = nullptr, *slope = nullptr, *radius = nullptr, *width = nullptr;
};

// Whether a wall holds all along its leg, at one end of it, or at a waypoint, which then stands in the place of the leg.
enum class Holds { along, at_ends, at_knots };

class WallSets {
public:
    static constexpr int most = 16;

    explicit WallSets(int dim = 0) : dim_(dim) {}

    const WallsRecord *data() const { return records_; }
    int count() const { return count_; }
    WallsRecord &last() { return records_[count_ - 1]; }
    const WallsRecord &operator[](int index) const { return records_[index]; }

    void clear(int dim) { dim_ = dim, count_ = 0; }

    // Add a set; false where there is no memory.
    [[nodiscard]] bool add(std::int64_t count, std::int64_t rows, std::int64_t order, WallRows &to, Holds holds = Holds::along) {
        const std::int64_t each = rows * dim_ + 2 * dim_ + 2;
        if (count_ == most || !numbers_[count_].allocate(std::size_t(count * each)) || !legs_[count_].allocate(std::size_t(2 * count)))
            return false;
        double *const first = numbers_[count_].data();
        std::int64_t *const legs = legs_[count_].data();
        for (std::int64_t j = 0; j < count * each; ++j) first[j] = 0.0;
        for (std::int64_t j = 0; j < 2 * count; ++j) legs[j] = 0;
        double *const anchor = first + count * rows * dim_, *const slope = anchor + count * dim_, *const radius = slope + count * dim_;
        to = {legs, legs + count, first, anchor, slope, radius, radius + count};
        std::int64_t *const at = holds == Holds::at_ends ? to.at : nullptr;
        records_[count_++] = {count, rows, order, 0, 0, holds == Holds::at_knots, legs, at, first, anchor, slope, radius, to.width};
        return true;
    }

    // Add a set with every leg cut into parts, each of which has the walls of its leg.
    [[nodiscard]] bool add_cut(const WallsRecord &from, std::int64_t parts) {
        WallRows to;
        if (!add(from.count * parts, from.rows, from.order, to)) return false;
        const std::int64_t size = from.rows * dim_;
        for (std::int64_t i = 0, k = 0; i < from.count; ++i)
            for (std::int64_t part = 0; part < parts; ++part, ++k) {
                to.leg[k] = from.leg[i] * parts + part, to.radius[k] = from.radius[i], to.width[k] = from.width[i];
                for (std::int64_t j = 0; j < size; ++j) to.matrix[k * size + j] = from.matrix[i * size + j];
                for (int d = 0; d < dim_; ++d)
                    to.anchor[k * dim_ + d] = from.anchor[i * dim_ + d], to.slope[k * dim_ + d] = from.slope[i * dim_ + d];
            }
        return true;
    }

private:
    int dim_, count_ = 0;
    WallsRecord records_[most];
    Buffer<double> numbers_[most];
    Buffer<std::int64_t> legs_[most];
};

}  // namespace minsnap

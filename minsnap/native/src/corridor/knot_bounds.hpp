// How far a knot may be from its nominal position along each coordinate, as the walls at that knot alone say.
//
// Where the walls' directions n_j are orthogonal and one coordinate axis is a combination of them, |x_i| <= sum |n_ji| c_j,
// c_j being the larger of the bounds of n_j . x and -n_j . x. Waypoints in boxes, gates and balls are such walls.
#pragma once

#include <cmath>
#include <limits>

#include "arithmetic/vectors.hpp"
#include "corridor/walls.hpp"

namespace minsnap {

class KnotBounds {
public:
    // From the walls of one piece that hold at its start, whose nominal position is ``place`` (dim,).
    KnotBounds(const GivenWalls &walls, const double *place, int dim) : dim_(dim) {
        for (std::int64_t i = 0; i < walls.count; ++i) {
            if (walls.order[i] != 0 || walls.when_of(i) != When::start) continue;
            walls.is_ball(i) ? add_ball(walls, i, place) : add_plane(walls, i, place);
        }
    }

    // Infinite where the walls do not say.
    double along(int axis) const {
        double rest = 1.0, sum = 0.0;
        for (int j = 0; j < count_; ++j) {
            const double own = normal_[j][axis];
            for (int other = 0; other < j; ++other)
                if (std::fabs(dot(normal_[j], normal_[other], dim_)) > rounding) return ball_;
            rest -= own * own;
            if (own != 0.0) sum += std::fabs(own) * (most_[j][0] > most_[j][1] ? most_[j][0] : most_[j][1]);
        }
        const double planes = std::fabs(rest) <= rounding ? sum : infinity;
        return planes < ball_ ? planes : ball_;
    }

private:
    static constexpr double infinity = std::numeric_limits<double>::infinity(), rounding = 1e-9;

    void add_ball(const GivenWalls &walls, std::int64_t i, const double *place) {
        const double *const matrix = walls.matrix_of(i, dim_);
        const double *const normal = walls.normal + i * dim_;
        if (dot(normal, normal, dim_) > 0.0) return;
        double squares = 0.0;
        for (int q = 0; q < dim_; ++q) {
            const double away = place[q] - walls.anchor[i * dim_ + q];
            squares += away * away;
            for (int axis = 0; axis < dim_; ++axis)
                if (matrix[q * dim_ + axis] != (q == axis ? 1.0 : 0.0)) return;
        }
        const double reach = walls.bound[i] + std::sqrt(squares);
        if (reach < ball_) ball_ = reach;
    }

    void add_plane(const GivenWalls &walls, std::int64_t i, const double *place) {
        const double *const given = walls.normal + i * dim_, *const anchor = walls.anchor + i * dim_;
        const double length = std::sqrt(dot(given, given, dim_));
        double normal[max_dim], bound = walls.bound[i];
        for (int q = 0; q < dim_; ++q) normal[q] = given[q] / length, bound += given[q] * (anchor[q] - place[q]);
        if (walls.is_equality(i)) bound = std::fabs(bound);
        int same = 0;
        while (same < count_ && !(std::fabs(dot(normal, normal_[same], dim_)) > 1.0 - rounding)) ++same;
        if (same == max_dim || !(length > 0.0)) return;
        if (same == count_) {
            for (int q = 0; q < dim_; ++q) normal_[same][q] = normal[q];
            most_[count_][0] = most_[count_][1] = infinity, ++count_;
        }
        const int back = dot(normal, normal_[same], dim_) < 0.0;
        for (int side = 0; side < 2; ++side)
            if ((side == back || walls.is_equality(i)) && bound / length < most_[same][side]) most_[same][side] = bound / length;
    }

    int dim_, count_ = 0;
    double normal_[max_dim][max_dim], most_[max_dim][2], ball_ = infinity;
};

}  // namespace minsnap

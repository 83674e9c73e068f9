// Where a curve exceeds its conditions most: a grid on every piece, and the tops between, by two parabolas each.
//
// The same search in Python is time_allocation/true_peaks.py.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "shortest_time/joint_grid.hpp"
#include "shortest_time/joint_terms.hpp"
#include "basics/status.hpp"

namespace minsnap {

// Results, arrays of the caller: by block the largest excess over its weight, its condition and place and the number of
// peaks; then all peaks, condition and place.
struct JointPeaks {
    double *tops, *places;
    std::int64_t *conditions, *counts;
    std::int64_t *index;
    double *s;
    std::size_t room;
};

class PeakSearch {
public:
    PeakSearch(const JointTerms &terms, JointPeaks &out) : terms_(terms), out_(out) {}

    Status run(std::size_t instants) {
        if (!grid_.set(terms_, instants)) return Status::no_memory;
        for (std::size_t b = 0; b < terms_.blocks; ++b) {
            const JointBlock block(terms_, b);
            const std::size_t before = used_;
            best_ = -HUGE_VAL, condition_ = 0, place_ = 0.0;
            for (std::size_t r = 0; r < block.conditions; ++r) {
                if (!row(block, r)) return Status::unsupported;
            }
            out_.tops[b] = std::max(best_ / block.weight, -1.0);
            out_.conditions[b] = static_cast<std::int64_t>(condition_);
            out_.places[b] = place_;
            out_.counts[b] = static_cast<std::int64_t>(used_ - before);
        }
        return Status::done;
    }

private:
    static constexpr double near_ = -0.2;   // excess above which a local maximum is kept
    static constexpr double closer_ = 6.0;  // how many times narrower the second parabola is

    bool row(const JointBlock &block, std::size_t r) {
        const double *v = grid_.row(block, r);
        const std::size_t last = grid_.instants() - 1;
        const double step = 1.0 / static_cast<double>(last), side = step / closer_;
        for (std::size_t g = 0; g <= last; ++g) raise(v[g], r, grid_.at(g));
        for (std::size_t g = 1; g < last; ++g) {
            const double bend = v[g - 1] - 2.0 * v[g] + v[g + 1];
            if (!(v[g] >= v[g - 1] && v[g] >= v[g + 1] && v[g] > near_ && bend < 0.0)) continue;
            if (!refine(block, r, grid_.at(g) - step * (v[g + 1] - v[g - 1]) / (2.0 * bend), side)) return false;
        }
        if (v[0] >= v[1] && v[0] > near_ && !refine(block, r, side, side)) return false;
        return !(v[last] >= v[last - 1] && v[last] > near_) || refine(block, r, 1.0 - side, side);
    }

    // Move a peak to the top of a narrower parabola, and keep it.
    bool refine(const JointBlock &block, std::size_t r, double s, double step) {
        if (used_ == out_.room) return false;
        const auto piece = static_cast<std::size_t>(block.piece[r]);
        double v[3];
        for (int i = 0; i < 3; ++i) {
            Derivatives at;
            fill_derivatives(terms_, block, piece, std::clamp(s + step * (i - 1), 0.0, 1.0), at);
            v[i] = block.excess(r, at);
        }
        const double bend = std::min(v[0] - 2.0 * v[1] + v[2], -1e-300), move = -(v[2] - v[0]) / (2.0 * bend);
        double height = std::max(std::max(v[0], v[1]), v[2]);
        if (std::abs(move) < 1.0 && bend < -1e-300) height = std::max(height, v[1] - (v[2] - v[0]) * (v[2] - v[0]) / (8.0 * bend));
        const double place = std::clamp(std::clamp(s, 0.0, 1.0) + step * std::clamp(move, -1.0, 1.0), 0.0, 1.0);
        if (std::isnan(place)) return true;
        out_.index[used_] = static_cast<std::int64_t>(r);
        out_.s[used_++] = place;
        raise(height, r, place);
        return true;
    }

    void raise(double value, std::size_t r, double s) {
        if (!(value > best_)) return;
        best_ = value, condition_ = r, place_ = s;
    }

    const JointTerms &terms_;
    JointPeaks &out_;
    JointGrid grid_;
    std::size_t used_ = 0, condition_ = 0;
    double best_ = 0.0, place_ = 0.0;
};

}  // namespace minsnap

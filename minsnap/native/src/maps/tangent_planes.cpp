// Convex sets around the segments of a line of points: planes touch what is nearest first, and what a plane cuts off needs none of its own.
//
// As in S. Liu, M. Watterson, K. Mohta, K. Sun, S. Bhattacharya, C. J. Taylor and V. Kumar, "Planning dynamically feasible trajectories for quadrotors using
// safe flight corridors in 3-D complex environments", IEEE RA-L 2017, whose ellipsoid is the segment itself here: each set is the largest around it that way.
#include <algorithm>

#include "basics/buffer.hpp"
#include "basics/export.hpp"
#include "basics/status.hpp"
#include "basics/threads.hpp"
#include "maps/nearest.hpp"
#include "maps/questions.hpp"

namespace minsnap {
namespace {

struct Near {
    double distance, normal[fleet_axes];
    Integer which;
};

double product(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// A single point as an obstacle: a ball without extent.
Obstacle as_obstacle(const double *point) {
    Obstacle ball{};
    for (int d = 0; d < fleet_axes; ++d) {
        ball.center[d] = point[d];
        ball.scale[d] = 1.0;
        ball.low[d] = -__builtin_huge_val();
        ball.high[d] = __builtin_huge_val();
    }
    return ball;
}

class SegmentSet {
public:
    SegmentSet(const TangentQuestion &q, Integer segment) : q_(q), segment_(segment), from_(q.path + fleet_axes * segment) {
        to_ = from_ + fleet_axes;
        planes_ = q.planes + 4 * q.capacity * segment;
        const double grown = 2.0 * q.reach + q.clearance;
        for (int d = 0; d < fleet_axes; ++d) {
            low_[d] = std::fmin(from_[d], to_[d]) - grown;
            high_[d] = std::fmax(from_[d], to_[d]) + grown;
        }
        near_ = grown * (1.0 + 1e-9) + 1e-9 * (std::fabs(from_[0]) + std::fabs(from_[1]) + std::fabs(from_[2]));
    }

    // False where there is no memory.
    bool find() {
        Buffer<Near> near;
        Integer count = 0;
        for (Integer which = 0; which < q_.obstacles + q_.points; ++which) count += may_reach(which);
        if (!near.allocate(std::size_t(count + 1))) return false;
        count = gather(near.data());
        std::sort(near.data(), near.data() + count, before);
        q_.nearest[segment_] = count > 0 ? near[0].which : -1;
        q_.distance[segment_] = count > 0 ? near[0].distance : __builtin_huge_val();
        enclose();
        for (Integer i = 0; i < count; ++i) touch(near[std::size_t(i)]);
        q_.counts[segment_] = planes_found_;
        return true;
    }

private:
    static bool before(const Near &a, const Near &b) { return a.distance < b.distance || (a.distance == b.distance && a.which < b.which); }

    Obstacle obstacle_of(Integer which) const {
        return which < q_.obstacles ? q_.obstacle[which] : as_obstacle(q_.point + fleet_axes * (which - q_.obstacles));
    }

    // Whether an obstacle may be within the box around the segment, grown by reach and clearance; or a point, of which there are millions, as near to it.
    bool may_reach(Integer which) const {
        if (which >= q_.obstacles) return is_near(q_.point + fleet_axes * (which - q_.obstacles));
        const Obstacle &obstacle = q_.obstacle[which];
        for (int d = 0; d < int(q_.dim); ++d) {
            double low = obstacle.low[d], high = obstacle.high[d];
            if (is_round(obstacle, d)) {
                low = std::fmax(low, obstacle.center[d] - obstacle.radius / obstacle.scale[d]);
                high = std::fmin(high, obstacle.center[d] + obstacle.radius / obstacle.scale[d]);
            }
            if (low > high_[d] || high < low_[d]) return false;
        }
        return true;
    }

    bool is_near(const double *point) const {
        bool within = true;
        for (int d = 0; d < int(q_.dim); ++d) within &= !(point[d] > high_[d]) & !(point[d] < low_[d]);
        if (!within) return false;
        double along[fleet_axes], away[fleet_axes], square = 0.0;
        for (int d = 0; d < fleet_axes; ++d) {
            along[d] = to_[d] - from_[d];
            away[d] = point[d] - from_[d];
        }
        const double length = product(along, along);
        const double share = length > 0.0 ? std::fmin(std::fmax(product(along, away) / length, 0.0), 1.0) : 0.0;
        for (int d = 0; d < fleet_axes; ++d) square += (away[d] - share * along[d]) * (away[d] - share * along[d]);
        return !(square > near_ * near_);
    }

    Integer gather(Near *near) const {
        Integer count = 0;
        for (Integer which = 0; which < q_.obstacles + q_.points; ++which) {
            if (!may_reach(which)) continue;
            const Obstacle obstacle = obstacle_of(which);
            Near &one = near[count];
            one.which = which;
            one.distance = nearest_on_segment(obstacle, from_, to_, one.normal);
            if (q_.dim == 2) one.normal[2] = 0.0;
            if (one.distance > 2.0 * q_.reach + q_.clearance) continue;
            const double length = std::sqrt(product(one.normal, one.normal));
            if (length > 0.0)
                for (int d = 0; d < fleet_axes; ++d) one.normal[d] /= length;
            ++count;
        }
        return count;
    }

    // The box along the segment that bounds the set where nothing else does.
    void enclose() {
        double along[fleet_axes], length = 0.0;
        for (int d = 0; d < fleet_axes; ++d) along[d] = to_[d] - from_[d];
        length = std::sqrt(product(along, along));
        for (int d = 0; d < fleet_axes; ++d) along[d] = length > 0.0 ? along[d] / length : double(d == 0);
        const bool upright = std::fabs(along[2]) > 0.9;
        const double other[fleet_axes] = {upright ? 1.0 : 0.0, 0.0, upright ? 0.0 : 1.0};
        double side[fleet_axes] = {other[1] * along[2] - other[2] * along[1], other[2] * along[0] - other[0] * along[2],
                                   other[0] * along[1] - other[1] * along[0]};
        const double width = std::sqrt(product(side, side));
        for (double &part : side) part /= width;
        const double last[fleet_axes] = {along[1] * side[2] - along[2] * side[1], along[2] * side[0] - along[0] * side[2],
                                         along[0] * side[1] - along[1] * side[0]};
        const double *axes[] = {along, side, last};
        for (int axis = 0; axis < int(q_.dim); ++axis)
            for (const double sign : {1.0, -1.0}) {
                double normal[fleet_axes];
                for (int d = 0; d < fleet_axes; ++d) normal[d] = sign * axes[axis][d];
                add(normal, std::fmax(product(normal, from_), product(normal, to_)) + q_.reach);
            }
    }

    // Bound the set by the plane that touches what is near, moved back by the clearance, unless a plane has it beyond by as much.
    void touch(const Near &near) {
        const Obstacle obstacle = obstacle_of(near.which);
        for (Integer i = 0; i < std::min(planes_found_, q_.capacity); ++i) {
            const double *plane = planes_ + 4 * i;
            if (least_product(obstacle, plane) >= plane[3] + q_.clearance) return;
        }
        add(near.normal, least_product(obstacle, near.normal) - q_.clearance);
    }

    void add(const double *normal, double bound) {
        if (planes_found_ < q_.capacity) {
            double *plane = planes_ + 4 * planes_found_;
            for (int d = 0; d < fleet_axes; ++d) plane[d] = normal[d];
            plane[3] = bound;
        }
        ++planes_found_;
    }

    const TangentQuestion &q_;
    Integer segment_, planes_found_ = 0;
    const double *from_, *to_;
    double low_[fleet_axes], high_[fleet_axes], near_;
    double *planes_;
};

}  // namespace
}  // namespace minsnap

using namespace minsnap;

MINSNAP_EXPORT std::int32_t minsnap_tangent_planes(const TangentQuestion *question) {
    const TangentQuestion &q = *question;
    if (q.dim < 2 || q.dim > 3 || q.segments < 1 || q.obstacles < 0 || q.points < 0 || q.capacity < 1 || q.threads < 1)
        return int(Status::bad_size);
    if (!(q.clearance >= 0.0) || !(q.reach > 0.0)) return int(Status::bad_number);
    std::atomic<bool> failed{false};
    auto task = [&q, &failed](Integer segment) {
        if (!SegmentSet(q, segment).find()) failed = true;
    };
    Chunks<decltype(task)>(q.segments, task).run(int(q.threads));
    return int(failed ? Status::no_memory : Status::done);
}

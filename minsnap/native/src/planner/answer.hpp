// A curve in memory of its own, and what of a course stays the same however its durations are chosen.
#pragma once

#include <algorithm>

#include "planner/course.hpp"

extern "C" std::int32_t minsnap_costs(std::int32_t pieces, std::int32_t degree, std::int32_t dim, const double *points,
                                      const double *durations, std::int32_t order, double *costs, double *total);

namespace minsnap {

void write_breaks(const double *durations, std::int64_t legs, double *breaks);

class CurveMemory {
public:
    std::int64_t legs = 0, pieces = 0;
    int dim = 0, half = 0;
    Buffer<double> points;     // (legs * pieces, 2k, dim)
    Buffer<double> durations;  // (legs * pieces,)
    Buffer<double> breaks;     // (legs * pieces + 1,)
    Buffer<double> yaw;        // (legs, 4) where it heads somewhere
    bool heads = false;

    // Make room for a curve that is to be written; without memory it has no legs.
    [[nodiscard]] bool allocate(const Course &course, std::int64_t per_leg) {
        return allocate(course.legs, per_leg, course.dim, course.half);
    }
    [[nodiscard]] bool allocate(std::int64_t all_legs, std::int64_t per_leg, int axes, int order) {
        const auto count = std::size_t(all_legs * per_leg);
        legs = 0;
        if (!points.allocate(count * 2 * order * axes) || !durations.allocate(count) || !breaks.allocate(count + 1)) return false;
        legs = all_legs, pieces = per_leg, dim = axes, half = order;
        return true;
    }

    std::int64_t all() const { return legs * pieces; }
    double total() const { return summed(durations.data(), all()); }

    void slow(double factor) {
        for (std::int64_t i = 0; i < all(); ++i) durations[std::size_t(i)] *= factor;
    }

    void swap(CurveMemory &other) {
        std::swap(legs, other.legs), std::swap(pieces, other.pieces), std::swap(dim, other.dim), std::swap(half, other.half);
        points.swap(other.points), durations.swap(other.durations), breaks.swap(other.breaks), yaw.swap(other.yaw);
        std::swap(heads, other.heads);
    }

    [[nodiscard]] bool copy(const CurveMemory &from) {
        if (!allocate(from.legs, from.pieces, from.dim, from.half)) return false;
        std::copy(from.points.data(), from.points.data() + all() * 2 * half * dim, points.data());
        std::copy(from.durations.data(), from.durations.data() + all(), durations.data());
        return true;
    }

    // The same as the public header has it.
    void tell(minsnap_curve &curve) {
        write_breaks(durations.data(), all(), breaks.data());
        curve.legs = legs, curve.pieces = pieces, curve.degree = 2 * half - 1, curve.dim = dim;
        curve.points = points.data(), curve.durations = durations.data(), curve.breaks = breaks.data();
        curve.duration = breaks[std::size_t(all())], curve.yaw = heads ? yaw.data() : nullptr;
        minsnap_costs(std::int32_t(all()), 2 * half - 1, dim, points.data(), durations.data(), half, nullptr, &curve.cost);
    }
};

// How far a curve goes over all time, and how much of each limit it uses.
struct Reached {
    double norm[4] = {0.0, 0.0, 0.0, 0.0};
    double thrust = 0.0, least_thrust = 0.0, tilt = 0.0, body_rate = 0.0;  // thrusts over weight
    std::int64_t piece[2] = {0, 0};                                        // in which the thrust is greatest, and least
    double place[2] = {0.0, 0.0};                                          // where on it, on [0, 1]
};

// Curves as what is proved of them takes them.
struct CurveView {
    const double *points, *durations;
    std::int64_t legs, pieces;
    int dim, degree;
};

inline CurveView view(const CurveMemory &curve) {
    return {curve.points.data(), curve.durations.data(), curve.legs, curve.pieces, curve.dim, 2 * curve.half - 1};
}

// Proved norms of the derivatives 1 ... 4 and, if wanted, of what the thrust does.
Status measure(const CurveView &curve, double gravity, bool thrust, Reached &reached);

// The share of the most used limit, of those on derivatives alone with drag; 1 is fully used. Infinite where it cannot be measured.
double largest_use(const CurveView &curve, const Bounds &bounds);

// Whether bounds prove that no rotor leaves its room, less a share of hover, and with drag that thrust, tilt and body rate keep theirs.
bool vehicle_kept(const CurveView &curve, const Bounds &bounds, double share = 0.0);

// A proved bound of the excess over walls on positions [m], negative inside; infinite where there is no proof.
double wall_excess(const CurveView &curve, const WallSets &walls);

// The largest distance of knots from where they may be, beyond balls and gates, and whether it is rounding [m].
double waypoint_excess(const CurveView &curve, const Course &course, bool &passes);

// Prove everything; a sentence where something is not kept.
Status certify(const CurveView &curve, const Course &course, minsnap_certificate &proved, Says &says);

}  // namespace minsnap

// Where waypoints may lie: balls around them, and gates, openings in a plane.
#pragma once

#include <cstdint>
#include <limits>

#include "basics/buffer.hpp"
#include "basics/public.hpp"
#include "basics/status.hpp"
#include "planner/says.hpp"
#include "planner/wall_sets.hpp"

namespace minsnap {

// The set in which the curve passes one waypoint, by offsets from it [m]; all parts hold together.
struct Region {
    std::int64_t waypoint;
    double lower[3], upper[3];  // corners of a box around it; of a gate across an axis it is flat
    double radius;              // of a ball, infinite of a gate
    double reach;               // no part is farther away
    std::int64_t first, sides;  // half-spaces beside the box
    bool slanted;               // whether it lies in a plane that is across no axis
    double normal[3];           // of that plane, of length 1
    bool crossed;               // whether the velocity has a direction
    double direction[3];        // along which it is not negative

    bool ball() const { return radius < std::numeric_limits<double>::infinity(); }
};

// Of balls first, then of gates, in the order of their waypoints; of a lap without its end, which is its start.
class Regions {
public:
    Status take(const minsnap_problem &given, const double *points, Says &says);

    std::int64_t count() const { return count_; }
    const Region &operator[](std::int64_t index) const { return regions_[std::size_t(index)]; }

    // The region of a waypoint, or null where that is a point.
    const Region *at(std::int64_t waypoint) const {
        const std::int64_t index = count_ == 0 ? -1 : index_[std::size_t(waypoint)];
        return index < 0 ? nullptr : &regions_[std::size_t(index)];
    }
    bool free(std::int64_t waypoint, int axis) const {
        const Region *const region = at(waypoint);
        return region != nullptr && region->upper[axis] > region->lower[axis];
    }

    // Half-spaces normal . offset <= bound, of unit length: (dim + 1,).
    const double *side(std::int64_t index) const { return sides_.data() + index * (dim_ + 1); }

    // Add balls, or the directions in which gates are crossed, as walls, for so many pieces a leg; false where there is no memory.
    [[nodiscard]] bool add_balls(WallSets &sets, const double *points, std::int64_t per_leg, Holds holds) const;
    [[nodiscard]] bool add_crossings(WallSets &sets, std::int64_t per_leg, Holds holds) const;

    // How far an offset is outside [m]; 0 or less inside.
    double excess(const Region &region, const double *offset) const;

private:
    Status take_balls(const minsnap_problem &given, Says &says);
    Status take_gates(const minsnap_problem &given, const double *points, Says &says);
    Status take_gate(const minsnap_gate &gate, const double *center, Says &says);
    Status take_opening(const minsnap_gate &gate, const double *center, const double *normal, Says &says);
    Status take_sides(const minsnap_gate &gate, const double *normal, std::int64_t corners, Says &says);

    int dim_ = 0;
    std::int64_t count_ = 0, all_sides_ = 0;
    Buffer<Region> regions_;
    Buffer<std::int64_t> index_;      // (waypoints,)
    Buffer<std::int64_t> gate_;       // (waypoints,)
    Buffer<double> sides_, corners_;  // the last of one gate, from its center (corners, dim)
};

}  // namespace minsnap

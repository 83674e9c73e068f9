// A problem of the public header, checked: where the curve passes, with which derivatives, and inside which walls.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "basics/buffer.hpp"
#include "basics/status.hpp"
#include "basics/public.hpp"
#include "planner/regions.hpp"
#include "planner/says.hpp"
#include "planner/wall_sets.hpp"

namespace minsnap {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double exact = 1e-9;                                                 // share below which two values count as equal
constexpr double stored = 8.0 * 0.5 * std::numeric_limits<double>::epsilon();  // error of a stored position, relative to the largest
constexpr double allowed_gap = 9e-7;                                           // share of a cost that a proof may give away
constexpr double earth = 9.80665;                                              // gravity [m/s^2]
constexpr double farthest = 1e12;  // of coordinates, derivatives and angles given: beyond, squares of what is computed from them overflow

inline bool finite(const double *values, std::int64_t count) {
    for (std::int64_t i = 0; i < count; ++i)
        if (!(std::fabs(values[i]) <= farthest)) return false;
    return true;
}

// The limits of a problem, infinite where there are none.
struct Bounds {
    double norm[4] = {infinite, infinite, infinite, infinite};  // speed, acceleration, jerk, snap
    double most_thrust = infinite, least_thrust = 0.0, tilt = infinite, body_rate = infinite, gravity = earth;
    double medium[5] = {earth, 0.0, 0.0, 0.0, 0.0};  // gravity and drag, as VehicleRecord
    const minsnap_vehicle *vehicle = nullptr;

    bool drags() const { return medium[1] != 0.0 || medium[2] != 0.0 || medium[3] != 0.0 || medium[4] != 0.0; }
    bool turns() const { return body_rate < infinite || vehicle != nullptr; }  // whether slower flight may turn faster, in free fall
    bool lifts() const { return most_thrust < infinite || least_thrust > 0.0 || tilt < infinite || turns(); }
    bool any() const { return lifts() || norm[0] < infinite || norm[1] < infinite || norm[2] < infinite || norm[3] < infinite; }
    double reached(int order) const;  // greatest derivative that a motion in any direction may have; infinite where free
    double hover() const { return 0.25 * vehicle->mass * gravity; }  // of a rotor [N]
    double room_above() const { return (1.0 - vehicle->reserve) * (vehicle->most - hover()); }
    double room_below() const { return (1.0 - vehicle->reserve) * (hover() - vehicle->least); }
};

class Course {
public:
    int dim = 0, half = 0;
    std::int64_t legs = 0, pieces = 0;  // pieces 0: the search chooses
    bool closed = false;
    bool still = true;  // whether all pinned derivatives are zero
    const double *durations = nullptr, *widths = nullptr;
    double total = 0.0;
    bool limited = false, walled = false;  // whether there are limits, and walls beside a tube
    Bounds bounds;
    Buffer<double> points;   // (legs + 1, dim), the first one where the curve begins
    Buffer<double> pinned;   // (legs + 1, half, dim) positions and derivatives [m/s^order]
    Buffer<double> lengths;  // (legs,)
    double length = 0.0;     // typical length of a leg
    WallSets walls;          // on positions
    Regions regions;         // where waypoints may lie

    // A status with a sentence where a problem is malformed. A curve in motion begins at `first`, (half, dim) with its position, in place of the
    // first waypoint, whose legs' walls stay; or null.
    Status take(const minsnap_problem *problem, Says &says, const double *first = nullptr);

    bool constrained() const { return walls.count() > 0 || regions.count() > 0; }

    // How far from a waypoint the curve may pass it.
    double reach(std::int64_t waypoint) const {
        const Region *const region = regions.at(waypoint);
        return region == nullptr ? 0.0 : region->reach;
    }

    // Work that the problem is worth, in milliseconds of a processor, about.
    double worth() const {
        const double size = double(pieces > 1 ? pieces : 1) * double(legs),
                     more = std::fmax(1.0, std::fmax(double(legs) / 5.0, size / 30.0));
        return 2000.0 * more * more;
    }

    const double *point(std::int64_t waypoint) const { return points.data() + waypoint * dim; }
    const double *state(std::int64_t waypoint) const { return pinned.data() + waypoint * half * dim; }

private:
    Status take_sizes(const minsnap_problem &given, Says &says);
    Status take_limits(const minsnap_problem &given, Says &says);
    Status take_vehicle(const minsnap_limits &given, Says &says);
    Status take_times(const minsnap_problem &given, Says &says);
    Status take_places(const minsnap_problem &given, const double *first, Says &says);
    Status take_tube(const minsnap_problem &given, Says &says);
    Status take_boxes(const minsnap_problem &given, Says &says);
    Status take_planes(const minsnap_problem &given, Says &says);
    Status look_for_room(Says &says) const;
    double scale(std::int64_t leg) const;
};

// Sum in the order of NumPy's, of whose plans these have the bits.
inline double summed(const double *values, std::int64_t count) {
    if (count > 128) {
        const std::int64_t part = count / 2 / 8 * 8;
        return summed(values, part) + summed(values + part, count - part);
    }
    if (count < 8) {
        double sum = count > 0 ? values[0] : 0.0;
        for (std::int64_t i = 1; i < count; ++i) sum += values[i];
        return sum;
    }
    double parts[8];
    for (int lane = 0; lane < 8; ++lane) parts[lane] = values[lane];
    std::int64_t i = 8;
    for (; i + 8 <= count; i += 8)
        for (int lane = 0; lane < 8; ++lane) parts[lane] += values[i + lane];
    double sum = ((parts[0] + parts[1]) + (parts[2] + parts[3])) + ((parts[4] + parts[5]) + (parts[6] + parts[7]));
    for (; i < count; ++i) sum += values[i];
    return sum;
}

}  // namespace minsnap

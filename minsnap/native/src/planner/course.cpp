// Checks of a problem, one sentence for what is wrong, and its walls.
#include "planner/course.hpp"

#include <algorithm>

#include "chain/unconstrained.hpp"

extern "C" std::int32_t minsnap_half_spaces(const minsnap::SetsRecord *asked);

namespace minsnap {
namespace {

constexpr std::int64_t most_waypoints = 100'000, most_planes = 1'000'000, most_per_leg = 1'000;
constexpr double nearest = 1e-9;        // of two waypoints [m]
constexpr double far = 1e3;             // radius of the largest ball in a set, over 1 m and its largest bound
constexpr double across = 1e-12;        // a component of a row that is shorter is rounding: the leg is along that axis
constexpr double least_length = 1e-12;  // share of all legs below which two waypoints count as equal
constexpr double right_angle = 1.5707963267948966;

using Long = long long;

bool positive(double value) { return value >= smallest_number && value <= largest_number; }

}  // namespace

Status Course::take(const minsnap_problem *problem, Says &says, const double *first) {
    if (problem == nullptr) return says(Status::bad_size, "the problem is a null pointer");
    if (problem->size != std::int64_t(sizeof(minsnap_problem)))
        return says(Status::bad_size,
                    "the problem has size %lld and this library's has %lld: make it by minsnap_problem_new of the same version",
                    Long(problem->size), Long(sizeof(minsnap_problem)));
    Status status = take_sizes(*problem, says);
    if (status == Status::done) status = take_limits(*problem, says);
    if (status == Status::done) status = take_times(*problem, says);
    if (status == Status::done) status = take_places(*problem, first, says);
    if (status == Status::done) status = take_tube(*problem, says);
    if (status == Status::done) status = take_boxes(*problem, says);
    if (status == Status::done) status = take_planes(*problem, says);
    if (status == Status::done) status = regions.take(*problem, problem->points, says);
    return status == Status::done ? look_for_room(says) : status;
}

Status Course::take_sizes(const minsnap_problem &given, Says &says) {
    if (given.dim < 1 || given.dim > 3) return says(Status::bad_size, "dim is %lld: it must be 1, 2 or 3", Long(given.dim));
    if (given.waypoints < 2 || given.waypoints > most_waypoints)
        return says(Status::bad_size, "there are %lld waypoints: give 2 to %lld", Long(given.waypoints), Long(most_waypoints));
    if (given.degree != 0 && (given.degree < 3 || given.degree > 11 || given.degree % 2 == 0))
        return says(Status::bad_size, "the degree is %lld: it must be 3, 5, 7, 9 or 11", Long(given.degree));
    if (given.pieces < 0 || given.pieces > most_per_leg)
        return says(Status::bad_size, "there are %lld polynomials a leg: give 1 to %lld, or 0 to have them chosen", Long(given.pieces),
                    Long(most_per_leg));
    if (given.closed != 0 && given.closed != 1) return says(Status::bad_size, "closed is %lld: it must be 0 or 1", Long(given.closed));
    if (given.points == nullptr) return says(Status::bad_size, "the waypoints are a null pointer");
    if ((given.box_lower == nullptr) != (given.box_upper == nullptr))
        return says(Status::bad_size, "boxes have lower and upper corners: give both");
    if (given.planes < 0 || given.planes > most_planes)
        return says(Status::bad_size, "there are %lld planes: give at most %lld", Long(given.planes), Long(most_planes));
    if (given.planes > 0 && (given.plane_leg == nullptr || given.plane_normal == nullptr || given.plane_bound == nullptr))
        return says(Status::bad_size, "planes have legs, normals and bounds: one is a null pointer");
    dim = int(given.dim), legs = given.waypoints - 1, half = int(given.degree == 0 ? 4 : (given.degree + 1) / 2);
    pieces = given.pieces, closed = given.closed != 0;
    if (closed && legs < 2) return says(Status::bad_size, "a lap has at least 2 legs");
    if (closed && (given.start != nullptr || given.end != nullptr))
        return says(Status::bad_number, "the state at the end of a lap is chosen: give none");
    return Status::done;
}

Status Course::take_limits(const minsnap_problem &given, Says &says) {
    limited = given.limits != nullptr, bounds = Bounds();
    if (!limited) return Status::done;
    const minsnap_limits &limits = *given.limits;
    if (limits.size != std::int64_t(sizeof(minsnap_limits)))
        return says(Status::bad_size,
                    "the limits have size %lld and this library's have %lld: make them by minsnap_limits_new of the same version",
                    Long(limits.size), Long(sizeof(minsnap_limits)));
    const struct {
        const char *name;
        double value, above, below;
        double *to;
    } kinds[] = {{"speed", limits.speed, 0.0, infinite, &bounds.norm[0]},
                 {"acceleration", limits.acceleration, 0.0, infinite, &bounds.norm[1]},
                 {"jerk", limits.jerk, 0.0, infinite, &bounds.norm[2]},
                 {"snap", limits.snap, 0.0, infinite, &bounds.norm[3]},
                 {"max_thrust", limits.max_thrust, 1.0, infinite, &bounds.most_thrust},
                 {"min_thrust", limits.min_thrust, 0.0, 1.0, &bounds.least_thrust},
                 {"tilt", limits.tilt, 0.0, right_angle, &bounds.tilt},
                 {"body_rate", limits.body_rate, 0.0, infinite, &bounds.body_rate},
                 {"gravity", limits.gravity, 0.0, infinite, &bounds.gravity}};
    for (const auto &kind : kinds) {
        if (kind.value == 0.0) continue;
        if (!positive(kind.value))
            return says(Status::bad_number, "the limit %s is %g: it must be a positive number", kind.name, kind.value);
        if (!(kind.value > kind.above && kind.value < kind.below))
            return says(Status::bad_number, "the limit %s is %g: no vehicle holds altitude unless it is above %g and below %g", kind.name,
                        kind.value, kind.above, kind.below);
        *kind.to = kind.value;
    }
    bounds.medium[0] = bounds.gravity;
    if (limits.vehicle != nullptr)
        if (const Status status = take_vehicle(limits, says); status != Status::done) return status;
    if (!bounds.any()) return says(Status::bad_number, "the limits are empty: set at least one");
    if (bounds.lifts() && dim != 3)
        return says(Status::bad_size, "limits of thrust, tilt and body rate need three coordinates; there are %d", dim);
    return Status::done;
}

// Whatever was not given of the sum of the thrusts is what the rotors can do.
Status Course::take_vehicle(const minsnap_limits &given, Says &says) {
    const minsnap_vehicle &vehicle = *given.vehicle;
    if (vehicle.size != std::int64_t(sizeof(minsnap_vehicle)))
        return says(Status::bad_size,
                    "the vehicle has size %lld and this library's has %lld: make it by minsnap_vehicle_new of the same version",
                    Long(vehicle.size), Long(sizeof(minsnap_vehicle)));
    bounds.vehicle = given.vehicle;
    std::copy(vehicle.drag, vehicle.drag + 4, bounds.medium + 1);
    if (!positive(vehicle.mass)) return says(Status::bad_number, "the mass is %g kg: it must be positive", vehicle.mass);
    if (!finite(vehicle.inertia, 9) || !finite(vehicle.mixer, 16) || !finite(&vehicle.yaw, 1))
        return says(Status::bad_number, "the vehicle has an inertia, a mixer or a yaw that is not finite");
    if (!finite(vehicle.drag, 4) || !(vehicle.drag[0] >= 0.0 && vehicle.drag[1] >= 0.0))
        return says(Status::bad_number, "the drag of the vehicle is %g and %g: it must be zero or positive, and finite", vehicle.drag[0],
                    vehicle.drag[1]);
    for (int axis = 0; axis < 3; ++axis)
        if (!positive(vehicle.inertia[4 * axis]))
            return says(Status::bad_number, "the inertia about axis %d is %g kg m^2: it must be positive", axis, vehicle.inertia[4 * axis]);
    if (!(vehicle.reserve >= 0.0 && vehicle.reserve < 1.0))
        return says(Status::bad_number, "the reserve is %g: it must be at least 0 and below 1", vehicle.reserve);
    if (!(vehicle.least >= 0.0 && vehicle.least < bounds.hover() && bounds.hover() < vehicle.most && vehicle.most <= largest_number))
        return says(Status::bad_number, "a rotor lifts from %g to %g N, and hovers at %g N: it cannot hold altitude", vehicle.least,
                    vehicle.most, bounds.hover());
    if (given.max_thrust == 0.0) bounds.most_thrust = 1.0 + bounds.room_above() / bounds.hover();
    if (given.min_thrust == 0.0 && vehicle.least > 0.0) bounds.least_thrust = 1.0 - bounds.room_below() / bounds.hover();
    return Status::done;
}

Status Course::take_times(const minsnap_problem &given, Says &says) {
    durations = given.durations, total = given.total_time;
    if (total != 0.0 && !(total >= shortest_duration && total <= longest_duration))
        return says(Status::bad_number, "the total time is %g s: it must be positive, at most %g", total, longest_duration);
    if (!(given.seconds >= 0.0)) return says(Status::bad_number, "the search may take %g s: give a positive number, or 0", given.seconds);
    if ((durations != nullptr) + (total != 0.0) + limited != 1)
        return says(Status::bad_number, durations == nullptr && total == 0.0
                                            ? "the plan has no times: give durations, a total time or limits"
                                            : "durations, a total time and limits exclude each other: give one of them");
    for (std::int64_t leg = 0; durations != nullptr && leg < legs; ++leg)
        if (!(durations[leg] >= shortest_duration && durations[leg] <= longest_duration))
            return says(Status::bad_number, "the duration of leg %lld is %g s: it must be positive, at most %g", Long(leg), durations[leg],
                        longest_duration);
    if (limited && half != 4 && dim != 3)
        return says(Status::unsupported, "within limits the degree of fewer than three coordinates is 7, and not %d", 2 * half - 1);
    return Status::done;
}

Status Course::take_places(const minsnap_problem &given, const double *first, Says &says) {
    const std::int64_t count = (legs + 1) * dim, orders = half - 1;
    if (!points.allocate(std::size_t(count)) || !pinned.allocate(std::size_t(count * half)) || !lengths.allocate(std::size_t(legs)))
        return says(Status::no_memory, "there is no memory for %lld waypoints", Long(legs + 1));
    for (std::int64_t i = 0; i <= legs; ++i)
        if (!finite(given.points + i * dim, dim))
            return says(Status::bad_number, "waypoint %lld is not finite, or farther away than %g m", Long(i), farthest);
    const double *const ends[2] = {given.start, given.end};
    for (int end = 0; end < 2; ++end)
        if (ends[end] != nullptr && !finite(ends[end], orders * dim))
            return says(Status::bad_number, "a derivative at the %s is not finite, or beyond %g", end == 0 ? "start" : "end", farthest);
    if (closed && !std::equal(given.points, given.points + dim, given.points + legs * dim))
        return says(Status::bad_number, "the last waypoint of a lap is the first one, and differs");
    std::copy(given.points, given.points + count, points.data());
    still = first == nullptr;
    std::fill(pinned.data(), pinned.data() + count * half, 0.0);
    for (std::int64_t i = 0; i <= legs; ++i) std::copy(point(i), point(i) + dim, pinned.data() + i * half * dim);
    for (int end = 0; end < 2; ++end)
        for (std::int64_t j = 0; ends[end] != nullptr && j < orders * dim; ++j) {
            pinned[std::size_t(end * legs * half * dim + dim + j)] = ends[end][j];
            still = still && ends[end][j] == 0.0;
        }
    if (first != nullptr) {
        if (!finite(first, half * dim)) return says(Status::bad_number, "the state from which the plan goes on is not finite");
        std::copy(first, first + half * dim, pinned.data());
        std::copy(first, first + dim, points.data());
    }
    for (std::int64_t leg = 0; leg < legs; ++leg) {
        double square = 0.0;
        for (int d = 0; d < dim; ++d) {
            const double step = point(leg + 1)[d] - point(leg)[d];
            square += step * step;
        }
        lengths[std::size_t(leg)] = std::sqrt(square);
    }
    const double sum = summed(lengths.data(), legs);
    for (std::int64_t leg = 0; leg < legs; ++leg)
        if (!(lengths[std::size_t(leg)] > std::max(least_length * sum, nearest)))
            return says(Status::bad_number, "waypoints %lld and %lld are at one place: leave one of them out", Long(leg), Long(leg + 1));
    length = sum / double(legs);
    widths = given.widths;
    walls.clear(dim), walled = false;
    return Status::done;
}

// Two planes for each leg as it was given and axis across it, upper ones first.
Status Course::take_tube(const minsnap_problem &given, Says &says) {
    if (given.widths == nullptr) return Status::done;
    std::int64_t pairs = 0;
    WallRows to;
    for (int writes = 0; writes < 2; ++writes) {
        if (writes == 1 && pairs == 0) break;
        if (writes == 1 && !walls.add(2 * pairs, 0, 0, to)) return says(Status::no_memory, "there is no memory for the corridor");
        std::int64_t k = 0;
        for (std::int64_t leg = 0; leg < legs; ++leg) {
            const double width = given.widths[leg];
            if (width == infinite) continue;
            if (!positive(width))
                return says(Status::bad_number, "the half-width of leg %lld is %g: it must be positive", Long(leg), width);
            double along[3], square = 0.0;
            for (int d = 0; d < dim; ++d)
                along[d] = given.points[(leg + 1) * dim + d] - given.points[leg * dim + d], square += along[d] * along[d];
            const double size = std::sqrt(square);
            if (!(size > 0.0)) return says(Status::bad_number, "leg %lld has no length", Long(leg));
            for (int d = 0; d < dim; ++d) along[d] /= size;
            for (int axis = 0; axis < dim; ++axis) {
                double row[3], largest = 0.0;
                for (int d = 0; d < dim; ++d) {
                    row[d] = -along[axis] * along[d] + (d == axis ? 1.0 : 0.0);
                    largest = std::max(largest, std::fabs(row[d]));
                }
                if (!(largest > across)) continue;
                for (int side = 0; writes == 1 && side < 2; ++side) {
                    const std::int64_t at = side * pairs + k;
                    to.leg[at] = leg, to.radius[at] = to.width[at] = width;
                    for (int d = 0; d < dim; ++d)
                        to.anchor[at * dim + d] = given.points[leg * dim + d], to.slope[at * dim + d] = side == 0 ? -row[d] : row[d];
                }
                ++k;
            }
        }
        pairs = k;
    }
    return Status::done;
}

double Course::scale(std::int64_t leg) const { return lengths[std::size_t(leg)] > exact * length ? lengths[std::size_t(leg)] : length; }

// Two planes for each leg and axis, fewer where a bound is infinite, upper ones first.
Status Course::take_boxes(const minsnap_problem &given, Says &says) {
    if (given.box_lower == nullptr) return Status::done;
    std::int64_t sides = 0;
    for (std::int64_t leg = 0; leg < legs; ++leg)
        for (int d = 0; d < dim; ++d) {
            const double low = given.box_lower[leg * dim + d], high = given.box_upper[leg * dim + d];
            if (!(low < high))
                return says(Status::bad_number,
                            "the box of leg %lld runs from %g to %g along axis %d: its lower bound must be below its upper one", Long(leg),
                            low, high, d);
            sides += (high < infinite) + (low > -infinite);
        }
    WallRows to;
    if (sides == 0) return Status::done;
    if (!walls.add(sides, 0, 0, to)) return says(Status::no_memory, "there is no memory for the boxes");
    std::int64_t k = 0;
    for (int side = 0; side < 2; ++side)
        for (std::int64_t leg = 0; leg < legs; ++leg)
            for (int d = 0; d < dim; ++d) {
                const double low = given.box_lower[leg * dim + d], high = given.box_upper[leg * dim + d];
                const double bound = side == 0 ? high : -low;
                if (!(bound < infinite)) continue;
                to.leg[k] = leg, to.radius[k] = bound, to.slope[k * dim + d] = side == 0 ? -1.0 : 1.0;
                to.width[k++] = high - low < infinite ? (high - low) / 2.0 : scale(leg);
            }
    walled = true;
    return Status::done;
}

// Planes of each leg in the order of the legs, judged by the radius of the largest ball in their polytope, at most the leg's length.
Status Course::take_planes(const minsnap_problem &given, Says &says) {
    const std::int64_t count = given.planes;
    if (count == 0) return Status::done;
    Buffer<std::int64_t> first;
    Buffer<double> normals, bounds, radius, centers;
    WallRows to;
    if (!first.allocate(std::size_t(legs + 2)) || !normals.allocate(std::size_t(count * dim)) || !bounds.allocate(std::size_t(count)) ||
        !radius.allocate(std::size_t(legs)) || !centers.allocate(std::size_t(legs * dim)) || !walls.add(count, 0, 0, to))
        return says(Status::no_memory, "there is no memory for %lld planes", Long(count));
    std::fill(first.data(), first.data() + legs + 2, 0);
    for (std::int64_t i = 0; i < count; ++i) {
        if (given.plane_leg[i] < 0 || given.plane_leg[i] >= legs)
            return says(Status::bad_size, "plane %lld is on leg %lld: legs go from 0 to %lld", Long(i), Long(given.plane_leg[i]),
                        Long(legs - 1));
        double square = 0.0;
        for (int d = 0; d < dim; ++d) square += given.plane_normal[i * dim + d] * given.plane_normal[i * dim + d];
        if (!finite(given.plane_normal + i * dim, dim) || !finite(given.plane_bound + i, 1) || !positive(square))
            return says(Status::bad_number, "plane %lld has a normal without direction, or a number that is not finite", Long(i));
        ++first[std::size_t(given.plane_leg[i] + 2)];
    }
    for (std::int64_t leg = 0; leg < legs; ++leg) first[std::size_t(leg + 2)] += first[std::size_t(leg + 1)];
    for (std::int64_t i = 0; i < count; ++i) {
        const std::int64_t leg = given.plane_leg[i], at = first[std::size_t(leg + 1)]++;
        double square = 0.0;
        for (int d = 0; d < dim; ++d) square += given.plane_normal[i * dim + d] * given.plane_normal[i * dim + d];
        const double size = std::sqrt(square);
        to.leg[at] = leg, to.radius[at] = bounds[std::size_t(at)] = given.plane_bound[i] / size;
        for (int d = 0; d < dim; ++d) {
            normals[std::size_t(at * dim + d)] = given.plane_normal[i * dim + d] / size;
            to.slope[at * dim + d] = -normals[std::size_t(at * dim + d)];
        }
    }
    for (std::int64_t leg = 0; leg < legs; ++leg) {
        const std::int64_t from = first[std::size_t(leg)], own = first[std::size_t(leg + 1)] - from, rows[2] = {0, own};
        if (own == 0) continue;
        SetsRecord set = {};
        set.sets = 1, set.dim = dim, set.far = far, set.first = rows, set.normals = normals.data() + from * dim,
        set.bounds = bounds.data() + from;
        set.centers = centers.data(), set.radii = radius.data();
        const Status solved = Status(minsnap_half_spaces(&set));
        if (solved != Status::done) return says(solved, "the polytope of leg %lld is not solved for its largest ball", Long(leg));
        double largest = 0.0;
        for (std::int64_t j = 0; j < own; ++j) largest = std::max(largest, std::fabs(set.bounds[j]));
        if (!(radius[0] > exact * (1.0 + largest))) return says(Status::bad_number, "the polytope of leg %lld has no interior", Long(leg));
        for (std::int64_t j = from; j < from + own; ++j) to.width[j] = std::min(radius[0], scale(leg));
    }
    walled = true;
    return Status::done;
}

// Every waypoint is inside the walls of its legs, with its region partly.
Status Course::look_for_room(Says &says) const {
    for (int g = 0; g < walls.count(); ++g)
        for (std::int64_t i = 0; i < walls[g].count; ++i)
            for (int end = 0; end < 2; ++end) {
                const WallsRecord &set = walls[g];
                const std::int64_t waypoint = set.leg[i] + end;
                double room = set.radius[i];
                for (int d = 0; d < dim; ++d) room += set.slope[i * dim + d] * (state(waypoint)[d] - set.anchor[i * dim + d]);
                if (room > exact * set.width[i] || (reach(waypoint) > 0.0 && room + reach(waypoint) > 0.0)) continue;
                if (room >= -exact * set.width[i] && !limited) continue;
                return says(Status::bad_number,
                            room < 0.0 ? "waypoint %lld is %.3g m outside of a wall of leg %lld: move it, or widen the corridor"
                                       : "waypoint %lld is %.3g m inside of a wall of leg %lld: within limits leave it some room",
                            Long(waypoint), std::fabs(room), Long(set.leg[i]));
            }
    return Status::done;
}

}  // namespace minsnap

// Null pointers, wrong sizes, numbers that are none, and random bytes in every struct: a status with a sentence, and nothing written.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>

#include <minsnap.hpp>

#include "expect.hpp"

namespace {

const double points[] = {0, 0, 1, 4, 1, 1.5, 7, -1, 2}, durations[] = {2, 2};
constexpr double none = std::numeric_limits<double>::quiet_NaN(), endless = std::numeric_limits<double>::infinity();

minsnap_problem good() {
    minsnap_problem problem = minsnap_problem_new();
    problem.dim = 3, problem.waypoints = 3, problem.points = points, problem.durations = durations;
    return problem;
}

// Call with one thing changed: refused with a sentence, and the curve as it was.
template <class Change>
void refused(minsnap_planner *planner, const char *part, Change change) {
    minsnap_problem problem = good();
    minsnap_limits limits = minsnap_limits_new();
    limits.speed = 3.0, limits.acceleration = 4.0;
    change(problem, limits);
    minsnap_curve curve = minsnap_curve_new(), before;
    curve.cost = 42.0;
    before = curve;
    const minsnap_status status = minsnap_plan(planner, &problem, &curve);
    const std::string said = minsnap_message(planner);
    if (status == MINSNAP_DONE || status == MINSNAP_SPENT || said.find(part) == std::string::npos)
        ++wrong, std::printf("%s: %s: %s\n", part, minsnap_status_name(status), said.c_str());
    EXPECT(std::memcmp(&curve, &before, sizeof curve) == 0);
}

void each_fault_has_its_sentence(minsnap_planner *planner) {
    using P = minsnap_problem;
    using L = minsnap_limits;
    auto within = [](P &problem, L &limits) { problem.durations = nullptr, problem.limits = &limits; };
    refused(planner, "problem has size 7", [](P &problem, L &) { problem.size = 7; });
    refused(planner, "dim is 4", [](P &problem, L &) { problem.dim = 4; });
    refused(planner, "1 waypoints", [](P &problem, L &) { problem.waypoints = 1; });
    refused(planner, "9223372036854775807 waypoints",
            [](P &problem, L &) { problem.waypoints = std::numeric_limits<std::int64_t>::max(); });
    refused(planner, "degree is 8", [](P &problem, L &) { problem.degree = 8; });
    refused(planner, "-1 polynomials a leg", [](P &problem, L &) { problem.pieces = -1; });
    refused(planner, "closed is 2", [](P &problem, L &) { problem.closed = 2; });
    refused(planner, "last waypoint of a lap", [](P &problem, L &) { problem.closed = 1; });
    refused(planner, "null pointer", [](P &problem, L &) { problem.points = nullptr; });
    refused(planner, "no times", [](P &problem, L &) { problem.durations = nullptr; });
    refused(planner, "exclude each other", [](P &problem, L &) { problem.total_time = 4.0; });
    refused(planner, "total time is nan", [](P &problem, L &) { problem.total_time = none; });
    refused(planner, "search may take -1 s", [](P &problem, L &) { problem.seconds = -1.0; });
    static minsnap_gate gate = minsnap_gate_new();
    auto through = [](P &problem, auto change) {
        gate = minsnap_gate_new(), gate.waypoint = 1, gate.normal[0] = 1.0, gate.width = 1.0;
        problem.gates = 1, problem.gate = &gate;
        change();
    };
    static const double square[] = {4, 0, 1, 4, 2, 1, 4, 2, 2, 4, 0, 2}, dented[] = {4, 0, 1, 4, 2, 1, 4, 1, 1.6, 4, 1, 2};
    refused(planner, "-1 gates", [](P &problem, L &) { problem.gates = -1; });
    refused(planner, "1 gates", [](P &problem, L &) { problem.gates = 1; });
    refused(planner, "gate 0 has size 3", [&](P &problem, L &) { through(problem, [] { gate.size = 3; }); });
    refused(planner, "at waypoint 9", [&](P &problem, L &) { through(problem, [] { gate.waypoint = 9; }); });
    refused(planner, "is at an end", [&](P &problem, L &) { through(problem, [] { gate.waypoint = 2; }); });
    refused(planner, "crossing of the gate at waypoint 1 is 2", [&](P &problem, L &) { through(problem, [] { gate.crossing = 2; }); });
    refused(planner, "normal of the gate", [&](P &problem, L &) { through(problem, [] { gate.normal[0] = 0.0; }); });
    refused(planner, "normal of the gate", [&](P &problem, L &) { through(problem, [] { gate.normal[1] = none; }); });
    refused(planner, "margin of the gate at waypoint 1 is -1", [&](P &problem, L &) { through(problem, [] { gate.margin = -1.0; }); });
    refused(planner, "nothing is left", [&](P &problem, L &) { through(problem, [] { gate.margin = 0.5; }); });
    refused(planner, "a side of the gate", [&](P &problem, L &) { through(problem, [] { gate.width = 0.0; }); });
    refused(planner, "up of the gate", [&](P &problem, L &) { through(problem, [] { gate.up[0] = 1.0; }); });
    refused(planner, "has 2 corners", [&](P &problem, L &) { through(problem, [] { gate.corner = square, gate.corners = 2; }); });
    refused(planner, "no convex polygon", [&](P &problem, L &) { through(problem, [] { gate.corner = dented, gate.corners = 4; }); });
    refused(planner, "no convex polygon",
            [&](P &problem, L &) { through(problem, [] { gate.corner = square, gate.corners = 4, gate.normal[0] = -1.0; }); });
    refused(planner, "not in the plane",
            [&](P &problem, L &) { through(problem, [] { gate.corner = square, gate.corners = 4, gate.normal[1] = 1e-3; }); });
    static const double yaws[] = {0.0, none, 1.0}, apart[] = {0.0, 1.0, 0.5}, lap[] = {0, 0, 1, 4, 1, 1.5, 0, 0, 1};
    refused(planner, "yaw at waypoint 1 is nan", [](P &problem, L &) { problem.yaws = yaws; });
    refused(planner, "ends at 0.5 rad", [](P &problem, L &) { problem.yaws = apart, problem.points = lap, problem.closed = 1; });
    static const double radii[] = {0.0, 0.3, 0.0};
    refused(planner, "a gate and a ball", [&](P &problem, L &) { through(problem, [&] { problem.radii = radii; }); });
    refused(planner, "lower and upper", [](P &problem, L &) { problem.box_lower = points; });
    refused(planner, "the box of leg 0", [](P &problem, L &) { problem.box_lower = problem.box_upper = points; });
    refused(planner, "-5 planes", [](P &problem, L &) { problem.planes = -5; });
    refused(planner, "planes have legs", [](P &problem, L &) { problem.planes = 1; });
    refused(planner, "half-width of leg 1 is 0", [](P &problem, L &) {
        static const double thin[] = {1.0, 0.0};
        problem.widths = thin;
    });
    refused(planner, "plane 0 is on leg 2", [](P &problem, L &) {
        static const std::int64_t leg[] = {2};
        problem.planes = 1, problem.plane_leg = leg, problem.plane_normal = points, problem.plane_bound = durations;
    });
    refused(planner, "normal without direction", [](P &problem, L &) {
        static const std::int64_t leg[] = {1};
        static const double zeros[3] = {};
        problem.planes = 1, problem.plane_leg = leg, problem.plane_normal = zeros, problem.plane_bound = durations;
    });
    refused(planner, "no interior", [](P &problem, L &) {
        static const std::int64_t leg[] = {0, 0};
        static const double both[] = {0, 0, 1, 0, 0, -1}, bounds[] = {0, -1};
        problem.planes = 2, problem.plane_leg = leg, problem.plane_normal = both, problem.plane_bound = bounds;
    });
    refused(planner, "outside of a wall of leg 1", [](P &problem, L &) {
        static const std::int64_t leg[] = {1};
        static const double up[] = {0, 0, 1}, low[] = {1.7};
        problem.planes = 1, problem.plane_leg = leg, problem.plane_normal = up, problem.plane_bound = low;
    });
    refused(planner, "radius of waypoint 1", [](P &problem, L &) {
        static const double radii[] = {0, -1, 0};
        problem.radii = radii;
    });
    refused(planner, "first and the last waypoint", [](P &problem, L &) {
        static const double radii[] = {1, 0, 0};
        problem.radii = radii;
    });
    refused(planner, "waypoint 2 is not finite", [](P &problem, L &) {
        static double changed[9];
        std::memcpy(changed, points, sizeof points), changed[8] = endless;
        problem.points = changed;
    });
    refused(planner, "waypoints 0 and 1 are at one place", [](P &problem, L &) {
        static double changed[9];
        std::memcpy(changed, points, sizeof points), std::memcpy(changed, points + 3, 3 * sizeof *points);
        problem.points = changed;
    });
    refused(planner, "duration of leg 0 is -1", [](P &problem, L &) {
        static const double backwards[] = {-1, 2};
        problem.durations = backwards;
    });
    refused(planner, "derivative at the end", [](P &problem, L &) {
        static const double state[9] = {none};
        problem.end = state;
    });
    refused(planner, "limits have size 0", [&](P &problem, L &limits) { within(problem, limits), limits.size = 0; });
    refused(planner, "limits are empty", [&](P &problem, L &limits) { limits = minsnap_limits_new(), within(problem, limits); });
    refused(planner, "speed is -1", [&](P &problem, L &limits) { within(problem, limits), limits.speed = -1.0; });
    refused(planner, "jerk is nan", [&](P &problem, L &limits) { within(problem, limits), limits.jerk = none; });
    refused(planner, "max_thrust is 0.9", [&](P &problem, L &limits) { within(problem, limits), limits.max_thrust = 0.9; });
    refused(planner, "tilt is 2", [&](P &problem, L &limits) { within(problem, limits), limits.tilt = 2.0; });
    refused(planner, "need three coordinates", [&](P &problem, L &limits) { within(problem, limits), problem.dim = 2, limits.tilt = 0.5; });
    refused(planner, "the degree of fewer than three coordinates is 7",
            [&](P &problem, L &limits) { within(problem, limits), problem.degree = 9, problem.dim = 2; });
}

void each_fault_of_a_vehicle_has_its_sentence(minsnap_planner *planner) {
    auto wrong_vehicle = [&](const char *part, auto change) {
        refused(planner, part, [&](minsnap_problem &problem, minsnap_limits &limits) {
            static minsnap_vehicle vehicle;
            vehicle = minsnap_vehicle_new();
            vehicle.mass = 0.5, vehicle.least = 0.1, vehicle.most = 2.5;
            for (int axis = 0; axis < 3; ++axis) vehicle.inertia[4 * axis] = 0.002;
            change(vehicle);
            problem.durations = nullptr, problem.limits = &limits, limits.vehicle = &vehicle;
        });
    };
    wrong_vehicle("vehicle has size 4", [](minsnap_vehicle &vehicle) { vehicle.size = 4; });
    wrong_vehicle("mass is 0", [](minsnap_vehicle &vehicle) { vehicle.mass = 0.0; });
    wrong_vehicle("not finite", [](minsnap_vehicle &vehicle) { vehicle.mixer[3] = none; });
    wrong_vehicle("inertia about axis 1 is -1", [](minsnap_vehicle &vehicle) { vehicle.inertia[4] = -1.0; });
    wrong_vehicle("reserve is 1", [](minsnap_vehicle &vehicle) { vehicle.reserve = 1.0; });
    wrong_vehicle("cannot hold altitude", [](minsnap_vehicle &vehicle) { vehicle.most = 1.0; });
    wrong_vehicle("drag of the vehicle is -1 and 0", [](minsnap_vehicle &vehicle) { vehicle.drag[0] = -1.0; });
    wrong_vehicle("drag of the vehicle is 0 and -1", [](minsnap_vehicle &vehicle) { vehicle.drag[1] = -1.0; });
    wrong_vehicle("drag of the vehicle", [](minsnap_vehicle &vehicle) { vehicle.drag[3] = endless; });
}

void null_pointers(minsnap_planner *planner) {
    minsnap_problem problem = good();
    minsnap_curve curve = minsnap_curve_new(), other = curve;
    minsnap_certificate proved = minsnap_certificate_new();
    double value[3] = {1, 2, 3};
    const double t = 0.5, late = 5.0;
    minsnap_planner *refused_planner = planner;
    EXPECT(minsnap_open(MINSNAP_ABI, nullptr) == MINSNAP_BAD_SIZE);
    EXPECT(minsnap_open(MINSNAP_ABI + 1, &refused_planner) == MINSNAP_UNSUPPORTED && refused_planner == planner);
    EXPECT(minsnap_plan(nullptr, &problem, &curve) == MINSNAP_BAD_SIZE && minsnap_message(nullptr)[0] != 0);
    EXPECT(minsnap_plan(planner, nullptr, &curve) == MINSNAP_BAD_SIZE && minsnap_message(planner)[0] != 0);
    EXPECT(minsnap_plan(planner, &problem, nullptr) == MINSNAP_BAD_SIZE && minsnap_message(planner)[0] != 0);
    other.size = 8;
    EXPECT(minsnap_plan(planner, &problem, &other) == MINSNAP_BAD_SIZE && other.size == 8);
    EXPECT(minsnap_certify(planner, &problem, &curve, &proved) == MINSNAP_BAD_SIZE);
    EXPECT(minsnap_certify(planner, &problem, &curve, nullptr) == MINSNAP_BAD_SIZE);
    EXPECT(minsnap_replan(planner, &problem, nullptr, 0.0, 0.1, &curve) == MINSNAP_BAD_SIZE);
    EXPECT(minsnap_brake(planner, &problem, nullptr, 0.0, &curve) == MINSNAP_BAD_SIZE && minsnap_message(planner)[0] != 0);
    EXPECT(minsnap_plan(planner, &problem, &curve) == MINSNAP_DONE && curve.legs == 2 && minsnap_message(planner)[0] == 0);
    EXPECT(minsnap_yaw_at(&curve, 0, &t, 1, value) == MINSNAP_BAD_SIZE && minsnap_yaw_at(nullptr, 0, &t, 1, value) == MINSNAP_BAD_SIZE);
    EXPECT(minsnap_certify(planner, nullptr, &curve, &proved) == MINSNAP_BAD_SIZE && proved.kept == 0);
    EXPECT(minsnap_replan(planner, nullptr, &curve, 0.0, 0.1, &other) == MINSNAP_BAD_SIZE);
    EXPECT(minsnap_at(nullptr, 0, &t, 1, value) == MINSNAP_BAD_SIZE && minsnap_at(&curve, 0, nullptr, 1, value) == MINSNAP_BAD_SIZE);
    EXPECT(minsnap_at(&curve, -1, &t, 1, value) == MINSNAP_BAD_SIZE && minsnap_at(&curve, 0, &t, -1, value) == MINSNAP_BAD_SIZE);
    EXPECT(minsnap_at(&curve, 0, &late, 1, value) == MINSNAP_BAD_NUMBER && minsnap_at(&curve, 0, &none, 1, value) == MINSNAP_BAD_NUMBER);
    EXPECT(value[0] == 1 && value[1] == 2 && value[2] == 3);
    EXPECT(minsnap_at(&curve, 0, nullptr, 0, nullptr) == MINSNAP_DONE && minsnap_at(&curve, 9, &t, 1, value) == MINSNAP_DONE &&
           value[2] == 0.0);
    EXPECT(minsnap_least_time(planner, &problem, nullptr) == MINSNAP_BAD_SIZE &&
           minsnap_least_time(planner, &problem, value) == MINSNAP_BAD_NUMBER);
    EXPECT(value[0] == 0.0 && minsnap_status_name(99) == nullptr);
    minsnap_close(nullptr);
}

void short_vectors() {
    minsnap::Planner planner;
    minsnap::Problem problem(3);
    problem.points = {0, 0, 1, 4, 1, 1.5}, problem.durations = {1, 2};
    EXPECT(planner.plan(problem).status == MINSNAP_BAD_SIZE && std::string(planner.message()).find("another length") != std::string::npos);
    problem.durations = {2}, problem.points.pop_back();
    EXPECT(planner.plan(problem).status == MINSNAP_BAD_SIZE);
}

// A generator of its own, so that every machine sees the same bytes (G. Marsaglia, "Xorshift RNGs", 2003).
struct Random {
    std::uint64_t state;
    std::uint64_t next() { return state ^= state << 13, state ^= state >> 7, state ^= state << 17; }
    std::uint64_t below(std::uint64_t most) { return next() % most; }
};

// Asked as often as its context says, then it ends the search.
std::int64_t stop_later(void *context) { return --*static_cast<int *>(context) < 0; }

// Random bytes where numbers stand, counts and pointers mostly kept so that what is read exists. Planners take turns, and go on with curves of
// each other.
void random_bytes(minsnap_planner *const planners[2], std::uint64_t seed, int rounds) {
    Random random{seed};
    const double odd[] = {0.0, -0.0, 1.0, -1.0, 1e-320, 1e-40, 1e40, 1.7e308, none, endless, -endless, 3.0, 0.3};
    for (int round = 0; round < rounds; ++round) {
        minsnap_planner *const planner = planners[round % 2], *const other = planners[(round + 1) % 2];
        double angles[4], places[12], times[3], wide[3], corners[2][9], normals[6], bounds[2], radii[4], ends[2][15];
        std::int64_t legs[2];
        const std::uint64_t rarity = std::uint64_t(12) << random.below(10);  // of odd numbers, so that rounds end in checks and in searches
        auto number = [&](double usual) {
            const std::uint64_t kind = random.below(rarity);
            double value = usual * (0.5 + double(random.below(1000)) / 1000.0);
            if (kind == 0) value = odd[random.below(sizeof odd / sizeof *odd)];
            if (kind == 1 && random.below(4) == 0) {
                const std::uint64_t bits = random.next();
                std::memcpy(&value, &bits, sizeof value);
            }
            return value;
        };
        for (int i = 0; i < 12; ++i) places[i] = number(double(i));
        for (double &value : times) value = number(2.0);
        for (double &value : wide) value = number(1.0);
        for (double &value : corners[0]) value = number(-3.0);
        for (double &value : corners[1]) value = number(15.0);
        for (double &value : normals) value = number(1.0);
        for (double &value : bounds) value = number(30.0);
        for (double &value : radii) value = number(0.3);
        for (auto &end : ends)
            for (double &value : end) value = number(0.2);
        radii[0] = radii[3] = 0.0;
        for (std::int64_t &leg : legs) leg = random.below(8) == 0 ? std::int64_t(random.next()) : std::int64_t(random.below(3));
        minsnap_problem problem = minsnap_problem_new();
        minsnap_limits limits = minsnap_limits_new();
        auto sometimes = [&](std::uint64_t most) { return random.below(most) == 0; };
        problem.dim = sometimes(2) ? 3 : 1 + std::int64_t(random.below(3)), problem.waypoints = 4, problem.points = places;
        const std::int64_t counts[] = {-1, std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min(), 0, 1 << 30};
        if (sometimes(60)) problem.dim = counts[random.below(5)];
        if (sometimes(60)) problem.waypoints = std::int64_t(random.below(4));
        problem.degree = sometimes(4) ? 3 + 2 * std::int64_t(random.below(5)) : 0;
        problem.pieces = sometimes(4) ? std::int64_t(random.below(3)) : 0;
        if (sometimes(60)) problem.pieces = counts[random.below(5)];
        if (sometimes(60)) problem.degree = counts[random.below(5)];
        if (sometimes(10)) problem.closed = 1;
        if (problem.closed == 1 && problem.dim >= 1 && problem.dim <= 3)
            std::memcpy(places + 3 * problem.dim, places, sizeof *places * std::size_t(problem.dim));
        const std::uint64_t kind = random.below(3);
        if (kind == 0) problem.durations = times;
        if (kind == 1) problem.total_time = number(8.0);
        if (kind == 2) problem.limits = &limits;
        double *const often[] = {&limits.speed, &limits.acceleration, &limits.jerk, &limits.max_thrust, &limits.tilt};
        double *const seldom[] = {&limits.snap, &limits.min_thrust, &limits.body_rate, &limits.gravity};
        const double usual[] = {3.0, 4.0, 30.0, 2.5, 0.5}, further[] = {200.0, 0.5, 3.0, 9.81};
        for (int k = 0; k < 5; ++k)
            if (!sometimes(3) && (k < 3 || problem.dim == 3)) *often[k] = number(usual[k]);
        for (int k = 0; k < 4; ++k)
            if (sometimes(6)) *seldom[k] = number(further[k]);
        minsnap_vehicle vehicle = minsnap_vehicle_new();
        vehicle.mass = number(0.5), vehicle.least = number(0.1), vehicle.most = number(2.5), vehicle.reserve = number(0.1),
        vehicle.yaw = number(1.0);
        for (double &value : vehicle.mixer) value = number(0.25);
        for (int axis = 0; axis < 3; ++axis) vehicle.inertia[4 * axis] = number(0.002);
        for (double &value : vehicle.drag) value = sometimes(2) ? 0.0 : number(0.1);
        if (sometimes(5)) limits.vehicle = &vehicle;
        if (sometimes(3)) problem.widths = wide;
        if (sometimes(3)) problem.box_lower = corners[0], problem.box_upper = corners[1];
        if (sometimes(3))
            problem.planes = std::int64_t(random.below(3)), problem.plane_leg = legs, problem.plane_normal = normals,
            problem.plane_bound = bounds;
        if (sometimes(5)) problem.radii = radii;
        minsnap_gate gates[2] = {minsnap_gate_new(), minsnap_gate_new()};
        for (minsnap_gate &gate : gates) {
            gate.waypoint = sometimes(8) ? std::int64_t(random.below(4)) : 1 + (&gate - gates),
            gate.crossing = std::int64_t(random.below(3)) - 1;
            for (double &value : gate.normal) value = number(1.0);
            for (double &value : gate.up) value = sometimes(3) ? number(1.0) : 0.0;
            gate.width = number(1.0), gate.height = sometimes(3) ? 0.0 : number(1.0), gate.margin = number(0.1);
            if (sometimes(20)) gate.corner = corners[0], gate.corners = std::int64_t(random.below(4));
        }
        if (sometimes(20)) gates[0].corners = counts[random.below(5)];
        if (sometimes(3)) problem.gates = 1 + std::int64_t(random.below(2)), problem.gate = gates;
        if (sometimes(50)) problem.gates = counts[random.below(5)];
        for (double &angle : angles) angle = number(3.0);
        if (problem.closed == 1) angles[3] = angles[0];
        if (sometimes(4)) problem.yaws = angles;
        if (sometimes(4) && (problem.closed == 0 || sometimes(8))) problem.start = ends[0];
        if (sometimes(4) && (problem.closed == 0 || sometimes(8))) problem.end = ends[1];
        problem.seconds = 0.003;
        int asked = int(random.below(40));
        if (sometimes(6)) problem.stop = stop_later, problem.context = &asked;
        minsnap_curve curve = minsnap_curve_new();
        std::int64_t *const sizes[] = {&problem.size, &limits.size, &vehicle.size, &gates[0].size, &curve.size};
        if (sometimes(40)) *sizes[random.below(5)] += random.next() >> random.below(64);
        const minsnap_status status = minsnap_plan(planner, &problem, &curve);
        EXPECT(minsnap_status_name(status) != nullptr);
        if (status != MINSNAP_DONE) EXPECT(minsnap_message(planner)[0] != 0);
        if (status != MINSNAP_DONE && status != MINSNAP_SPENT) EXPECT(curve.legs == 0 && curve.points == nullptr);
        double least = -1.0, angle = 0.0;
        const double begin = 0.0;
        if (curve.yaw != nullptr) EXPECT(minsnap_yaw_at(&curve, 0, &begin, 1, &angle) == MINSNAP_DONE && angle == angles[0]);
        if (minsnap_least_time(planner, &problem, &least) == MINSNAP_DONE)
            EXPECT(least > 0.0 && (status != MINSNAP_DONE || least <= curve.duration));
        else
            EXPECT(least == -1.0 && minsnap_message(planner)[0] != 0);
        if (curve.legs == 0) continue;
        minsnap_certificate proved = minsnap_certificate_new();
        EXPECT(minsnap_certify(other, &problem, &curve, &proved) == MINSNAP_DONE && proved.kept == 1);
        minsnap_curve again = minsnap_curve_new();
        const double now = number(0.1);
        if (problem.limits == nullptr) continue;
        minsnap_brake(other, &problem, &curve, now, &again);
        minsnap_replan(other, &problem, &curve, now, number(0.003), &again);
        minsnap_replan(planner, &problem, &curve, now, number(0.003), &curve);
    }
}

// The bytes of a curve that is not a planner's: what is not a curve is refused, and nothing else is said of it.
void random_curves(minsnap_planner *planner, std::uint64_t seed, int rounds) {
    Random random{seed};
    minsnap_problem problem = good();
    for (int round = 0; round < rounds; ++round) {
        double values[2 * 8 * 3], times[2] = {2.0, 2.0}, breaks[3] = {0.0, 2.0, 4.0}, value[3];
        for (double &one : values) {
            const std::uint64_t bits = random.next();
            if (random.below(3) == 0)
                std::memcpy(&one, &bits, sizeof one);
            else
                one = double(random.below(100)) - 50.0;
        }
        minsnap_curve curve = minsnap_curve_new();
        curve.legs = 2, curve.pieces = 1, curve.degree = 7, curve.dim = 3, curve.points = values, curve.durations = times,
        curve.breaks = breaks;
        std::int64_t *const counts[] = {&curve.size, &curve.legs, &curve.pieces, &curve.degree, &curve.dim};
        if (random.below(3) == 0) *counts[random.below(5)] = std::int64_t(random.next()) | (std::int64_t(1) << 40);
        minsnap_certificate proved = minsnap_certificate_new();
        const minsnap_status status = minsnap_certify(planner, &problem, &curve, &proved);
        EXPECT(status != MINSNAP_DONE || proved.kept == 0);
        if (status != MINSNAP_DONE) EXPECT(minsnap_message(planner)[0] != 0 && proved.speed == 0.0);
        const double t = double(random.below(5));
        minsnap_at(&curve, std::int64_t(random.below(12)), &t, 1, value);
    }
}

}  // namespace

// bad_input [digests [seed [rounds]]]
int main(int count, char **arguments) {
    const std::uint64_t seed = count > 2 ? std::strtoull(arguments[2], nullptr, 10) : 60;
    const int rounds = count > 3 ? std::atoi(arguments[3]) : 1000;
    minsnap_planner *planners[2] = {};
    for (minsnap_planner *&each : planners) EXPECT(minsnap_open(MINSNAP_ABI, &each) == MINSNAP_DONE);
    minsnap_planner *const planner = planners[0];
    each_fault_has_its_sentence(planner);
    each_fault_of_a_vehicle_has_its_sentence(planner);
    null_pointers(planner);
    short_vectors();
    random_bytes(planners, seed + 1, rounds);
    random_curves(planner, seed + 2, rounds);
    for (minsnap_planner *each : planners) minsnap_close(each);
    return wrong != 0;
}

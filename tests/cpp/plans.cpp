// Plans of all kinds, and digests of all their bits, which a file holds beside them: Python's plans have the same.
#include <cstdio>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <string>

#include "expect.hpp"
#include "problems.hpp"

namespace {

// Of the bits of durations, then of control points, and of those of a heading (Fowler, Noll and Vo, FNV-1a).
std::uint64_t digest(const minsnap::Curve &curve) {
    std::uint64_t hash = 14695981039346656037ULL;
    for (const std::vector<double> *values : {&curve.durations(), &curve.points(), &curve.yaw_points()})
        for (const double value : *values) {
            const double own = value == 0.0 ? 0.0 : value;  // of either sign
            unsigned char bytes[sizeof own];
            std::memcpy(bytes, &own, sizeof own);
            for (const unsigned char byte : bytes) hash = (hash ^ byte) * 1099511628211ULL;
        }
    return hash;
}

minsnap::Problem line() {
    minsnap::Problem problem(3);
    problem.points = {0, 0, 1, 4, 1, 1.5, 7, -1, 2};
    return problem;
}

// An opening of 1.2 m by 0.8 m.
minsnap::Gate gate(std::int64_t waypoint, double x, double y, double z, std::int64_t crossing = 0) {
    minsnap::Gate made;
    made.waypoint = waypoint, made.normal[0] = x, made.normal[1] = y, made.normal[2] = z;
    made.width = 1.2, made.height = 0.8, made.margin = 0.1, made.crossing = crossing;
    return made;
}

std::map<std::string, minsnap::Problem> problems() {
    std::map<std::string, minsnap::Problem> all;
    minsnap::Limits limits = usual();

    minsnap::Problem problem = rectangle();
    problem.durations = {4, 2, 4, 2};
    all.emplace("durations", problem);
    problem.widths = {0.3, 0.3, 0.3, 0.3};
    all.emplace("tube", problem);
    problem.pieces = 2;
    all.emplace("tube of two pieces a leg", problem);

    problem = rectangle(), problem.total_time = 12.0;
    all.emplace("total", problem);
    problem.widths = {0.3, 0.3, 0.3, 0.3};
    all.emplace("total in a tube", problem);

    problem = rectangle(), problem.closed = true, problem.durations = {4, 2, 4, 2};
    all.emplace("lap", problem);
    problem.durations.clear(), problem.total_time = 12.0, problem.widths = {0.5, 0.5, 0.5, 0.5};
    all.emplace("lap in a tube, total", problem);

    problem = rectangle(), problem.degree = 9, problem.durations = {4, 2, 4, 2}, problem.widths = {0.5, 0.5, 0.5, 0.5};
    all.emplace("degree 9", problem);

    problem = line(), problem.durations = {2, 2}, problem.start = {1, 0, 0, 0, 0.5, 0, 0, 0, 0};
    all.emplace("moving start", problem);
    problem.durations.clear(), problem.total_time = 4.0, problem.radii = {0, 0.3, 0};
    all.emplace("moving start, total and a ball", problem);
    problem.durations = {2, 2}, problem.total_time = 0.0, problem.radii.clear();
    problem.widths = {0.6, 0.6};
    all.emplace("moving start in a tube", problem);

    problem = line(), problem.durations = {2, 2}, problem.box_lower = {-1, -1, 0, 3, -2, 0}, problem.box_upper = {5, 1.02, 3, 8, 1.02, 3};
    all.emplace("boxes", problem);
    problem.radii = {0, 0.4, 0};
    all.emplace("boxes and a ball", problem);

    problem = line(), problem.durations = {2, 2};
    for (std::int64_t leg = 0; leg < 2; ++leg)
        for (const auto &side : {std::vector<double>{1, 1, 0}, {-1, 1, 0}, {0, -1, 0.5}, {0, 0, 1}, {0, 0, -2}, {1, 0, 0}, {-1, 0, 0}})
            problem.add_plane(leg, side, 8.5);
    problem.add_plane(0, {0, 1, 0}, 1.03);
    all.emplace("polytopes", problem);

    problem = rectangle(), problem.pieces = 1, problem.within(limits);
    all.emplace("limits, one piece", problem);
    problem.pieces = 0;
    all.emplace("limits", problem);
    problem.widths = {0.3, 0.3, 0.3, 0.3};
    all.emplace("limits in a tube", problem);

    problem = line(), problem.within(limits), problem.radii = {0, 0.3, 0};
    all.emplace("limits and a ball", problem);
    problem = line(), problem.within(limits), problem.start = {1, 0, 0, 0, 0, 0, 0, 0, 0};
    all.emplace("limits from a moving start", problem);
    problem = line(), problem.within(limits), problem.box_lower = {-1, -1, 0, 3, -2, 0}, problem.box_upper = {5, 1.02, 3, 8, 1.02, 3};
    all.emplace("limits in boxes", problem);

    limits = minsnap::Limits(), limits.max_thrust = 1.6, limits.min_thrust = 0.5, limits.tilt = 0.5, limits.speed = 4.0, limits.jerk = 30.0;
    problem = rectangle(), problem.within(limits);
    all.emplace("thrust and tilt", problem);
    limits.body_rate = 3.0;
    problem.within(limits);
    all.emplace("thrust, tilt and body rate", problem);

    problem = line(), problem.within(usual()), problem.pieces = 6;
    all.emplace("limits, six pieces", problem);
    problem.pieces = 0, problem.degree = 5;
    all.emplace("limits, degree 5", problem);
    problem = rectangle(), problem.within(usual()), problem.degree = 9, problem.widths = {0.4, 0.4, 0.4, 0.4};
    all.emplace("limits, degree 9, in a tube", problem);

    problem = rectangle(), problem.durations = {4, 2, 4, 2}, problem.yaws = {0, 1.5, 3.2, -1.6, 7};
    all.emplace("yaws", problem);
    problem.durations.clear(), problem.within(usual()), problem.closed = true, problem.yaws = {0.1, 1, 5, -3, 0.1};
    all.emplace("lap within limits with yaws", problem);

    problem = line(), problem.durations = {2, 2}, problem.gates = {gate(1, 1, 0, 0)};
    all.emplace("gate", problem);
    problem.gates[0] = gate(1, 3, -4, 0, 1), problem.durations.clear(), problem.total_time = 4.0;
    all.emplace("slanted gate, total", problem);
    static const double triangle[] = {4, 0, 1, 4, 2, 1, 4, 1, 2.5};
    problem.gates[0] = gate(1, 1, 0, 0), problem.gates[0].corner = triangle, problem.gates[0].corners = 3;
    all.emplace("gate of three corners, total", problem);
    problem = rectangle(), problem.gates = {gate(3, -1, 0, 1), gate(1, 1, 1, 0), gate(2, 0, 0, 1, -1)}, problem.radii = {0, 0, 0, 0, 0};
    problem.within(usual());
    all.emplace("gates within limits", problem);
    problem.pieces = 1, problem.gates = {gate(0, 0, -1, 0, -1), gate(2, 0, 3, 4)}, problem.closed = true, problem.radii = {0, 0.3, 0, 0.3, 0};
    all.emplace("lap of gates and balls within limits", problem);
    problem.within(minsnap::Limits()), problem.limited = false, problem.total_time = 12.0;
    all.emplace("lap of gates and balls, total", problem);

    problem = minsnap::Problem(2), problem.points = {0, 0, 5, 0, 5, 3}, problem.within(usual());
    all.emplace("limits in the plane", problem);
    return all;
}

// A vehicle that goes on in flight along what was planned anew, from bit to bit where it changes over.
void replans() {
    minsnap::Planner planner;
    minsnap::Problem problem = rectangle();
    problem.within(usual()), problem.widths = {0.5, 0.5, 0.5, 0.5};
    const minsnap::Plan first = planner.plan(problem);
    EXPECT(first.status == MINSNAP_DONE);
    const double now = 0.4, budget = 5.0;  // more than any machine needs: it lasts as long as the first leg
    minsnap::Problem ahead = problem;
    ahead.points[3] = 8.5, ahead.points[6] = 8.5;
    const double splice = 0.4 + 0.1;
    (void)now, (void)budget;
    const minsnap::Plan next = planner.replan(ahead, first.curve, 0.4, 0.1);
    EXPECT(next.status == MINSNAP_DONE || next.status == MINSNAP_SPENT || next.curve.empty());
    if (next.status == MINSNAP_DONE)
        for (std::int64_t order = 0; order < 4; ++order) {
            const std::vector<double> old = first.curve(splice, order), fresh = next.curve(0.0, order);
            for (int d = 0; d < 3; ++d) EXPECT(std::abs(old[d] - fresh[d]) <= 1e-6);
        }
    for (const double instant : {0.4, 1.5, 3.0}) {
        const minsnap::Plan rest = planner.brake(problem, first.curve, instant);
        EXPECT(rest.status == MINSNAP_DONE && rest.curve.duration() < 4.0);
        for (std::int64_t order = 0; order < 4 && rest.status == MINSNAP_DONE; ++order) {
            const std::vector<double> old = first.curve(instant, order), fresh = rest.curve(0.0, order),
                                      end = rest.curve(rest.curve.duration(), order);
            for (int d = 0; d < 3; ++d) EXPECT(std::abs(old[d] - fresh[d]) <= 1e-6 && (order == 0 || std::abs(end[d]) <= 1e-6));
        }
        for (int k = 0; k <= 100; ++k) {
            const double t = rest.curve.duration() * k / 100;
            const std::vector<double> speed = rest.curve(t, 1), place = rest.curve(t);
            EXPECT(std::hypot(speed[0], speed[1], speed[2]) <= 3.0 + 1e-6 && place[1] >= -0.5 - 1e-9 &&
                   (place[1] <= 0.5 + 1e-9 || place[0] >= 7.5 - 1e-9));
        }
    }
    EXPECT(planner.brake(problem, first.curve, -1.0).status == MINSNAP_BAD_NUMBER);
    EXPECT(planner.replan(ahead, first.curve, first.curve.duration(), 0.1).status == MINSNAP_BAD_NUMBER);
}

// What goes on in flight is planned as what begins there, to the bit: also from far past the first waypoint, and where one start is not enough.
void replans_are_plans_from_the_state() {
    minsnap::Planner planner;
    minsnap::Problem problem = rectangle();
    problem.within(usual());
    const minsnap::Plan first = planner.plan(problem);
    const double instant = 2.0;
    minsnap::Problem moving = problem, close = problem;
    moving.end = {0, 1, 0, 0, 0, 0, 0, 0, 0};
    close.points[6] = 8.0, close.points[7] = 0.3;
    for (const minsnap::Problem &ahead : {problem, moving, close}) {
        minsnap::Problem there = ahead;
        there.start.clear();
        for (std::int64_t order = 0; order < 4; ++order) {
            const std::vector<double> state = first.curve(instant, order);
            if (order == 0)
                std::copy(state.begin(), state.end(), there.points.begin());
            else
                there.start.insert(there.start.end(), state.begin(), state.end());
        }
        const minsnap::Plan next = planner.replan(ahead, first.curve, 0.0, instant), own = planner.plan(there);
        EXPECT(own.status == MINSNAP_DONE && next.status == MINSNAP_DONE && digest(next.curve) == digest(own.curve));
    }
}

// Rotors keep their range: 0.5 kg with four rotors of 0.15 to 2.6 N on arms of 0.12 m.
void rotors() {
    minsnap::Vehicle vehicle;
    vehicle.mass = 0.5, vehicle.least = 0.15, vehicle.most = 2.6, vehicle.reserve = 0.1;
    vehicle.inertia[0] = 0.0021, vehicle.inertia[4] = 0.0023, vehicle.inertia[8] = 0.004;
    const double across = 0.25 / (0.12 * std::sqrt(0.5)), about = 0.25 / 0.015;
    const double signs[4][3] = {{1, -1, 1}, {1, 1, -1}, {-1, 1, 1}, {-1, -1, -1}};
    for (int rotor = 0; rotor < 4; ++rotor) {
        vehicle.mixer[4 * rotor] = 0.25;
        for (int axis = 0; axis < 3; ++axis) vehicle.mixer[4 * rotor + 1 + axis] = signs[rotor][axis] * (axis < 2 ? across : about);
    }
    minsnap::Limits limits;
    limits.vehicle = &vehicle, limits.speed = 6.0, limits.jerk = 60.0;
    minsnap::Planner planner;
    minsnap::Problem problem = rectangle();
    problem.within(limits);
    const minsnap::Plan plan = planner.plan(problem);
    EXPECT(plan.status == MINSNAP_DONE);
    EXPECT(planner.certify(problem, plan.curve).kept == 1);
    vehicle.most = 2.2;
    EXPECT(planner.certify(problem, plan.curve).kept == 0 && std::string(planner.message()) == "the curve exceeds a limit");
    const minsnap::Plan slower = planner.plan(problem);
    EXPECT(slower.status == MINSNAP_DONE && slower.curve.duration() > plan.curve.duration());
    vehicle.drag[0] = 0.3;
    EXPECT(planner.certify(problem, slower.curve).kept == 0);
    const minsnap::Plan dragged = planner.plan(problem);
    EXPECT(dragged.status == MINSNAP_DONE && planner.certify(problem, dragged.curve).kept == 1);
}

// A heading goes on in flight, and is where it was asked for at the waypoints.
void headings() {
    minsnap::Planner planner;
    minsnap::Problem problem = rectangle();
    problem.within(usual()), problem.yaws = {0, 1.5, 3, -1.5, 0};
    const minsnap::Plan first = planner.plan(problem), next = planner.replan(problem, first.curve, 0.4, 1.0);
    EXPECT(first.status == MINSNAP_DONE && next.status == MINSNAP_DONE);
    EXPECT(std::abs(first.curve.yaw(0.0)) < 1e-12 && std::abs(first.curve.yaw(first.curve.duration(), 1)) < 1e-9);
    for (std::int64_t order = 0; order < 2; ++order)
        EXPECT(std::abs(first.curve.yaw(1.4, order) - next.curve.yaw(0.0, order)) < 1e-9);
    EXPECT(std::abs(std::remainder(next.curve.yaw(next.curve.duration()), 2.0 * std::acos(-1.0))) < 1e-9);
    problem.yaws.clear();
    EXPECT(std::isnan(planner.plan(problem).curve.yaw(0.5)));
}

// A search that is ended gives the best curve there is, or none, and says so.
void stops() {
    minsnap::Planner planner;
    minsnap::Problem problem = rectangle();
    problem.within(usual());
    problem.stop = [] { return true; };
    const minsnap::Plan plan = planner.plan(problem);
    EXPECT(plan.status == MINSNAP_SPENT && !plan.curve.empty() && planner.message()[0] != 0);
    EXPECT(planner.certify(problem, plan.curve).kept == 1);
}

void certifies() {
    minsnap::Planner planner;
    minsnap::Problem problem = rectangle();
    problem.durations = {4, 2, 4, 2};
    const minsnap::Plan plan = planner.plan(problem);
    minsnap_certificate proved = planner.certify(problem, plan.curve);
    EXPECT(proved.kept == 1 && proved.continuity >= 3 && proved.waypoints == 0.0 &&
           proved.margin == std::numeric_limits<double>::infinity());
    problem.widths = {0.3, 0.3, 0.3, 0.3};
    proved = planner.certify(problem, plan.curve);
    EXPECT(proved.size > 0 && proved.kept == 0 && proved.margin < 0.0 && std::string(planner.message()) == "the curve leaves its walls");
    problem.widths.clear(), problem.durations = {4, 2, 4, 3};
    EXPECT(planner.certify(problem, plan.curve).kept == 0 &&
           std::string(planner.message()) == "the curve has other times than were asked for");
}

}  // namespace

// plans digests.txt: compare; plans: print digests of all.
int main(int count, char **arguments) {
    std::map<std::string, std::string> known;
    if (count > 1) {
        std::ifstream file(arguments[1]);
        for (std::string digits, name; file >> digits && std::getline(file >> std::ws, name);) known[name] = digits;
        EXPECT(!known.empty());
    }
    minsnap::Planner planner;
    EXPECT(static_cast<bool>(planner));
    for (const auto &[name, problem] : problems()) {
        const minsnap::Plan plan = planner.plan(problem);
        if (plan.status != MINSNAP_DONE)
            ++wrong, std::printf("%s: %s: %s\n", name.c_str(), minsnap_status_name(plan.status), planner.message());
        char digits[17];
        std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(digest(plan.curve)));
        if (count < 2) std::printf("%s %s\n", digits, name.c_str());
        if (count > 1 && known[name] != digits) ++wrong, std::printf("%s: %s, not %s\n", name.c_str(), digits, known[name].c_str());
        EXPECT(planner.certify(problem, plan.curve).kept == 1);
        if (const double least = planner.least_time(problem); problem.limited)
            EXPECT(least > 0.5 * plan.curve.duration() && least <= plan.curve.duration());
    }
    replans();
    replans_are_plans_from_the_state();
    rotors();
    headings();
    stops();
    certifies();
    return wrong;
}

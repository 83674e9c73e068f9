// A lap through four gates within thrust and body rate, the nose to the next one: its time, what is proved of it, and how long every flight takes at least.
#include <cstdio>
#include <minsnap.hpp>

int main() {
    minsnap::Planner planner;
    minsnap::Limits limits;
    limits.max_thrust = 2.0, limits.min_thrust = 0.3, limits.body_rate = 5.0;
    minsnap::Problem lap(3);
    lap.closed = true, lap.within(limits);
    lap.points = {0, 0, 1.5, 6, 2, 1.5, 5, 7, 2.5, -1, 6, 1.5, 0, 0, 1.5};
    lap.yaws = {0.0, 1.0, 2.6, 4.4, 6.283185307179586};
    const double normals[4][2] = {{1, 0}, {1, 1}, {-1, 1}, {-1, -1}};
    for (int k = 0; k < 4; ++k) {
        minsnap::Gate gate;
        gate.waypoint = k, gate.normal[0] = normals[k][0], gate.normal[1] = normals[k][1];
        gate.width = 1.4, gate.margin = 0.25, gate.crossing = 1;
        lap.gates.push_back(gate);
    }
    const minsnap::Plan plan = planner.plan(lap);
    if (plan.status != MINSNAP_DONE) return std::puts(planner.message()), 1;
    const minsnap_certificate proved = planner.certify(lap, plan.curve);
    std::printf("a lap of %.3f s, and none takes less than %.3f s; thrust at most %.3f of the weight, body rate %.3f rad/s\n",
                plan.curve.duration(), planner.least_time(lap), proved.thrust, proved.body_rate);
    return proved.kept == 1 ? 0 : 1;
}

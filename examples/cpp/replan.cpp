// A vehicle that follows a goal which moves: a new plan every half a second, from where the vehicle will be when it is there.
#include <cmath>
#include <cstdio>
#include <minsnap.hpp>

int main() {
    minsnap::Planner planner;
    minsnap::Limits limits;
    limits.speed = 4.0, limits.acceleration = 6.0, limits.jerk = 40.0;
    minsnap::Problem problem(3);
    problem.points = {0, 0, 1, 6, 0, 1};
    problem.within(limits);
    minsnap::Curve flown = planner.plan(problem).curve;
    const double budget = 0.05;  // [s]
    double now = 0.4;            // on the clock of the curve that is flown
    for (int step = 1; step <= 8 && now + budget < flown.duration(); ++step) {
        problem.points[4] = std::sin(0.3 * step), problem.points[5] = 1.0 + 0.1 * step;
        const minsnap::Plan next = planner.replan(problem, flown, now, budget);
        std::printf("step %d: %s%s\n", step, next.status == MINSNAP_DONE ? "a new plan" : "the old plan: ", planner.message());
        if (next.status == MINSNAP_DONE) flown = next.curve, now = -budget;
        now += budget + 0.45;
    }
    const auto goal = flown(flown.duration());
    std::printf("at rest at %.3f %.3f %.3f\n", goal[0], goal[1], goal[2]);
}

// A rectangle in the shortest time within limits, in a tube of 0.3 m, to 20 setpoints a second on standard output.
#include <cstdio>
#include <minsnap.hpp>

int main() {
    minsnap::Planner planner;
    minsnap::Limits limits;
    limits.speed = 3.0, limits.acceleration = 5.0, limits.jerk = 30.0;
    minsnap::Problem problem(3);
    problem.points = {0, 0, 1, 8, 0, 1, 8, 4, 1, 0, 4, 1, 0, 0, 1};
    problem.widths = {0.3, 0.3, 0.3, 0.3};
    problem.within(limits);
    const minsnap::Plan plan = planner.plan(problem);
    if (plan.status != MINSNAP_DONE) return std::puts(planner.message()), 1;
    std::puts("t,x,y,z");
    for (int k = 0; k / 20.0 < plan.curve.duration(); ++k) {
        const auto r = plan.curve(k / 20.0);
        std::printf("%.17g,%.17g,%.17g,%.17g\n", k / 20.0, r[0], r[1], r[2]);
    }
}

// Two polytopes around a corner, given durations, and the proof that the curve stays inside them at every instant.
#include <cstdio>
#include <minsnap.hpp>

int main() {
    minsnap::Planner planner;
    minsnap::Problem problem(3);
    problem.points = {0, 0, 1, 5, 0, 1, 5, 4, 1.5};
    problem.durations = {2.5, 2.5};
    for (std::int64_t leg = 0; leg < 2; ++leg) {
        problem.add_plane(leg, {0, 0, 1}, 2.0);
        problem.add_plane(leg, {0, 0, -1}, -0.5);
        problem.add_plane(leg, {0, -1, 0}, 0.5);
        problem.add_plane(leg, {1, 0, 0}, 5.4);
    }
    problem.add_plane(0, {0, 1, 0}, 0.5);
    problem.add_plane(1, {-1, -1, 0}, -4.5);
    const minsnap::Plan plan = planner.plan(problem);
    if (plan.status != MINSNAP_DONE) return std::puts(planner.message()), 1;
    const minsnap_certificate proved = planner.certify(problem, plan.curve);
    std::printf("inside by %.3g m at every instant, no faster than %.3f m/s, thrust at most %.3f of the weight\n", proved.margin,
                proved.speed, proved.thrust);
    return proved.kept == 1 ? 0 : 1;
}

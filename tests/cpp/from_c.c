/* A program in C, written from the header alone. */
#include <minsnap.h>
#include <stdio.h>

int main(void) {
    const double points[] = {0, 0, 1, 8, 0, 1, 8, 4, 1, 0, 4, 1, 0, 0, 1}, widths[] = {0.3, 0.3, 0.3, 0.3}, t[] = {0.0, 6.0, 12.0};
    double position[9];
    minsnap_planner *planner = NULL;
    minsnap_problem problem = minsnap_problem_new();
    minsnap_curve curve = minsnap_curve_new();
    minsnap_certificate proved = minsnap_certificate_new();
    if (minsnap_open(MINSNAP_ABI, &planner) != MINSNAP_DONE) return 1;
    problem.dim = 3, problem.waypoints = 5, problem.points = points, problem.total_time = 12.0, problem.widths = widths;
    if (minsnap_plan(planner, &problem, &curve) != MINSNAP_DONE) return puts(minsnap_message(planner)), 1;
    if (minsnap_certify(planner, &problem, &curve, &proved) != MINSNAP_DONE || !proved.kept || !(proved.margin >= 0.0))
        return puts("not certified"), 1;
    if (minsnap_at(&curve, 0, t, 3, position) != MINSNAP_DONE || position[8] != 1.0 || strcmp(minsnap_version(), MINSNAP_VERSION) != 0)
        return puts("not evaluated"), 1;
    printf("%lld legs in %.9g s at cost %.9g, %.3g m inside\n", (long long)curve.legs, curve.duration, curve.cost, proved.margin);
    minsnap_close(planner);
    return 0;
}

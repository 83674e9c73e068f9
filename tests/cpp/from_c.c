/* A program in C, written from the header alone: a certified rectangle, then a new plan in flight, and digests of their bits. */
#include <minsnap.h>
#include <stdio.h>

/* Of the bits of durations, then of control points, as plans.cpp has it. */
static unsigned long long digest(const minsnap_curve *curve) {
    const int64_t pieces = curve->legs * curve->pieces, counts[] = {pieces, pieces * (curve->degree + 1) * curve->dim};
    const double *const arrays[] = {curve->durations, curve->points};
    unsigned long long hash = 14695981039346656037ULL;
    for (int k = 0; k < 2; ++k)
        for (int64_t i = 0; i < counts[k]; ++i) {
            unsigned char bytes[sizeof(double)];
            const double value = arrays[k][i] == 0.0 ? 0.0 : arrays[k][i];
            memcpy(bytes, &value, sizeof bytes);
            for (size_t j = 0; j < sizeof bytes; ++j) hash = (hash ^ bytes[j]) * 1099511628211ULL;
        }
    return hash;
}

int main(void) {
    const double points[] = {0, 0, 1, 8, 0, 1, 8, 4, 1, 0, 4, 1, 0, 0, 1}, widths[] = {0.3, 0.3, 0.3, 0.3}, t[] = {0.0, 6.0, 12.0};
    double position[9];
    minsnap_planner *planner = NULL;
    minsnap_problem problem = minsnap_problem_new();
    minsnap_limits limits = minsnap_limits_new();
    minsnap_curve curve = minsnap_curve_new();
    minsnap_certificate proved = minsnap_certificate_new();
    if (minsnap_open(MINSNAP_ABI, &planner) != MINSNAP_DONE) return 1;
    problem.dim = 3, problem.waypoints = 5, problem.points = points, problem.total_time = 12.0, problem.widths = widths;
    if (minsnap_plan(planner, &problem, &curve) != MINSNAP_DONE) return puts(minsnap_message(planner)), 1;
    if (minsnap_certify(planner, &problem, &curve, &proved) != MINSNAP_DONE || !proved.kept || !(proved.margin >= 0.0))
        return puts("not certified"), 1;
    if (minsnap_at(&curve, 0, t, 3, position) != MINSNAP_DONE || position[8] != 1.0 || strcmp(minsnap_version(), MINSNAP_VERSION) != 0)
        return puts("not evaluated"), 1;
    printf("%lld legs in %.9g s at cost %.9g, %.3g m inside, %016llx\n", (long long)curve.legs, curve.duration, curve.cost, proved.margin,
           digest(&curve));
    limits.speed = 6.0, limits.acceleration = 12.0, limits.jerk = 80.0;
    problem.total_time = 0.0, problem.limits = &limits, problem.pieces = 1;
    if (minsnap_replan(planner, &problem, &curve, 0.5, 0.5, &curve) == MINSNAP_DONE)
        printf("planned anew: %.9g s, %016llx\n", curve.duration, digest(&curve));
    else /* on a machine that is too busy */
        puts(minsnap_message(planner));
    minsnap_close(planner);
    return 0;
}

/* What the page asks of the core: one row of numbers in, one out. It knows the public header alone. */
#include <math.h>
#include <minsnap.h>

#define SHOWN(name) __attribute__((export_name(#name))) name

enum { ROOM = 1 << 16, MOST = 200 };

static double room[ROOM];
static double points[3 * MOST], widths[MOST];
static minsnap_planner *planner;
static minsnap_curve curve;
static minsnap_problem problem;
static minsnap_limits limits;

double *SHOWN(play_room)(void) { return room; }
const char *SHOWN(play_message)(void) { return minsnap_message(planner); }
const char *SHOWN(play_version)(void) { return minsnap_version(); }

/* In: waypoints, pieces (0 chosen), total time (0 within limits), half-width (0 none), speed, acceleration, jerk, max_thrust, tilt, body_rate,
 * then x, y, z of each waypoint. Out: legs, pieces of each, duration, cost, kept, margin, speed, acceleration, jerk, thrust, tilt, body rate. */
int SHOWN(play_plan)(void) {
    const int count = room[0] >= 0 && room[0] <= MOST ? (int)room[0] : 0;
    minsnap_certificate proved = minsnap_certificate_new();
    if (planner == NULL && minsnap_open(MINSNAP_ABI, &planner) != MINSNAP_DONE) return MINSNAP_NO_MEMORY;
    curve = minsnap_curve_new(), problem = minsnap_problem_new(), limits = minsnap_limits_new();
    problem.dim = 3, problem.waypoints = count, problem.points = points, problem.pieces = (int64_t)room[1];
    for (int i = 0; i < count; ++i) widths[i] = room[3];
    for (int i = 0; i < 3 * count; ++i) points[i] = room[10 + i];
    if (room[3] != 0.0) problem.widths = widths;
    limits.speed = room[4], limits.acceleration = room[5], limits.jerk = room[6];
    limits.max_thrust = room[7], limits.tilt = room[8], limits.body_rate = room[9];
    if (room[2] != 0.0)
        problem.total_time = room[2];
    else
        problem.limits = &limits;
    const int status = minsnap_plan(planner, &problem, &curve);
    if (curve.legs == 0) return status == MINSNAP_DONE ? MINSNAP_NO_PROGRESS : status;
    if (minsnap_certify(planner, &problem, &curve, &proved) != MINSNAP_DONE) return MINSNAP_NOT_PROVED;
    const double found[] = {(double)curve.legs, (double)curve.pieces, curve.duration,      curve.cost,   (double)proved.kept, proved.margin,
                            proved.speed,       proved.acceleration,  proved.jerk,         proved.thrust, proved.tilt,        proved.body_rate};
    memcpy(room, found, sizeof found);
    return status;
}

/* The time that every flight of the last question takes at least [s]; 0 where none is known. */
double SHOWN(play_least)(void) {
    double least = 0.0;
    if (planner != NULL && problem.limits != NULL) minsnap_least_time(planner, &problem, &least);
    return least;
}

/* The last curve: how many durations, which come first, then control points (pieces, 8, 3); 0 where there is no room. */
int SHOWN(play_curve)(void) {
    const int64_t count = curve.legs * curve.pieces, numbers = count * (curve.degree + 1) * 3;
    if (count < 1 || count + numbers > ROOM) return 0;
    memcpy(room, curve.durations, (size_t)count * sizeof(double));
    memcpy(room + count, curve.points, (size_t)numbers * sizeof(double));
    return (int)count;
}

/* The last curve at so many instants, first and last included: rows of t, position, velocity, acceleration, jerk. */
int SHOWN(play_sample)(int count) {
    if (curve.legs == 0 || count < 2 || count > ROOM / 13) return MINSNAP_BAD_SIZE;
    for (int i = 0; i < count; ++i) {
        double *const row = room + 13 * i;
        row[0] = i + 1 == count ? curve.duration : curve.duration * i / (count - 1);
        for (int order = 0; order < 4; ++order) {
            const int status = minsnap_at(&curve, order, row, 1, row + 1 + 3 * order);
            if (status != MINSNAP_DONE) return status;
        }
    }
    return MINSNAP_DONE;
}

/* The last curve so many times a second, from a row on, as many rows as there is room for, up to its end: their number. */
int SHOWN(play_rows)(double rate, int first) {
    int count = 0;
    for (; curve.legs > 0 && rate > 0.0 && count < ROOM / 13 && (first + count) / rate <= curve.duration; ++count) {
        double *const row = room + 13 * count;
        row[0] = (first + count) / rate;
        for (int order = 0; order < 4; ++order)
            if (minsnap_at(&curve, order, row, 1, row + 1 + 3 * order) != MINSNAP_DONE) return 0;
    }
    return count;
}

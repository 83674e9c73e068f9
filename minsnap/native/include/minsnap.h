/* Curves of minimum snap through waypoints, certified inside corridors and limits at every instant.
 *
 *     minsnap_planner *planner;
 *     minsnap_curve curve = minsnap_curve_new();
 *     minsnap_problem problem = minsnap_problem_new();
 *     problem.points = points, problem.waypoints = 5, problem.dim = 3, problem.total_time = 12.0;
 *     if (minsnap_open(MINSNAP_ABI, &planner) == MINSNAP_DONE && minsnap_plan(planner, &problem, &curve) == MINSNAP_DONE) ...
 *     minsnap_close(planner);
 *
 * SI units, z up; times in seconds from 0. Arrays are contiguous, belong to the caller, and have the shape that stands beside them; a pointer
 * that may be null says so. What is zero was not given. Nothing is kept between calls but what a planner has; planners of their own may be used
 * in threads of their own. Functions return a status, and minsnap_message says in a sentence what was wrong. A call that ends with a status
 * other than MINSNAP_DONE and MINSNAP_SPENT writes nothing.
 *
 * Floating point must round as IEEE 754 says (no -ffast-math in the library), then results have the same bits on every machine.
 */
#ifndef MINSNAP_H
#define MINSNAP_H

#include <stdint.h>
#include <string.h>

#define MINSNAP_VERSION "0.2.0"
#define MINSNAP_ABI 23 /* of the library's entry points; raised with ABI of library.py whenever one changes its arguments or its meaning */

#ifdef __cplusplus
extern "C" {
#endif

typedef int32_t minsnap_status;

enum {
    MINSNAP_DONE = 0,        /* the answer is there */
    MINSNAP_BAD_SIZE = 1,    /* a pointer is null, a count is out of its range, or a struct is of another version */
    MINSNAP_BAD_NUMBER = 2,  /* a number is not finite, not positive where it must be, or contradicts another */
    MINSNAP_NO_MEMORY = 3,   /* an allocation was refused */
    MINSNAP_UNSUPPORTED = 4, /* well formed, but not done by the library */
    MINSNAP_SINGULAR = 5,    /* a pivot is not positive to working precision */
    MINSNAP_NOT_PROVED = 6,  /* a curve was found, and not proved to keep what was asked for */
    MINSNAP_INFEASIBLE = 7,  /* no curve seems to keep the walls in these times */
    MINSNAP_NO_PROGRESS = 8, /* the search ended without a curve */
    MINSNAP_SPENT = 9        /* time, work or the caller ended the search: the best curve so far is there where it has pieces */
};

/* A quadrotor whose rotors keep their range of thrust, at a constant heading. Body axes forward, left, up. */
typedef struct minsnap_vehicle {
    int64_t size;       /* sizeof(minsnap_vehicle), as minsnap_vehicle_new sets it */
    double mass;        /* [kg] */
    double inertia[9];  /* (3, 3) [kg m^2] */
    double mixer[16];   /* (4, 4) the thrusts of the rotors [N], from their sum [N] and the torques about the body's axes [N m] */
    double least, most; /* thrust of a rotor [N] */
    double reserve;     /* share of its room around hover that is left to feedback, at least 0 and below 1 */
    double yaw;         /* heading [rad] */
    double drag[4];     /* per mass: a, b of (a + b |v|) v [1/s], [1/m], and how much both are more along the thrust; zero is none */
} minsnap_vehicle;

/* Limits that a curve keeps at every instant; zero is no limit. The last four need three coordinates. */
typedef struct minsnap_limits {
    int64_t size;                           /* sizeof(minsnap_limits), as minsnap_limits_new sets it */
    double speed, acceleration, jerk, snap; /* greatest Euclidean norms [m/s], [m/s^2], [m/s^3], [m/s^4] */
    double max_thrust, min_thrust;          /* thrust over weight, above and below 1 */
    double tilt;                            /* largest angle between thrust and the vertical, below pi/2 [rad] */
    double body_rate;                       /* roll and pitch rate together [rad/s] */
    double gravity;                         /* [m/s^2]; 9.80665 unless given */
    const minsnap_vehicle *vehicle;         /* whose rotors keep their range, and with them the sum of thrusts; or null */
} minsnap_limits;

/* An opening in a plane, at a waypoint: the curve meets the plane within it, and the waypoint is a point of it. */
typedef struct minsnap_gate {
    int64_t size;         /* sizeof(minsnap_gate), as minsnap_gate_new sets it */
    int64_t waypoint;     /* an inner one, or the first of a lap */
    double normal[3];     /* across the opening, of any length but zero; in the plane the first two count */
    double width, height; /* of a rectangle around the waypoint [m]; the height is the width unless given, and none in the plane */
    double up[3];         /* along the height, its part in the opening counts; z unless given, or y for a level opening */
    int64_t corners;      /* at least 3, or 2 in the plane */
    const double *corner; /* (corners, dim) of a convex polygon in place of the rectangle, counter-clockwise about the normal [m]; or null */
    double margin;        /* how far the curve stays from the edges [m] */
    int64_t crossing;     /* 1 where it is flown through along the normal, -1 against it, 0 either way */
} minsnap_gate;

/* What is asked for. With durations, or a total time, the curve costs least: the integral of the squared k-th derivative, for degree 2k - 1. With
 * neither, it is the quickest that is found within the limits. Walls hold at every instant, all of them together. */
typedef struct minsnap_problem {
    int64_t size;         /* sizeof(minsnap_problem), as minsnap_problem_new sets it */
    int64_t dim;          /* coordinates: 1, 2 or 3 */
    int64_t waypoints;    /* at least 2 */
    int64_t degree;       /* 3, 5, 7, 9 or 11; 7 unless given, and within limits in fewer than three coordinates */
    int64_t pieces;       /* polynomials of each leg; 0 leaves it to the search within limits, and is 1 elsewhere, as it is without walls */
    int64_t closed;       /* 1 for a lap, whose last waypoint is the first, and whose state there is chosen; else 0 */
    const double *points; /* (waypoints, dim) [m] */
    const double *durations;        /* (waypoints - 1,) [s], or null */
    double total_time;              /* of all legs [s], or 0 */
    const minsnap_limits *limits;   /* or null */
    const double *widths;           /* (waypoints - 1,) half-widths of a tube around each leg [m], infinite where a leg has none; or null */
    const double *box_lower;        /* (waypoints - 1, dim) corners of a box for each leg [m], infinite where there is no wall; or null */
    const double *box_upper;        /* (waypoints - 1, dim) */
    int64_t planes;                 /* half-spaces normal . r <= bound, each on one leg: those of a leg are its polytope */
    const int64_t *plane_leg;       /* (planes,) from 0 */
    const double *plane_normal;     /* (planes, dim) of any length but zero */
    const double *plane_bound;      /* (planes,) [m] for a normal of length 1 */
    const double *radii;            /* (waypoints,) balls around waypoints through which the curve may pass [m], 0 at both ends; or null */
    int64_t gates;                  /* openings that are flown through */
    const minsnap_gate *gate;       /* (gates,), one at a waypoint, which then has no ball */
    const double *yaws;             /* (waypoints,) headings, turned the shorter way but for whole turns [rad]; or null */
    const double *start;            /* (k - 1, dim) derivatives 1 ... k - 1 at the start [m/s^order]; null at rest */
    const double *end;              /* (k - 1, dim) the same at the end */
    double seconds;                 /* after which a search ends with the best curve so far [s]; 0 for as much work as a problem is worth */
    int64_t (*stop)(void *context); /* asked during a search, which ends where it returns other than 0; or null */
    void *context;                  /* for stop */
} minsnap_problem;

/* A curve: of each leg some polynomials in Bernstein form, one after another. */
typedef struct minsnap_curve {
    int64_t size;   /* sizeof(minsnap_curve), as minsnap_curve_new sets it */
    int64_t legs;   /* 0 where there is none */
    int64_t pieces; /* polynomials of each leg */
    int64_t degree;
    int64_t dim;
    const double *points;    /* (legs * pieces, degree + 1, dim) control points [m]; those of a planner are there until it plans again */
    const double *durations; /* (legs * pieces,) [s] */
    const double *breaks;    /* (legs * pieces + 1,) where polynomials begin and end, from 0 [s] */
    double duration;         /* [s] */
    double cost;             /* integral of the squared norm of derivative (degree + 1) / 2 [m^2/s^degree] */
    const double *yaw;       /* (legs, 4) control points of the heading, a cubic polynomial of each leg [rad]; or null */
} minsnap_curve;

/* What is proved of a curve over all time, rounding included. */
typedef struct minsnap_certificate {
    int64_t size;                           /* sizeof(minsnap_certificate), as minsnap_certificate_new sets it */
    int64_t kept;                           /* 1 where all that the problem asks for is kept, else 0 */
    int64_t continuity;                     /* derivatives that agree on both sides of every inner knot, degree where all do */
    double waypoints;                       /* largest distance from a waypoint, beyond its ball [m] */
    double margin;                          /* the distance to the walls is nowhere less [m]; negative outside, infinite without walls */
    double speed, acceleration, jerk, snap; /* norms that are never exceeded [m/s], [m/s^2], [m/s^3], [m/s^4] */
    double thrust, least_thrust;            /* greatest and least thrust over weight, without drag; of three coordinates, else 0 */
    double tilt;                            /* largest angle between thrust and the vertical [rad]; the same */
    double body_rate;                       /* largest roll and pitch rate together [rad/s], infinite where thrust vanishes; the same */
} minsnap_certificate;

typedef struct minsnap_planner minsnap_planner; /* memory for plans, and the last message */

static inline minsnap_vehicle minsnap_vehicle_new(void) {
    minsnap_vehicle made;
    memset(&made, 0, sizeof made);
    made.size = (int64_t)sizeof made;
    return made;
}
static inline minsnap_limits minsnap_limits_new(void) {
    minsnap_limits made;
    memset(&made, 0, sizeof made);
    made.size = (int64_t)sizeof made;
    return made;
}
static inline minsnap_gate minsnap_gate_new(void) {
    minsnap_gate made;
    memset(&made, 0, sizeof made);
    made.size = (int64_t)sizeof made;
    return made;
}
static inline minsnap_problem minsnap_problem_new(void) {
    minsnap_problem made;
    memset(&made, 0, sizeof made);
    made.size = (int64_t)sizeof made;
    return made;
}
static inline minsnap_curve minsnap_curve_new(void) {
    minsnap_curve made;
    memset(&made, 0, sizeof made);
    made.size = (int64_t)sizeof made;
    return made;
}
static inline minsnap_certificate minsnap_certificate_new(void) {
    minsnap_certificate made;
    memset(&made, 0, sizeof made);
    made.size = (int64_t)sizeof made;
    return made;
}

#if defined(_WIN32) && defined(MINSNAP_BUILD)
#define MINSNAP_API __declspec(dllexport)
#elif defined(_WIN32)
#define MINSNAP_API __declspec(dllimport)
#elif defined(MINSNAP_BUILD)
#define MINSNAP_API __attribute__((visibility("default")))
#else
#define MINSNAP_API
#endif

/* Version of the library, as MINSNAP_VERSION; interface of the library; name of a status, as "DONE", or null. */
MINSNAP_API const char *minsnap_version(void);
MINSNAP_API int32_t minsnap_abi(void);
MINSNAP_API const char *minsnap_status_name(minsnap_status status);

/* Make a planner, for MINSNAP_ABI, and free it; unsupported where the library is another version. Null is nothing to free. */
MINSNAP_API minsnap_status minsnap_open(int32_t abi, minsnap_planner **planner);
MINSNAP_API void minsnap_close(minsnap_planner *planner);

/* What the last call with a planner had to say: a sentence, empty where it was done. */
MINSNAP_API const char *minsnap_message(const minsnap_planner *planner);

/* Plan. The curve that comes back is certified. */
MINSNAP_API minsnap_status minsnap_plan(minsnap_planner *planner, const minsnap_problem *problem, minsnap_curve *curve);

/* Plan anew in flight, within `budget` seconds from `now`: from the state that the curve flown has at now + budget, through the waypoints of a
 * problem within limits. Its first waypoint is the one that was passed last, and gives the walls of the first leg alone. The new curve begins at
 * now + budget. With any other status than done the vehicle goes on along the old one, which is still there if it is the planner's own. */
MINSNAP_API minsnap_status minsnap_replan(minsnap_planner *planner, const minsnap_problem *problem, const minsnap_curve *flown, double now,
                                          double budget, minsnap_curve *curve);

/* Come to rest from the state that a curve flown has at an instant, within the walls of the leg that is flown, or of that and the next one, and
 * within limits: the shortest of a family of polynomials that is proved to. The first waypoint of the problem is the one that was passed last. */
MINSNAP_API minsnap_status minsnap_brake(minsnap_planner *planner, const minsnap_problem *problem, const minsnap_curve *flown,
                                         double instant, minsnap_curve *curve);

/* A time that every flight of a problem within limits takes at least, whatever its curve, rounded down [s]. Speed, acceleration, thrust and tilt
 * bound it; jerk, snap, body rate and the torque of rotors do at ends where the flight hovers, for curves of its degree; other limits, the walls, and
 * thrust and tilt with drag are left out. */
MINSNAP_API minsnap_status minsnap_least_time(minsnap_planner *planner, const minsnap_problem *problem, double *seconds);

/* Derivatives of an order at instants (count,) [s] from 0 to the duration: out (count, dim) [m/s^order]. */
MINSNAP_API minsnap_status minsnap_at(const minsnap_curve *curve, int64_t order, const double *t, int64_t count, double *out);

/* Derivatives of the heading at instants (count,) [s], of a curve that has one: out (count,) [rad/s^order]. */
MINSNAP_API minsnap_status minsnap_yaw_at(const minsnap_curve *curve, int64_t order, const double *t, int64_t count, double *out);

/* Prove what holds of any curve over all time, and whether it keeps what a problem asks for; times count where the problem has durations or a total. */
MINSNAP_API minsnap_status minsnap_certify(minsnap_planner *planner, const minsnap_problem *problem, const minsnap_curve *curve,
                                           minsnap_certificate *certificate);

#ifdef __cplusplus
}
#endif

#endif

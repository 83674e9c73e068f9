// What is asked of the joint search for a fleet's curves, and what it keeps from step to step.
#pragma once

#include "fleet/obstacles.hpp"
#include "fleet/septic.hpp"

namespace minsnap {

constexpr int limit_kinds = 5;   // of each order: three axes, the norm, the norm of x and y
constexpr int limit_orders = 4;  // velocity to snap

// What does not change during a search.
MINSNAP_RECORD(JointQuestion, {
    Integer vehicles, pieces, samples;  // samples of a piece
    const double *radii;                // (vehicles,)
    const double *limits;               // (vehicles, limit_orders, limit_kinds), infinite where there is none
    const double *room;                 // (vehicles, pieces, 2, 3), infinite where there is none
    const double *free;                 // (vehicles, pieces + 1, 12): 1 where an unknown is free, 0 where it is given
    const double *shares;               // (pieces,): of the flight time, sum 1
    Integer obstacles;
    const Obstacle *obstacle;
    double downwash;
    double length;  // unit in which distances from walls and obstacles are penalised [m]
    Integer threads;
});

// One run: the time, how exact, and the curves, which it moves.
MINSNAP_RECORD(JointRun, {
    double time;        // common flight time [s]
    double inflation;   // pairs are pushed to so many times their separation
    double smoothness;  // weight of the squared fourth derivative in units of the piece's time [1/m^2]
    double rho, tau;
    Integer iterations, inner;    // at most so many steps, each with at most so many steps of conjugate gradients
    Integer patience;             // ends after so many steps without progress: the larger of both has not fallen by a tenth
    double short_by, over_by;     // ends once separations are short by less, and limits exceeded by less, relatively
    Integer settle;               // 1: goes on until the cost is settled, too
    double *curves;               // (vehicles, pieces + 1, 4, 3): h^q times the derivatives at knots [m], h = time / pieces
    volatile std::int32_t *stop;  // ends once this is not 0
    double *found;                // (4,): short by, over by, value, steps done
});

}  // namespace minsnap

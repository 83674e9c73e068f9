// What Python asks about a fleet, and where answers are written.
#pragma once

#include "fleet/obstacles.hpp"

namespace minsnap {

// Which pairs of a fleet come near each other, and how near.
MINSNAP_RECORD(SeparationQuestion, {
    FleetCurves fleet;
    const double *radii;  // (vehicles,): a pair is to be apart by the sum of both
    double downwash;
    double reach;          // pairs nearer than this many times their separation are returned
    Integer nearest_only;  // of each chunk only the pair nearest in units of its separation
    Integer threads;
    Integer capacity;  // of the arrays below
    Integer *pairs;    // (capacity, 2)
    double *values;    // (capacity, 3): least, attained, instant
    Integer *found;    // as many there are, perhaps more than fit
});

// How near every vehicle of a fleet comes to obstacles.
MINSNAP_RECORD(ClearanceQuestion, {
    FleetCurves fleet;
    Integer obstacles;
    const Obstacle *obstacle;
    double finest;  // how far proof and truth may lie apart [m]
    Integer threads;
    double *values;    // (vehicles, 3): never less, attained, instant
    Integer *nearest;  // (vehicles,)
});

// Which vehicle flies to which goal; vehicles beyond `vehicles` have no place, and go anywhere at no cost.
MINSNAP_RECORD(AssignmentQuestion, {
    Integer vehicles, goals;
    const double *start;  // (3, vehicles) [m]
    const double *goal;   // (3, goals) [m]
    double step;          // by which a bid raises a price beyond the next best goal [m^2]
    Integer bids;         // the most of one call
    double *price;        // (goals,) [m^2], and what it becomes
    Integer *goal_of;     // (goals,): of each vehicle, -1 for none
    Integer *waiting;     // how many have none
});

}  // namespace minsnap

// What Python asks about the curves of a fleet, and where answers are written; listed in basics/border_fields.hpp.
#pragma once

#include "fleet/obstacles.hpp"

namespace minsnap {

// Which pairs of a fleet come near each other, and how near.
struct SeparationQuestion {
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
};

// How near every vehicle of a fleet comes to obstacles.
struct ClearanceQuestion {
    FleetCurves fleet;
    Integer obstacles;
    const Obstacle *obstacle;
    double finest;  // how far proof and truth may lie apart [m]
    Integer threads;
    double *values;    // (vehicles, 3): never less, attained, instant
    Integer *nearest;  // (vehicles,)
};

}  // namespace minsnap

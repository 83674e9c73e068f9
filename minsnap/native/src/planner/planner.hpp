// What a planner of the public header keeps.
#pragma once

#include "basics/pool.hpp"
#include "planner/answer.hpp"

struct minsnap_planner {
    minsnap::Pool pool;  // of all memory that its calls need
    minsnap::Says says;
    minsnap::Course course;
    minsnap::CurveMemory told, next;  // the curve that was given last, and the one that is made
};

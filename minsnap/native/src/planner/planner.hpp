// What a planner of the public header keeps.
#pragma once

#include "planner/answer.hpp"

struct minsnap_planner {
    minsnap::Says says;
    minsnap::Course course;
    minsnap::CurveMemory told, next;  // the curve that was given last, and the one that is made
};

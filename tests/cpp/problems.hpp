// What tests of the public header plan.
#pragma once

#include <minsnap.hpp>

inline minsnap::Limits usual() {
    minsnap::Limits limits;
    limits.speed = 3.0, limits.acceleration = 4.0, limits.jerk = 30.0;
    return limits;
}

inline minsnap::Problem rectangle() {
    minsnap::Problem problem(3);
    problem.points = {0, 0, 1, 8, 0, 1, 8, 4, 1, 0, 4, 1, 0, 0, 1};
    return problem;
}

// The time that every flight of a course within limits takes at least, whatever its curve.
#pragma once

#include "planner/course.hpp"

namespace minsnap {

Status least_time(const Course &course, Says &says, double &seconds);

}  // namespace minsnap

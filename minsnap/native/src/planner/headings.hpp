// Headings through angles at waypoints: the cubic spline of least squared angular acceleration.
#pragma once

#include "planner/answer.hpp"

namespace minsnap {

// Where a heading begins that goes on in flight [rad], [rad/s].
struct HeadingState {
    double angle = 0.0, rate = 0.0;
    bool given = false;
};

// Check the angles of a problem; those of a lap are the same at both ends, but for whole turns.
Status check_yaws(const minsnap_problem &problem, const Course &course, Says &says);

// Write the heading of a curve, (legs, 4) control points [rad], from a state on where that is given.
Status make_heading(const double *yaws, const Course &course, const HeadingState &from, CurveMemory &curve);

// A derivative of the heading of a curve at an instant within it.
double heading_at(const minsnap_curve &curve, std::int64_t order, double t);

}  // namespace minsnap

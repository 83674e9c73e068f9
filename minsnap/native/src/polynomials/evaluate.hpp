// Evaluation of a piecewise polynomial; see evaluate.cpp.
#pragma once

#include <cstdint>

#include "basics/record.hpp"
#include "basics/status.hpp"

namespace minsnap {

MINSNAP_RECORD(PiecewiseCurve, {
    const double *points;     // (pieces, degree + 1, dim)
    const double *durations;  // (pieces,)
    const double *breaks;     // (pieces + 1,), from 0
    std::int64_t pieces;
    std::int32_t degree;
    std::int32_t dim;
});

// Derivative of an order at instants (count,) [s]: (count, dim).  bad_number if an instant is outside the interval.
Status evaluate_curve(const PiecewiseCurve &curve, int order, const double *t, std::int64_t count, double *out);

}  // namespace minsnap

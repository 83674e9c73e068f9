// What Python asks of a vehicle's use along a curve; see vehicle_use.cpp.
#pragma once

#include "basics/record.hpp"
#include "polynomials/evaluate.hpp"

namespace minsnap {

// Quantities are thrust and minus the thrust over weight, tilt [rad], body rate [rad/s], and the largest deviations of the rotors' thrusts from hover,
// upwards and downwards [N].
MINSNAP_RECORD(VehicleUseRecord, {
    const PiecewiseCurve *curve;  // of three coordinates
    const PiecewiseCurve *yaw;    // [rad], of one coordinate, on the clock `begin + rate t`; null where it is constant
    double begin, rate, angle;    // angle: of a constant yaw, or of a body that does not spin, about the thrust axis at the start
    std::int64_t heads;     // 0 where the heading is not known and no rotor is asked for; 1 for a yaw; 2 for a body that does not spin
    double mass, jerk;      // [kg]; bound of the yaw's third derivative [rad/s^3]
    const double *medium;   // (5,) as VehicleRecord has it
    const double *inertia;  // (3, 3) [kg m^2]
    const double *mixer;    // (4, 4) from thrust and torques to thrusts of the rotors
    std::int64_t samples;   // of a piece, from which largest values are taken
    std::int64_t wanted;    // of the quantities to be proved, one bit for each
    std::int64_t rounds, first, parts, most, missed;  // of a proof, as VehicleUseSettings has them
    const double *finer;                              // (6,) added to samples of a proof
    double *values;                                   // (6,) largest samples, or what is to be proved, raised where that fails
    double *instants;                                 // (6,) of samples [s]
});

}  // namespace minsnap

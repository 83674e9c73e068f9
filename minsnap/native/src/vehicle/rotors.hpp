// Body rates, angular accelerations and the rotors' thrusts that a motion takes, by differential flatness.
//
// With z = f / |f|, y = f x h / |f x h|, x = y x z for a heading h, differentiating x.f = y.f = y.h = 0 once and twice gives rates and angular
// accelerations (D. Mellinger and V. Kumar, ICRA 2011).
#pragma once

#include "vehicle/lift.hpp"

namespace minsnap {

template <class Real>
struct Turning {
    Real rate[3], change[3];  // about the body's axes [rad/s], [rad/s^2]
};

// A heading that stays, (x, y, 0).
struct FixedHeading {
    double x, y;

    template <class Real>
    Space<Real> across(const Space<Real> &f) const {
        return {(-y) * f.z, x * f.z, y * f.x - x * f.y};
    }
    template <class Real>
    Real along(const Space<Real> &v) const {
        return x * v.x + y * v.y;
    }
};

// A heading that turns: its direction and two derivatives of it, all level.
template <class Real>
struct TurningHeading {
    Space<Real> direction, change, bend;

    Space<Real> across(const Space<Real> &f) const { return cross(f, direction); }
    Real along(const Space<Real> &v) const { return inner(v, direction); }
};

// The turns of the thrust axis alone, in axes x and y of the body, for a spin r and what it adds to both accelerations.
template <class Real>
struct AxisTurns {
    Real size, pull, p, q;

    AxisTurns(const Lift<Real> &f, const Real &length, const Space<Real> &x, const Space<Real> &y, const Space<Real> &z)
        : size(length), pull(inner(z, f.change) / size), p(-1.0 * (inner(y, f.change) / size)), q(inner(x, f.change) / size) {}

    Real p_change(const Lift<Real> &f, const Space<Real> &y) const { return -1.0 * (inner(y, f.bend) / size) - 2.0 * (p * pull); }
    Real q_change(const Lift<Real> &f, const Space<Real> &x) const { return inner(x, f.bend) / size - 2.0 * (q * pull); }
};

// Of a heading that stays: terms with its derivatives are left out.
template <class Real>
inline Turning<Real> turning(const Medium &m, const Lift<Real> &f, const Real &size, const FixedHeading &heading) {
    const Space<Real> lateral = heading.across(f.force);
    const Real reach = norm(lateral, m.floor());
    const Space<Real> z = along(f.force, size), y = along(lateral, reach), x = cross(y, z);
    const AxisTurns<Real> t(f, size, x, y, z);
    const Real forward = reach / size, upward = heading.along(z);
    const Real r = t.p * upward / forward;
    const Real p_change = t.p_change(f, y) + r * t.q, q_change = t.q_change(f, x) - r * t.p;
    return {{t.p, t.q, r}, {p_change, q_change, t.p * t.q + (r * t.q + p_change) * upward / forward}};
}

template <class Real>
inline Turning<Real> turning(const Medium &m, const Lift<Real> &f, const Real &size, const TurningHeading<Real> &heading) {
    const Space<Real> lateral = heading.across(f.force);
    const Real reach = norm(lateral, m.floor());
    const Space<Real> z = along(f.force, size), y = along(lateral, reach), sides = cross(y, z);
    const Space<Real> x{within_one(sides.x), within_one(sides.y), within_one(sides.z)};
    const AxisTurns<Real> t(f, size, x, y, z);
    const Real forward = within_one(reach / size), upward = heading.along(z);
    const Real r = (inner(y, heading.change) + t.p * upward) / forward;
    const Real p_change = t.p_change(f, y) + r * t.q, q_change = t.q_change(f, x) - r * t.p;
    const Real bent = inner(y, heading.bend) + 2.0 * (t.p * inner(z, heading.change) - r * inner(x, heading.change));
    return {{t.p, t.q, r}, {p_change, q_change, t.p * t.q + ((r * t.q + p_change) * upward + bent) / forward}};
}

// Of a body that does not spin about its thrust axis, with axes x and y.
template <class Real>
inline Turning<Real> unspun(const Lift<Real> &f, const Real &size, const Space<Real> &x, const Space<Real> &y) {
    const AxisTurns<Real> t(f, size, x, y, along(f.force, size));
    return {{t.p, t.q, Real(0.0)}, {t.p_change(f, y), t.q_change(f, x), Real(0.0)}};
}

// Thrust and torques of the body, from the thrust per mass (L. Euler's equations).
template <class Real>
inline void wrench_of(double mass, const double *inertia, const Real &thrust, const Turning<Real> &turn, Real *wrench) {
    Real momentum[3];
    wrench[0] = mass * thrust;
    for (int i = 0; i < 3; ++i) {
        momentum[i] = inertia[3 * i] * turn.rate[0] + inertia[3 * i + 1] * turn.rate[1] + inertia[3 * i + 2] * turn.rate[2];
        wrench[i + 1] = inertia[3 * i] * turn.change[0] + inertia[3 * i + 1] * turn.change[1] + inertia[3 * i + 2] * turn.change[2];
    }
    for (int i = 0; i < 3; ++i) {
        const int a = (i + 1) % 3, b = (i + 2) % 3;
        wrench[i + 1] = wrench[i + 1] + (turn.rate[a] * momentum[b] - turn.rate[b] * momentum[a]);
    }
}

// Thrust of one rotor, by its row of the inverse mixer.
template <class Real>
inline Real rotor_of(const double *row, const Real *wrench) {
    return ((row[0] * wrench[0] + row[1] * wrench[1]) + row[2] * wrench[2]) + row[3] * wrench[3];
}

}  // namespace minsnap

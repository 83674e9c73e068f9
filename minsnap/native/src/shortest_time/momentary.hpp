// Limits at an instant that are not convex: thrust and tilt with drag, body rate, rotors' thrusts, turns of the velocity and of a view.
//
// The thrust axis lies along f = a + g e_z + (linear + quadratic |v|) v / m where the drag is the same along the body's
// two lateral axes (M. Faessler, A. Franchi and D. Scaramuzza, RA-L 2018); rates and torques follow as from D. Mellinger
// and V. Kumar, ICRA 2011. The same formulas stand in time_allocation/momentary_limits.py and rotor_limits.py. A kind has one or more
// functions that must not be positive, or the parts of one second-order cone, its axis first.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "arithmetic/dual.hpp"

namespace minsnap {
inline namespace joint {

enum class Kind : std::int64_t {
    wall = 0,
    least_thrust = 1,
    body_rate = 2,
    unspun_rotors = 3,
    yawed_rotors = 4,
    most_thrust = 5,
    tilt = 6,
    heading_rate = 7,
    look_rate = 8,
};

constexpr double tiny_share = 1e-12;

// Gravity, and drag per mass: linear and quadratic across, and by how much more along the thrust.
struct Medium {
    double gravity, linear, quadratic, more_linear, more_quadratic;
    bool drag() const { return linear != 0.0 || quadratic != 0.0 || more_linear != 0.0 || more_quadratic != 0.0; }
};

constexpr std::size_t medium_values = 5;

inline Medium medium_of(const double *p) { return {p[0], p[1], p[2], p[3], p[4]}; }

// What the thrust must be: f with its derivatives, and by how much it is less along its own axis than |f|.
template <class Real>
struct Lift {
    Space<Real> force, change, bend;
    Real speed;
    bool drag;
};

// From velocity to snap, x[1] ... x[4]; `orders` says how many derivatives of f are wanted.
template <class Real>
inline Lift<Real> lift_of(const Medium &m, const Space<Real> *x, int derivatives) {
    Lift<Real> f{x[2], x[3], x[4], Real(0.0), m.drag()};
    f.force.z = f.force.z + m.gravity;
    if (!f.drag) return f;
    const Real speed = norm(x[1], tiny_share * m.gravity * m.gravity);
    const Real first = inner(x[1], x[2]) / speed;
    const Real share = m.quadratic * speed + m.linear;
    f.speed = speed;
    f.force = f.force + share * x[1];
    if (derivatives > 0) f.change = f.change + (m.quadratic * first) * x[1] + share * x[2];
    if (derivatives > 1) {
        const Real second = (inner(x[2], x[2]) + inner(x[1], x[3]) - first * first) / speed;
        f.bend = f.bend + (m.quadratic * second) * x[1] + (2.0 * (m.quadratic * first)) * x[2] + share * x[3];
    }
    return f;
}

// Thrust per mass along the axis.
template <class Real>
inline Real thrust_of(const Medium &m, const Lift<Real> &f, const Real &size, const Space<Real> &velocity) {
    if (!f.drag) return size;
    return size + (m.more_quadratic * f.speed + m.more_linear) * (inner(f.force, velocity) / size);
}

// Parameters: medium, ratio.
template <class Real>
inline void least_thrust(const double *p, const Space<Real> *x, Real *out) {
    const Medium m = medium_of(p);
    const Lift<Real> f = lift_of(m, x, 0);
    const Real size = norm(f.force, tiny_share * m.gravity * m.gravity);
    out[0] = (-1.0 / m.gravity) * thrust_of(m, f, size, x[1]) + p[medium_values];
}

// Parameters: medium, ratio. A cone of four parts.
template <class Real>
inline void most_thrust(const double *p, const Space<Real> *x, Real *out) {
    const Medium m = medium_of(p);
    const double unit = 1.0 / (p[medium_values] * m.gravity);
    const Lift<Real> f = lift_of(m, x, 0);
    const Real size = norm(f.force, tiny_share * m.gravity * m.gravity);
    out[0] = (-unit) * (thrust_of(m, f, size, x[1]) - size) + 1.0;
    out[1] = unit * f.force.x;
    out[2] = unit * f.force.y;
    out[3] = unit * f.force.z;
}

// Parameters: medium, tangent of the limit. A cone of three parts.
template <class Real>
inline void tilt(const double *p, const Space<Real> *x, Real *out) {
    const Medium m = medium_of(p);
    const double across = 1.0 / (p[medium_values] * m.gravity);
    const Lift<Real> f = lift_of(m, x, 0);
    out[0] = (1.0 / m.gravity) * f.force.z;
    out[1] = across * f.force.x;
    out[2] = across * f.force.y;
}

// Parameters: limit, typical speed, speed below which the heading is held, allowance there. Turns to the left and right.
template <class Real>
inline void heading_rate(const double *p, const Space<Real> *x, Real *out) {
    const double limit = p[0], typical = p[1], held = p[2], room = p[3];
    const Space<Real> flat{x[1].x, x[1].y, Real(0.0)};
    const Real speed = norm(flat, tiny_share * typical * typical);
    const Real turn = (1.0 / (limit * typical)) * ((flat.x * x[2].y - flat.y * x[2].x) / speed);
    Real allowed = (1.0 / typical) * speed;
    if (value_of(speed) < held) allowed = allowed + ((-room / held) * speed + room);
    out[0] = turn - allowed;
    out[1] = -1.0 * turn - allowed;
}

// Parameters: limit, typical speed, point that is looked at, least allowance. Turns of the way to it to the left and right, and how near it is.
template <class Real>
inline void look_rate(const double *p, const Space<Real> *x, Real *out) {
    const double limit = p[0], typical = p[1];
    const Space<Real> way{x[0].x - p[2], x[0].y - p[3], Real(0.0)};
    const Real distance = norm(way, tiny_share * (typical / limit) * (typical / limit));
    const Real turn = (1.0 / typical) * ((way.x * x[1].y - way.y * x[1].x) / distance);
    const Real allowed = (limit / typical) * distance;
    out[0] = turn - allowed;
    out[1] = -1.0 * turn - allowed;
    out[2] = (-1.0 / p[4]) * allowed + 1.0;
}

// Parameters: medium, limit.
template <class Real>
inline void body_rate(const double *p, const Space<Real> *x, Real *out) {
    const Medium m = medium_of(p);
    const double limit = p[medium_values], unit = limit * m.gravity;
    const Lift<Real> f = lift_of(m, x, 1);
    const Real thrust = norm(f.force, tiny_share * m.gravity * m.gravity);
    const Space<Real> axis = (Real(1.0) / thrust) * f.force;
    const Space<Real> across = f.change - inner(axis, f.change) * axis;
    out[0] = (0.5 / unit) * (norm(across, tiny_share * unit * unit) - limit * thrust);
}

// Parameters: medium, mass, least and most thrust of a rotor, its most thrust for an angular acceleration and for a rate of one.
template <class Real>
inline void unspun_rotors(const double *p, const Space<Real> *x, Real *out) {
    const Medium m = medium_of(p);
    const double *rest = p + medium_values;
    const double mass = rest[0], least = rest[1], most = rest[2], share = rest[3];
    const Lift<Real> f = lift_of(m, x, 2);
    const Real size = norm(f.force, tiny_share * m.gravity * m.gravity);
    const Space<Real> axis = (Real(1.0) / size) * f.force;
    const Real pull = inner(axis, f.change);
    const Space<Real> across = f.change - pull * axis;
    const Space<Real> turn = f.bend - inner(axis, f.bend) * axis - (2.0 * (pull / size)) * across;
    const double unit = most * m.gravity / share;
    const Real push = share * norm(turn, tiny_share * unit * unit) + rest[4] * (inner(across, across) / size);
    const Real mean = (0.25 * mass) * thrust_of(m, f, size, x[1]);
    out[0] = (1.0 / most) * (mean + push / size - most);
    out[1] = (0.5 / (most * m.gravity)) * (push - (mean - least) * size);
}

// Parameters: medium, mass, least, most, cosine and sine of the yaw, inertia (9), inverse mixer (16).
template <class Real>
inline void yawed_rotors(const double *p, const Space<Real> *x, Real *out) {
    const Medium m = medium_of(p);
    const double *rest = p + medium_values, *inertia = rest + 5, *mixer = rest + 14;
    const double least = rest[1], most = rest[2];
    const Lift<Real> f = lift_of(m, x, 2);
    const Space<Real> heading{Real(rest[3]), Real(rest[4]), Real(0.0)};
    const Real size = norm(f.force, tiny_share * m.gravity * m.gravity);
    const Space<Real> up = (Real(1.0) / size) * f.force;
    const Space<Real> lateral = cross(f.force, heading);
    const Space<Real> left = (Real(1.0) / norm(lateral, 0.0)) * lateral, ahead = cross(left, up);
    const Real forward = inner(ahead, heading), upward = inner(up, heading), pull = inner(up, f.change) / size;
    const Space<Real> rate{-1.0 * (inner(left, f.change) / size), inner(ahead, f.change) / size, Real(0.0)};
    const Real spin = rate.x * upward / forward;
    const Real p_rate = spin * rate.y - 2.0 * (rate.x * pull) - inner(left, f.bend) / size;
    const Real q_rate = inner(ahead, f.bend) / size - spin * rate.x - 2.0 * (rate.y * pull);
    const Real r_rate = (rate.x * rate.y * forward + spin * rate.y * upward + p_rate * upward) / forward;
    const Real turn[3] = {p_rate, q_rate, r_rate}, rates[3] = {rate.x, rate.y, spin};
    Real wrench[4] = {rest[0] * thrust_of(m, f, size, x[1]), Real(0.0), Real(0.0), Real(0.0)}, momentum[3];
    for (int i = 0; i < 3; ++i) {
        momentum[i] = inertia[3 * i] * rates[0] + inertia[3 * i + 1] * rates[1] + inertia[3 * i + 2] * rates[2];
        wrench[i + 1] = inertia[3 * i] * turn[0] + inertia[3 * i + 1] * turn[1] + inertia[3 * i + 2] * turn[2];
    }
    for (int i = 0; i < 3; ++i) {
        const int a = (i + 1) % 3, b = (i + 2) % 3;
        wrench[i + 1] = wrench[i + 1] + (rates[a] * momentum[b] - rates[b] * momentum[a]);
    }
    for (int i = 0; i < 4; ++i) {
        Real thrust = mixer[4 * i] * wrench[0];
        for (int j = 1; j < 4; ++j) thrust = thrust + mixer[4 * i + j] * wrench[j];
        out[i] = (1.0 / most) * (thrust - most);
        out[i + 4] = (-1.0 / most) * (thrust - least);
    }
}

constexpr int most_functions = 8;

// How many functions a kind has, how many parts its cone (1 for functions), and how many parameters.
struct Form {
    std::int64_t functions, parts;
    std::size_t parameters;
};

inline Form form_of(Kind kind) {
    switch (kind) {
        case Kind::unspun_rotors: return {2, 1, medium_values + 5};
        case Kind::yawed_rotors: return {8, 1, medium_values + 30};
        case Kind::most_thrust: return {1, 4, medium_values + 1};
        case Kind::tilt: return {1, 3, medium_values + 1};
        case Kind::heading_rate: return {2, 1, 4};
        case Kind::look_rate: return {3, 1, 5};
        default: return {1, 1, medium_values + 1};
    }
}

// Values of all functions of a kind from physical derivatives.
template <class Real>
inline void momentary(Kind kind, const double *p, const Space<Real> *x, Real *out) {
    switch (kind) {
        case Kind::least_thrust: least_thrust(p, x, out); break;
        case Kind::body_rate: body_rate(p, x, out); break;
        case Kind::unspun_rotors: unspun_rotors(p, x, out); break;
        case Kind::yawed_rotors: yawed_rotors(p, x, out); break;
        case Kind::most_thrust: most_thrust(p, x, out); break;
        case Kind::tilt: tilt(p, x, out); break;
        case Kind::heading_rate: heading_rate(p, x, out); break;
        case Kind::look_rate: look_rate(p, x, out); break;
        case Kind::wall: break;
    }
}

}  // namespace joint
}  // namespace minsnap

// What the thrust of a vehicle is against: gravity, and drag that is the same along the body's two lateral axes.
//
// The thrust axis lies along f = a + g e_z + (linear + quadratic |v|) v (M. Faessler, A. Franchi and D. Scaramuzza, RA-L 2018). Written once for plain
// numbers, for numbers with derivatives (the search) and for numbers with ranges (the proofs).
#pragma once

#include "arithmetic/space.hpp"

namespace minsnap {

constexpr double tiny_share = 1e-12;  // of the square of a norm that counts as large, so that its root is smooth

// Gravity, and drag per mass: linear and quadratic across, and by how much more along the thrust.
struct Medium {
    static constexpr int values = 5;
    double gravity, linear, quadratic, more_linear, more_quadratic;
    explicit Medium(const double *p) : gravity(p[0]), linear(p[1]), quadratic(p[2]), more_linear(p[3]), more_quadratic(p[4]) {}
    Medium(double pull, double across, double bent)
        : gravity(pull), linear(across), quadratic(bent), more_linear(0.0), more_quadratic(0.0) {}
    bool drag() const { return linear != 0.0 || quadratic != 0.0 || more_linear != 0.0 || more_quadratic != 0.0; }
    double floor() const { return tiny_share * gravity * gravity; }
};

// f and as many derivatives of it, from velocity, acceleration, jerk and snap.
//
// With the direction e = v / |v| the derivative of the speed is e.a, and the second one times v is (a.a + v.j - (e.a)^2) e: there is no quotient by
// the speed but that direction, whose components are known at rest too.
template <class Real>
struct Lift {
    Space<Real> force, change, bend;
    Real speed;

    Lift(const Medium &m, const Space<Real> *x, int derivatives) : force(x[1]) {
        force.z = force.z + m.gravity;
        if (derivatives > 0) change = x[2];
        if (derivatives > 1) bend = x[3];
        if (!m.drag()) return;
        speed = norm(x[0], m.floor());
        const Real share = m.quadratic * speed + m.linear;
        force = force + share * x[0];
        if (derivatives < 1) return;
        const Space<Real> direction = along(x[0], speed);
        const Real first = inner(direction, x[1]);
        change = change + (m.quadratic * first) * x[0] + share * x[1];
        if (derivatives < 2) return;
        const Real second = square(x[1]) + inner(x[0], x[2]) - squared(first);
        bend = bend + (m.quadratic * second) * direction + (2.0 * (m.quadratic * first)) * x[1] + share * x[2];
    }

    // The thrust per mass: of the length of f, and more by what the drag along the axis is greater.
    Real thrust(const Medium &m, const Real &size, const Space<Real> &velocity) const {
        if (!m.drag()) return size;
        return size + (m.more_quadratic * speed + m.more_linear) * inner(along(force, size), velocity);
    }
};

}  // namespace minsnap

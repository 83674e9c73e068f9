// The rotors' thrusts for a heading that turns and drag that differs along the body's axes, and their gradients.
//
// Its axes x and y are perpendicular to alpha = a + g e_z + d_x v and beta = a + g e_z + d_y v, y to the heading too, and the thrust per mass is what
// gamma = a + g e_z + d_z v has along z (M. Faessler, A. Franchi and D. Scaramuzza, RA-L 2018). Differentiated once and twice, the three conditions
// give rates and angular accelerations by one matrix; and so they do for any small change of the three vectors, so that reverse accumulation (A. Griewank
// and A. Walther, "Evaluating Derivatives", 2008, chapter 3) takes three solutions with its transpose.
#pragma once

#include "arithmetic/dual.hpp"
#include "vehicle/rotors.hpp"

namespace minsnap {

// Parameters: gravity, linear and quadratic drag per mass along each of the body's axes, mass, least and most thrust of a rotor, inertia (9), inverse
// mixer (16), least share of the thrust that is not along the heading: there a small change of the thrust spins the body about it by any angle.
struct TurningRotors {
    static constexpr int rotors = 4, cone = 2 * rotors, functions = cone + 1;
    static constexpr int inertia_at = 10, values = inertia_at + 9 + 16 + 1;
    static constexpr int heading =
        7;  // numbers of a heading: a vector along it and two derivatives, each east and north; 1 where it is the velocity

    Medium along[3];
    double mass, least, most, share;  // share: of the square of the thrust that may be along the heading
    const double *inertia, *mixer;

    explicit TurningRotors(const double *p)
        : along{{p[0], p[1], p[4]}, {p[0], p[2], p[5]}, {p[0], p[3], p[6]}}, mass(p[7]), least(p[8]), most(p[9]),
          share(1.0 - p[values - 1] * p[values - 1]), inertia(p + inertia_at), mixer(inertia + 9) {}

    bool drag() const { return along[0].drag() || along[1].drag() || along[2].drag(); }
    double unit() const { return 1.0 / (along[0].gravity * along[0].gravity); }
};

// A vector and two derivatives of it, in the body's axes.
template <class Real>
using Moving = Space<Real>[3];

// How the body turns, from velocity to snap and the heading; the velocity is not read where there is no drag.
template <class Real>
struct BodyTurns {
    Space<Real> x, y, z;               // its axes
    Space<Real> beta;                  // in the world's axes
    Moving<Real> first, second, head;  // alpha, beta and the heading
    Real lift, inverse;                // thrust per mass; one over the determinant of the conditions
    Space<Real> rate, change;          // [rad/s], [rad/s^2]

    MINSNAP_INLINE BodyTurns(const TurningRotors &asked, const Space<Real> *motion, const Real *heading) {
        const Lift<Real> a(asked.along[0], motion, 2), b(asked.along[1], motion, 2), c(asked.along[2], motion, 0);
        const double floor = asked.along[0].floor();
        beta = b.force;
        const Space<Real> lateral{-1.0 * (heading[1] * beta.z), heading[0] * beta.z, heading[1] * beta.x - heading[0] * beta.y};
        y = along(lateral, norm(lateral, floor));
        const Space<Real> forward = cross(y, a.force);
        x = along(forward, norm(forward, floor));
        z = cross(x, y);
        const Space<Real> *from[2][3] = {{&a.force, &a.change, &a.bend}, {&b.force, &b.change, &b.bend}};
        for (int k = 0; k < 3; ++k) {
            first[k] = in_body(*from[0][k]);
            second[k] = in_body(*from[1][k]);
            const Real &east = heading[2 * k], &north = heading[2 * k + 1];
            head[k] = {x.x * east + x.y * north, y.x * east + y.y * north, z.x * east + z.y * north};
        }
        first[0].x = second[0].y = head[0].y = Real(0.0);
        lift = inner(z, c.force);
        inverse = Real(1.0) / (second[0].z * head[0].x - second[0].x * head[0].z);
        rate = solved({first[1].x, second[1].y, head[1].y});
        const Real &p = rate.x, &q = rate.y, &r = rate.z, pq = p * q;
        const auto turned = [&](const Moving<Real> &v) { return pq * v[0].x + q * r * v[0].z + 2.0 * (p * v[1].z - r * v[1].x) + v[2].y; };
        change = solved(
            {pq * first[0].y + p * r * first[0].z + 2.0 * (r * first[1].y - q * first[1].z) + first[2].x, turned(second), turned(head)});
    }

    MINSNAP_INLINE Space<Real> in_body(const Space<Real> &v) const { return {inner(x, v), inner(y, v), inner(z, v)}; }
    MINSNAP_INLINE Space<Real> in_world(const Space<Real> &v) const { return v.x * x + v.y * y + v.z * z; }

    // The turn of the axes that makes up for what the conditions are off by.
    MINSNAP_INLINE Space<Real> solved(const Space<Real> &off) const {
        const Real p = inverse * (second[0].x * off.z - head[0].x * off.y), r = inverse * (second[0].z * off.z - head[0].z * off.y);
        return {p, (first[0].y * r + off.x) / first[0].z, r};
    }
    // The same with the transposed matrix, of the other sign.
    MINSNAP_INLINE Space<Real> weights(const Space<Real> &turn) const {
        const Real one = turn.y / first[0].z, rest = turn.z + first[0].y * one;
        return {one, -1.0 * (inverse * (turn.x * head[0].x + head[0].z * rest)), inverse * (second[0].z * rest + second[0].x * turn.x)};
    }

    // Half the square of what beta has along the heading, less a share of half its own square.
    MINSNAP_INLINE Real cone(const Real *heading, double share) const {
        const Real ahead = heading[0] * beta.x + heading[1] * beta.y, square = heading[0] * heading[0] + heading[1] * heading[1];
        return 0.5 * (ahead * ahead / square - share * inner(beta, beta));
    }
};

template <class Real>
inline void turning_rotors(const double *p, const Space<Real> *motion, const Real *heading, Real *out) {
    const TurningRotors asked(p);
    const BodyTurns<Real> body(asked, motion, heading);
    Real wrench[4];
    const Space<Real> &rate = body.rate, &change = body.change;
    wrench_of<Real>(asked.mass, asked.inertia, body.lift, {{rate.x, rate.y, rate.z}, {change.x, change.y, change.z}}, wrench);
    for (int i = 0; i < asked.rotors; ++i) {
        const Real thrust = rotor_of(asked.mixer + asked.rotors * i, wrench);
        out[i] = (1.0 / asked.most) * (thrust - asked.most);
        out[i + asked.rotors] = (-1.0 / asked.most) * (thrust - asked.least);
    }
    out[asked.cone] = asked.unit() * body.cone(heading, asked.share);
}

// Parameters: those of the rotors, then the most rate of the thrust axis.
template <class Real>
inline void turning_body_rate(const double *p, const Space<Real> *motion, const Real *heading, Real *out) {
    const BodyTurns<Real> body(TurningRotors(p), motion, heading);
    const double limit = p[TurningRotors::values];
    out[0] = (0.5 / (limit * limit)) * (body.rate.x * body.rate.x + body.rate.y * body.rate.y) - 0.5;
}

// Gradients of one of the rotors' thrusts, and of the cone around the heading. By velocity where there is drag, acceleration, jerk and snap; and, as a
// heading turns more slowly where more time is taken, by the logarithm of the duration, with what the second derivative is by the heading.
template <bool drag>
class TurningGradients {
public:
    typedef Dual<0, Quad> Plain;
    Quad own{}, own_bend{};
    Plain by_heading[3][2];  // of the last one, by the heading and its two derivatives, each east and north

    MINSNAP_INLINE TurningGradients(const TurningRotors &asked, const Space<Plain> *motion, const Plain *heading)
        : asked_(asked), motion_(motion), heading_(heading), body_(asked, motion, heading), momentum_(momentum(body_.rate)) {
        if constexpr (drag) speed_ = norm(motion[0], asked.along[0].floor());
    }

    // Of one rotor, by its row of the inverse mixer.
    MINSNAP_INLINE void of_rotor(const double *row, Quad *gradient) {
        const Space<Plain> torque{row[1], row[2], row[3]};
        of_turns(momentum(torque), cross(momentum_, torque) + momentum(cross(torque, body_.rate)), row[0] * asked_.mass, gradient);
    }

    // Of half the square of the rate of the thrust axis.
    MINSNAP_INLINE void of_rate(Quad *gradient) {
        const Plain none(0.0);
        of_turns({none, none, none}, {body_.rate.x, body_.rate.y, none}, 0.0, gradient);
    }

    // Of half the square of what beta has along the heading, less a share of half its own square.
    MINSNAP_INLINE void of_cone(Quad *gradient) {
        const Space<Plain> &beta = body_.beta;
        const Plain &east = heading_[0], &north = heading_[1], none(0.0);
        const Plain ahead = (east * beta.x + north * beta.y) / (east * east + north * north);
        const Space<Plain> by{east * ahead - asked_.share * beta.x, north * ahead - asked_.share * beta.y, -asked_.share * beta.z};
        const Space<Plain> zero{none, none, none};
        const Moving<Plain> by_a{zero, zero, zero}, by_b{body_.in_body(by), zero, zero};
        own = own_bend = Quad{};
        put(by_a, by_b, zero, gradient);
        for (auto &by : by_heading) by[0] = by[1] = none;
        by_heading[0][0] = ahead * (beta.x - ahead * east);
        by_heading[0][1] = ahead * (beta.y - ahead * north);
        if constexpr (drag) along_velocity(gradient);
    }

    // Of the last one, by the heading's angle and its two derivatives.
    MINSNAP_INLINE void by_angle(Quad *found) const {
        const Quad &east = heading_[0].value, &north = heading_[1].value;
        Quad turn[3][2];  // what each has along the turning heading, and along the heading
        for (int k = 0; k < 3; ++k) {
            const Quad &x = by_heading[k][0].value, &y = by_heading[k][1].value;
            turn[k][0] = east * y - north * x, turn[k][1] = east * x + north * y;
        }
        const Quad rate = east * heading_[3].value - north * heading_[2].value, bend = east * heading_[5].value - north * heading_[4].value;
        found[0] = turn[0][0] - rate * turn[1][1] - bend * turn[2][1] - rate * rate * turn[2][0];
        found[1] = turn[1][0] - 2.0 * (rate * turn[2][1]);
        found[2] = turn[2][0];
    }

private:
    // Of angular accelerations and rates with their weights, and of the thrust per mass with its own.
    MINSNAP_INLINE void of_turns(const Space<Plain> &by_change, const Space<Plain> &by_rate, double lift, Quad *gradient) {
        const Space<Plain> &rate = body_.rate, &change = body_.change;
        const Plain &p = rate.x, &q = rate.y, &r = rate.z;
        const Moving<Plain> &a = body_.first, &b = body_.second, &h = body_.head;
        // Weights of the conditions' second derivatives, then of their first ones, then of the conditions.
        const Space<Plain> m = body_.weights(by_change);
        const auto turned = [&](const Moving<Plain> &v) {  // of what is perpendicular to y, by the rate
            return Space<Plain>{q * v[0].x + 2.0 * v[1].z, p * v[0].x + r * v[0].z, q * v[0].z - 2.0 * v[1].x};
        };
        const Space<Plain> by_x{q * a[0].y + r * a[0].z, p * a[0].y - 2.0 * a[1].z, p * a[0].z + 2.0 * a[1].y};
        const Space<Plain> n = body_.weights(by_rate + m.x * by_x + m.y * turned(b) + m.z * turned(h));
        const Plain none(0.0);
        const auto by_y = [&](const Plain &m, const Plain &n, Moving<Plain> &by) {
            by[0] = {m * (p * q - change.z) - n * r, none, m * (q * r + change.x) + n * p};
            by[1] = {-2.0 * (r * m), n, 2.0 * (p * m)};
            by[2] = {none, m, none};
        };
        Moving<Plain> by_a, by_b, by_h;
        by_a[0] = {none, m.x * (p * q + change.z) + n.x * r, m.x * (p * r - change.y) - n.x * q};
        by_a[1] = {n.x, 2.0 * (r * m.x), -2.0 * (q * m.x)};
        by_a[2] = {m.x, none, none};
        by_y(m.y, n.y, by_b);
        by_y(m.z, n.z, by_h);
        Space<Plain> by_c{none, none, Plain(lift)}, twist = Plain(lift) * crossed_lift();
        for (int k = 0; k < 3; ++k) twist = twist + cross(by_a[k], a[k]) + cross(by_b[k], b[k]) + cross(by_h[k], h[k]);
        const Space<Plain> t = body_.weights(twist);
        by_a[0].x = by_a[0].x + t.x;
        by_b[0].y = by_b[0].y + t.y;
        const Plain once = inner(by_h[1], h[1]), twice = inner(by_h[2], h[2]);
        const Plain held = Plain(1.0) - heading_[6];
        own = (-1.0 * (held * (once + 2.0 * twice))).value;
        own_bend = (held * (once + 4.0 * twice)).value;
        put(by_a, by_b, by_c, gradient);
        by_h[0].y = by_h[0].y + t.z;
        for (int k = 0; k < 3; ++k) {
            const Space<Plain> by = body_.in_world(by_h[k]);
            by_heading[k][0] = by.x, by_heading[k][1] = by.y;
        }
        if constexpr (drag) along_velocity(gradient);
    }

    MINSNAP_INLINE Space<Plain> momentum(const Space<Plain> &a) const {
        const double *m = asked_.inertia;
        return {m[0] * a.x + m[1] * a.y + m[2] * a.z, m[3] * a.x + m[4] * a.y + m[5] * a.z, m[6] * a.x + m[7] * a.y + m[8] * a.z};
    }

    // z x gamma in the body's axes.
    MINSNAP_INLINE Space<Plain> crossed_lift() const {
        const Lift<Plain> gamma(asked_.along[2], motion_, 0);
        return {-1.0 * inner(body_.y, gamma.force), inner(body_.x, gamma.force), Plain(0.0)};
    }

    // Add the gradient by the heading, where that is the velocity.
    MINSNAP_INLINE void along_velocity(Quad *gradient) const {
        const Quad along = heading_[6].value;
        for (int k = 0; k < 3; ++k)
            for (int c = 0; c < 2; ++c) gradient[3 * k + c] = gradient[3 * k + c] + along * by_heading[k][c].value;
    }

    MINSNAP_INLINE void write(const Space<Plain> &a, Quad *to) const { to[0] = a.x.value, to[1] = a.y.value, to[2] = a.z.value; }

    // From gradients in the body's axes by alpha, beta and gamma to those by the derivatives of position.
    MINSNAP_INLINE void put(const Moving<Plain> &by_a, const Moving<Plain> &by_b, const Space<Plain> &by_c, Quad *gradient) const {
        Moving<Plain> whole;
        for (int k = 0; k < 3; ++k) whole[k] = body_.in_world(k == 0 ? by_a[0] + by_b[0] + by_c : by_a[k] + by_b[k]);
        if constexpr (drag) return through_drag(whole, by_a, by_b, by_c, gradient);
        for (int k = 0; k < 3; ++k) write(whole[k], gradient + 3 * k);
    }

    // What the drag along each axis adds: of the speed e.v, e = v / |v|, whose derivatives are those of `Lift`.
    MINSNAP_INLINE void through_drag(const Moving<Plain> &whole, const Moving<Plain> &by_a, const Moving<Plain> &by_b,
                                     const Space<Plain> &by_c, Quad *gradient) const {
        const Space<Plain> &v = motion_[0], &a = motion_[1], &j = motion_[2];
        Moving<Plain> bent, share;
        const Plain none(0.0);
        for (int k = 0; k < 3; ++k) {
            const Space<Plain> c = k == 0 ? by_c : Space<Plain>{none, none, none};
            const auto weighed = [&](const double *of) { return Plain(of[0]) * by_a[k] + Plain(of[1]) * by_b[k] + Plain(of[2]) * c; };
            const double linear[3] = {asked_.along[0].linear, asked_.along[1].linear, asked_.along[2].linear};
            const double quadratic[3] = {asked_.along[0].quadratic, asked_.along[1].quadratic, asked_.along[2].quadratic};
            bent[k] = body_.in_world(weighed(quadratic));
            share[k] = body_.in_world(weighed(linear)) + speed_ * bent[k];
        }
        const Plain slower = Plain(1.0) / speed_;
        const Space<Plain> e = slower * v;
        const Plain first = inner(e, a), second = inner(a, a) + inner(v, j) - first * first;
        const auto damped = [&](int k) { return share[k] + inner(e, bent[k]) * v; };
        const Space<Plain> across = a - first * e, first_slope = slower * across, second_slope = j - (2.0 * first) * first_slope;
        const Plain held = inner(e, bent[2]), pulled = inner(a, bent[2]);
        const Space<Plain> by_velocity = first * bent[1] + inner(e, bent[1]) * across + inner(a, bent[1]) * e + held * second_slope +
                                         (second * slower) * (bent[2] - held * e) + (2.0 * pulled) * first_slope + inner(j, bent[2]) * e;
        const Space<Plain> by_acceleration = (2.0 * held) * across + (2.0 * first) * bent[2] + (2.0 * pulled) * e;
        write(damped(0) + by_velocity, gradient);
        write(whole[0] + damped(1) + by_acceleration, gradient + 3);
        write(whole[1] + damped(2), gradient + 6);
        write(whole[2], gradient + 9);
    }

    const TurningRotors &asked_;
    const Space<Plain> *motion_;
    const Plain *heading_;
    const BodyTurns<Plain> body_;
    const Space<Plain> momentum_;
    Plain speed_;
};

}  // namespace minsnap

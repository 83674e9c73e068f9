// Gradients of the rotors' thrusts, and of what the thrust has along the heading, in the derivatives of position, for a heading that stays: by reverse accumulation in the axes of the body (A. Griewank
// and A. Walther, "Evaluating Derivatives", 2008, chapter 3).
//
// In those axes the turns depend on c = |f|, on f' and f'', and on k = h.z / h.x alone (`rotors.hpp`). A change of f by (x, y, z) there makes c longer
// by z, turns the axes by (-y, x, -k y) / c, and k by (1 + k^2) x / c.
#pragma once

#include "arithmetic/dual.hpp"
#include "vehicle/rotors.hpp"

namespace minsnap {

template <bool drag>
class RotorGradients {
public:
    typedef Dual<0, Quad> Plain;

    // From velocity, acceleration, jerk and snap; the velocity is not read where there is no drag. Medium and inertia stay with the caller.
    MINSNAP_INLINE RotorGradients(const Medium &medium, const Space<Plain> *motion, double mass, const FixedHeading &heading,
                                  const double *inertia)
        : medium_(medium), mass_(mass), inertia_(inertia) {
        for (int q = 0; q < 4; ++q) motion_[q] = plain(motion[q]);
        const Lift<Plain> lift(medium, motion, 2);
        const Space<Quad> f = plain(lift.force), lateral{-heading.y * f.z, heading.x * f.z, heading.y * f.x - heading.x * f.y};
        length_ = root(inner(f, f) + medium.floor());
        inverse_ = 1.0 / length_;
        speed_ = lift.speed.value;
        z_ = inverse_ * f;
        const Quad reach = root(inner(lateral, lateral) + medium.floor());
        y_ = (1.0 / reach) * lateral;
        x_ = cross(y_, z_);
        k_ = (heading.x * z_.x + heading.y * z_.y) * length_ / reach;
        change_ = in_body(plain(lift.change));
        bend_ = in_body(plain(lift.bend));
        turn();
    }

    // Of one rotor, by its row of the inverse mixer: in so many derivatives from acceleration on, or from velocity on where there is drag.
    MINSNAP_INLINE void of_rotor(const double *row, Quad *gradient) const {
        Space<Quad> by_force, by_change, by_bend;
        of_torque({filled<Quad>(row[1]), filled<Quad>(row[2]), filled<Quad>(row[3])}, by_force, by_change, by_bend);
        const double lift = row[0] * mass_;
        by_force.z += filled<Quad>(lift);
        const Space<Quad> alpha = in_world(by_force), beta = in_world(by_change), gamma = in_world(by_bend);
        put_all(lift, alpha, beta, gamma, gradient);
    }

    // Of half the square of what f has along the heading, less a share of half its own square.
    MINSNAP_INLINE void of_cone(const FixedHeading &heading, double share, Quad *gradient) const {
        const Space<Quad> f = length_ * z_, none{};
        const Quad ahead = heading.x * f.x + heading.y * f.y;
        const Space<Quad> alpha{heading.x * ahead - share * f.x, heading.y * ahead - share * f.y, -share * f.z};
        put_all(0.0, alpha, none, none, gradient);
    }

private:
    static MINSNAP_INLINE Space<Quad> plain(const Space<Plain> &a) { return {a.x.value, a.y.value, a.z.value}; }
    static MINSNAP_INLINE void put(const Space<Quad> &a, Quad *to) { to[0] = a.x, to[1] = a.y, to[2] = a.z; }
    MINSNAP_INLINE Space<Quad> in_body(const Space<Quad> &a) const { return {inner(x_, a), inner(y_, a), inner(z_, a)}; }
    MINSNAP_INLINE Space<Quad> in_world(const Space<Quad> &a) const { return a.x * x_ + a.y * y_ + a.z * z_; }
    MINSNAP_INLINE Space<Quad> momentum(const Space<Quad> &a) const {
        const double *m = inertia_;
        return {m[0] * a.x + m[1] * a.y + m[2] * a.z, m[3] * a.x + m[4] * a.y + m[5] * a.z, m[6] * a.x + m[7] * a.y + m[8] * a.z};
    }

    // Rates and angular accelerations, as in `turning`.
    MINSNAP_INLINE void turn() {
        pull_ = inverse_ * change_.z;
        rate_.x = -inverse_ * change_.y;
        rate_.y = inverse_ * change_.x;
        rate_.z = rate_.x * k_;
        p_change_ = -inverse_ * bend_.y - 2.0 * (rate_.x * pull_) + rate_.z * rate_.y;
        momentum_ = momentum(rate_);
    }

    // Gradients of the product of a row with the torques, in the body's axes.
    MINSNAP_INLINE void of_torque(const Space<Quad> &row, Space<Quad> &by_force, Space<Quad> &by_change, Space<Quad> &by_bend) const {
        const Quad &p = rate_.x, &q = rate_.y, &r = rate_.z;
        Space<Quad> accelerated = momentum(row), turned = cross(momentum_, row) + momentum(cross(row, rate_));
        Quad by_k = (r * q + p_change_) * accelerated.z, by_pull{}, by_length{};
        turned = turned + Space<Quad>{q * accelerated.z, (p + k_ * r) * accelerated.z, k_ * q * accelerated.z};
        accelerated.x += k_ * accelerated.z;
        turned = turned + Space<Quad>{-2.0 * pull_ * accelerated.x - r * accelerated.y, r * accelerated.x - 2.0 * pull_ * accelerated.y,
                                      q * accelerated.x - p * accelerated.y};
        by_pull = -2.0 * (p * accelerated.x + q * accelerated.y);
        by_k += p * turned.z;
        turned.x += k_ * turned.z;
        by_length =
            inverse_ * (inverse_ * (bend_.y * accelerated.x - bend_.x * accelerated.y) - p * turned.x - q * turned.y - pull_ * by_pull);
        by_bend = {inverse_ * accelerated.y, -inverse_ * accelerated.x, Quad{}};
        by_change = {inverse_ * turned.y, -inverse_ * turned.x, inverse_ * by_pull};
        const Space<Quad> axes = cross(by_change, change_) + cross(by_bend, bend_);
        by_force = {inverse_ * (axes.y + (1.0 + k_ * k_) * by_k), -inverse_ * (axes.x + k_ * axes.z), by_length};
    }

    // Gradients in f, f' and f'' as those in the derivatives of position, and what drag along the axis adds to the thrust.
    MINSNAP_INLINE void put_all(double lift, const Space<Quad> &alpha, const Space<Quad> &beta, const Space<Quad> &gamma,
                                Quad *gradient) const {
        if constexpr (drag) return through_drag(lift, alpha, beta, gamma, gradient);
        put(alpha, gradient);
        put(beta, gradient + 3);
        put(gamma, gradient + 6);
    }

    // In velocity, acceleration, jerk and snap (`Lift`).
    MINSNAP_INLINE void through_drag(double lift, Space<Quad> alpha, const Space<Quad> &beta, const Space<Quad> &gamma,
                                     Quad *gradient) const {
        const Space<Quad> &v = motion_[0], &a = motion_[1], &j = motion_[2];
        const Quad slower = 1.0 / speed_, share = medium_.quadratic * speed_ + medium_.linear;
        const Space<Quad> e = slower * v;
        const Quad first = inner(e, a), second = inner(a, a) + inner(v, j) - first * first;
        const Quad along_axis = inner(z_, v), more = lift * (medium_.more_quadratic * speed_ + medium_.more_linear);
        alpha = alpha + (more * inverse_) * (v - along_axis * z_);
        const auto damped = [&](const Space<Quad> &x) MINSNAP_INLINED { return share * x + (medium_.quadratic * inner(e, x)) * v; };
        const Space<Quad> across = a - first * e, first_slope = slower * across, second_slope = j - (2.0 * first) * first_slope;
        const Quad quadratic = filled<Quad>(medium_.quadratic), bent = inner(e, gamma), pulled = inner(a, gamma);
        const Space<Quad> by_velocity = first * beta + inner(e, beta) * across + inner(a, beta) * e + bent * second_slope +
                                        (second * slower) * (gamma - bent * e) + (2.0 * pulled) * first_slope + inner(j, gamma) * e;
        const Space<Quad> by_acceleration = (2.0 * bent) * across + (2.0 * first) * gamma + (2.0 * pulled) * e;
        put(damped(alpha) + quadratic * by_velocity + more * z_ + (lift * medium_.more_quadratic * along_axis) * e, gradient);
        put(alpha + damped(beta) + quadratic * by_acceleration, gradient + 3);
        put(beta + damped(gamma), gradient + 6);
        put(gamma, gradient + 9);
    }

    const Medium &medium_;
    const double mass_;
    const double *inertia_;
    Space<Quad> motion_[4], x_, y_, z_, change_, bend_, rate_, momentum_;  // change and bend of f in the body's axes
    Quad length_, inverse_, speed_, k_, pull_, p_change_;
};

}  // namespace minsnap

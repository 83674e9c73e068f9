// Limits that depend on several derivatives at an instant: body rate, rotors' thrusts, thrust and tilt with drag, turns of the velocity and of a view.
//
// Each limit is one or more functions that must not be positive, of what `vehicle/` says of a motion, written once for plain numbers and for numbers
// with derivatives. They are squared where a norm would have a kink. What does not depend on directions is a function of the thrust and of the
// products of f and its derivatives with each other, relative to f.f: six numbers, not nine, in which it has few terms.
#pragma once

#include "arithmetic/curved.hpp"
#include "shortest_time/border.hpp"
#include "vehicle/turning_rotors.hpp"

namespace minsnap {

enum class LimitKind : std::int64_t {
    least_thrust = 0,
    most_thrust = 1,
    tilt = 2,
    body_rate = 3,
    unspun_rotors = 4,
    yawed_rotors = 5,
    heading_rate = 6,
    look_rate = 7,
    turning_rotors = 8,
    turn_rate = 9,
    turning_body_rate = 10,
};

// Parameters: medium, ratio.
template <class Real>
inline void least_thrust(const double *p, const Space<Real> *x, Real *out) {
    const Medium m(p);
    const Lift<Real> f(m, x, 0);
    const Real size = norm(f.force, m.floor());
    out[0] = (-1.0 / m.gravity) * f.thrust(m, size, x[0]) + p[Medium::values];
}

// Parameters: medium, ratio.
template <class Real>
inline void most_thrust(const double *p, const Space<Real> *x, Real *out) {
    const Medium m(p);
    const Lift<Real> f(m, x, 0);
    const Real size = norm(f.force, m.floor());
    out[0] = (1.0 / (p[Medium::values] * m.gravity)) * f.thrust(m, size, x[0]) - 1.0;
}

// Parameters: medium, tangent of the limit.
template <class Real>
inline void tilt(const double *p, const Space<Real> *x, Real *out) {
    const Medium m(p);
    const Lift<Real> f(m, x, 0);
    const double upright = 0.5 / (m.gravity * m.gravity), across = upright / (p[Medium::values] * p[Medium::values]);
    out[0] = across * (f.force.x * f.force.x + f.force.y * f.force.y) - upright * (f.force.z * f.force.z);
    out[1] = (-1.0 / m.gravity) * f.force.z;
}

// Products of f and its derivatives relative to the square of f: f.f', f'.f', f.f'', f'.f'', f''.f''.
template <class Real>
inline void products_of(const Lift<Real> &f, const Real &square, int derivatives, Real *products) {
    const Real inverse = Real(1.0) / square;
    products[0] = inverse * inner(f.force, f.change);
    products[1] = inverse * inner(f.change, f.change);
    if (derivatives < 2) return;
    products[2] = inverse * inner(f.force, f.bend);
    products[3] = inverse * inner(f.change, f.bend);
    products[4] = inverse * inner(f.bend, f.bend);
}

// Parameters: medium, limit. From the first two products.
template <class Real>
MINSNAP_INLINE void body_rate(const double *p, const Real *products, Real *out) {
    const double limit = p[Medium::values];
    out[0] = (0.5 / (limit * limit)) * (products[1] - products[0] * products[0]) - 0.5;
}

// Parameters: medium, mass, least and most thrust of a rotor, its most thrust for an angular acceleration and for a rate of one.
// The rotor with most to do has at most the mean thrust, its share of the torque, and that of unequal inertias.
struct UnspunRotors {
    static constexpr double rounded = 3e-4;  // thrust by which the norm of the torque is rounded at its tip

    // Shares of the most thrust of a rotor: the least one, and what thrust, squared turn and squared rate are multiplied by.
    double least, mean, square, gyration;

    explicit UnspunRotors(const double *p) {
        const double *rest = p + Medium::values;
        const double most = rest[2], share = rest[3] / most;
        least = rest[1] / most;
        mean = 0.25 * rest[0] / most;
        square = share * share;
        gyration = rest[4] / most;
    }

    // Squares of the angular acceleration and of the rate across the thrust, from the relative products.
    template <class Real>
    struct Torque {
        Real across, rest, turn;

        explicit MINSNAP_INLINE Torque(const Real *products) {
            const Real &pull = products[0], &bent = products[2];
            across = products[1] - pull * pull;
            rest = (products[3] - bent * pull) - pull * across;
            turn = (products[4] - bent * bent) - 4.0 * (pull * rest);
        }
    };

    template <class Real>
    MINSNAP_INLINE Real under(const Real &turn) const {
        return square * turn + rounded * rounded;
    }

    template <class Real>
    MINSNAP_INLINE void at(const Real *products, const Real &thrust, Real *out) const {
        const Torque<Real> torque(products);
        const Real lift = mean * thrust, push = root(under(torque.turn)) + gyration * torque.across;
        out[0] = (lift + push) - 1.0;
        out[1] = (push - lift) + least;
    }
};

// Parameters: medium, mass, least and most thrust of a rotor, cosine and sine of the yaw, inertia (9), inverse mixer (16), least share of the thrust
// that is not along the heading: there a small change of the thrust spins the body about it by any angle.
struct YawedRotors {
    static constexpr int rotors = 4, cone = 2 * rotors, functions = cone + 1;
    static constexpr int inertia_at = Medium::values + 5, values = inertia_at + 9 + 16 + 1;

    double mass, least, most, share,
        unit;  // share of the square of the thrust that may be along the heading; one over the square of gravity
    FixedHeading heading;
    const double *inertia, *mixer;

    explicit YawedRotors(const double *p)
        : mass(p[Medium::values]), least(p[Medium::values + 1]), most(p[Medium::values + 2]), share(1.0 - p[values - 1] * p[values - 1]),
          unit(1.0 / (p[0] * p[0])), heading{p[Medium::values + 3], p[Medium::values + 4]}, inertia(p + inertia_at), mixer(inertia + 9) {}
};

template <class Real>
inline void yawed_rotors(const double *p, const Space<Real> *x, Real *out) {
    const Medium m(p);
    const YawedRotors limit(p);
    const Lift<Real> f(m, x, 2);
    const Real size = norm(f.force, m.floor());
    Real wrench[4];
    wrench_of(limit.mass, limit.inertia, f.thrust(m, size, x[0]), turning(m, f, size, limit.heading), wrench);
    for (int i = 0; i < limit.rotors; ++i) {
        const Real thrust = rotor_of(limit.mixer + limit.rotors * i, wrench);
        out[i] = (1.0 / limit.most) * (thrust - limit.most);
        out[i + limit.rotors] = (-1.0 / limit.most) * (thrust - limit.least);
    }
    const Real ahead = limit.heading.along(f.force);
    out[limit.cone] = (0.5 * limit.unit) * (ahead * ahead - limit.share * inner(f.force, f.force));
}

// Parameters: limit, typical speed, speed below which the heading is held, allowance there. From horizontal velocity and acceleration.
template <class Real>
inline void heading_rate(const double *p, const Real *x, Real *out) {
    const double limit = p[0], typical = p[1], held = p[2], room = p[3], unit = 1.0 / (limit * typical * typical);
    const Real turn = unit * (x[0] * x[3] - x[1] * x[2]), square = (1.0 / (typical * typical)) * (x[0] * x[0] + x[1] * x[1]);
    const double bound = held * held / (typical * typical);
    const Real share = positive((-1.0 / bound) * square + 1.0), allowed = square + (room * held / typical) * (share * share);
    out[0] = turn - allowed;
    out[1] = -1.0 * turn - allowed;
}

// Parameters: limit, the point that is looked at, a length that counts as large. From horizontal position and velocity.
template <class Real>
inline void look_rate(const double *p, const Real *x, Real *out) {
    const double limit = p[0];
    const Real east = x[0] - p[1], north = x[1] - p[2];
    const Real square = (east * east + north * north) + tiny_share * p[3] * p[3];
    const Real turn = (1.0 / limit) * ((east * x[3] - north * x[2]) / square);
    out[0] = 0.5 * (turn * turn) - 0.5;
}

// Parameters: limit. From a heading.
template <class Real>
inline void turn_rate(const double *p, const Real *heading, Real *out) {
    out[0] = (0.5 / (p[0] * p[0])) * (heading[2] * heading[2] + heading[3] * heading[3]) - 0.5;
}

// Where a heading is along the velocity, its numbers are those of horizontal velocity, acceleration and jerk: they may be as long as they like.
MINSNAP_INLINE void follow(const Quad *motion, Quad *heading) {
    const Quad &along = heading[TurningRotors::heading - 1];
    for (int n = 0; n < TurningRotors::heading - 1; ++n) heading[n] = along > 0.0 ? motion[n / 2 * 3 + n % 2] : heading[n];
}

// Orders of derivatives, none where the last is below the first.
struct Span {
    int low, high;

    int count() const { return high - low + 1; }
};

// Weighted sums over the functions of a limit at four instants: of gradients, of gradients weighted as Hessians are, and of Hessians with the outer
// products.
struct InstantTerms {
    static constexpr int most = 12, together = Lanes<Quad>::count;
    Quad slope[most], pull[most], bend[most][most];
    Quad crossed[most], own_slope,
        own_bend;  // where there is a heading: the same with the logarithm of the own duration, by which that turns

    // Leave one instant out.
    void silence(int inputs, int lane) {
        for (int n = 0; n < inputs; ++n) {
            slope[n][lane] = pull[n][lane] = 0.0;
            for (int m = 0; m < inputs; ++m) bend[n][m][lane] = 0.0;
        }
    }
};

// Weights of the rows: of their Hessians, of the outer products of their gradients, of their gradients.
struct RowWeights {
    const double *hessian, *outer, *gradient;

    RowWeights from(int row) const { return {hessian + row, outer + row, gradient + row}; }
};

struct InstantLimit {
    static_assert(TurningRotors::values == YawedRotors::values && TurningRotors::inertia_at == YawedRotors::inertia_at,
                  "both have their inertia at the same place");
    static constexpr int most_functions = YawedRotors::functions, most_inputs = InstantTerms::most + TurningRotors::heading;

    LimitKind kind;
    const double *parameters;
    Span span;                          // of the derivatives that it depends on
    bool along = false;                 // whether its heading may be along the velocity
    bool timed = false;                 // whether its heading is a function of time, which a longer duration does not slow
    int axes, functions, products = 0;  // coordinates of each; products of which it is a function, f.f among them, 0 for none

    explicit InstantLimit(const MomentaryLimit &asked) : kind(static_cast<LimitKind>(asked.kind)), parameters(asked.parameters) {
        const bool turns = kind == LimitKind::heading_rate || kind == LimitKind::look_rate;
        if (kind == LimitKind::turn_rate) {
            span = {1, 0}, axes = 0, functions = 1;
            return;
        }
        const bool drag = !turns && (headed() ? TurningRotors(parameters).drag() : Medium(parameters).drag());
        axes = turns ? 2 : 3;
        const bool two = kind == LimitKind::tilt || kind == LimitKind::heading_rate || kind == LimitKind::unspun_rotors;
        functions = two ? 2 : of_yaw() ? YawedRotors::functions : 1;
        span.low = kind == LimitKind::look_rate ? 0 : 1;
        span.high = kind == LimitKind::look_rate ? 1 : kind == LimitKind::body_rate ? 3 : rotors() || turns_body() ? 4 : 2;
        if (!drag && (kind == LimitKind::body_rate || rotors() || turns_body())) span.low = 2;
        if (!drag && kind == LimitKind::body_rate) products = 3;
        if (!drag && kind == LimitKind::unspun_rotors) products = 6;
    }

    static bool known(const MomentaryLimit &asked, std::int64_t dim) {
        const bool turns = asked.kind == static_cast<std::int64_t>(LimitKind::heading_rate) ||
                           asked.kind == static_cast<std::int64_t>(LimitKind::look_rate);
        const bool heading = asked.kind == static_cast<std::int64_t>(LimitKind::turn_rate);  // alone
        return asked.kind >= 0 && asked.kind <= static_cast<std::int64_t>(LimitKind::turning_body_rate) &&
               dim >= (heading ? 1
                       : turns ? 2
                               : 3);
    }

    bool rotors() const { return kind == LimitKind::unspun_rotors || of_yaw(); }
    bool of_yaw() const { return kind == LimitKind::yawed_rotors || kind == LimitKind::turning_rotors; }
    bool turns_body() const { return kind == LimitKind::turning_rotors || kind == LimitKind::turning_body_rate; }
    bool headed() const { return turns_body() || kind == LimitKind::turn_rate; }  // by what is given beside the derivatives
    int inputs() const { return span.count() * axes; }
    bool follows() const { return along && turns_body(); }
    int given() const { return inputs() + (headed() ? TurningRotors::heading : 0); }  // with the heading, after them
    int order(int input) const { return input < inputs() ? span.low + input / axes : timed ? 0 : (input - inputs()) / 2; }

    // All functions at four instants from the derivatives, by order, then by axis, and the heading; and their change along a change of those.
    void values(const Quad *u, Quad *out) const;
    void slopes(const Quad *u, const Quad *step, Quad *out) const;

    // Their change with the angle of the heading and with its two derivatives.
    void by_angle(const Quad *u, Quad (*found)[3]) const;

    // Add up for weights of the functions, `stride` apart.
    void gather(const Quad *u, const RowWeights &weights, int stride, InstantTerms &terms) const;

private:
    // All functions. Where the number of inputs is known, only the kinds that have as many, and second derivatives, are compiled.
    template <int known = 0, class Real>
    void functions_at(const Real *u, Real *out) const {
        if constexpr (known == 0 || known == 4) {
            if (kind == LimitKind::heading_rate) return heading_rate(parameters, u, out);
            if (kind == LimitKind::look_rate) return look_rate(parameters, u, out);
        }
        if constexpr (known != 4) {
            Space<Real> x[4];
            for (int q = span.low; q <= span.high; ++q, u += 3) x[q - 1] = {u[0], u[1], u[2]};
            if constexpr (known == 0 || known == 6) {
                if (kind == LimitKind::least_thrust) return least_thrust(parameters, x, out);
                if (kind == LimitKind::most_thrust) return most_thrust(parameters, x, out);
                if (kind == LimitKind::tilt) return tilt(parameters, x, out);
            }
            if constexpr (known == 0) {
                if (kind == LimitKind::yawed_rotors) return yawed_rotors(parameters, x, out);
                if (kind == LimitKind::turning_rotors) return turning_rotors(parameters, x, u, out);
                if (kind == LimitKind::turn_rate) return turn_rate(parameters, u, out);
                if (kind == LimitKind::turning_body_rate) return turning_body_rate(parameters, x, u, out);
            }
            if constexpr (known != 6) of_turning(x, out);
        }
    }

    // Those of bodies that turn, by products.
    template <class Real>
    void of_turning(const Space<Real> *x, Real *out) const {
        const Medium m(parameters);
        const Lift<Real> f(m, x, span.high - 2);
        const Real square = inner(f.force, f.force) + m.floor();
        Real found[5] = {};
        products_of(f, square, span.high - 2, found);
        of_products(found, rotors() ? f.thrust(m, root(square), x[0]) : Real(0.0), out);
    }

    template <class Real>
    void of_products(const Real *found, const Real &thrust, Real *out) const {
        if (kind == LimitKind::body_rate) return body_rate(parameters, found, out);
        UnspunRotors(parameters).at(found, thrust, out);
    }

    friend struct GatheredLimit;
};

}  // namespace minsnap

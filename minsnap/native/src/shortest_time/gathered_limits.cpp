// Limits on several derivatives at four instants at once: values, changes along a step, weighted sums of first and second derivatives.
#include "arithmetic/wide.hpp"
#include "shortest_time/instant_limits.hpp"
#include "vehicle/rotor_gradients.hpp"

namespace minsnap {

// Place in the lower triangle of a symmetric matrix.
constexpr int bend_at(int row, int column) { return row * (row + 1) / 2 + column; }

// Derivatives of `body_rate` in the thrust and the relative products x, of which most are zeros.
MINSNAP_INLINE void body_rate_bent(const double *p, const Quad *x, Curved<3, Quad> *out) {
    const double limit = p[Medium::values], unit = 0.5 / (limit * limit);
    out->slope[1] = -unit * (x[1] + x[1]);
    out->slope[2] = filled<Quad>(unit);
    out->bend[bend_at(1, 1)] = filled<Quad>(-2.0 * unit);
}

// The same of `unspun_rotors`, whose functions differ but in the sign of the mean thrust.
MINSNAP_INLINE void unspun_rotors_bent(const double *p, const Quad *x, Curved<6, Quad> *out) {
    constexpr int count = 6;
    const Quad &pull = x[1], &bent = x[3];
    const UnspunRotors rotors(p);
    const UnspunRotors::Torque<Quad> torque(x + 1);
    // First derivatives of the turn, then of its root; those in the thrust are left out.
    const Quad twice = pull + pull, across = -twice, inner_pull = torque.across + pull * across, rest = -bent - inner_pull;
    const Quad square = pull * pull;
    Quad slope[count] = {};
    slope[1] = -4.0 * (torque.rest + pull * rest);
    slope[2] = 4.0 * square;
    slope[3] = 4.0 * square - (bent + bent);
    slope[4] = -4.0 * pull;
    slope[5] = filled<Quad>(1.0);
    Quad bend[Curved<count, Quad>::packed] = {};
    bend[bend_at(1, 1)] = -4.0 * (pull * (twice + (twice + twice)) + (rest + rest));
    bend[bend_at(2, 1)] = bend[bend_at(3, 1)] = 8.0 * pull;
    bend[bend_at(4, 1)] = filled<Quad>(-4.0);
    bend[bend_at(3, 3)] = filled<Quad>(-2.0);
    const Quad under = rotors.under(torque.turn), size = root(under), first = 0.5 / size, second = -0.5 * first / under;
    for (int i = 1; i < count; ++i) slope[i] *= rotors.square;
    for (int i = 1; i < count; ++i)
        for (int j = 1; j <= i; ++j) {
            const int t = bend_at(i, j);
            out[0].bend[t] = first * (rotors.square * bend[t]) + second * (slope[i] * slope[j]);
        }
    for (int i = 1; i < count; ++i) out[0].slope[i] = first * slope[i];
    out[0].slope[1] += rotors.gyration * across;
    out[0].slope[2] += rotors.gyration;
    out[0].bend[bend_at(1, 1)] += -2.0 * rotors.gyration;
    out[1] = out[0];
    out[0].slope[0] = filled<Quad>(rotors.mean);
    out[1].slope[0] = filled<Quad>(-rotors.mean);
}

// Call action(gradients, gradient, unit, row, other) for the functions of rotors, or of a body rate, under a heading that turns: in those units; the
// other row, where there is one, has the same gradient but for its sign.
template <int n, class Action>
MINSNAP_INLINE void each_turning(const InstantLimit &limit, const Quad *u, Action &&action) {
    const TurningRotors asked(limit.parameters);
    using Gradients = TurningGradients<n == 12>;
    typename Gradients::Plain heading[TurningRotors::heading];
    Space<typename Gradients::Plain> motion[4];
    for (int q = limit.span.low; q <= limit.span.high; ++q, u += 3)
        motion[q - 1].x.value = u[0], motion[q - 1].y.value = u[1], motion[q - 1].z.value = u[2];
    for (int k = 0; k < TurningRotors::heading; ++k) heading[k].value = u[k];
    Gradients gradients(asked, motion, heading);
    Quad gradient[n];
    if (limit.kind == LimitKind::turning_body_rate) {
        const double most = limit.parameters[TurningRotors::values];
        gradients.of_rate(gradient);
        return action(gradients, gradient, 1.0 / (most * most), 0, -1);
    }
    for (int k = 0; k < asked.rotors; ++k) {
        gradients.of_rotor(asked.mixer + asked.rotors * k, gradient);
        action(gradients, gradient, 1.0 / asked.most, k, k + asked.rotors);
    }
    gradients.of_cone(gradient);
    action(gradients, gradient, asked.unit(), asked.cone, -1);
}

// Weighted sums of one limit.
struct GatheredLimit {
    static constexpr int together = InstantTerms::together;

    const InstantLimit &limit;
    const RowWeights &weights;
    int stride;

    void add(const Quad *u, InstantTerms &terms) const {
        if (limit.products == 3) return widely([&]() MINSNAP_INLINED { products<2>(u, terms); });
        if (limit.products == 6) return widely([&]() MINSNAP_INLINED { products<3>(u, terms); });
        if (limit.kind == LimitKind::yawed_rotors)
            return widely([&]() MINSNAP_INLINED { limit.inputs() == 9 ? of_rotors<9>(u, terms) : of_rotors<12>(u, terms); });
        if (limit.kind == LimitKind::turn_rate) return of_turn_rate(u, terms);
        if (limit.headed())
            return widely([&]()
                              MINSNAP_INLINED { limit.inputs() == 9 ? of_turning_rotors<9>(u, terms) : of_turning_rotors<12>(u, terms); });
        switch (limit.inputs()) {
            case 4: return widely([&]() MINSNAP_INLINED { directly<4>(u, terms); });
            case 6: return widely([&]() MINSNAP_INLINED { directly<6>(u, terms); });
            case 9: return directly<9>(u, terms);
            default: return directly<12>(u, terms);
        }
    }

private:
    template <int n>
    MINSNAP_INLINE void directly(const Quad *u, InstantTerms &terms) const {
        Curved<n, Quad> x[n], out[InstantLimit::most_functions];
        for (int i = 0; i < n; ++i) x[i] = Curved<n, Quad>::unknown(u[i], i);
        limit.functions_at<n>(x, out);
        sum(out, terms);
        mirror<n>(terms);
    }

    // First derivatives alone: second ones of rotors are indefinite, which makes steps short, and took four fifths of a search.
    template <int n>
    MINSNAP_INLINE void of_rotors(const Quad *u, InstantTerms &terms) const {
        const Medium medium(limit.parameters);
        const YawedRotors asked(limit.parameters);
        const double unit = 1.0 / asked.most;
        using Gradients = RotorGradients<n == 12>;
        Space<typename Gradients::Plain> motion[4];
        for (int q = limit.span.low; q <= limit.span.high; ++q, u += 3)
            motion[q - 1].x.value = u[0], motion[q - 1].y.value = u[1], motion[q - 1].z.value = u[2];
        const Gradients gradients(medium, motion, asked.mass, asked.heading, asked.inertia);
        const auto weight = [&](const double *of, int function) MINSNAP_INLINED { return four(of + function * stride); };
        clear<n>(terms);
        Quad gradient[n];
        for (int k = 0; k < asked.rotors; ++k) {  // the most and the least thrust share a gradient
            const int other = k + asked.rotors;
            gradients.of_rotor(asked.mixer + asked.rotors * k, gradient);
            add<n>(gradient, unit * (weight(weights.hessian, k) - weight(weights.hessian, other)),
                   (unit * unit) * (weight(weights.outer, k) + weight(weights.outer, other)),
                   unit * (weight(weights.gradient, k) - weight(weights.gradient, other)), terms);
        }
        gradients.of_cone(asked.heading, asked.share, gradient);
        add<n>(gradient, asked.unit * weight(weights.hessian, asked.cone), (asked.unit * asked.unit) * weight(weights.outer, asked.cone),
               asked.unit * weight(weights.gradient, asked.cone), terms);
        mirror<n>(terms);
    }

    // Its change with the logarithm of the own duration alone.
    void of_turn_rate(const Quad *u, InstantTerms &terms) const {
        const double limit_rate = limit.parameters[0];
        const double unit = limit.timed ? 0.0 : -1.0 / (limit_rate * limit_rate);
        const Quad change = unit * (u[2] * u[2] + u[3] * u[3]);
        terms.own_slope = four(weights.gradient) * change;
        terms.own_bend = four(weights.outer) * change * change - 2.0 * four(weights.hessian) * change;
    }

    // The same where the heading turns.
    template <int n>
    MINSNAP_INLINE void of_turning_rotors(const Quad *u, InstantTerms &terms) const {
        const auto weight = [&](const double *of, int function) MINSNAP_INLINED { return four(of + function * stride); };
        clear<n>(terms);
        clear_own<n>(terms);
        each_turning<n>(limit, u, [&](const auto &gradients, const Quad *gradient, double unit, int row, int other) MINSNAP_INLINED {
            const auto both = [&](const double *of, double sign)
                                  MINSNAP_INLINED { return other < 0 ? weight(of, row) : weight(of, row) + sign * weight(of, other); };
            const Quad bent = unit * both(weights.hessian, -1.0), crossed = (unit * unit) * both(weights.outer, 1.0),
                       sloped = unit * both(weights.gradient, -1.0), along = crossed * gradients.own;
            add<n>(gradient, bent, crossed, sloped, terms);
            for (int i = 0; i < n; ++i) terms.crossed[i] += along * gradient[i];
            terms.own_slope += sloped * gradients.own;
            terms.own_bend += along * gradients.own + bent * gradients.own_bend;
        });
        mirror<n>(terms);
        if (limit.timed) clear_own<n>(terms);
    }

    // Add a function without second derivatives: weights of its gradient as Hessians are, of the outer product, of the gradient.
    template <int n>
    static MINSNAP_INLINE void add(const Quad *gradient, const Quad &bent, const Quad &crossed, const Quad &sloped, InstantTerms &terms) {
        for (int i = 0; i < n; ++i) {
            terms.slope[i] += sloped * gradient[i];
            terms.pull[i] += bent * gradient[i];
            const Quad scaled = crossed * gradient[i];
            for (int j = 0; j <= i; ++j) terms.bend[i][j] += scaled * gradient[j];
        }
    }

    template <int n>
    static MINSNAP_INLINE void clear(InstantTerms &terms) {
        for (int i = 0; i < n; ++i) {
            terms.slope[i] = terms.pull[i] = Quad{};
            for (int j = 0; j <= i; ++j) terms.bend[i][j] = Quad{};
        }
    }

    template <int n>
    static MINSNAP_INLINE void clear_own(InstantTerms &terms) {
        terms.own_slope = terms.own_bend = Quad{};
        for (int i = 0; i < n; ++i) terms.crossed[i] = Quad{};
    }

    template <int n>
    static MINSNAP_INLINE void mirror(InstantTerms &terms) {
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < i; ++j) terms.bend[j][i] = terms.bend[i][j];
    }

    // The lower triangle of the bends, and all slopes.
    template <int n>
    MINSNAP_INLINE void sum(const Curved<n, Quad> *out, InstantTerms &terms) const {
        clear<n>(terms);
        for (int k = 0; k < limit.functions; ++k) {
            const Quad bent = four(weights.hessian + k * stride), crossed = four(weights.outer + k * stride),
                       sloped = four(weights.gradient + k * stride);
            for (int i = 0, t = 0; i < n; ++i) {
                terms.slope[i] += sloped * out[k].slope[i];
                terms.pull[i] += bent * out[k].slope[i];
                for (int j = 0; j <= i; ++j, ++t) terms.bend[i][j] += bent * out[k].bend[t] + crossed * out[k].slope[i] * out[k].slope[j];
            }
        }
    }

    // Place of the product of two of f and its derivatives.
    static constexpr int place(int a, int b) { return a > b ? bend_at(a, b) : bend_at(b, a); }

    // By the products of f and its derivatives, of which the derivatives are the vectors themselves: a product turns only with its own two vectors.
    template <int vectors>
    MINSNAP_INLINE void products(const Quad *u, InstantTerms &terms) const {
        constexpr int n = 3 * vectors, count = vectors * (vectors + 1) / 2;
        Quad f[n], found[count], half[count][n];  // found: the thrust, then the products relative to f.f
        for (int i = 0; i < n; ++i) f[i] = i == 2 ? u[i] + limit.parameters[0] : u[i];
        for (int a = 0; a < vectors; ++a)
            for (int b = 0; b <= a; ++b)
                found[place(a, b)] = f[3 * a] * f[3 * b] + f[3 * a + 1] * f[3 * b + 1] + f[3 * a + 2] * f[3 * b + 2];
        const Quad square = found[0] + Medium(limit.parameters).floor(), inverse = 1.0 / square;
        found[0] = root(square);
        for (int t = 1; t < count; ++t) found[t] *= inverse;
        InstantTerms own;
        Curved<count, Quad> out[2];
        if constexpr (vectors == 2)
            body_rate_bent(limit.parameters, found, out);
        else
            unspun_rotors_bent(limit.parameters, found, out);
        sum(out, own);
        to_products<count>(found, inverse, own);
        const auto turned = [&f](const auto &value, int a, int c) MINSNAP_INLINED {
            Quad total{};
            for (int b = 0; b < vectors; ++b) total += (a == b ? 2.0 * f[3 * b + c] : f[3 * b + c]) * value(place(a, b));
            return total;
        };
        for (int i = 0; i < n; ++i) {
            const int a = i / 3, c = i % 3;
            terms.slope[i] = turned([&own](int t) MINSNAP_INLINED { return own.slope[t]; }, a, c);
            terms.pull[i] = turned([&own](int t) MINSNAP_INLINED { return own.pull[t]; }, a, c);
            for (int t = 0; t < count; ++t)
                half[t][i] = turned([&own, t](int o) MINSNAP_INLINED { return t > o ? own.bend[t][o] : own.bend[o][t]; }, a, c);
        }
        for (int i = 0; i < n; ++i)
            for (int j = 0; j <= i; ++j) {
                Quad bend = turned([&half, j](int t) MINSNAP_INLINED { return half[t][j]; }, i / 3, i % 3);
                if (i % 3 == j % 3) bend += i == j ? 2.0 * own.pull[place(i / 3, i / 3)] : own.pull[place(i / 3, j / 3)];
                terms.bend[i][j] = terms.bend[j][i] = bend;
            }
    }

    // From sums in the thrust and the relative products to sums in the products: these are v = p / F and the thrust is the root of F, the first product,
    // so that dv/dF = -v / F. The lower triangle of the bends.
    template <int count>
    static MINSNAP_INLINE void to_products(const Quad *v, const Quad &inverse, InstantTerms &sums) {
        const Quad first = 0.5 * v[0] * inverse, second = -0.5 * first * inverse;  // derivatives of the thrust in F
        Quad slope{}, pull{}, mixed{}, bend{};
        for (int k = 1; k < count; ++k) {
            slope += sums.slope[k] * v[k];
            pull += sums.pull[k] * v[k];
            mixed += sums.bend[k][0] * v[k];
            Quad turned{};
            for (int o = 1; o < count; ++o) turned += (k > o ? sums.bend[k][o] : sums.bend[o][k]) * v[o];
            bend += turned * v[k];
            sums.bend[k][0] = inverse * (first * sums.bend[k][0] - inverse * (turned + sums.pull[k]));
        }
        sums.bend[0][0] =
            first * (first * sums.bend[0][0] - 2.0 * inverse * mixed) + inverse * inverse * (bend + 2.0 * pull) + second * sums.pull[0];
        sums.slope[0] = first * sums.slope[0] - inverse * slope;
        sums.pull[0] = first * sums.pull[0] - inverse * pull;
        for (int k = 1; k < count; ++k) {
            sums.slope[k] *= inverse;
            sums.pull[k] *= inverse;
            for (int o = 1; o <= k; ++o) sums.bend[k][o] *= inverse * inverse;
        }
    }
};

void InstantLimit::values(const Quad *u, Quad *out) const {
    widely([&]() MINSNAP_INLINED {
        Dual<0, Quad> x[most_inputs], found[most_functions];
        for (int n = 0; n < given(); ++n) x[n].value = u[n];
        functions_at(x, found);
        for (int f = 0; f < functions; ++f) out[f] = found[f].value;
    });
}

void InstantLimit::slopes(const Quad *u, const Quad *step, Quad *out) const {
    widely([&]() MINSNAP_INLINED {
        Dual<1, Quad> x[most_inputs], found[most_functions];
        for (int n = 0; n < given(); ++n) x[n].value = u[n], x[n].slope[0] = step[n];
        functions_at(x, found);
        for (int f = 0; f < functions; ++f) out[f] = found[f].slope[0];
    });
}

void InstantLimit::by_angle(const Quad *u, Quad (*found)[3]) const {
    const auto write = [&](const auto &gradients, const Quad *, double unit, int row, int other) MINSNAP_INLINED {
        gradients.by_angle(found[row]);
        for (int k = 0; k < 3; ++k) {
            found[row][k] *= unit;
            if (other >= 0) found[other][k] = -found[row][k];
        }
    };
    widely([&]() MINSNAP_INLINED {
        if (kind != LimitKind::turn_rate) return inputs() == 9 ? each_turning<9>(*this, u, write) : each_turning<12>(*this, u, write);
        found[0][0] = found[0][2] = Quad{};
        found[0][1] = (1.0 / (parameters[0] * parameters[0])) * (u[0] * u[3] - u[1] * u[2]);
    });
}

void InstantLimit::gather(const Quad *u, const RowWeights &weights, int stride, InstantTerms &terms) const {
    GatheredLimit{*this, weights, stride}.add(u, terms);
}

}  // namespace minsnap

// Control points of a leg from the states at its ends.
//
// Of a polynomial of degree n = 2k - 1 the first k control points depend on the start alone, the last k on the end:
// p_j = sum over i <= j of C(j, i) (n - i)! / n! T^i x^(i)(0), and the same backwards with the sign of odd orders turned
// (G. Farin, "Curves and Surfaces for CAGD", chapter 5).  So both ends are met exactly.
#pragma once

#include <cmath>
#include <cstdint>

#include "chain/sweep.hpp"

namespace minsnap {

// C(j, i) (n - i)! / n!
template <int half>
constexpr double end_factor(int j, int i) {
    double value = 1.0;
    for (int m = 0; m < i; ++m) value = value * (j - m) / ((m + 1) * (2.0 * half - 1.0 - m));
    return value;
}

template <int half>
struct EndFactors {
    double of[half][half] = {};

    constexpr EndFactors() {
        for (int j = 0; j < half; ++j)
            for (int i = 0; i <= j; ++i) of[j][i] = end_factor<half>(j, i);
    }
};

// Where the optimum of a chain goes: control points (legs, 2k, stride) and states (legs + 1, k - 1, stride), or null.
struct Output {
    double *points = nullptr;
    double *states = nullptr;
};

// A sink of sweep.hpp: writes every leg and keeps a sum that is not finite if one of its derivatives is not.
template <int half, int dim>
class LegWriter {
public:
    LegWriter(const ChainProblem &chain, int axis, Output out) : chain_(chain), axis_(axis), out_(out) {}

    MINSNAP_INLINE void operator()(std::int64_t leg, const double (&left)[half - 1][dim], const double (&right)[half - 1][dim]) {
        if (out_.points != nullptr) write_points(leg, left, right);
        if (out_.states != nullptr) {
            keep(leg, left);
            keep(leg + 1, right);
        }
    }

    bool finite() const { return isfinite(sum_); }

private:
    void keep(std::int64_t knot, const double (&state)[half - 1][dim]) {
        double *place = out_.states + knot * (half - 1) * chain_.stride + axis_;
        for (int a = 0; a < half - 1; ++a)
            for (int d = 0; d < dim; ++d) sum_ += place[a * chain_.stride + d] = state[a][d];
    }

    MINSNAP_INLINE void write_points(std::int64_t leg, const double (&left)[half - 1][dim], const double (&right)[half - 1][dim]) {
        const std::int64_t stride = chain_.stride;
        const double *from = chain_.points + leg * stride + axis_, *to = from + stride;
        double *place = out_.points + leg * 2 * half * stride + axis_;
        const double duration = chain_.durations[leg];
        write_end(from, left, duration, place, stride);
        write_end(to, right, -duration, place + (2 * half - 1) * stride, -stride);
    }

    MINSNAP_INLINE void write_end(const double *point, const double (&state)[half - 1][dim], double duration, double *place,
                                  std::int64_t stride) {
        static constexpr EndFactors<half> factors{};
        double scaled[half - 1][dim], power = duration;
        MINSNAP_UNROLL
        for (int a = 0; a < half - 1; ++a) {
            MINSNAP_UNROLL
            for (int d = 0; d < dim; ++d) sum_ += scaled[a][d] = power * state[a][d];
            power *= duration;
        }
        MINSNAP_UNROLL
        for (int j = 0; j < half; ++j) {
            MINSNAP_UNROLL
            for (int d = 0; d < dim; ++d) {
                double offset = 0.0;
                MINSNAP_UNROLL
                for (int a = 0; a < j; ++a) offset += factors.of[j][a + 1] * scaled[a][d];
                place[j * stride + d] = point[d] + offset;
            }
        }
    }

    const ChainProblem &chain_;
    int axis_;
    Output out_;
    double sum_ = 0.0;
};

}  // namespace minsnap

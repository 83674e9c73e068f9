// Control points of what a certificate looks at, each with a running error bound: derivatives of a piece, their
// components along a normal, their squared norm. The stored control points and durations are taken as exact.
#pragma once

#include <cstdint>

#include "polynomials/extrema.hpp"
#include "arithmetic/rounding.hpp"

namespace minsnap {

constexpr int max_curve_degree = max_scalar_degree / 2;
constexpr int max_curve_dim = 8;
constexpr int max_order = 8;

constexpr double longest_vector = 0x1p300, longest_normal = 0x1p60;  // of their entries, so that no product overflows
constexpr double longest_duration = 0x1p40;                          // [s]; the shortest is one over it

// Whether all values are numbers of a size up to a limit.
inline bool within(const double *values, std::int64_t count, double limit) {
    bool all = true;
    for (std::int64_t i = 0; i < count; ++i) all = all && std::fabs(values[i]) <= limit;
    return all;
}

// A scalar polynomial.
struct Scalar {
    int degree;
    double value[max_scalar_degree + 1];
    double error[max_scalar_degree + 1];
};

// A curve, one coordinate after the other.
struct Curve {
    int degree;
    int dim;
    double value[max_curve_dim][max_curve_degree + 1];
    double error[max_curve_dim][max_curve_degree + 1];
};

// A trajectory as it is stored: control points (pieces, degree + 1, dim), durations (pieces,).
struct Pieces {
    const double *points;
    const double *durations;
    std::int64_t count;
    int degree;
    int dim;

    // Whether the numbers are of sizes for which nothing overflows.
    bool sound() const {
        if (!within(points, count * (degree + 1) * dim, longest_vector)) return false;
        for (std::int64_t i = 0; i < count; ++i)
            if (!(durations[i] >= 1.0 / longest_duration && durations[i] <= longest_duration)) return false;
        return true;
    }
};

// Replace control points by their differences: fl(a - b) is off by at most u |result|.
inline void take_differences(double *value, double *error, int degree) {
    for (int j = 0; j < degree; ++j) {
        value[j] = value[j + 1] - value[j];
        error[j] = error[j + 1] + error[j] + unit * std::fabs(value[j]);
    }
}

// The derivative of that order of one piece: n! / (n - p)! times differences over T^p. The factor is an integer below
// 2^53; T^p carries p - 1 roundings, the product and the quotient one each.
inline void derivative(const Pieces &pieces, std::int64_t piece, int order, Curve &curve) {
    const int n = pieces.degree;
    curve.dim = pieces.dim;
    curve.degree = order <= n ? n - order : 0;
    double factor = 1.0, power = 1.0;
    for (int p = 0; p < order && p <= n; ++p) {
        factor *= n - p;
        power *= pieces.durations[piece];
    }
    for (int d = 0; d < pieces.dim; ++d) {
        double *value = curve.value[d], *error = curve.error[d];
        const double *stored = pieces.points + piece * (n + 1) * pieces.dim + d;
        for (int j = 0; j <= n; ++j) {
            value[j] = stored[j * pieces.dim];
            error[j] = 0.0;
        }
        for (int p = 0; p < order && p < n; ++p) take_differences(value, error, n - p);
        if (order > n) value[0] = error[0] = 0.0;
        if (order == 0 || order > n) continue;
        for (int j = 0; j <= curve.degree; ++j) {
            value[j] = factor * value[j] / power;
            error[j] = factor * error[j] / power + (order + 1) * unit * std::fabs(value[j]);
        }
    }
}

// Take a point away from a curve; the rounding of each difference is known exactly.
inline void subtract(const double *point, Curve &curve) {
    for (int d = 0; d < curve.dim; ++d) {
        const double a = point[d];
        if (a == 0.0) continue;
        for (int j = 0; j <= curve.degree; ++j) {
            const double before = curve.value[d][j], after = before - a;
            curve.error[d][j] += difference_error(before, a, after);
            curve.value[d][j] = after;
        }
    }
}

// A derivative relative to a point, of the piece, order and point that were asked for last.
class Relative {
public:
    explicit Relative(const Pieces &pieces) : pieces_(pieces) {}

    const Curve &operator()(std::int64_t piece, int order, const double *anchor) {
        bool same = piece == piece_ && order == order_;
        for (int d = 0; same && d < pieces_.dim; ++d) same = anchor[d] == anchor_[d];
        if (same) return curve_;
        derivative(pieces_, piece, order, curve_);
        subtract(anchor, curve_);
        piece_ = piece;
        order_ = order;
        for (int d = 0; d < pieces_.dim; ++d) anchor_[d] = anchor[d];
        return curve_;
    }

private:
    const Pieces pieces_;
    std::int64_t piece_ = -1;
    int order_ = 0;
    double anchor_[max_curve_dim] = {};
    Curve curve_;
};

// Component of a curve along a normal. Products and sums of dim terms are off by at most dim u sum |n x| (Higham,
// section 3.1); multiplying by 0, 1 or -1 is exact, so a lone such term is.
inline void along(const Curve &curve, const double *normal, Scalar &scalar) {
    const int n = scalar.degree = curve.degree;
    double magnitude[max_curve_degree + 1];
    for (int j = 0; j <= n; ++j) scalar.value[j] = scalar.error[j] = magnitude[j] = 0.0;
    int terms = 0;
    bool plain = true;
    for (int d = 0; d < curve.dim; ++d) {
        const double factor = normal[d], size = std::fabs(factor);
        if (factor == 0.0) continue;
        ++terms;
        plain = plain && size == 1.0;
        for (int j = 0; j <= n; ++j) {
            const double product = factor * curve.value[d][j];
            scalar.value[j] += product;
            scalar.error[j] += size * curve.error[d][j];
            magnitude[j] += std::fabs(product);
        }
    }
    if (terms <= 1 && plain) return;
    for (int j = 0; j <= n; ++j) scalar.error[j] += terms * unit * magnitude[j];
}

// sign scalar - bound, as a new polynomial. True if its control points show that it does not raise what is known.
inline bool beyond(const Scalar &scalar, double bound, double sign, Greatest &best, Scalar &excess) {
    const double share = bound == 0.0 ? 0.0 : unit;
    double highest = -__builtin_huge_val();
    for (int j = 0; j <= scalar.degree; ++j) {
        const double value = sign * scalar.value[j] - bound;
        excess.value[j] = value;
        excess.error[j] = scalar.error[j] + share * std::fabs(value);
        const double upper = above(value, excess.error[j]);
        if (upper > highest) highest = upper;
    }
    excess.degree = scalar.degree;
    if (!best.reaches(highest)) return false;
    best.admit(highest);
    return true;
}

// Squared norm of a curve x of degree n: control point k of degree 2n is the sum over i + j = k of
// C(n, i) C(n, j) x_i . x_j / C(2n, k). With g = C x off by f, each product is off by |g_i| f_j + f_i |g_j| + f_i f_j;
// summed over i + j = k that is at most the sum of (2 |g_i| + f_i) f_j, since i and j may be exchanged. A product and
// a sum over at most dim (n + 1) terms add dim (n + 1) u sum |g_i| |g_j|, which is the same as making every f larger by
// dim (n + 1) u |g| / 2; the factors and the quotient are off by at most 2 u and 3 u.
inline void squared_norm(const Curve &curve, const double *binomials, const double *doubled, Scalar &square) {
    const int n = curve.degree;
    square.degree = 2 * n;
    for (int k = 0; k <= 2 * n; ++k) square.value[k] = square.error[k] = 0.0;
    const double share = unit * (curve.dim * (n + 1) / 2.0 + 4.0);
    for (int d = 0; d < curve.dim; ++d) {
        double g[max_curve_degree + 1], f[max_curve_degree + 1], wide[max_curve_degree + 1];
        for (int j = 0; j <= n; ++j) {
            g[j] = binomials[j] * curve.value[d][j];
            f[j] = binomials[j] * curve.error[d][j] + share * std::fabs(g[j]);
            wide[j] = 2.0 * std::fabs(g[j]) + f[j];
        }
        for (int i = 0; i <= n; ++i) {
            for (int j = 0; j <= n; ++j) {
                square.value[i + j] += g[i] * g[j];
                square.error[i + j] += wide[i] * f[j];
            }
        }
    }
    for (int k = 0; k <= 2 * n; ++k) {
        square.value[k] /= doubled[k];
        square.error[k] = square.error[k] / doubled[k];
    }
}

// Binomial coefficients C(n, 0) ... C(n, n): exact up to n = 56, beyond that off by at most u each.
void binomial_row(int n, double *row);

struct Binomials {
    double single[max_scalar_degree + 1], doubled[max_scalar_degree + 1];

    explicit Binomials(int degree) {
        binomial_row(degree, single);
        binomial_row(2 * degree, doubled);
    }
};

// A matrix (rows, dim) times a curve; false if its squares would overflow.
inline bool map(const Curve &curve, const double *matrix, int rows, Curve &mapped) {
    Scalar component;
    mapped.degree = curve.degree;
    mapped.dim = rows;
    for (int q = 0; q < rows; ++q) {
        along(curve, matrix + q * curve.dim, component);
        for (int j = 0; j <= curve.degree; ++j) {
            if (!(std::fabs(component.value[j]) < 0x1p450)) return false;
            mapped.value[q][j] = component.value[j];
            mapped.error[q][j] = component.error[j];
        }
    }
    return true;
}

// Make a curve the point at its start (0) or end (1).
inline void keep_end(Curve &curve, int end) {
    for (int q = 0; q < curve.dim; ++q) {
        curve.value[q][0] = curve.value[q][end * curve.degree];
        curve.error[q][0] = curve.error[q][end * curve.degree];
    }
    curve.degree = 0;
}

// Raise what is known by |y| - radius, from the squared norm of y.
template <class Search>
inline void climb_ball(Search &climb, const Scalar &square, double radius, std::int64_t row, Greatest &best) {
    const double reach = radius + best.attained;
    const double lowest = -__builtin_huge_val();
    Greatest mine{reach > 0.0 ? reach * reach * (1.0 - 4.0 * unit) : lowest, lowest, 0.0, -1};
    climb.raise(mine, square.value, square.error, row);
    if (mine.row == row) {
        const double norm = std::sqrt(mine.attained > 0.0 ? mine.attained : 0.0) * (1.0 - 2.0 * unit);
        best.attain(below(norm - radius, unit * std::fabs(norm - radius)), mine.s, row);
    }
    const double norm = std::sqrt(mine.bound > 0.0 ? mine.bound : 0.0) * (1.0 + 4.0 * unit);
    best.admit(above(norm - radius, unit * std::fabs(norm - radius)));
}

}  // namespace minsnap

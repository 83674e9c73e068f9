// Proof that a polynomial of double control points is nowhere positive on 0 <= s <= 1, rounding included.
//
// A polynomial lies in the convex hull of its control points, also after it is split at any instant (Farin 2002,
// section 4.1). Every computed number v carries a bound e of its distance to the exact one, by running error analysis
// (N. J. Higham, "Accuracy and Stability of Numerical Algorithms", 2nd edition, 2002, section 3.3): with
// fl(x op y) = (x op y)(1 + d), |d| <= u = 2^-53, one has |exact - computed| <= u |computed| for the operation itself,
// besides what the operands bring along:
//
//   sum, difference   e = e_x + e_y + u |v|
//   factor c, exact   e = |c| e_x + u |v|,  nothing added where c is 1 or -1
//   quotient          e = e_x / |c| + u |v|
//
// The bounds are sums of non-negative terms; computed in double themselves, they are multiplied by ``padding``, which
// is more than the (1 + u)^n that their own roundings amount to, n being below 1000. Subtracting zero and adding to
// zero are exact and bring nothing: so a curve that begins on a face of a box is inside it to the last bit.
#pragma once

#include <cmath>

#include "walls.hpp"

namespace minsnap {

struct Bounded {
    double value = 0.0, error = 0.0;
};

constexpr double unit_roundoff = 0x1p-53, padding = 1.0 + 0x1p-40;

inline Bounded difference(Bounded a, Bounded b) {
    const double value = a.value - b.value;
    const bool exact = a.value == 0.0 || b.value == 0.0;
    return {value, padding * (a.error + b.error + (exact ? 0.0 : unit_roundoff * std::fabs(value)))};
}

inline Bounded product(double factor, Bounded a) {
    const double value = factor * a.value, size = std::fabs(factor);
    const double own = size == 1.0 || size == 0.0 ? 0.0 : unit_roundoff * std::fabs(value);
    return {value, padding * (size * a.error + own)};
}

inline Bounded quotient(Bounded a, double divisor) {
    const double value = a.value / divisor;
    return {value, padding * (a.error / divisor + unit_roundoff * std::fabs(value))};
}

// Derivative of control points (2k,) of one coordinate, in place; returns the degree left.
inline int differentiate_bounded(Bounded *own, int degree, std::int64_t order, double duration) {
    for (std::int64_t q = 0; q < order; ++q, --degree)
        for (int j = 0; j < degree; ++j)
            own[j] = quotient(product(degree, difference(own[j + 1], own[j])), duration);
    return degree;
}

// n.(r^(p) - a) - b on a piece with control points (2k, dim): its control points; returns their degree.
inline int bounded_excess(const GivenWalls &walls, std::int64_t index, const double *points, int count, int dim,
                          double duration, Bounded *excess) {
    const double *const normal = walls.normal + index * dim, *const anchor = walls.anchor + index * dim;
    const int degree = count - 1 - int(walls.order[index]);
    for (int j = 0; j <= degree; ++j) excess[j] = {};
    for (int axis = 0; axis < dim; ++axis) {
        if (normal[axis] == 0.0) continue;
        Bounded own[max_points];
        for (int j = 0; j < count; ++j) own[j] = {points[j * dim + axis], 0.0};
        differentiate_bounded(own, count - 1, walls.order[index], duration);
        for (int j = 0; j <= degree; ++j)
            excess[j] = difference(excess[j], product(-normal[axis], difference(own[j], {anchor[axis], 0.0})));
    }
    for (int j = 0; j <= degree; ++j) excess[j] = difference(excess[j], {walls.bound[index], 0.0});
    return degree;
}

// (1 - s) a + s b for s a multiple of 2^-30, so that 1 - s is exact. Both products and the sum are rounded.
inline Bounded blend(Bounded a, Bounded b, double s) {
    const double left = (1.0 - s) * a.value, right = s * b.value;
    const double own = 2.0 * unit_roundoff * (std::fabs(left) + std::fabs(right));
    return {left + right, padding * ((1.0 - s) * a.error + s * b.error + own)};
}

inline void split_bounded(const Bounded *points, int degree, double s, Bounded *before, Bounded *after) {
    for (int j = 0; j <= degree; ++j) after[j] = points[j];
    before[0] = after[0];
    for (int m = degree; m > 0; --m) {
        for (int j = 0; j < m; ++j) after[j] = blend(after[j], after[j + 1], s);
        before[degree - m + 1] = after[0];
    }
}

inline bool proved_at(Bounded point) { return point.value + point.error <= 0.0; }

// Where to split: near the largest value, where both parts are then likely monotone; any choice is valid.
inline double place_to_split(const Bounded *points, int degree) {
    double plain[max_points];
    int top = 0;
    for (int j = 0; j <= degree; ++j) {
        plain[j] = points[j].value;
        if (plain[j] > plain[top]) top = j;
    }
    double s = double(top) / degree;
    for (int step = 0; step < 6; ++step) {
        const Jet<double> jet = jet_at(plain, degree, s);
        if (!(jet.curvature < 0.0)) return 0.5;
        const double next = s - jet.slope / jet.curvature;
        if (!(next > 0.0 && next < 1.0)) return 0.5;
        if (std::fabs(next - s) < 1e-10) break;
        s = next;
    }
    s = std::round(s * 0x1p30) * 0x1p-30;
    return s > 0.01 && s < 0.99 ? s : 0.5;
}

// Whether the polynomial is nowhere positive; if that is not proved, ``where`` is an instant of this part near which it
// may be positive.
inline bool nowhere_positive(const Bounded *points, int degree, int depth, double &where) {
    bool inside = true;
    for (int j = 0; j <= degree && inside; ++j) inside = proved_at(points[j]);
    if (inside) return true;
    where = points[degree].value > points[0].value ? 1.0 : 0.0;
    if (!proved_at(points[0]) || !proved_at(points[degree]) || depth == 0) return false;
    const double s = place_to_split(points, degree);
    Bounded before[max_points], after[max_points];
    split_bounded(points, degree, s, before, after);
    if (!nowhere_positive(before, degree, depth - 1, where)) {
        where *= s;
        return false;
    }
    if (!nowhere_positive(after, degree, depth - 1, where)) {
        where = s + where * (1.0 - s);
        return false;
    }
    return true;
}

constexpr int deepest = 50;

// Whether a wall is kept at every instant of its piece by control points (pieces, 2k, dim) in metres; if that is not
// proved, ``where`` is an instant in question.
inline bool wall_kept(const GivenWalls &walls, std::int64_t index, const double *points, int count, int dim,
                      const double *durations, double &where) {
    const std::int64_t piece = walls.piece_of(index);
    Bounded excess[max_points];
    const int degree = bounded_excess(walls, index, points + piece * count * dim, count, dim, durations[piece], excess);
    if (walls.when == nullptr || walls.when[index] < 0) return nowhere_positive(excess, degree, deepest, where);
    where = double(walls.when[index]);
    return proved_at(excess[walls.when[index] == 0 ? 0 : degree]);
}

}  // namespace minsnap

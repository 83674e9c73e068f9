// The proof of proof.hpp, compiled once for all who use it.
#include "certificate/proof.hpp"

// As in certificate.cpp: short loops are slower when gcc vectorises them.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("no-tree-vectorize")
#endif

namespace minsnap {
namespace {

constexpr double infinity = __builtin_huge_val();

// The certificate looks at walls in another order, and its bounds may differ: for balls errors are doubled, and this
// share of the radius is left.
constexpr double more = 2.0;
constexpr double less = 64.0 * unit;

template <class Job>
void with_climb(int degree, Job job) {
    if (degree == 14) {
        Climb<14> climb(degree);
        job(climb);
    } else {
        Climb<-1, max_products - 1> climb(degree);
        job(climb);
    }
}

bool is_cone(const double *normal, int dim) {
    for (int d = 0; d < dim; ++d)
        if (normal[d] != 0.0) return true;
    return false;
}

}  // namespace

bool Proof::takes(std::int64_t wall) const {
    const int dim = pieces_.dim;
    if (walls_.is_ball(wall) && !within(walls_.matrix_of(wall, dim), dim * dim, longest_normal)) return false;
    return sound_ && within(walls_.normal + wall * dim, dim, longest_normal) && within(walls_.anchor + wall * dim, dim, longest_vector) &&
           within(walls_.bound + wall, 1, longest_vector);
}

Greatest Proof::excess(std::int64_t wall) {
    if (!takes(wall)) return {infinity, infinity, 0.5, wall};
    if (walls_.is_ball(wall)) return ball_excess(wall);
    const int dim = pieces_.dim, order = int(walls_.order[wall]);
    Scalar component, excess;
    along(relative_(walls_.piece_of(wall), order, walls_.anchor + wall * dim), walls_.normal + wall * dim, component);
    Greatest kept{0.0, -infinity, 0.0, wall};
    const bool settled = beyond(component, walls_.bound[wall], 1.0, kept, excess);
    // The certificate looks at walls in another order; so its bounds may differ, by less than the largest error, where
    // they are more than what is attained.
    const int n = excess.degree;
    double room = 0.0;
    for (int j = 0; j <= n; ++j) room = excess.error[j] > room ? excess.error[j] : room;
    if (settled && above(kept.bound, room) <= 0.0) return kept;
    if (walls_.when_of(wall) != When::always) {
        const int end = walls_.when_of(wall) == When::start ? 0 : n;
        const double value = excess.value[end], error = excess.error[end];
        return {below(value, error), above(value, error), double(int(walls_.when_of(wall))), wall};
    }
    Greatest best{-infinity, -infinity, 0.0, wall};
    if (n == 7)
        Climb<7>(n).raise(best, excess.value, excess.error, wall);
    else
        Climb<-1, max_points - 1>(n).raise(best, excess.value, excess.error, wall);
    if (best.bound > best.attained) best.bound = above(best.bound, room);
    return best;
}

// First whether it is kept, then, if not, by how much and where it is not.
Greatest Proof::ball_excess(std::int64_t wall) {
    const int dim = pieces_.dim;
    Curve mapped;
    const Curve &curve = relative_(walls_.piece_of(wall), int(walls_.order[wall]), walls_.anchor + wall * dim);
    if (!map(curve, walls_.matrix_of(wall, dim), dim, mapped)) return {infinity, infinity, 0.5, wall};
    const bool momentary = walls_.when_of(wall) != When::always;
    if (momentary) keep_end(mapped, int(walls_.when_of(wall)));
    if (is_cone(walls_.normal + wall * dim, dim)) return cone_excess(wall, curve, mapped);
    const Binomials binomials(mapped.degree);
    Scalar square;
    squared_norm(mapped, binomials.single, binomials.doubled, square);
    for (int j = 0; j <= square.degree; ++j) square.error[j] *= more;
    const double radius = walls_.bound[wall] * (1.0 - less);
    Greatest best{0.0, -infinity, 0.0, wall};
    with_climb(square.degree, [&](auto &climb) {
        climb_ball(climb, square, radius, wall, best);
        if (best.bound <= 0.0) return;
        best = {-infinity, -infinity, 0.0, wall};
        climb_ball(climb, square, radius, wall, best);
    });
    if (momentary) best.s = double(int(walls_.when_of(wall)));
    return best;
}

// Of a cone |y| <= h, where h = b - n.x grows along an axis: that neither -h nor |y|^2 - h^2 is ever positive. The latter is
// made a length by 2 b. ``mapped`` is y.
Greatest Proof::cone_excess(std::int64_t wall, const Curve &curve, const Curve &mapped) {
    const double bound = walls_.bound[wall] * (1.0 - less), share = 0.5 / bound;
    Curve low;  // -h
    if (!map(curve, walls_.normal + wall * pieces_.dim, 1, low)) return {infinity, infinity, 0.5, wall};
    subtract(&bound, low);
    const bool momentary = walls_.when_of(wall) != When::always;
    if (momentary) keep_end(low, int(walls_.when_of(wall)));
    const Binomials binomials(mapped.degree);
    Scalar excess, height;
    squared_norm(mapped, binomials.single, binomials.doubled, excess);
    squared_norm(low, binomials.single, binomials.doubled, height);
    for (int j = 0; j <= excess.degree; ++j) {
        const double value = excess.value[j] - height.value[j];
        excess.error[j] = share * (more * (excess.error[j] + height.error[j]) + 2.0 * unit * std::fabs(value));
        excess.value[j] = share * value;
    }
    for (int j = 0; j <= low.degree; ++j) low.error[0][j] *= more;
    Greatest best{-infinity, -infinity, 0.0, wall};
    Climb<-1, max_products - 1> round(excess.degree), flat(low.degree);
    round.raise(best, excess.value, excess.error, wall);
    flat.raise(best, low.value[0], low.error[0], wall);
    if (momentary) best.s = double(int(walls_.when_of(wall)));
    return best;
}

}  // namespace minsnap

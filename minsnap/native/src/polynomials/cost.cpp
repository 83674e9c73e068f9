// What pieces cost: integrals of the squared norm of a derivative.
//
// A derivative of order p has the control points n!/(n-p)! times the p-th differences; with m = n - p and
// G_ij = C(m,i) C(m,j) / C(2m, i+j) / (2m+1) = (U'U)_ij its integral of squares is |U d|^2. Differences carry the rounding
// of those before along (D. E. Knuth, "The Art of Computer Programming", volume 2, theorem 4.2.2B), so that small
// differences of large numbers keep their digits.
#include <algorithm>
#include <cstdint>

#include "arithmetic/lanes.hpp"
#include "arithmetic/wide.hpp"
#include "basics/export.hpp"
#include "basics/status.hpp"
#include "polynomials/bernstein.hpp"

namespace minsnap {
namespace {

constexpr int most_degree = max_points - 1;
constexpr double unit_rounding = 0x1p-53, enough_digits = 1e-12;  // of a cost

// U for polynomials of degree 0 to ``most_degree``.
struct GramRoots {
    double root[max_points][max_points][max_points] = {};

    GramRoots() {
        for (int m = 0; m <= most_degree; ++m) factorise(m);
    }

    void factorise(int m) {
        DoubleDouble factor[max_points][max_points] = {};
        for (int j = 0; j <= m; ++j)
            for (int i = 0; i <= j; ++i) {
                DoubleDouble sum = binomial(m, i) * DoubleDouble(binomial(m, j)) / (binomial(2 * m, i + j) * (2.0 * m + 1.0));
                for (int q = 0; q < i; ++q) sum -= factor[q][i] * factor[q][j];
                factor[i][j] = i == j ? sqrt(sum) : sum / factor[i][i];
                root[m][i][j] = double(factor[i][j]);
            }
    }
};

const GramRoots &gram_roots() {
    static const GramRoots made;
    return made;
}

constexpr int most_at_once = 128, lanes = Lanes<Quad>::count;
constexpr int pieces_ahead = 16, line = 8;  // what is fetched into caches early, and numbers in a line of these

struct Pieces {
    const double *points, *durations;
    std::int64_t count;
    int degree, dim, order;
};

// Costs of a block of pieces, four of them at a time. Sizes are known when compiled for the usual curves: Degree > 0.
template <int Degree, int Order, int Dim>
struct Costs {
    const Pieces &all;
    const GramRoots &roots;
    const std::int64_t begin;
    const int count;
    double *costs;

    MINSNAP_INLINE int degree() const { return Degree > 0 ? Degree : all.degree; }
    MINSNAP_INLINE int order() const { return Degree > 0 ? Order : all.order; }
    MINSNAP_INLINE int dim() const { return Degree > 0 ? Dim : all.dim; }

    // Plain differences, and careful ones where the rounding of these is not small beside the cost.
    MINSNAP_INLINE void operator()() const {
        double growth = 2.0 * order() * unit_rounding / enough_digits;
        for (int q = 1; q < order(); ++q) growth *= 2.0;
        growth *= growth / (degree() - order() + 1);  // the largest eigenvalue of G is one over that
        int rounded[most_at_once + lanes], number = 0;
        for (int k = 0; k < count; k += lanes) {
            int places[lanes];
            for (int lane = 0; lane < lanes; ++lane) places[lane] = std::min(k + lane, count - 1);
            Quad steps{};
            const Quad squares = measure(places, [&](const Quad *value) MINSNAP_INLINED { return plainly(value, steps); });
            for (int lane = 0; lane < lanes; ++lane) {
                rounded[number] = places[lane];
                number += growth * steps[lane] <= squares[lane] ? 0 : 1;
            }
        }
        for (int lane = 0; lane < lanes; ++lane) rounded[number + lane] = rounded[0];
        for (int n = 0; n < number; n += lanes) measure(rounded + n, [&](const Quad *value) MINSNAP_INLINED { return carefully(value); });
    }

    // Write the costs of four pieces: the integrals of squares over the unit interval, which come back, brought to their durations.
    template <class Action>
    MINSNAP_INLINE Quad measure(const int *places, Action squares_of) const {
        const std::int64_t size = (degree() + 1) * dim();
        const double *points[lanes];
        Quad duration{}, squares{};
        for (int lane = 0; lane < lanes; ++lane) {
            points[lane] = all.points + (begin + places[lane]) * size;
            duration[lane] = all.durations[begin + places[lane]];
            for (int at = 0; at < size; at += line) __builtin_prefetch(points[lane] + pieces_ahead * size + at);
        }
        for (int axis = 0; axis < dim(); ++axis) {
            Quad value[max_points] = {};
            MINSNAP_UNROLL
            for (int i = 0; i < max_points; ++i)
                if (i <= degree()) {
                    const int at = i * dim() + axis;
                    value[i] = Quad{points[0][at], points[1][at], points[2][at], points[3][at]};
                }
            squares += squares_of(value);
        }
        double factor = 1.0;
        Quad power = duration;
        for (int q = 0; q < order(); ++q) factor *= degree() - q;
        for (int q = 2; q < 2 * order(); ++q) power *= duration;
        const Quad found = factor * factor * squares / power;
        for (int lane = 0; lane < lanes; ++lane) costs[places[lane]] = found[lane];
        return squares;
    }

    // |U d|^2 of the plain differences d of four polynomials; the squares of the first ones are added to others.
    MINSNAP_INLINE Quad plainly(const Quad *points, Quad &steps) const {
        Quad value[max_points] = {};
        MINSNAP_UNROLL
        for (int i = 0; i < most_degree; ++i)
            if (i < degree()) {
                value[i] = points[i + 1] - points[i];
                steps += value[i] * value[i];
            }
        if (degree() == 7 && order() == 4) return snap(value);
        for (int q = 1; q < order(); ++q)
            for (int i = 0; i < degree() - q; ++i) value[i] = value[i + 1] - value[i];
        return norm(value, degree() - order());
    }

    // The same of snap at degree 7 by its Legendre coefficients, which are sums and differences of the steps.
    static MINSNAP_INLINE Quad snap(const Quad *s) {
        const Quad x = s[6] - s[0], y = s[5] - s[1], z = s[4] - s[2], a = s[6] + s[0], b = s[5] + s[1], c = s[4] + s[2];
        const Quad zero = (x + z) - 2.0 * y, one = (3.0 * a + 5.0 * c) - 8.0 * b;
        const Quad two = (x + 5.0 * z) - 4.0 * y, three = (a + 15.0 * c) - (6.0 * b + 20.0 * s[3]);
        return ((1.0 / 16.0) * (zero * zero) + (3.0 / 400.0) * (one * one)) +
               ((1.0 / 80.0) * (two * two) + (1.0 / 2800.0) * (three * three));
    }

    // |U d|^2 of differences that carry their rounding along.
    MINSNAP_INLINE Quad carefully(const Quad *points) const {
        Quad value[max_points], rounding[max_points] = {};
        std::copy_n(points, max_points, value);
        MINSNAP_UNROLL
        for (int q = 0; q < most_degree; ++q)
            if (q < order()) {
                MINSNAP_UNROLL
                for (int i = 0; i < most_degree; ++i)
                    if (i < degree() - q) {
                        const Quad a = value[i], b = value[i + 1], difference = b - a, back = b - difference;
                        rounding[i] = rounding[i + 1] - rounding[i] + ((b - (difference + back)) - (a - back));
                        value[i] = difference;
                    }
            }
        for (int i = 0; i <= degree() - order(); ++i) value[i] += rounding[i];
        return norm(value, degree() - order());
    }

    MINSNAP_INLINE Quad norm(const Quad *value, int m) const {
        Quad total{};
        for (int i = 0; i <= m; ++i) {
            Quad sum{};
            for (int j = i; j <= m; ++j) sum += roots.root[m][i][j] * value[j];
            total += sum * sum;
        }
        return total;
    }
};

void costs_of_block(const Pieces &all, std::int64_t begin, int count, double *costs) {
    if (all.degree == 7 && all.order == 4 && all.dim == 3)
        widely(Costs<7, 4, 3>{all, gram_roots(), begin, count, costs});
    else
        widely(Costs<0, 0, 0>{all, gram_roots(), begin, count, costs});
}

double sum_of_block(const double *costs, int count) {
    double sums[8] = {};
    int k = 0;
    for (; k + 8 <= count; k += 8)
        for (int lane = 0; lane < 8; ++lane) sums[lane] += costs[k + lane];
    double sum = ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
    for (; k < count; ++k) sum += costs[k];
    return sum;
}

// The sum of the costs of pieces, by halves where they are many, so that few roundings add up: to the bit what NumPy makes of them. The
// costs are kept where they are asked for.
double sum_of(const Pieces &all, std::int64_t begin, std::int64_t count, double *costs) {
    if (count > most_at_once) {
        const std::int64_t half = count / 2 / 8 * 8;
        const double sum = sum_of(all, begin, half, costs);
        return sum + sum_of(all, begin + half, count - half, costs);
    }
    double room[most_at_once], *found = costs == nullptr ? room : costs + begin;
    costs_of_block(all, begin, static_cast<int>(count), found);
    return sum_of_block(found, static_cast<int>(count));
}

}  // namespace
}  // namespace minsnap

// The integral of the squared norm of the order-th derivative: control points (pieces, degree + 1, dim) and durations (pieces,) in; that
// of each piece, (pieces,), where there is room for it, and of all of them out.
MINSNAP_EXPORT std::int32_t minsnap_costs(std::int32_t pieces, std::int32_t degree, std::int32_t dim, const double *points,
                                          const double *durations, std::int32_t order, double *costs, double *total) {
    using namespace minsnap;
    if (pieces < 1 || degree < 0 || dim < 1 || order < 1 || order > degree) return std::int32_t(Status::bad_size);
    if (degree > most_degree || dim > max_dim) return std::int32_t(Status::unsupported);
    const Pieces all{points, durations, pieces, degree, dim, order};
    *total = sum_of(all, 0, pieces, costs);
    return std::int32_t(Status::done);
}

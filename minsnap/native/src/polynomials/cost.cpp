// What pieces cost: integrals of the squared norm of a derivative.
//
// A derivative of order p has the control points n!/(n-p)! times the p-th differences; with m = n - p and
// G_ij = C(m,i) C(m,j) / C(2m, i+j) / (2m+1) = (U'U)_ij its integral of squares is |U d|^2. Differences carry the rounding
// of those before along (D. E. Knuth, "The Art of Computer Programming", volume 2, theorem 4.2.2B), so that small
// differences of large numbers keep their digits.
#include <algorithm>
#include <cstdint>

#include "arithmetic/elementary.hpp"
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

// Rows of four coordinates at a time; those beyond the last one are of no account. Degree and order are known when compiled
// for the usual curves: Degree > 0.
template <int Degree, int Order>
struct Costs {
    const double *points, *durations;
    std::int64_t pieces;
    int degree_, dim, order_;
    const GramRoots &roots;
    double *costs;

    MINSNAP_INLINE void operator()() const {
        const int degree = Degree > 0 ? Degree : degree_, order = Degree > 0 ? Order : order_;
        double factor = 1.0, growth = 2.0 * order * unit_rounding / enough_digits;
        for (int q = 0; q < order; ++q) factor *= degree - q, growth *= q ? 2.0 : 1.0;
        const int size = (degree + 1) * dim;
        const auto cost = [&](const double *from, double duration) MINSNAP_INLINED {
            double sum = 0.0;
            for (int axis = 0; axis < dim; axis += 4) sum += squares(from + axis, degree, order, growth * growth, dim - axis);
            return factor * factor * sum / power(duration, 2 * order - 1);
        };
        std::int64_t piece = 0;
        for (; (pieces - piece - 1) * size >= 3; ++piece) costs[piece] = cost(points + piece * size, durations[piece]);
        double last[max_points * max_dim + 3] = {};  // rows of four go up to three numbers beyond the end of a piece
        for (; piece < pieces; ++piece) {
            std::copy_n(points + piece * size, size, last);
            costs[piece] = cost(last, durations[piece]);
        }
    }

    // |U d|^2 of the differences d: plain ones where their rounding is small beside it.
    MINSNAP_INLINE double squares(const double *from, int degree, int order, double growth, int count) const {
        Quad plain[max_points] = {}, steps{};
        MINSNAP_UNROLL
        for (int i = 0; i < most_degree; ++i)
            if (i < degree) {
                plain[i] = four(from + (i + 1) * dim) - four(from + i * dim);
                steps += plain[i] * plain[i];
            }
        MINSNAP_UNROLL
        for (int q = 1; q < most_degree; ++q)
            if (q < order) {
                MINSNAP_UNROLL
                for (int i = 0; i < most_degree - 1; ++i)
                    if (i < degree - q) plain[i] = plain[i + 1] - plain[i];
            }
        const Pair sums = sums_of(norm(plain, degree - order), steps, count);
        return growth * sums[1] <= sums[0] ? sums[0] : carefully(from, degree, order, count);
    }

    // Apart, so that the plain ones stay in registers.
    MINSNAP_APART double carefully(const double *from, int degree, int order, int count) const {
        Quad value[max_points], rounding[max_points] = {};
        for (int i = 0; i <= degree; ++i) value[i] = four(from + i * dim);
        for (int q = 0; q < order; ++q)
            for (int i = 0; i < degree - q; ++i) {
                const Quad a = value[i], b = value[i + 1], difference = b - a, back = b - difference;
                rounding[i] = rounding[i + 1] - rounding[i] + ((b - (difference + back)) - (a - back));
                value[i] = difference;
            }
        for (int i = 0; i <= degree - order; ++i) value[i] += rounding[i];
        return sums_of(norm(value, degree - order), Quad(), count)[0];
    }

    MINSNAP_INLINE Quad norm(const Quad *value, int m) const {
        Quad total{};
        MINSNAP_UNROLL
        for (int i = 0; i < most_degree; ++i)
            if (i <= m) {
                Quad sum = roots.root[m][i][i] * value[i];
                MINSNAP_UNROLL
                for (int j = i + 1; j < most_degree; ++j)
                    if (j <= m) sum += roots.root[m][i][j] * value[j];
                total += sum * sum;
            }
        return total;
    }

    // Sums of the coordinates that there are, of two at once.
    static MINSNAP_INLINE Pair sums_of(const Quad &one, const Quad &other, int count) {
        Pair sums = {one[0], other[0]};
        for (int d = 1; d < 4; ++d)
            if (d < count) sums += Pair{one[d], other[d]};
        return sums;
    }
};

}  // namespace
}  // namespace minsnap

// The integral of the squared norm of the order-th derivative of each piece: control points (pieces, degree + 1, dim) and
// durations (pieces,) in, costs (pieces,) out.
MINSNAP_EXPORT std::int32_t minsnap_costs(std::int64_t pieces, std::int64_t degree, std::int64_t dim, std::int64_t order,
                                          const double *points, const double *durations, double *costs) {
    using namespace minsnap;
    if (pieces < 1 || degree < 0 || dim < 1 || order < 1 || order > degree) return std::int32_t(Status::bad_size);
    if (degree > most_degree || dim > max_dim) return std::int32_t(Status::unsupported);
    const GramRoots &roots = gram_roots();
    if (degree == 7 && order == 4)
        widely(Costs<7, 4>{points, durations, pieces, 7, int(dim), 4, roots, costs});
    else
        widely(Costs<0, 0>{points, durations, pieces, int(degree), int(dim), int(order), roots, costs});
    return std::int32_t(Status::done);
}

// What pieces cost: integrals of the squared norm of a derivative.
//
// A derivative of order p has the control points n!/(n-p)! times the p-th differences; with m = n - p and
// G_ij = C(m,i) C(m,j) / C(2m, i+j) / (2m+1) = (U'U)_ij its integral of squares is |U d|^2. Differences carry the rounding
// of those before along (D. E. Knuth, "The Art of Computer Programming", volume 2, theorem 4.2.2B), so that small
// differences of large numbers keep their digits.
#include <cstdint>

#include "arithmetic/elementary.hpp"
#include "arithmetic/wide.hpp"
#include "basics/export.hpp"
#include "basics/status.hpp"
#include "polynomials/bernstein.hpp"

namespace minsnap {
namespace {

constexpr int most_degree = max_points - 1, most_values = max_points * max_dim;

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

// Degree, coordinates and order are known when compiled for the usual curves: Dim > 0.
template <int Degree, int Dim, int Order>
struct Costs {
    const double *points, *durations;
    std::int64_t pieces;
    int degree_, dim_, order_;
    const GramRoots &roots;
    double *costs;

    __attribute__((always_inline)) void operator()() const {
        const int degree = Dim > 0 ? Degree : degree_, dim = Dim > 0 ? Dim : dim_, order = Dim > 0 ? Order : order_;
        double factor = 1.0;
        for (int q = 0; q < order; ++q) factor *= degree - q;
        for (std::int64_t piece = 0; piece < pieces; ++piece) {
            constexpr int most = Dim > 0 ? (Degree + 1) * Dim : most_values;
            double value[most], rounding[most] = {};
            int left = (degree + 1) * dim;
            const double *const own = points + piece * left;
            for (int i = 0; i < left; ++i) value[i] = own[i];
            for (int q = 0; q < order; ++q) {
                left -= dim;
                for (int i = 0; i < left; ++i) {
                    const double a = value[i], b = value[i + dim], difference = b - a, back = b - difference;
                    rounding[i] = rounding[i + dim] - rounding[i] + ((b - (difference + back)) - (a - back));
                    value[i] = difference;
                }
            }
            for (int i = 0; i < left; ++i) value[i] = factor * (value[i] + rounding[i]);
            costs[piece] = squares(value, degree - order, dim) / power(durations[piece], 2 * order - 1);
        }
    }

    __attribute__((always_inline)) double squares(const double *value, int m, int dim) const {
        double total = 0.0;
        for (int i = 0; i <= m; ++i) {
            double sums[max_dim] = {};
            for (int j = i; j <= m; ++j)
                for (int d = 0; d < dim; ++d) sums[d] += roots.root[m][i][j] * value[j * dim + d];
            for (int d = 0; d < dim; ++d) total += sums[d] * sums[d];
        }
        return total;
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
    if (degree == 7 && dim == 3 && order == 4)
        widely(Costs<7, 3, 4>{points, durations, pieces, 7, 3, 4, roots, costs});
    else
        widely(Costs<0, 0, 0>{points, durations, pieces, int(degree), int(dim), int(order), roots, costs});
    return std::int32_t(Status::done);
}

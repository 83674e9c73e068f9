// Evaluation of piecewise polynomials in Bernstein form, and of their derivatives, at any instants.
//
// Piece i is r(t) = sum of B_j(s) p_ij with s = (t - t_i) / T_i in [0, 1]; pieces are half-open, the last is closed.  The
// weights B_j are not negative and sum to one (G. Farin, "Curves and Surfaces for CAGD", chapter 5), so knots are met
// exactly and rounding stays relative to the control points.  Instants in the same piece are taken together.
// Helpers are inlined whatever the flags: code for wide registers passes vectors between functions in another way.
#undef MINSNAP_INLINE
#include "polynomials/evaluate.hpp"

#include <algorithm>
#include <cstdint>

#include "basics/buffer.hpp"
#include "basics/dispatch.hpp"
#include "basics/export.hpp"
#include "arithmetic/lanes.hpp"
#include "basics/status.hpp"

namespace minsnap {
namespace {

constexpr int most_degree = 63;
constexpr std::int64_t many_instants = 16;
constexpr double rounding = 1e-12;  // share of the duration by which an instant may be outside; it counts as the end

struct Binomials {
    double of[most_degree + 1][most_degree + 1] = {};

    constexpr Binomials() {
        for (int n = 0; n <= most_degree; ++n) {
            of[n][0] = of[n][n] = 1.0;
            for (int j = 1; j < n; ++j) of[n][j] = of[n - 1][j - 1] + of[n - 1][j];
        }
    }
};

constexpr Binomials binomials{};

// The derivative of one piece of a curve: its control points, made when the piece changes.
class Piece {
public:
    Piece(const PiecewiseCurve &curve, int order, double *room)
        : curve_(curve), order_(order), room_(room), duration_(curve.breaks[curve.pieces]) {}

    int degree() const { return curve_.degree - order_; }
    const double *points() const { return points_; }

    // Whether an instant is within the curve's interval, but for rounding.
    bool outside(double t) const {
        const double slack = rounding * duration_;
        return !(t >= -slack && t <= duration_ + slack);
    }

    double inside(double t) const { return std::min(std::max(t, 0.0), duration_); }

    bool holds(double t) const { return t >= begin_ && t < end_; }

    void go_to(double t) {
        const double *last = curve_.breaks + curve_.pieces;
        std::int64_t index = index_ + 1;  // the next piece more often than not
        if (!(index < curve_.pieces && t >= curve_.breaks[index] && t < curve_.breaks[index + 1]))
            index = std::max<std::int64_t>(std::upper_bound(curve_.breaks, last, t) - curve_.breaks - 1, 0);
        index_ = index;
        begin_ = curve_.breaks[index], end_ = curve_.breaks[index + 1], length_ = curve_.durations[index];
        differentiate(curve_.points + index * (curve_.degree + 1) * curve_.dim);
    }

    // Share of the piece's duration that has passed.
    double share(double t) const { return t == end_ ? 1.0 : std::min(std::max((t - begin_) / length_, 0.0), 1.0); }

private:
    void differentiate(const double *points) {
        if (order_ == 0) {
            points_ = points;
            return;
        }
        const int dim = curve_.dim;
        std::copy(points, points + (curve_.degree + 1) * dim, room_);
        for (int p = 0; p < order_; ++p) {
            const double factor = curve_.degree - p;
            for (int i = 0; i < (curve_.degree - p) * dim; ++i) room_[i] = factor * (room_[i + dim] - room_[i]);
        }
        double power = length_;
        for (int p = 1; p < order_; ++p) power *= length_;
        for (int i = 0; i < (degree() + 1) * dim; ++i) room_[i] /= power;
        points_ = room_;
    }

    const PiecewiseCurve &curve_;
    int order_;
    double *room_;
    double duration_;
    const double *points_ = nullptr;
    std::int64_t index_ = -1;
    double begin_ = 0.0, end_ = -1.0, length_ = 1.0;
};

// Values of dim polynomials, Bernstein control points (degree + 1, stride), at the shares s, lane by lane.
template <int dim, class Real>
MINSNAP_INLINE void evaluate(const double *points, int degree, int stride, Real s, Real (&values)[dim]) {
    Real falling[most_degree + 1], rising = filled<Real>(1.0);
    const Real rest = 1.0 - s;
    falling[0] = rising;
    for (int j = 1; j <= degree; ++j) falling[j] = falling[j - 1] * rest;
    for (int d = 0; d < dim; ++d) values[d] = Real{};
    for (int j = 0; j <= degree; ++j) {
        const Real weight = binomials.of[degree][j] * rising * falling[degree - j];
        MINSNAP_UNROLL
        for (int d = 0; d < dim; ++d) values[d] += weight * points[j * stride + d];
        rising *= s;
    }
}

// Some axes at the lanes' instants, from the first axis on: out is (lanes, stride).
template <int dim, class Real>
MINSNAP_INLINE void write_axes(const Piece &piece, int stride, int axis, Real s, double *out) {
    Real values[dim];
    evaluate<dim>(piece.points() + axis, piece.degree(), stride, s, values);
    for (int lane = 0; lane < Lanes<Real>::count; ++lane)
        for (int d = 0; d < dim; ++d) out[lane * stride + axis + d] = Lanes<Real>::get(values[d], lane);
}

// The lanes' instants, all axes.
template <class Real>
MINSNAP_INLINE void write_all_axes(const Piece &piece, int dim, const double *t, double *out) {
    Real s{};
    for (int lane = 0; lane < Lanes<Real>::count; ++lane) Lanes<Real>::set(s, lane, piece.share(t[lane]));
    for (int axis = 0; axis < dim; axis += axes_at_once) {
        if (dim - axis == 1)
            write_axes<1>(piece, dim, axis, s, out);
        else if (dim - axis == 2)
            write_axes<2>(piece, dim, axis, s, out);
        else
            write_axes<3>(piece, dim, axis, s, out);
    }
}

template <int lanes>
MINSNAP_INLINE bool ahead(const Piece &piece, const double *t) {
    bool all = true;
    for (int lane = 0; lane < lanes; ++lane) all = all && piece.holds(t[lane]);
    return all;
}

template <class Vector>
MINSNAP_INLINE Status evaluate_all(const PiecewiseCurve &curve, int order, const double *t, std::int64_t count, double *room, double *out) {
    constexpr int lanes = Lanes<Vector>::count;
    Piece piece(curve, order, room);
    for (std::int64_t i = 0; i < count;) {
        if (i + lanes <= count && ahead<lanes>(piece, t + i)) {
            write_all_axes<Vector>(piece, curve.dim, t + i, out + i * curve.dim);
            i += lanes;
            continue;
        }
        if (piece.outside(t[i])) return Status::bad_number;
        const double inside = piece.inside(t[i]);
        if (!piece.holds(inside)) {
            piece.go_to(inside);
            if (i + lanes <= count && ahead<lanes>(piece, t + i)) continue;
        }
        write_all_axes<double>(piece, curve.dim, &inside, out + i * curve.dim);
        ++i;
    }
    return Status::done;
}

#if defined(__x86_64__)
// The same with the wide registers of newer processors: 3.5 times faster, to the same bits.
__attribute__((target("avx2"))) Status evaluate_wide(const PiecewiseCurve &curve, int order, const double *t, std::int64_t count,
                                                     double *room, double *out) {
    return evaluate_all<Quad>(curve, order, t, count, room, out);
}

bool has_wide_registers() { return __builtin_cpu_supports("avx2"); }
#else
Status evaluate_wide(const PiecewiseCurve &curve, int order, const double *t, std::int64_t count, double *room, double *out) {
    return evaluate_all<Pair>(curve, order, t, count, room, out);
}

bool has_wide_registers() { return false; }
#endif

// A derivative beyond the degree.
Status evaluate_zeros(const PiecewiseCurve &curve, const double *t, std::int64_t count, double *out) {
    const Piece piece(curve, 0, nullptr);
    for (std::int64_t i = 0; i < count; ++i)
        if (piece.outside(t[i])) return Status::bad_number;
    std::fill(out, out + count * curve.dim, 0.0);
    return Status::done;
}

Status evaluate_narrow(const PiecewiseCurve &curve, int order, const double *t, std::int64_t count, double *room, double *out) {
    return evaluate_all<Pair>(curve, order, t, count, room, out);
}

}  // namespace

Status evaluate_curve(const PiecewiseCurve &curve, int order, const double *t, std::int64_t count, double *out) {
    if (curve.pieces < 1 || curve.degree < 0 || curve.dim < 1 || order < 0 || count < 0) return Status::bad_size;
    if (curve.degree > most_degree || curve.dim > most_axes) return Status::unsupported;
    if (order > curve.degree) return evaluate_zeros(curve, t, count, out);
    constexpr int small = 64;
    double few[small];
    Buffer<double> many;
    const int size = order == 0 ? 0 : (curve.degree + 1) * curve.dim;
    if (size > small && !many.allocate(static_cast<std::size_t>(size))) return Status::no_memory;
    const auto evaluate = count >= many_instants && has_wide_registers() ? evaluate_wide : evaluate_narrow;
    return evaluate(curve, order, t, count, size > small ? many.data() : few, out);
}

}  // namespace minsnap

// The same, for Python.
MINSNAP_EXPORT std::int32_t minsnap_evaluate(const void *curve, std::int32_t order, const double *t, std::int64_t count, double *out) {
    using namespace minsnap;
    return static_cast<std::int32_t>(evaluate_curve(*static_cast<const PiecewiseCurve *>(curve), order, t, count, out));
}

// At one instant: (dim,).
MINSNAP_EXPORT std::int32_t minsnap_evaluate_one(const void *curve, std::int32_t order, double t, double *out) {
    return minsnap_evaluate(curve, order, &t, 1, out);
}

// The derivatives 0 ... orders - 1 at instants (count,) [s]: (count, orders, dim).
MINSNAP_EXPORT std::int32_t minsnap_evaluate_states(const void *curve, std::int32_t orders, const double *t, std::int64_t count,
                                                    double *out) {
    const std::int32_t dim = static_cast<const minsnap::PiecewiseCurve *>(curve)->dim;
    std::int32_t status = 0;
    for (std::int64_t i = 0; i < count && status == 0; ++i)
        for (std::int32_t order = 0; order < orders && status == 0; ++order, out += dim)
            status = minsnap_evaluate(curve, order, t + i, 1, out);
    return status;
}

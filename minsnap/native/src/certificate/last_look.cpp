// The last look of last_look.hpp, and its entry points.
#include "certificate/last_look.hpp"

#include <cmath>

#include "basics/export.hpp"
#include "basics/for_all.hpp"
#include "certificate/proof.hpp"

namespace minsnap {
namespace {

// Shares of derivatives and of positions that are rounding, as in the certificate.
constexpr double exact = 1e-9, stored = 8.0 * unit;

// A component of a row that is shorter is rounding: the leg is along that axis.
constexpr double along_axis = 1e-12;

inline double larger(double a, double b) { return a > b ? a : b; }

// Differences of one order more of control points that stand one after the other, ``count`` values of them left.
inline void differ(double *row, int dim, int count) {
    for (int j = 0; j < count; ++j) row[j] = row[j + dim] - row[j];
}

template <int Order, int Dim>
class Look {
public:
    Look(const Asked &asked, const double *curve) : asked_(asked), curve_(curve), stride_(std::int64_t(asked.degree + 1) * asked.dim) {}

    bool keeps() const {
        return passes() && joins() && in_state(asked_.start, curve_, dim(), asked_.durations[0]) &&
               in_state(asked_.end, last_of(pieces() - 1), -dim(), -asked_.durations[pieces() - 1]) &&
               (asked_.widths == nullptr || inside());
    }

private:
    static constexpr int most = Dim > 0 ? Dim : max_curve_dim;

    int dim() const { return Dim > 0 ? Dim : asked_.dim; }
    std::int64_t pieces() const { return asked_.legs * asked_.pieces; }
    const double *first_of(std::int64_t piece) const { return curve_ + piece * stride_; }
    const double *last_of(std::int64_t piece) const { return first_of(piece) + asked_.degree * dim(); }

    bool passes() const {
        for (std::int64_t leg = 0; leg < asked_.legs; ++leg) {
            const double *const from = asked_.points + leg * dim(), *const start = first_of(leg * asked_.pieces),
                                *const end = last_of((leg + 1) * asked_.pieces - 1);
            for (int d = 0; d < dim(); ++d)
                if (start[d] != from[d] || end[d] != from[dim() + d]) return false;
        }
        return true;
    }

    // Both sides of every knot agree to rounding, which is measured there alone: less than the certificate allows.
    bool joins() const {
        const int dim = this->dim(), count = Order * dim;
        for (std::int64_t piece = 1; piece < pieces(); ++piece) {
            const double before = 1.0 / asked_.durations[piece - 1], after = 1.0 / asked_.durations[piece];
            double old[(Order + 1) * most], now[(Order + 1) * most], size = 0.0, slower = 1.0, faster = 1.0;
            for (int j = 0; j < count + dim; ++j) old[j] = last_of(piece - 1)[j - count], now[j] = first_of(piece)[j];
            bool same = true;
            for (int d = 0; d < dim; ++d) same &= old[count + d] == now[d], size = larger(size, std::fabs(now[d]));
            double rounding = larger(stored * size, steps_below);
            const double growth = 2.0 * larger(before, after);
            for (int p = 1; p <= Order; ++p) {
                const int left = count - p * dim;
                differ(old, dim, left + dim), differ(now, dim, left + dim);
                slower *= before, faster *= after, rounding *= growth;
                for (int d = 0; d < dim; ++d) {
                    const double arrives = slower * old[left + d], leaves = faster * now[d];
                    same &= std::fabs(leaves - arrives) <= exact * std::fabs(leaves) + rounding;
                }
            }
            if (!same) return false;
        }
        return true;
    }

    // At the start, or at the end, whose control points are looked at backwards.
    bool in_state(const double *state, const double *from, int step, double duration) const {
        if (state == nullptr) {
            for (int j = step; j != step * (asked_.pinned + 1); j += step)
                for (int d = 0; d < dim(); ++d)
                    if (from[j + d] != from[d]) return false;
            return true;
        }
        double row[(Order + 1) * most], size = 0.0, factor = 1.0;
        for (int j = 0; j <= asked_.pinned; ++j)
            for (int d = 0; d < dim(); ++d) row[j * dim() + d] = from[j * step + d];
        for (int d = 0; d < dim(); ++d) size = larger(size, std::fabs(from[d]));
        double rounding = stored * size;
        for (int p = 1; p <= asked_.pinned; ++p, state += dim()) {
            const double share = (asked_.degree + 1 - p) / duration;
            differ(row, dim(), (asked_.pinned + 1 - p) * dim());
            factor *= share, rounding *= 2.0 * std::fabs(share);
            for (int d = 0; d < dim(); ++d)
                if (!(std::fabs(factor * row[d] - state[d]) <= exact * std::fabs(state[d]) + rounding)) return false;
        }
        return true;
    }

    // |e_axis . (I - u u') (r - r_leg)| <= width on every leg.
    bool inside() const {
        const std::int64_t none[2 * most] = {};
        for (std::int64_t leg = 0; leg < asked_.legs; ++leg) {
            const double *const from = asked_.points + leg * dim();
            double along[most], normal[2 * most * most], anchor[2 * most * most], width[2 * most], length = 0.0;
            for (int d = 0; d < dim(); ++d) along[d] = from[dim() + d] - from[d], length += along[d] * along[d];
            length = std::sqrt(length);
            std::int64_t count = 0;
            for (int axis = 0; axis < dim(); ++axis) {
                double *const row = normal + count * dim();
                double largest = 0.0;
                for (int d = 0; d < dim(); ++d) {
                    row[d] = (d == axis ? 1.0 : 0.0) - along[axis] / length * (along[d] / length);
                    largest = larger(largest, std::fabs(row[d]));
                }
                if (largest <= along_axis || hull_inside(leg, row)) continue;
                for (int d = 0; d < dim(); ++d)
                    row[dim() + d] = -row[d], anchor[count * dim() + d] = anchor[(count + 1) * dim() + d] = from[d];
                width[count] = width[count + 1] = width_of(leg);
                count += 2;
            }
            const GivenWalls walls = {count, none, none, normal, anchor, width, width, nullptr, 0};
            Proof proof(walls, first_of(leg), asked_.durations + leg, 1, asked_.degree + 1, dim());
            for (std::int64_t wall = 0; wall < count; ++wall)
                if (!(proof.excess(wall).bound <= 0.0)) return false;
        }
        return true;
    }

    double width_of(std::int64_t leg) const { return asked_.widths[asked_.shared ? 0 : leg]; }

    // Whether the control points of a leg are inside by more than their rounding: then so is the curve.
    bool hull_inside(std::int64_t leg, const double *row) const {
        const double *const from = asked_.points + leg * dim(), *const curve = first_of(leg);
        double most_across = 0.0, size = 0.0;
        for (int j = 0; j <= asked_.degree; ++j) {
            double across = 0.0;
            for (int d = 0; d < dim(); ++d) {
                across += row[d] * (curve[j * dim() + d] - from[d]);
                size = larger(size, std::fabs(curve[j * dim() + d]) + std::fabs(from[d]));
            }
            most_across = larger(most_across, std::fabs(across));
        }
        return most_across + stored * dim() * size <= width_of(leg);
    }

    const Asked asked_;
    const double *const curve_;
    const std::int64_t stride_;
};

bool well_sized(const Asked &asked) {
    return asked.legs >= 1 && asked.pieces >= 1 && asked.degree >= 1 && asked.degree <= max_curve_degree && asked.dim >= 1 &&
           asked.dim <= max_curve_dim && asked.continuity >= 0 && asked.continuity <= asked.degree && asked.pinned >= 0 &&
           asked.pinned <= (asked.start ? asked.continuity : asked.degree) && (asked.widths == nullptr || asked.pieces == 1);
}

template <int Order>
bool keeps_to(const Asked &asked, const double *curve) {
    switch (asked.dim) {
        case 2: return Look<Order, 2>(asked, curve).keeps();
        case 3: return Look<Order, 3>(asked, curve).keeps();
        default: return Look<Order, 0>(asked, curve).keeps();
    }
}

}  // namespace

bool passes_last_look(const Asked &asked, const double *curve) {
    if (!well_sized(asked)) return false;
    switch (asked.continuity) {
        case 1: return keeps_to<1>(asked, curve);
        case 2: return keeps_to<2>(asked, curve);
        case 3: return keeps_to<3>(asked, curve);
        case 4: return keeps_to<4>(asked, curve);
        case 5: return keeps_to<5>(asked, curve);
        default: return false;
    }
}

}  // namespace minsnap

// Whether a curve keeps what is asked, with states (2, pinned, dim) at its start and end, or at rest there; see Asked.
MINSNAP_EXPORT std::int32_t minsnap_last_look(const double *points, const double *durations, const double *widths, const double *states,
                                              std::int64_t legs, std::int32_t pieces, std::int32_t dim, std::int32_t degree,
                                              std::int32_t continuity, std::int32_t pinned, std::int32_t shared, const double *curve) {
    using namespace minsnap;
    const double *const end = states ? states + std::int64_t(pinned) * dim : nullptr;
    const Asked asked = {points, durations, states, end, widths, shared != 0, legs, pieces, degree, dim, continuity, pinned};
    return std::int32_t(passes_last_look(asked, curve) ? Status::done : Status::not_proved);
}

// The same of the curves of many plans in tubes: statuses that were done become ``not_proved``.
MINSNAP_EXPORT std::int32_t minsnap_last_looks(const minsnap::ManyRecord *many) {
    using namespace minsnap;
    if (!many_fit(*many)) return std::int32_t(Status::bad_size);
    const int dim = int(many->dim), half = int(many->half);
    for_all(many->count, 8, int(many->threads), many->statuses, [=](std::int64_t b) {
        const std::int64_t first = many->offsets[b];
        const Asked asked = {many->points + (first + b) * dim,
                             many->durations + first,
                             nullptr,
                             nullptr,
                             many->widths + first,
                             false,
                             many->offsets[b + 1] - first,
                             1,
                             2 * half - 1,
                             dim,
                             half - 1,
                             half - 1};
        const Status status = Status(many->statuses[b]);
        return status != Status::done || passes_last_look(asked, many->curves + first * 2 * half * dim) ? status : Status::not_proved;
    });
    return std::int32_t(Status::done);
}

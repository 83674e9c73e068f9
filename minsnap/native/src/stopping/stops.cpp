// Ways to come to rest from a moving state, inside the walls of the leg or of the next one: a family in closed form.
//
// A member is the polynomial of degree 2k - 1 that goes on from the state and ends at rest after a given duration, where its k-th derivative has
// the least integral of squares, or a little nearer or further. Members are looked at from the shortest on at a few instants, and those that are
// inside there are proved to be inside at every instant, by the proofs of the certificate, and pass the last look. Where one leaves the first leg
// for the second it is divided, at the instant nearest to its middle at which it is inside of both: short polynomials lose digits.
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "basics/border.hpp"
#include "basics/export.hpp"
#include "basics/status.hpp"
#include "certificate/last_look.hpp"
#include "certificate/proof.hpp"
#include "corridor/flat_walls.hpp"
#include "corridor/request.hpp"
#include "polynomials/leg.hpp"
#include "stopping/settings.hpp"

namespace minsnap {
namespace {

using Settings = StopSettings;

class Stops {
public:
    explicit Stops(StopRecord &asked)
        : p_(asked), size_(int(asked.half)), dim_(int(asked.dim)), legs_(asked.legs < Settings::legs ? 1 : Settings::legs),
          tables_(leg_tables<double>(int(asked.half))) {}

    Status find() {
        for (std::int64_t leg = 0; leg < legs_; ++leg) {
            if (const Status taken = own_[leg].take(p_.cones, p_.walls, dim_, leg); taken != Status::done) return taken;
            put_cap(leg);
        }
        if (const Status taken = limits_.take(p_.cones + p_.walls, p_.limits, dim_, 0, Settings::kept); taken != Status::done) return taken;
        p_.change = 0.0;
        if (p_.member < 0) return proved() ? Status::done : Status::infeasible;
        put_factors(limits_.walls());
        for (std::int64_t leg = 0; leg < legs_; ++leg) put_factors(own_[leg].walls());
        for (; p_.member < Settings::durations * Settings::ends; ++p_.member) {
            put_ends(p_.member);
            if (!looks_good()) continue;
            put_points();
            if (proved()) return Status::done;
        }
        return Status::infeasible;
    }

private:
    // Beyond the waypoint at its end, a leg whose walls run along it, such as a tube, goes on by their width.
    void put_cap(std::int64_t leg) {
        const double *const from = p_.waypoints + leg * dim_, *const to = from + dim_;
        double along[max_curve_dim], length = 0.0, width = infinity;
        for (int d = 0; d < dim_; ++d) along[d] = to[d] - from[d], length += along[d] * along[d];
        for (int d = 0; d < dim_; ++d) along[d] /= std::sqrt(length);
        for (std::int64_t g = 0; g < p_.walls; ++g) width = std::fmin(width, width_along(p_.cones[g], leg, along));
        p_.caps[leg] = width;
        if (width < infinity) own_[leg].add_plane(along, to, width);
    }

    // Least width of a group on a leg, whose rows all run along it; else infinite.
    double width_along(const WallsRecord &group, std::int64_t leg, const double *along) const {
        double width = infinity;
        for (std::int64_t i = 0; i < group.count; ++i) {
            if (group.leg[i] != leg) continue;
            if (group.order != 0 || !is_across(group.slope + i * dim_, along)) return infinity;
            for (std::int64_t q = 0; q < group.rows; ++q)
                if (!is_across(group.matrix + (i * group.rows + q) * dim_, along)) return infinity;
            width = std::fmin(width, group.width[i]);
        }
        return width;
    }

    bool is_across(const double *row, const double *along) const {
        double sum = 0.0;
        for (int d = 0; d < dim_; ++d) sum += row[d] * along[d];
        return std::fabs(sum) <= Settings::across;
    }

    // Factors of the ends in the derivatives that walls bound, at the instants looked at, on the unit interval.
    void put_factors(const GivenWalls &held) {
        for (std::int64_t wall = 0; wall < held.count; ++wall) {
            const int order = int(held.order[wall]);
            if (order > size_.degree() || known_ >> order & 1U) continue;
            known_ |= 1U << order;
            for (int i = 0; i < Settings::instants; ++i) row_factors(size_, tables_, 1.0, order, instant(i), factors_[order][i]);
        }
    }

    static double instant(int i) { return double(i) / (Settings::instants - 1); }

    void put_ends(std::int64_t member) {
        const int half = size_.half();
        p_.duration = Settings::shortest * p_.unit;
        for (std::int64_t i = 0; i < member / Settings::ends; ++i) p_.duration *= Settings::longer;
        double power = 1.0;
        for (int q = 0; q < half; ++q, power *= p_.duration)
            for (int d = 0; d < dim_; ++d) {
                ends_[q][d] = q == 0 ? 0.0 : power * p_.state[q * dim_ + d];
                ends_[half + q][d] = 0.0;
            }
        for (int d = 0; d < dim_; ++d) {
            double sum = 0.0;
            for (int q = 1; q < half; ++q) sum += weight(half, q) * ends_[q][d];
            ends_[half][d] = Settings::reaches[member % Settings::ends] * ends_[1][d] - sum / weight(half, half);
        }
    }

    // Weight of the product of two end derivatives in the cost.
    double weight(int one, int other) const {
        double sum = 0.0;
        for (int i = 0; i < size_.half(); ++i) sum += tables_.root[i][one] * tables_.root[i][other];
        return sum;
    }

    // Whether the ends are inside at the instants looked at; chooses where the second leg is entered, 0 for nowhere.
    bool looks_good() {
        constexpr int last = Settings::instants - 1;
        int in_first = 0;  // instants from the start on
        while (in_first <= last && inside(limits_.walls(), in_first) && inside(own_[0].walls(), in_first)) ++in_first;
        int middle = 0;
        if (in_first <= last) {
            int from = last + 1;  // first instant from which it is inside of the last leg
            while (from > 1 && inside(limits_.walls(), from - 1) && inside(own_[legs_ - 1].walls(), from - 1)) --from;
            for (int i = from; i < in_first && i < last; ++i)
                if (middle == 0 || std::abs(2 * i - last) < std::abs(2 * middle - last)) middle = i;
            if (middle == 0) return false;
        }
        p_.change = instant(middle);
        return true;
    }

    bool inside(const GivenWalls &held, int i) const {
        const double inwards = i > 0 ? Settings::inwards * instant(i) : -Settings::outwards;
        double value[max_curve_dim];
        int order = -1;
        for (std::int64_t wall = 0; wall < held.count; ++wall) {
            if (held.order[wall] != order) put_value(order = int(held.order[wall]), i, value);
            if (!(excess(held, wall, value) + inwards <= 0.0)) return false;
        }
        return true;
    }

    // By how many widths a value of the derivative is outside of a wall.
    double excess(const GivenWalls &held, std::int64_t wall, const double *value) const {
        const double *const normal = held.normal + wall * dim_, *const anchor = held.anchor + wall * dim_;
        double offset[max_curve_dim], along = 0.0, squares = 0.0;
        for (int d = 0; d < dim_; ++d) offset[d] = value[d] - anchor[d], along += normal[d] * offset[d];
        if (held.is_ball(wall)) {
            const double *row = held.matrix_of(wall, dim_);
            for (int q = 0; q < dim_; ++q, row += dim_) {
                double sum = 0.0;
                for (int d = 0; d < dim_; ++d) sum += row[d] * offset[d];
                squares += sum * sum;
            }
        }
        return (std::sqrt(squares) + along - held.bound[wall]) / held.width[wall];
    }

    void put_value(int order, int i, double *value) const {
        double power = 1.0;
        for (int q = 0; q < order; ++q) power *= p_.duration;
        for (int d = 0; d < dim_; ++d) {
            double sum = 0.0;
            if (order <= size_.degree())
                for (int j = 0; j < size_.points(); ++j) sum += factors_[order][i][j] * ends_[j][d];
            value[d] = order > 0 ? sum / power : p_.state[d] + sum;
        }
    }

    void put_points() {
        const int count = size_.points();
        for (int d = 0; d < dim_; ++d) {
            double ends[max_points], points[max_points];
            for (int j = 0; j < count; ++j) ends[j] = ends_[j][d];
            points_from_ends(size_, tables_, ends, points);
            for (int j = 0; j < count; ++j) p_.points[j * dim_ + d] = points[j];
        }
    }

    // Whether the polynomial at ``points``, counted from the start, is a stop. Makes it positions, and divides it where it changes legs.
    bool proved() {
        divide();
        const int parts = p_.change > 0.0 ? 2 : 1, count = size_.points(), stride = count * dim_;
        const double durations[] = {parts == 1 ? p_.duration : p_.change * p_.duration, (1.0 - p_.change) * p_.duration};
        double ends[2 * max_curve_dim];
        for (int d = 0; d < dim_; ++d) ends[d] = p_.state[d], ends[dim_ + d] = p_.points[parts * stride - dim_ + d];
        const Asked asked = {ends, durations, p_.state + dim_, nullptr, nullptr,          false,
                             1,    parts,     size_.degree(),  dim_,    size_.half() - 1, size_.half() - 1};
        if (!passes_last_look(asked, p_.points)) return false;
        p_.limited = 1;
        for (int part = 0; part < parts; ++part) {
            if (!keeps(own_[part], p_.points + part * stride, durations + part)) return false;
            p_.limited = p_.limited && keeps(limits_, p_.points + part * stride, durations + part);
        }
        return true;
    }

    // Counted from the start, and one polynomial, no more; by de Casteljau's algorithm.
    void divide() {
        const int last = size_.points() - 1, parts = p_.change > 0.0 ? 2 : 1;
        for (int d = 0; d < dim_; ++d) {
            double row[max_points], *const place = p_.points + d;
            for (int j = 0; j <= last; ++j) row[j] = place[j * dim_];
            for (int m = last; parts == 2 && m >= 0; --m) {
                place[(last - m) * dim_] = row[0], place[(last + 1 + m) * dim_] = row[m];
                for (int j = 0; j < m; ++j) row[j] += p_.change * (row[j + 1] - row[j]);
            }
            for (int j = 0; j < parts * (last + 1); ++j) place[j * dim_] += p_.state[d];
        }
    }

    bool keeps(const FlatWalls &held, const double *points, const double *duration) const {
        Proof proof(held.walls(), points, duration, 1, size_.points(), dim_);
        for (std::int64_t wall = 0; wall < held.walls().count; ++wall)
            if (!(proof.excess(wall).bound <= 0.0)) return false;
        return true;
    }

    static constexpr double infinity = __builtin_huge_val();

    StopRecord &p_;
    const Degree<0> size_;
    const int dim_, legs_;
    const LegTables<double> &tables_;
    FlatWalls own_[Settings::legs], limits_;
    unsigned known_ = 0;  // bits of the orders that factors are known of
    double factors_[max_points][Settings::instants][max_points];
    double ends_[max_points][max_curve_dim];
};

bool fits(const StopRecord &asked) {
    if (asked.half < 2 || asked.half > max_half || asked.dim < 1 || asked.dim > max_curve_dim || asked.legs < 1 || asked.walls < 0 ||
        asked.limits < 0)
        return false;
    for (std::int64_t g = 0; g < asked.walls + asked.limits; ++g)
        if (asked.cones[g].rows < 0 || asked.cones[g].rows > asked.dim || asked.cones[g].order < 0 || asked.cones[g].order > max_order)
            return false;
    return true;
}

}  // namespace
}  // namespace minsnap

// Find the first member from one on that is proved, or prove a polynomial: see StopRecord; infeasible where there is none.
MINSNAP_EXPORT std::int32_t minsnap_stop(minsnap::StopRecord *asked) {
    using namespace minsnap;
    if (!fits(*asked)) return std::int32_t(Status::bad_size);
    const bool sound = asked->unit > 0.0 && std::isfinite(asked->unit) && all_finite(asked->state, asked->half * asked->dim) &&
                       all_finite(asked->waypoints, (asked->legs + 1) * asked->dim);
    if (!sound) return std::int32_t(Status::bad_number);
    return std::int32_t(Stops(*asked).find());
}

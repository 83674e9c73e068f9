// minsnap.h for C++17: memory that frees itself, arrays as vectors, no exceptions.
//
//     minsnap::Planner planner;
//     minsnap::Problem problem(3);
//     problem.points = {0, 0, 1, 8, 0, 1, 8, 4, 1};
//     problem.total_time = 6.0, problem.widths = {0.3, 0.3};
//     const minsnap::Plan plan = planner.plan(problem);
//     if (plan.status == MINSNAP_DONE) ...
//     else std::puts(planner.message());
//
// Fields are those of minsnap.h, with their shapes and units. Vectors that are empty were not given.
#ifndef MINSNAP_HPP
#define MINSNAP_HPP

#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "minsnap.h"

namespace minsnap {
inline namespace header {  // the library has a namespace of the same name

// A row of numbers that belongs to somebody else, as std::span of C++20.
template <class Value>
class Span {
public:
    Span() = default;
    Span(Value *first, std::size_t count) : first_(first), count_(count) {}

    Value *data() const { return first_; }
    std::size_t size() const { return count_; }
    Value *begin() const { return first_; }
    Value *end() const { return first_ + count_; }
    Value &operator[](std::size_t index) const { return first_[index]; }

private:
    Value *first_ = nullptr;
    std::size_t count_ = 0;
};

// A curve with memory of its own.
class Curve {
public:
    Curve() = default;
    explicit Curve(const minsnap_curve &from) { copy(from); }

    // Become a copy of a curve, in the memory that there is where that is enough.
    void copy(const minsnap_curve &from) {
        const std::int64_t count = from.legs * from.pieces;
        legs_ = from.legs, pieces_ = from.pieces, degree_ = from.degree, dim_ = from.dim, cost_ = from.cost;
        points_.assign(from.points, from.points + count * (from.degree + 1) * from.dim);
        durations_.assign(from.durations, from.durations + count);
        breaks_.assign(from.breaks, from.breaks + (count > 0 ? count + 1 : 0));
        yaw_.assign(from.yaw, from.yaw + (from.yaw == nullptr ? 0 : 4 * from.legs));
    }

    bool empty() const { return legs_ == 0; }
    std::int64_t legs() const { return legs_; }
    std::int64_t pieces() const { return pieces_; }  // polynomials of each leg
    std::int64_t degree() const { return degree_; }
    std::int64_t dim() const { return dim_; }
    double cost() const { return cost_; }
    double duration() const { return empty() ? 0.0 : breaks_.back(); }
    const std::vector<double> &points() const { return points_; }
    const std::vector<double> &durations() const { return durations_; }
    const std::vector<double> &breaks() const { return breaks_; }

    // A derivative at an instant [s], (dim,); empty where there is none.
    std::vector<double> operator()(double t, std::int64_t order = 0) const {
        std::vector<double> value(static_cast<std::size_t>(dim_));
        if (at({&t, 1}, order, {value.data(), value.size()}) != MINSNAP_DONE) value.clear();
        return value;
    }

    // Derivatives at instants (count,): out (count, dim).
    minsnap_status at(Span<const double> t, std::int64_t order, Span<double> out) const {
        if (out.size() != t.size() * static_cast<std::size_t>(dim_)) return MINSNAP_BAD_SIZE;
        const minsnap_curve whole = view();
        return minsnap_at(&whole, order, t.data(), static_cast<std::int64_t>(t.size()), out.data());
    }

    // A derivative of the heading at an instant [rad/s^order]; not a number where there is none.
    double yaw(double t, std::int64_t order = 0) const {
        double value = 0.0;
        const minsnap_curve whole = view();
        return minsnap_yaw_at(&whole, order, &t, 1, &value) == MINSNAP_DONE ? value : std::nan("");
    }
    const std::vector<double> &yaw_points() const { return yaw_; }  // (legs, 4), empty where there is none

    // The curve as minsnap.h has it, as long as this one lives.
    minsnap_curve view() const {
        minsnap_curve curve = minsnap_curve_new();
        curve.legs = legs_, curve.pieces = pieces_, curve.degree = degree_, curve.dim = dim_, curve.cost = cost_;
        curve.points = points_.data(), curve.durations = durations_.data(), curve.breaks = breaks_.data(), curve.duration = duration();
        curve.yaw = yaw_.empty() ? nullptr : yaw_.data();
        return curve;
    }

private:
    std::int64_t legs_ = 0, pieces_ = 0, degree_ = 0, dim_ = 0;
    double cost_ = 0.0;
    std::vector<double> points_, durations_, breaks_, yaw_;
};

// A vehicle whose rotors are to keep their range; all zero to begin with.
struct Vehicle : minsnap_vehicle {
    Vehicle() : minsnap_vehicle(minsnap_vehicle_new()) {}
};

// Limits, none to begin with.
struct Limits : minsnap_limits {
    Limits() : minsnap_limits(minsnap_limits_new()) {}
};

// A gate; it has no size to begin with.
struct Gate : minsnap_gate {
    Gate() : minsnap_gate(minsnap_gate_new()) {}
};

// A problem whose arrays are vectors.
class Problem {
public:
    explicit Problem(std::int64_t dimensions = 3) : dim(dimensions) {}

    std::int64_t dim, degree = 7, pieces = 0;
    bool closed = false, limited = false;
    std::vector<double> points, durations, widths, box_lower, box_upper, radii, yaws, start, end;
    std::vector<Gate> gates;  // their corners belong to the caller
    double total_time = 0.0, seconds = 0.0;
    std::function<bool()> stop;

    // Plan the quickest curve within limits.
    void within(const Limits &limits) { limits_ = limits, limited = true; }

    // A half-space normal . r <= bound in which a leg stays.
    void add_plane(std::int64_t leg, const std::vector<double> &normal, double bound) {
        legs_.push_back(leg), bounds_.push_back(bound);
        normals_.insert(normals_.end(), normal.begin(), normal.end());
        ragged_ = ragged_ || static_cast<std::int64_t>(normal.size()) != dim;
    }

    // As minsnap.h has it, as long as this one lives and does not change; false where a vector has another length than the waypoints ask for.
    bool view(minsnap_problem &problem) const {
        problem = minsnap_problem_new();
        const auto size = static_cast<std::size_t>(dim);
        if (dim < 1 || dim > 3 || points.empty() || points.size() % size != 0 || ragged_) return false;
        const std::size_t waypoints = points.size() / size, legs = waypoints - 1;
        const auto orders = static_cast<std::size_t>((degree - 1) / 2) * size;
        const std::pair<const std::vector<double> *, std::size_t> sizes[] = {
            {&durations, legs}, {&widths, legs}, {&box_lower, legs * size}, {&box_upper, legs * size}, {&radii, waypoints},
            {&start, orders},   {&end, orders},   {&yaws, waypoints}};
        for (const auto &[values, count] : sizes)
            if (!values->empty() && values->size() != count) return false;
        problem.dim = dim, problem.waypoints = static_cast<std::int64_t>(waypoints), problem.degree = degree, problem.pieces = pieces;
        problem.closed = closed, problem.points = points.data(), problem.durations = given(durations), problem.total_time = total_time;
        problem.limits = limited ? &limits_ : nullptr, problem.widths = given(widths), problem.box_lower = given(box_lower);
        problem.box_upper = given(box_upper), problem.planes = static_cast<std::int64_t>(legs_.size()), problem.plane_leg = legs_.data();
        problem.plane_normal = given(normals_), problem.plane_bound = given(bounds_), problem.radii = given(radii);
        problem.yaws = given(yaws);
        problem.gates = static_cast<std::int64_t>(gates.size()), problem.gate = gates.empty() ? nullptr : gates.data();
        problem.start = given(start);
        problem.end = given(end), problem.seconds = seconds;
        if (stop) problem.stop = &Problem::ask, problem.context = const_cast<Problem *>(this);
        return true;
    }

private:
    static const double *given(const std::vector<double> &values) { return values.empty() ? nullptr : values.data(); }
    static std::int64_t ask(void *self) { return static_cast<Problem *>(self)->stop(); }

    Limits limits_;
    std::vector<std::int64_t> legs_;
    std::vector<double> normals_, bounds_;
    bool ragged_ = false;
};

// How a call ended, and its curve; empty where there is none.
struct Plan {
    minsnap_status status = MINSNAP_BAD_SIZE;
    Curve curve;
};

class Planner {
public:
    Planner() {
        minsnap_planner *made = nullptr;
        if (minsnap_open(MINSNAP_ABI, &made) == MINSNAP_DONE) planner_.reset(made);
    }

    // Whether the library is of this header's version, and there was memory.
    explicit operator bool() const { return planner_ != nullptr; }

    // What the last call had to say: a sentence, empty where it was done.
    const char *message() const {
        return short_ ? "an array of the problem has another length than its waypoints ask for" : minsnap_message(planner_.get());
    }

    // Each call also writes into a plan that there is, in its memory: then a planner that is warm allocates nothing.
    Plan plan(const Problem &problem) {
        Plan made;
        plan(problem, made);
        return made;
    }
    void plan(const Problem &problem, Plan &made) {
        minsnap_problem asked;
        minsnap_curve found = minsnap_curve_new();
        give(view(problem, asked) ? minsnap_plan(planner_.get(), &asked, &found) : MINSNAP_BAD_SIZE, found, made);
    }

    // See minsnap_replan; the curve flown may be that of the plan that is written.
    Plan replan(const Problem &problem, const Curve &flown, double now, double budget) {
        Plan made;
        replan(problem, flown, now, budget, made);
        return made;
    }
    void replan(const Problem &problem, const Curve &flown, double now, double budget, Plan &made) {
        minsnap_problem asked;
        minsnap_curve found = minsnap_curve_new();
        const minsnap_curve old = flown.view();
        give(view(problem, asked) ? minsnap_replan(planner_.get(), &asked, &old, now, budget, &found) : MINSNAP_BAD_SIZE, found, made);
    }

    // See minsnap_brake.
    Plan brake(const Problem &problem, const Curve &flown, double instant) {
        Plan made;
        brake(problem, flown, instant, made);
        return made;
    }
    void brake(const Problem &problem, const Curve &flown, double instant, Plan &made) {
        minsnap_problem asked;
        minsnap_curve found = minsnap_curve_new();
        const minsnap_curve old = flown.view();
        give(view(problem, asked) ? minsnap_brake(planner_.get(), &asked, &old, instant, &found) : MINSNAP_BAD_SIZE, found, made);
    }

    // The time that every flight takes at least [s]; 0 where none is known.
    double least_time(const Problem &problem) {
        minsnap_problem asked;
        double seconds = 0.0;
        if (view(problem, asked)) minsnap_least_time(planner_.get(), &asked, &seconds);
        return seconds;
    }

    // What is proved of a curve; its `size` is 0 where nothing is.
    minsnap_certificate certify(const Problem &problem, const Curve &curve) {
        minsnap_problem asked;
        minsnap_certificate proved = minsnap_certificate_new();
        const minsnap_curve whole = curve.view();
        if (!view(problem, asked) || minsnap_certify(planner_.get(), &asked, &whole, &proved) != MINSNAP_DONE) proved.size = 0;
        return proved;
    }

private:
    struct Close {
        void operator()(minsnap_planner *planner) const { minsnap_close(planner); }
    };

    bool view(const Problem &problem, minsnap_problem &asked) { return !(short_ = !problem.view(asked)) && planner_ != nullptr; }

    static void give(minsnap_status status, const minsnap_curve &found, Plan &made) {
        made.status = status;
        made.curve.copy(found);
    }

    std::unique_ptr<minsnap_planner, Close> planner_;
    bool short_ = false;
};

}  // namespace header
}  // namespace minsnap

#endif

// Many plans within limits over threads, each as the public header makes it: the same to the bit, whatever the number of threads.
#include <atomic>
#include <cmath>

#include "basics/export.hpp"
#include "basics/threads.hpp"
#include "planner/border.hpp"
#include "planner/planner.hpp"
#include "planner/shortest_plan.hpp"

namespace minsnap {
namespace {

// Problems that one thread takes, one by one, with a planner of its own.
class Planned {
public:
    Planned(const PlansRecord &asked, std::atomic<std::int64_t> &next) : asked_(asked), next_(next) {}

    void operator()(std::int64_t) const {
        minsnap_planner *planner = nullptr;
        const minsnap_status opened = minsnap_open(MINSNAP_ABI, &planner);
        for (std::int64_t b = next_++; b < asked_.count; b = next_++) asked_.statuses[b] = planner == nullptr ? opened : one(*planner, b);
        minsnap_close(planner);
    }

private:
    minsnap_status one(minsnap_planner &planner, std::int64_t b) const {
        const std::int64_t first = asked_.offsets[b], legs = asked_.offsets[b + 1] - first, size = 8 * asked_.dim;
        const double *const given = asked_.limits + 9 * b;
        minsnap_limits limits = minsnap_limits_new();
        limits.speed = given[0], limits.acceleration = given[1], limits.jerk = given[2], limits.snap = given[3];
        limits.max_thrust = given[4], limits.min_thrust = given[5], limits.tilt = given[6], limits.body_rate = given[7];
        limits.gravity = given[8];
        minsnap_problem problem = minsnap_problem_new();
        problem.dim = asked_.dim, problem.waypoints = legs + 1, problem.pieces = asked_.pieces, problem.limits = &limits;
        problem.points = asked_.points + (first + b) * asked_.dim;
        problem.widths = asked_.widths == nullptr || !bounded(first, legs) ? nullptr : asked_.widths + first;
        minsnap_curve curve = minsnap_curve_new();
        const minsnap_status status = minsnap_plan(&planner, &problem, &curve);
        if (status != MINSNAP_DONE) return status;
        if (curve.pieces > asked_.most || misled(planner.course)) return MINSNAP_UNSUPPORTED;
        const std::int64_t pieces = curve.legs * curve.pieces;
        std::copy(curve.points, curve.points + pieces * size, asked_.curves + first * asked_.most * size);
        std::copy(curve.durations, curve.durations + pieces, asked_.durations + first * asked_.most);
        asked_.found[b] = curve.pieces;
        return status;
    }

    bool bounded(std::int64_t first, std::int64_t legs) const {
        for (std::int64_t leg = 0; leg < legs; ++leg)
            if (asked_.widths[first + leg] < infinite) return true;
        return false;
    }

    const PlansRecord &asked_;
    std::atomic<std::int64_t> &next_;
};

}  // namespace
}  // namespace minsnap

// Curves, in as many pieces as were found, and statuses; unsupported where another start may find a much shorter flight.
MINSNAP_EXPORT std::int32_t minsnap_plans(const minsnap::PlansRecord *asked) {
    using namespace minsnap;
    const std::int64_t threads = std::min<std::int64_t>(asked->threads, asked->count);
    if (asked->count < 0 || asked->most < 1 || threads > most_threads) return static_cast<std::int32_t>(Status::bad_size);
    std::atomic<std::int64_t> next{0};
    Planned planned(*asked, next);
    Chunks<Planned>(threads, planned).run(int(threads));
    return static_cast<std::int32_t>(Status::done);
}

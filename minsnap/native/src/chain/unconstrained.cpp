// Plans without walls: the curve of least integral of the squared k-th derivative through waypoints.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "chain/sweep.hpp"
#include "basics/dispatch.hpp"
#include "basics/export.hpp"
#include "certificate/last_look.hpp"
#include "chain/unconstrained.hpp"

namespace minsnap {
namespace {

constexpr std::int64_t most_legs = std::int64_t{1} << 32;

bool well_sized(const ChainProblem &chain, int half) {
    return chain.legs >= 1 && chain.legs <= most_legs && chain.stride >= 1 && chain.stride <= most_axes && half >= least_half &&
           half <= most_half && chain.pin_count >= 0 && chain.pin_count < chain.legs + 1;
}

bool in_range(const double *values, std::int64_t count) {
    bool all = true;
    for (std::int64_t i = 0; i < count; ++i) all &= std::fabs(values[i]) <= largest_number;
    return all;
}

// Pins are at inner knots, ascending, and in range.
bool well_pinned(const ChainProblem &chain, int half) {
    for (std::int64_t i = 0; i < chain.pin_count; ++i) {
        const std::int64_t before = i ? chain.knots[i - 1] : 0;
        if (chain.knots[i] <= before || chain.knots[i] >= chain.legs) return false;
        if (!in_range(chain.pins[i].values, static_cast<std::int64_t>(half - 1) * chain.stride)) return false;
    }
    return true;
}

// The largest ratio of durations of legs near each other, across the seam of a lap too.
double ratio_nearby(const ChainProblem &chain) {
    double ratio = 1.0;
    for (std::int64_t i = 0; i < chain.legs; ++i) {
        double least = chain.durations[i], most = least;
        for (std::int64_t j = 1; j < near_legs; ++j) {
            const double other = chain.durations[(i + j) % chain.legs];
            least = std::min(least, other), most = std::max(most, other);
        }
        ratio = std::max(ratio, most / least);
    }
    return ratio;
}

}  // namespace

Status read_chain(const ChainRecord &given, Pins &pins, ChainProblem &chain) {
    if (given.dim < 1 || given.dim > most_axes || given.half < least_half || given.half > most_half) return Status::bad_size;
    chain.points = given.points, chain.durations = given.durations, chain.legs = given.legs, chain.stride = int(given.dim);
    chain.start = given.start, chain.end = given.end, chain.knots = given.knots, chain.pin_count = given.pins;
    if (!well_sized(chain, int(given.half))) return Status::bad_size;
    if (!pins.allocate(std::size_t(given.pins))) return Status::no_memory;
    for (std::int64_t i = 0; i < given.pins; ++i) {
        Pin &pin = pins[std::size_t(i)];
        pin.mask = given.masks[i], pin.stride = chain.stride, pin.values = given.values + i * (given.half - 1) * given.dim;
    }
    chain.pins = pins.data();
    return Status::done;
}

Status check_chain(const ChainProblem &chain, int half, Spread &spread, double multiple) {
    if (!well_sized(chain, half)) return Status::bad_size;
    double least = chain.durations[0], most = least;
    bool positive = true;
    for (std::int64_t i = 0; i < chain.legs; ++i) {
        positive = positive && chain.durations[i] > 0.0;
        least = std::min(least, chain.durations[i]);
        most = std::max(most, chain.durations[i]);
    }
    if (!positive || !std::isfinite(most)) return Status::bad_number;
    const std::int64_t state = static_cast<std::int64_t>(half - 1) * chain.stride;
    if (!in_range(chain.points, (chain.legs + 1) * chain.stride)) return Status::bad_number;
    if (chain.start && !in_range(chain.start, state)) return Status::bad_number;
    if (chain.end && !in_range(chain.end, state)) return Status::bad_number;
    if (!well_pinned(chain, half)) return Status::bad_number;
    if (least < shortest_duration || most > longest_duration) return Status::unsupported;
    if (most > resolved_twice[half] * least) return Status::unsupported;
    const double ratio = multiple * resolved[half];
    spread = most > ratio * least && ratio_nearby(chain) > ratio ? Spread::wide : Spread::narrow;
    return Status::done;
}

bool has_hold(const ChainProblem &chain) {
    for (std::int64_t leg = 0; leg < chain.legs; ++leg) {
        const double *const begin = chain.points + leg * chain.stride;
        if (std::equal(begin, begin + chain.stride, begin + chain.stride)) return true;
    }
    return false;
}

Status solve_chain(const ChainProblem &chain, int half, Spread spread, Output out) {
    if (spread == Spread::wide) return solve_chain_extended(chain, half, out);
    return half <= most_usual_half ? solve_chain_usual(chain, half, out) : solve_chain_high(chain, half, out);
}

Status looked_at(const ChainProblem &chain, int half, const double *out) {
    const Asked asked = {chain.points, chain.durations,   chain.start, chain.end, nullptr, false, chain.legs, 1,
                         2 * half - 1, int(chain.stride), half - 1,    half - 1};
    return passes_last_look(asked, out) ? Status::done : Status::not_proved;
}

void write_breaks(const double *durations, std::int64_t legs, double *breaks) {
    double sum = breaks[0] = 0.0;
    for (std::int64_t i = 0; i < legs; ++i) breaks[i + 1] = sum += durations[i];
}

}  // namespace minsnap

// The curve through points (legs + 1, dim) [m] with durations (legs,) [s], at rest at both ends; unsupported where a leg
// has no length.
//
// Out: control points (legs, 2 half, dim) [m].
MINSNAP_EXPORT std::int32_t minsnap_unconstrained(const double *points, const double *durations, std::int64_t legs, std::int32_t dim,
                                                  std::int32_t half, double *out) {
    using namespace minsnap;
    ChainProblem chain;
    chain.points = points, chain.durations = durations, chain.legs = legs, chain.stride = dim;
    Spread spread;
    Status status = check_chain(chain, half, spread);
    if (status == Status::done && has_hold(chain)) status = Status::unsupported;
    if (status == Status::done) status = solve_chain(chain, half, spread, {out, nullptr});
    if (status == Status::done) status = looked_at(chain, half, out);
    return static_cast<std::int32_t>(status);
}

// The same with states at the ends and pins at inner knots, or of a closed lap.  Out also: the states of all knots,
// (legs + 1, half - 1, dim).
MINSNAP_EXPORT std::int32_t minsnap_unconstrained_pinned(const minsnap::ChainRecord *given, double *out, double *states) {
    using namespace minsnap;
    Pins pins;
    ChainProblem chain;
    Spread spread;
    const int half = int(given->half);
    Status status = read_chain(*given, pins, chain);
    if (status == Status::done) status = check_chain(chain, half, spread);
    if (status != Status::done) return static_cast<std::int32_t>(status);
    status = given->closed ? solve_closed(chain, half, spread, {out, states}) : solve_chain(chain, half, spread, {out, states});
    return static_cast<std::int32_t>(status);
}

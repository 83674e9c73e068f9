// Angles are turned the shorter way round, but those of a whole turn or more: one that is given is meant.
#include "planner/headings.hpp"

#include "basics/border.hpp"

extern "C" std::int32_t minsnap_unconstrained_pinned(const minsnap::ChainRecord *given, double *out, double *states);

namespace minsnap {
namespace {

constexpr double pi = 3.141592653589793;

// The same angle from -pi to below pi.
double wrapped(double angle) {
    const double rest = std::fmod(angle + pi, 2.0 * pi);
    return (rest < 0.0 ? rest + 2.0 * pi : rest) - pi;
}

}  // namespace

Status check_yaws(const minsnap_problem &problem, const Course &course, Says &says) {
    if (problem.yaws == nullptr) return Status::done;
    for (std::int64_t i = 0; i <= course.legs; ++i)
        if (!finite(problem.yaws + i, 1))
            return says(Status::bad_number, "the yaw at waypoint %lld is %g: it must be finite", static_cast<long long>(i),
                        problem.yaws[i]);
    if (course.closed && !(std::fabs(wrapped(problem.yaws[course.legs] - problem.yaws[0])) <= exact))
        return says(Status::bad_number, "a lap begins at a yaw of %g rad and ends at %g rad: give the same, but for whole turns",
                    problem.yaws[0], problem.yaws[course.legs]);
    if (course.bounds.vehicle != nullptr)
        return says(Status::unsupported, "rotors are limited at the heading of their vehicle: give no yaws beside them");
    return Status::done;
}

Status make_heading(const double *yaws, const Course &course, const HeadingState &from, CurveMemory &curve) {
    curve.heads = yaws != nullptr;
    if (!curve.heads) return Status::done;
    const std::int64_t legs = course.legs;
    Buffer<double> angles, times, states;
    if (!angles.allocate(std::size_t(legs + 1)) || !times.allocate(std::size_t(legs)) || !states.allocate(std::size_t(2 * (legs + 1))) ||
        !curve.yaw.allocate(std::size_t(4 * legs)))
        return Status::no_memory;
    const double first = from.given ? from.angle + wrapped(yaws[0] - from.angle) : yaws[0];
    double unwrapped = first, corrected = 0.0, sum = 0.0;
    angles[0] = from.given ? from.angle : first;
    for (std::int64_t i = 0; i < legs; ++i) {
        const double step = yaws[i + 1] - yaws[i];
        double shorter = wrapped(step);
        if (shorter == -pi && step > 0.0) shorter = pi;
        if (std::fabs(step) >= pi) corrected += shorter - step;
        const double next = yaws[i + 1] + (first - yaws[0]) + corrected, turned = next - unwrapped;
        sum += std::fabs(step) >= 2.0 * pi * (1.0 - exact) ? step : turned;
        angles[std::size_t(i + 1)] = first + sum, unwrapped = next;
    }
    write_breaks(curve.durations.data(), curve.all(), curve.breaks.data());
    for (std::int64_t leg = 0; leg < legs; ++leg)
        times[std::size_t(leg)] = curve.breaks[std::size_t((leg + 1) * curve.pieces)] - curve.breaks[std::size_t(leg * curve.pieces)];
    ChainRecord chain = {};
    chain.half = 2, chain.legs = legs, chain.dim = 1, chain.closed = course.closed, chain.points = angles.data();
    chain.durations = times.data(), chain.start = from.given ? &from.rate : nullptr;
    return Status(minsnap_unconstrained_pinned(&chain, curve.yaw.data(), states.data()));
}

double heading_at(const minsnap_curve &curve, std::int64_t order, double t) {
    std::int64_t leg = 0;
    while (leg + 1 < curve.legs && curve.breaks[(leg + 1) * curve.pieces] <= t) ++leg;
    const double begins = curve.breaks[leg * curve.pieces], lasts = curve.breaks[(leg + 1) * curve.pieces] - begins,
                 s = (t - begins) / lasts;
    if (order > 3) return 0.0;
    double row[4];
    std::copy(curve.yaw + 4 * leg, curve.yaw + 4 * leg + 4, row);
    int degree = 3;
    for (; degree > 3 - int(order); --degree)
        for (int j = 0; j < degree; ++j) row[j] = degree / lasts * (row[j + 1] - row[j]);
    for (; degree > 0; --degree)
        for (int j = 0; j < degree; ++j) row[j] += s * (row[j + 1] - row[j]);
    return row[0];
}

}  // namespace minsnap

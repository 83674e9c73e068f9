// Curves of least cost in given durations, or in the best split of a total time.
#include "planner/given.hpp"

#include "certificate/last_look.hpp"

extern "C" {
std::int32_t minsnap_unconstrained(const double *points, const double *durations, std::int64_t legs, std::int32_t dim, std::int32_t half,
                                   double *out);
std::int32_t minsnap_unconstrained_pinned(const minsnap::ChainRecord *given, double *out, double *states);
std::int32_t minsnap_tube(const double *points, const double *durations, const double *widths, std::int64_t legs, std::int32_t dim,
                          std::int32_t half, std::int32_t shared, double gap, double *out, double *breaks, double *figures);
std::int32_t minsnap_corridor(const minsnap::CorridorRecord *asked, minsnap::CorridorAnswerRecord *found);
std::int32_t minsnap_best_split(const minsnap::ChainRecord *given, minsnap::SplitRecord *found);
std::int32_t minsnap_best_corridor_split(const minsnap::CorridorRecord *asked, minsnap::SplitRecord *found);
std::int32_t minsnap_best_tube_split(const double *points, const double *first, const double *widths, std::int32_t dim, std::int32_t half,
                                     std::int32_t shared, double gap, minsnap::SplitRecord *found);
}

namespace minsnap {
namespace {

constexpr double solve_work = 360.0;        // of a solve that does all that one is worth, in milliseconds of a processor, about
constexpr std::int64_t evaluations = 2000;  // of a split, after which it is given up
constexpr double whole_effort = 2.0;        // of what a problem of its size is worth

}  // namespace

ChainRecord GivenTimes::chain(const double *durations) const {
    ChainRecord record = {};
    record.half = course_.half, record.legs = course_.legs, record.dim = course_.dim, record.closed = course_.closed;
    record.points = course_.points.data(), record.durations = durations;
    if (!course_.closed) record.start = course_.state(0) + course_.dim, record.end = course_.state(course_.legs) + course_.dim;
    return record;
}

Status GivenTimes::solve(const double *durations, CurveMemory &curve) {
    const std::int64_t per_leg = course_.constrained() ? std::max<std::int64_t>(course_.pieces, 1) : 1;
    if (!curve.allocate(course_, per_leg)) return says_(Status::no_memory, "there is no memory for the curve");
    for (std::int64_t i = 0; i < curve.all(); ++i) curve.durations[std::size_t(i)] = durations[i / per_leg] / double(per_leg);
    const Status status = !course_.constrained() ? free(durations, curve) : in_tube(curve) == Status::done ? Status::done : inside(curve);
    if (status == Status::done) return status;
    if (status == Status::infeasible)
        return says_(status, "no curve seems to keep the walls in these durations: widen the corridor, or give more pieces");
    return says_(status, "no curve of least cost was proved in these durations: give others, less far apart");
}

Status GivenTimes::free(const double *durations, CurveMemory &curve) {
    if (course_.still && !course_.closed) {
        const auto status =
            Status(minsnap_unconstrained(course_.points.data(), durations, course_.legs, course_.dim, course_.half, curve.points.data()));
        seen_ = status == Status::done;
        if (status != Status::unsupported) return status;
    }
    if (!states_.allocate(std::size_t((course_.legs + 1) * course_.half * course_.dim))) return Status::no_memory;
    const ChainRecord record = chain(durations);
    return Status(minsnap_unconstrained_pinned(&record, curve.points.data(), states_.data()));
}

bool GivenTimes::plain_tube() const {
    if (course_.widths == nullptr || course_.walled || course_.regions.count() > 0 || course_.closed || !course_.still || course_.dim == 1)
        return false;
    for (std::int64_t leg = 0; leg < course_.legs; ++leg)
        if (course_.widths[leg] == infinite) return false;
    return true;
}

// From rest to rest in a tube alone, one polynomial a leg: walls and units are made by one call.
Status GivenTimes::in_tube(CurveMemory &curve) {
    if (!plain_tube() || curve.pieces != 1) return Status::unsupported;
    double figures[4];
    const auto status = Status(minsnap_tube(course_.points.data(), curve.durations.data(), course_.widths, course_.legs, course_.dim,
                                            course_.half, 0, allowed_gap, curve.points.data(), curve.breaks.data(), figures));
    if (status != Status::done) return status;
    const Asked asked = {course_.points.data(),
                         curve.durations.data(),
                         nullptr,
                         nullptr,
                         course_.widths,
                         false,
                         course_.legs,
                         1,
                         2 * course_.half - 1,
                         course_.dim,
                         course_.half - 1,
                         course_.half - 1};
    seen_ = passes_last_look(asked, curve.points.data());
    return seen_ ? Status::done : Status::not_proved;
}

// Units of a question: its typical leg, and the power of two near the geometric mean of the durations.
bool GivenTimes::make_question(const double *durations, std::int64_t per_leg) {
    const int dim = course_.dim, half = course_.half;
    const std::int64_t pieces = course_.legs * per_leg, knots = pieces + 1, state = std::int64_t(half) * dim;
    const auto all = std::size_t(knots * state);
    std::int64_t exponents = 0;
    for (std::int64_t i = 0; i < pieces; ++i) {
        int exponent;
        std::frexp(durations[i], &exponent);
        exponents += exponent;
    }
    const std::int64_t mean = exponents >= 0 ? exponents / pieces : -((-exponents + pieces - 1) / pieces);
    if (!positions_.allocate(std::size_t(knots * dim)) || !pinned_.allocate(all) || !values_.allocate(all)) return false;
    const double *const origin = course_.state(0);
    for (std::int64_t knot = 0; knot < knots; ++knot) {
        const std::int64_t leg = knot / per_leg, part = knot % per_leg;
        for (int d = 0; d < dim; ++d) {
            const double at = course_.state(leg)[d];
            if (part == 0) {
                positions_[std::size_t(knot * dim + d)] = at;
                continue;
            }
            const double here = (at - origin[d]) / course_.length, next = (course_.state(leg + 1)[d] - origin[d]) / course_.length;
            positions_[std::size_t(knot * dim + d)] = origin[d] + course_.length * (here + double(part) / double(per_leg) * (next - here));
        }
    }
    for (std::int64_t j = 0; j < std::int64_t(all); ++j) pinned_[std::size_t(j)] = 0, values_[std::size_t(j)] = 0.0;
    for (std::int64_t waypoint = 0; waypoint <= course_.legs; ++waypoint) {
        const auto at = std::size_t(waypoint * per_leg * state);
        const bool end = !course_.closed && (waypoint == 0 || waypoint == course_.legs);
        for (int q = 0; q < half; ++q)
            for (int d = 0; d < dim; ++d) {
                if (q == 0 ? course_.regions.free(waypoint, d) : !end) continue;
                pinned_[at + std::size_t(q * dim + d)] = 1;
                if (q > 0) values_[at + std::size_t(q * dim + d)] = course_.state(waypoint)[q * dim + d];
            }
    }
    sets_.clear(dim);
    for (int g = 0; g < course_.walls.count(); ++g)
        if (!sets_.add_cut(course_.walls[g], per_leg)) return false;
    if (!add_regions(per_leg)) return false;
    question_ = {};
    question_.half = half, question_.pieces = pieces, question_.dim = dim, question_.continuity = half - 1,
    question_.closed = course_.closed;
    question_.groups = sets_.count(), question_.length = course_.length, question_.time = std::ldexp(1.0, int(mean)),
    question_.gap = allowed_gap;
    question_.effort = whole_effort, question_.seconds = infinite, question_.positions = positions_.data(), question_.durations = durations;
    question_.pinned = pinned_.data(), question_.values = course_.still ? nullptr : values_.data(), question_.walls = sets_.data();
    return true;
}

// What holds where waypoints may vary, each at the start of the piece that follows: boxes, upper sides first, other sides of gates, balls, directions of
// crossing, and planes on which the curve lies.
bool GivenTimes::add_regions(std::int64_t per_leg) {
    const Regions &regions = course_.regions;
    const int dim = course_.dim;
    std::int64_t boxed = 0, sides = 0, planes = 0;
    for (std::int64_t k = 0; k < regions.count(); ++k) {
        const Region &region = regions[k];
        for (int d = 0; d < dim; ++d) boxed += region.upper[d] > region.lower[d];
        sides += region.sides, planes += region.slanted;
    }
    auto put = [&](WallRows &to, std::int64_t at, const Region &region, double radius, double width) {
        to.leg[at] = region.waypoint * per_leg, to.radius[at] = radius, to.width[at] = width;
        std::copy(course_.point(region.waypoint), course_.point(region.waypoint) + dim, to.anchor + at * dim);
    };
    WallRows to;
    if (boxed > 0 && !sets_.add(2 * boxed, 0, 0, to, Holds::at_ends)) return false;
    for (std::int64_t waypoint = 0, at = 0; waypoint < course_.legs; ++waypoint)
        for (int d = 0; d < dim; ++d) {
            if (!regions.free(waypoint, d)) continue;
            const Region &region = *regions.at(waypoint);
            const double width = (region.upper[d] - region.lower[d]) / 2.0;
            put(to, at, region, region.upper[d], width), put(to, boxed + at, region, -region.lower[d], width);
            to.slope[at * dim + d] = -1.0, to.slope[(boxed + at++) * dim + d] = 1.0;
        }
    if (sides > 0 && !sets_.add(sides, 0, 0, to, Holds::at_ends)) return false;
    for (std::int64_t k = 0, at = 0; k < regions.count(); ++k)
        for (std::int64_t j = 0; j < regions[k].sides; ++j, ++at) {
            const double *const side = regions.side(regions[k].first + j);
            put(to, at, regions[k], side[dim], side[dim]);
            for (int d = 0; d < dim; ++d) to.slope[at * dim + d] = -side[d];
        }
    if (!regions.add_balls(sets_, course_.points.data(), per_leg, Holds::at_ends)) return false;
    if (!regions.add_crossings(sets_, per_leg, Holds::at_ends)) return false;
    if (planes > 0 && !sets_.add(planes, 0, 0, to, Holds::at_ends)) return false;
    if (planes > 0) sets_.last().equal = 1;
    for (std::int64_t k = 0, at = 0; k < regions.count(); ++k) {
        if (!regions[k].slanted) continue;
        put(to, at, regions[k], 0.0, course_.length);
        for (int d = 0; d < dim; ++d) to.slope[at * dim + d] = -regions[k].normal[d];
        ++at;
    }
    return true;
}

Status GivenTimes::inside(CurveMemory &curve) {
    if (!make_question(curve.durations.data(), curve.pieces)) return Status::no_memory;
    const std::int64_t state = std::int64_t(course_.half) * course_.dim, most = curve.all() * state + 2;
    if (!knots_.allocate(std::size_t((curve.all() + 1) * state)) || !wall_.allocate(std::size_t(most)) ||
        !numbers_.allocate(std::size_t(2 * most)) || !direction_.allocate(std::size_t(most * course_.dim)))
        return Status::no_memory;
    CorridorAnswerRecord answer = {};
    answer.points = curve.points.data(), answer.knots = knots_.data(), answer.wall = wall_.data(), answer.s = numbers_.data();
    answer.multiplier = numbers_.data() + most, answer.direction = direction_.data();
    return Status(minsnap_corridor(&question_, &answer));
}

Status GivenTimes::split(CurveMemory &curve) {
    const std::int64_t legs = course_.legs;
    if (!best_.allocate(std::size_t(legs)) || !first_.allocate(std::size_t(legs)) || !history_.allocate(std::size_t(2 * evaluations)))
        return says_(Status::no_memory, "there is no memory for the durations of %lld legs", static_cast<long long>(legs));
    const double sum = summed(course_.lengths.data(), legs);
    for (std::int64_t leg = 0; leg < legs; ++leg) first_[std::size_t(leg)] = course_.total * course_.lengths[std::size_t(leg)] / sum;
    std::copy(first_.data(), first_.data() + legs, best_.data());
    SplitRecord record = {};
    record.legs = legs, record.per_leg = 1, record.capacity = evaluations, record.seconds = record.effort = infinite;
    record.durations = best_.data(), record.history = history_.data();
    bool free = false;
    if (legs > 1) {
        const ChainRecord whole = chain(first_.data());
        free = minsnap_best_split(&whole, &record) == 0;
        if (!free && !course_.constrained()) std::copy(first_.data(), first_.data() + legs, best_.data());
    }
    if (legs > 1 && course_.constrained() && !split_inside(free, record)) std::copy(first_.data(), first_.data() + legs, best_.data());
    return solve(best_.data(), curve);
}

// The split inside the walls, from the one without them on, or from the one by distance; false where none is found.
bool GivenTimes::split_inside(bool free, SplitRecord &record) {
    const std::int64_t legs = course_.legs, per_leg = std::max<std::int64_t>(course_.pieces, 1);
    Buffer<double> start, pieces;
    if (!start.allocate(std::size_t(legs)) || !pieces.allocate(std::size_t(legs * per_leg))) return false;
    record.per_leg = per_leg, record.effort = infinite;
    for (int from = free ? 0 : 1; from < 2; ++from) {
        const double *const first = from == 0 ? best_.data() : first_.data();
        std::copy(first, first + legs, start.data());
        Status status = Status::unsupported;
        if (plain_tube() && per_leg == 1)
            status = Status(minsnap_best_tube_split(course_.points.data(), start.data(), course_.widths, course_.dim, course_.half, 0,
                                                    allowed_gap, &record));
        if (status != Status::done) {
            for (std::int64_t i = 0; i < legs * per_leg; ++i) pieces[std::size_t(i)] = first_[std::size_t(i / per_leg)] / double(per_leg);
            if (!make_question(pieces.data(), per_leg)) return false;
            question_.durations = start.data(), question_.effort = 1.0, record.effort = 0.5 * course_.worth() / solve_work;
            status = Status(minsnap_best_corridor_split(&question_, &record));
        }
        if (status == Status::done) return true;
    }
    return false;
}

}  // namespace minsnap

// What is asked of the search for the shortest time, in which order, and when it ends.
#include "planner/shortest_plan.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "arithmetic/double_double.hpp"
#include "chain/unconstrained.hpp"
#include "planner/time_bound.hpp"
#include "polynomials/evaluate.hpp"
#include "shortest_time/instant_limits.hpp"

extern "C" {
std::int32_t minsnap_shortest_time(const minsnap::ShortestRequest *request, minsnap::ShortestAnswer *answer);
std::int32_t minsnap_stop(minsnap::StopRecord *asked);
}

namespace minsnap {
namespace {

struct PlanSettings {
    static constexpr std::int64_t divided[2] = {3, 2},
                                  alone[2] = {3, 3};  // into how many parts legs are divided, time after time; a single leg
    static constexpr double worthwhile = 0.08;        // relative gain by which several legs are divided once more
    static constexpr double short_leg = 0.3;          // share of the mean length that a leg has at least for a first guess
    static constexpr double inwards = 2e-4;           // share of their widths by which walls are moved inwards
    static constexpr double room = 1e-4;              // share by which limits are tightened that slower flight does not mend
    static constexpr double directed = 0.1;           // share of the weight below which thrust has no direction
    static constexpr double proof_margin = 1e-4;      // share of limits with drag that is left to their proof
    static constexpr double rotor_margin = 1e-4;      // share of hover that is left to the proof of rotors
    static constexpr double slower_whole = 1.4, slower_divided = 1.05;  // factor on the time of a plan whose legs are divided
    static constexpr double hastened = 0.9;                             // least factor on time at which limits of rotors are touched
    static constexpr int rotor_halvings = 20;
    static constexpr double rotor_work = 2.5e-4;  // as row_work
    static constexpr double aside = 0.1;          // least share of the thrust that is not along the heading
    static constexpr double slower_parts[] = {0.0,  1e-6, 1e-5,
                                              1e-4, 1e-3, 1e-2};  // of a curve that is divided, until no sample is over a limit
    static constexpr double last_try = 0.75;                      // share of the work after which one last try ends
    static constexpr int tries = 3;                               // searches until a curve can be certified
    static constexpr double farther = 10.0;     // factor on the share by which walls are moved inwards, where a curve is outside
    static constexpr double not_longer = 1e-3;  // share by which a certified curve may be slower than that of its search
    static constexpr double seen = 0.05;        // excess beyond which a search has not seen a limit
    static constexpr double enough = 2.0;       // by how many excesses limits are tightened
    static constexpr double row_work = 6e-5, block_work = 5e-6;  // milliseconds of a processor, about
    static constexpr double vanishing = 1e-6;                    // share of the longest total below which nothing limits the time
    static constexpr double idle = 0.8;                          // factor on time below which nothing limits it; and where
    static constexpr double far = 0.05, nearly = 0.98;           // a search ended so far inside all limits
    static constexpr double near_least = 1.05;                   // time of a second start over the least that is proved
    static constexpr double close = 0.2, straight = 0.9;         // legs are close together below that share of the way to stop; its cosine
    static constexpr double on_limit = 0.999;                    // use of a state that leaves no room
    static constexpr double briefest = 0.15;                     // time that stopping takes at least [s]
    static constexpr double kept = 1e-9;                         // how far above 1 a use may be
    static constexpr double met = 2e-7;                          // how near to 1 a use is brought
    static constexpr int secants = 6, halvings = 60;
    static constexpr double longest = 40.0, precision = 1e-13;  // of the logarithm of a factor on time
    static constexpr double secant_step = 0.05, first_step = 0.02;
    static constexpr double grain = 0x1p32;  // factors on time are rounded up to its fractions
    static constexpr std::int64_t room_for_totals = 256;
};
using P = PlanSettings;

// Largest derivatives of the profile 35 s^4 - 84 s^5 + 70 s^6 - 20 s^7 over the unit interval.
constexpr double peaks[4] = {2.1875, 7.5132, 52.5, 840.0};

constexpr int most_points = 12;  // of a polynomial

// A number of so many digits, for what a search decides by.
double significant(double value, int digits) {
    char text[40];
    std::snprintf(text, sizeof text, "%.*g", digits, value);
    return std::strtod(text, nullptr);
}

double grained(double factor) { return std::ceil(factor * P::grain) / P::grain; }

struct Told {
    SearchEnd *end;
    ShortestAnswer *answer;
};

std::int64_t poll(void *context) {
    const Told &told = *static_cast<Told *>(context);
    told.answer->told = 0;
    return told.end->over();
}

}  // namespace

double Bounds::reached(int order) const {
    double least = norm[order - 1];
    if (order == 2 && most_thrust < infinite) least = std::min(least, (most_thrust - 1.0) * gravity);
    if (order == 2 && least_thrust > 0.0) least = std::min(least, (1.0 - least_thrust) * gravity);
    if (order == 2 && tilt < infinite) least = std::min(least, gravity * std::sin(tilt));
    if (order == 3 && body_rate < infinite) least = std::min(least, 0.5 * gravity * body_rate);
    return least;
}

bool misled(const Course &course) {
    const int dim = course.dim;
    bool moves[2] = {false, false};
    for (int end = 0; end < 2; ++end)
        for (int j = dim; j < course.half * dim; ++j) moves[end] = moves[end] || course.state(end * course.legs)[j] != 0.0;
    if (course.closed) return false;
    if (moves[0] && moves[1]) return true;
    const double speed = course.bounds.reached(1), acceleration = course.bounds.reached(2);
    if (!(acceleration < infinite)) return false;
    const double fastest = std::min(speed, std::sqrt(acceleration * summed(course.lengths.data(), course.legs)));
    const double stop = fastest * fastest / (2.0 * acceleration);
    for (std::int64_t leg = 0; leg + 1 < course.legs; ++leg) {
        double product = 0.0;
        for (int d = 0; d < dim; ++d)
            product += (course.point(leg + 1)[d] - course.point(leg)[d]) * (course.point(leg + 2)[d] - course.point(leg + 1)[d]);
        const double one = course.lengths[std::size_t(leg)], other = course.lengths[std::size_t(leg + 1)];
        if (product > P::straight * one * other && std::min(one, other) < P::close * stop) return true;
    }
    return false;
}

void ShortestPlan::make_question() {
    moving_ = !course_.still || course_.bounds.turns();
    question_.inwards = P::inwards, question_.tightened = course_.still && moving_ ? P::room : 0.0;
    for (std::int64_t leg = 0; leg < course_.legs; ++leg)
        lengths_[std::size_t(leg)] = std::max(course_.lengths[std::size_t(leg)], P::short_leg * course_.length);
    const std::int64_t state = std::int64_t(course_.half) * course_.dim;
    for (std::int64_t i = 0; i <= course_.legs; ++i)
        for (std::int64_t j = 0; j < state; ++j) {
            const bool end = !course_.closed && (i == 0 || i == course_.legs);
            free_[std::size_t(i * state + j)] = j < course_.dim ? course_.regions.free(i, int(j)) : !end;
        }
}

// In a slanted plane a position varies along two axes, beside a third across it: a reflection of the world's (A. S. Householder, 1958).
void ShortestPlan::turn_planes() {
    const int dim = course_.dim;
    const std::int64_t state = std::int64_t(course_.half) * dim, count = (course_.legs + 1) * state;
    std::copy(course_.pinned.data(), course_.pinned.data() + count, pinned_.data());
    std::fill(turned_.data(), turned_.data() + (course_.legs + 1) * dim * dim, 0.0);
    slanted_ = false;
    for (std::int64_t i = 0; i <= course_.legs; ++i) {
        const Region *const region = course_.regions.at(i);
        if (region == nullptr || !region->slanted) continue;
        double mirror[3], square = 0.0, *const axes = turned_.data() + i * dim * dim, *const place = pinned_.data() + i * state;
        std::copy(region->normal, region->normal + dim, mirror);
        mirror[0] += region->normal[0] >= 0.0 ? 1.0 : -1.0;
        for (int d = 0; d < dim; ++d) square += mirror[d] * mirror[d];
        for (int c = 0; c < dim; ++c) {
            double along = 0.0;
            for (int d = 0; d < dim; ++d) {
                axes[d * dim + c] = (c == d ? 1.0 : 0.0) - 2.0 / square * mirror[d] * mirror[c];
                along += axes[d * dim + c] * course_.point(i)[d];
            }
            place[c] = along;
            free_[std::size_t(i * state + c)] = c > 0;
        }
        slanted_ = true;
    }
}

// Walls, then limits as convex sets, then what holds at waypoints.
bool ShortestPlan::make_sets() {
    const int dim = course_.dim;
    sets_.clear(dim);
    for (int g = 0; g < course_.walls.count(); ++g)
        if (!sets_.add_cut(course_.walls[g], 1)) return false;
    if (!make_limits(false)) return false;
    return add_regions();
}

// Flat sides of all regions by waypoint, those of boxes first, then balls, then the directions in which gates are crossed. Of a lap not those of its end.
bool ShortestPlan::add_regions() {
    const Regions &regions = course_.regions;
    const int dim = course_.dim;
    std::int64_t flat = 0;
    for (std::int64_t k = 0; k < regions.count(); ++k) {
        for (int d = 0; d < dim; ++d) flat += !regions[k].ball() && regions[k].upper[d] > regions[k].lower[d] ? 2 : 0;
        flat += regions[k].sides;
    }
    auto put = [&](WallRows &to, std::int64_t at, const Region &region, double radius, double width) {
        to.leg[at] = region.waypoint, to.radius[at] = radius, to.width[at] = width;
        std::copy(course_.point(region.waypoint), course_.point(region.waypoint) + dim, to.anchor + at * dim);
    };
    WallRows to;
    if (flat > 0 && !sets_.add(flat, 0, 0, to, Holds::at_knots)) return false;
    for (std::int64_t waypoint = 0, at = 0; waypoint < course_.legs; ++waypoint) {
        const Region *const region = regions.at(waypoint);
        if (region == nullptr || region->ball()) continue;
        double width = 0.0;
        for (int d = 0; d < dim; ++d) width = std::max(width, region->upper[d] - region->lower[d]);
        for (int side = 0; side < 2; ++side)
            for (int d = 0; d < dim; ++d) {
                if (!regions.free(waypoint, d)) continue;
                put(to, at, *region, side == 0 ? region->upper[d] : -region->lower[d], width / 2.0);
                to.slope[at++ * dim + d] = side == 0 ? -1.0 : 1.0;
            }
        for (std::int64_t j = 0; j < region->sides; ++j, ++at) {
            const double *const side = regions.side(region->first + j);
            put(to, at, *region, side[dim], width / 2.0);
            for (int d = 0; d < dim; ++d) to.slope[at * dim + d] = -side[d];
        }
    }
    return regions.add_balls(sets_, course_.points.data(), 1, Holds::at_knots) && regions.add_crossings(sets_, 1, Holds::at_knots);
}

// Limits as convex sets: all that are convex, or those that the search does not know better.
bool ShortestPlan::make_limits(bool all) {
    const Bounds &bounds = course_.bounds;
    const int dim = course_.dim;
    WallRows to;
    // balls |A x| <= radius + slope x_z around an anchor along z, the same on every leg; planes where there are no rows
    auto add = [&](int rows, std::int64_t order, double radius, double width, double anchor, double slope) {
        if (!sets_.add(course_.legs, rows, order, to)) return false;
        for (std::int64_t leg = 0; leg < course_.legs; ++leg) {
            to.leg[leg] = leg, to.radius[leg] = radius, to.width[leg] = width;
            for (int d = 0; d < rows; ++d) to.matrix[(leg * rows + d) * dim + d] = 1.0;
            if (dim == 3) to.anchor[leg * dim + 2] = anchor, to.slope[leg * dim + 2] = slope;
        }
        return true;
    };
    for (int k = 0; k < 4; ++k)
        if (bounds.norm[k] < infinite && !add(dim, k + 1, bounds.norm[k], bounds.norm[k], 0.0, 0.0)) return false;
    if (bounds.drags() && !all) return true;
    const double g = bounds.gravity;
    const bool bounded = bounds.most_thrust < infinite || bounds.norm[1] < infinite;
    if (bounds.most_thrust < infinite && !add(3, 2, bounds.most_thrust * g, bounds.most_thrust * g, -g, 0.0)) return false;
    if (bounds.least_thrust > 0.0 && (all || !bounded)) {
        const double lowest = (bounds.least_thrust - 1.0) * g;
        if (!add(0, 2, -lowest, -lowest, 0.0, 1.0)) return false;
    }
    if (bounds.tilt < infinite) {
        const double slope = std::tan(bounds.tilt), lowest = (1.0 - exact) * g;
        if (!add(0, 2, lowest, lowest, 0.0, 1.0) || !add(2, 2, slope * g, slope * g, 0.0, slope)) return false;
    }
    const bool directed = bounds.turns() && bounds.least_thrust < P::directed;
    const double least = directed ? P::directed : bounded ? bounds.least_thrust : 0.0;
    if (least == 0.0 || all) return true;
    if (!add(3, 2, least * g, directed ? g : least * g, -g, 0.0)) return false;
    sets_.last().outside = 1;
    return true;
}

bool ShortestPlan::stop_and_go(Buffer<double> &durations) const {
    if (!durations.allocate(std::size_t(course_.legs))) return false;
    for (std::int64_t leg = 0; leg < course_.legs; ++leg) {
        double longest = 0.0;
        const double length = lengths_[std::size_t(leg)];
        for (int order = 1; order <= 4; ++order)
            if (const double most = course_.bounds.reached(order); most < infinite) {
                const double power = peaks[order - 1] * length / most;  // libraries agree on square roots
                longest = std::max(longest, order == 1   ? power
                                            : order == 2 ? std::sqrt(power)
                                                         : significant(std::pow(power, 1.0 / order), 13));
            }
        durations[std::size_t(leg)] = longest > 0.0 ? longest : 1e-3 + length;
    }
    return true;
}

Status ShortestPlan::run(CurveMemory &curve) {
    const std::int64_t state = std::int64_t(course_.half) * course_.dim;
    if (!lengths_.allocate(std::size_t(course_.legs)) || !free_.allocate(std::size_t((course_.legs + 1) * state)) ||
        !totals_.allocate(P::room_for_totals) || !pinned_.allocate(std::size_t((course_.legs + 1) * state)) ||
        !turned_.allocate(std::size_t((course_.legs + 1) * course_.dim * course_.dim)))
        return says_(Status::no_memory, "there is no memory for a search of %lld legs", static_cast<long long>(course_.legs));
    make_question();
    turn_planes();
    if (!make_sets())
        return says_(Status::no_memory, "there is no memory for the walls of %lld legs", static_cast<long long>(course_.legs));
    Attempt found;
    of_pieces(course_.pieces, found);
    if (course_.pieces == 0 && (found.solved.legs == 0 || found.stands_in) && goes_on(found)) {  // with three, and fewer
        Attempt three;
        of_pieces(P::divided[0], three);
        found.shorter(three.solved, three.stands_in);
    }
    const bool searched = found.solved.legs > 0;
    Buffer<double> times;
    const bool slow = !searched || (end_.ended && stop_and_go(times) && found.solved.total() > summed(times.data(), course_.legs));
    bool rests = false;
    if (CurveMemory rest; slow && course_.still && resting(rest)) rests = found.shorter(rest);
    curve.swap(found.solved);
    if (curve.legs > 0 && end_.ended)
        return says_(Status::spent, rests ? "the search was ended: this curve rests at every waypoint"
                                          : "the search was ended: this is the best curve so far");
    if (curve.legs > 0) return Status::done;
    if (end_.ended) return says_(Status::spent, "the search was ended before it had a curve that can be certified");
    if (on_limit())
        return says_(Status::no_progress,
                     "the state at the start is on a limit, which leaves a new curve no room: raise the limit a little");
    if (found.unlimited)
        return says_(Status::unsupported, "nothing limits the time: the path keeps its limits at any speed; add another one");
    return says_(Status::no_progress, "no curve within the limits%s was found: loosen a limit%s",
                 course_.walls.count() > 0 ? " and the walls" : "", course_.walls.count() > 0 ? ", or widen the corridor" : "");
}

// Take another plan where that is shorter.
bool ShortestPlan::Attempt::shorter(CurveMemory &other, bool other_stands_in) {
    if (other.legs == 0 || (solved.legs > 0 && !(other.total() < solved.total()))) return false;
    solved.swap(other);
    stands_in = other_stands_in;
    return true;
}

// The shorter plan of both.
void ShortestPlan::Attempt::then(Attempt &later) {
    shorter(later.solved, later.stands_in);
    unlimited = unlimited || later.unlimited;
}

// A flight of so many polynomials a leg, or one of fewer, divided, where that is shorter: every flight of fewer is one of more. A search without an end
// is repeated from that one. Where many, or those that a search chose, took all of the work, one polynomial a leg is searched in little more.
void ShortestPlan::of_pieces(std::int64_t pieces, Attempt &found) {
    of_starts(pieces, found);
    if (found.hopeless() || pieces == 1) return;
    const bool spent = end_.ended;
    if (spent ? !has_last_try() : pieces == 0) return;
    Attempt fewer, finer;
    of_pieces(spent ? 1 : pieces - 1, fewer);
    CurveMemory divided;
    Guess guess;
    const bool known = fewer.solved.legs > 0 && cut(fewer.solved, std::max<std::int64_t>(pieces, 1), divided);
    if (known && !spent && (found.solved.legs == 0 || found.stands_in) && guess_of(divided, guess)) of_strategy(pieces, &guess, finer);
    if (known) found.shorter(divided, fewer.stands_in);
    found.shorter(finer.solved, finer.stands_in);
    end_.ended = end_.ended || spent;
}

// Whether work alone is over, for the first time: then a little more of it is allowed.
bool ShortestPlan::has_last_try() {
    if (share_ >= P::last_try || work_ <= share_ * course_.worth()) return false;
    end_.ended = false;
    if (end_.over()) return false;
    share_ = P::last_try;
    return true;
}

// From the usual start and, where that may end far away, from near the least time too.
void ShortestPlan::of_starts(std::int64_t pieces, Attempt &found) {
    of_strategy(pieces, nullptr, found);
    if (found.solved.legs == 0 || end_.ended || !misled(course_)) return;
    const std::int64_t finest = pieces == 0 ? P::divided[0] * P::divided[1] : pieces;
    Guess guess;
    Attempt other;
    if (!near_least(finest, guess)) return;
    of_strategy(finest, &guess, other);
    found.shorter(other.solved, other.stands_in);
}

// A search of a number of pieces.
void ShortestPlan::of_strategy(std::int64_t pieces, const Guess *guess, Attempt &found) {
    per_leg_ = pieces, longest_ = 0.0;
    solve(guess, found);
}

// Divide the polynomials of a curve by de Casteljau's algorithm in double-double arithmetic, so that each control point is rounded once. More samples
// may find it barely too fast.
bool ShortestPlan::cut(const CurveMemory &whole, std::int64_t pieces, CurveMemory &curve) {
    if (!divide(whole, pieces, curve) || !inside(curve)) return false;
    for (const double share : P::slower_parts)
        if (const double slower = 1.0 + share; keeps(curve, slower)) return curve.slow(slower), true;
    return false;
}

// Equal parts of each polynomial, and one more of the longest ones of each leg where that leaves a rest.
bool ShortestPlan::divide(const CurveMemory &whole, std::int64_t pieces, CurveMemory &curve) const {
    const std::int64_t every = pieces / whole.pieces, rest = pieces % whole.pieces, size = 2 * course_.half;
    if (every == 0 || !curve.allocate(course_, pieces)) return false;
    const int dim = course_.dim;
    const double *const own = whole.durations.data();
    std::int64_t first = 0;
    for (std::int64_t i = 0; i < whole.all(); ++i) {
        const std::int64_t leg = i / whole.pieces * whole.pieces;
        std::int64_t longer = 0;
        for (std::int64_t j = leg; j < leg + whole.pieces; ++j) longer += own[j] > own[i] || (own[j] == own[i] && j < i);
        const std::int64_t parts = every + (longer < rest);
        for (int d = 0; d < dim; ++d) {
            DoubleDouble left[most_points], right[most_points];
            for (std::int64_t j = 0; j < size; ++j) left[j] = whole.points[std::size_t((i * size + j) * dim + d)];
            for (std::int64_t part = 0; part < parts; ++part) {
                const bool last = part + 1 == parts;
                const DoubleDouble s = DoubleDouble(1.0) / DoubleDouble(double(parts - part));
                for (std::int64_t j = 0; j < size; ++j) {
                    curve.points[std::size_t(((first + part) * size + j) * dim + d)] = to_double(left[last ? j : 0]);
                    if (last) continue;
                    right[size - 1 - j] = left[size - 1 - j];
                    for (std::int64_t k = 0; k + 1 < size - j; ++k) left[k] += s * (left[k + 1] - left[k]);
                }
                if (!last) std::copy(right, right + size, left);
            }
        }
        for (std::int64_t part = 0; part < parts; ++part) curve.durations[std::size_t(first + part)] = own[i] / double(parts);
        first += parts;
    }
    return true;
}

// Whether the state at the start uses nearly all of a limit.
bool ShortestPlan::on_limit() const {
    const Bounds &bounds = course_.bounds;
    double used = 0.0, thrust = 0.0;
    for (int order = 1; order < std::min(course_.half, 5); ++order) {
        double square = 0.0;
        for (int d = 0; d < course_.dim; ++d) {
            const double value = course_.state(0)[order * course_.dim + d];
            square += value * value;
            if (order == 2) thrust += d == 2 ? (value + bounds.gravity) * (value + bounds.gravity) : value * value;
        }
        used = std::max(used, std::sqrt(square) / bounds.norm[order - 1]);
    }
    thrust = std::sqrt(thrust) / bounds.gravity;
    return !course_.still && (std::max(used, thrust / bounds.most_thrust) > P::on_limit || P::on_limit * thrust < bounds.least_thrust);
}

// A question that begins from rest at every waypoint, or from a curve, whose pieces are not divided where they are several already.
ShortestPlan::Question ShortestPlan::question_from(const Guess *guess) const {
    Question question = question_;
    question.guess = guess;
    if ((guess != nullptr && guess->pieces > 1) || per_leg_ == 1) return question;
    const std::int64_t *const parts = per_leg_ > 0 ? &per_leg_ : course_.legs > 1 ? P::divided : P::alone;
    question.divisions = per_leg_ > 0 ? 1 : 2;
    std::copy(parts, parts + question.divisions, question.parts);
    return question;
}

// From a curve, or from rest at every waypoint, and before that from a better curve where there is one.
void ShortestPlan::solve(const Guess *given, Attempt &found) {
    if (given == nullptr && fewer_first()) return divided(found);
    Guess guess;
    if (given == nullptr && !course_.still && coasting(guess)) {
        certified(question_from(&guess), found);
        if (end_.ended || found.solved.legs > 0 || found.unlimited) return;
    }
    if (end_.over()) return;
    Attempt later;
    certified(question_from(given), later);
    found.then(later);
}

// A curve as a guess, in memory that the next guess takes.
bool ShortestPlan::guess_of(const CurveMemory &curve, Guess &guess) {
    const std::int64_t all = curve.all(), state = std::int64_t(course_.half) * course_.dim;
    Buffer<double> breaks;
    if (!breaks.allocate(std::size_t(all + 1)) || !guess_durations_.allocate(std::size_t(all)) ||
        !guess_knots_.allocate(std::size_t((all + 1) * state)))
        return false;
    write_breaks(curve.durations.data(), all, breaks.data());
    const PiecewiseCurve whole = {curve.points.data(), curve.durations.data(), breaks.data(), all, 2 * course_.half - 1, course_.dim};
    for (std::int64_t i = 0; i <= all; ++i)
        for (int order = 0; order < course_.half; ++order)
            if (evaluate_curve(whole, order, breaks.data() + i, 1, guess_knots_.data() + i * state + order * course_.dim) != Status::done)
                return false;
    for (std::int64_t i = 0; i < all; ++i) guess_durations_[std::size_t(i)] = breaks[std::size_t(i + 1)] - breaks[std::size_t(i)];
    guess = {curve.pieces, guess_durations_.data(), guess_knots_.data(), 1.0};
    return true;
}

// Within rotors fewer pieces first, then more from that curve: more of them take long. The shorter flight of the two.
void ShortestPlan::divided(Attempt &found) {
    const bool eases = course_.still;
    per_leg_ = eases ? P::divided[0] : 1;
    solve(nullptr, found);
    per_leg_ = 0;
    if (!goes_on(found)) return;
    Guess guess;
    Question question = question_from(nullptr);
    if (found.solved.legs > 0 && guess_of(found.solved, guess)) {
        guess.slower = eases ? P::slower_divided : P::slower_whole;
        question.guess = &guess;
        if (eases) question.parts[0] = question.parts[1], question.parts[1] = 1;  // divided, then cut anew
    }
    Attempt finer;
    certified(question, finer);
    found.then(finer);
}

// The curve of least cost through all waypoints that goes on as a moving start does: from rest a search finds a loop back to a waypoint close ahead.
bool ShortestPlan::coasting(Guess &guess) {
    if (!stop_and_go(guess_durations_) || !scaled_.allocate(course_, 1)) return false;
    for (int end = 0; end < 2; ++end) {
        const std::int64_t leg = end == 0 ? 0 : course_.legs - 1;
        const double *const velocity = course_.state(end == 0 ? 0 : course_.legs) + course_.dim;
        double square = 0.0;
        for (int d = 0; d < course_.dim; ++d) square += velocity[d] * velocity[d];
        double &duration = guess_durations_[std::size_t(leg)];
        if (square > 0.0) duration = std::min(duration, std::max(course_.lengths[std::size_t(leg)] / std::sqrt(square), shortest_duration));
    }
    std::copy(guess_durations_.data(), guess_durations_.data() + course_.legs, scaled_.durations.data());
    if (given_.free(scaled_.durations.data(), scaled_) != Status::done || !guess_of(scaled_, guess)) return false;
    std::copy(scaled_.durations.data(), scaled_.durations.data() + course_.legs, guess_durations_.data());
    return true;
}

// The curve of least cost without walls in barely more than the least time there is.
bool ShortestPlan::near_least(std::int64_t pieces, Guess &guess) {
    double least = 0.0;
    if (least_time(course_, unsaid_, least) != Status::done || !(least > 0.0) || !scaled_.allocate(course_, 1)) return false;
    const double sum = summed(course_.lengths.data(), course_.legs);
    for (std::int64_t i = 0; i < course_.legs; ++i)
        scaled_.durations[std::size_t(i)] = P::near_least * least * course_.lengths[std::size_t(i)] / sum;
    CurveMemory finer;
    return given_.free(scaled_.durations.data(), scaled_) == Status::done && divide(scaled_, pieces, finer) && guess_of(finer, guess);
}

Status ShortestPlan::search(const Question &question, CurveMemory &curve) {
    const std::int64_t legs = course_.legs, state = std::int64_t(course_.half) * course_.dim;
    const std::int64_t pieces = (question.guess == nullptr ? 1 : question.guess->pieces) * question.parts[0] * question.parts[1];
    if (!curve.allocate(course_, pieces) || !knots_.allocate(std::size_t((legs * pieces + 1) * state))) return Status::no_memory;
    const Bounds &bounds = course_.bounds;
    const double norms[4] = {bounds.reached(1), bounds.reached(2), bounds.reached(3), bounds.reached(4)};
    const double share = bounds.drags() ? 1.0 - P::proof_margin : 1.0;
    double turning[4][6];
    MomentaryLimit momentary[5];
    std::int64_t limits = 0;
    auto limit = [&](bool given, LimitKind kind, double value) {
        if (!given) return;
        std::copy(bounds.medium, bounds.medium + 5, turning[limits]);
        turning[limits][5] = value;
        momentary[limits] = {std::int64_t(kind), turning[limits]};
        ++limits;
    };
    limit(bounds.drags() && bounds.least_thrust > 0.0, LimitKind::least_thrust, bounds.least_thrust / share);
    limit(bounds.drags() && bounds.most_thrust < infinite, LimitKind::most_thrust, bounds.most_thrust * share);
    limit(bounds.drags() && bounds.tilt < infinite, LimitKind::tilt, std::tan(bounds.tilt * share));
    limit(bounds.body_rate < infinite, LimitKind::body_rate, bounds.body_rate * share);
    double rotors[5 + 3 + 2 + 9 + 16 + 1];
    if (bounds.vehicle != nullptr) {
        const minsnap_vehicle &vehicle = *bounds.vehicle;
        const double hover = bounds.hover(), kept = P::rotor_margin * hover;
        const double first[10] = {bounds.medium[0],
                                  bounds.medium[1],
                                  bounds.medium[2],
                                  bounds.medium[3],
                                  bounds.medium[4],
                                  vehicle.mass,
                                  hover - (bounds.room_below() - kept),
                                  hover + (bounds.room_above() - kept),
                                  std::cos(vehicle.yaw),
                                  std::sin(vehicle.yaw)};
        std::copy(first, first + 10, rotors);
        std::copy(vehicle.inertia, vehicle.inertia + 9, rotors + 10);
        std::copy(vehicle.mixer, vehicle.mixer + 16, rotors + 19);
        rotors[35] = P::aside;
        momentary[limits++] = {std::int64_t(LimitKind::yawed_rotors), rotors};
    }
    answer_ = {};
    answer_.work = work_, answer_.longest = longest_, answer_.totals = totals_.data(), answer_.durations = curve.durations.data();
    answer_.points = curve.points.data(), answer_.knots = knots_.data();
    Told told = {&end_, &answer_};
    ShortestRequest asked = {};
    asked.half = course_.half, asked.dim = course_.dim, asked.legs = legs, asked.closed = course_.closed;
    asked.groups = sets_.count(), asked.limits = limits, asked.divisions = question.divisions;
    asked.moving = moving_, asked.parts = question.parts, asked.worthwhile = legs > 1 ? P::worthwhile : 0.0;
    asked.inwards = question.inwards, asked.tightened = question.tightened, asked.pinned = pinned_.data();
    asked.free = free_.data(), asked.turned = slanted_ ? turned_.data() : nullptr;
    asked.lengths = lengths_.data(), asked.norms = norms, asked.slower = 1.0, asked.cones = sets_.data(), asked.momentary = momentary;
    if (question.guess != nullptr) {
        asked.guessed = question.guess->pieces, asked.slower = question.guess->slower;
        asked.guess_durations = question.guess->durations, asked.guess_knots = question.guess->knots;
    }
    const double block = double(course_.half - 1) * course_.dim;
    asked.row_work = bounds.vehicle != nullptr ? P::rotor_work : P::row_work,
    asked.iteration_work = P::block_work * double(legs * pieces) * block * block * block;
    asked.worth = share_ * course_.worth(), asked.vanishing = P::vanishing, asked.room = P::room_for_totals;
    asked.live = end_.timed(), asked.poll = poll, asked.context = &told;
    const Status status = Status(minsnap_shortest_time(&asked, &answer_));
    work_ = answer_.work, longest_ = answer_.longest, stopped_ = status == Status::spent;
    if (status == Status::spent && answer_.work > asked.worth) end_.ended = true;
    if (status != Status::done && status != Status::spent && status != Status::no_progress) return status;
    curve.pieces = answer_.pieces;
    return status;
}

// A certified plan; none where the search has no curve, or none that can be certified nearby.
void ShortestPlan::certified(Question question, Attempt &found) {
    for (int attempt = 0; attempt < P::tries; ++attempt) {
        CurveMemory curve;
        const Status status = search(question, curve);
        if (status != Status::done && status != Status::spent && status != Status::no_progress) return;
        if (curve.total() < P::vanishing * longest_) return void(found.unlimited = true);
        if (status == Status::no_progress) return;
        if (!inside(curve)) {
            question.inwards = P::farther * std::max(question.inwards, P::inwards);
            continue;
        }
        double excess = 0.0;
        if (within(question, curve, excess, found.unlimited)) {
            found.stands_in = answer_.restored != 0;
            return found.solved.swap(curve);
        }
        if (found.unlimited || stopped_ || excess > P::seen) return;
        question.tightened += P::enough * excess;
    }
}

bool ShortestPlan::inside(const CurveMemory &curve) const {
    bool passes = false;
    waypoint_excess(view(curve), course_, passes);
    return passes && wall_excess(view(curve), course_.walls) <= 0.0;
}

// Fly the same path at the speed at which the most used limit is just kept, if that is about its own.
bool ShortestPlan::within(const Question &question, CurveMemory &curve, double &excess, bool &unlimited) {
    const Bounds &bounds = course_.bounds;
    if (moving_) {
        const double used = largest_use(view(curve), bounds), beyond = rotor_excess(curve);
        if (used <= 1.0 + P::kept && beyond == 0.0) {
            hasten(curve);
            return true;
        }
        excess = std::max(used - 1.0, beyond);
        return false;
    }
    double factor = touching(curve);
    if (!(factor < infinite)) return excess = infinite, false;
    factor = grained(factor);
    excess = factor - 1.0;
    const bool limited = bounds.norm[0] < infinite || bounds.norm[1] < infinite || bounds.norm[2] < infinite || bounds.norm[3] < infinite;
    const double least = -answer_.limit > P::far + question.tightened ? P::nearly : P::idle;
    if (factor < least && !stopped_ && !limited) return unlimited = true, false;
    if (factor > 1.0 + P::not_longer && !stopped_) return false;
    curve.slow(factor);
    return keeps(curve);
}

// Touch limits of rotors that the last barrier has kept away from.
void ShortestPlan::hasten(CurveMemory &curve) {
    if (course_.bounds.vehicle == nullptr || !course_.still || stopped_) return;
    double low = P::hastened, high = 1.0;
    for (int k = 0; k < P::rotor_halvings / 2; ++k) {
        const double middle = grained(0.5 * (low + high));
        (keeps(curve, middle) ? high : low) = middle;
    }
    if (high < 1.0) curve.slow(high);
}

// By how much of its room a rotor goes beyond it at most, up to a factor of two; 0 where all are kept, infinite where it is far.
double ShortestPlan::rotor_excess(const CurveMemory &curve) const {
    const Bounds &bounds = course_.bounds;
    if (vehicle_kept(view(curve), bounds)) return 0.0;
    const double room = std::min(bounds.room_above(), bounds.room_below()) / bounds.hover();
    for (double share = P::rotor_margin; share <= P::seen * room; share *= 2.0)
        if (vehicle_kept(view(curve), bounds, -share)) return share / room;
    return infinite;
}

bool ShortestPlan::keeps(const CurveMemory &curve, double factor) {
    if (factor != 1.0) {
        if (!scaled_.copy(curve)) return false;
        scaled_.slow(factor);
    }
    const CurveView flown = view(factor == 1.0 ? curve : scaled_);
    return largest_use(flown, course_.bounds) <= 1.0 + P::kept && vehicle_kept(flown, course_.bounds);
}

// The factor on time at which the most used limit is just reached, none exceeded; infinite where there is none.
double ShortestPlan::touching(const CurveMemory &curve) {
    const Bounds &bounds = course_.bounds;
    if (!bounds.lifts()) {
        Reached reached;
        if (measure(view(curve), bounds.gravity, false, reached) != Status::done) return infinite;
        double factor = 0.0;
        for (int k = 0; k < 4; ++k)
            if (bounds.norm[k] < infinite)
                factor = std::max(factor, std::pow(std::max(reached.norm[k] / bounds.norm[k], 0.0), 1.0 / (k + 1)));
        return factor;
    }
    const double near = bounds.vehicle == nullptr ? nearby(curve) : infinite;
    if (near < infinite) return near;
    auto kept = [&](double logarithm) {
        if (bounds.vehicle != nullptr) return keeps(curve, logarithm == 0.0 ? 1.0 : grained(std::exp(logarithm)));
        if (!scaled_.copy(curve)) return false;
        scaled_.slow(std::exp(logarithm));
        return largest_use(view(scaled_), bounds) <= 1.0;
    };
    double low = 0.0, high = 0.0, step = P::first_step;
    for (; !kept(high); low = high, high += step, step *= 2.0)
        if (high > P::longest) return infinite;
    for (; low == high || kept(low); high = low, low -= step, step *= 2.0)
        if (low < -P::longest) return 0.0;
    for (int k = 0; k < (bounds.vehicle == nullptr ? P::halvings : P::rotor_halvings) && high - low > P::precision; ++k) {
        const double middle = 0.5 * (low + high);
        (kept(middle) ? high : low) = middle;
    }
    return std::exp(high);
}

// Slope of the logarithm of the largest use in that of the factor on time, and the use; exact for derivatives, and for thrusts where they are largest.
double ShortestPlan::slope(const CurveMemory &curve, double &used) const {
    const Bounds &bounds = course_.bounds;
    used = largest_use(view(curve), bounds);
    Reached reached;
    if (measure(view(curve), bounds.gravity, true, reached) != Status::done) return -2.0;
    for (int k = 0; k < 4; ++k)
        if (reached.norm[k] / bounds.norm[k] == used) return -(k + 1.0);
    const bool most = reached.thrust / bounds.most_thrust == used;
    if (!most && !(bounds.least_thrust > 0.0 && bounds.least_thrust / reached.least_thrust == used)) return -2.0;
    const int which = most ? 0 : 1;
    const std::int64_t piece = reached.piece[which];
    const PiecewiseCurve whole = {curve.points.data(), curve.durations.data(), curve.breaks.data(), curve.all(), 2 * course_.half - 1, 3};
    const double instant = curve.breaks[std::size_t(piece)] + reached.place[which] * curve.durations[std::size_t(piece)];
    double force[3], across = 0.0, square = 0.0;
    if (evaluate_curve(whole, 2, &instant, 1, force) != Status::done) return -2.0;
    for (int d = 0; d < 3; ++d) {
        const double acceleration = force[d];
        if (d == 2) force[d] += bounds.gravity;
        across += acceleration * force[d], square += force[d] * force[d];
    }
    const double own = -2.0 * across / (square > 0.0 ? square : 1.0);
    return most ? own : -own;
}

// The same where it is near one, by a few steps of the secant method; infinite where they do not find it.
double ShortestPlan::nearby(const CurveMemory &curve) {
    double place = 1.0, best = infinite, last_place = 0.0, last_excess = 0.0;
    for (int k = 0; k < P::secants; ++k) {
        if (!scaled_.copy(curve)) return infinite;
        scaled_.slow(place);
        write_breaks(scaled_.durations.data(), scaled_.all(), scaled_.breaks.data());
        double used;
        const double guessed = slope(scaled_, used), excess = std::log(std::min(std::max(used, 1e-3), 1e3));
        if (excess <= P::kept) {
            best = std::min(best, place);
            if (excess >= -P::met) return best;
        }
        if (last_place > 0.0 && place > last_place && excess > std::max(last_excess, 0.0) + P::met) return best;
        const bool known = last_place > 0.0 && place != last_place;
        const double own = known ? (excess - last_excess) / std::log(place / last_place) : guessed;
        double step = (excess + 0.5 * P::met) / std::min(std::max(own, -10.0), -0.2);
        step = std::min(std::max(step, -P::secant_step), P::secant_step);
        last_place = place, last_excess = excess, place = grained(place * std::exp(-step));
    }
    return infinite;
}

// The same path as much more slowly as the limits ask for.
bool ShortestPlan::slowed(CurveMemory &curve) {
    if (!course_.still) return false;
    const double factor = touching(curve);
    if (!(factor < 1e6)) return false;
    curve.slow(grained(factor));
    return keeps(curve) && inside(curve);
}

// Rest at every waypoint, where nothing better was found.
bool ShortestPlan::resting(CurveMemory &curve) {
    Buffer<double> durations;
    if (!stop_and_go(durations) || !curve.allocate(course_, 1)) return false;
    const int count = 2 * course_.half, dim = course_.dim;
    for (std::int64_t leg = 0; leg < course_.legs; ++leg) {
        curve.durations[std::size_t(leg)] = durations[std::size_t(leg)];
        for (int j = 0; j < count; ++j) {
            const double *const from = course_.state(j < course_.half ? leg : leg + 1);
            std::copy(from, from + dim, curve.points.data() + (leg * count + j) * dim);
        }
    }
    return inside(curve) && slowed(curve);
}

// The shortest member of the family that is inside: by the proof that it has, or where what it reaches is within the limits.
Status ShortestPlan::brake(CurveMemory &curve) {
    const Bounds &bounds = course_.bounds;
    const int dim = course_.dim, half = course_.half;
    const std::int64_t legs = std::min<std::int64_t>(course_.legs, 2), count = 2 * half * dim;
    double waypoints[3 * 3], caps[2], moving = 0.0, acceleration = course_.bounds.reached(2);
    for (std::int64_t i = 0; i <= legs; ++i) std::copy(course_.state(i), course_.state(i) + dim, waypoints + i * dim);
    for (int order = 1; order <= 2; ++order) {
        double square = 0.0;
        for (int d = 0; d < dim; ++d) square += course_.state(0)[order * dim + d] * course_.state(0)[order * dim + d];
        moving += (order == 1 ? 1.0 : 0.3) * std::sqrt(square);
    }
    if (!(acceleration < infinite)) acceleration = 0.5 * bounds.gravity;
    sets_.clear(dim);
    Buffer<double> points;
    bool room = points.allocate(std::size_t(2 * count)) && curve.allocate(course_, 2);
    for (int g = 0; room && g < course_.walls.count(); ++g) room = sets_.add_cut(course_.walls[g], 1);
    const int walls = sets_.count();
    if (!room || !make_limits(true)) return says_(Status::no_memory, "there is no memory for a way to come to rest");
    StopRecord asked = {};
    asked.half = half, asked.dim = dim, asked.walls = walls, asked.limits = sets_.count() - walls, asked.legs = legs;
    asked.unit = std::max(moving / acceleration, P::briefest), asked.state = course_.state(0), asked.waypoints = waypoints,
    asked.cones = sets_.data();
    asked.caps = caps, asked.points = points.data();
    for (; minsnap_stop(&asked) == 0; ++asked.member) {
        const std::int64_t pieces = asked.change > 0.0 ? 2 : 1;
        curve.legs = pieces, curve.pieces = 1;
        std::copy(points.data(), points.data() + pieces * count, curve.points.data());
        curve.durations[0] = pieces == 2 ? asked.change * asked.duration : asked.duration;
        if (pieces == 2) curve.durations[1] = (1.0 - asked.change) * asked.duration;
        if ((asked.limited != 0 && !bounds.turns()) || keeps(curve)) return Status::done;
    }
    return says_(Status::no_progress, "no way to come to rest inside the walls of the leg and within the limits was found: brake earlier");
}

}  // namespace minsnap

// The entry points of the public header.
#include <chrono>
#include <new>

#include "basics/export.hpp"
#include "planner/given.hpp"
#include "planner/headings.hpp"
#include "planner/planner.hpp"
#include "planner/time_bound.hpp"
#include "planner/shortest_plan.hpp"
#include "polynomials/enclosure.hpp"
#include "polynomials/evaluate.hpp"

namespace minsnap {
namespace {

using Long = long long;

Status check_curve(const minsnap_curve *curve) {
    if (curve == nullptr || curve->size != std::int64_t(sizeof(minsnap_curve))) return Status::bad_size;
    constexpr std::int64_t most = 10'000'000;
    if (curve->legs < 1 || curve->legs > most || curve->pieces < 1 || curve->pieces > most / curve->legs) return Status::bad_size;
    if (curve->dim < 1 || curve->dim > 3 || curve->degree < 1 || curve->degree > 11) return Status::bad_size;
    return curve->points == nullptr || curve->durations == nullptr || curve->breaks == nullptr ? Status::bad_size : Status::done;
}

Status check_given(const minsnap_curve *curve, const char *what, Says &says) {
    if (check_curve(curve) != Status::done) return says(Status::bad_size, "%s is a null pointer, of another version, or has no legs", what);
    const Pieces pieces{curve->points, curve->durations, curve->legs * curve->pieces, int(curve->degree), int(curve->dim)};
    return pieces.sound() ? Status::done
                          : says(Status::bad_number, "%s has a control point that is not finite, or a duration that is not positive", what);
}

Status check_room(const minsnap_curve *curve, Says &says) {
    if (curve != nullptr && curve->size == std::int64_t(sizeof(minsnap_curve))) return Status::done;
    return says(Status::bad_size, "the curve to be written is a null pointer, or of another version: make it by minsnap_curve_new");
}

// A call with a planner, in its memory.
class Call {
public:
    explicit Call(minsnap_planner &planner) : planner_(planner), pool_(planner.pool) { planner.says.nothing(); }

    // Where memory was refused, that is why there is no answer, whatever became of it on the way.
    minsnap_status ends(Status status) const {
        const bool unanswered =
            status != Status::done && status != Status::spent && status != Status::bad_size && status != Status::bad_number;
        if (unanswered && planner_.pool.refused())
            status = planner_.says(Status::no_memory, "there is no memory for a problem of %lld legs", Long(planner_.course.legs));
        return minsnap_status(status);
    }

private:
    minsnap_planner &planner_;
    const Pool::Use pool_;
};

Status plan(minsnap_planner &planner, SearchEnd &end, bool &seen) {
    seen = false;
    const Course &course = planner.course;
    if (course.limited) return ShortestPlan(course, end, planner.says).run(planner.next);
    GivenTimes given(course, planner.says);
    const Status status = course.durations != nullptr ? given.solve(course.durations, planner.next) : given.split(planner.next);
    seen = given.seen();
    return status;
}

// Prove what was found, unless it was seen to be right, and give it to the caller: nothing leaves that is not certified.
Status give(minsnap_planner &planner, Status status, bool seen, const double *yaws, const HeadingState &from, minsnap_curve &curve) {
    if (status != Status::done && status != Status::spent) return status;
    minsnap_curve made = minsnap_curve_new();
    if (planner.next.legs > 0) {
        minsnap_certificate proved = minsnap_certificate_new();
        Says says;
        const Status looked = seen ? Status::done : certify(view(planner.next), planner.course, proved, says);
        if (looked != Status::done || (!seen && proved.kept == 0))
            return planner.says(Status::not_proved, "a curve was found and not certified: %s", says.text());
        const Status heading = make_heading(yaws, planner.course, from, planner.next);
        if (heading != Status::done)
            return planner.says(heading, "no heading was computed in these durations: give others, less far apart");
        planner.told.swap(planner.next);
        planner.told.tell(made);
    }
    curve = made;
    return status;
}

SearchEnd end_of(const minsnap_problem &problem, double seconds) {
    SearchEnd end;
    end.stop = problem.stop, end.context = problem.context;
    if (seconds > 0.0 && seconds < 1e9)
        end.due = SearchEnd::Clock::now() + std::chrono::duration_cast<SearchEnd::Clock::duration>(std::chrono::duration<double>(seconds));
    return end;
}

bool is_problem(const minsnap_problem *problem) { return problem != nullptr && problem->size == std::int64_t(sizeof(minsnap_problem)); }

// Take a problem that goes on, from the state that a curve flown has at an instant.
Status go_on(minsnap_planner &planner, const minsnap_problem *problem, const minsnap_curve *flown, double instant,
             const minsnap_curve *room) {
    Says &says = planner.says;
    Status status = check_room(room, says);
    if (status == Status::done) status = check_given(flown, "the curve flown", says);
    if (status != Status::done) return status;
    if (!is_problem(problem)) return planner.course.take(problem, says);
    const std::int64_t pieces = flown->legs * flown->pieces;
    const double last = flown->breaks[pieces];
    if (!(instant >= 0.0 && instant <= last))
        return says(Status::bad_number, "the plan goes on at %g s, and the curve flown lasts from 0 to %g s", instant, last);
    if (problem->limits == nullptr || problem->closed != 0) return says(Status::unsupported, "a plan goes on within limits, and is no lap");
    const std::int64_t degree = problem->degree == 0 ? 7 : problem->degree;
    if (problem->dim != flown->dim || flown->degree < degree / 2)
        return says(Status::bad_size, "the curve flown has %lld coordinates and degree %lld, and the problem %lld and %lld",
                    Long(flown->dim), Long(flown->degree), Long(problem->dim), Long(degree));
    double state[6 * 3];
    const PiecewiseCurve whole = {flown->points,           flown->durations, flown->breaks, pieces, std::int32_t(flown->degree),
                                  std::int32_t(flown->dim)};
    for (int order = 0; order < 6 && 2 * order < degree && status == Status::done; ++order)
        status = evaluate_curve(whole, order, &instant, 1, state + order * flown->dim);
    if (status != Status::done) return says(status, "the curve flown has no state at %g s", instant);
    return planner.course.take(problem, says, state);
}

}  // namespace
}  // namespace minsnap

using minsnap::Status;

MINSNAP_EXPORT const char *minsnap_version() { return MINSNAP_VERSION; }

MINSNAP_EXPORT minsnap_status minsnap_open(std::int32_t abi, minsnap_planner **planner) {
    if (planner == nullptr) return MINSNAP_BAD_SIZE;
    if (abi != minsnap_abi()) return MINSNAP_UNSUPPORTED;
    minsnap_planner *const made = new (std::nothrow) minsnap_planner;
    if (made == nullptr) return MINSNAP_NO_MEMORY;
    *planner = made;
    return MINSNAP_DONE;
}

MINSNAP_EXPORT void minsnap_close(minsnap_planner *planner) { delete planner; }

MINSNAP_EXPORT const char *minsnap_message(const minsnap_planner *planner) {
    return planner == nullptr ? "the planner is a null pointer" : planner->says.text();
}

MINSNAP_EXPORT minsnap_status minsnap_plan(minsnap_planner *planner, const minsnap_problem *problem, minsnap_curve *curve) {
    if (planner == nullptr) return MINSNAP_BAD_SIZE;
    const minsnap::Call call(*planner);
    Status status = minsnap::check_room(curve, planner->says);
    if (status == Status::done) status = planner->course.take(problem, planner->says);
    if (status == Status::done) status = minsnap::check_yaws(*problem, planner->course, planner->says);
    if (status != Status::done) return call.ends(status);
    minsnap::SearchEnd end = minsnap::end_of(*problem, problem->seconds);
    bool seen = false;
    status = minsnap::plan(*planner, end, seen);
    return call.ends(minsnap::give(*planner, status, seen, problem->yaws, {}, *curve));
}

MINSNAP_EXPORT minsnap_status minsnap_replan(minsnap_planner *planner, const minsnap_problem *problem, const minsnap_curve *flown,
                                             double now, double budget, minsnap_curve *curve) {
    if (planner == nullptr) return MINSNAP_BAD_SIZE;
    const minsnap::Call call(*planner);
    minsnap::SearchEnd end;
    if (minsnap::is_problem(problem)) end = minsnap::end_of(*problem, budget);
    if (!(budget > 0.0 && budget < 1e9))
        return call.ends(planner->says(Status::bad_number, "the budget is %g s: it must be positive", budget));
    if (!(now >= 0.0))
        return call.ends(planner->says(Status::bad_number, "it is %g s on the clock of the curve flown, which begins at 0", now));
    Status status = minsnap::go_on(*planner, problem, flown, now + budget, curve);
    if (status == Status::done) status = minsnap::check_yaws(*problem, planner->course, planner->says);
    if (status != Status::done) return call.ends(status);
    bool seen = false;
    status = minsnap::plan(*planner, end, seen);
    if (status == Status::spent && planner->next.legs == 0)
        return call.ends(planner->says(status, "no new curve was certified within the budget: the old one stands"));
    minsnap::HeadingState heading;
    if (flown->yaw != nullptr) heading = {minsnap::heading_at(*flown, 0, now + budget), minsnap::heading_at(*flown, 1, now + budget), true};
    status = minsnap::give(*planner, status, seen, problem->yaws, heading, *curve);
    return call.ends(status == Status::spent ? Status::done : status);
}

MINSNAP_EXPORT minsnap_status minsnap_brake(minsnap_planner *planner, const minsnap_problem *problem, const minsnap_curve *flown,
                                            double instant, minsnap_curve *curve) {
    if (planner == nullptr) return MINSNAP_BAD_SIZE;
    const minsnap::Call call(*planner);
    minsnap::SearchEnd end;
    Status status = minsnap::go_on(*planner, problem, flown, instant, curve);
    if (status == Status::done) status = minsnap::ShortestPlan(planner->course, end, planner->says).brake(planner->next);
    return call.ends(minsnap::give(*planner, status, true, nullptr, {}, *curve));
}

MINSNAP_EXPORT minsnap_status minsnap_at(const minsnap_curve *curve, std::int64_t order, const double *t, std::int64_t count, double *out) {
    const Status status = minsnap::check_curve(curve);
    if (status != Status::done) return minsnap_status(status);
    if (count < 0 || order < 0 || (count > 0 && (t == nullptr || out == nullptr))) return MINSNAP_BAD_SIZE;
    const std::int64_t pieces = curve->legs * curve->pieces;
    for (std::int64_t i = 0; i < count; ++i)
        if (!(t[i] >= 0.0 && t[i] <= curve->breaks[pieces])) return MINSNAP_BAD_NUMBER;
    const minsnap::PiecewiseCurve whole = {curve->points,           curve->durations, curve->breaks, pieces, std::int32_t(curve->degree),
                                           std::int32_t(curve->dim)};
    return minsnap_status(minsnap::evaluate_curve(whole, int(std::min<std::int64_t>(order, whole.degree + 1)), t, count, out));
}

MINSNAP_EXPORT minsnap_status minsnap_yaw_at(const minsnap_curve *curve, std::int64_t order, const double *t, std::int64_t count,
                                             double *out) {
    const Status status = minsnap::check_curve(curve);
    if (status != Status::done) return minsnap_status(status);
    if (curve->yaw == nullptr || count < 0 || order < 0 || (count > 0 && (t == nullptr || out == nullptr))) return MINSNAP_BAD_SIZE;
    for (std::int64_t i = 0; i < count; ++i)
        if (!(t[i] >= 0.0 && t[i] <= curve->breaks[curve->legs * curve->pieces])) return MINSNAP_BAD_NUMBER;
    for (std::int64_t i = 0; i < count; ++i) out[i] = minsnap::heading_at(*curve, order, t[i]);
    return MINSNAP_DONE;
}

MINSNAP_EXPORT minsnap_status minsnap_certify(minsnap_planner *planner, const minsnap_problem *problem, const minsnap_curve *curve,
                                              minsnap_certificate *certificate) {
    if (planner == nullptr) return MINSNAP_BAD_SIZE;
    const minsnap::Call call(*planner);
    if (certificate == nullptr || certificate->size != std::int64_t(sizeof(minsnap_certificate)))
        return call.ends(planner->says(Status::bad_size,
                                       "the certificate is a null pointer, or of another version: make it by minsnap_certificate_new"));
    Status status = minsnap::check_given(curve, "the curve", planner->says);
    if (status == Status::done) status = planner->course.take(problem, planner->says);
    if (status != Status::done) return call.ends(status);
    minsnap_certificate proved = minsnap_certificate_new();
    const minsnap::CurveView seen = {curve->points, curve->durations, curve->legs, curve->pieces, int(curve->dim), int(curve->degree)};
    status = minsnap::certify(seen, planner->course, proved, planner->says);
    if (status == Status::done && proved.kept == 0 && planner->pool.refused()) status = Status::not_proved;
    if (status == Status::done) *certificate = proved;
    return call.ends(status);
}

MINSNAP_EXPORT minsnap_status minsnap_least_time(minsnap_planner *planner, const minsnap_problem *problem, double *seconds) {
    if (planner == nullptr) return MINSNAP_BAD_SIZE;
    const minsnap::Call call(*planner);
    if (seconds == nullptr) return call.ends(planner->says(Status::bad_size, "the seconds to be written are a null pointer"));
    double found = 0.0;
    Status status = planner->course.take(problem, planner->says);
    if (status == Status::done) status = minsnap::least_time(planner->course, planner->says, found);
    if (status == Status::done) *seconds = found;
    return call.ends(status);
}

// A plan on a clock: since when it is flown, what is to be flown now, and what takes over after a change. It knows nothing of ROS.
#ifndef MINSNAP_CPP_FLOWN_PLAN_HPP
#define MINSNAP_CPP_FLOWN_PLAN_HPP

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>
#include <minsnap.hpp>
#include <string>
#include <utility>
#include <vector>

namespace minsnap_cpp {

using Vector = std::array<double, 3>;

inline double distance(const Vector &a, const Vector &b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

// What plans are to keep.
struct Asked {
    double corridor = 0.0;  // half-width [m], 0 for none
    double speed = 3.0, acceleration = 6.0;

    minsnap::Problem problem(const std::vector<Vector> &waypoints) const {
        minsnap::Problem problem(3);
        minsnap::Limits limits;
        limits.speed = speed, limits.acceleration = acceleration;
        problem.within(limits);
        for (const Vector &point : waypoints) problem.points.insert(problem.points.end(), point.begin(), point.end());
        if (corridor > 0.0) problem.widths.assign(waypoints.size() - 1, corridor);
        return problem;
    }
};

// One sample of a plan: position [m], velocity [m/s], acceleration [m/s^2], jerk [m/s^3].
using State = std::array<Vector, 4>;

class FlownPlan {
public:
    // A plan through waypoints, which is not begun; empty, with a reason, where there is none.
    static std::shared_ptr<FlownPlan> through(const std::vector<Vector> &waypoints, const Asked &asked, std::string &reason) {
        auto made = std::make_shared<FlownPlan>();
        minsnap::Planner planner;
        if (!planner || waypoints.size() < 2) {
            reason = planner ? "a plan needs at least two waypoints" : "the library is of another version than its header";
            return nullptr;
        }
        minsnap::Plan found = planner.plan(asked.problem(waypoints));
        if (found.status != MINSNAP_DONE) {
            reason = planner.message();
            return nullptr;
        }
        made->waypoints_ = waypoints, made->curve_ = std::move(found.curve);
        return made;
    }

    const minsnap::Curve &curve() const { return curve_; }
    bool begun() const { return begun_; }
    double began() const { return began_; }  // instant of its time 0 on the node's clock [s]
    const FlownPlan &newest() const { return then_ ? *then_ : *this; }
    bool over(double now) const { return begun_ && !then_ && now >= began_ + curve_.duration(); }

    std::shared_ptr<FlownPlan> begun_at(double now) const {
        auto made = std::make_shared<FlownPlan>(*this);
        made->begun_ = true, made->began_ = now;
        return made;
    }

    // What is flown now: this plan, or what has taken over.
    const FlownPlan &at(double now) const { return then_ && now >= then_->began_ ? *then_ : *this; }

    // What is to be flown at an instant: the first state before the plan begins, the last one from its end on.
    State state(double now) const {
        const FlownPlan &flown = at(now);
        const double t = flown.begun_ ? std::clamp(now - flown.began_, 0.0, flown.curve_.duration()) : 0.0;
        State state{};
        for (std::size_t order = 0; order < state.size(); ++order)
            flown.curve_.at({&t, 1}, static_cast<std::int64_t>(order), {state[order].data(), 3});
        return state;
    }

    // The plan with another end, which takes over `budget` seconds from now; empty, with a reason, where it is flown as it was.
    std::shared_ptr<FlownPlan> changed(const Vector &goal, double now, double budget, const Asked &asked, std::string &reason) const {
        const FlownPlan &flown = at(now);
        if (!flown.begun_ || now + budget >= flown.began_ + flown.curve_.duration()) {
            reason = "nothing is flown that could be changed: plan through waypoints instead";
            return nullptr;
        }
        const double t = now - flown.began_;
        std::vector<Vector> ahead(flown.waypoints_.begin() + static_cast<std::ptrdiff_t>(flown.passed(t + budget)), flown.waypoints_.end());
        ahead.back() = goal;
        if (ahead.size() == 2)
            ahead.front() = flown.state(now + budget)[0];  // the leg that is flown is another one, from where the vehicle will be
        minsnap::Planner planner;
        minsnap::Plan found = planner.replan(asked.problem(ahead), flown.curve_, t, budget);
        if (found.status != MINSNAP_DONE) {
            reason = std::string("the plan is flown as it was: ") + planner.message();
            return nullptr;
        }
        auto then = std::make_shared<FlownPlan>();
        then->waypoints_ = std::move(ahead), then->curve_ = std::move(found.curve), then->begun_ = true, then->began_ = now + budget;
        auto made = std::make_shared<FlownPlan>(flown);
        made->then_ = std::move(then);
        return made;
    }

private:
    // The waypoint that was passed last at a time of the plan.
    std::size_t passed(double t) const {
        const auto &breaks = curve_.breaks();
        const auto next = std::upper_bound(breaks.begin(), breaks.end(), t) - breaks.begin();
        return std::min(static_cast<std::size_t>((next - 1) / curve_.pieces()), waypoints_.size() - 2);
    }

    std::vector<Vector> waypoints_;
    minsnap::Curve curve_;
    bool begun_ = false;
    double began_ = 0.0;
    std::shared_ptr<const FlownPlan> then_;
};

}  // namespace minsnap_cpp

#endif

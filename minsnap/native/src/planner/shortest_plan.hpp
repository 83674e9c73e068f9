// The quickest curve within limits: one search on the whole problem, whose curve is certified, scaled to touch its limits, or searched anew.
//
// A search keeps walls and limits at instants and peaks that it sees; proved extrema have the last word. A curve outside of a wall is searched again
// with walls moved further inwards. Where only time is in the way, the curve is flown at the speed at which the most used limit is just kept.
#pragma once

#include <chrono>

#include "planner/answer.hpp"
#include "planner/given.hpp"
#include "shortest_time/border.hpp"

namespace minsnap {

// When a search ends from outside.
struct SearchEnd {
    using Clock = std::chrono::steady_clock;

    Clock::time_point due = Clock::time_point::max();
    std::int64_t (*stop)(void *) = nullptr;
    void *context = nullptr;
    bool ended = false;

    bool timed() const { return due < Clock::time_point::max() || stop != nullptr; }
    bool over() {
        ended = ended || (stop != nullptr && stop(context) != 0) || (due < Clock::time_point::max() && Clock::now() >= due);
        return ended;
    }
};

// Whether a search that begins with rest at every waypoint may end at a flight that is far too long: between two states in motion there are quick
// flights and slow ones, which turn back, and none between; and waypoints close to each other on a straight way are passed slowly once they are.
bool misled(const Course &course);

class ShortestPlan {
public:
    ShortestPlan(const Course &course, SearchEnd &end, Says &says) : course_(course), end_(end), says_(says), given_(course, unsaid_) {}

    // Done, or spent where the search was ended from outside: then the curve has no legs where there is none.
    Status run(CurveMemory &curve);

    // Rest, from the state at the start, within the first leg or two.
    Status brake(CurveMemory &curve);

private:
    // A curve that a search begins from.
    struct Guess {
        std::int64_t pieces;
        const double *durations, *knots;
        double slower;
    };

    // What changes from one search to the next.
    struct Question {
        const Guess *guess = nullptr;
        bool divided = true, rough = false;
        double inwards, tightened, body_rate;
        int first = 0;  // of the divisions
    };

    void make_question();
    bool make_sets();
    bool make_limits(bool all, WallSets &sets);
    bool stop_and_go(Buffer<double> &durations) const;
    Status of_pieces(std::int64_t pieces, CurveMemory &curve);
    bool cut(const CurveMemory &whole, std::int64_t pieces, CurveMemory &curve);
    Status solve(CurveMemory &curve);
    bool on_limit() const;
    Status certified(Question question, CurveMemory &curve);
    Status search(const Question &question, CurveMemory &curve);
    Status divided(CurveMemory &curve);
    void hasten(CurveMemory &curve);
    double rotor_excess(const CurveMemory &curve) const;
    bool softer(Guess &guess);
    bool planned(CurveMemory &curve);
    Status improved(CurveMemory &curve);
    bool guess_of(const CurveMemory &curve, Guess &guess);
    bool coasting(Guess &guess);
    bool within(const Question &question, CurveMemory &curve, double &excess);
    double touching(const CurveMemory &curve);
    double nearby(const CurveMemory &curve);
    double slope(const CurveMemory &curve, double &used) const;
    bool inside(const CurveMemory &curve) const;
    bool keeps(const CurveMemory &curve, double factor = 1.0);
    bool slowed(CurveMemory &curve);
    bool resting(CurveMemory &curve);
    const Course &course_;
    SearchEnd &end_;
    Says &says_;
    Says unsaid_;
    GivenTimes given_;
    WallSets sets_, limits_;
    Question question_;
    bool moving_ = false, found_none_ = false;
    std::int64_t asked_ = 0, per_leg_ = 0;  // pieces of a leg that are asked for, and in this attempt; 0 for those that the search chooses
    ShortestAnswer answer_ = {};
    bool stopped_ = false, kept_ = false;
    double work_ = 0.0, longest_ = 0.0;
    CurveMemory scaled_, searched_;  // the last is what a search left without an end
    Buffer<std::int64_t> free_;
    Buffer<double> lengths_, totals_, knots_, guess_durations_, guess_knots_;
};

}  // namespace minsnap

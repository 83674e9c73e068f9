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
        std::int64_t parts[2] = {1, 1}, divisions = 0;  // into how many parts pieces are divided, time after time
        double inwards = 0.0, tightened = 0.0;
    };

    // What was found: the shortest plan, certified; without legs where there is none.
    struct Attempt {
        CurveMemory solved;
        bool unlimited = false;  // whether nothing limits the time
        bool stands_in = false;  // whether the plan stands in for the end of a search

        bool hopeless() const { return solved.legs == 0 && unlimited; }
        bool shorter(CurveMemory &other, bool other_stands_in = false);
        void then(Attempt &later);
    };

    void make_question();
    void turn_planes();
    bool make_sets();
    bool add_regions();
    bool make_limits(bool all);
    bool stop_and_go(Buffer<double> &durations) const;
    void of_pieces(std::int64_t pieces, Attempt &found);
    bool has_last_try();
    void of_starts(std::int64_t pieces, Attempt &found);
    void of_strategy(std::int64_t pieces, const Guess *guess, Attempt &found);
    void solve(const Guess *guess, Attempt &found);
    void divided(Attempt &found);
    Question question_from(const Guess *guess) const;
    void certified(Question question, Attempt &found);
    Status search(const Question &question, CurveMemory &curve);
    bool goes_on(const Attempt &found) { return !end_.over() && !found.hopeless(); }
    bool fewer_first() const { return course_.bounds.vehicle != nullptr && per_leg_ == 0; }
    bool cut(const CurveMemory &whole, std::int64_t pieces, CurveMemory &curve);
    bool divide(const CurveMemory &whole, std::int64_t pieces, CurveMemory &curve) const;
    bool on_limit() const;
    void hasten(CurveMemory &curve);
    double rotor_excess(const CurveMemory &curve) const;
    bool guess_of(const CurveMemory &curve, Guess &guess);
    bool coasting(Guess &guess);
    bool near_least(std::int64_t pieces, Guess &guess);
    bool within(const Question &question, CurveMemory &curve, double &excess, bool &unlimited);
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
    WallSets sets_;
    Question question_;
    bool moving_ = false;
    std::int64_t per_leg_ = 0;  // pieces of a leg in this attempt; 0 for those that the search chooses
    ShortestAnswer answer_ = {};
    bool stopped_ = false;
    double work_ = 0.0, longest_ = 0.0, share_ = 0.5;  // share_: of the work that the problem is worth, after which a search ends
    CurveMemory scaled_;
    Buffer<std::int64_t> free_;
    Buffer<double> lengths_, totals_, knots_, guess_durations_, guess_knots_;
    Buffer<double> pinned_,
        turned_;            // of the course, with positions along the axes of slanted planes; these (legs + 1, dim, dim), or zeros
    bool slanted_ = false;  // whether there are any
};

}  // namespace minsnap

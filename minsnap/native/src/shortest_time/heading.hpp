// A heading that turns with time: by angles at waypoints, as a function of time, or by cubics on shares of the time that every leg takes.
//
// A step of a search knows how the spline through angles depends on the durations of all legs. Others it holds as they stand over each piece: one on legs
// turns as much more slowly as the piece takes longer, a function of time does not. All are found anew after every step.
#pragma once

#include <algorithm>

#include "arithmetic/elementary.hpp"
#include "arithmetic/lanes.hpp"
#include "basics/border.hpp"
#include "basics/buffer.hpp"
#include "shortest_time/border.hpp"
#include "shortest_time/settings.hpp"

extern "C" std::int32_t minsnap_unconstrained_pinned(const minsnap::ChainRecord *given, double *out, double *states);

namespace minsnap {

struct LegHeadings {
    std::int64_t turns = 0;                 // cubics on each leg, on equal shares of its time; any number where `first` is given
    const double *points = nullptr;         // (cubics, 4) leg by leg [rad]
    double clock = 0.0;                     // seconds that the cubics of one leg span, where it is a function of time
    const std::int64_t *first = nullptr;    // (legs + 1,) first cubic of each leg, and their number; or null
    const double *cuts = nullptr;           // (cubics,) shares of its leg's time at which they begin
    const std::int64_t *follows = nullptr;  // (cubics,) 1 where it is along the velocity, or null

    double power(double inverse) const { return clock > 0.0 ? 1.0 : inverse; }
};

// The cubic spline of least squared angular acceleration through angles at the waypoints.
class SplineHeading {
public:
    [[nodiscard]] bool allocate(const ShortestRequest &request) {
        legs_ = request.legs, angles_ = request.angles, rate_ = request.rate, closed_ = request.closed;
        const std::size_t legs = static_cast<std::size_t>(legs_), knots = legs + 1;
        return angles_ == nullptr || (points_.allocate(4 * legs) && states_.allocate(2 * knots) && durations.allocate(legs) &&
                                      (!few() || (changes_.allocate(knots * legs) && along_.allocate(knots) && steps_.allocate(legs))));
    }

    Buffer<double> durations;  // (legs,) [s]

    // For those durations; where they are too far apart, at rest at every waypoint.
    LegHeadings through() {
        ChainRecord chain = {};
        chain.half = 2, chain.legs = legs_, chain.dim = 1, chain.closed = closed_, chain.points = angles_;
        chain.durations = durations.data(), chain.start = closed_ ? nullptr : &rate_;
        if (minsnap_unconstrained_pinned(&chain, points_.data(), states_.data()) != 0)
            for (std::int64_t k = 0; k < 4 * legs_; ++k) points_[k] = angles_[k / 4 + (k % 4) / 2];
        return {1, points_.data()};
    }

    bool given() const { return angles_ != nullptr; }

    // Whether its legs are so few that a search knows how its rate changes with the durations of all of them.
    bool few() const { return given() && legs_ <= ShortestSettings::coupled_legs; }

    // Find how its rates at the waypoints change with the logarithms of the durations: the equations of a spline, differentiated (C. de Boor,
    // "A Practical Guide to Splines", chapter IV), by sweeps that bring each to a quarter of its error.
    void differentiate() {
        constexpr int sweeps = 16;
        const int legs = static_cast<int>(legs_), first = closed_ ? 0 : 1;
        for (int leg = 0; leg < legs; ++leg) {
            double *change = changes_.data() + static_cast<std::size_t>(leg) * (legs + 1);
            for (int knot = 0; knot <= legs; ++knot) change[knot] = 0.0;
            const double duration = durations[leg], whole = 6.0 * turned(leg) / duration, low = rate(leg, 0), high = rate(leg, 1);
            for (int sweep = 0; sweep < sweeps; ++sweep)
                for (int knot = first; knot < legs; ++knot) {
                    const int before = knot > 0 ? knot - 1 : legs - 1;
                    const double left = 1.0 / durations[before], right = 1.0 / durations[knot];
                    double sum = -left * change[before] - right * change[knot + 1];
                    if (knot == leg) sum += (2.0 * low + high - whole) / duration;
                    if (before == leg) sum += (low + 2.0 * high - whole) / duration;
                    change[knot] = 0.5 * sum / (left + right);
                    if (knot == 0) change[legs] = change[0];
                }
        }
    }

    // How its angle and its two derivatives change at a share of a leg's time with the logarithm of the duration of one, or along steps of all.
    // `own`: 1, or 0 without what a longer time of the leg itself makes of them, where its angles and rates at both ends stay.
    void changes_at(int leg, double share, int other, double own, double *found) const {
        const double *change = changes_.data() + static_cast<std::size_t>(other) * (legs_ + 1) + leg;
        change_of(leg, share, change, other == leg ? own : 0.0, found);
    }
    void along_at(int leg, double share, double own, double *found) const {
        change_of(leg, share, along_.data() + leg, own * steps_[leg], found);
    }

    // Take steps of the logarithms of the durations.
    void take(const double *steps) {
        for (std::int64_t knot = 0; knot <= legs_; ++knot) along_[knot] = 0.0;
        for (std::int64_t leg = 0; leg < legs_; ++leg) {
            steps_[leg] = steps[leg];
            for (std::int64_t knot = 0; knot <= legs_; ++knot) along_[knot] += changes_[leg * (legs_ + 1) + knot] * steps[leg];
        }
    }

private:
    double turned(int leg) const { return points_[4 * leg + 3] - points_[4 * leg]; }
    double rate(int leg, int end) const { return 3.0 * (points_[4 * leg + 1 + 2 * end] - points_[4 * leg + 2 * end]) / durations[leg]; }

    // By changes of the rates at both ends of a leg, and of the logarithm of its duration.
    void change_of(int leg, double share, const double *rates, double longer, double *found) const {
        const double left = 1.0 - share, duration = durations[leg], mean = 3.0 * turned(leg) / duration;
        const double low = rate(leg, 0), high = rate(leg, 1),
                     bend = (2.0 * (share * high - left * low) + 2.0 * (left - share) * (mean - low - high)) / duration;
        const double middle = -longer * mean - rates[0] - rates[1];
        found[0] = duration * share * left * (left * (rates[0] + longer * low) - share * (rates[1] + longer * high));
        found[1] = left * left * rates[0] + share * share * rates[1] + 2.0 * share * left * middle;
        found[2] = (2.0 * (share * rates[1] - left * rates[0]) + 2.0 * (left - share) * middle) / duration - longer * bend;
    }

    std::int64_t legs_ = 0, closed_ = 0;
    const double *angles_ = nullptr;
    double rate_ = 0.0;
    Buffer<double> points_, states_;
    Buffer<double> changes_, along_, steps_;  // (legs, legs + 1) of the rates at the waypoints; (legs + 1,) along steps (legs,)
};

// That of one piece, which begins at a share of the time of its leg and has another.
struct TurningPiece {
    LegHeadings legs;
    int leg;
    double begins, lasts;

    double share(double s) const { return begins + lasts * s; }  // of the leg's time

    // The direction at four instants and two derivatives of it, each east and north, for the inverse of the duration; and where it is the velocity's.
    MINSNAP_INLINE void at(const Quad &s, double inverse, Quad *heading) const {
        const double pace = legs.clock > 0.0 ? 1.0 / legs.clock : lasts * inverse;
        for (int lane = 0; lane < Lanes<Quad>::count; ++lane) {
            const double place = begins + lasts * s[lane], within = place < 1.0 ? place : 1.0;  // nothing is known beyond the end
            const std::int64_t part = part_at(within), cubic = first() + part;
            const double begun = cut(part), width = cut(part + 1) - begun, unit = pace / width;
            const double *b = legs.points + 4 * cubic, right = (within - begun) / width, left = 1.0 - right;
            const double first[3] = {left * b[0] + right * b[1], left * b[1] + right * b[2], left * b[2] + right * b[3]};
            const double second[2] = {left * first[0] + right * first[1], left * first[1] + right * first[2]};
            const double rate = 3.0 * unit * (second[1] - second[0]), bend = 6.0 * unit * unit * (first[2] - 2.0 * first[1] + first[0]);
            double sine, cosine;
            sine_and_cosine(left * second[0] + right * second[1], sine, cosine);
            const double numbers[7] = {cosine,
                                       sine,
                                       -rate * sine,
                                       rate * cosine,
                                       -bend * sine - rate * rate * cosine,
                                       bend * cosine - rate * rate * sine,
                                       legs.follows != nullptr && legs.follows[cubic] != 0 ? 1.0 : 0.0};
            for (int n = 0; n < 7; ++n) heading[n][lane] = numbers[n];
        }
    }

    // Up to two of the next places within the piece where a cubic ends, on the unit interval: how many; `next` is the first that is looked at.
    int cuts_within(int &next, double *found) const {
        int count = 0;
        for (; legs.first != nullptr && next < cubics() && count < 2; ++next) {
            const double place = (cut(next) - begins) / lasts;
            if (place > 0.0 && place < 1.0) found[count++] = place;
        }
        return count;
    }

private:
    MINSNAP_INLINE std::int64_t first() const { return legs.first == nullptr ? leg * legs.turns : legs.first[leg]; }
    MINSNAP_INLINE std::int64_t cubics() const { return legs.first == nullptr ? legs.turns : legs.first[leg + 1] - legs.first[leg]; }

    // Share of the leg's time at which a cubic of it begins, 1 behind the last.
    MINSNAP_INLINE double cut(std::int64_t part) const {
        if (legs.first == nullptr) return static_cast<double>(part) / static_cast<double>(legs.turns);
        return part < cubics() ? legs.cuts[first() + part] : 1.0;
    }

    MINSNAP_INLINE std::int64_t part_at(double within) const {
        if (legs.first == nullptr) return std::min(static_cast<std::int64_t>(within * static_cast<double>(legs.turns)), legs.turns - 1);
        std::int64_t part = 0;
        while (part + 1 < cubics() && cut(part + 1) <= within) ++part;
        return part;
    }
};

}  // namespace minsnap

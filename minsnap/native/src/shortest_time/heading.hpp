// A heading that turns with time: by angles at waypoints, as a function of time, or by cubics on shares of the time that every leg takes.
//
// A step of a search holds it as it stands over each piece: one on legs turns as much more slowly as the piece takes longer, a function of time does
// not. It is found anew after every step: the spline through angles, what a rule makes of the curve, and where pieces end on their leg or in time.
#pragma once

#include <algorithm>

#include "arithmetic/elementary.hpp"
#include "arithmetic/lanes.hpp"
#include "basics/border.hpp"
#include "basics/buffer.hpp"
#include "shortest_time/border.hpp"

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
        return angles_ == nullptr || (points_.allocate(4 * legs_) && states_.allocate(2 * (legs_ + 1)) && durations.allocate(legs_));
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

private:
    std::int64_t legs_ = 0, closed_ = 0;
    const double *angles_ = nullptr;
    double rate_ = 0.0;
    Buffer<double> points_, states_;
};

// That of one piece, which begins at a share of the time of its leg and has another.
struct TurningPiece {
    LegHeadings legs;
    int leg;
    double begins, lasts;

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

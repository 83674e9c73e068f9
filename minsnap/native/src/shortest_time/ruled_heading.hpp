// A heading that a rule makes of any curve, as cubics: along the horizontal velocity, or towards a point.
//
// Where a path is slow its velocity has no direction to rely on: there the heading is held, and turns from where the path was fast to where it is again
// at a limited rate, beginning earlier and ending later where the time is too short for that. `trajectory/velocity_heading.py` has the same rule for
// the plan that is flown; here it serves a search, which asks for it at every step.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "arithmetic/elementary.hpp"
#include "basics/buffer.hpp"
#include "shortest_time/border.hpp"
#include "shortest_time/heading.hpp"

namespace minsnap {

class RuledHeading {
public:
    // An instant of a curve: a horizontal vector and its rate.
    struct Sample {
        double time, east, north, east_rate, north_rate;  // [s], the velocity or the place

        double square() const { return east * east + north * north; }
        double turn() const { return (east * north_rate - north * east_rate) / square(); }
    };

    void set(const ShortestRequest &request) {
        kind_ = static_cast<Kind>(request.rule);
        for (int k = 0; k < 3 && given(); ++k) numbers_[k] = request.ruled[k];
    }
    bool given() const { return kind_ != Kind::none; }
    bool along() const { return kind_ == Kind::velocity; }
    int order() const { return along() ? 1 : 0; }      // of the derivative whose samples are taken
    int samples() const { return along() ? 64 : 16; }  // of a piece

    // Room for the samples of a curve, to be written in order, its end among them.
    [[nodiscard]] bool allocate(int count) {
        const std::size_t room = static_cast<std::size_t>(count), parts = 4 * room + 4, cubics = parts + room;
        return sampled_.allocate(room) && grid_.allocate(2 * room) && holds_.allocate(room) && parts_.allocate(parts) &&
               points_.allocate(4 * cubics) && cuts_.allocate(cubics) && follows_.allocate(cubics) && first_.allocate(room + 1);
    }
    Sample *to_write() { return sampled_.data(); }

    // The heading of a curve over legs of so many samples.
    LegHeadings lay(int legs, int per_leg) {
        const int count = legs * per_leg + 1;
        part_count_ = 0;
        if (along())
            follow(count);
        else
            look(count);
        return share(legs, per_leg);
    }

private:
    enum class Kind : std::int64_t { none = 0, velocity = 1, point = 2 };

    static constexpr double pi = 0x1.921fb54442d18p+1;
    static constexpr double longest_ease = 0.5, slow = 0.5, slow_share = 0.1, reserve = 1e-9;  // as in `TurnSettings`

    struct Place {
        double time, east, north, rate;  // of a vector along it
        bool fast;

        double angle() const { return angle_of(east, north); }
    };
    // Instants between which it turns, by index; before the first or behind the last where it does so from, or to, an end of the path.
    struct Hold {
        int first, last;
    };
    // From an instant on: an angle and the coefficients of the time since; or along the velocity.
    struct Part {
        double begins, angle, first, second, third;
        bool follows;
    };
    // A turn between two instants: to rest, by a cubic, up to speed.
    struct Turn {
        double ease, middle, angle;
    };

    static double nearest(double angle) { return angle - 2.0 * pi * std::floor(angle / (2.0 * pi) + 0.5); }

    // Towards the point, by a cubic between any two samples.
    void look(int count) {
        for (int k = 0; k < count; ++k) {
            const Sample &at = sampled_[k];
            const Sample to = {at.time, numbers_[0] - at.east, numbers_[1] - at.north, -at.east_rate, -at.north_rate};
            grid_[k] = {at.time, to.east, to.north, to.square() > 0.0 ? to.turn() : 0.0, true};
        }
        for (int k = 0; k + 1 < count; ++k) {
            const Place &from = grid_[k], &to = grid_[k + 1];
            const double span = to.time - from.time, angle = from.angle(), mean = nearest(to.angle() - angle) / span;
            parts_[part_count_++] = {from.time,
                                     angle,
                                     from.rate,
                                     (3.0 * mean - 2.0 * from.rate - to.rate) / span,
                                     (from.rate + to.rate - 2.0 * mean) / (span * span),
                                     false};
        }
    }

    // Along the velocity, but for the holds.
    void follow(int count) {
        find_places(count);
        find_holds();
        int since = 0;
        for (int n = 0; n <= hold_count_; ++n) {
            const bool last = n == hold_count_;
            const int until = last ? place_count_ - 1 : holds_[n].first;
            if (until >= 0 && since < place_count_ && !(begins_given() && until == 0))
                parts_[part_count_++] = {grid_[since].time, 0.0, 0.0, 0.0, 0.0, true};
            if (last) break;
            turn_through(holds_[n]);
            since = holds_[n].last;
        }
    }

    bool begins_given() const { return numbers_[2] < HUGE_VAL; }

    // The samples, and the slowest places between them that alone are slow.
    void find_places(int count) {
        double top = 0.0;
        for (int k = 0; k < count; ++k) top = std::max(top, sampled_[k].square());
        top = std::sqrt(top);
        const double own = numbers_[1] > 0.0 ? numbers_[1] : std::min(slow, slow_share * top), least = std::min(own, top);
        const auto place = [&](const Sample &at) {
            const bool fast = at.square() >= least * least && top > 0.0;
            grid_[place_count_++] = {at.time, at.east, at.north, fast ? at.turn() : 0.0, fast};
        };
        place_count_ = 0;
        for (int k = 0; k < count; ++k) {
            const Sample &at = sampled_[k];
            const double bend = at.east_rate * at.east_rate + at.north_rate * at.north_rate;
            const bool lowest = k > 0 && k + 1 < count && at.square() <= std::min(sampled_[k - 1].square(), sampled_[k + 1].square());
            Sample dip = at;
            if (lowest && at.square() >= least * least && bend > 0.0) {
                const double step = -(at.east * at.east_rate + at.north * at.north_rate) / bend;
                const double moved = std::min(std::max(step, sampled_[k - 1].time - at.time), sampled_[k + 1].time - at.time);
                dip = {at.time + moved, at.east + moved * at.east_rate, at.north + moved * at.north_rate, at.east_rate, at.north_rate};
            }
            const bool dips = dip.square() < least * least && lowest;
            if (dips && dip.time < at.time) place(dip);
            place(at);
            if (dips && dip.time > at.time) place(dip);
        }
        if (!begins_given()) return;
        grid_[0].rate = 0.0, grid_[0].fast = true, grid_[1].fast = false;
        sine_and_cosine(numbers_[2], grid_[0].north, grid_[0].east);
    }

    // The runs of slow places, widened until each turns slowly enough; those that meet are joined.
    void find_holds() {
        hold_count_ = 0;
        for (int k = 0; k < place_count_; ++k) {
            if (grid_[k].fast) continue;
            const int first = k - 1;
            while (k + 1 < place_count_ && !grid_[k + 1].fast) ++k;
            holds_[hold_count_++] = {first, k + 1};
        }
        for (int at = 0; at < hold_count_;) {
            const int low = at > 0 ? holds_[at - 1].last : 0, high = at + 1 < hold_count_ ? holds_[at + 1].first : place_count_ - 1;
            if (widened(holds_[at], low, high)) {
                ++at;
                continue;
            }
            join(at, low, high);
            at = std::max(at - 1, 0);  // it takes room from the one before, which may have to be wider now
        }
    }

    // Find the narrowest one that turns slowly enough; false if the room is too narrow.
    bool widened(Hold &hold, int low, int high) const {
        const bool begins = hold.first < 0, ends = hold.last >= place_count_;
        if (begins && ends) return true;
        const bool free = begins || (begins_given() && hold.first == 0);
        const double most = numbers_[0] * (1.0 - reserve);
        const int steps = std::min(free ? place_count_ : hold.first - low, ends ? place_count_ : high - hold.last);
        for (int n = 0; n <= steps; ++n) {
            const int before = std::max(hold.first - n, 0), after = std::min(hold.last + n, place_count_ - 1);
            const int first = begins ? after : before, last = ends ? before : after;
            double largest = std::max(std::abs(grid_[first].rate), std::abs(grid_[last].rate));
            if (!begins && !ends) {
                const Turn turn = turn_between(first, last);
                largest = std::max(largest, 1.5 * std::abs(turn.angle) / turn.middle);
            }
            if (!(largest <= most)) continue;
            hold = {free ? hold.first : hold.first - n, ends ? hold.last : hold.last + n};
            return true;
        }
        return false;
    }

    // Join a hold without room with its nearer neighbour, or let it begin or end with the path.
    void join(int at, int low, int high) {
        Hold &hold = holds_[at];
        const bool back =
            hold.first >= 0 && !(begins_given() && hold.first == 0) && (hold.last >= place_count_ || hold.first - low <= high - hold.last);
        const int other = back ? at - 1 : at + 1, kept = std::min(at, other);
        const bool joins = other >= 0 && other < hold_count_;
        if (back)
            hold.first = joins ? holds_[other].first : -1;
        else
            hold.last = joins ? holds_[other].last : place_count_;
        if (!joins) return;
        holds_[kept] = hold;
        --hold_count_;
        for (int n = kept + 1; n < hold_count_; ++n) holds_[n] = holds_[n + 1];
    }

    Turn turn_between(int first, int last) const {
        const Place &from = grid_[first], &to = grid_[last];
        const double span = to.time - from.time, ease = std::min(longest_ease, 0.25 * span);
        return {ease, span - 2.0 * ease, nearest(to.angle() - from.angle() - 0.5 * ease * (from.rate + to.rate))};
    }

    // The parts of a hold; one that begins or ends with the path only eases.
    void turn_through(const Hold &hold) {
        const bool begins = hold.first < 0, ends = hold.last >= place_count_;
        const int first = std::max(hold.first, 0), last = std::min(hold.last, place_count_ - 1);
        const Place &from = grid_[first], &to = grid_[last];
        Turn turn = {std::min(longest_ease, to.time - from.time), 1.0, 0.0};
        if (!begins && !ends) turn = turn_between(first, last);
        const double ease = turn.ease, slower = ease > 0.0 ? -from.rate / (2.0 * ease) : 0.0,
                     faster = ease > 0.0 ? to.rate / (2.0 * ease) : 0.0;
        const double held = begins ? to.angle() - 0.5 * to.rate * ease : from.angle() + 0.5 * from.rate * ease,
                     square = turn.middle * turn.middle;
        if (!begins) parts_[part_count_++] = {from.time, from.angle(), from.rate, slower, 0.0, false};
        parts_[part_count_++] = {begins ? from.time : from.time + ease,
                                 begins && ends ? first_fast() : held,
                                 0.0,
                                 3.0 * turn.angle / square,
                                 -2.0 * turn.angle / (square * turn.middle),
                                 false};
        if (!ends) parts_[part_count_++] = {to.time - ease, held + turn.angle, 0.0, faster, 0.0, false};
    }

    double first_fast() const {
        for (int k = 0; k < place_count_; ++k)
            if (grid_[k].fast) return grid_[k].angle();
        return 0.0;
    }

    // Share the parts out to the legs, as cubics on shares of their times.
    LegHeadings share(int legs, int per_leg) {
        constexpr double trifle = 1e-9;  // of a leg, which has no part of its own
        std::int64_t count = 0;
        for (int leg = 0, part = 0; leg < legs; ++leg) {
            const double begins = sampled_[leg * per_leg].time, ends = sampled_[(leg + 1) * per_leg].time, whole = ends - begins;
            first_[leg] = count;
            for (double from = begins; from < ends; ++count) {
                while (part + 1 < part_count_ && parts_[part + 1].begins <= from + trifle * whole) ++part;
                const double next = part + 1 < part_count_ ? parts_[part + 1].begins : ends,
                             to = next < ends - trifle * whole ? next : ends;
                write(count, parts_[part], from, to);
                cuts_[count] = (from - begins) / whole;
                from = to;
            }
        }
        first_[legs] = count;
        return {0, points_.data(), 0.0, first_.data(), cuts_.data(), along() ? follows_.data() : nullptr};
    }

    void write(std::int64_t at, const Part &part, double from, double to) {
        const auto angle = [&](double t) { return part.angle + t * (part.first + t * (part.second + t * part.third)); };
        const auto rate = [&](double t) { return part.first + t * (2.0 * part.second + 3.0 * t * part.third); };
        const double low = from - part.begins, high = to - part.begins, third = (to - from) / 3.0;
        double *points = points_.data() + 4 * at;
        points[0] = angle(low), points[1] = points[0] + third * rate(low);
        points[3] = angle(high), points[2] = points[3] - third * rate(high);
        follows_[at] = part.follows ? 1 : 0;
    }

    Kind kind_ = Kind::none;
    double numbers_[3] =
        {};  // the largest rate of a hold, the speed below which it is held or 0, the angle at the start or none; or a point
    Buffer<Sample> sampled_;
    Buffer<Place> grid_;
    Buffer<Hold> holds_;
    Buffer<Part> parts_;
    Buffer<double> points_, cuts_;
    Buffer<std::int64_t> follows_, first_;
    int place_count_ = 0, hold_count_ = 0, part_count_ = 0;
};

}  // namespace minsnap

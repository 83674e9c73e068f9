// The shortest time within walls and limits, from coarse to fine: one piece a leg from rest at every waypoint, then nearly the same curve divided.
#pragma once

#include "basics/status.hpp"
#include "shortest_time/division.hpp"
#include "shortest_time/interior_point.hpp"

namespace minsnap {

template <class S>
class ShortestTime {
public:
    using Settings = ShortestSettings;

    ShortestTime(const ShortestRequest &request, const Instants<S::half, S::instants> &tables, Watch &watch)
        : request_(request), point_(tables, watch) {}

    Status run(ShortestAnswer &answer) {
        std::int64_t most = request_.legs;
        for (std::int64_t k = 0; k < request_.divisions; ++k) most *= request_.parts[k];
        most *= std::max<std::int64_t>(request_.guessed, 1);
        const int pieces = static_cast<int>(most);
        if (!point_.allocate(pieces) || !best_.allocate(pieces)) return Status::no_memory;
        if (!point_.rows.build(request_)) return Status::no_memory;
        begin();
        StageEnd end = stages();
        answer.restored = end == StageEnd::stuck;
        if (end == StageEnd::stuck) end = restored();
        return finished(end, answer);
    }

private:
    // At rest at every knot but for what is pinned, as fast as limits on norms allow.
    void begin() {
        Chain<S> &chain = point_.chain;
        chain.course = {static_cast<int>(request_.legs),
                        request_.closed != 0,
                        request_.moving != 0,
                        request_.timed != 0,
                        request_.total,
                        request_.free,
                        request_.turned};
        chain.pieces = static_cast<int>(request_.legs);
        chain.per_leg = 1;
        double sizes[3] = {0.0, 0.0, 0.0};
        const double enough = cruising();
        for (int i = 0; i < chain.pieces; ++i) {
            chain.sigma[i] = logarithm(stop_and_go(request_.lengths[i]));
            double size = std::min(request_.lengths[i], enough);
            const double duration = stop_and_go(size);
            for (double &largest : sizes) largest = std::max(largest, size /= duration);
        }
        for (int q = 0; q < 3; ++q) point_.objective.sizes[q] = std::min(request_.norms[q], peaks[q] * sizes[q]);
        for (int j = 0; j < (chain.pieces + 1) * S::knot; ++j) chain.w[j] = request_.pinned[j];
        point_.objective.price = request_.total > 0.0 ? 1.0 : request_.price;
        if (request_.guessed > 0)
            guess();
        else
            chain.slow(Settings::slowed);
        point_.rows.wall_margin = 0.0;
        point_.rows.limit_margin = request_.tightened;
        prepare();
    }

    // The curve that is given, flown a little more slowly; what is pinned stays.
    void guess() {
        Chain<S> &chain = point_.chain;
        chain.per_leg = static_cast<int>(request_.guessed);
        chain.pieces = chain.per_leg * chain.course.legs;
        for (int i = 0; i < chain.pieces; ++i) chain.sigma[i] = logarithm(request_.guess_durations[i]);
        for (int k = 0; k <= chain.pieces; ++k) {
            double *knot = chain.w.data() + static_cast<std::size_t>(k) * S::knot;
            own_knot(chain, k, request_.guess_knots + static_cast<std::size_t>(k) * S::knot, knot);
            for (int entry = 0; entry < S::knot; ++entry)
                if (!chain.varies(k, entry)) knot[entry] = request_.pinned[k / chain.per_leg * S::knot + entry];
        }
        chain.slow(request_.slower);
    }

    // Duration of the rest-to-rest profile of degree 7 over a length within the limits on norms.
    double stop_and_go(double length) const {
        double longest = 0.0;
        for (int q = 1; q <= condition_orders - 1; ++q)
            if (request_.norms[q - 1] < 1e300)
                longest = std::max(longest, exponential(logarithm(peaks[q - 1] * length / request_.norms[q - 1]) / q));
        return longest > 0.0 ? longest : 1e-3 + length;
    }

    // Four times the length just long enough for the same profile to reach the limit on the speed: a leg that is longer mostly cruises, and what is large
    // on it is so on its ramps, not on its average. A price brings its own smoothness, and limits at instants bind where a curve is rough.
    double cruising() const {
        constexpr double infinite = 1e300;
        if (request_.limits > 0 || costs() || request_.norms[0] >= infinite) return infinite;
        double duration = 0.0;
        for (int q = 2; q <= condition_orders - 1; ++q)
            if (request_.norms[q - 1] < infinite)
                duration = std::max(
                    duration, exponential(logarithm(peaks[q - 1] * request_.norms[0] / (peaks[0] * request_.norms[q - 1])) / (q - 1)));
        return duration > 0.0 ? 4.0 * request_.norms[0] * duration / peaks[0] : infinite;
    }

    void prepare() {
        Chain<S> &chain = point_.chain;
        point_.objective.unit = chain.total();
        for (int i = 0; i + 1 < chain.pieces; ++i) point_.objective.ratio[i] = chain.sigma[i] - chain.sigma[i + 1];
    }

    // Whether the last stage converged. Within rotors the way round free fall and round the heading is found with a body that is easy to turn; where a
    // search from there has no end, another begins at rest.
    StageEnd stages() {
        if (eases()) {
            const StageEnd end = eased();
            if (end != StageEnd::stuck) return end;
            point_.rows.ease(1.0);
            begin();
        }
        if (!point_.begin(first_gap())) return StageEnd::no_memory;
        if (request_.planned != 0 &&
            !(point_.rows.begin_from_plan(point_.chain, point_.values(), request_.inwards) && point_.begin(first_gap())))
            return StageEnd::no_memory;
        return divided(false);
    }

    bool eases() const { return request_.guessed == 0 && request_.rough == 0 && !costs() && point_.rows.turns_hard(); }

    // From rest with a body that is easy to turn, inside all rows at every step; then its own, more slowly until it is inside again.
    StageEnd eased() {
        point_.rows.ease(Settings::easy);
        if (!slow_until_inside(Settings::slowed)) return StageEnd::stuck;
        point_.within = true;
        if (!point_.begin(Settings::easy_gap)) return StageEnd::no_memory;
        const StageEnd end = point_.run(Settings::easy_end, true);
        point_.within = false;
        point_.rows.ease(1.0);
        if (end == StageEnd::no_memory || (end == StageEnd::stopped && !point_.begin(first_gap()))) return StageEnd::no_memory;
        if (end == StageEnd::stopped) return end;
        return slow_until_inside(Settings::slowed_easy) ? divided(true) : StageEnd::stuck;
    }

    // Slow the curve by factors until it is inside all rows; false where slower flight does not bring it there.
    bool slow_until_inside(double factor) {
        const double most = Settings::slowest * point_.chain.total();
        for (; point_.begin(first_gap()) && point_.chain.total() < most; prepare()) {
            if (point_.largest() < -Settings::well_inside) return true;
            point_.chain.slow(factor);
        }
        return false;
    }

    // Where the search has no end: on from the shortest curve inside that it came by, divided step by step, inside all rows first and then as usual.
    StageEnd restored() {
        Chain<S> &chain = point_.chain, &inside = point_.inside;
        if (inside.pieces == 0 || request_.rough != 0 || request_.timed != 0 || request_.price > 0.0) return StageEnd::stuck;
        StageEnd end = StageEnd::stuck;
        int pieces = static_cast<int>(std::max<std::int64_t>(request_.guessed, 1));
        for (std::int64_t k = 0; k <= request_.divisions && end != StageEnd::stopped; ++k) {
            if (k > 0) pieces *= static_cast<int>(request_.parts[k - 1]);
            if (pieces < inside.per_leg || (pieces == 1 && request_.divisions > 0)) continue;
            if (!divide(point_.rows, nullptr, inside, pieces / inside.per_leg, chain)) return StageEnd::no_memory;
            prepare();
            point_.within = true;
            if (!point_.begin(Settings::divided_gap)) return StageEnd::no_memory;
            if (point_.largest() < 0.0) end = point_.run(Settings::coarse_gap, true);
            point_.within = false;
            if (end == StageEnd::stopped) return end;
            if (!point_.begin(Settings::coarse_gap)) return StageEnd::no_memory;
            const bool last = k == request_.divisions;
            end = point_.run(last ? Settings::last_gap : Settings::rough_gap, !last);
        }
        return end;
    }

    // Whether the cost counts.
    bool costs() const { return request_.price > 0.0 || request_.total > 0.0; }

    double last_gap() const { return point_.chain.course.total > 0.0 ? Settings::held_gap : Settings::last_gap; }

    double first_gap() const { return request_.guessed > 0 ? Settings::divided_gap : Settings::first_gap; }

    // Search, divide and search again; stages that others follow end roughly. A curve that was eased is divided at once.
    StageEnd divided(bool eased) {
        constexpr double infinite = 1e300;  // a time that is not known: any other is worth more
        const bool once = request_.divisions == 1, guessed = request_.guessed > 0, rough = once && !guessed && !eased;
        for (int k = 0;
             !point_.chain.held() && request_.planned == 0 && k < Settings::slowings && point_.rows.slows() && point_.largest() > 0.0;
             ++k) {
            point_.chain.slow(Settings::slowed);
            prepare();
            if (!point_.begin(first_gap())) return StageEnd::no_memory;
        }
        const bool whole = guessed && request_.divisions == 0 && !costs(), swift = request_.slower == 1.0;
        const bool alike = whole && swift && request_.moving != 0;  // to what was searched
        if (alike && std::abs(point_.largest()) < Settings::touched) point_.start(Settings::touched_gap, Settings::touched_slack);
        if (request_.rough != 0) return point_.run(Settings::guess_gap, true);
        StageEnd end = StageEnd::converged;
        if (request_.divisions > 0 && !eased)
            end = point_.run(once ? Settings::coarse_gap : Settings::rough_gap, !guessed);  // a guess in motion is followed closely
        double former = 0.0;                                                                // where known
        for (std::int64_t k = 0; k < request_.divisions && end != StageEnd::stopped; ++k) {
            const double now = point_.chain.total();
            const bool stuck = end == StageEnd::stuck && request_.worthwhile > 0.0;  // where any gain is worth it, more pieces may go on
            if (k > 0 && (stuck || now > former * (1.0 - request_.worthwhile))) break;
            former = end == StageEnd::converged && !(eased && k == 0) ? now : infinite;
            best_.copy(point_.chain);
            if (!divide(point_.rows, point_.values(), best_, static_cast<int>(request_.parts[k]), point_.chain)) return StageEnd::no_memory;
            point_.chain.slow(eased ? Settings::slowed_easy : Settings::slowed_again);
            prepare();
            if (!point_.begin(eased && k == 0 ? Settings::first_gap : Settings::divided_gap)) return StageEnd::no_memory;
            if (rough || k + 1 < request_.divisions) end = point_.run(Settings::rough_gap, true);
        }
        if (!rough && end != StageEnd::stopped) end = point_.run(last_gap());
        const bool whole_way = eased || (guessed && point_.rows.turns_hard());  // searched once: a second time gains little there
        return once && !whole_way && !point_.chain.held() && end != StageEnd::stopped ? polished(end, rough) : end;
    }

    // Search on from the same curve flown a little more slowly, as valleys are flat with several pieces; where that finds no shorter one, take or end the first.
    StageEnd polished(StageEnd end, bool rough) {
        constexpr double as_good = 1.00001;
        const double before = point_.chain.total();
        best_.copy(point_.chain);
        point_.chain.slow(Settings::eased);
        if (!point_.begin(Settings::divided_gap)) return StageEnd::no_memory;
        const StageEnd again = point_.run(last_gap());
        if (again == StageEnd::stopped || (again == StageEnd::converged && point_.chain.total() <= as_good * before)) return again;
        point_.chain.copy(best_);
        if (!point_.begin(rough ? Settings::rough_gap : last_gap())) return StageEnd::no_memory;
        return rough ? point_.run(last_gap()) : end;
    }

    // Bring the curve inside at true peaks: walls move inwards, and limits where time may not be scaled.
    Status finished(StageEnd end, ShortestAnswer &answer) {
        if (end == StageEnd::no_memory) return Status::no_memory;
        if (end == StageEnd::stopped) return stopped(answer);
        if (end == StageEnd::stuck) return given_up(answer);
        if (request_.rough != 0) {
            write(answer);
            return Status::done;
        }
        constexpr double enough = 1.1;
        for (int repair = 0; repair <= Settings::repairs; ++repair) {
            point_.excess(request_.inwards, answer.wall, answer.limit);
            const bool fast = request_.moving != 0 && answer.limit > Settings::leak;
            if ((answer.wall <= Settings::leak && !fast) || repair == Settings::repairs) break;
            if (answer.wall > 1.0 || answer.limit > 1.0) return given_up(answer);
            if (answer.wall > Settings::leak) point_.rows.wall_margin += enough * answer.wall + 10.0 * Settings::leak;
            if (fast) point_.rows.limit_margin += enough * answer.limit + 10.0 * Settings::leak;
            point_.resume(last_gap());
            if (point_.run(last_gap()) == StageEnd::stopped) return stopped(answer);
        }
        constexpr double shorter = 0.999;
        const Chain<S> &inside = point_.inside;
        const bool passed = !costs() && inside.pieces > 0 && inside.total() < shorter * point_.chain.total();
        const bool over = request_.moving != 0 && answer.limit > Settings::seen;
        if (answer.wall > 1e-6 || over || passed) return given_up(answer);
        write(answer);
        return Status::done;
    }

    // The shortest curve inside that it came by in place of an end, in at least as many pieces; without one the last curve, which says why.
    Status given_up(ShortestAnswer &answer) {
        Chain<S> &chain = point_.chain, &inside = point_.inside;
        const bool known = inside.pieces > 0 && request_.rough == 0;
        if (known) {
            const int parts = std::max(1, chain.per_leg / inside.per_leg);
            answer.restored = 1;
            if (!divide(point_.rows, nullptr, inside, parts, chain) || !point_.begin(last_gap())) return Status::no_memory;
            point_.excess(request_.inwards, answer.wall, answer.limit);
        }
        write(answer);
        return known ? Status::done : Status::no_progress;
    }

    // The shortest curve inside where the search was ended from outside; where slower flight mends it for sure, or none was inside, the last one.
    Status stopped(ShortestAnswer &answer) {
        point_.excess(request_.inwards, answer.wall, answer.limit);
        Chain<S> &chain = point_.chain, &inside = point_.inside;
        const bool scales = request_.moving == 0, kept = answer.wall <= Settings::leak && (scales || answer.limit <= Settings::leak);
        const double total = chain.total() * (scales ? 1.0 + std::max(answer.limit, 0.0) : 1.0);
        if (inside.pieces > 0 && !(kept && (total <= inside.total() || costs()))) chain.copy(inside);
        write(answer);
        return Status::spent;
    }

    void write(ShortestAnswer &answer) const {
        const Chain<S> &chain = point_.chain, &inside = point_.inside;
        answer.pieces = chain.per_leg;
        answer.iterations = point_.iterations;
        answer.total = chain.total();
        write(chain, answer.durations, answer.points, answer.knots);
        answer.inside = answer.inside_durations != nullptr && inside.pieces > 0 ? inside.per_leg : 0;
        if (answer.inside > 0) write(inside, answer.inside_durations, answer.inside_points, answer.inside_knots);
    }

    void write(const Chain<S> &chain, double *durations, double *points, double *knots) const {
        PieceEnds<S> piece;
        for (int i = 0; i < chain.pieces; ++i) {
            chain.ends(i, piece);
            const PieceCurve<S> curve(piece);
            durations[i] = chain.course.timed ? request_.guess_durations[i] : piece.duration;
            for (int j = 0; j < S::ends; ++j)
                for (int c = 0; c < S::dim; ++c) points[(i * S::ends + j) * S::dim + c] = curve.points[0][j][c];
        }
        for (int k = 0; k <= chain.pieces; ++k)
            world_knot(chain, k, chain.w.data() + (chain.course.closed && k == chain.pieces ? 0 : k) * S::knot, knots + k * S::knot);
    }

    // Largest derivatives of the profile 35 s^4 - 84 s^5 + 70 s^6 - 20 s^7 over the unit interval.
    static constexpr double peaks[4] = {2.1875, 7.5132, 52.5, 840.0};

    const ShortestRequest &request_;
    InteriorPoint<S> point_;
    Chain<S> best_;
};

template <int half, int dim, int count>
Status search(const ShortestRequest &request, ShortestAnswer &answer) {
    static const Instants<half, count> tables;
    Watch watch(request, answer);
    return ShortestTime<Shape<half, dim, count>>(request, tables, watch).run(answer);
}

}  // namespace minsnap

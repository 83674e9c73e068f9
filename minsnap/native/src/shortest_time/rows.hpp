// Rows of the programme: every condition of a leg at every instant of its pieces, and conditions of knots; their values and their change along a step.
//
// Rows of one piece stand together: by condition, then by instant, so that loops over instants run along contiguous numbers; those of its knot follow,
// and rows that always hold, to a multiple of four. Four rows in a group sleep as long as all are far inside: they have values, but no slacks.
#pragma once

#include "shortest_time/chain.hpp"
#include "shortest_time/conditions.hpp"
#include "shortest_time/heading.hpp"
#include "shortest_time/instant_limits.hpp"
#include "shortest_time/piece_curve.hpp"
#include "shortest_time/ruled_heading.hpp"

namespace minsnap {

// A piece as it is.
template <class S>
struct PieceState {
    using Jets = double[condition_orders][S::dim][S::instants];

    PieceEnds<S> ends;
    Jets jets;  // derivatives at its instants: by order, axis, instant
};

template <class S>
class Rows {
public:
    static constexpr int count_at = S::instants, together = InstantTerms::together;
    static_assert(count_at % together == 0, "instants are taken four at a time");
    using Jets = typename PieceState<S>::Jets;

    const Instants<S::half, S::instants> &instants;
    ConditionTable<S::dim> legs, knots;
    Buffer<InstantLimit> limits;  // on all legs
    int limit_count = 0;
    double share = 1.0;                // of its inertia that the body has
    Buffer<std::int32_t> first;        // row of every piece, and their number
    Buffer<double> margin;             // (rows,) added to the value: frozen between changes of the barrier
    Buffer<unsigned char> awake;       // (rows / together,)
    bool used[condition_orders] = {};  // orders of derivatives that conditions of legs and limits depend on
    int count = 0, regular = 0;        // rows, and those not of knots
    double wall_margin = 0.0, limit_margin = 0.0;

    explicit Rows(const Instants<S::half, S::instants> &tables) : instants(tables) {}

    [[nodiscard]] bool build(const ShortestRequest &request) {
        limit_count = static_cast<int>(request.limits);
        ruled_.set(request);
        if (!limits.allocate(limit_count)) return false;
        for (std::int64_t k = 0; k < request.groups; ++k) used[request.cones[k].order] |= request.cones[k].at_knots == 0;
        for (int k = 0; k < limit_count; ++k) {
            limits[k] = InstantLimit(request.momentary[k]);
            if (limits[k].of_yaw()) own_ = limits[k].parameters;
            headed_ = headed_ || limits[k].headed();
            limits[k].timed = request.clock > 0.0;
            limits[k].along = ruled_.along();
            if (limits[k].follows()) limits[k].span.low = 1;
            for (int q = limits[k].span.low; q <= limits[k].span.high; ++q) used[q] = true;
        }
        if (headed_) heading_ = {request.turns, request.turning, request.clock};
        if (headed_ && !spline_.allocate(request)) return false;
        coupled_ = spline_.few() && headed_ && request.timed == 0;
        for (int k = 0; k < limit_count; ++k) limits[k].timed = limits[k].timed || (coupled_ && limits[k].kind == LimitKind::turn_rate);
        return legs.build(request, false) && knots.build(request, true);
    }

    [[nodiscard]] bool lay_out(const Chain<S> &chain) {
        if (!first.allocate(chain.pieces + 1)) return false;
        count = regular = 0;
        for (int i = 0; i < chain.pieces; ++i) {
            first[i] = count;
            const int most = sampled(i / chain.per_leg);
            regular += most;
            count += most;
            for (int right = 0; right < 2; ++right) count += knot_count(chain, i, right);
            count += comes_back(i) ? 1 : 0;
            count = (count + together - 1) / together * together;
        }
        first[chain.pieces] = count;
        if (!margin.allocate(count) || !awake.allocate(count / together)) return false;
        for (int j = 0; j < count; ++j) margin[j] = 0.0;
        for (int j = 0; j < count / together; ++j) awake[j] = 1;
        return !headed_ || turn(chain);
    }

    // Whether limits on several derivatives ask for a slow beginning; none keeps that on a view whose point lies on the way.
    bool slows() const {
        for (int k = 0; k < limit_count; ++k)
            if (limits[k].kind == LimitKind::look_rate) return false;
        return limit_count > 0;
    }

    // Whether the rotors are limited for a yaw: then the body's inertia may be taken to be a share of its own, for a curve to begin from.
    bool turns_hard() const { return own_ != nullptr; }
    void ease(double to) {
        share = to;
        for (int k = 0; k < limit_count; ++k) {
            if (!limits[k].of_yaw()) continue;
            for (int j = 0; j < YawedRotors::values; ++j) eased_[j] = own_[j];
            for (int j = 0; j < 9; ++j) eased_[YawedRotors::inertia_at + j] *= share;
            limits[k].parameters = share < 1.0 ? eased_ : own_;
        }
    }

    // Hold no row of the first and of the last piece further inwards than a plan has it, which is the guess, nor outwards. The first may be a way back into
    // the limits: what it breaks it may break a little more, and it takes no longer.
    [[nodiscard]] bool begin_from_plan(const Chain<S> &chain, const double *value, double inwards) {
        for (int side = 0; side < 2; ++side) {
            const int i = side == 0 ? 0 : chain.pieces - 1, leg = i / chain.per_leg, most = sampled(leg);
            if (!allowed_[side].allocate(most)) return false;
            int walls = 0;
            while (walls < legs.count(leg) && legs.begin(leg)[walls].order == 0) ++walls;
            for (int j = 0; j < most; ++j) {
                const double over = value[first[i] + j], room = j < walls * count_at ? inwards : limit_margin;
                const bool broken = side == 0 && j >= walls * count_at && over > room + ShortestSettings::broken;
                allowed_[side][j] = broken ? over + ShortestSettings::loosened : std::min(std::max(over, 0.0), room);
                back_ = back_ || broken;
            }
        }
        longest_ = chain.sigma[0];
        return planned_ = true;
    }

    // By how much a plan exceeds the rows of a piece, at its instants; null where they are held as they are.
    const double *allowed(const Chain<S> &chain, int i) const {
        return !planned_ ? nullptr : i == 0 ? allowed_[0].data() : i + 1 == chain.pieces ? allowed_[1].data() : nullptr;
    }
    bool comes_back(int i) const { return back_ && i == 0; }

    bool is_awake(int row) const { return awake[row / together] != 0; }

    // Whether four instants of any function of a limit are, of which the first stand at a row.
    bool is_awake(const InstantLimit &limit, int row) const {
        bool found = false;
        for (int f = 0; f < limit.functions; ++f) found = found || is_awake(row + f * count_at);
        return found;
    }

    // Rows of a piece at instants.
    int sampled(int leg) const {
        int functions = legs.count(leg);
        for (int k = 0; k < limit_count; ++k) functions += limits[k].functions;
        return functions * count_at;
    }

    // Conditions of the knot at one side of a piece: every knot belongs to the piece after it, the last one of an open chain to the one before.
    int knot_count(const Chain<S> &chain, int i, int right) const {
        const int waypoint = knot_at(chain, i, right);
        return waypoint < 0 ? 0 : knots.count(waypoint);
    }
    int knot_at(const Chain<S> &chain, int i, int right) const {
        if ((i + right) % chain.per_leg != 0) return -1;
        if (right && (i + 1 < chain.pieces || chain.course.closed)) return -1;
        return (i + right) / chain.per_leg;
    }

    // Derivatives of a piece from its ends, of the orders in use.
    void jets(const PieceEnds<S> &piece, const double *ends, Jets &found) const {
        for (int q = 0; q < condition_orders; ++q) {
            if (!used[q]) continue;
            double end[S::whole];
            for (int r = 0; r < S::whole; ++r) end[r] = ends[r] * piece.inverse[q];
            for (int g = 0; g < count_at; g += together) {
                Quad sum[S::dim] = {};
                for (int a = 0; a < S::ends; ++a)
                    for (int c = 0; c < S::dim; ++c) sum[c] += end[a * S::dim + c] * four(instants.by_end[q][a] + g);
                for (int c = 0; c < S::dim; ++c) put_four(found[q][c] + g, sum[c]);
            }
        }
    }

    // Values of all rows of a piece, margins included.
    void values(const Chain<S> &chain, int i, const PieceEnds<S> &piece, const Jets &jet, double *value) const {
        const int leg = i / chain.per_leg;
        const Condition<S::dim> *condition = legs.begin(leg);
        const double *margins = margin.data() + first[i];
        const double *end = value + first[i + 1];
        value += first[i];
        double *begin = value;
        for (int k = 0; k < legs.count(leg); ++k, ++condition, value += count_at, margins += count_at) {
            const double moved = condition->order == 0 ? wall_margin : limit_margin;
            const auto &x = jet[condition->order];
            for (int g = 0; g < count_at; g += together) {
                Quad gradient[S::dim], sum = {};
                gradients(*condition, x, g, gradient);
                for (int c = 0; c < S::dim; ++c) sum += 0.5 * (gradient[c] + condition->slope[c]) * (four(x[c] + g) - condition->anchor[c]);
                put_four(value + g, sum + (condition->constant + moved + four(margins + g)));
            }
            silence(chain, i, condition->order, value, -1.0);
        }
        limit_values(chain, i, piece.inverse, jet, value, margins);
        const double *over = allowed(chain, i);
        for (int j = 0; over != nullptr && j < sampled(leg); ++j) begin[j] -= over[j];
        knot_rows(chain, i, piece, [&](const Condition<S::dim> &at_knot, int, const double *x) {
            double gradient[S::dim];
            *value++ = at_knot.at(x, gradient) + wall_margin;
        });
        if (comes_back(i)) *value++ = chain.sigma[i] - longest_;
        while (value < end) *value++ = -1.0;
    }

    // Change of the rows of a piece that are awake along a step that changes its ends and the logarithm of its duration.
    void slopes(const Chain<S> &chain, int i, const PieceEnds<S> &piece, const Jets &jet, const double *changed, double own,
                double *slope) const {
        Jets moved;
        jets(piece, changed, moved);
        const int leg = i / chain.per_leg;
        const Condition<S::dim> *condition = legs.begin(leg);
        const double *end = slope + first[i + 1];
        slope += first[i];
        for (int k = 0, row = first[i]; k < legs.count(leg); ++k, ++condition, slope += count_at, row += count_at) {
            const int q = condition->order;
            for (int g = 0; g < count_at; g += together) {
                if (!is_awake(row + g)) continue;
                Quad gradient[S::dim], sum = {};
                gradients(*condition, jet[q], g, gradient);
                for (int c = 0; c < S::dim; ++c) sum += gradient[c] * (four(moved[q][c] + g) - q * own * four(jet[q][c] + g));
                put_four(slope + g, sum);
            }
            silence(chain, i, q, slope, 0.0);
        }
        limit_slopes(chain, i, piece.inverse, jet, moved, own, slope);
        knot_rows(chain, i, piece, [&](const Condition<S::dim> &at_knot, int a, const double *x) {
            double gradient[S::dim], sum = 0.0;
            at_knot.at(x, gradient);
            for (int c = 0; c < S::dim; ++c)
                sum += gradient[c] * (changed[a * S::dim + c] * piece.inverse[at_knot.order] - at_knot.order * own * x[c]);
            *slope++ = sum;
        });
        if (comes_back(i)) *slope++ = own;
        while (slope < end) *slope++ = 0.0;
    }

    // What a limit depends on at as many instants as there are lanes: derivatives of some coordinates; and the heading, with powers of the duration.
    MINSNAP_INLINE void inputs(const InstantLimit &limit, int i, const double *inverse, const Jets &jet, int g, Quad *u) const {
        const Quad *motion = u;
        for (int q = limit.span.low; q <= limit.span.high; ++q)
            for (int c = 0; c < limit.axes; ++c) *u++ = four(jet[q][c] + g);
        if (!limit.headed()) return;
        const double *heading = headings_.data() + static_cast<std::size_t>(i) * TurningRotors::heading * count_at + g;
        for (int n = 0; n < TurningRotors::heading; ++n)
            u[n] = (n < 6 ? heading_.power(inverse[n / 2]) : 1.0) * four(heading + n * count_at);
        if (limit.follows()) follow(motion, u);
    }

    // Whether a step knows how a yaw through angles changes with the durations of all legs.
    bool coupled() const { return coupled_; }
    SplineHeading &spline() { return spline_; }
    const SplineHeading &spline() const { return spline_; }

    // 1 where all of that is a row's, 0 where each piece already turns more slowly as it takes longer: rotors' rows tie that to changes of the path.
    static double whole(const InstantLimit &limit) { return limit.turns_body() ? 0.0 : 1.0; }

    // Share of its leg's time at which an instant of a piece is.
    double share_at(int i, int instant) const { return turning_[i].share(Instants<S::half, S::instants>::place(instant)); }

    // Lay the heading of the curve as it is now out again; false where there is none.
    bool turn_again(const Chain<S> &chain) { return headed_ && turn(chain); }

    const TurningPiece *turning(int i) const { return headed_ ? turning_.data() + i : nullptr; }

    // Gradients of a condition at as many instants as there are lanes.
    static MINSNAP_INLINE void gradients(const Condition<S::dim> &condition, const double (&x)[S::dim][count_at], int g,
                                         Quad (&gradient)[S::dim]) {
        for (int c = 0; c < S::dim; ++c) gradient[c] = filled<Quad>(condition.slope[c]);
        if (!condition.curved) return;
        for (int c = 0, t = 0; c < S::dim; ++c)
            for (int d = 0; d <= c; ++d, ++t) {
                const double entry = condition.curvature[t];
                if (entry == 0.0) continue;
                gradient[c] += entry * (four(x[d] + g) - condition.anchor[d]);
                if (c != d) gradient[d] += entry * (four(x[c] + g) - condition.anchor[c]);
            }
    }

    // Call action(condition, end derivative, value there) for all conditions of the knots of a piece.
    template <class Action>
    void knot_rows(const Chain<S> &chain, int i, const PieceEnds<S> &piece, Action &&action) const {
        for (int right = 0; right < 2; ++right) {
            const int waypoint = knot_at(chain, i, right);
            if (waypoint < 0) continue;
            for (int k = 0; k < knots.count(waypoint); ++k) {
                const Condition<S::dim> &condition = knots.begin(waypoint)[k];
                const int a = right * S::half + condition.order;
                double x[S::dim];
                for (int c = 0; c < S::dim; ++c) x[c] = piece.e[a * S::dim + c] * piece.inverse[condition.order];
                action(condition, a, x);
            }
        }
    }

    // What limits on several derivatives add to the values of a piece, and to their change along a step; both move the pointers on.
    void limit_values(const Chain<S> &chain, int i, const double *inverse, const Jets &jet, double *&value, const double *margins) const {
        Quad u[InstantLimit::most_inputs], out[InstantLimit::most_functions];
        for (int k = 0; k < limit_count; ++k) {
            const InstantLimit &limit = limits[k];
            for (int g = 0; g < count_at; g += together) {
                inputs(limit, i, inverse, jet, g, u);
                limit.values(u, out);
                const Quad moved = filled<Quad>(limit_margin);
                for (int f = 0, row = g; f < limit.functions; ++f, row += count_at)
                    put_four(value + row, out[f] + moved + four(margins + row));
            }
            for (int f = 0; f < limit.functions; ++f, value += count_at, margins += count_at) silence(chain, i, limit, value, -1.0);
        }
    }
    void limit_slopes(const Chain<S> &chain, int i, const double *inverse, const Jets &jet, const Jets &moved, double own,
                      double *&slope) const {
        Quad u[InstantLimit::most_inputs], step[InstantLimit::most_inputs], out[InstantLimit::most_functions];
        int row = first[i] + legs.count(i / chain.per_leg) * count_at;
        for (int k = 0; k < limit_count; row += limits[k++].functions * count_at) {
            const InstantLimit &limit = limits[k];
            for (int g = 0; g < count_at; g += together) {
                if (!is_awake(limit, row + g)) continue;
                inputs(limit, i, inverse, jet, g, u);
                inputs(limit, i, inverse, moved, g, step);
                for (int n = 0; n < limit.inputs(); ++n) step[n] -= limit.order(n) * own * u[n];
                for (int n = limit.inputs(); n < limit.given(); ++n) step[n] = -limit.order(n) * own * u[n];
                if (limit.headed()) step[limit.given() - 1] = u[limit.given() - 1];  // whether it follows, which no step changes
                if (limit.follows()) follow(step, step + limit.inputs());
                if (coupled_ && limit.headed()) change_heading(i, g, whole(limit), u + limit.inputs(), step + limit.inputs());
                limit.slopes(u, step, out);
                for (int f = 0; f < limit.functions; ++f) put_four(slope + f * count_at + g, out[f]);
            }
            for (int f = 0; f < limit.functions; ++f, slope += count_at) silence(chain, i, limit, slope, 0.0);
        }
    }

    void silence(const Chain<S> &chain, int i, const InstantLimit &limit, double *numbers, double quiet) const {
        for (int right = 0; right < 2; ++right)
            if (pinned(chain, i, right, limit)) numbers[right ? count_at - 1 : 0] = quiet;
    }
    // Whether all that a limit depends on is pinned at one end of a piece.
    bool pinned(const Chain<S> &chain, int i, int right, const InstantLimit &limit) const {
        bool found = !limit.headed() && limit.span.high < S::half && (i + right) % chain.per_leg == 0;
        for (int q = limit.span.low; found && q <= limit.span.high; ++q) found = !chain.course.any_free((i + right) / chain.per_leg, q);
        return found;
    }

    // What is pinned whole at the end of a piece cannot change: its rows say nothing.
    void silence(const Chain<S> &chain, int i, int order, double *numbers, double quiet) const {
        if (order >= S::half) return;
        for (int right = 0; right < 2; ++right)
            if ((i + right) % chain.per_leg == 0 && !chain.course.any_free((i + right) / chain.per_leg, order))
                numbers[right ? count_at - 1 : 0] = quiet;
    }

private:
    // The heading that the rule makes of a curve.
    [[nodiscard]] bool rule(const Chain<S> &chain) {
        const int samples = ruled_.samples(), order = ruled_.order();
        if (!ruled_.allocate(chain.pieces * samples + 1)) return false;
        RuledHeading::Sample *to = ruled_.to_write();
        PieceEnds<S> piece;
        double begins = 0.0;
        for (int i = 0; i < chain.pieces; begins += piece.duration, ++i) {
            chain.ends(i, piece);
            const PieceCurve<S> curve(piece);
            const double low = piece.inverse[order], high = piece.inverse[order + 1];
            const int count = i + 1 < chain.pieces ? samples : samples + 1;
            for (int g = 0; g < count; g += together) {
                Quad s, here[S::dim], change[S::dim];
                for (int lane = 0; lane < together; ++lane) s[lane] = std::min(static_cast<double>(g + lane) / samples, 1.0);
                curve.at(order, s, low, here);
                curve.at(order + 1, s, high, change);
                constexpr int north = S::dim > 1 ? 1 : 0;
                for (int lane = 0; lane < together && g + lane < count; ++lane)
                    *to++ = {begins + s[lane] * piece.duration, here[0][lane], here[north][lane], change[0][lane], change[north][lane]};
            }
        }
        heading_ = ruled_.lay(chain.course.legs, samples * chain.per_leg);
        return true;
    }

    // Lay the heading of each leg out over its pieces as they are, at their instants.
    [[nodiscard]] bool turn(const Chain<S> &chain) {
        if (!turning_.allocate(chain.pieces) ||
            !headings_.allocate(static_cast<std::size_t>(chain.pieces) * TurningRotors::heading * count_at))
            return false;
        const bool timed = heading_.clock > 0.0;
        for (int leg = 0; spline_.given() && leg < chain.course.legs; ++leg) {
            double sum = 0.0;
            for (int k = leg * chain.per_leg; k < (leg + 1) * chain.per_leg; ++k) sum += exponential(chain.sigma[k]);
            spline_.durations[leg] = sum;
        }
        if (spline_.given()) heading_ = spline_.through();
        if (ruled_.given() && !rule(chain)) return false;
        double before = 0.0, whole = heading_.clock;  // of the way so far, or of the leg
        for (int i = 0; i < chain.pieces; ++i) {
            if (!timed && i % chain.per_leg == 0) {
                before = whole = 0.0;
                for (int k = i; k < i + chain.per_leg; ++k) whole += exponential(chain.sigma[k]);
            }
            const double duration = exponential(chain.sigma[i]);
            turning_[i] = {heading_, timed ? 0 : i / chain.per_leg, before / whole, duration / whole};
            before += duration;
            for (int g = 0; g < count_at; g += together) {
                Quad place, found[TurningRotors::heading];
                for (int lane = 0; lane < together; ++lane) place[lane] = Instants<S::half, S::instants>::place(g + lane);
                turning_[i].at(place, 1.0, found);
                for (int n = 0; n < TurningRotors::heading; ++n)
                    put_four(headings_.data() + (static_cast<std::size_t>(i) * TurningRotors::heading + n) * count_at + g, found[n]);
            }
        }
        return true;
    }

    // Steps of a direction and its derivatives where a yaw through angles changes with all durations.
    void change_heading(int i, int g, double own, const Quad *u, Quad *step) const {
        Quad change[3];
        for (int lane = 0; lane < together; ++lane) {
            double found[3];
            spline_.along_at(turning_[i].leg, share_at(i, g + lane), own, found);
            for (int k = 0; k < 3; ++k) change[k][lane] = found[k];
        }
        const Quad rate = u[0] * u[3] - u[1] * u[2], bend = u[0] * u[5] - u[1] * u[4];
        for (int c = 0; c < 2; ++c) {
            const double sign = c == 0 ? -1.0 : 1.0;
            const Quad across = sign * u[1 - c];
            step[c] += change[0] * across;
            step[2 + c] += change[1] * across - change[0] * rate * u[c];
            step[4 + c] += (change[2] - change[0] * rate * rate) * across - (2.0 * change[1] * rate + change[0] * bend) * u[c];
        }
    }

    bool headed_ = false, coupled_ = false;  // whether a limit asks for a heading, and for one that all durations change
    bool planned_ = false, back_ = false;    // whether the guess is a plan, and begins outside of limits
    Buffer<double> allowed_[2];              // (rows at instants,) of the first and of the last piece
    double longest_ = 0.0;                   // logarithm of the duration of the first one
    SplineHeading spline_;
    RuledHeading ruled_;
    LegHeadings heading_;
    Buffer<TurningPiece> turning_;            // (pieces,) headings of the pieces, and those at their instants on the unit interval
    Buffer<double> headings_;                 // (pieces, heading, instants)
    const double *own_ = nullptr;             // parameters of the rotors' limit for a yaw, of which there is one
    double eased_[YawedRotors::values] = {};  // the same for a body that is easy to turn
};

}  // namespace minsnap

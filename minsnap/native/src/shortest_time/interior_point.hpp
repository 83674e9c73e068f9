// A primal-dual interior point with a filter on the whole programme: c + s = 0, s > 0, multipliers z > 0 (A. Waechter and L. T. Biegler, "On the
// implementation of an interior-point filter line-search algorithm", Mathematical Programming 106, 2006), with exact second derivatives.
//
// Rows stand at fixed instants; what leaks between them becomes margins whenever the barrier falls, frozen until it falls again.
#pragma once

#include "shortest_time/leaks.hpp"
#include "shortest_time/newton.hpp"
#include "shortest_time/watch.hpp"

namespace minsnap {

enum class StageEnd { converged, stuck, stopped, no_memory };

// Pairs of infeasibility and merit that later steps must improve on.
class Filter {
public:
    void clear() { count_ = 0; }
    bool accepts(double infeasibility, double merit) const {
        constexpr double less = 0.999, same = 1e-9;
        for (int k = 0; k < count_; ++k)
            if (infeasibility > less * entries_[k][0] && merit > entries_[k][1] - same) return false;
        return true;
    }
    void add(double infeasibility, double merit) {
        if (count_ == ShortestSettings::iterations) return;
        entries_[count_][0] = infeasibility;
        entries_[count_++][1] = merit;
    }

private:
    double entries_[ShortestSettings::iterations][2];
    int count_ = 0;
};

template <class S>
class InteriorPoint {
public:
    using Settings = ShortestSettings;

    // Where it is, and the shortest so far that was inside all rows of the vehicle's own body, slowed where that helps; of no pieces before.
    Chain<S> chain, inside;
    Rows<S> rows;
    TimeObjective<S> objective;
    std::int64_t iterations = 0;
    bool within =
        false;  // whether every step stays inside all rows, whose slacks are what they leave: it may end anywhere, and finds no other way round

    InteriorPoint(const Instants<S::half, S::instants> &tables, Watch &watch) : rows(tables), watch_(watch) {}

    [[nodiscard]] bool allocate(int most) {
        return chain.allocate(most) && inside.allocate(most) && anchor_.allocate(most) && trial_.allocate(most) &&
               objective.ratio.allocate(most) && newton_.allocate(most) && first_states_.allocate(most) && second_states_.allocate(most);
    }

    // Make rows for the chain as it is, with slacks and multipliers of a barrier of that gap.
    [[nodiscard]] bool begin(double gap) {
        if (!rows.lay_out(chain) || !allocate_rows(rows.count)) return false;
        if (!newton_.lay_out(chain, rows.coupled())) return false;
        trial_.copy(chain);
        states_ = first_states_.data();
        trial_states_ = second_states_.data();
        smooth_ = evaluate(chain, states_, value_.data());
        if (chain.course.total > 0.0) {
            objective.price = price_of_cost();
            smooth_ = evaluate(chain, states_, value_.data());
        }
        start(gap, within ? Settings::leak : Settings::least_slack);
        list_awake();
        return true;
    }

    // Slacks and multipliers of a barrier of that gap for the chain as it is.
    void start(double gap, double least) {
        barrier_ = gap / rows.regular;
        for (int j = 0; j < rows.count; ++j) {
            slack_[j] = std::max(-value_[j], least);
            multiplier_[j] = barrier_ / slack_[j];
        }
    }

    // Take the barrier up again from a gap; margins, slacks and multipliers stay.
    void resume(double gap) {
        evaluate(chain, states_, value_.data());
        barrier_ = gap / rows.regular;
        settle();
        each_awake([&](int group) {
            for (int j = group; j < group + together; ++j) {
                slack_[j] = std::max(slack_[j], -value_[j]);
                multiplier_[j] = std::min(std::max(multiplier_[j], 0.1 * barrier_ / slack_[j]), 10.0 * barrier_ / slack_[j]);
            }
        });
    }

    // Lower the barrier to a gap. A rough stage ends as soon as it is about there: another one follows from its curve.
    StageEnd run(double last_gap, bool rough = false) {
        constexpr double raised = 1.5, hair = 1.0001;  // factor on the last barrier after margins have grown
        const double last = last_gap / rows.regular;
        const auto stuck = [&]() {
            return barrier_ < raised * hair * last && residual() < Settings::usable ? StageEnd::converged : StageEnd::stuck;
        };
        double damping = 0.0, least_damping = 0.0, former = 0.0;
        int shortened = 0, failed = 0, lost = 0, stalled = 0, grown = 0;
        filter_.clear();
        keep();
        for (int iteration = 0; iteration < Settings::iterations; ++iteration, ++iterations) {
            if (watch_.ends(chain.total(), rows.count)) return StageEnd::stopped;
            weigh();
            newton_.assemble(chain, rows, objective, states_, {multiplier_.data(), outer_.data(), gradient_.data()});
            if (shortened == 0) damping /= within ? Settings::damping_fall_within : Settings::damping_change;
            damping = std::max(damping > 1e-6 ? damping : 0.0, least_damping);
            if (!newton_.solve(chain, damping)) return stuck();
            lost = damping > Settings::hopeless ? lost + 1 : 0;
            if (lost > Settings::longest_stall) return stuck();
            shortened = search();
            if (shortened == woken) {
                shortened = 1;
                continue;
            }
            if (shortened < 0) {
                damping = std::max(damping * 10.0, 1e-2);
                if (damping > 1e3 || ++failed > Settings::failures) return stuck();
                shortened = 1;
                continue;
            }
            failed = 0;
            keep();
            if (shortened > (within ? 1 : 0)) damping = std::max(damping * Settings::damping_change, Settings::damping);
            const double now = chain.held() ? smooth_ * objective.unit : chain.total(), gap = barrier_ * rows.regular,
                         decrement = -newton_.slope() * std::max(1.0, damping);
            const bool free = damping <= Settings::held;  // a step that is held back says nothing about what is left to gain
            if (free) stalled = std::abs(now - former) < Settings::stalled * objective.unit ? stalled + 1 : 0;
            former = now;
            const bool still = stalled >= Settings::stalls;
            if (barrier_ > hair * last) {  // far outside, a barrier that has fallen lets slacks cut every step short
                if (!(decrement < Settings::centred * gap && infeasibility_ < allowed()) && !still) continue;
                if (chain.course.total > 0.0) weigh_cost();
                barrier_ = std::max(last, barrier_ * Settings::barrier_fall);
                filter_.clear();
                if (barrier_ * rows.regular < Settings::margin_gap && !within) freeze(grown > 0);
                if (barrier_ * rows.regular < Settings::asleep_gap) settle();
                continue;
            }
            const bool there = decrement < gap || still;
            if (rough && there) return StageEnd::converged;
            if ((there && residual() < Settings::residual) || stalled > Settings::longest_stall) {
                const bool anew = chain.course.total > 0.0 && grown == 0;  // margins of peaks that are gone cost much near the least time
                if ((freeze(!anew) < Settings::grown && !anew) || ++grown >= Settings::rounds) return StageEnd::converged;
                barrier_ *= raised;
                filter_.clear();
                stalled = 0;
                each_awake([&](int group) {
                    for (int j = group; j < group + together; ++j) multiplier_[j] = std::max(multiplier_[j], 0.3 * barrier_ / slack_[j]);
                });
            }
            if (stalled > 0) least_damping = Settings::settled;
        }
        return stuck();
    }

    // Values of all rows as the chain is, margins included.
    const double *values() const { return value_.data(); }

    // Largest value of a row as the chain is.
    double largest() const {
        double most = -1.0;
        for (int j = 0; j < rows.count; ++j) most = std::max(most, value_[j]);
        return most;
    }

    // Largest excess of walls and of limits at true peaks, in widths.
    void excess(double inwards, double &wall, double &limit) const { excess_of(chain, states_, value_.data(), inwards, wall, limit); }

private:
    [[nodiscard]] bool allocate_rows(int count) {
        return value_.allocate(count) && slack_.allocate(count) && multiplier_.allocate(count) && outer_.allocate(count) &&
               gradient_.allocate(count) && slope_.allocate(count) && slack_step_.allocate(count) && multiplier_step_.allocate(count) &&
               trial_value_.allocate(count) && trial_slack_.allocate(count) && frozen_.allocate(count) &&
               groups_.allocate(count / together);
    }

    // Call action(first row) for every group of rows that is awake.
    template <class Action>
    MINSNAP_INLINE void each_awake(Action action) const {
        for (int n = 0; n < group_count_; ++n) action(groups_[n]);
    }

    void list_awake() {
        group_count_ = 0;
        for (int j = 0; j < rows.count; j += together)
            if (rows.is_awake(j)) groups_[group_count_++] = j;
    }

    // Let groups of rows sleep that are far inside, and wake the others.
    void settle() {
        for (int j = 0; j < rows.count; j += together) {
            const bool far = largest_of(four(value_.data() + j)) < -Settings::asleep;
            if (!far && !rows.is_awake(j)) wake(j);
            if (!far) continue;
            rows.awake[j / together] = 0;
            for (int k = j; k < j + together; ++k) multiplier_[k] = outer_[k] = gradient_[k] = 0.0;
        }
        list_awake();
    }

    void wake(int group) {
        rows.awake[group / together] = 1;
        for (int k = group; k < group + together; ++k) {
            slack_[k] = std::max(-value_[k], Settings::least_slack);
            multiplier_[k] = barrier_ / slack_[k];
        }
    }

    // Whether a row that sleeps is across its bound.
    bool crossed(const double *value) const {
        bool found = false;
        for (int j = 0; j < rows.count; j += together) found = found || (!rows.is_awake(j) && largest_of(four(value + j)) > 0.0);
        return found;
    }

    // Wake rows that come near their bounds there.
    void wake_near(const double *value) {
        bool any = false;
        for (int j = 0; j < rows.count; j += together) {
            if (rows.is_awake(j) || largest_of(four(value + j)) < -Settings::woken) continue;
            wake(j);
            any = true;
        }
        if (!any) return;
        list_awake();
        filter_.clear();
    }

    double allowed() const { return Settings::infeasibility * rows.regular; }

    double cost() const {
        double sum = 0.0;
        for (int i = 0; i < chain.pieces; ++i) sum += objective.cost(states_[i].ends, rows.instants);
        return sum;
    }

    // The price of a second at which the cost as it is counts as the total does.
    double price_of_cost() const {
        constexpr double trifle = 1e-100;  // where nothing moves
        return std::max(cost() / chain.total(), trifle);
    }

    // Let the cost as it is count as the total does; the barrier keeps its weight beside it.
    void weigh_cost() {
        const double price = price_of_cost(), change = price / objective.price;
        objective.price = price;
        barrier_ /= change;
        for (int j = 0; j < rows.count; ++j) multiplier_[j] /= change;
        smooth_ = evaluate(chain, states_, value_.data());
    }

    // Values of all rows and the smooth objective.
    double evaluate(const Chain<S> &at, PieceState<S> *states, double *value) const {
        double sum = 0.0;
        widely([&]() MINSNAP_INLINED {
            for (int i = 0; i < at.pieces; ++i) {
                PieceState<S> &state = states[i];
                at.ends(i, state.ends);
                rows.jets(state.ends, state.ends.e, state.jets);
                rows.values(at, i, state.ends, state.jets, value);
                sum += objective.value(at, i, state.ends, rows.instants);
            }
        });
        return sum;
    }

    void weigh() {
        widely([&]() MINSNAP_INLINED {
            each_awake([&](int j) MINSNAP_INLINED {
                const Quad slack = four(slack_.data() + j), multiplier = four(multiplier_.data() + j), inverse = 1.0 / slack;
                put_four(outer_.data() + j, multiplier * inverse);
                put_four(gradient_.data() + j, (barrier_ + multiplier * (four(value_.data() + j) + slack)) * inverse);
            });
        });
    }

    // Steps of slacks and multipliers, and the shares of both that stay inside.
    void complete(double &primal, double &dual) {
        double falls, drops;
        widely([&]() MINSNAP_INLINED {
            double changed[S::whole];
            if (rows.coupled()) rows.spline().take(newton_.coupling.leg_steps(newton_.step.data()));
            for (int i = 0; i < chain.pieces; ++i) {
                chain.change(i, states_[i].ends, newton_.step_durations.data(), newton_.step_knots.data(), changed);
                rows.slopes(chain, i, states_[i].ends, states_[i].jets, changed, newton_.step_durations[i], slope_.data());
            }
            Quad fall = {}, drop = {};
            each_awake([&](int j) MINSNAP_INLINED {
                const Quad slack = four(slack_.data() + j), multiplier = four(multiplier_.data() + j), outer = four(outer_.data() + j),
                           inverse = 1.0 / slack;
                const Quad ds = -(four(value_.data() + j) + slack) - four(slope_.data() + j),
                           dz = barrier_ * inverse - multiplier - outer * ds;
                put_four(slack_step_.data() + j, ds);
                put_four(multiplier_step_.data() + j, dz);
                const Quad share = -ds * inverse, portion = -dz / multiplier;
                fall = share > fall ? share : fall;
                drop = portion > drop ? portion : drop;
            });
            falls = largest_of(fall);
            drops = largest_of(drop);
        });
        const double share = within ? Settings::to_boundary_within : Settings::to_boundary;
        primal = falls > share ? share / falls : 1.0;
        dual = drops > share ? share / drops : 1.0;
    }

    double barrier_terms(const double *value, const double *slack, double &infeasibility) const {
        double sum = 0.0, product = 1.0;
        Quad residual = {};
        each_awake([&](int j) MINSNAP_INLINED {
            const Quad here = four(slack + j), left = four(value + j) + here;
            residual += left > 0.0 ? left : -left;
            product *= (here[0] * here[1]) * (here[2] * here[3]);
            if (product < 1e-200 || product > 1e200) {
                sum += logarithm(product);
                product = 1.0;
            }
        });
        infeasibility = total(residual);
        return barrier_ * (sum + logarithm(product));
    }

    // Take as much of the step as the filter accepts: the number of halvings, -1 for nothing, or `woken` where another step is needed.
    int search() {
        double share = 1.0, dual = 1.0, before = 0.0, after = 0.0, largest = 0.0;
        complete(share, dual);
        for (int i = 0; i < chain.pieces; ++i) largest = std::max(largest, std::abs(newton_.step_durations[i]));
        if (largest > Settings::largest_step) share = std::min(share, Settings::largest_step / largest);
        const double merit = smooth_ - barrier_terms(value_.data(), slack_.data(), before), slope = newton_.slope();
        for (int halving = 0; halving < Settings::halvings; ++halving, share *= 0.5) {
            move(share);
            turn_along(trial_);
            const double trial = evaluate(trial_, trial_states_, trial_value_.data());
            if (crossed(trial_value_.data())) {
                wake_near(trial_value_.data());
                turn_along(chain);
                return woken;
            }
            each_awake([&](int j) MINSNAP_INLINED {
                const Quad moved = four(slack_.data() + j) + share * four(slack_step_.data() + j), least = -four(trial_value_.data() + j);
                put_four(trial_slack_.data() + j, within || moved < least ? least : moved);
            });
            if (within && !stays_inside()) continue;
            const double reached = trial - barrier_terms(trial_value_.data(), trial_slack_.data(), after);
            const double enough = within ? 1e-4 : 1e-6;
            const bool better = (after <= (1.0 - 1e-2 * share) * before && !within) ||
                                reached <= merit - 1e-3 * share * std::min(before, 1.0) - enough * share * std::abs(slope);
            const bool passes = better && after < std::max(allowed(), 2.0 * before) && filter_.accepts(after, reached);
            if (passes || (after < 1e-9 && reached <= merit + 1e-10)) {
                filter_.add(before, merit);
                smooth_ = trial;
                infeasibility_ = after;
                accept(dual);
                turn();
                wake_near(value_.data());
                return halving;
            }
        }
        turn_along(chain);
        return -1;
    }

    // Whether what is tried leaves every row a part of its slack.
    bool stays_inside() const {
        constexpr double left = 1.0 - Settings::to_boundary_within;
        Quad worst = filled<Quad>(-1.0);
        each_awake([&](int j) MINSNAP_INLINED {
            const Quad over = left * four(slack_.data() + j) - four(trial_slack_.data() + j);
            worst = over > worst ? over : worst;
        });
        return largest_of(worst) <= 0.0;
    }

    void move(double share) {
        for (int i = 0; i < chain.pieces; ++i) trial_.sigma[i] = chain.sigma[i] + share * newton_.step_durations[i];
        for (int j = 0; j < (chain.pieces + 1) * S::knot; ++j) trial_.w[j] = chain.w[j] + share * newton_.step_knots[j];
        if (chain.course.total > 0.0) trial_.slow(1.0);
    }

    void accept(double dual) {
        constexpr double spread = 1e4;
        chain.copy(trial_);
        std::swap(states_, trial_states_);
        value_.swap(trial_value_);
        slack_.swap(trial_slack_);
        each_awake([&](int j) MINSNAP_INLINED {
            const Quad middle = barrier_ / four(slack_.data() + j), least = middle * (1.0 / spread), most = middle * spread;
            const Quad moved = four(multiplier_.data() + j) + dual * four(multiplier_step_.data() + j);
            put_four(multiplier_.data() + j, moved < least ? least : moved > most ? most : moved);
        });
    }

    // Lay the heading of what is tried out, or of the curve again, where a step knows how all durations change it.
    void turn_along(const Chain<S> &at) {
        if (rows.coupled()) (void)rows.turn_again(at);
    }

    // Give the curve its own heading: a step knows that of the curve before, but for one that all durations change.
    void turn() {
        if (rows.coupled() || !rows.turn_again(chain)) return;
        evaluate(chain, states_, value_.data());
        barrier_terms(value_.data(), slack_.data(), infeasibility_);
        filter_.clear();
    }

    double residual() const {
        double most = 0.0;
        each_awake([&](int j) { most = std::max(most, largest_of(four(value_.data() + j) + four(slack_.data() + j))); });
        return most;
    }

    // Make margins of what leaks now: the largest growth that matters.
    double freeze(bool only_grow) {
        double growth = 0.0;
        for (int j = 0; j < rows.count; ++j) frozen_[j] = only_grow ? rows.margin[j] : 0.0;
        for (int i = 0; i < chain.pieces; ++i) {
            each_peak(rows, chain, i, states_[i].ends, value_.data(), [&](const Peak &peak) {
                frozen_[peak.row] = std::max(frozen_[peak.row], peak.rise);
                frozen_[peak.beside] = std::max(frozen_[peak.beside], peak.rise);
            });
        }
        for (int j = 0; j < rows.count; ++j) {
            const double change = frozen_[j] - rows.margin[j];
            value_[j] += change;
            rows.margin[j] = frozen_[j];
            if (rows.is_awake(j) && value_[j] + slack_[j] > 0.0) growth = std::max(growth, change);
        }
        return growth;
    }

    void excess_of(const Chain<S> &at, const PieceState<S> *states, const double *value, double inwards, double &wall,
                   double &limit) const {
        wall = limit = -1.0;
        for (int i = 0; i < at.pieces; ++i) {
            each_peak(rows, at, i, states[i].ends, value, [&](const Peak &peak) {
                const double over = value[peak.row] - rows.margin[peak.row] + peak.rise;
                if (peak.wall)
                    wall = std::max(wall, over - rows.wall_margin - inwards);
                else
                    limit = std::max(limit, over - rows.limit_margin);
            });
            for (int row = rows.first[i] + rows.sampled(i / at.per_leg); row < rows.first[i + 1]; ++row)
                wall = std::max(wall, value[row] - rows.wall_margin - inwards);
        }
    }

    // Keep the curve if it is inside, or as little slower, or nearer to the last one of as many pieces, as it must be. What is tried next is lost.
    void keep() {
        if (objective.price > 0.0) return keep_cheapest();
        if (!chain.course.moving) return keep_slowed();
        if (anchor_.pieces != chain.pieces) anchor_.pieces = 0;
        const double total = chain.total(), before = anchor_.pieces > 0 ? anchor_.total() : Settings::slowest * total, share = rows.share;
        if (total >= Settings::shorter * before) return;
        if (share == 1.0 && is_inside(chain, states_, value_.data())) return take(chain);
        if (--wait_ > 0) return;
        rows.ease(1.0);
        double low = 1.0, high = Settings::shorter * before / total;
        bool found = slowed(high);
        while (found && high > Settings::barely * low) {
            const double middle = std::sqrt(low * high);
            (slowed(middle) ? high : low) = middle;
        }
        for (double part = 0.5; !found && anchor_.pieces > 0 && part > Settings::least_part; part *= 0.5) found = nearer(part);
        rows.ease(share);
        failed_ = found ? 0 : std::min(failed_ + 1, Settings::longest_wait);
        wait_ = failed_;
    }

    // The same where the cost counts: the cheapest curve, with its time where that is free.
    void keep_cheapest() {
        const double now = cost() + (chain.held() ? 0.0 : objective.price * chain.total());
        double wall, limit;
        if (inside.pieces > 0 && now >= least_cost_) return;
        excess_of(chain, states_, value_.data(), 0.0, wall, limit);
        if (wall > 0.0 || limit > 0.0) return;
        inside.copy(chain);
        least_cost_ = now;
    }

    // The same where slower flight mends all limits, which are exceeded by little: a curve inside the walls, about as much slower as that takes.
    void keep_slowed() {
        const double before = inside.pieces > 0 ? inside.total() : Settings::slowest * chain.total();
        if (chain.total() >= Settings::shorter * before) return;
        double wall, limit;
        excess_of(chain, states_, value_.data(), 0.0, wall, limit);
        const double factor = 1.0 + std::max(limit, 0.0);
        if (wall > 0.0 || factor > Settings::slowest || factor * chain.total() >= Settings::shorter * before) return;
        inside.copy(chain);
        inside.slow(factor);
    }

    // Whether the curve is inside when slowed by a factor; taken if so.
    bool slowed(double factor) {
        trial_.copy(chain);
        trial_.slow(factor);
        return tried();
    }

    // The same a part of the way to it from the last one that was.
    bool nearer(double part) {
        for (int i = 0; i < chain.pieces; ++i) trial_.sigma[i] = anchor_.sigma[i] + part * (chain.sigma[i] - anchor_.sigma[i]);
        for (int j = 0; j < (chain.pieces + 1) * S::knot; ++j) trial_.w[j] = anchor_.w[j] + part * (chain.w[j] - anchor_.w[j]);
        return tried();
    }

    bool tried() {
        rows.turn_again(trial_);
        evaluate(trial_, trial_states_, trial_value_.data());
        const bool inside_all = is_inside(trial_, trial_states_, trial_value_.data());
        if (inside_all) take(trial_);
        rows.turn_again(chain);
        return inside_all;
    }

    void take(const Chain<S> &found) {
        anchor_.copy(found);
        if (inside.pieces == 0 || found.total() < inside.total()) inside.copy(found);
    }

    // Whether a curve is inside all rows without their margins, and at true peaks.
    bool is_inside(const Chain<S> &at, const PieceState<S> *states, const double *value) const {
        for (int j = 0; j < rows.count; ++j)
            if (value[j] - rows.margin[j] > -Settings::well_inside) return false;
        double wall, limit;
        excess_of(at, states, value, 0.0, wall, limit);
        return wall <= 0.0 && limit <= 0.0;
    }

    static constexpr int together = Rows<S>::together, woken = -2;

    Chain<S> trial_, anchor_;  // what is tried, and the shortest curve inside of as many pieces as the chain has; of none before
    NewtonSystem<S> newton_;
    Filter filter_;
    Watch &watch_;
    Buffer<PieceState<S>> first_states_, second_states_;
    PieceState<S> *states_ = nullptr, *trial_states_ = nullptr;  // at the chain and at what is tried
    int failed_ = 0, wait_ = 0;                                  // tries in a row that kept no curve, and steps until the next one
    double smooth_ = 0.0;                                        // the smooth objective at the chain
    double infeasibility_ = 0.0;                                 // sum of residuals there
    double barrier_ = 0.0;
    double least_cost_ = 0.0;  // of what is kept where the cost counts
    Buffer<double> value_, slack_, multiplier_, outer_, gradient_, slope_, slack_step_, multiplier_step_, trial_value_, trial_slack_,
        frozen_;
    Buffer<int> groups_;  // first rows of the groups that are awake
    int group_count_ = 0;
};

}  // namespace minsnap

// The certified optimum inside walls that hold at every instant: an exchange inside a dual active set.
//
// The dual active set starts at the optimum without walls and takes in the most violated rows; here rows are the instants
// where the curve sticks out. Near the end the walls are moved inwards by a share of their widths that costs less than
// the gap allows, and the control points that are returned are proved to be inside the true walls. The dual bound is
// computed from the multipliers and the optimum without walls alone.
#pragma once

#include <algorithm>

#include "corridor/contacts.hpp"
#include "corridor/exchange_solver.hpp"
#include "corridor/peaks.hpp"
#include "certificate/proof.hpp"

namespace minsnap {

template <class Real, int Half>
class Exchange {
public:
    explicit Exchange(int half) : chain(half), active(chain, walls_, balls_, factor_of_), contacts_(chain, walls_, balls_, active) {}

    // Solve one request after another; what is written holds if the status is ``done``. Contacts known from a similar
    // request, if there are any, are where it begins.
    Status solve(const Request &given, Answer &answer, Aim aim = Aim::proved, const Contact *known = nullptr, int count = 0) {
        given_ = &given, aim_ = aim, given_away_ = 0;
        Status status = run(answer, known, count);
        for (int turn = 0; turn < most_prices && status == Status::done && overpriced(); ++turn) {
            given_away_ = Real(given.gap) / 8 * chain.cost();
            status = run(answer, known, count);
        }
        if (aim == Aim::widened) return widened(answer, status);
        return status == Status::done ? finish(answer) : status;
    }

private:
    Status run(Answer &answer, const Contact *known, int count) {
        const Aim aim = aim_;
        share_ = aim == Aim::near ? near_share : Real(0), pause_ = tries_ = rounds_ = 0, patience_ = shortest_pause,
        work_ = factors_work_ = 0.0, infeasible_ = false, least_ = std::numeric_limits<Real>::infinity(), halved_ = 0;
        Status status = prepare();
        if (status == Status::done && count > 0 && !active.begin_with(known, count)) status = Status::no_progress;
        if (status == Status::done) status = meet_equalities();
        if (status == Status::done) status = iterate(answer.points);
        answer.rounds = rounds_, answer.work += (work_ + factors_work_ + active.work()) / most_work;
        if (status == Status::done && aim == Aim::proved && !joined(answer.points)) status = Status::not_proved;
        return status;
    }

    const Request *given_ = nullptr;
    Buffer<Wall<Real>> walls_;
    Buffer<Ball<Real>> balls_;
    SquareRoot<Real, Half> factors_[max_dim];
    const SquareRoot<Real, Half> *factor_of_[max_dim] = {};

public:
    Chain<Real, Half> chain;
    ActiveSet<Real, Half> active;

private:
    static constexpr int most_prices = 3;  // of what draws a curve that walls alone hold
    static constexpr int most_rounds = 1000, most_idle = 100, most_tries = 40, shortest_pause = 3;
    // Products of vectors' entries, about, after which it gives up: 0.2 to 0.4 s in either precision.
    static constexpr double most_work = sizeof(Real) > 8 ? 4.5e7 : 7e8;
    static constexpr double round_work = 8.0;  // the same for a round, for each coefficient and point of a wall or a coordinate
    static constexpr Real absurd = Real(sizeof(Real) > 8 ? 1e8 : 1e6);        // times the cost of stops at all knots: hardly a plan
    static constexpr Real most_absurd = Real(sizeof(Real) > 8 ? 1e18 : 1e6);  // the same where rounding has taken over
    static constexpr Real most_inward = Real(1e-3);                           // share of their widths by which walls move
    static constexpr double jump = 1e-9, stored = 8e-16;                      // of derivatives at knots, as the certificate judges them
    static constexpr Real narrow = Real(2e-5);                                // of Aim::widened: excess that is none, in widths
    static constexpr Real rough = Real(0.3);                                  // the same in shares of the largest slack, for its sign
    static constexpr Real known = Real(1e-5);                                 // share of the distance that slacks leave: the sign is told
    static constexpr Real held_up = Real(1e-6);                               // excess that rounding in doubles may leave, in widths
    static constexpr Real nearly = Real(1e-5), near_share = Real(1e-4);       // of Aim::near: excess, over walls moved so

    Status prepare() {
        if (!chain.allocate(given_->pieces, given_->dim, given_->closed, given_->smoothness())) return Status::no_memory;
        if (!walls_.allocate(given_->walls.count + 1) || !balls_.allocate(count_balls() + 1)) return Status::no_memory;
        load_chain(*given_, chain);
        int balls = 0;
        for (std::int64_t index = 0; index < given_->walls.count; ++index) {
            const Status status = load_wall(*given_, chain, index, balls, walls_[index], balls_[balls]);
            if (status != Status::done) return status;
            if (walls_[index].ball >= 0) ++balls;
        }
        Real stops = chain.cost();  // of what is pinned alone: straight legs with stops
        nothing_ = Real(1e4) * std::numeric_limits<Real>::epsilon() * std::numeric_limits<Real>::epsilon() * stops;
        const Status drawn = draw();
        if (drawn != Status::done) return drawn;
        const Status status = factorise();
        if (status != Status::done) return status;
        if (given_->continuity >= given_->half) stops += free_cost_;
        most_cost_ = (given_->effort >= patient ? most_absurd : absurd) * stops;
        most_peaks_ = 8 * given_->walls.count + 8;
        const Real price = sqrt(Real(given_->slacks.price) * (stops + free_cost_));
        if (!active.allocate(given_->slacks.count, price > 0 ? price : Real(1)) || !contacts_.allocate() || !peaks_.allocate(most_peaks_))
            return Status::no_memory;
        return start();
    }

    // Along a coordinate in which no position is given, walls alone say where the curve lies. It is drawn to the nominal
    // position of one knot, whose walls bound how far it can be from there, and so what the cost with that price may differ
    // from the true one: a share of the gap, ``given_away_``.
    Status draw() {
        int count = 0;
        for (int axis = 0; axis < chain.dim; ++axis) count += floats(axis);
        drawn_ = 0;
        if (count == 0) return Status::done;
        if (given_away_ == 0) given_away_ = Real(given_->gap) / 8 * chain.cost();
        if (!(given_away_ > 0) || !pull_.allocate(std::size_t(chain.dim) * chain.pieces)) return Status::no_progress;
        for (int i = 0; i < chain.dim * chain.pieces; ++i) pull_[i] = 0;
        for (int axis = 0; axis < chain.dim; ++axis) {
            if (!floats(axis)) continue;
            Real widest = 0;
            int best = -1;
            for (int knot = 0; knot < chain.pieces; ++knot) {
                Real reach = 0;  // of all coordinates that are drawn: they may share a factor
                for (int other = 0; other < chain.dim; ++other)
                    if (floats(other)) reach = largest(reach, reach_of(knot, other));
                if (best < 0 || reach < widest) widest = reach, best = knot;
            }
            if (!(widest < std::numeric_limits<Real>::infinity())) return Status::unsupported;
            pull_[std::size_t(axis) * chain.pieces + best] = sqrt(given_away_ / count) / widest;
            drawn_ |= 1U << axis;
        }
        return Status::done;
    }

    bool floats(int axis) const {
        for (int knot = 0; knot <= chain.pieces; ++knot)
            if (!chain.is_free(knot, 0, axis)) return false;
        return true;
    }

    const Real *pull_of(int axis) const { return drawn_ >> axis & 1U ? pull_.data() + std::size_t(axis) * chain.pieces : nullptr; }

    // How far the start of a piece may be from its nominal position along a coordinate, as walls there say one by one.
    Real reach_of(int knot, int axis) const {
        Real most[2] = {std::numeric_limits<Real>::infinity(), std::numeric_limits<Real>::infinity()};
        for (std::int64_t i = 0; i < given_->walls.count; ++i) {
            const Wall<Real> &wall = walls_[i];
            if (wall.piece != knot || wall.order != 0 || wall.when == When::end || wall.equality) continue;
            if (wall.ball < 0 && wall.axes == 1U << axis) {
                Real &side = most[wall.normal[axis] < 0];
                side = smallest(side, fabs(wall.bound / wall.normal[axis]));
            } else if (wall.ball >= 0 && wall.axes == 0) {
                const Real reach = reach_in(wall, balls_[wall.ball], axis);
                most[0] = smallest(most[0], reach), most[1] = smallest(most[1], reach);
            }
        }
        return largest(most[0], most[1]);
    }

    Real reach_in(const Wall<Real> &wall, const Ball<Real> &ball, int axis) const {
        for (int q = 0; q < ball.rows; ++q) {
            bool alone = ball.matrix[q][axis] != 0;
            for (int other = 0; other < chain.dim; ++other) alone = alone && (other == axis || ball.matrix[q][other] == 0);
            if (alone) return (wall.bound + fabs(ball.offset[q])) / fabs(ball.matrix[q][axis]);
        }
        return std::numeric_limits<Real>::infinity();
    }

    // Whether the price of what draws the curve is more than the gap allows, now that the cost is known.
    bool overpriced() const { return drawn_ != 0 && chain.cost() > 0 && !(given_away_ <= Real(given_->gap) / 4 * chain.cost()); }

    std::int64_t count_balls() const {
        std::int64_t count = 0;
        for (std::int64_t index = 0; index < given_->walls.count; ++index) count += given_->walls.is_ball(index);
        return count;
    }

    // One factor for all coordinates that are pinned alike.
    Status factorise() {
        free_cost_ = 0;
        return for_each_factor([&](SquareRoot<Real, Half> &factor, const int *axes, int count) {
            if (!factor.allocate(chain)) return Status::no_memory;
            const Status status = factor.factorise(chain, axes, count, pull_of(axes[0]));
            factors_work_ += factor.products();
            if (status != Status::done) return status;
            free_cost_ += factor.rest();
            if (!scratch_.allocate(factor.unknowns() + 1)) return Status::no_memory;
            for (int i = 0; i < count; ++i) {
                factor_of_[axes[i]] = &factor;
                factor.optimum(i, scratch_.data());
                factor.add(chain, axes[i], scratch_.data());
            }
            return Status::done;
        });
    }

    // Take away what is left of jumps of derivatives above k - 1: what is felt of them grows with powers of durations.
    Status join() {
        if (given_->continuity < given_->half) return Status::done;
        const Status status = for_each_factor([&](SquareRoot<Real, Half> &factor, const int *axes, int count) {
            if (!scratch_.allocate(factor.unknowns() + 1)) return Status::no_memory;
            const Status status = factor.join(chain, axes, count, pull_of(axes[0]), scratch_.data());
            factors_work_ += factor.products();
            return status;
        });
        if (status == Status::done) chain.place();
        return status;
    }

    template <class Job>
    Status for_each_factor(Job &&job) {
        bool done[max_dim] = {};
        Status status = Status::done;
        for (int axis = 0; axis < chain.dim && status == Status::done; ++axis) {
            if (done[axis]) continue;
            int axes[max_dim], count = 0;
            for (int other = axis; other < chain.dim; ++other)
                if (!done[other] && pinned_alike(axis, other)) axes[count++] = other, done[other] = true;
            status = job(factors_[axis], axes, count);
        }
        return status;
    }

    bool pinned_alike(int axis, int other) const {
        if (axis == other) return true;
        const std::size_t states = std::size_t(chain.pieces + (chain.closed ? 0 : 1)) * chain.slots();
        for (std::size_t i = 0; i < states; ++i)
            if (chain.pinned[i * chain.dim + axis] != chain.pinned[i * chain.dim + other]) return false;
        return true;
    }

    Status start() {
        const std::size_t count = std::size_t(chain.pieces) * chain.dim * chain.size.points();
        if (!free_points_.allocate(count)) return Status::no_memory;
        chain.place();
        std::memcpy(free_points_.data(), chain.points.data(), sizeof(Real) * count);
        active.clear();
        return Status::done;
    }

    // Take in the equalities, which then stay active.
    Status meet_equalities() {
        bool any = false;
        for (int wall = 0; wall < int(given_->walls.count); ++wall) {
            if (!walls_[wall].equality || is_active(wall) || !active.propose(wall, Real(int(walls_[wall].when)), 0)) continue;
            if (active.enter() != Entered::added) return Status::infeasible;
            any = true;
        }
        if (!any) return Status::done;
        active.place();
        active.settle();
        return active.drop_negative() ? Status::done : Status::no_progress;
    }

    bool is_active(int wall) const {
        for (int k = 0; k < active.count(); ++k)
            if (active.row(k).wall == wall) return true;
        return false;
    }

    Status iterate(double *points) {
        for (rounds_ = 1; rounds_ <= most_rounds; ++rounds_) {
            find_peaks();
            if (aim_ == Aim::widened && worst_ <= none()) return Status::done;
            if ((aim_ == Aim::near || aim_ == Aim::measured) && worst_ <= (aim_ == Aim::near ? nearly : affordable() / 10))
                return Status::done;
            if (aim_ == Aim::proved && share_ == 0 && worst_ <= affordable() / 2) {
                if (!pressed() && peak_count_ == 0 && proved(points)) return Status::done;
                share_ = Real(0.66) * affordable();
                if (!active.tighten(share_)) return Status::no_progress;
                find_peaks();
            }
            if (share_ > 0 && worst_ <= Real(0.7) * share_) {
                if (aim_ == Aim::proved && share_ > Real(1.2) * affordable()) {  // multipliers have grown since it was chosen
                    share_ = Real(0.66) * affordable();
                    if (!active.tighten(share_)) return Status::no_progress;
                    continue;
                }
                if (proved(points)) return Status::done;
                if (++tries_ > most_tries) return Status::not_proved;
                if (moved_walls_) {
                    if (!active.tighten(share_)) return Status::no_progress;
                    continue;
                }
                add_failures();
                if (peak_count_ == 0) return Status::not_proved;
                pause_ = largest(pause_, 2);
            }
            if (pause_ == 0 && near_rows() && moved()) continue;
            if (spent()) return Status::spent;
            if (stuck()) return Status::no_progress;
            if (aim_ != Aim::widened && !(active.squared_distance() < most_cost_)) return Status::no_progress;
            if (pause_ > 0) --pause_;
            const Status status = take_in();
            if (status != Status::done) return status;
        }
        return Status::no_progress;
    }

    bool spent() {
        const double points = 2.0 * given_->half;
        work_ += round_work * points * points * (double(given_->walls.count) + double(chain.pieces) * chain.dim);
        return work_ + active.work() > most_work * given_->effort ||
               (given_->due != Instant::max() && std::chrono::steady_clock::now() > given_->due);
    }

    // Whether the excess is small and has not been halved for long: rounding holds it up then, but not in the next precision.
    bool stuck() {
        if (worst_ < least_ / 2) least_ = worst_, halved_ = rounds_;
        return sizeof(Real) == 8 && worst_ < held_up && rounds_ - halved_ > most_idle;
    }

    // Whether a wall, other than an equality, is active.
    bool pressed() const {
        for (int k = 0; k < active.count(); ++k)
            if (!active.is_equality(k)) return true;
        return false;
    }

    // By how large a share of their widths walls may move inwards.
    Real affordable() const {
        const Real cost = free_cost_ + active.squared_distance(), slope = active.slope();
        return slope > 0 ? smallest(Real(given_->gap) * cost / (Real(1.5) * slope), most_inward) : most_inward;
    }

    void find_peaks() {
        peak_count_ = 0, worst_ = 0;
        for (int wall = 0; wall < int(given_->walls.count); ++wall) {
            if (walls_[wall].equality) continue;  // always active
            Real excess[max_products];
            const int degree = excess_over(wall, excess);
            const Real floor = Real(1e-13) * walls_[wall].width;
            const When when = walls_[wall].when;
            if (when == When::always)
                peaks_of(excess, degree, floor, [&](Real s, Real value) { note(wall, s, value); });
            else if (excess[when == When::start ? 0 : degree] > floor)
                note(wall, Real(int(when)), excess[when == When::start ? 0 : degree]);
        }
    }

    // Control points of the excess over a wall moved inwards, of a ball that of squares; returns their degree.
    int excess_over(int index, Real *excess) const {
        const Wall<Real> &wall = walls_[index];
        const int degree = beyond_plane(chain, wall, inwards(wall), excess);
        return wall.ball < 0 ? degree : beyond_ball(chain, wall, balls_[wall.ball], degree, excess);
    }

    // The share of its width by which a wall is moved inwards, or less outwards.
    Real inwards(const Wall<Real> &wall) const { return wall.slack < 0 ? share_ : share_ - active.slack(wall.slack); }

    Real widest() const {
        Real most = 0;
        for (int i = 0; i < given_->slacks.count; ++i) most = largest(most, active.slack(i));
        return most;
    }

    // Excess over walls that have given way which is none, in widths.
    Real none() const {
        const Real most = widest();
        if (sizeof(Real) > 8 && given_->slacks.sign && active.carries_slacks(known)) return std::numeric_limits<Real>::infinity();
        return largest(narrow * (1 + most), given_->slacks.sign ? rough * most : Real(0));
    }

    // Note a peak of what ``excess_over`` returned.
    void note(int index, Real s, Real value) {
        const Wall<Real> &wall = walls_[index];
        if (wall.ball >= 0) {
            Real low[max_points];  // minus the height
            const int degree = beyond_plane(chain, wall, inwards(wall), low);
            value = distance_beyond(wall, -jet_at(low, degree, s).value, value);
        }
        const Real excess = value / unit_at(wall, s);
        worst_ = largest(worst_, excess);
        if (peak_count_ < most_peaks_) peaks_[peak_count_++] = {index, s, excess};
    }

    // Prove the control points to be returned. Of walls that do not keep it, the instants are kept where the curve is
    // outside; a wall that rounding leaves no room for moves inwards.
    bool proved(double *points) {
        if (join() != Status::done) return false;
        write_points(*given_, chain, points);
        Proof proof(given_->walls, points, given_->durations, given_->pieces, chain.size.points(), chain.dim);
        failure_count_ = 0, moved_walls_ = false;
        bool all = true;
        for (int wall = 0; wall < int(given_->walls.count); ++wall) {
            if (walls_[wall].equality) {
                all = all && met(wall);
                continue;
            }
            const Greatest excess = proof.excess(wall);
            if (excess.bound <= 0.0) continue;
            all = false;
            if (excess.attained <= 0.0 && moved_inwards(walls_[wall], excess))
                moved_walls_ = true;
            else if (failure_count_ < most_failures)
                failures_[failure_count_++] = {wall, Real(excess.s), 0};
        }
        return all;
    }

    // Whether an equality holds but for rounding, which is all that can be asked of it.
    bool met(int wall) const {
        Real excess[max_products];
        const int degree = excess_over(wall, excess);
        return fabs(excess[walls_[wall].when == When::start ? 0 : degree]) <= Real(1e-10) * walls_[wall].width;
    }

    // Move a wall inwards by half as much again as the rounding of its proof, if there is that much room at its ends.
    bool moved_inwards(Wall<Real> &wall, const Greatest &excess) const {
        Real unit = given_->length;
        for (int q = 0; q < wall.order; ++q) unit /= given_->time;
        const Real inward = wall.inward + Real(1.5) * (Real(excess.bound) - excess.attained) / unit;
        if (!(inward < smallest(wall.give[0], wall.give[1]) / 2)) return false;
        wall.inward = inward;
        return true;
    }

    // Whether the control points are as often differentiable at the knots as asked, to what they can say.
    bool joined(const double *points) const {
        if (given_->continuity < given_->half) return true;
        const Pieces pieces{points, given_->durations, given_->pieces, chain.size.degree(), chain.dim};
        std::int64_t found = 0;
        return pieces.sound() && find_continuity(pieces, jump, stored, found) == Status::done && found >= given_->continuity;
    }

    // The instants where the proof failed become peaks, where the curve is beyond the walls moved inwards.
    void add_failures() {
        for (int i = 0; i < failure_count_; ++i) {
            Real excess[max_products];
            const int degree = excess_over(failures_[i].wall, excess);
            const Real value = jet_at(excess, degree, failures_[i].s).value;
            if (value > 0) note(failures_[i].wall, failures_[i].s, value);
        }
    }

    // Whether every peak that matters lies near an active row.
    bool near_rows() const {
        if (active.count() == 0 || worst_ >= Real(0.1)) return false;
        for (int i = 0; i < peak_count_; ++i) {
            if (peaks_[i].excess < Real(0.1) * worst_) continue;
            bool near = false;
            for (int k = 0; k < active.count() && !near; ++k) {
                const Row<Real> &row = active.row(k);
                near = row.wall == peaks_[i].wall && fabs(row.s - peaks_[i].s) < Real(0.3);
            }
            if (!near) return false;
        }
        return peak_count_ > 0;
    }

    // Move the rows to the contacts; if that does not halve the excess, come back.
    bool moved() {
        const Real before = worst_;
        contacts_.remember();
        if (contacts_.step(share_)) {
            find_peaks();
            if (worst_ < before / 2) {
                patience_ = shortest_pause;
                return true;
            }
        }
        contacts_.come_back(share_);
        find_peaks();
        pause_ = patience_, patience_ *= 2;
        return false;
    }

    // Take in the peaks, worst first, each that is still violated when its turn comes.
    Status take_in() {
        std::sort(peaks_.data(), peaks_.data() + peak_count_, [](const Peak<Real> &a, const Peak<Real> &b) { return a.before(b); });
        bool any = false;
        for (int i = 0; i < peak_count_; ++i) {
            const Peak<Real> &peak = peaks_[i];
            if (any && peak.excess < Real(0.05) * worst_) break;
            if (!active.propose(peak.wall, peak.s, share_)) continue;
            const Real left = active.value(active.count()) - active.row(active.count()).limit;
            if (left < peak.excess / 2 * unit_at(walls_[peak.wall], peak.s)) continue;
            const Entered entered = active.enter();
            if (entered == Entered::stalled) return Status::no_progress;
            any = any || entered == Entered::added;
            infeasible_ = entered == Entered::infeasible;
        }
        if (!any) return infeasible_ ? Status::infeasible : Status::no_progress;
        active.place();
        active.settle();
        return active.drop_negative() ? Status::done : Status::no_progress;
    }

    // The cost of the curve, and apart from it the bound that the multipliers prove; they must agree.
    Status finish(Answer &answer) {
        const Real cost = chain.cost(), bound = aim_ == Aim::proved ? dual_bound() - given_away_ : Real(0);
        answer.cost = double(cost), answer.bound = double(bound), answer.share = double(share_);
        press(answer);
        write_knots(answer);
        if (!isfinite(answer.cost) || !isfinite(answer.bound)) return Status::not_proved;  // as doubles
        const Real allowed = Real(given_->gap) * cost + smallest(price_of_proof(), most_inward * cost) + nothing_;
        return aim_ != Aim::proved || fabs(cost - bound) <= allowed ? Status::done : Status::not_proved;
    }

    // The active rows, and their multipliers.
    void press(Answer &answer) const {
        answer.rows = active.count();
        for (int k = 0; k < active.count(); ++k) write_row(answer, k, 2 * pressing(k) / active.row(k).norm);
    }

    void write_knots(Answer &answer) const {
        const std::size_t state = std::size_t(chain.slots()) * chain.dim;
        for (int knot = 0; knot <= chain.pieces; ++knot)
            for (std::size_t i = 0; i < state; ++i) answer.knots[knot * state + i] = double(chain.values[chain.at(knot, 0, 0) + i]);
    }

    void write_row(Answer &answer, int k, Real multiplier) const {
        const Row<Real> &row = active.row(k);
        answer.wall[k] = row.wall, answer.s[k] = double(row.s), answer.multiplier[k] = to_double(multiplier);
        if (answer.remainder != nullptr) answer.remainder[k] = to_double(multiplier - answer.multiplier[k]);
        for (int q = 0; q < chain.dim && answer.direction != nullptr; ++q) answer.direction[k * chain.dim + q] = double(row.direction[q]);
    }

    // Slacks, by which the walls give way to the last curve, and what presses against them, at whichever round that is: rows with
    // multipliers whose sum is next to nothing. Equalities are written with the sign of their normals.
    Status widened(Answer &answer, Status status) const {
        Real largest_part = 0;
        answer.rows = 0;
        if (status == Status::no_memory || status == Status::singular || status == Status::unsupported) return status;
        for (int k = 0; k < active.count(); ++k) {
            largest_part = largest(largest_part, fabs(active.row(k).multiplier / active.row(k).norm));
            if (!isfinite(active.row(k).multiplier) || !(largest_part < Real(1e150))) return Status::no_progress;  // quotients overflow
        }
        for (int k = 0; k < active.count() && largest_part > 0; ++k) {
            const Real sign = active.is_equality(k) ? active.row(k).direction[0] : Real(1);
            write_row(answer, k, sign * pressing(k) / active.row(k).norm / largest_part);
            answer.rows = k + 1;
        }
        for (int i = 0; i < given_->slacks.count; ++i) answer.slack[i] = to_double(active.slack(i));
        write_knots(answer);
        return status;
    }

    // What it costs that walls moved inwards by more than the gap allows, for the rounding of the proof.
    Real price_of_proof() const {
        Real total = 0;
        for (int k = 0; k < active.count(); ++k) {
            const Row<Real> &row = active.row(k);
            total += 2 * largest(row.multiplier, Real(0)) / row.norm * walls_[row.wall].inward;
        }
        return total;
    }

    // The multiplier of a row: of an equality it may have either sign.
    Real pressing(int k) const {
        const Real multiplier = active.row(k).multiplier;
        return active.is_equality(k) ? multiplier : largest(multiplier, Real(0));
    }

    // The least value of cost + 2 sum mu (n.r - b) over all curves is J0 - |sum mu a|^2 + 2 sum mu (n.r0 - b), where J0
    // and r0 belong to the optimum without walls. It bounds every cost for any mu >= 0, wherever they come from.
    Real dual_bound() {
        const int entries = active.layout().entries;
        if (!scratch_.allocate(entries + 1)) return -std::numeric_limits<Real>::infinity();
        for (int i = 0; i < entries; ++i) scratch_[i] = 0;
        Real linear = 0, points[max_points];
        for (int k = 0; k < active.count(); ++k) {
            const Row<Real> &row = active.row(k);
            const Real multiplier = pressing(k);
            const int degree = along_normal(chain, free_points_.data(), row.plane, points);
            linear += multiplier / row.norm * (jet_at(points, degree, row.s).value - row.plane.bound);
            active.orthogonal().add(scratch_.data(), multiplier, active.vector(k), row.reach);
        }
        return free_cost_ - dot(scratch_.data(), scratch_.data(), entries) + 2 * linear;
    }

    static constexpr int most_failures = 64;

    Contacts<Real, Half> contacts_;
    Buffer<Peak<Real>> peaks_;
    Buffer<Real> scratch_, free_points_, pull_;
    Peak<Real> failures_[most_failures];
    Real given_away_ = 0, free_cost_ = 0, share_ = 0, worst_ = 0, most_cost_ = 0, least_ = 0;
    Real nothing_ = 0;  // cost that rounding makes: a lap of continuity k - 2 may cost nothing
    std::int64_t most_peaks_ = 0, peak_count_ = 0;
    Aim aim_ = Aim::proved;
    unsigned drawn_ = 0;  // bits of coordinates
    int failure_count_ = 0, pause_ = 0, patience_ = 0, tries_ = 0;
    bool infeasible_ = false, moved_walls_ = false;
    int rounds_ = 0, halved_ = 0;
    double work_ = 0.0, factors_work_ = 0.0;  // the latter counts, and does not end a solve
};

}  // namespace minsnap

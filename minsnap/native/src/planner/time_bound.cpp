// A costate that the search of bounds/ finds in units of order one, and the time that it proves, summed as in minsnap/bounds/costate_proof.py.
#include "planner/time_bound.hpp"

#include <algorithm>

#include "basics/border.hpp"
#include "bounds/border.hpp"
#include "linear/inverse.hpp"

extern "C" std::int32_t minsnap_costate(minsnap::CostateSearch *asked);

namespace minsnap {
namespace {

struct BoundSettings {
    static constexpr int cells = 8, fine = 32;   // of each leg at first and at the end, where velocities are bounded
    static constexpr int parts = 64, finer = 2;  // of a leg where a costate is linear on it, and of each of them when the time is proved
    static constexpr double fast = 30.0;         // speed that no shortest flight has, over that of an acceleration along the whole way
    static constexpr double least = 1e-7;        // share of a leg in which its speed is reached that counts as at once
    static constexpr double factors[] = {1.0, 0.999, 0.9997, 1.0003, 1.001};  // that are tried on the costate
    static constexpr double larger[] = {1.01, 1.1, 1.3, 1.6};                 // the same where flights begin or end hovering,
    static constexpr double enough = 1.01;                                    // while each gains that much
    static constexpr double later[] = {0.97, 1.02, 1.06, 1.1, 1.16,
                                       1.25, 1.5,  2.0,  3.0, 4.5};  // ends of intervals of such a leg's duration, over that at the bound
    static constexpr double widest = 1.2;                            // half-angle up to which a cone around the vertical counts [rad]
    static constexpr double rounded = 1e-10;                         // share of what a time is the sum of by which it is rounded down
    static constexpr double beside = 1.0 + 8.0 * 0x1p-53;            // factor on what is computed from limits
};
using B = BoundSettings;

// A ball around a center in the first coordinates, or a cone that opens upwards from it and is cut.
struct Reachable {
    int dim;
    double fall, radius, slope, height;  // the center is (0, 0, fall)

    double support(const double *x) const {
        double square = 0.0;
        for (int d = 0; d < dim && radius > 0.0; ++d) square += x[d] * x[d];
        double reach = fall * x[2] + radius * std::sqrt(square);
        if (height > 0.0) reach += height * std::max(x[2] + slope * std::sqrt(x[0] * x[0] + x[1] * x[1]), 0.0);
        return reach;
    }

    Reachable scaled(double factor) const { return {dim, fall * factor, radius * factor, slope, height * factor}; }

    // As the search takes it: whether a cone, center, group of each axis, radius of each group, slope and height.
    void write(double *row) const {
        std::fill(row, row + 12, 0.0);
        row[0] = height > 0.0, row[3] = fall, row[10] = slope, row[11] = height;
        for (int d = 0; d < 3; ++d) row[4 + d] = radius > 0.0 && d < dim ? 0.0 : -1.0;
        row[7] = radius;
    }
};

// Accelerations that a flight can have some time after it hovers, or before it hovers: a cone whose half-angle grows, or a ball whose radius does.
struct Growing {
    Reachable unit;
    double rate;
    int power;  // of time: the flight hovers where its derivatives up to 1 + power are zero

    double size(double time) const { return rate * (power == 1 ? time : 0.5 * time * time); }
    static double slope(double angle) { return std::tan(std::min(angle, B::widest)) * B::beside; }

    double support(const double *x, double time) const {
        if (unit.height == 0.0) return size(time) * unit.support(x);
        Reachable grown = unit;
        grown.slope = slope(size(time));
        return grown.support(x);
    }

    // What a set of thrusts up to a norm loses least by: all, or what the projection on the cone leaves (J. J. Moreau, 1962).
    void share(const double *x, double time, double *own) const {
        for (int d = 0; d < 3; ++d) own[d] = x[d];
        if (unit.height == 0.0) return;
        const double angle = size(time), steep = slope(angle), aside = std::sqrt(x[0] * x[0] + x[1] * x[1]);
        const double height = aside > steep * x[2] ? std::max(steep * aside + x[2], 0.0) / (1.0 + steep * steep) : x[2];
        const double level = std::min(aside, steep * height) / (aside > 0.0 ? aside : 1.0);
        for (int d = 0; d < 3; ++d) own[d] = angle <= B::widest ? x[d] - (d < 2 ? level * x[d] : height) : 0.0;
    }
};

class TimeBound {
public:
    explicit TimeBound(const Course &course) : course_(course) {}

    Status find(double &seconds) {
        make_sets();
        if (own_ + fast_ == 0) return Status::unsupported;
        if (!make_course()) return Status::no_memory;
        if (!advances_) return Status::infeasible;
        const Status status = search();
        if (status != Status::done) return status;
        seconds = -infinite;
        double best = 1.0;
        for (const double factor : B::factors)
            if (const double found = proved(factor, false); found > seconds) seconds = found, best = factor;
        for (const double factor : B::larger) {
            if (growing_ == 0 || std::max(calm_[0], calm_[1]) < 2) break;
            const double before = seconds, found = proved(factor * best, true);
            seconds = std::max(seconds, found);
            if (!(found >= B::enough * before)) break;
        }
        return seconds > 0.0 ? Status::done : Status::not_proved;
    }

private:
    void make_sets() {
        const Bounds &bounds = course_.bounds;
        const double g = bounds.gravity;
        double height = infinite;
        if (bounds.norm[0] < infinite) velocities_[fast_++] = {course_.dim, 0.0, bounds.norm[0], 0.0, 0.0};
        if (bounds.norm[1] < infinite) accelerations_[own_++] = {course_.dim, 0.0, bounds.norm[1], 0.0, 0.0}, height = bounds.norm[1] + g;
        if (bounds.most_thrust < infinite && !bounds.drags()) {
            const double most = bounds.most_thrust * g * B::beside;
            accelerations_[own_++] = {3, -g, most, 0.0, 0.0}, height = std::min(height, most);
        }
        if (bounds.tilt < infinite && height < infinite && !bounds.drags())
            accelerations_[own_++] = {3, -g, 0.0, std::tan(bounds.tilt) * B::beside, height * B::beside};
        if (own_ > 0) make_growing(bounds);
    }

    // What bounds accelerations soon after rest: jerk and snap, and how fast thrust turns from the vertical.
    void make_growing(const Bounds &bounds) {
        for (int power = 1; power <= 2; ++power)
            if (bounds.norm[1 + power] < infinite)
                grows_[growing_++] = {{course_.dim, 0.0, 1.0, 0.0, 0.0}, bounds.norm[1 + power] * B::beside, power};
        if (!(bounds.most_thrust < infinite) || bounds.drags()) return;
        const Reachable cone = {3, -bounds.gravity, 0.0, 0.0, bounds.most_thrust * bounds.gravity * B::beside};
        if (bounds.body_rate < infinite) grows_[growing_++] = {cone, bounds.body_rate * B::beside, 1};
        if (bounds.vehicle == nullptr) return;
        if (const double turning = most_angular_acceleration(bounds); turning > 0.0) grows_[growing_++] = {cone, turning * B::beside, 2};
    }

    // The most by which rotors change the rate at which the thrust axis turns, or 0 where that is not known: see minsnap/bounds/derivative_sets.py.
    static double most_angular_acceleration(const Bounds &bounds) {
        const double *const inertia = bounds.vehicle->inertia, own[2] = {inertia[0], inertia[4]};
        for (int k = 0; k < 9; ++k)
            if (k % 4 != 0 && inertia[k] != 0.0) return 0.0;
        const bool alike = own[0] == own[1];
        const double excess[2] = {alike ? 1.0 : inertia[8] - own[0], alike ? 1.0 : inertia[8] - own[1]};
        if (!(std::min(excess[0], excess[1]) > 0.0)) return 0.0;
        double mixer[4][4], torques[4][4], most = 0.0;
        std::copy(bounds.vehicle->mixer, bounds.vehicle->mixer + 16, &mixer[0][0]);
        if (!invert(4, mixer, torques, 0.0)) return 0.0;
        for (int corner = 0; corner < 16; ++corner) {
            double sum = 0.0;
            for (int axis = 0; axis < 2; ++axis) {
                double torque = 0.0;
                for (int rotor = 0; rotor < 4; ++rotor)
                    torque +=
                        torques[1 + axis][rotor] * (bounds.hover() + (corner >> rotor & 1 ? bounds.room_above() : -bounds.room_below()));
                sum += excess[axis] * torque * torque / own[axis];
            }
            most = std::max(most, sum);
        }
        return std::sqrt(most / std::min(own[0] * excess[0], own[1] * excess[1]));
    }

    bool leaves(std::int64_t one, std::int64_t other) const {
        double square = 0.0;
        for (int d = 0; d < course_.dim; ++d) square += std::pow(course_.state(other)[d] - course_.state(one)[d], 2);
        return square > (1.0 + exact) * (course_.reach(one) + course_.reach(other)) * std::sqrt(square);
    }

    // Without inner balls that the way between centers does not leave for the next one.
    bool make_course() {
        const std::int64_t last = course_.legs;
        Buffer<std::int64_t> keep;
        if (!keep.allocate(std::size_t(last + 2))) return false;
        std::int64_t kept = 1;
        keep[0] = 0;
        for (std::int64_t knot = 1; knot <= last; ++knot)
            if (leaves(keep[std::size_t(kept - 1)], knot)) keep[std::size_t(kept++)] = knot;
        while (keep[std::size_t(kept - 1)] != last)
            if (kept == 1 || leaves(keep[std::size_t(kept - 1)], last))
                keep[std::size_t(kept++)] = last;
            else
                --kept;
        legs_ = kept - 1;
        advances_ = legs_ > course_.closed;
        for (std::int64_t k = 0; k < legs_; ++k) advances_ = advances_ && leaves(keep[std::size_t(k)], keep[std::size_t(k + 1)]);
        if (!steps_.allocate(std::size_t(3 * legs_)) || !radii_.allocate(std::size_t(kept))) return false;
        for (std::int64_t k = 0; k < kept; ++k) radii_[std::size_t(k)] = course_.reach(keep[std::size_t(k)]);
        for (std::int64_t k = 0; k < legs_; ++k)
            for (int d = 0; d < 3; ++d)
                steps_[std::size_t(3 * k + d)] =
                    d < course_.dim ? course_.state(keep[std::size_t(k + 1)])[d] - course_.state(keep[std::size_t(k)])[d] : 0.0;
        for (int end = 0; end < 2; ++end)
            for (int d = 0; d < course_.dim && !course_.closed; ++d) ends_[3 * end + d] = course_.state(end * last)[course_.dim + d];
        for (int end = 0; end < 2 && !course_.closed; ++end)
            for (int order = 1; order < course_.half && calm_[end] == order - 1; ++order) {
                bool zero = true;
                for (int d = 0; d < course_.dim; ++d) zero = zero && course_.state(end * last)[order * course_.dim + d] == 0.0;
                calm_[end] += zero;
            }
        return true;
    }

    static double size(const double *x) { return std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

    // Roughly the time of a leg, and how long its speed takes to change.
    void roughly(std::int64_t leg, double &time, double &starting) const {
        const double *const step = steps_.data() + 3 * leg, length = size(step);
        const double along[3] = {step[0] / length, step[1] / length, step[2] / length}, back[3] = {-along[0], -along[1], -along[2]};
        double acceleration = infinite, speed = infinite;
        for (int k = 0; k < own_; ++k)
            acceleration = std::min(acceleration, std::max(accelerations_[k].support(along), accelerations_[k].support(back)));
        for (int k = 0; k < fast_; ++k) speed = std::min(speed, std::max(velocities_[k].support(along), velocities_[k].support(back)));
        time = std::sqrt(length / speed * (length / speed) + length / acceleration), starting = speed / acceleration;
    }

    Status search() {
        const std::int64_t legs = legs_, count = 12 * (std::max(own_, 1) + std::max(fast_, 1));
        linear_ = fast_ == 0, fine_ = linear_ ? 1 : B::fine, parts_ = linear_ ? B::parts : 1;
        const std::int64_t more = std::max(own_, 1) - 1, grid = legs * (fine_ + 1), splits = legs * fine_ * (parts_ + 1) * more * 3;
        double sets[12 * 5];
        Buffer<double> steps, rounds, sides, times;
        if (!steps.allocate(std::size_t(3 * legs)) || !rounds.allocate(std::size_t(9 * (legs + 1))) ||
            !sides.allocate(std::size_t(9 * (legs + 1))) || !times.allocate(std::size_t(2 * legs)) || !grid_.allocate(std::size_t(grid)) ||
            !costate_.allocate(std::size_t(3 * grid)) || !rate_.allocate(std::size_t(3 * legs)) ||
            !splits_.allocate(std::size_t(splits + 1)))
            return Status::no_memory;
        double length = 0.0, time = 0.0, rough, starting;
        for (std::int64_t k = 0; k < legs; ++k)
            roughly(k, rough, starting), length += size(steps_.data() + 3 * k) / double(legs), time += rough / double(legs);
        const double speed = length / time, acceleration = speed / time;
        std::fill(rounds.data(), rounds.data() + 9 * (legs + 1), 0.0), std::fill(sides.data(), sides.data() + 9 * (legs + 1), 0.0);
        std::fill(grid_.data(), grid_.data() + grid, 0.0), std::fill(costate_.data(), costate_.data() + 3 * grid, 0.0),
            std::fill(splits_.data(), splits_.data() + splits, 0.0);
        double sum = 0.0, fastest = 0.0, ends[6];
        for (std::int64_t k = 0; k < legs; ++k) {
            roughly(k, rough, starting);
            times[std::size_t(k)] = rough / time, times[std::size_t(legs + k)] = starting / rough, sum += rough / time;
            for (int d = 0; d < 3; ++d) steps[std::size_t(3 * k + d)] = steps_[std::size_t(3 * k + d)] / length;
        }
        for (std::int64_t k = 0; k <= legs; ++k)
            for (int d = 0; d < course_.dim; ++d) rounds[std::size_t(9 * k + 4 * d)] = radii_[std::size_t(k)] / length;
        for (int j = 0; j < 6; ++j) ends[j] = ends_[j] / speed, fastest = std::max(fastest, std::fabs(ends[j]));
        for (int k = 0; k < own_; ++k) accelerations_[k].scaled(1.0 / acceleration).write(sets + 12 * k);
        if (own_ == 0) Reachable{3, 0.0, 1.0, 0.0, 0.0}.write(sets);
        double *const second = sets + 12 * std::max(own_, 1);
        if (fast_ > 0)
            velocities_[0].scaled(1.0 / speed).write(second);
        else
            Reachable{3, 0.0, B::fast * (sum + fastest), 0.0, 0.0}.write(second);
        (void)count;
        begin(steps.data(), times.data() + legs, 1.0 / acceleration, 1.0 / speed);
        const std::int64_t axes = (std::int64_t(1) << course_.dim) - 1;
        CostateSearch asked = {};
        asked.legs = legs, asked.cells = linear_ ? 1 : B::cells, asked.fine = fine_, asked.parts = parts_, asked.closed = course_.closed;
        asked.accelerations = std::max(own_, 1), asked.velocities = 1, asked.costate_axes = own_ > 0 ? axes : 0, asked.rate_axes = axes;
        asked.sets = sets, asked.steps = steps.data(), asked.rounds = rounds.data(), asked.sides = sides.data(), asked.times = times.data();
        asked.ends = ends, asked.grid = grid_.data(), asked.costate = costate_.data(), asked.rate = rate_.data(),
        asked.splits = splits_.data();
        asked.rate_splits = splits_.data() + splits;
        const Status status = Status(minsnap_costate(&asked));
        if (status != Status::done) return status;
        for (std::int64_t j = 0; j < 3 * grid; ++j) costate_[std::size_t(j)] /= acceleration;
        for (std::int64_t j = 0; j < 3 * legs; ++j) rate_[std::size_t(j)] /= acceleration;
        for (std::int64_t j = 0; j < splits; ++j) splits_[std::size_t(j)] /= acceleration;
        for (std::int64_t k = 0; linear_ && k < legs; ++k)
            for (int d = 0; d < 3; ++d)
                rate_[std::size_t(3 * k + d)] = costate_[std::size_t(6 * k + d)] - costate_[std::size_t(6 * k + 3 + d)];
        return Status::done;
    }

    // A costate that falls along the way, or what the speed alone proves. Units: of the inverse of an acceleration, and of a speed.
    void begin(const double *steps, const double *shares, double slower, double unhurried) {
        if (linear_) {
            double place[3] = {}, mean[3] = {}, most = 0.0;
            for (std::int64_t k = 0; k < legs_; ++k)
                for (int d = 0; d < 3; ++d) place[d] += steps[3 * k + d], mean[d] += place[d];
            double at[3];
            for (int d = 0; d < 3; ++d) at[d] = course_.closed ? 0.0 : -mean[d] / double(legs_ + 1);
            auto raise = [&] {
                const double back[3] = {-at[0], -at[1], -at[2]};
                for (int j = 0; j < own_; ++j)
                    most = std::max({most, slower * accelerations_[j].support(at), slower * accelerations_[j].support(back)});
            };
            raise();
            for (std::int64_t k = 0; k < legs_; ++k) {
                for (int d = 0; d < 3; ++d)
                    costate_[std::size_t(6 * k + d)] = at[d], at[d] += steps[3 * k + d], costate_[std::size_t(6 * k + 3 + d)] = at[d];
                raise();
            }
            const double factor = 0.25 / most;
            for (std::int64_t j = 0; j < 6 * legs_; ++j) costate_[std::size_t(j)] *= -factor;
            for (std::int64_t k = 0; k < legs_; ++k) grid_[std::size_t(2 * k + 1)] = 1.0;
            for (std::int64_t j = 0; j < 3 * legs_; ++j) rate_[std::size_t(j)] = factor * steps[j];
            return;
        }
        for (std::int64_t k = 0; k < legs_; ++k) {
            const double share = shares[k],
                         square = steps[3 * k] * steps[3 * k] + steps[3 * k + 1] * steps[3 * k + 1] + steps[3 * k + 2] * steps[3 * k + 2];
            const double most = unhurried * velocities_[0].support(steps + 3 * k);
            const bool graded = share < 0.25 && share > B::least;
            double *const grid = grid_.data() + k * (fine_ + 1);
            for (int j = 0; j <= B::cells; ++j) {
                const double close = share * 0.5 * (j < 4 ? j : 8 - j);
                grid[j] = !graded ? double(j) / B::cells : j < 4 ? close : j == 4 ? 0.5 : 1.0 - close;
            }
            for (int d = 0; d < 3; ++d) rate_[std::size_t(3 * k + d)] = square / (most * most) * steps[3 * k + d];
        }
    }

    // The support of the intersection of accelerations, divided among them: shares are those of the sets after the first.
    double supported(const double *whole, const double *shares) const {
        double rest[3] = {whole[0], whole[1], whole[2]}, sum = 0.0;
        for (int k = 1; k < own_; ++k) {
            for (int d = 0; d < 3; ++d) rest[d] -= shares[3 * (k - 1) + d];
            sum += accelerations_[k].support(shares + 3 * (k - 1));
        }
        return own_ > 0 ? accelerations_[0].support(rest) + sum : 0.0;
    }

    // The costate times a factor at an instant of a cell, and what the sets after the first share of it.
    void at_instant(std::int64_t leg, std::int64_t cell, std::int64_t i, double factor, double *whole, double *shares) const {
        const std::int64_t more = std::max(own_, 1) - 1, low = std::min<std::int64_t>(i / B::finer, parts_ - 1);
        const double *const p = costate_.data() + 3 * (leg * (fine_ + 1) + cell), *const splits = splits_.data() + (leg * fine_ + cell) *
                                                                                                                       (parts_ + 1) * more *
                                                                                                                       3;
        const double share = double(i) / double(parts_ * B::finer), past = double(i) / B::finer - double(low);
        for (int d = 0; d < 3; ++d) whole[d] = factor * ((1.0 - share) * p[d] + share * p[3 + d]);
        for (std::int64_t j = 0; j < 3 * more; ++j)
            shares[j] = factor * ((1.0 - past) * splits[low * more * 3 + j] + past * splits[(low + 1) * more * 3 + j]);
    }

    // 1 - a, b, X and the integral of the velocities' support of a leg.
    void sums(std::int64_t leg, double factor, double &room, double &product, double &change, double &lost) const {
        const std::int64_t steps = parts_ * B::finer;
        const double *const grid = grid_.data() + leg * (fine_ + 1), *const costate = costate_.data() + 3 * leg * (fine_ + 1);
        double used = 0.0;
        lost = 0.0;
        for (int cell = 0; cell < fine_; ++cell) {
            const double width = grid[cell + 1] - grid[cell], *const p = costate + 3 * cell;
            double inside = 0.0, moved[3];
            for (std::int64_t i = 0; i <= steps; ++i) {
                double whole[3], shares[6];
                at_instant(leg, cell, i, factor, whole, shares);
                inside += supported(whole, shares) * (i == 0 || i == steps ? 0.5 : 1.0) / double(steps);
            }
            used += inside * width;
            for (int d = 0; d < 3; ++d) moved[d] = factor * ((p[3 + d] - p[d]) / width + rate_[std::size_t(3 * leg + d)]);
            if (fast_ > 0) lost += velocities_[0].support(moved) * width;
        }
        const double *const rate = rate_.data() + 3 * leg, *const step = steps_.data() + 3 * leg;
        room = 1.0 - used, product = factor * (rate[0] * step[0] + rate[1] * step[1] + rate[2] * step[2]);
        change = factor * size(rate) * (radii_[std::size_t(leg)] + radii_[std::size_t(leg + 1)]);
    }

    // What growing sets add to the room of a leg at an end, for its durations up to each of some, and these.
    void add_growing(std::int64_t leg, double factor, double time, double *saved, double *latest) const {
        const std::int64_t more = std::max(own_, 1) - 1, steps = parts_ * B::finer;
        const double *const grid = grid_.data() + leg * (fine_ + 1);
        for (int j = 0; j < intervals; ++j) saved[j] = 0.0, latest[j] = B::later[j] * time;
        for (std::int64_t part = 0; part < fine_ * steps; ++part) {
            const std::int64_t cell = part / steps, i = part % steps;
            const double width = (grid[cell + 1] - grid[cell]) / double(steps), begins = grid[cell] + width * double(i);
            double whole[2][3], shares[2][6], rest[2][3], before[2];
            for (int side = 0; side < 2; ++side) {
                at_instant(leg, cell, i + side, factor, whole[side], shares[side]);
                before[side] = supported(whole[side], shares[side]);
                for (int d = 0; d < 3; ++d) {
                    rest[side][d] = whole[side][d];
                    for (std::int64_t m = 0; m < more; ++m) rest[side][d] -= shares[side][3 * m + d];
                }
            }
            for (int j = 0; j < intervals; ++j)
                for (int end = 0; end < 2; ++end) {
                    if (leg != (end == 0 ? 0 : legs_ - 1)) continue;
                    const double share = end == 0 ? begins + width : 1.0 - begins, after = share * latest[j];
                    if (legs_ == 1 && share > 0.5 + 1e-9) continue;  // half of a single leg each
                    double most = 0.0;
                    for (int g = 0; g < growing_; ++g) {
                        if (calm_[end] <= grows_[g].power) continue;
                        double gain = 0.0;
                        for (int side = 0; side < 2; ++side) {
                            double own[3], left[3];
                            grows_[g].share(rest[side], after, own);
                            for (int d = 0; d < 3; ++d) left[d] = whole[side][d] - own[d];
                            gain += before[side] - supported(left, shares[side]) - grows_[g].support(own, after);
                        }
                        most = std::max(most, gain);
                    }
                    saved[j] += 0.5 * width * most;
                }
        }
    }

    // The least of (1 - a) T + b / T over the intervals of a leg's duration T.
    static double least(double room, double product, const double *saved, const double *latest) {
        double found = infinite;
        for (int j = 0; j <= intervals; ++j) {
            const double here = room + (j < intervals ? saved[j] : 0.0), begin = j > 0 ? latest[j - 1] : 1e-300;
            const double at = std::min(std::max(std::sqrt(product / here), begin), j < intervals ? latest[j] : infinite);
            found = std::min(found, here * at + product / at);
        }
        return found;
    }

    // The time that the costate times a factor proves, rounded down; less than zero where it proves none.
    double proved(double factor, bool hovers) {
        double seconds = 0.0, all = 0.0, room, product, change, lost;
        if (!turned_.allocate(std::size_t(3 * (legs_ + 1)))) return -infinite;
        std::fill(turned_.data(), turned_.data() + 3 * (legs_ + 1), 0.0);
        for (std::int64_t leg = 0; leg < legs_; ++leg) {
            sums(leg, factor, room, product, change, lost);
            if (!(room > 0.0 && product >= change)) return -infinite;
            double most = 2.0 * std::sqrt(room * (product + change)), fewest = 2.0 * std::sqrt(room * (product - change));
            if (hovers && (leg == 0 || leg == legs_ - 1)) {
                double saved[intervals], latest[intervals];
                add_growing(leg, factor, std::sqrt(product / room), saved, latest);
                most = least(room, product + change, saved, latest), fewest = least(room, product - change, saved, latest);
            }
            const double chord = change > 1e-6 * product ? (most - fewest) / (2.0 * change) : std::sqrt(room / product);
            const double found = std::min(most - chord * change, fewest + chord * change);
            seconds += found - lost, all += std::fabs(found) + lost;
            for (int d = 0; d < 3; ++d) {
                const double turn = chord * factor * rate_[std::size_t(3 * leg + d)];
                turned_[std::size_t(3 * leg + d)] += turn, turned_[std::size_t(3 * leg + 3 + d)] -= turn;
            }
        }
        for (int d = 0; course_.closed && d < 3; ++d)
            turned_[std::size_t(d)] += turned_[std::size_t(3 * legs_ + d)], turned_[std::size_t(3 * legs_ + d)] = 0.0;
        for (std::int64_t k = 0; k <= legs_; ++k) {
            const double reach = radii_[std::size_t(k)] * size(turned_.data() + 3 * k);
            seconds -= reach, all += reach;
        }
        double ends = 0.0;
        for (int d = 0; d < 3; ++d)
            ends +=
                factor * (costate_[std::size_t(3 * (legs_ * (fine_ + 1) - 1) + d)] * ends_[3 + d] - costate_[std::size_t(d)] * ends_[d]);
        return seconds + ends - B::rounded * (all + std::fabs(ends));
    }

    static constexpr int intervals = int(sizeof(B::later) / sizeof(double));

    const Course &course_;
    Reachable accelerations_[3] = {}, velocities_[1] = {};
    Growing grows_[4] = {};
    int own_ = 0, fast_ = 0, growing_ = 0, fine_ = 1, parts_ = 1, calm_[2] = {};
    bool linear_ = false, advances_ = false;
    std::int64_t legs_ = 0;
    double ends_[6] = {};
    Buffer<double> steps_, radii_, grid_, costate_, rate_, splits_, turned_;
};

}  // namespace

Status least_time(const Course &course, Says &says, double &seconds) {
    if (!course.limited) return says(Status::bad_number, "a least time is that of flights within limits: give limits, and no times");
    const Status status = TimeBound(course).find(seconds);
    if (status == Status::done) return status;
    if (status == Status::unsupported) return says(status, "neither a speed nor an acceleration is bounded all around");
    if (status == Status::infeasible) return says(Status::unsupported, "the course may be passed without moving");
    return says(status, status == Status::no_memory ? "there is no memory for a bound of the time" : "no time above zero was proved");
}

}  // namespace minsnap

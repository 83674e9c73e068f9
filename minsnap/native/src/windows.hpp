// Many pieces: overlapping windows, then tiles, then one bound for the whole.
//
// What happens at one knot is felt at another less and less the more knots lie between. So windows of ``core`` pieces with
// ``margin`` more on each side, their ends at rest, give the states in the middle of every window almost as the whole
// chain has them. Tiles then run from middle to middle with these states held: together they are one curve, every piece
// of it proved inside its walls. The multipliers, of a tile where it is far from its ends and of the window elsewhere,
// and one elimination over the whole chain give a lower bound of every cost, which decides whether that was good enough;
// if not, tiles with other ends follow, whose states are those of the last ones.
#pragma once

#include "exchange_solver.hpp"
#include "sorted_walls.hpp"
#include "square_root.hpp"
#include "vectors.hpp"

namespace minsnap {

class Windows {
public:
    explicit Windows(int half) : chain_(half) {}

    Status solve(const Request &given, Answer &answer) {
        given_ = &given, answer_ = &answer;
        answer.rounds = 0;
        if (!allocate()) return Status::no_memory;
        Status status = prepare_bound();
        for (int begin = 0; begin < given.pieces && status == Status::done; begin += core)
            status = window(begin, begin + core < given.pieces ? begin + core : given.pieces);
        for (int sweep = 0; sweep < most_sweeps && status == Status::done; ++sweep) {
            status = tiles(sweep % 2 == 0 ? core / 2 : core);
            if (status == Status::done && close_enough()) return finish();
        }
        return status == Status::done ? Status::not_proved : status;
    }

private:
    static constexpr int core = 12, margin = 3, longest = core + 2 * margin, most_contacts = 24, most_sweeps = 5;

    struct Kept {
        std::int64_t wall;  // among the sorted ones
        double s, pressure, direction[max_dim];
    };

    [[nodiscard]] bool allocate() {
        const std::size_t half = given_->half, dim = given_->dim, state = half * dim, local = longest + 1;
        const std::size_t pieces = given_->pieces, rows = longest * state + 2;
        return walls_.take(given_->walls, given_->pieces, given_->dim) && states_.allocate((pieces + 1) * state) &&
               kept_.allocate(pieces * most_contacts) && kept_count_.allocate(pieces) &&
               pinned_.allocate(local * state) && values_.allocate(local * state) &&
               points_.allocate(longest * 2 * state) && knots_.allocate(local * state) && wall_.allocate(rows) &&
               s_.allocate(rows) && multiplier_.allocate(rows) && direction_.allocate(rows * dim) && known_.allocate(longest * most_contacts);
    }

    // Solve pieces from begin up to end and ``margin`` more on each side; keep what is in between.
    Status window(int begin, int end) {
        const int low = begin > margin ? begin - margin : 0;
        const int high = end + margin < given_->pieces ? end + margin : given_->pieces;
        for (int piece = begin; piece < end; ++piece) kept_count_[piece] = 0;
        return run(low, high, begin, end, true, points_.data());
    }

    // Solve tiles that begin after ``first`` pieces, from the contacts known and between states held.
    Status tiles(int first) {
        Status status = Status::done;
        cost_ = 0.0;
        for (int begin = 0, end = first; begin < given_->pieces && status == Status::done; begin = end, end += core) {
            end = end < given_->pieces ? end : given_->pieces;
            if (given_->pieces - end < core / 2) end = given_->pieces;
            double *const points = answer_->points + std::size_t(begin) * 2 * given_->half * given_->dim;
            const int inner_begin = begin == 0 ? 0 : begin + core / 4;
            const int inner_end = end == given_->pieces ? end : end - core / 4;
            status = run(begin, end, inner_begin, inner_end, false, points);
        }
        return status;
    }

    // Solve pieces [low, high); keep states inside it, and contacts of the pieces [begin, end).
    Status run(int low, int high, int begin, int end, bool rough, double *points) {
        pin(low, high, !rough);
        const std::size_t dim = given_->dim;
        const Request part = {given_->half, high - low, given_->dim, false, given_->length, given_->time,
                              given_->positions + low * dim, given_->durations + low, pinned_.data(), values_.data(),
                              walls_.between(low, high), given_->gap / 2};
        Answer found = {points, knots_.data(), wall_.data(), s_.data(), multiplier_.data(), 0, 0, 0, 0, 0, direction_.data()};
        const int known = rough ? 0 : gather(low, high);
        const Status status = exchange_.solve(part, found, rough, known_.data(), known);
        if (status != Status::done) return status;
        cost_ += found.cost;
        answer_->rounds += found.rounds, answer_->share = found.share;
        for (int piece = begin; piece < end; ++piece) kept_count_[piece] = 0;
        for (std::int64_t row = 0; row < found.rows; ++row) keep(low, begin, end, row);
        const int first = rough ? (begin > low ? begin : low + 1) : low + 1;
        const int last = rough ? (end < high ? end : high - 1) : high - 1;
        for (int knot = first; knot <= last; ++knot) keep_state(knot, knot - low);
        return status;
    }

    // States at the ends of a stretch: given ones at the ends of the chain, else held, or at rest.
    void pin(int low, int high, bool held) {
        const std::size_t state = std::size_t(given_->half) * given_->dim;
        for (int knot = low; knot <= high; ++knot)
            for (std::size_t i = 0; i < state; ++i) {
                const std::size_t local = (knot - low) * state + i, global = knot * state + i;
                const int order = int(i) / given_->dim, axis = int(i) % given_->dim;
                const bool cut = (knot == low && low > 0) || (knot == high && high < given_->pieces);
                pinned_[local] = cut || is_pinned(*given_, knot, order, axis);
                values_[local] = given_->values == nullptr ? 0.0 : given_->values[global];
                if (cut && !is_pinned(*given_, knot, order, axis)) values_[local] = held ? states_[global] : 0.0;
            }
    }

    int gather(int low, int high) {
        int count = 0;
        for (int piece = low; piece < high; ++piece)
            for (int i = 0; i < kept_count_[piece]; ++i) {
                const Kept &kept = kept_[std::size_t(piece) * most_contacts + i];
                Contact &contact = known_[count++];
                contact = {int(kept.wall - walls_.sorted(low, 0)), kept.s, kept.pressure, {}};
                for (int q = 0; q < max_dim; ++q) contact.direction[q] = kept.direction[q];
            }
        return count;
    }

    void keep(int low, int begin, int end, std::int64_t row) {
        const std::int64_t wall = walls_.sorted(low, wall_[row]);
        const int piece = int(walls_.between(0, given_->pieces).piece[wall]);
        if (piece < begin || piece >= end || kept_count_[piece] == most_contacts) return;
        Kept &kept = kept_[std::size_t(piece) * most_contacts + kept_count_[piece]++];
        kept = {wall, s_[row], multiplier_[row] / 2, {}};
        for (int q = 0; q < given_->dim; ++q) kept.direction[q] = direction_[row * given_->dim + q];
    }

    // Keep the state of a knot, in metres and seconds.
    void keep_state(int knot, int local) {
        const std::size_t dim = given_->dim, state = given_->half * dim;
        double unit = given_->length;
        for (std::size_t i = 0; i < state; ++i) {
            if (i > 0 && i % dim == 0) unit /= given_->time;
            states_[knot * state + i] = knots_[local * state + i] * unit;
        }
    }

    // The optimum of the whole chain without walls.
    Status prepare_bound() {
        if (!chain_.allocate(given_->pieces, given_->dim, false)) return Status::no_memory;
        load_chain(*given_, chain_);
        free_cost_ = 0.0;
        for (int axis = 0; axis < given_->dim; ++axis) {
            if (!factors_[axis].allocate(chain_)) return Status::no_memory;
            const Status status = factors_[axis].factorise(chain_, &axis, 1);
            if (status != Status::done) return status;
            if (!force_[axis].allocate(factors_[axis].unknowns() + 1)) return Status::no_memory;
            free_cost_ += factors_[axis].rest();
            factors_[axis].optimum(0, force_[axis].data());
            factors_[axis].add(chain_, axis, force_[axis].data());
        }
        chain_.place();
        return Status::done;
    }

    // The bound that the contacts kept prove, as in Exchange::dual_bound.
    bool close_enough() {
        double linear = 0.0;
        for (int axis = 0; axis < given_->dim; ++axis)
            for (int i = 0; i < factors_[axis].unknowns(); ++i) force_[axis][i] = 0.0;
        const GivenWalls all = walls_.between(0, given_->pieces);
        for (int piece = 0; piece < given_->pieces; ++piece)
            for (int i = 0; i < kept_count_[piece]; ++i)
                linear += press(all, kept_[std::size_t(piece) * most_contacts + i]);
        double squares = 0.0;
        for (int axis = 0; axis < given_->dim; ++axis) {
            factors_[axis].forward_all(force_[axis].data());
            squares += dot(force_[axis].data(), force_[axis].data(), factors_[axis].unknowns());
        }
        answer_->cost = cost_, answer_->bound = free_cost_ - squares + 2.0 * linear;
        return std::fabs(answer_->cost - answer_->bound) <= given_->gap * cost_;
    }

    // Add the force of a contact; returns its pressure times the excess of the optimum without walls.
    double press(const GivenWalls &all, const Kept &kept) {
        Request whole = *given_;
        whole.walls = all;
        Wall<double> wall;
        Ball<double> ball;
        load_wall(whole, chain_, kept.wall, 0, wall, ball);
        const Plane<double> plane = wall.ball < 0 ? wall : tangent(wall, ball, given_->dim, kept.direction);
        double factors[max_points], points[max_points];
        row_factors(chain_.size, *chain_.tables, chain_.durations[plane.piece], plane.order, kept.s, factors);
        for (int axis = 0; axis < given_->dim; ++axis)
            if (plane.axes >> axis & 1U)
                factors_[axis].scatter(plane.piece, factors, kept.pressure * plane.normal[axis], force_[axis].data());
        const int degree = along_normal(chain_, chain_.points.data(), plane, points);
        return kept.pressure * (jet_at(points, degree, kept.s).value - plane.bound);
    }

    // States and contacts of the whole.
    Status finish() {
        const std::size_t dim = given_->dim, state = given_->half * dim;
        answer_->rows = 0;
        for (int piece = 0; piece < given_->pieces; ++piece)
            for (int i = 0; i < kept_count_[piece]; ++i) {
                const Kept &kept = kept_[std::size_t(piece) * most_contacts + i];
                if (answer_->rows == std::int64_t(given_->pieces * state)) return Status::bad_size;
                answer_->wall[answer_->rows] = walls_.source(kept.wall), answer_->s[answer_->rows] = kept.s;
                answer_->multiplier[answer_->rows++] = 2.0 * kept.pressure;
            }
        double unit = given_->length;
        for (std::size_t i = 0; i < state; ++i) {
            if (i > 0 && i % dim == 0) unit /= given_->time;
            for (int knot = 0; knot <= given_->pieces; ++knot) {
                const bool fixed = is_pinned(*given_, knot, int(i / dim), int(i % dim));
                const double value = !fixed ? states_[knot * state + i]
                                     : given_->values == nullptr ? 0.0 : given_->values[knot * state + i];
                answer_->knots[knot * state + i] = value / unit;
            }
        }
        return Status::done;
    }

    const Request *given_ = nullptr;
    Answer *answer_ = nullptr;
    SortedWalls walls_;
    ExchangeSolver exchange_;
    Chain<double, 0> chain_;
    SquareRoot<double, 0> factors_[max_dim];
    Buffer<double> force_[max_dim], states_, values_, points_, knots_, s_, multiplier_, direction_;
    Buffer<std::uint8_t> pinned_;
    Buffer<std::int64_t> wall_;
    Buffer<Kept> kept_;
    Buffer<int> kept_count_;
    Buffer<Contact> known_;
    double cost_ = 0.0, free_cost_ = 0.0;
};

}  // namespace minsnap

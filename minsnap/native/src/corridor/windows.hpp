// Many pieces: overlapping windows, then tiles, then one bound for the whole.
//
// What happens at one knot is felt at another less and less the more knots lie between. So windows of ``core`` pieces with
// ``margin`` more on each side, their ends at rest, give the states in the middle of every window almost as the whole
// chain has them. Tiles then run from middle to middle with these states held: together they are one curve, every piece
// of it proved inside its walls. In a closed chain windows and tiles run across the seam, over its first pieces again. The multipliers, of a tile where it is far from its ends and of the window elsewhere,
// and one elimination over the whole chain give a lower bound of every cost, which decides whether that was good enough;
// if not, tiles with other ends follow, whose states are those of the last ones. What is felt further, such as where
// many waypoints in a row are free, takes more and longer tiles.
#pragma once

#include <cstring>

#include "corridor/exchange_solver.hpp"
#include "corridor/knot_bounds.hpp"
#include "corridor/sorted_walls.hpp"
#include "arithmetic/square_root.hpp"
#include "arithmetic/vectors.hpp"

namespace minsnap {

// Pieces up to which a request is solved whole at first, and at all.
constexpr int most_whole = 48, most_again = 96;

class Windows {
public:
    explicit Windows(int half) : chain_(half) {}

    Status solve(const Request &given, Answer &answer) {
        given_ = &given, answer_ = &answer;
        stretches_ = given.pieces / core;
        answer.rounds = 0;
        if (!joins() || stretches_ == 0 || given.continuity >= given.half) return Status::unsupported;
        if (!allocate()) return Status::no_memory;
        unroll();
        Status status = Status::done;
        for (int i = 0; i < stretches_ && status == Status::done; ++i) status = window(cut(2 * i), cut(2 * i + 2));
        double before = std::numeric_limits<double>::infinity();
        for (int sweep = 0; sweep < most_sweeps && status == Status::done; ++sweep) {
            status = tiles(sweep % 2 == 0 ? 1 : 0);
            if (status == Status::done && sweep == 0) status = prepare_bound();
            if (status != Status::done) return status;
            if (close_enough()) return finish();
            const double left = answer.cost - answer.bound;
            if (!(left < before / 10)) grow();
            before = left;
        }
        return status == Status::done ? Status::not_proved : status;
    }

private:
    static constexpr int core = 12, margin = 3, longest = 5 * core, most_contacts = 24, most_sweeps = 12;
    static constexpr double holding = 0.1;  // share of the gap that the bound may give away to hold knots

    struct Kept {
        std::int64_t wall;  // among those of its piece
        double s, pressure, direction[max_dim];
    };

    // Knots at which stretches of about ``core`` pieces end, for even i, and the middles between them.
    int cut(int i) const { return int(std::int64_t(i) * given_->pieces / (2 * stretches_)); }

    // Pieces and knots of a closed chain are counted on behind the last one; its last knot is the first one.
    int own(int index) const { return given_->closed ? index % given_->pieces : index; }
    bool is_end(int knot) const { return !given_->closed && (knot == 0 || knot == given_->pieces); }
    int repeated() const { return !given_->closed ? 0 : given_->pieces < longest ? given_->pieces : longest; }

    // Where tiles come closer too slowly, longer ones follow, solved more accurately.
    void grow() {
        accuracy_ /= 2;
        const int fewer = stretches_ / 2;
        if (fewer > 0 && given_->pieces < fewer * longest) stretches_ = fewer;
    }

    // Whether a closed chain ends where it begins, as repeated pieces must.
    bool joins() const {
        for (int axis = 0; axis < given_->dim && given_->closed; ++axis)
            if (given_->positions[std::size_t(given_->pieces) * given_->dim + axis] != given_->positions[axis]) return false;
        return true;
    }

    [[nodiscard]] bool allocate() {
        const std::size_t dim = given_->dim, state = given_->slots() * dim, local = longest + 1;
        const std::size_t pieces = given_->pieces, all = pieces + repeated(), rows = longest * state + 2;
        return walls_.take(given_->walls, given_->pieces, repeated(), given_->dim) && positions_.allocate((all + 1) * dim) &&
               durations_.allocate(all) && states_.allocate((pieces + 1) * state) && kept_.allocate(pieces * most_contacts) &&
               kept_count_.allocate(pieces) && pinned_.allocate(local * state) && values_.allocate(local * state) &&
               points_.allocate(longest * 2 * given_->half * dim) && knots_.allocate(local * state) && wall_.allocate(rows) &&
               s_.allocate(rows) && multiplier_.allocate(rows) && direction_.allocate(rows * dim) &&
               known_.allocate(longest * most_contacts);
    }

    void unroll() {
        const int all = given_->pieces + repeated(), dim = given_->dim;
        for (int piece = 0; piece < all; ++piece) durations_[piece] = given_->durations[own(piece)];
        for (int knot = 0; knot <= all; ++knot)
            for (int axis = 0; axis < dim; ++axis)
                positions_[std::size_t(knot) * dim + axis] = given_->positions[std::size_t(own(knot)) * dim + axis];
    }

    // Solve pieces from begin up to end and ``margin`` more on each side; keep what is in between.
    Status window(int begin, int end) {
        const int shift = given_->closed && begin < margin ? given_->pieces : 0;
        begin += shift, end += shift;
        const int low = begin > margin ? begin - margin : 0, most = given_->pieces + repeated();
        return run(low, end + margin < most ? end + margin : most, begin, end, true);
    }

    // Solve tiles between every second cut, from the contacts known and between states held.
    Status tiles(int first) {
        Status status = Status::done;
        cost_ = 0.0;
        int begin = given_->closed ? cut(first) : 0;
        const int last = begin + given_->pieces;
        for (int i = begin == cut(first) ? first + 2 : first; begin < last && status == Status::done; i += 2) {
            const int end = cut(i) < last ? cut(i) : last, quarter = (end - begin) / 4;
            status = run(begin, end, is_end(begin) ? begin : begin + quarter, is_end(end) ? end : end - quarter, false);
            const std::size_t size = 2 * std::size_t(given_->half) * given_->dim;
            for (int piece = begin; piece < end; ++piece)
                std::memcpy(answer_->points + own(piece) * size, points_.data() + (piece - begin) * size, size * sizeof(double));
            begin = end;
        }
        return status;
    }

    // Solve pieces [low, high); keep states inside it, and contacts of the pieces [begin, end).
    Status run(int low, int high, int begin, int end, bool rough) {
        pin(low, high, !rough);
        Request part = {given_->half,
                        high - low,
                        given_->dim,
                        false,
                        given_->length,
                        given_->time,
                        positions_.data() + std::size_t(low) * given_->dim,
                        durations_.data() + low,
                        pinned_.data(),
                        values_.data(),
                        walls_.between(low, high),
                        accuracy_ * given_->gap};
        part.continuity = given_->continuity, part.effort = given_->effort, part.due = given_->due;
        Answer found = {points_.data(), knots_.data(), wall_.data(), s_.data(), multiplier_.data(), 0, 0, 0, 0, 0, direction_.data()};
        const int known = rough ? 0 : gather(low, high);
        Status status = exchange_.solve(part, found, rough ? Aim::near : Aim::proved, known_.data(), known);
        if (status != Status::done && known > 0) status = exchange_.solve(part, found);
        if (status != Status::done) return status;
        cost_ += found.cost;
        answer_->rounds += found.rounds, answer_->share = found.share;
        for (int piece = begin; piece < end; ++piece) kept_count_[own(piece)] = 0;
        for (std::int64_t row = 0; row < found.rows; ++row) keep(low, begin, end, row);
        const int first = rough && begin > low ? begin : low + 1, last = rough && end < high ? end : high - 1;
        for (int knot = first; knot <= last; ++knot) keep_state(knot, knot - low);
        return status;
    }

    // States at the ends of a stretch: given ones at the ends of the chain, else held, or at rest.
    void pin(int low, int high, bool held) {
        const std::size_t state = std::size_t(given_->slots()) * given_->dim;
        for (int knot = low; knot <= high; ++knot)
            for (std::size_t i = 0; i < state; ++i) {
                const std::size_t local = (knot - low) * state + i, global = own(knot) * state + i;
                const bool given = is_pinned(*given_, own(knot), int(i) / given_->dim, int(i) % given_->dim);
                const bool cut_off = (knot == low || knot == high) && !is_end(knot);
                pinned_[local] = cut_off || given;
                values_[local] = given_->values == nullptr ? 0.0 : given_->values[global];
                if (cut_off && !given) values_[local] = held ? states_[global] : 0.0;
            }
    }

    // Whether value i of a knot is the first one of a derivative; a last one may have two slots.
    bool starts_order(std::size_t i) const { return i > 0 && i % given_->dim == 0 && i / given_->dim < std::size_t(given_->half); }

    int gather(int low, int high) {
        int count = 0;
        for (int piece = low; piece < high; ++piece)
            for (int i = 0; i < kept_count_[own(piece)]; ++i) {
                const Kept &kept = kept_[std::size_t(own(piece)) * most_contacts + i];
                Contact &contact = known_[count++];
                contact = {int(walls_.first(piece) - walls_.first(low) + kept.wall), kept.s, kept.pressure, {}};
                for (int q = 0; q < max_dim; ++q) contact.direction[q] = kept.direction[q];
            }
        return count;
    }

    void keep(int low, int begin, int end, std::int64_t row) {
        const std::int64_t wall = walls_.first(low) + wall_[row];
        const int piece = int(walls_.piece(wall));
        if (piece < begin || piece >= end || kept_count_[own(piece)] == most_contacts) return;
        Kept &kept = kept_[std::size_t(own(piece)) * most_contacts + kept_count_[own(piece)]++];
        kept = {wall - walls_.first(piece), s_[row], multiplier_[row] / 2, {}};
        for (int q = 0; q < given_->dim; ++q) kept.direction[q] = direction_[row * given_->dim + q];
    }

    // Keep the state of a knot, in metres and seconds.
    void keep_state(int knot, int local) {
        const std::size_t dim = given_->dim, state = given_->slots() * dim;
        double unit = given_->length;
        for (std::size_t i = 0; i < state; ++i) {
            if (starts_order(i)) unit /= given_->time;
            states_[own(knot) * state + i] = knots_[local * state + i] * unit;
        }
    }

    // What the bound is computed from: the optimum of the whole chain without walls.
    //
    // Where no waypoint is fixed for long, that optimum is far away, and the least force that multipliers leave unbalanced
    // moves it further. But a knot is within some w of its nominal position, x^2 <= w^2 along each coordinate; so
    // J + sum p^2 (x^2 - w^2) is a lower bound of the cost J inside the walls too, and p holds that optimum. The sum of
    // p^2 w^2 is what this gives away.
    Status prepare_bound() {
        if (!chain_.allocate(given_->pieces, given_->dim, given_->closed, given_->smoothness())) return Status::no_memory;
        load_chain(*given_, chain_);
        if (!hold_knots()) return Status::no_memory;
        free_cost_ = -given_away_;
        for (int axis = 0; axis < given_->dim; ++axis) {
            if (!factors_[axis].allocate(chain_)) return Status::no_memory;
            const Status status = factors_[axis].factorise(chain_, &axis, 1, pull_.data() + std::size_t(axis) * given_->pieces);
            if (status != Status::done) return status;
            if (!force_[axis].allocate(factors_[axis].unknowns() + 1)) return Status::no_memory;
            free_cost_ += factors_[axis].rest();
            factors_[axis].optimum(0, force_[axis].data());
            factors_[axis].add(chain_, axis, force_[axis].data());
        }
        chain_.place();
        return Status::done;
    }

    // Choose p for every knot whose distance from its nominal position is bounded: all give away the same.
    bool hold_knots() {
        const int pieces = given_->pieces;
        const std::size_t count = std::size_t(given_->dim) * pieces;
        if (!pull_.allocate(count)) return false;
        int held = 0;
        for (int piece = 0; piece < pieces; ++piece) {
            const KnotBounds bounds(walls_.between(piece, piece + 1), &positions_[std::size_t(piece) * given_->dim], given_->dim);
            for (int axis = 0; axis < given_->dim; ++axis) {
                const double reach = chain_.is_free(piece, 0, axis) ? bounds.along(axis) / given_->length : 0.0;
                const bool bounded = reach > 0.0 && std::isfinite(reach);
                pull_[std::size_t(axis) * pieces + piece] = bounded ? 1.0 / reach : 0.0;
                held += bounded;
            }
        }
        given_away_ = held > 0 ? holding * given_->gap * cost_ : 0.0;
        for (std::size_t i = 0; i < count; ++i) pull_[i] *= std::sqrt(given_away_ / largest(held, 1));
        return true;
    }

    // The bound that the contacts kept prove, as in Exchange::dual_bound.
    bool close_enough() {
        double linear = 0.0;
        for (int axis = 0; axis < given_->dim; ++axis)
            for (int i = 0; i < factors_[axis].unknowns(); ++i) force_[axis][i] = 0.0;
        const GivenWalls all = walls_.between(0, given_->pieces);
        for (int piece = 0; piece < given_->pieces; ++piece)
            for (int i = 0; i < kept_count_[piece]; ++i) linear += press(all, piece, kept_[std::size_t(piece) * most_contacts + i]);
        double squares = 0.0;
        for (int axis = 0; axis < given_->dim; ++axis) {
            factors_[axis].forward_all(force_[axis].data());
            squares += dot(force_[axis].data(), force_[axis].data(), factors_[axis].unknowns());
        }
        answer_->cost = cost_, answer_->bound = free_cost_ - squares + 2.0 * linear;
        return std::fabs(answer_->cost - answer_->bound) <= given_->gap * cost_;
    }

    // Add the force of a contact; returns its pressure times the excess of the optimum without walls.
    double press(const GivenWalls &all, int piece, const Kept &kept) {
        Request whole = *given_;
        whole.walls = all;
        Wall<double> wall;
        Ball<double> ball;
        load_wall(whole, chain_, walls_.first(piece) + kept.wall, 0, wall, ball);
        const Plane<double> plane = wall.ball < 0 ? wall : tangent(wall, ball, given_->dim, kept.direction);
        const double pressure = wall.equality ? kept.direction[0] * kept.pressure : kept.pressure;
        double factors[max_points], points[max_points];
        row_factors(chain_.size, *chain_.tables, chain_.durations[plane.piece], plane.order, kept.s, factors);
        for (int axis = 0; axis < given_->dim; ++axis)
            if (plane.axes >> axis & 1U) factors_[axis].scatter(plane.piece, factors, pressure * plane.normal[axis], force_[axis].data());
        const int degree = along_normal(chain_, chain_.points.data(), plane, points);
        return pressure * (jet_at(points, degree, kept.s).value - plane.bound);
    }

    // States and contacts of the whole.
    Status finish() {
        const std::size_t dim = given_->dim, state = given_->slots() * dim;
        answer_->rows = 0;
        for (int piece = 0; piece < given_->pieces; ++piece)
            for (int i = 0; i < kept_count_[piece]; ++i) {
                const Kept &kept = kept_[std::size_t(piece) * most_contacts + i];
                if (answer_->rows == std::int64_t(given_->pieces * state)) return Status::bad_size;
                answer_->wall[answer_->rows] = walls_.source(walls_.first(piece) + kept.wall), answer_->s[answer_->rows] = kept.s;
                if (answer_->direction != nullptr)
                    std::memcpy(answer_->direction + answer_->rows * dim, kept.direction, dim * sizeof(double));
                answer_->multiplier[answer_->rows++] = 2.0 * kept.pressure;
            }
        double unit = given_->length;
        for (std::size_t i = 0; i < state; ++i) {
            if (starts_order(i)) unit /= given_->time;
            for (int knot = 0; knot <= given_->pieces; ++knot) {
                const bool fixed = is_pinned(*given_, own(knot), int(i / dim), int(i % dim));
                const std::size_t from = own(knot) * state + i;
                const double value = !fixed ? states_[from] : given_->values == nullptr ? 0.0 : given_->values[from];
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
    Buffer<double> force_[max_dim], pull_, positions_, durations_, states_, values_, points_, knots_, s_, multiplier_, direction_;
    Buffer<std::uint8_t> pinned_;
    Buffer<std::int64_t> wall_;
    Buffer<Kept> kept_;
    Buffer<int> kept_count_;
    Buffer<Contact> known_;
    double cost_ = 0.0, free_cost_ = 0.0, given_away_ = 0.0;
    double accuracy_ = 0.5;  // share of the gap that tiles may give away
    int stretches_ = 0;
};

}  // namespace minsnap

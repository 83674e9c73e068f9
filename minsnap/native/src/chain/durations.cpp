// Durations: the optimal cost and its exact gradient, and the split of a total time, or at a price of time, that costs
// least; without walls by one elimination an evaluation, with walls by the certified exchange.
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>

#include "arithmetic/elementary.hpp"
#include "chain/cost_slopes.hpp"
#include "basics/dispatch.hpp"
#include "basics/export.hpp"
#include "basics/for_all.hpp"
#include "arithmetic/quasi_newton.hpp"
#include "corridor/tube.hpp"
#include "chain/unconstrained.hpp"
#include "corridor/windows.hpp"

namespace minsnap {
namespace {

using Integer = std::int64_t;

constexpr Integer most_split_legs = Integer{1} << 20, most_split_pieces = 256;

// Derivatives 1 ... k - 1 at the ends of a leg along an axis, each `stride` apart, and its displacement.
struct AxisEnds {
    const double *start, *end;
    int stride;
    double step;
};

// Cost of all legs, and T dJ/dT of each, from ends(leg, axis): derivatives in `time`, or in the unit interval where that is 0.
// forces (legs, dim): dJ/dd for the displacements, or null.
template <int half, class Ends>
void sum_legs(Integer legs, int dim, const double *durations, double time, Ends &&ends, double &cost, double *slopes, double *forces) {
    const LegTables<double> &tables = leg_tables<double>(half);
    for (Integer leg = 0; leg < legs; ++leg) {
        double powers[half + 1];
        duration_powers<half>(time > 0.0 ? durations[leg] / time : durations[leg], powers);
        for (int a = 0; time == 0.0 && a < half; ++a) powers[a] = 1.0;
        LegSlopes found;
        for (int d = 0; d < dim; ++d) {
            const AxisEnds own = ends(leg, d);
            const double force = add_axis<half>(tables, powers, own.start, own.end, own.stride, own.step, found);
            if (forces) forces[leg * dim + d] = force;
        }
        cost += found.cost;
        slopes[leg] = found.time;
    }
}

// Optimal cost of a chain without walls, and its slopes.
class FreeCost {
public:
    FreeCost(const ChainProblem &chain, int half, bool closed) : chain_(chain), half_(half), closed_(closed) {
        // Stiffness that is lost at one place counts less among many legs.
        if (half > 2 && chain.legs > near_legs) multiple_ = exponential(logarithm(double(chain.legs) / near_legs) / (2 * half - 5));
    }

    // slopes (legs,): T dJ/dT of every leg; forces (legs, dim): dJ/dd for its displacement, or null.
    Status evaluate(const double *durations, double &cost, double *slopes, double *forces) {
        chain_.durations = durations;
        Spread spread;
        Status status = check_chain(chain_, half_, spread, multiple_);
        if (status != Status::done) return status;
        for (Integer leg = 0; leg < chain_.legs; ++leg) slopes[leg] = 0.0;
        cost = 0.0;
        status = for_half(half_, [&](auto k) { return run<k.value>(spread, cost, slopes, forces); });
        return status == Status::done && !std::isfinite(cost) ? Status::singular : status;
    }

private:
    template <int half>
    Status run(Spread spread, double &cost, double *slopes, double *forces) {
        if (closed_) return spread == Spread::wide ? Status::unsupported : lap<half>(cost, slopes, forces);
        if (spread == Spread::wide || half != 4) return from_states<half>(spread, cost, slopes, forces);
        return for_axes<4>(chain_.stride, [&](auto axes, int axis) { return open<4, axes.value>(axis, cost, slopes, forces); });
    }

    // Leg by leg while the elimination gives their states.
    template <int half, int axes>
    Status open(int axis, double &cost, double *slopes, double *forces) {
        using Chain = TwoWayChain<half, axes>;
        constexpr int n = half - 1;
        if (!room_.allocate(std::size_t(chain_.legs * Chain::width))) return Status::no_memory;
        const LegTables<double> &tables = leg_tables<double>(half);
        auto sink = [&](Integer leg, const double (&start)[n][axes], const double (&end)[n][axes]) {
            double powers[half + 1];
            duration_powers<half>(chain_.durations[leg], powers);
            LegSlopes found;
            const double *from = chain_.points + leg * chain_.stride + axis;
            for (int d = 0; d < axes; ++d) {
                const double step = from[chain_.stride + d] - from[d];
                const double force = add_axis<half>(tables, powers, &start[0][d], &end[0][d], axes, step, found);
                if (forces) forces[leg * chain_.stride + axis + d] = force;
            }
            cost += found.cost;
            slopes[leg] += found.time;
        };
        return Chain::solve(chain_, axis, {room_.data(), Chain::width}, sink);
    }

    // The same after the elimination, for rare degrees, and for durations too far apart for doubles.
    template <int half>
    Status from_states(Spread spread, double &cost, double *slopes, double *forces) {
        constexpr int n = half - 1;
        const int dim = chain_.stride;
        if (!room_.allocate(std::size_t(chain_.legs + 1) * n * dim)) return Status::no_memory;
        const Status status = solve_chain(chain_, half, spread, {nullptr, room_.data()});
        if (status != Status::done) return status;
        auto ends = [&](Integer leg, int d) {
            const double *start = room_.data() + leg * n * dim + d, *from = chain_.points + leg * dim + d;
            return AxisEnds{start, start + n * dim, dim, from[dim] - from[0]};
        };
        sum_legs<half>(chain_.legs, dim, chain_.durations, 1.0, ends, cost, slopes, forces);
        return Status::done;
    }

    // A lap gives control points; scaled end derivatives are their differences.
    template <int half>
    Status lap(double &cost, double *slopes, double *forces) {
        const int dim = chain_.stride;
        if (!room_.allocate(std::size_t(chain_.legs) * 2 * half * dim)) return Status::no_memory;
        const Status status = solve_closed(chain_, half, Spread::narrow, Output{room_.data(), nullptr});
        if (status != Status::done) return status;
        double start[half], end[half];
        auto ends = [&](Integer leg, int d) {
            const double *from = chain_.points + leg * dim + d;
            scaled_ends<half>(room_.data() + leg * 2 * half * dim + d, dim, start, end);
            return AxisEnds{start, end, 1, from[dim] - from[0]};
        };
        sum_legs<half>(chain_.legs, dim, chain_.durations, 0.0, ends, cost, slopes, forces);
        return Status::done;
    }

    // Derivatives 1 ... k - 1 at both ends of the unit interval.
    template <int half>
    static void scaled_ends(const double *points, int stride, double *start, double *end) {
        constexpr int degree = 2 * half - 1;
        double left[half], right[half], factor = 1.0;
        for (int j = 0; j < half; ++j) left[j] = points[j * stride], right[j] = points[(half + j) * stride];
        for (int a = 1; a < half; ++a) {
            for (int j = 0; j < half - a; ++j) left[j] = left[j + 1] - left[j], right[j] = right[j + 1] - right[j];
            factor *= degree - a + 1;
            start[a - 1] = factor * left[0];
            end[a - 1] = factor * right[half - 1 - a];
        }
    }

    ChainProblem chain_;
    int half_;
    bool closed_;
    double multiple_ = 1.0;  // of the ratio of durations that doubles resolve
    Buffer<double> room_;
};

// Optimal cost inside walls, in normalised units, and its slopes; every active row adds its multiplier times its own
// slope, at an instant that keeps its share of the piece.
class CorridorCost {
public:
    CorridorCost(const Request &given) : given_(given), windows_(given.half) {}

    [[nodiscard]] bool allocate() {
        const std::size_t pieces = std::size_t(given_.pieces), state = std::size_t(given_.half) * given_.dim;
        const std::size_t most = pieces * state + 2;
        return points_.allocate(pieces * 2 * state) && knots_.allocate((pieces + 1) * state) && wall_.allocate(most) && s_.allocate(most) &&
               multiplier_.allocate(most) && direction_.allocate(most * given_.dim) && known_.allocate(most);
    }

    // slopes (pieces,): T dJ/dT of every piece. The contacts of one evaluation are where the next one begins; work is counted.
    Status evaluate(const double *durations, double &cost, double *slopes, double &work) {
        given_.durations = durations;
        Answer answer = {points_.data(), knots_.data(), wall_.data(), s_.data(), multiplier_.data(), 0, 0, 0, 0, 0, direction_.data()};
        const Status status = solve(answer);
        work += answer.work;
        if (status != Status::done) return status;
        known_count_ = int(answer.rows);
        for (int k = 0; k < known_count_; ++k)
            known_[k] = contact(int(wall_[k]), s_[k], multiplier_[k], &direction_[k * given_.dim], given_.dim);
        return for_half(given_.half, [&](auto k) { return slope<k.value>(int(answer.rows), cost, slopes); });
    }

private:
    static constexpr int few = 48;

    // Windows are the quicker way where pieces and contacts are many.
    Status solve(Answer &answer) {
        const bool known = known_count_ > 0, many = !known || known_count_ > few || given_.pieces > most_again;
        if (given_.pieces > most_whole && many) {
            const Status windows = windows_.solve(given_, answer);
            if (windows == Status::done || given_.pieces > most_again) return windows;
        }
        const Status status = solver_.solve(given_, answer, Aim::measured, known_.data(), known_count_);
        return known && status != Status::done ? solver_.solve(given_, answer, Aim::measured) : status;
    }

    template <int half>
    Status slope(int rows, double &cost, double *slopes) {
        const LegTables<double> &tables = leg_tables<double>(half);
        const int dim = given_.dim;
        cost = 0.0;
        auto ends = [&](Integer piece, int d) {
            const double *start = &knots_[std::size_t(piece) * half * dim + d], *end = start + half * dim;
            const double *from = given_.positions + std::size_t(piece) * dim + d;
            return AxisEnds{start + dim, end + dim, dim, (from[dim] - from[0]) / given_.length + end[0] - start[0]};
        };
        sum_legs<half>(given_.pieces, dim, given_.durations, given_.time, ends, cost, slopes, nullptr);
        for (int k = 0; k < rows; ++k) add_row<half>(tables, k, slopes);
        return Status::done;
    }

    // With the derivatives at the knots held, entry a of order p's row grows as T^(a - p).
    template <int half>
    void add_row(const LegTables<double> &tables, int k, double *slopes) const {
        const GivenWalls &walls = given_.walls;
        const Integer wall = wall_[k], piece = walls.piece[wall];
        const int order = int(walls.order[wall]), dim = given_.dim;
        double factors[max_points], sum = 0.0;
        row_factors(Degree<half>(half), tables, given_.durations[piece] / given_.time, order, s_[k], factors);
        for (int d = 0; d < dim; ++d) {
            const double *start = &knots_[std::size_t(piece) * half * dim + d], *end = start + half * dim;
            const double *from = given_.positions + std::size_t(piece) * dim + d;
            double slope = -order * factors[half] * ((from[dim] - from[0]) / given_.length);
            for (int a = 0; a < half; ++a) { slope += (a - order) * (factors[a] * start[a * dim] + factors[half + a] * end[a * dim]); }
            sum += normal(k, d) * slope;
        }
        slopes[piece] += multiplier_[k] * sum;
    }

    // Of the plane that row k is.
    double normal(int k, int d) const {
        const GivenWalls &walls = given_.walls;
        const int dim = given_.dim;
        const double side = walls.is_equality(wall_[k]) ? direction_[k * dim] : 1.0;
        double sum = side * walls.normal[wall_[k] * dim + d];
        for (int q = 0; walls.is_ball(wall_[k]) && q < dim; ++q)
            sum += direction_[k * dim + q] * walls.matrix_of(wall_[k], dim)[q * dim + d];
        return sum;
    }

    Request given_;
    Windows windows_;
    ExchangeSolver solver_;
    Buffer<double> points_, knots_, s_, multiplier_, direction_;
    Buffer<Integer> wall_;
    Buffer<Contact> known_;
    int known_count_ = 0;
};

// Whether time is left for one more evaluation and for one like it after the search, judged by the longest so far, and work.
class TimeLeft {
public:
    explicit TimeLeft(double seconds) : seconds_(seconds) {}

    bool over(bool spent) {
        const double now = std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
        longest_ = now - last_ > longest_ ? now - last_ : longest_;
        last_ = now;
        return ended_ = ended_ || spent || now + 2.0 * longest_ > seconds_;
    }
    bool ended() const { return ended_; }

private:
    const double seconds_;
    const std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
    double last_ = 0.0, longest_ = 0.0;
    bool ended_ = false;
};

// A search for durations: from where, what the cost is worth, and what the caller gives and gets.
struct Split {
    const double *first;  // (legs,) [s]
    double unit;
    SplitRecord &record;
};

// Minimise the logarithm of cost + price * time over logarithms of factors on the first durations; at a fixed total the
// durations are the shares of it. evaluate(durations of pieces, cost, slopes) gives a status.
template <class Cost>
Status find_split(const Split &split, double gain, Cost &&evaluate) {
    SplitRecord &record = split.record;
    const Integer legs = record.legs, per_leg = record.per_leg, pieces = legs * per_leg;
    QuasiNewton search;
    Buffer<double> times, slopes;
    if (!search.allocate(int(legs)) || !times.allocate(std::size_t(pieces)) || !slopes.allocate(std::size_t(pieces))) {
        return Status::no_memory;
    }
    double total = 0.0, best = 0.0;
    Integer evaluations = 0;
    const bool priced = record.price > 0.0;
    Status last = Status::done;
    TimeLeft left(record.seconds);
    record.work = 0.0;
    for (Integer i = 0; i < legs; ++i) total += split.first[i];
    auto function = [&](const double *x, double *gradient, double &value) {
        double sum = 0.0, cost = 0.0, all = 0.0;
        for (Integer i = 0; i < legs; ++i) sum += gradient[i] = split.first[i] * exponential(x[i]);
        const double share = priced ? 1.0 : total / sum;
        for (Integer i = 0; i < legs; ++i) {
            gradient[i] *= share;
            for (Integer p = 0; p < per_leg; ++p) times[std::size_t(i * per_leg + p)] = gradient[i] / double(per_leg);
        }
        if (evaluations == record.capacity || (evaluations > 0 && left.over(record.work > record.effort))) return false;
        last = evaluate(times.data(), cost, slopes.data());
        if (last != Status::done || !(cost > 0.0)) return false;
        cost *= split.unit;
        const double time = sum * share, price = priced ? record.price : 0.0;
        const double worth = cost + price * time;
        if (evaluations == 0 || worth < best) {
            best = worth;
            for (Integer i = 0; i < legs; ++i) record.durations[i] = gradient[i];
        }
        record.history[2 * evaluations] = time;
        record.history[2 * evaluations++ + 1] = worth;
        for (Integer i = 0; i < pieces; ++i) all += slopes[std::size_t(i)];
        for (Integer i = 0; i < legs; ++i) {
            double slope = 0.0;
            for (Integer p = 0; p < per_leg; ++p) slope += slopes[std::size_t(i * per_leg + p)];
            const double own = priced ? price * gradient[i] : -split.unit * all * gradient[i] / time;
            gradient[i] = (split.unit * slope + own) / worth;
        }
        value = logarithm(worth);
        return true;
    };
    Stopping stopping;
    stopping.gain = gain;
    stopping.evaluations = int(record.capacity);
    const Status status = search.minimise(stopping, function);
    record.evaluations = evaluations;
    if (left.ended()) return Status::done;
    return status == Status::infeasible && last != Status::done ? last : status;
}

// The same for a request, whose durations are not read.
Status split_in_corridor(const Request &given, const double *first, SplitRecord &record) {
    CorridorCost corridor(given);
    if (!corridor.allocate()) return Status::no_memory;
    const double unit = given.length * given.length / power(given.time, 2 * given.half - 1);
    return find_split({first, unit, record}, given.gap, [&](const double *pieces, double &cost, double *slopes) {
        return corridor.evaluate(pieces, cost, slopes, record.work);
    });
}

bool well_sized(Integer half, Integer legs, Integer dim, Integer pins) {
    return half >= least_half && half <= most_half && legs >= 1 && legs <= most_split_legs && dim >= 1 && dim <= most_axes && pins >= 0 &&
           pins <= legs;
}

}  // namespace
}  // namespace minsnap

using namespace minsnap;

// Optimal costs of many chains without pins over threads, and their exact gradients: costs, slopes, displacements and statuses.
MINSNAP_EXPORT std::int32_t minsnap_many_gradients(const ManyRecord *many) {
    if (!many_fit(*many)) return int(Status::bad_size);
    for_all(many->count, 8, int(many->threads), many->statuses, [=](Integer b) {
        const ChainProblem chain = chain_of(*many, b);
        if (!well_sized(many->half, chain.legs, many->dim, 0)) return Status::bad_size;
        FreeCost free(chain, int(many->half), false);
        double *const slopes = many->slopes + many->offsets[b];
        const Status status = free.evaluate(chain.durations, many->costs[b], slopes, many->displacements + many->offsets[b] * many->dim);
        for (Integer leg = 0; status == Status::done && leg < chain.legs; ++leg) slopes[leg] /= chain.durations[leg];
        return status;
    });
    return int(Status::done);
}

// The split of least cost without walls, for the chain's durations to begin with.
MINSNAP_EXPORT std::int32_t minsnap_best_split(const ChainRecord *given, SplitRecord *found) {
    if (!well_sized(given->half, given->legs, given->dim, given->pins)) return int(Status::bad_size);
    if (found->legs != given->legs || found->per_leg != 1 || found->capacity < 1) return int(Status::bad_size);
    Pins pins;
    ChainProblem chain;
    const Status status = read_chain(*given, pins, chain);
    if (status != Status::done) return int(status);
    FreeCost free(chain, int(given->half), given->closed != 0);
    return int(find_split({given->durations, 1.0, *found}, 1e-10,
                          [&](const double *times, double &cost, double *slopes) { return free.evaluate(times, cost, slopes, nullptr); }));
}

// The same inside walls, solved for each evaluation, for the record's durations of legs to begin with, split equally over
// the pieces of each leg. The gap is the share of the cost that an evaluation may give away.
MINSNAP_EXPORT std::int32_t minsnap_best_corridor_split(const CorridorRecord *asked, SplitRecord *found) {
    const Integer legs = found->legs, per_leg = found->per_leg;
    if (asked->half < least_half || asked->half > most_half || asked->continuity >= asked->half) return int(Status::bad_size);
    if (legs < 1 || per_leg < 1 || found->capacity < 1) return int(Status::bad_size);
    if (per_leg > most_split_pieces || legs > most_split_pieces / per_leg) return int(Status::unsupported);
    const Integer pieces = legs * per_leg;
    if (!corridor_sizes_fit(asked->half, pieces, asked->dim, asked->groups)) return int(Status::bad_size);
    Buffer<double> times;
    if (!times.allocate(std::size_t(pieces))) return int(Status::no_memory);
    for (Integer i = 0; i < pieces; ++i) times[std::size_t(i)] = asked->durations[i / per_leg] / double(per_leg);
    FlatWalls walls;
    Request given = {};
    const Status taken = take_request(*asked, pieces, times.data(), walls, given);
    if (taken != Status::done) return int(taken);
    return int(split_in_corridor(given, asked->durations, *found));
}

// The same in a tube, whose walls are made here: points (legs + 1, dim); half-widths as in tube.cpp.
MINSNAP_EXPORT std::int32_t minsnap_best_tube_split(const double *points, const double *first, const double *widths, std::int32_t dim,
                                                    std::int32_t half, std::int32_t shared, double gap, SplitRecord *found) {
    if (found->capacity < 1 || found->legs > most_split_pieces || found->per_leg != 1) return int(Status::bad_size);
    TubeWalls walls;
    Request request = {};
    const Status status = request_tube({points, first, widths, found->legs, dim, half, shared != 0}, gap, walls, request);
    return int(status == Status::done ? split_in_corridor(request, first, *found) : status);
}

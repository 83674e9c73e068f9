// A plan from rest to rest in a tube around the legs, of one half-width or of one per leg: walls and units are made here,
// so that a caller has one call to make.
#include <cmath>
#include <cstdint>

#include "exchange_solver.hpp"
#include "export.hpp"
#include "for_all.hpp"
#include "unconstrained.hpp"

namespace minsnap {
namespace {

// What is given: points (legs + 1, dim) [m], durations (legs,) [s], half-widths [m], the first for all if they are shared.
struct TubeProblem {
    const double *points, *durations, *widths;
    std::int64_t legs;
    int dim, half;
    bool shared;

    double width(std::int64_t leg) const { return widths[shared ? 0 : leg]; }
};

// A row of the projection that is shorter than this is one of a leg along that axis.
constexpr double rounding = 1e-12;

class TubeWalls {
public:
    double length = 0.0, time = 0.0;  // mean length of a leg, geometric mean of the durations

    // Two walls for each leg and axis across it. A status other than done if a number is not finite or a leg has no length.
    Status make(const TubeProblem &given) {
        const std::size_t most = std::size_t(given.legs) * given.dim * 2 + 1;
        if (!piece_.allocate(most) || !order_.allocate(most) || !normal_.allocate(most * given.dim) ||
            !anchor_.allocate(most * given.dim) || !bound_.allocate(most))
            return Status::no_memory;
        double logarithms = 0.0;
        for (std::int64_t leg = 0; leg < given.legs; ++leg) {
            const double duration = given.durations[leg];
            if (!(duration > 0.0 && std::isfinite(duration) && given.width(leg) > 0.0)) return Status::bad_number;
            if (!around(given, leg)) return Status::bad_number;
            logarithms += std::log(duration);
        }
        length /= double(given.legs), time = std::exp(logarithms / double(given.legs));
        return Status::done;
    }

    GivenWalls walls() const {
        return {count_,         piece_.data(), order_.data(), normal_.data(), anchor_.data(),
                bound_.data(), bound_.data(), nullptr,       0};
    }

private:
    bool around(const TubeProblem &given, std::int64_t leg) {
        const double *from = given.points + leg * given.dim;
        double along[max_dim], square = 0.0;
        for (int axis = 0; axis < given.dim; ++axis) {
            along[axis] = from[given.dim + axis] - from[axis];
            square += along[axis] * along[axis];
        }
        const double size = std::sqrt(square);
        if (!(size > 0.0 && std::isfinite(size))) return false;
        length += size;
        for (int axis = 0; axis < given.dim; ++axis) along[axis] /= size;
        for (int axis = 0; axis < given.dim; ++axis) add_pair(given, leg, axis, along);
        return true;
    }

    // |e_axis . (I - u u') (r - r_leg)| <= width.
    void add_pair(const TubeProblem &given, std::int64_t leg, int axis, const double *along) {
        double row[max_dim], largest = 0.0;
        for (int other = 0; other < given.dim; ++other) {
            row[other] = (other == axis ? 1.0 : 0.0) - along[axis] * along[other];
            largest = std::fabs(row[other]) > largest ? std::fabs(row[other]) : largest;
        }
        if (largest <= rounding) return;
        for (int sign = 1; sign >= -1; sign -= 2, ++count_) {
            piece_[count_] = leg, order_[count_] = 0, bound_[count_] = given.width(leg);
            for (int other = 0; other < given.dim; ++other) {
                normal_[count_ * given.dim + other] = sign * row[other];
                anchor_[count_ * given.dim + other] = given.points[leg * given.dim + other];
            }
        }
    }

    std::int64_t count_ = 0;
    Buffer<std::int64_t> piece_, order_;
    Buffer<double> normal_, anchor_, bound_;
};

// What the answer holds besides the control points, which the caller does not ask for.
class Unasked {
public:
    [[nodiscard]] bool allocate(const TubeProblem &given) {
        const std::size_t state = std::size_t(given.half) * given.dim, most = given.legs * state + 2;
        return knots_.allocate((given.legs + 1) * state) && wall_.allocate(most) && s_.allocate(most) &&
               multiplier_.allocate(most);
    }

    Answer answer(double *points) {
        return {points, knots_.data(), wall_.data(), s_.data(), multiplier_.data(), 0.0, 0.0, 0.0, 0, 0};
    }

private:
    Buffer<double> knots_, s_, multiplier_;
    Buffer<std::int64_t> wall_;
};

// figures (4,): cost and lower bound [m^2/s^(2k-1)], contacts, rounds.
Status solve_tube(const TubeProblem &given, double gap, double *out, double *breaks, double *figures) {
    if (!corridor_sizes_fit(given.half, given.legs, given.dim, 2 * given.legs * given.dim)) return Status::bad_size;
    TubeWalls walls;
    Unasked unasked;
    Status status = walls.make(given);
    if (status == Status::done && !unasked.allocate(given)) status = Status::no_memory;
    if (status != Status::done) return status;
    const Request request = {given.half, int(given.legs), given.dim, false, walls.length, walls.time, given.points,
                             given.durations, nullptr, nullptr, walls.walls(), gap};
    status = check_request(request);
    if (status != Status::done) return status;
    Answer answer = unasked.answer(out);
    std::int64_t attempts = 0;
    status = solve_request(request, answer, attempts);
    if (status != Status::done) return status;
    write_breaks(given.durations, given.legs, breaks);
    const double unit = walls.length * walls.length * std::pow(walls.time, 1.0 - 2.0 * given.half);
    figures[0] = unit * answer.cost, figures[1] = unit * answer.bound;
    figures[2] = double(answer.rows), figures[3] = double(answer.rounds);
    return Status::done;
}

}  // namespace
}  // namespace minsnap

// The curve of least cost from rest to rest that stays inside the tube at every instant, which is proved. shared: one
// half-width for all legs. Out: control points (legs, 2k, dim) [m], instants of the knots (legs + 1,) [s], and figures.
MINSNAP_EXPORT std::int32_t minsnap_tube(const double *points, const double *durations, const double *widths,
                                         std::int64_t legs, std::int32_t dim, std::int32_t half, std::int32_t shared,
                                         double gap, double *out, double *breaks, double *figures) {
    using namespace minsnap;
    return std::int32_t(solve_tube({points, durations, widths, legs, dim, half, shared != 0}, gap, out, breaks, figures));
}

// Many of them over threads, each solved as if it were alone, one after the other in all arrays; a half-width for every
// leg. Out besides: figures (count, 4) and a status for each problem.
MINSNAP_EXPORT std::int32_t minsnap_many_tubes(const double *points, const double *durations, const double *widths,
                                               const std::int64_t *offsets, std::int64_t count, std::int32_t dim,
                                               std::int32_t half, double gap, std::int32_t threads, double *out,
                                               double *breaks, double *figures, std::int32_t *statuses) {
    using namespace minsnap;
    if (count < 0 || dim < 1 || half < 2 || !ascending(offsets, count)) return std::int32_t(Status::bad_size);
    for_all<8>(count, threads, statuses, [&](std::int64_t b) {
        const std::int64_t first = offsets[b];
        const TubeProblem given = {points + (first + b) * dim, durations + first, widths + first,
                                   offsets[b + 1] - first,     dim,               half,
                                   false};
        return solve_tube(given, gap, out + first * 2 * half * dim, breaks + first + b, figures + 4 * b);
    });
    return std::int32_t(Status::done);
}

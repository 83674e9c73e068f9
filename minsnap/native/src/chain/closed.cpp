// A closed lap is an open chain whose ends have the same, unknown state, the seam: the optimum for a seam at rest, plus
// the responses to a unit of each of its derivatives, in the shares at which the forces on both sides of it cancel.
#include "chain/unconstrained.hpp"

#include <cmath>

#include "basics/dispatch.hpp"
#include "corridor/exchange_solver.hpp"

namespace minsnap {
namespace {

constexpr double least_gap = 1e-10;  // share of the cost, of an optimum without walls

template <int half>
class Lap {
    static constexpr int n = half - 1;

public:
    explicit Lap(const ChainProblem &chain) : chain_(chain) {}

    Status solve(Output out) {
        const std::size_t knots = static_cast<std::size_t>(chain_.legs) + 1, dim = static_cast<std::size_t>(chain_.stride);
        if (!responses_.allocate(knots * n * n) || !states_.allocate(knots * n * dim)) return Status::no_memory;
        const Status status = respond();
        return status == Status::done ? close(out) : status;
    }

private:
    // Response a, as axis a of a chain that goes nowhere: derivative a + 1 is 1 at both ends.
    Status respond() {
        Buffer<double> nowhere, zeros;
        Buffer<Pin> pins;
        const std::size_t knots = static_cast<std::size_t>(chain_.legs) + 1;
        if (!nowhere.allocate(knots * n)) return Status::no_memory;
        for (std::size_t i = 0; i < knots * n; ++i) nowhere[i] = 0.0;
        double unit[n][n] = {};
        for (int a = 0; a < n; ++a) unit[a][a] = 1.0;
        ChainProblem still = chain_;
        if (!rest(still, pins, zeros)) return Status::no_memory;
        still.points = nowhere.data(), still.stride = n, still.start = still.end = &unit[0][0];
        const Status status = solve_chain(still, half, Spread::narrow, {nullptr, responses_.data()});
        return status == Status::done ? stiffen() : status;
    }

    // Factor the forces that the responses cause at the seam.
    Status stiffen() {
        double stiffness[n][n], least = 1.0, pull[n];
        for (int a = 0; a < n; ++a) {
            seam_pull([&](std::int64_t knot, int order) { return response(knot, order, a); }, 0.0, 0.0, pull);
            for (int b = 0; b < n; ++b) stiffness[b][a] = pull[b];
        }
        factor_.compute(stiffness, least);
        return least > 0.0 ? Status::done : Status::singular;
    }

    // The same pinned orders, all zero.
    bool rest(ChainProblem &still, Buffer<Pin> &pins, Buffer<double> &zeros) const {
        if (!pins.allocate(static_cast<std::size_t>(chain_.pin_count)) || !zeros.allocate(n * n)) return false;
        for (int i = 0; i < n * n; ++i) zeros[i] = 0.0;
        for (std::int64_t i = 0; i < chain_.pin_count; ++i) {
            Pin &pin = pins[static_cast<std::size_t>(i)];
            pin.mask = chain_.pins[i].mask, pin.values = zeros.data(), pin.stride = n;
        }
        still.pins = pins.data();
        return true;
    }

    double response(std::int64_t knot, int order, int which) const {
        return responses_[static_cast<std::size_t>((knot * n + order - 1) * n + which)];
    }

    // Half the gradient of the cost in the seam's derivatives, of the legs on both sides of it.
    template <class Value>
    void seam_pull(Value &&value, double first_step, double last_step, double (&pull)[n]) const {
        using Step = Elimination<half, 1, double>;
        const std::int64_t last = chain_.legs - 1;
        const typename Step::Powers head(1.0 / chain_.durations[0]), tail(1.0 / chain_.durations[last]);
        for (int a = 1; a < half; ++a) {
            double sum = sign_of(a) * Step::entry(tail, a, 0, false) * last_step - Step::entry(head, a, 0, false) * first_step;
            for (int b = 1; b < half; ++b) {
                sum += Step::entry(head, a, b, false) * value(0, b) + Step::entry(head, a, b, true) * value(1, b);
                sum += sign_of(a + b) * Step::entry(tail, a, b, false) * value(last + 1, b);
                sum += Step::entry(tail, b, a, true) * value(last, b);
            }
            pull[a - 1] = sum;
        }
    }

    Status close(Output out) {
        ChainProblem open = chain_;
        open.start = open.end = nullptr;
        const Status status = solve_chain(open, half, Spread::narrow, {nullptr, states_.data()});
        if (status != Status::done) return status;
        for (int axis = 0; axis < chain_.stride; ++axis) add_responses(axis);
        return for_axes<half>(chain_.stride, [&](auto axes, int axis) { return write<axes.value>(axis, out); });
    }

    template <int axes>
    Status write(int axis, Output out) const {
        LegWriter<half, axes> writer(chain_, axis, out);
        double left[n][axes], right[n][axes];
        for (std::int64_t leg = 0; leg < chain_.legs; ++leg) {
            for (int a = 0; a < n; ++a)
                for (int d = 0; d < axes; ++d) {
                    left[a][d] = state(leg, a + 1, axis + d);
                    right[a][d] = state(leg + 1, a + 1, axis + d);
                }
            writer(leg, left, right);
        }
        return writer.finite() ? Status::done : Status::singular;
    }

    double state(std::int64_t knot, int order, int axis) const {
        return states_[static_cast<std::size_t>((knot * n + order - 1) * chain_.stride + axis)];
    }

    void add_responses(int axis) {
        const std::int64_t last = chain_.legs - 1;
        const double *points = chain_.points + axis;
        const double first_step = points[chain_.stride] - points[0];
        const double last_step = points[(last + 1) * chain_.stride] - points[last * chain_.stride];
        double shares[n][1], pull[n];
        seam_pull([&](std::int64_t knot, int order) { return state(knot, order, axis); }, first_step, last_step, pull);
        for (int a = 0; a < n; ++a) shares[a][0] = -pull[a];
        factor_.solve(shares);
        for (std::int64_t knot = 0; knot <= chain_.legs; ++knot)
            for (int order = 1; order < half; ++order)
                for (int a = 0; a < n; ++a)
                    states_[static_cast<std::size_t>((knot * n + order - 1) * chain_.stride + axis)] +=
                        shares[a][0] * response(knot, order, a);
    }

    const ChainProblem &chain_;
    Buffer<double> responses_, states_;
    Factor<half - 1, double> factor_{};
};

// Durations too far apart for doubles: as a corridor without walls, in double-double arithmetic.
Status solve_wide(const ChainProblem &chain, int half, Output out) {
    const std::int64_t knots = chain.legs + 1, dim = chain.stride, state = half * dim;
    if (!corridor_sizes_fit(half, chain.legs, dim, 0)) return Status::unsupported;
    Buffer<std::uint8_t> pinned;
    Buffer<double> values, numbers;
    Buffer<std::int64_t> wall;
    const std::size_t rows = std::size_t(knots * state) + 2;
    if (!pinned.allocate(rows) || !values.allocate(rows) || !numbers.allocate(3 * rows) || !wall.allocate(rows)) return Status::no_memory;
    for (std::int64_t i = 0; i < knots * state; ++i) pinned[std::size_t(i)] = i % state < dim, values[std::size_t(i)] = 0.0;
    for (std::int64_t i = 0; i < chain.pin_count; ++i)
        for (int order = 1; order < half; ++order) {
            if (!(chain.pins[i].mask >> order & 1U)) continue;
            for (int axis = 0; axis < dim; ++axis) {
                const std::size_t at = std::size_t(chain.knots[i] * state + order * dim + axis);
                pinned[at] = 1, values[at] = chain.pins[i].values[(order - 1) * chain.pins[i].stride + axis];
            }
        }
    double time = 0.0, length = 0.0;
    for (std::int64_t leg = 0; leg < chain.legs; ++leg) time = std::fmax(time, chain.durations[leg]);
    for (std::int64_t i = 0; i < chain.legs * dim; ++i) length = std::fmax(length, std::fabs(chain.points[i + dim] - chain.points[i]));
    if (length == 0.0) length = 1.0;
    Request request = {};
    request.half = half, request.pieces = int(chain.legs), request.dim = int(dim), request.closed = true;
    request.length = length, request.time = time, request.gap = least_gap;
    request.positions = chain.points, request.durations = chain.durations;
    request.pinned = pinned.data(), request.values = values.data();
    double *const states = numbers.data(), *const s = states + rows, *const multiplier = s + rows;
    Answer answer = {out.points, states, wall.data(), s, multiplier, 0.0, 0.0, 0.0, 0, 0};
    const Status status = solve_extended(request, answer);
    for (std::int64_t knot = 0; knot < knots && status == Status::done; ++knot) {
        double unit = length;
        for (int order = 1; order < half; ++order)
            for (int axis = 0; axis < dim; ++axis) {
                if (axis == 0) unit /= time;
                out.states[(knot * (half - 1) + order - 1) * dim + axis] = unit * states[knot * state + order * dim + axis];
            }
    }
    return status;
}

}  // namespace

Status solve_closed(const ChainProblem &chain, int half, Spread spread, Output out) {
    if (spread == Spread::wide) return solve_wide(chain, half, out);
    return for_half(half, [&](auto k) {
        Lap<k.value> lap(chain);
        return lap.solve(out);
    });
}

}  // namespace minsnap

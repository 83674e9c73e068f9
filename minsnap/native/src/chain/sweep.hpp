// The optimum of a chain of legs without walls: states of all knots, leg by leg, to whoever wants them.
//
// A long chain is eliminated from both ends at once, in the two lanes of a vector, and joined at its middle.  Seen from
// the other end time runs backwards, so there derivatives of odd order and displacements have the opposite sign.
#pragma once

#include <cmath>
#include <cstdint>

#include "basics/border.hpp"
#include "basics/buffer.hpp"
#include "basics/status.hpp"
#include "arithmetic/tridiagonal.hpp"

namespace minsnap {

// What is known of a chain; arrays belong to the caller.
struct ChainProblem {
    const double *points = nullptr;     // (legs + 1, stride) [m]
    const double *durations = nullptr;  // (legs,) [s], positive
    std::int64_t legs = 0;
    int stride = 0;                       // coordinates of a point
    const double *start = nullptr;        // (k - 1, stride), derivatives at the start; null at rest
    const double *end = nullptr;          // the same at the end
    const Pin *pins = nullptr;            // at inner knots
    const std::int64_t *knots = nullptr;  // their knots, ascending
    std::int64_t pin_count = 0;
};

// The chain of one problem of many.
inline ChainProblem chain_of(const ManyRecord &many, std::int64_t b) {
    const std::int64_t first = many.offsets[b], state = b * (many.half - 1) * many.dim;
    ChainProblem chain;
    chain.points = many.points + (first + b) * many.dim, chain.durations = many.durations + first;
    chain.legs = many.offsets[b + 1] - first, chain.stride = int(many.dim);
    chain.start = many.starts ? many.starts + state : nullptr, chain.end = many.ends ? many.ends + state : nullptr;
    return chain;
}

// Where the records of eliminated knots are kept: record i at base + i * step, width doubles each.
struct RecordRoom {
    double *base = nullptr;
    std::int64_t step = 0;
};

// Walks along the pins of a chain, from its start or from its end.
class PinCursor {
public:
    PinCursor(const ChainProblem &chain, bool backwards)
        : chain_(chain), next_(backwards ? chain.pin_count - 1 : 0), backwards_(backwards) {}

    const Pin *at(std::int64_t knot) {
        if (next_ < 0 || next_ >= chain_.pin_count || chain_.knots[next_] != knot) return nullptr;
        const Pin *found = chain_.pins + next_;
        next_ += backwards_ ? -1 : 1;
        return found;
    }

private:
    const ChainProblem &chain_;
    std::int64_t next_;
    bool backwards_;
};

template <int half, int dim, class Real>
class OneWayChain {
    using Step = Elimination<half, dim, Real>;
    static constexpr int n = half - 1;

public:
    // Solve for the coordinates axis ... axis + dim - 1 and give sink(leg, state at its start, state at its end), last
    // leg first.
    template <class Sink>
    static Status solve(const ChainProblem &chain, int axis, Buffer<typename Step::Record> &records, Sink &&sink) {
        if (!records.allocate(static_cast<std::size_t>(chain.legs))) return Status::no_memory;
        const double sign[1] = {1.0};
        Real state[n][dim], next[n][dim], step[dim], smallest(1.0);
        typename Step::Front front;
        PinCursor cursor(chain, false);
        known(state, chain.start, chain.stride, axis);
        displacement(step, chain, 0, axis);
        Step::start(front, 1.0 / Real(chain.durations[0]), step, &state);
        for (std::int64_t leg = 1; leg < chain.legs; ++leg) {
            const Pin *const pins[1] = {cursor.at(leg)};
            displacement(step, chain, leg, axis);
            const Real rate = 1.0 / Real(chain.durations[leg]);
            if (pins[0] != nullptr)
                Step::advance_pinned(front, rate, step, pins, axis, sign, records[leg], smallest);
            else
                Step::advance(front, rate, step, records[leg], smallest);
        }
        if (!(to_double(smallest) > 0.0)) return Status::singular;
        known(next, chain.end, chain.stride, axis);
        double left[n][dim], right[n][dim];
        rounded(next, right);
        for (std::int64_t leg = chain.legs - 1; leg >= 0; --leg) {
            if (leg == 0)
                known(state, chain.start, chain.stride, axis);
            else
                Step::recover(records[leg], next, state);
            rounded(state, left);
            sink(leg, left, right);
            for (int a = 0; a < n; ++a)
                for (int d = 0; d < dim; ++d) next[a][d] = state[a][d], right[a][d] = left[a][d];
        }
        return Status::done;
    }

private:
    static void known(Real (&state)[n][dim], const double *values, int stride, int axis) {
        for (int a = 0; a < n; ++a)
            for (int d = 0; d < dim; ++d) state[a][d] = Real(values ? values[a * stride + axis + d] : 0.0);
    }

    static void displacement(Real (&step)[dim], const ChainProblem &chain, std::int64_t leg, int axis) {
        const double *from = chain.points + leg * chain.stride + axis, *to = from + chain.stride;
        for (int d = 0; d < dim; ++d) step[d] = Real(to[d]) - Real(from[d]);
    }

    static void rounded(const Real (&state)[n][dim], double (&values)[n][dim]) {
        for (int a = 0; a < n; ++a)
            for (int d = 0; d < dim; ++d) values[a][d] = to_double(state[a][d]);
    }
};

template <int half, int dim>
class TwoWayChain {
    using Step = Elimination<half, dim, Pair>;
    using Single = Elimination<half, dim, double>;
    static constexpr int n = half - 1;

public:
    static constexpr std::int64_t width = n * n + n * dim;  // doubles of a record

    // Solve for the coordinates axis ... axis + dim - 1 and give sink(leg, state at its start, state at its end), from
    // the middle outwards.  The record of a knot is overwritten by the sink of no leg before it is read, if it lies in
    // the place of the leg that the knot starts (left of the middle) or ends (right of it).
    template <class Sink>
    static Status solve(const ChainProblem &chain, int axis, RecordRoom room, Sink &&sink) {
        if (chain.legs == 1) return solve_leg(chain, axis, sink);
        const std::int64_t legs = chain.legs, middle = legs / 2, left = middle - 1, right = legs - 1 - middle;
        Pair smallest = filled<Pair>(1.0);
        typename Step::Front front;
        PinCursor rising(chain, false), falling(chain, true);
        begin(front, chain, axis);
        for (std::int64_t k = 1; k <= left; ++k) {
            const Pin *const pins[2] = {rising.at(k), falling.at(legs - k)};
            advance(front, chain, axis, k, k, pins, room, smallest);
        }
        if (right > left) advance_right(front, chain, axis, right, falling.at(legs - right), room, smallest);
        Pair state[n][dim];
        join(front, rising.at(middle), axis, state, smallest);
        if (!(smallest[0] > 0.0 && smallest[1] > 0.0)) return Status::singular;
        descend(chain, axis, room, state, sink);
        return Status::done;
    }

private:
    static constexpr double both[2] = {1.0, -1.0};

    // A single leg has nothing free.
    template <class Sink>
    static Status solve_leg(const ChainProblem &chain, int axis, Sink &&sink) {
        Pair ends[n][dim];
        double start[n][dim], end[n][dim];
        known(ends, chain, axis);
        for (int a = 0; a < n; ++a)
            for (int d = 0; d < dim; ++d) start[a][d] = ends[a][d][0], end[a][d] = sign_of(a + 1) * ends[a][d][1];
        sink(0, start, end);
        return Status::done;
    }

    // Displacement of leg `one` forwards and of leg `other` backwards.
    static MINSNAP_INLINE void displacement(Pair (&step)[dim], const ChainProblem &chain, std::int64_t one, std::int64_t other, int axis) {
        const double *a = chain.points + one * chain.stride + axis, *b = chain.points + other * chain.stride + axis;
        MINSNAP_UNROLL
        for (int d = 0; d < dim; ++d) step[d] = Pair{a[chain.stride + d], b[d]} - Pair{a[d], b[chain.stride + d]};
    }

    static void known(Pair (&state)[n][dim], const ChainProblem &chain, int axis) {
        for (int a = 0; a < n; ++a)
            for (int d = 0; d < dim; ++d) {
                const std::int64_t at = a * chain.stride + axis + d;
                state[a][d] = Pair{chain.start ? chain.start[at] : 0.0, chain.end ? sign_of(a + 1) * chain.end[at] : 0.0};
            }
    }

    static MINSNAP_INLINE void begin(typename Step::Front &front, const ChainProblem &chain, int axis) {
        Pair step[dim], state[n][dim];
        displacement(step, chain, 0, chain.legs - 1, axis);
        const bool resting = chain.start == nullptr && chain.end == nullptr;
        if (!resting) known(state, chain, axis);
        const Pair rate = 1.0 / Pair{chain.durations[0], chain.durations[chain.legs - 1]};
        Step::start(front, rate, step, resting ? nullptr : &state);
    }

    // Eliminate knot `one` from the start and knot `other` from the end.
    static MINSNAP_INLINE void advance(typename Step::Front &front, const ChainProblem &chain, int axis, std::int64_t one,
                                       std::int64_t other, const Pin *const (&pins)[2], RecordRoom room, Pair &smallest) {
        const std::int64_t mirrored = chain.legs - 1 - other;
        Pair step[dim];
        typename Step::Record record;
        displacement(step, chain, one, mirrored, axis);
        const Pair rate = 1.0 / Pair{chain.durations[one], chain.durations[mirrored]};
        if (pins[0] != nullptr || pins[1] != nullptr) {
            typename Step::Front kept = front;
            typename Step::Record fixed;
            Pair least = smallest;
            Step::advance_pinned(kept, rate, step, pins, axis, both, fixed, least);
            front = kept, record = fixed, smallest = least;
        } else {
            Step::advance(front, rate, step, record, smallest);
        }
        write(record, room.base + one * room.step, 0);
        write(record, room.base + mirrored * room.step, 1);
    }

    // The chain from the end has one knot more: its lane goes on alone, while the other repeats a step for nothing.
    static MINSNAP_APART void advance_right(typename Step::Front &front, const ChainProblem &chain, int axis, std::int64_t knot,
                                            const Pin *pin, RecordRoom room, Pair &smallest) {
        const typename Step::Front kept = front;
        const std::int64_t mirrored = chain.legs - 1 - knot;
        const Pin *const pins[2] = {nullptr, pin};
        Pair step[dim];
        typename Step::Record record;
        displacement(step, chain, mirrored, mirrored, axis);
        const Pair rate = 1.0 / filled<Pair>(chain.durations[mirrored]);
        Step::advance_pinned(front, rate, step, pins, axis, both, record, smallest);
        write(record, room.base + mirrored * room.step, 1);
        for (int a = 0; a < n; ++a) {
            for (int b = 0; b <= a; ++b) front.matrix[a][b][0] = kept.matrix[a][b][0];
            for (int d = 0; d < dim; ++d) front.right[a][d][0] = kept.right[a][d][0];
        }
    }

    // The state of the middle knot, seen from both ends.
    static MINSNAP_APART void join(const typename Step::Front &front, const Pin *pin, int axis, Pair (&state)[n][dim], Pair &smallest) {
        double matrix[n][n], right[n][dim], none[n][n] = {}, nowhere[n][dim] = {}, least = 1.0;
        for (int a = 0; a < n; ++a) {
            for (int b = 0; b <= a; ++b) matrix[a][b] = front.matrix[a][b][0] + sign_of(a + b) * front.matrix[a][b][1];
            for (int d = 0; d < dim; ++d) right[a][d] = front.right[a][d][0] + sign_of(a + 1) * front.right[a][d][1];
        }
        if (pin != nullptr) Single::fix(matrix, none, right, nowhere, *pin, 0, axis, 1.0);
        Factor<n, double> factor;
        factor.compute(matrix, least);
        factor.solve(right);
        smallest = lesser(filled<Pair>(least), smallest);
        for (int a = 0; a < n; ++a)
            for (int d = 0; d < dim; ++d) state[a][d] = Pair{right[a][d], sign_of(a + 1) * right[a][d]};
    }

    // From the middle knot outwards, both lanes together; the leg after the middle comes first where one end has more.
    template <class Sink>
    static MINSNAP_INLINE void descend(const ChainProblem &chain, int axis, RecordRoom room, Pair (&next)[n][dim], Sink &&sink) {
        const std::int64_t legs = chain.legs, middle = legs / 2;
        Pair state[n][dim], ends[n][dim];
        known(ends, chain, axis);
        if (legs - middle > middle) {
            read_and_recover(room.base + middle * room.step, room.base + middle * room.step, next, state);
            for (int a = 0; a < n; ++a)
                for (int d = 0; d < dim; ++d) state[a][d][0] = next[a][d][0];
            give(sink, 1, middle, state, next);
            copy(state, next);
        }
        for (std::int64_t leg = middle - 1; leg >= 0; --leg) {
            const std::int64_t mirrored = legs - 1 - leg;
            if (leg == 0)
                copy(ends, state);
            else
                read_and_recover(room.base + leg * room.step, room.base + mirrored * room.step, next, state);
            give(sink, 0, leg, state, next);
            give(sink, 1, mirrored, state, next);
            copy(state, next);
        }
    }

    template <class Sink>
    static MINSNAP_INLINE void give(Sink &&sink, int lane, std::int64_t leg, const Pair (&outer)[n][dim], const Pair (&inner)[n][dim]) {
        double one[n][dim], other[n][dim];
        MINSNAP_UNROLL
        for (int a = 0; a < n; ++a) {
            MINSNAP_UNROLL
            for (int d = 0; d < dim; ++d) {
                one[a][d] = lane ? sign_of(a + 1) * outer[a][d][1] : outer[a][d][0];
                other[a][d] = lane ? sign_of(a + 1) * inner[a][d][1] : inner[a][d][0];
            }
        }
        if (lane == 0)
            sink(leg, one, other);
        else
            sink(leg, other, one);
    }

    static MINSNAP_INLINE void copy(const Pair (&from)[n][dim], Pair (&to)[n][dim]) {
        MINSNAP_UNROLL
        for (int a = 0; a < n; ++a) {
            MINSNAP_UNROLL
            for (int d = 0; d < dim; ++d) to[a][d] = from[a][d];
        }
    }

    static MINSNAP_INLINE void write(const typename Step::Record &record, double *place, int lane) {
        MINSNAP_UNROLL
        for (int a = 0; a < n; ++a) {
            MINSNAP_UNROLL
            for (int b = 0; b < n; ++b) place[a * n + b] = record.gain[a][b][lane];
            MINSNAP_UNROLL
            for (int d = 0; d < dim; ++d) place[n * n + a * dim + d] = record.offset[a][d][lane];
        }
    }

    static MINSNAP_INLINE void read_and_recover(const double *one, const double *other, const Pair (&next)[n][dim], Pair (&state)[n][dim]) {
        typename Step::Record record;
        MINSNAP_UNROLL
        for (int a = 0; a < n; ++a) {
            MINSNAP_UNROLL
            for (int b = 0; b < n; ++b) record.gain[a][b] = Pair{one[a * n + b], other[a * n + b]};
            MINSNAP_UNROLL
            for (int d = 0; d < dim; ++d) {
                const int at = n * n + a * dim + d;
                record.offset[a][d] = Pair{one[at], other[at]};
            }
        }
        Step::recover(record, next, state);
    }
};

}  // namespace minsnap

// A chain of polynomial pieces: durations, nominal displacements, and the derivatives at its knots, pinned or free.
//
// Where derivative k - 1 is not continuous a knot has two values of it: one of the piece that ends there, one of the piece that
// starts. All in normalised units. Positions are deviations from nominal ones, so that nothing depends on the origin.
#pragma once

#include <cstdint>

#include "basics/buffer.hpp"
#include "polynomials/leg.hpp"

namespace minsnap {

template <class Real, int Half>
struct Chain {
    Degree<Half> size;
    int pieces = 0, dim = 0;
    int continuity = 0;  // derivatives continuous at the knots, at least k - 2
    bool closed = false;
    Buffer<Real> durations;       // (pieces,)
    Buffer<Real> steps;           // (pieces, dim): nominal displacement of each piece
    Buffer<Real> values;          // (pieces + 1, slots, dim): derivatives 0 ... k - 1 at each knot
    Buffer<std::uint8_t> pinned;  // (pieces + 1, slots, dim): which of them are given
    Buffer<Real> points;          // (pieces, dim, 2k): control points relative to the nominal start of each piece
    const LegTables<Real> *tables = nullptr;

    explicit Chain(int half) : size(half), tables(&leg_tables<Real>(half)) {}

    [[nodiscard]] bool allocate(int pieces_, int dim_, bool closed_, int continuity_) {
        pieces = pieces_, dim = dim_, closed = closed_, continuity = continuity_;
        const std::size_t count = pieces, state = slots() * std::size_t(dim);
        return durations.allocate(count) && steps.allocate(count * dim) && values.allocate((count + 1) * state) &&
               pinned.allocate((count + 1) * state) && points.allocate(count * dim * size.points());
    }

    bool splits() const { return continuity < size.half() - 1; }

    // Values at a knot, and which of them a derivative is for the piece that starts (0) or ends (1) there.
    int slots() const { return size.half() + splits(); }
    int slot(int order, int end) const { return order + (end == 0 && order == size.half() - 1 && splits()); }

    // The same with derivatives above k - 1 that are continuous.
    int state() const { return continuity < size.half() ? slots() : continuity + 1; }

    // The knot at the end of the last piece of a closed chain is the first one.
    int knot(int index) const { return closed && index == pieces ? 0 : index; }
    std::size_t at(int index, int slot, int axis) const { return (std::size_t(knot(index)) * slots() + slot) * dim + axis; }
    bool is_free(int index, int slot, int axis) const { return pinned[at(index, slot, axis)] == 0; }
    Real *points_of(int piece, int axis) { return &points[(std::size_t(piece) * dim + axis) * size.points()]; }
    const Real *points_of(int piece, int axis) const { return &points[(std::size_t(piece) * dim + axis) * size.points()]; }

    // Scaled end derivatives of a piece along an axis, the position relative to the nominal start.
    void ends_of(int piece, int axis, Real *ends) const {
        const int half = size.half();
        const Real *start = &values[at(piece, 0, axis)], *end = &values[at(piece + 1, 0, axis)];
        Real power = 1;
        for (int a = 0; a < half; ++a, power *= durations[piece]) {
            ends[a] = start[slot(a, 0) * dim] * power;
            ends[half + a] = end[a * dim] * power;
        }
        ends[half] += steps[std::size_t(piece) * dim + axis];
    }

    // Control points of all pieces from the values at the knots.
    void place() {
        Real ends[max_points];
        for (int piece = 0; piece < pieces; ++piece)
            for (int axis = 0; axis < dim; ++axis) {
                ends_of(piece, axis, ends);
                points_from_ends(size, *tables, ends, points_of(piece, axis));
            }
    }

    // The integral of the squared norm of the k-th derivative: a sum of squares, so that nothing cancels.
    Real cost() const {
        const int half = size.half();
        Real total = 0, ends[max_points];
        for (int piece = 0; piece < pieces; ++piece) {
            Real squares = 0, power = durations[piece];
            for (int axis = 0; axis < dim; ++axis) {
                ends_of(piece, axis, ends);
                ends[half] -= ends[0];
                for (int i = 0; i < half; ++i) {
                    Real sum = tables->root[i][half] * ends[half];
                    for (int j = 1; j < half; ++j) sum += tables->root[i][j] * ends[j] + tables->root[i][half + j] * ends[half + j];
                    squares += sum * sum;
                }
            }
            for (int q = 1; q < half; ++q) power *= durations[piece] * durations[piece];
            total += squares / power;
        }
        return total;
    }
};

}  // namespace minsnap

// A plan from rest to rest in a tube around the legs, of one half-width or of one per leg: walls and units are made here,
// so that a caller has one call to make; and many of them over threads.
#include "corridor/tube.hpp"

#include "basics/dispatch.hpp"
#include "basics/export.hpp"
#include "basics/for_all.hpp"
#include "chain/unconstrained.hpp"

// The curve of least cost from rest to rest that stays inside the tube at every instant, which is proved, in double
// precision: ``minsnap_corridor``, which the caller asks next, has more. shared: one
// half-width for all legs. Out: control points (legs, 2k, dim) [m], instants of the knots (legs + 1,) [s], and figures
// (4,): cost and lower bound [m^2/s^(2k-1)], contacts, rounds.
MINSNAP_EXPORT std::int32_t minsnap_tube(const double *points, const double *durations, const double *widths,
                                         std::int64_t legs, std::int32_t dim, std::int32_t half, std::int32_t shared,
                                         double gap, double *out, double *breaks, double *figures) {
    using namespace minsnap;
    const TubeProblem given = {points, durations, widths, legs, dim, half, shared != 0};
    TubeWalls walls;
    TubeAnswer found;
    const Status status = solve_tube(given, gap, false, out, walls, found);
    if (status != Status::done) return std::int32_t(status);
    write_breaks(durations, legs, breaks);
    const double unit = cost_unit(given, walls);
    figures[0] = unit * found.answer.cost, figures[1] = unit * found.answer.bound;
    figures[2] = double(found.answer.rows), figures[3] = double(found.answer.rounds);
    return std::int32_t(Status::done);
}

// The same for many problems over threads, arrays as in many.cpp; widths (legs in all,). figures (count, 4). Where ``gap``
// does not end with a proof, ``most_gap`` is given away. Unless slopes is null: derivatives of the cost in the durations
// (legs in all,), in the displacements of legs (legs in all, dim) and in the half-widths (legs in all,).
MINSNAP_EXPORT std::int32_t minsnap_many_tubes(const double *points, const double *durations, const double *widths,
                                               const std::int64_t *offsets, std::int64_t count, std::int32_t dim,
                                               std::int32_t half, double gap, double most_gap, std::int32_t threads, double *out,
                                               double *breaks, double *figures, double *slopes, double *displacements,
                                               double *width_slopes, std::int32_t *statuses) {
    using namespace minsnap;
    if (count < 0 || dim < 1 || half < least_half || half > most_half || !ascending(offsets, count))
        return std::int32_t(Status::bad_size);
    for_all(count, 8, threads, statuses, [&](std::int64_t b) {
        const std::int64_t first = offsets[b], legs = offsets[b + 1] - first;
        const TubeProblem given = {points + (first + b) * dim, durations + first, widths + first, legs, dim, half, false};
        Status status = Status::no_progress;
        for (double share = gap; status != Status::done; share = most_gap) {
            TubeWalls walls;
            TubeAnswer found;
            status = solve_tube(given, share, true, out + first * 2 * half * dim, walls, found);
            if (status != Status::done && share < most_gap) continue;
            if (status != Status::done) return status;
            write_breaks(given.durations, legs, breaks + first + b);
            const double unit = cost_unit(given, walls);
            const double told[] = {unit * found.answer.cost, unit * found.answer.bound, double(found.answer.rows),
                                   double(found.answer.rounds)};
            for (int i = 0; i < 4; ++i) figures[4 * b + i] = told[i];
            if (slopes == nullptr) break;
            status = for_half(half, [&](auto k) {
                TubeSlopes<k.value>(given, walls, found.answer)
                    .write(slopes + first, displacements + first * dim, width_slopes + first);
                return Status::done;
            });
        }
        return status;
    });
    return std::int32_t(Status::done);
}

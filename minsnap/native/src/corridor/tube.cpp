// A plan from rest to rest in a tube around the legs, of one half-width or of one per leg: walls and units are made here,
// so that a caller has one call to make; and many of them over threads.
#include "corridor/tube.hpp"

#include "basics/dispatch.hpp"
#include "basics/export.hpp"
#include "basics/for_all.hpp"
#include "chain/unconstrained.hpp"

namespace minsnap {
namespace {

// Cost and lower bound [m^2/s^(2k-1)], contacts, rounds.
void write_figures(const TubeProblem &given, const TubeWalls &walls, const TubeAnswer &found, double *figures) {
    const double unit = cost_unit(given, walls);
    figures[0] = unit * found.answer.cost, figures[1] = unit * found.answer.bound;
    figures[2] = double(found.answer.rows), figures[3] = double(found.answer.rounds);
}

}  // namespace
}  // namespace minsnap

// The curve of least cost from rest to rest that stays inside the tube at every instant, which is proved, in double
// precision: ``minsnap_corridor``, which the caller asks next, has more. shared: one
// half-width for all legs. Out: control points (legs, 2k, dim) [m], instants of the knots (legs + 1,) [s], and figures (4,).
MINSNAP_EXPORT std::int32_t minsnap_tube(const double *points, const double *durations, const double *widths, std::int64_t legs,
                                         std::int32_t dim, std::int32_t half, std::int32_t shared, double gap, double *out, double *breaks,
                                         double *figures) {
    using namespace minsnap;
    const TubeProblem given = {points, durations, widths, legs, dim, half, shared != 0};
    TubeWalls walls;
    TubeAnswer found;
    const Status status = solve_tube(given, gap, false, out, walls, found);
    if (status != Status::done) return std::int32_t(status);
    write_breaks(durations, legs, breaks);
    write_figures(given, walls, found, figures);
    return std::int32_t(Status::done);
}

// The same for many problems over threads: curves, breaks, figures and statuses, and unless slopes is null the derivatives.
MINSNAP_EXPORT std::int32_t minsnap_many_tubes(const minsnap::ManyRecord *many) {
    using namespace minsnap;
    const int dim = int(many->dim), half = int(many->half);
    if (!many_fit(*many) || half > most_half) return std::int32_t(Status::bad_size);
    for_all(many->count, 8, int(many->threads), many->statuses, [=](std::int64_t b) {
        const std::int64_t first = many->offsets[b], legs = many->offsets[b + 1] - first;
        const TubeProblem given = {many->points + (first + b) * dim, many->durations + first, many->widths + first, legs, dim, half, false};
        Status status = Status::no_progress;
        for (double share = many->gap; status != Status::done; share = many->most_gap) {
            TubeWalls walls;
            TubeAnswer found;
            status = solve_tube(given, share, true, many->curves + first * 2 * half * dim, walls, found);
            if (status != Status::done && share < many->most_gap) continue;
            if (status != Status::done) return status;
            write_breaks(given.durations, legs, many->breaks + first + b);
            write_figures(given, walls, found, many->figures + 4 * b);
            if (many->slopes == nullptr) break;
            status = for_half(half, [&](auto k) {
                TubeSlopes<k.value>(given, walls, found.answer)
                    .write(many->slopes + first, many->displacements + first * dim, many->width_slopes + first);
                return Status::done;
            });
        }
        return status;
    });
    return std::int32_t(Status::done);
}

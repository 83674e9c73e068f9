// Many plans, and their evaluation, over threads.  Every problem is solved as if it were alone, to the same bits.
//
// The arrays of all problems stand one after the other: problem b has the legs offsets[b] ... offsets[b + 1] - 1, and
// one knot more than legs.
#include <algorithm>
#include <cstdint>
#include <limits>

#include "polynomials/evaluate.hpp"
#include "basics/export.hpp"
#include "basics/for_all.hpp"
#include "basics/past_caches.hpp"
#include "chain/unconstrained.hpp"

namespace minsnap {
namespace {

constexpr std::int64_t small = 2048, large = 1 << 20;  // doubles: of a result kept in the first cache; of results beyond all

// How many problems a thread takes at once: of results beyond all caches those of nearly 2 MB, since two threads that write
// side by side would both ask the system for the same fresh page of 2 MB, and both would clear it. Whole pages would be
// worse: places a power of two apart lie in the same banks of the memory.
std::int64_t chunk_of(std::int64_t count, std::int64_t all, std::int32_t threads) {
    constexpr std::int64_t part = (15 << 17) / sizeof(double), least = 64;
    if (all < large) return least;
    return std::max(least, std::min(count * part / all, count / (4 * std::max(threads, 1))));
}

// The optimum of one problem of many, whose results are ``all`` doubles together.
Status solve_one(const ChainProblem &chain, int half, std::int64_t all, double *out) {
    Spread spread;
    const Status checked = check_chain(chain, half, spread);
    if (checked != Status::done) return checked;
    if (has_hold(chain)) return Status::unsupported;
    const std::int64_t count = chain.legs * 2 * half * chain.stride;
    const bool direct = all < large || count > small || reinterpret_cast<std::uintptr_t>(out) % 16 != 0;
    alignas(64) double room[small];
    double *const place = direct ? out : room;
    Status status = solve_chain(chain, half, spread, {place, nullptr});
    if (status == Status::done) status = looked_at(chain, half, place);
    if (status == Status::done && !direct) copy_past_caches(room, out, count);
    return status;
}

}  // namespace
}  // namespace minsnap

// Plans without walls, between states or at rest: curves, breaks and statuses.
MINSNAP_EXPORT std::int32_t minsnap_many(const minsnap::ManyRecord *many) {
    using namespace minsnap;
    if (!many_fit(*many)) return static_cast<std::int32_t>(Status::bad_size);
    const int threads = int(many->threads);
    const std::int64_t size = 2 * many->half * many->dim, all = many->offsets[many->count] * size;
    for_all(
        many->count, chunk_of(many->count, all, threads), threads, many->statuses,
        [=](std::int64_t b) {
            const ChainProblem chain = chain_of(*many, b);
            const std::int64_t first = many->offsets[b];
            const Status status = solve_one(chain, int(many->half), all, many->curves + first * size);
            if (status == Status::done) write_breaks(chain.durations, chain.legs, many->breaks + first + b);
            return status;
        },
        settle_copies);
    return static_cast<std::int32_t>(Status::done);
}

// Derivative of an order of many curves of one degree, each at `instants` instants: (count, instants, dim).  The
// instants are (count, instants), or (instants,) for all if they are shared.  Where a curve is missing (present is 0) or
// asked outside its interval the values are not numbers.
MINSNAP_EXPORT std::int32_t minsnap_evaluate_many(const minsnap::ValuesRecord *asked) {
    using namespace minsnap;
    const ValuesRecord &given = *asked;
    if (given.count < 0 || given.dim < 1 || given.degree < 0 || given.instants < 0 || given.order < 0 || given.order > given.degree ||
        !ascending(given.offsets, given.count))
        return static_cast<std::int32_t>(Status::bad_size);
    for_all(given.count, 64, int(given.threads), given.statuses, [&](std::int64_t b) {
        const std::int64_t first = given.offsets[b], size = given.instants * given.dim;
        const PiecewiseCurve curve = {given.points + first * (given.degree + 1) * given.dim,
                                      given.durations + first,
                                      given.breaks + first + b,
                                      given.offsets[b + 1] - first,
                                      int(given.degree),
                                      int(given.dim)};
        double *place = given.values + b * size;
        const double *t = given.shared ? given.t : given.t + b * given.instants;
        const Status status = given.present[b] ? evaluate_curve(curve, int(given.order), t, given.instants, place) : Status::done;
        if (!given.present[b] || status != Status::done) std::fill(place, place + size, std::numeric_limits<double>::quiet_NaN());
        return status;
    });
    return static_cast<std::int32_t>(Status::done);
}

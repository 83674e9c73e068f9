// Least clearance of every vehicle of a fleet from the nearest of several obstacles.
#include <new>

#include "basics/buffer.hpp"
#include "basics/export.hpp"
#include "basics/status.hpp"
#include "basics/threads.hpp"
#include "fleet/questions.hpp"

namespace minsnap {
namespace {

Clearance clearance_of(const ClearanceQuestion &q, Integer vehicle, ClearanceSearch &search, Curve &arc) {
    const double *t = clock_of(q.fleet, vehicle);
    Clearance best{__builtin_huge_val(), __builtin_huge_val(), 0.0, -1};
    for (Integer i = 0; i < q.fleet.pieces[vehicle]; ++i) {
        part_of(q.fleet, vehicle, i, t[i], t[i + 1], arc);
        for (Integer k = 0; k < q.obstacles; ++k) search.lower(arc, t[i], t[i + 1], q.obstacle[k], k, q.finest, best);
    }
    return best;
}

}  // namespace
}  // namespace minsnap

using namespace minsnap;

MINSNAP_EXPORT std::int32_t minsnap_fleet_clearance(const ClearanceQuestion *question) {
    const ClearanceQuestion &q = *question;
    if (q.fleet.vehicles < 1 || q.obstacles < 1 || q.threads < 1) return int(Status::bad_size);
    if (!sound(q.fleet) || !(q.finest > 0.0)) return int(Status::bad_number);
    std::atomic<bool> failed{false};
    auto task = [&q, &failed](Integer vehicle) {
        Buffer<ClearanceSearch> search;
        Buffer<Curve> arc;
        if (!search.allocate(1) || !arc.allocate(1)) {
            failed = true;
            return;
        }
        const Clearance found = clearance_of(q, vehicle, *new (search.data()) ClearanceSearch, arc[0]);
        q.values[3 * vehicle] = found.least;
        q.values[3 * vehicle + 1] = found.attained;
        q.values[3 * vehicle + 2] = found.instant;
        q.nearest[vehicle] = found.obstacle;
    };
    Chunks<decltype(task)>(q.fleet.vehicles, task).run(int(q.threads));
    return int(failed ? Status::no_memory : Status::done);
}

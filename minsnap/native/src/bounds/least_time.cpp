// Bounds of the flight time of all curves: the entry point of the search for a costate.
#include <cmath>
#include <cstdint>

#include "basics/export.hpp"
#include "basics/status.hpp"
#include "bounds/costate.hpp"

namespace minsnap {
namespace {

bool fits(const CostateSearch &asked) {
    constexpr std::int64_t most = std::int64_t(1) << 20;
    return asked.legs >= 1 && asked.legs <= most && asked.cells >= 1 && asked.fine >= asked.cells && asked.fine <= Layout::most_cells &&
           asked.parts >= 1 && asked.parts <= Layout::most_cells && asked.accelerations >= 1 && asked.velocities >= 1 &&
           asked.accelerations <= CostateSettings::sets && asked.velocities <= CostateSettings::sets &&
           asked.legs * asked.fine * asked.parts <= most && (!asked.closed || asked.legs >= 2);
}

bool finite(const double *values, std::int64_t count) {
    for (std::int64_t i = 0; i < count; ++i)
        if (!std::isfinite(values[i])) return false;
    return true;
}

}  // namespace
}  // namespace minsnap

// Find the costate: see CostateSearch.
MINSNAP_EXPORT std::int32_t minsnap_costate(minsnap::CostateSearch *asked) {
    using namespace minsnap;
    if (!fits(*asked)) return std::int32_t(Status::bad_size);
    const std::int64_t legs = asked->legs;
    const bool sound = finite(asked->sets, 12 * (asked->accelerations + asked->velocities)) && finite(asked->steps, 3 * legs) &&
                       finite(asked->rounds, 9 * (legs + 1)) && finite(asked->sides, 9 * (legs + 1)) && finite(asked->times, legs) &&
                       finite(asked->ends, 6);
    if (!sound) return std::int32_t(Status::bad_number);
    return std::int32_t(Costate(*asked).find());
}

// Entry points of the search for the shortest time.
#include "shortest_time/instant_limits.hpp"
#include "shortest_time/instants.hpp"
#include "shortest_time/searches.hpp"

#include <algorithm>

#include "basics/export.hpp"

namespace minsnap {
namespace {

constexpr std::int64_t most_pieces = 100'000, most_rows = 20'000'000;

Status checked(const ShortestRequest &request) {
    if (request.half < 2 || request.half > 6 || request.dim < 1 || request.dim > 5) return Status::unsupported;
    if (request.room < 1 || request.poll == nullptr) return Status::bad_size;
    if (request.planned != 0 && (request.guessed < 1 || request.divisions > 0 || request.closed != 0)) return Status::bad_size;
    if (request.rule < 0 || request.rule > 2 || (request.rule != 0 && request.ruled == nullptr)) return Status::bad_size;
    if (request.legs < (request.closed != 0 ? 2 : 1) || request.groups < 0 || request.divisions < 0) return Status::bad_size;
    std::int64_t pieces = request.legs * (request.guessed > 0 ? request.guessed : 1), rows = 0;
    for (std::int64_t k = 0; k < request.divisions; ++k) {
        if (request.parts[k] < 1 || request.parts[k] > most_pieces) return Status::bad_size;
        pieces *= request.parts[k];
        if (pieces > most_pieces) return Status::bad_size;
    }
    for (std::int64_t k = 0; k < request.groups; ++k) {
        const WallsRecord &group = request.cones[k];
        if (group.order < 0 || group.order >= condition_orders || group.count < 0 || group.rows < 0) return Status::unsupported;
        if (group.at_knots != 0 && group.order >= request.half) return Status::unsupported;
        rows += group.count;
        for (std::int64_t row = 0; row < group.count; ++row)
            if (group.leg[row] < 0 || group.leg[row] >= request.legs + (group.at_knots != 0 ? 1 : 0)) return Status::bad_size;
    }
    for (std::int64_t k = 0; k < request.limits; ++k) {
        if (!InstantLimit::known(request.momentary[k], request.dim)) return Status::unsupported;
        if (InstantLimit(request.momentary[k]).headed() && request.angles == nullptr && request.rule == 0 &&
            (request.turns < 1 || request.turning == nullptr))
            return Status::bad_size;
        rows += InstantLimit::most_functions * request.legs;
    }
    if (rows * (pieces / request.legs) * ShortestSettings::more_instants > most_rows) return Status::bad_size;
    return Status::done;
}

}  // namespace
}  // namespace minsnap

// Search for the shortest time.
MINSNAP_EXPORT std::int32_t minsnap_shortest_time(const minsnap::ShortestRequest *request, minsnap::ShortestAnswer *answer) {
    using minsnap::Status;
    const Status status = minsnap::checked(*request);
    if (status != Status::done) return static_cast<std::int32_t>(status);
    const bool usual = request->half == 4 && request->dim <= 3;
    const auto search = usual ? minsnap::search_usual : request->dim == 5 ? minsnap::search_many : minsnap::search_other;
    return static_cast<std::int32_t>(search(*request, *answer));
}

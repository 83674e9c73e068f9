// The search for the shortest time with other degrees in space, and with degree 7 in four coordinates.
#include "shortest_time/searches.hpp"
#include "shortest_time/shortest_time.hpp"

namespace minsnap {

Status search_other(const ShortestRequest &request, ShortestAnswer &answer) {
    constexpr int count = ShortestSettings::other_instants;
    if (request.half == 4 && request.dim == 4) return search<4, 4, count>(request, answer);
    if (request.dim != 3) return Status::unsupported;
    switch (request.half) {
        case 2: return search<2, 3, count>(request, answer);
        case 3: return search<3, 3, count>(request, answer);
        case 5: return search<5, 3, count>(request, answer);
        case 6: return search<6, 3, count>(request, answer);
        default: return Status::unsupported;
    }
}

}  // namespace minsnap

// The search for the shortest time with degree 7 along a line, in the plane and in space.
#include "shortest_time/searches.hpp"
#include "shortest_time/shortest_time.hpp"

namespace minsnap {

Status search_usual(const ShortestRequest &request, ShortestAnswer &answer) {
    constexpr int few = ShortestSettings::instants, many = ShortestSettings::more_instants;
    const bool whole = request.divisions == 0 && request.guessed < 2;
    if (request.dim == 1) return search<4, 1, few>(request, answer);
    if (request.dim == 2) return whole ? search<4, 2, many>(request, answer) : search<4, 2, few>(request, answer);
    return whole ? search<4, 3, many>(request, answer) : search<4, 3, few>(request, answer);
}

}  // namespace minsnap

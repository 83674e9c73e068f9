// The search for the shortest time in five coordinates, and in four but with degree 7.
#include "shortest_time/searches.hpp"
#include "shortest_time/shortest_time.hpp"

namespace minsnap {

Status search_many(const ShortestRequest &request, ShortestAnswer &answer) {
    constexpr int count = ShortestSettings::other_instants;
    switch (request.half) {
        case 2: return search<2, 5, count>(request, answer);
        case 3: return search<3, 5, count>(request, answer);
        case 4: return search<4, 5, count>(request, answer);
        case 5: return search<5, 5, count>(request, answer);
        default: return search<6, 5, count>(request, answer);
    }
}

}  // namespace minsnap

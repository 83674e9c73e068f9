// The search for the shortest time for every degree and number of coordinates, compiled apart.
#pragma once

#include "basics/status.hpp"
#include "shortest_time/border.hpp"

namespace minsnap {

Status search_usual(const ShortestRequest &request, ShortestAnswer &answer);  // degree 7 in up to three coordinates
Status search_other(const ShortestRequest &request, ShortestAnswer &answer);  // in space, or degree 7 in four coordinates
Status search_many(const ShortestRequest &request, ShortestAnswer &answer);   // in five coordinates

}  // namespace minsnap

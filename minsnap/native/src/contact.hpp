// What a corridor's optimum is known by besides its curve.
#pragma once

namespace minsnap {

// A place where a curve touches a wall, and by how much half the cost falls for each unit by which the bound grows.
struct Contact {
    int wall;
    double s, pressure;
};

}  // namespace minsnap

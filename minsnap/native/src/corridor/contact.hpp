// What a corridor's optimum is known by besides its curve.
#pragma once

#include "polynomials/bernstein.hpp"

namespace minsnap {

// A place where a curve touches a wall, by how much half the cost falls for each unit by which the bound grows, and, of a
// ball, the direction of its tangent plane.
struct Contact {
    int wall;
    double s, pressure, direction[max_dim];
};

// From a multiplier as answers have it, and a direction (dim,).
inline Contact contact(int wall, double s, double multiplier, const double *direction, int dim) {
    Contact made = {wall, s, multiplier / 2.0, {}};
    for (int q = 0; q < dim; ++q) made.direction[q] = direction[q];
    return made;
}

}  // namespace minsnap

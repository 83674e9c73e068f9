// What Python asks about ways through maps, and where answers are written.
#pragma once

#include "fleet/obstacles.hpp"

namespace minsnap {

// Convex sets around the segments of a line of points, bounded by planes that touch what is near.
MINSNAP_RECORD(TangentQuestion, {
    Integer dim, segments, obstacles, points, capacity, threads;
    double clearance;    // between the sets and all obstacles and points [m]
    double reach;        // how far a set extends beyond its segment, and to its sides [m]
    const double *path;  // (segments + 1, 3) [m]; in the plane the height is 0
    const Obstacle *obstacle;
    const double *point;  // (points, 3) [m]
    double *planes;       // (segments, capacity, 4): a unit normal and the bound that its product with positions has [m]
    Integer *counts;      // (segments,) planes, perhaps more than fit
    Integer *nearest;     // (segments,) the nearest obstacle, or point counted on behind them; -1 where none is in reach
    double *distance;     // (segments,) from the segment [m]
});

// A way through the free cells of a grid whose lines have any angle.
MINSNAP_RECORD(GridWayQuestion, {
    Integer dim, capacity;
    const Integer *shape;  // (3,) cells along each axis; 1 for the height in the plane
    const double *size;    // (3,) sides of a cell [m]
    const std::uint8_t *free;
    const Integer *start, *goal;  // (3,) cells
    Integer *way;                 // (capacity, 3) cells from start to goal
    Integer *found;               // as many there are, perhaps more than fit; 0 where there is no way
});

// What a sensor sees from one place, marked in a block of cells.
MINSNAP_RECORD(SightQuestion, {
    Integer dim, points, rays;
    double size;           // side of a cell [m]
    const Integer *first;  // (dim,) the first cell of the block
    const Integer *shape;  // (dim,) cells along each axis
    const double *place;   // (dim,) of the sensor [m]
    const double *point;   // (points, dim) on obstacles [m]
    const double *end;     // (rays, dim) of lines on which nothing is [m]
    std::uint8_t *states;  // of each cell: 0 unknown, 1 free, 2 occupied
    std::uint8_t *spans;   // (cells, 2, dim) where points were seen in a cell, in parts of its side
});

}  // namespace minsnap

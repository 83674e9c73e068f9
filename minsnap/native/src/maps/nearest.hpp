// Distance between a segment and a convex obstacle, and the plane that touches the obstacle on the segment's side.
//
// An obstacle is taken as a product: a ball in scaled coordinates over the axes that have a scale, an interval over each other axis. The distance from the
// points of a segment is convex along it, and the derivative of its square is twice the product of the way from the nearest point with the segment.
#pragma once

#include "fleet/obstacles.hpp"

namespace minsnap {

struct NearestSettings {
    int halvings = 50;        // of a segment, until the place of the least distance is known
    int newton = 60;          // steps to the nearest point of an ellipsoid: from below they rise to it without a jump
    double settled = 1e-14;   // change of such a step, relative, that ends them
    double rounding = 1e-14;  // by which a bound is moved towards the obstacle, relative to its terms
};

inline constexpr NearestSettings nearest_settings;

inline bool is_round(const Obstacle &obstacle, int axis) { return obstacle.radius >= 0.0 && obstacle.scale[axis] > 0.0; }

// The point of an obstacle that is nearest to a position; the same where the position is inside.
inline void nearest_point(const Obstacle &obstacle, const double *position, double *nearest) {
    double square = 0.0, away[fleet_axes];
    for (int d = 0; d < fleet_axes; ++d) {
        away[d] = position[d] - obstacle.center[d];
        const double scaled = obstacle.scale[d] * away[d];
        if (is_round(obstacle, d)) square += scaled * scaled;
        nearest[d] = is_round(obstacle, d) ? position[d] : std::fmin(std::fmax(position[d], obstacle.low[d]), obstacle.high[d]);
    }
    const double radius = obstacle.radius;
    if (radius < 0.0 || square <= radius * radius) return;
    double lambda = 0.0;  // of the nearest point away / (1 + lambda scale^2), whose scaled norm is the radius
    for (int step = 0; step < nearest_settings.newton; ++step) {
        double norm = 0.0, slope = 0.0;
        for (int d = 0; d < fleet_axes; ++d) {
            if (!is_round(obstacle, d)) continue;
            const double weight = obstacle.scale[d] * obstacle.scale[d], shrunk = 1.0 / (1.0 + lambda * weight);
            const double part = obstacle.scale[d] * away[d] * shrunk;
            norm += part * part;
            slope += part * part * weight * shrunk;
        }
        // Newton's step on 1 / norm, which is nearly linear in lambda.
        const double root = std::sqrt(norm), change = norm * (root / radius - 1.0) / slope;
        lambda += change;
        if (!(change > nearest_settings.settled * lambda)) break;
    }
    for (int d = 0; d < fleet_axes; ++d)
        if (is_round(obstacle, d)) nearest[d] = obstacle.center[d] + away[d] / (1.0 + lambda * obstacle.scale[d] * obstacle.scale[d]);
}

// Place on a segment, from 0 to 1, that is nearest to an obstacle, and the way from there to it; return the distance.
inline double nearest_on_segment(const Obstacle &obstacle, const double *from, const double *to, double *way) {
    double position[fleet_axes], point[fleet_axes];
    auto slope = [&](double s) {
        double sum = 0.0;
        for (int d = 0; d < fleet_axes; ++d) position[d] = from[d] + s * (to[d] - from[d]);
        nearest_point(obstacle, position, point);
        for (int d = 0; d < fleet_axes; ++d) {
            way[d] = point[d] - position[d];
            sum -= way[d] * (to[d] - from[d]);
        }
        return sum;
    };
    if (slope(0.0) < 0.0 && slope(1.0) > 0.0) {
        double low = 0.0, high = 1.0;
        for (int i = 0; i < nearest_settings.halvings; ++i) {
            const double middle = 0.5 * (low + high), rise = slope(middle);
            if (rise == 0.0) break;
            (rise < 0.0 ? low : high) = middle;
        }
    }  // else the last slope is that of the nearer end
    return std::sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
}

// The least product of a normal with points of an obstacle, never more than it is.
inline double least_product(const Obstacle &obstacle, const double *normal) {
    double sum = 0.0, size = 0.0, spread = 0.0;
    for (int d = 0; d < fleet_axes; ++d) {
        if (normal[d] == 0.0) continue;
        const bool round = is_round(obstacle, d);
        const double part = normal[d] * (round ? obstacle.center[d] : normal[d] > 0.0 ? obstacle.low[d] : obstacle.high[d]);
        const double share = round ? normal[d] / obstacle.scale[d] : 0.0;
        sum += part;
        size += std::fabs(part);
        spread += share * share;
    }
    if (obstacle.radius >= 0.0) {
        const double part = obstacle.radius * std::sqrt(spread);
        sum -= part;
        size += part;
    }
    return sum - nearest_settings.rounding * size;
}

}  // namespace minsnap

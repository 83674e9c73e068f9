// Control points of velocity to snap on a piece, all of the degree of the velocity, as bounds on parts take them.
#pragma once

#include <algorithm>

namespace minsnap {

constexpr int most_motion_points = 64;

// From control points (degree + 1, 3) of a piece that takes so long to (4, 3, degree).
inline void motion_points(const double *points, int degree, double duration, double *motion) {
    for (int d = 0; d < 3; ++d) {
        double row[most_motion_points + 1], raised[most_motion_points + 1];
        for (int j = 0; j <= degree; ++j) row[j] = points[3 * j + d];
        for (int order = 1, size = degree; order <= 4; ++order, --size) {
            for (int j = 0; j < size; ++j) row[j] = size / duration * (row[j + 1] - row[j]);
            std::copy(row, row + std::max(size, 1), raised);
            if (size < 1) raised[0] = 0.0;
            for (int have = std::max(size, 1); have < degree; ++have)
                for (int j = have; j >= 0; --j) {
                    const double share = double(j) / have, before = j > 0 ? raised[j - 1] : 0.0, here = j < have ? raised[j] : 0.0;
                    raised[j] = share * before + (1.0 - share) * here;
                }
            std::copy(raised, raised + degree, motion + ((order - 1) * 3 + d) * degree);
        }
    }
}

}  // namespace minsnap

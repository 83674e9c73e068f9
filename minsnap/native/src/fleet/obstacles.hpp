// Clearance of a curve from a convex obstacle, proved: the least over time of the largest of its distances from the sets whose intersection the obstacle is.
//
// The sets are a ball in scaled coordinates (a vertical cylinder where the height's scale is 0) and slabs along the axes. A part of a curve has at least the
// clearance of its control points from one set, along one direction; it has at most that of its ends; halving makes the two meet.
#pragma once

#include "fleet/curves.hpp"

namespace minsnap {

// What Python hands over, as 13 numbers. A set that there is not has a radius < 0 or infinite bounds.
struct Obstacle {
    double center[fleet_axes], scale[fleet_axes], radius;
    double low[fleet_axes], high[fleet_axes];
};

struct Clearance {
    double least, attained, instant;
    Integer obstacle;
};

class ClearanceSearch {
public:
    // Lower what is known of a vehicle by its part between two instants; `finest` [m] is how far proof and truth may lie apart.
    void lower(const Curve &arc, double from, double to, const Obstacle &obstacle, Integer index, double finest, Clearance &best) {
        parts_ = 1;
        copy(arc, stack_[0].arc);
        stack_[0].from = from;
        stack_[0].to = to;
        stack_[0].level = 0;
        while (parts_ > 0) {
            Part &part = stack_[parts_ - 1];
            attain(part, obstacle, index, best);
            const double least = at_least(part.arc, obstacle);
            if (least >= best.attained - finest || part.level >= deepest) {
                best.least = std::fmin(best.least, least);
                --parts_;
            } else {
                halve();
            }
        }
    }

    // A lower bound on the clearance of all of a curve.
    static double at_least(const Curve &arc, const Obstacle &obstacle) {
        double best = -__builtin_huge_val();
        for (int d = 0; d < fleet_axes; ++d) {
            double low = __builtin_huge_val(), high = -low;
            for (int j = 0; j <= arc.degree; ++j) {
                low = std::fmin(low, below(arc.value[d][j], arc.error[d][j]));
                high = std::fmax(high, above(arc.value[d][j], arc.error[d][j]));
            }
            best = std::fmax(best, std::fmax(rounded_down(low, obstacle.high[d]), rounded_down(-high, -obstacle.low[d])));
        }
        return obstacle.radius < 0.0 ? best : std::fmax(best, beyond_ball(arc, obstacle));
    }

private:
    static constexpr int deepest = 48;
    struct Part {
        Curve arc;
        double from, to;
        int level;
    };

    static double rounded_down(double value, double bound) {
        const double difference = value - bound;
        return difference - 2.0 * unit * std::fabs(difference);
    }

    static double beyond_ball(const Curve &arc, const Obstacle &obstacle) {
        const int middle = arc.degree / 2;
        double way[fleet_axes], length = 0.0;
        for (int d = 0; d < fleet_axes; ++d) {
            way[d] = obstacle.scale[d] * (0.5 * (arc.value[d][middle] + arc.value[d][arc.degree - middle]) - obstacle.center[d]);
            length += way[d] * way[d];
        }
        length = std::sqrt(length);
        if (!(length > 0.0)) return -obstacle.radius;
        double least = __builtin_huge_val();
        for (int j = 0; j <= arc.degree; ++j) {
            double along = 0.0, error = 0.0;
            for (int d = 0; d < fleet_axes; ++d) {
                const double share = way[d] / length * obstacle.scale[d], away = arc.value[d][j] - obstacle.center[d];
                along += share * away;
                error += std::fabs(share) * arc.error[d][j] + 16.0 * unit * std::fabs(share * away);
            }
            least = std::fmin(least, along - error * (1.0 + 1e-9));
        }
        return least - obstacle.radius - 4.0 * unit * (std::fabs(least) + obstacle.radius);
    }

    static void attain(const Part &part, const Obstacle &obstacle, Integer index, Clearance &best) {
        for (int end = 0; end < 2; ++end) {
            const int j = end * part.arc.degree;
            double value = -__builtin_huge_val(), square = 0.0;
            for (int d = 0; d < fleet_axes; ++d) {
                const double x = part.arc.value[d][j], y = obstacle.scale[d] * (x - obstacle.center[d]);
                value = std::fmax(value, std::fmax(x - obstacle.high[d], obstacle.low[d] - x));
                square += y * y;
            }
            if (obstacle.radius >= 0.0) value = std::fmax(value, std::sqrt(square) - obstacle.radius);
            if (value < best.attained) best = {best.least, value, end == 0 ? part.from : part.to, index};
        }
    }

    static void copy(const Curve &source, Curve &target) {
        target.degree = source.degree;
        target.dim = source.dim;
        for (int d = 0; d < source.dim; ++d)
            for (int j = 0; j <= source.degree; ++j) {
                target.value[d][j] = source.value[d][j];
                target.error[d][j] = source.error[d][j];
            }
    }

    void halve() {
        Part &left = stack_[parts_ - 1], &right = stack_[parts_];
        copy(left.arc, right.arc);
        cut(left.arc, 0.5, false);
        cut(right.arc, 0.5, true);
        right.to = left.to;
        left.to = right.from = 0.5 * (left.from + left.to);
        right.level = ++left.level;
        ++parts_;
    }

    int parts_ = 0;
    Part stack_[deepest + 2];
};

}  // namespace minsnap

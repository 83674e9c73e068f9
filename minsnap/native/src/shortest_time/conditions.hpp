// Conditions on one derivative at an instant as quadratic functions that must not be positive: walls, limits on norms, thrust, tilt, regions of knots.
//
// |A d| <= radius + slope . d becomes (|A d|^2 - (radius + slope . d)^2) / (2 width^2) <= 0, and with a slope the plane on which the right side
// is not negative besides; a least norm is the same with the other sign. Their Hessians are exact, convex or not.
#pragma once

#include <algorithm>

#include "arithmetic/lanes.hpp"
#include "basics/buffer.hpp"
#include "shortest_time/border.hpp"
#include "shortest_time/instants.hpp"

namespace minsnap {

template <int dim>
struct Condition {
    double curvature[dim * (dim + 1) / 2];  // lower triangle
    double slope[dim], anchor[dim], constant;
    std::int32_t order;
    bool curved;

    // Value at a derivative, and its gradient.
    template <class Real>
    MINSNAP_INLINE Real at(const Real *x, Real *gradient) const {
        Real offset[dim], linear = filled<Real>(constant), square{};
        for (int c = 0; c < dim; ++c) offset[c] = x[c] - anchor[c];
        for (int c = 0; c < dim; ++c) {
            Real sum{};
            if (curved)
                for (int d = 0; d < dim; ++d) sum += curvature[c > d ? c * (c + 1) / 2 + d : d * (d + 1) / 2 + c] * offset[d];
            gradient[c] = slope[c] + sum;
            linear += slope[c] * offset[c];
            square += sum * offset[c];
        }
        return linear + 0.5 * square;
    }
};

// Conditions of all legs, or of all waypoints, each place's sorted by order.
template <int dim>
struct ConditionTable {
    Buffer<Condition<dim>> entries;
    Buffer<std::int32_t> first;  // of every place, and their number

    const Condition<dim> *begin(int place) const { return entries.data() + first[place]; }
    int count(int place) const { return first[place + 1] - first[place]; }

    [[nodiscard]] bool build(const ShortestRequest &request, bool at_knots) {
        const int places = static_cast<int>(request.legs) + (at_knots ? 1 : 0);
        if (!first.allocate(places + 1)) return false;
        for (int k = 0; k <= places; ++k) first[k] = 0;
        each(request, at_knots,
             [&](const WallsRecord &group, std::int64_t row) { first[group.leg[row] + 1] += sloped(group, row) ? 2 : 1; });
        for (int k = 0; k < places; ++k) first[k + 1] += first[k];
        if (!entries.allocate(first[places])) return false;
        Buffer<std::int32_t> place;
        if (!place.allocate(places + 1)) return false;
        for (int k = 0; k <= places; ++k) place[k] = first[k];
        for (int order = 0; order < condition_orders; ++order)
            each(request, at_knots, [&](const WallsRecord &group, std::int64_t row) {
                if (group.order != order) return;
                std::int32_t &next = place[group.leg[row]];
                entries[next++] = cone(group, row, request.inwards);
                if (sloped(group, row)) entries[next++] = plane(group, row, request.inwards);
            });
        return true;
    }

private:
    template <class Action>
    static void each(const ShortestRequest &request, bool at_knots, Action &&action) {
        for (std::int64_t k = 0; k < request.groups; ++k)
            if ((request.cones[k].at_knots != 0) == at_knots)
                for (std::int64_t row = 0; row < request.cones[k].count; ++row) action(request.cones[k], row);
    }

    static bool sloped(const WallsRecord &group, std::int64_t row) {
        bool found = false;
        for (int c = 0; c < dim; ++c) found = found || group.slope[row * dim + c] != 0.0;
        return found && group.rows > 0;
    }

    static Condition<dim> plane(const WallsRecord &group, std::int64_t row, double inwards) {
        Condition<dim> made{};
        const double width = group.width[row];
        made.order = static_cast<std::int32_t>(group.order);
        made.constant = (group.order == 0 ? inwards : 0.0) - group.radius[row] / width;
        for (int c = 0; c < dim; ++c) {
            made.slope[c] = -group.slope[row * dim + c] / width;
            made.anchor[c] = group.anchor[row * dim + c];
        }
        return made;
    }

    static Condition<dim> cone(const WallsRecord &group, std::int64_t row, double inwards) {
        if (group.rows == 0) return plane(group, row, inwards);
        Condition<dim> made = plane(group, row, inwards);
        const double width = group.width[row], radius = group.radius[row] / width, sign = group.outside ? -1.0 : 1.0;
        const double *matrix = group.matrix + row * group.rows * dim;
        made.curved = true;
        made.constant = (group.order == 0 ? inwards : 0.0) - 0.5 * sign * radius * radius;
        for (int c = 0, t = 0; c < dim; ++c)
            for (int d = 0; d <= c; ++d, ++t) {
                double sum = -made.slope[c] * made.slope[d];
                for (std::int64_t r = 0; r < group.rows; ++r) sum += matrix[r * dim + c] * matrix[r * dim + d] / (width * width);
                made.curvature[t] = sign * sum;
            }
        for (int c = 0; c < dim; ++c) made.slope[c] *= radius;
        return made;
    }
};

}  // namespace minsnap

// Gates as the openings that they leave: sides along the axes are those of a box, others half-spaces; a plane across an axis makes the box flat.
#include <algorithm>

#include "arithmetic/double_double.hpp"
#include "planner/course.hpp"

namespace minsnap {
namespace {

constexpr double smallest = 0x1p-500;  // of a radius and a side [m]
constexpr double rounding = 1e-12;     // component of a direction that is only rounding
constexpr std::int64_t most_corners = 1000;

using Long = long long;

// Rounded once.
double length_of(const double *x, int dim) {
    DoubleDouble sum(0.0);
    for (int d = 0; d < dim; ++d) sum += DoubleDouble(x[d]) * DoubleDouble(x[d]);
    return to_double(sqrt(sum));
}

double dot(const double *a, const double *b, int dim) {
    double sum = a[0] * b[0];
    for (int d = 1; d < dim; ++d) sum += a[d] * b[d];
    return sum;
}

void cross(const double *a, const double *b, double *out) {
    for (int d = 0; d < 3; ++d) {
        const int next = (d + 1) % 3, last = (d + 2) % 3;
        out[d] = a[next] * b[last] - a[last] * b[next];
    }
}

void snap(double *x, int dim) {
    for (int d = 0; d < dim; ++d)
        if (std::fabs(x[d]) <= rounding) x[d] = 0.0;
}

}  // namespace

bool Regions::add_balls(WallSets &sets, const double *points, std::int64_t per_leg, Holds holds) const {
    std::int64_t balls = 0;
    for (std::int64_t k = 0; k < count_; ++k) balls += (*this)[k].ball();
    WallRows to;
    if (balls > 0 && !sets.add(balls, dim_, 0, to, holds)) return false;
    for (std::int64_t k = 0; k < balls; ++k) {  // they come first
        const Region &ball = (*this)[k];
        const double *const center = points + ball.waypoint * dim_;
        to.leg[k] = ball.waypoint * per_leg, to.radius[k] = to.width[k] = ball.radius;
        std::copy(center, center + dim_, to.anchor + k * dim_);
        for (int d = 0; d < dim_; ++d) to.matrix[(k * dim_ + d) * dim_ + d] = 1.0;
    }
    return true;
}

bool Regions::add_crossings(WallSets &sets, std::int64_t per_leg, Holds holds) const {
    std::int64_t crossings = 0;
    for (std::int64_t k = 0; k < count_; ++k) crossings += (*this)[k].crossed;
    WallRows to;
    if (crossings > 0 && !sets.add(crossings, 0, 1, to, holds)) return false;
    for (std::int64_t k = 0, at = 0; k < count_; ++k) {
        const Region &gate = (*this)[k];
        if (!gate.crossed) continue;
        to.leg[at] = gate.waypoint * per_leg, to.width[at] = 1.0;
        std::copy(gate.direction, gate.direction + dim_, to.slope + at++ * dim_);
    }
    return true;
}

double Regions::excess(const Region &region, const double *offset) const {
    double worst = length_of(offset, dim_) - region.radius;
    for (int d = 0; d < dim_; ++d) worst = std::max({worst, offset[d] - region.upper[d], region.lower[d] - offset[d]});
    for (std::int64_t j = region.first; j < region.first + region.sides; ++j)
        worst = std::max(worst, dot(side(j), offset, dim_) - side(j)[dim_]);
    return region.slanted ? std::max(worst, std::fabs(dot(region.normal, offset, dim_))) : worst;
}

Status Regions::take(const minsnap_problem &given, const double *points, Says &says) {
    const std::int64_t waypoints = given.waypoints;
    dim_ = int(given.dim), count_ = all_sides_ = 0;
    if (given.radii == nullptr && given.gates == 0) return Status::done;
    if (given.gates < 0 || given.gates > waypoints || (given.gates > 0 && given.gate == nullptr))
        return says(Status::bad_size, "there are %lld gates: give at most one at each waypoint, and where they are", Long(given.gates));
    if (!regions_.allocate(std::size_t(waypoints)) || !index_.allocate(std::size_t(waypoints)) || !gate_.allocate(std::size_t(waypoints)))
        return says(Status::no_memory, "there is no memory for the regions of %lld waypoints", Long(waypoints));
    std::fill(index_.data(), index_.data() + waypoints, -1);
    const Status status = take_balls(given, says);
    return status == Status::done ? take_gates(given, points, says) : status;
}

Status Regions::take_balls(const minsnap_problem &given, Says &says) {
    for (std::int64_t i = 0; given.radii != nullptr && i < given.waypoints; ++i) {
        const double radius = given.radii[i];
        if (radius == 0.0) continue;
        if (!(radius >= smallest && radius <= farthest))
            return says(Status::bad_number, "the radius of waypoint %lld is %g: it must be positive, or 0", Long(i), radius);
        if (i == 0 || i == given.waypoints - 1)
            return says(Status::unsupported, "the first and the last waypoint have no ball: set their radii to 0");
        Region ball = {};
        ball.waypoint = i, ball.radius = ball.reach = radius;
        std::fill(ball.lower, ball.lower + 3, -radius), std::fill(ball.upper, ball.upper + 3, radius);
        index_[std::size_t(i)] = count_, regions_[std::size_t(count_++)] = ball;
    }
    return Status::done;
}

Status Regions::take_gates(const minsnap_problem &given, const double *points, Says &says) {
    const std::int64_t last = given.waypoints - 1;
    std::fill(gate_.data(), gate_.data() + given.waypoints, -1);
    std::int64_t corners = 0;
    for (std::int64_t k = 0; k < given.gates; ++k) {
        const minsnap_gate &gate = given.gate[k];
        const std::int64_t waypoint = gate.waypoint;
        if (gate.size != std::int64_t(sizeof(minsnap_gate)))
            return says(Status::bad_size, "gate %lld has size %lld and this library's have %lld: make it by minsnap_gate_new", Long(k),
                        Long(gate.size), Long(sizeof(minsnap_gate)));
        if (waypoint < 0 || waypoint > last)
            return says(Status::bad_size, "gate %lld is at waypoint %lld: waypoints go from 0 to %lld", Long(k), Long(waypoint),
                        Long(last));
        if (waypoint == last || (waypoint == 0 && given.closed == 0))
            return says(Status::unsupported, "gate %lld is at an end: put it at an inner waypoint, or at the start of a lap", Long(k));
        if (index_[std::size_t(waypoint)] >= 0 || gate_[std::size_t(waypoint)] >= 0)
            return says(Status::bad_number, "waypoint %lld has two gates, or a gate and a ball: give one", Long(waypoint));
        if (gate.corner != nullptr && (gate.corners < 3 - (dim_ == 2) || gate.corners > most_corners))
            return says(Status::bad_size, "gate %lld has %lld corners: give 3 to %lld, or 2 in the plane", Long(k), Long(gate.corners),
                        Long(most_corners));
        gate_[std::size_t(waypoint)] = k, corners += gate.corner != nullptr ? gate.corners : 4;
    }
    if (!sides_.allocate(std::size_t(corners * (dim_ + 1))) || !corners_.allocate(std::size_t(corners * dim_)))
        return says(Status::no_memory, "there is no memory for %lld gates", Long(given.gates));
    for (std::int64_t i = 0; i < last; ++i) {
        if (gate_[std::size_t(i)] < 0) continue;
        const Status status = take_gate(given.gate[gate_[std::size_t(i)]], points + i * dim_, says);
        if (status != Status::done) return status;
    }
    if (given.closed != 0) index_[std::size_t(last)] = index_[0];
    return Status::done;
}

Status Regions::take_gate(const minsnap_gate &gate, const double *center, Says &says) {
    const Long waypoint = gate.waypoint;
    if (dim_ == 1) return says(Status::bad_size, "gates need two or three coordinates; there is one");
    if (gate.crossing < -1 || gate.crossing > 1)
        return says(Status::bad_number,
                    "the crossing of the gate at waypoint %lld is %lld: 1 along its normal, -1 against it, 0 either way", waypoint,
                    Long(gate.crossing));
    const double size = finite(gate.normal, dim_) ? length_of(gate.normal, dim_) : 0.0;
    if (!(size > 0.0))
        return says(Status::bad_number, "the normal of the gate at waypoint %lld is zero or not finite: it has no direction", waypoint);
    if (!(gate.margin >= 0.0 && gate.margin <= farthest))
        return says(Status::bad_number, "the margin of the gate at waypoint %lld is %g: it must be positive, or 0", waypoint, gate.margin);
    double normal[3] = {0.0, 0.0, 0.0};
    for (int d = 0; d < dim_; ++d) normal[d] = gate.normal[d] / size;
    snap(normal, dim_);
    const Status status = take_opening(gate, center, normal, says);
    return status == Status::done ? take_sides(gate, normal, gate.corner != nullptr ? gate.corners : dim_ == 2 ? 2 : 4, says) : status;
}

// The corners from the center: those that are given, or of a rectangle that stands upright.
Status Regions::take_opening(const minsnap_gate &gate, const double *center, const double *normal, Says &says) {
    const Long waypoint = gate.waypoint;
    if (gate.corner != nullptr) {
        if (!finite(gate.corner, gate.corners * dim_))
            return says(Status::bad_number, "a corner of the gate at waypoint %lld is not finite", waypoint);
        for (std::int64_t j = 0; j < gate.corners * dim_; ++j) corners_[std::size_t(j)] = gate.corner[j] - center[j % dim_];
        return Status::done;
    }
    const double sides[2] = {gate.width, gate.height == 0.0 ? gate.width : gate.height};
    for (const double side : sides)
        if (!(side >= smallest && side <= farthest))
            return says(Status::bad_number, "a side of the gate at waypoint %lld is %g m: it must be positive", waypoint, side);
    double along[2][3] = {{-normal[1], normal[0], 0.0}, {}};
    if (dim_ == 3) {
        const bool level = std::fabs(normal[2]) > 1.0 - exact, chosen = gate.up[0] != 0.0 || gate.up[1] != 0.0 || gate.up[2] != 0.0;
        const double usual[3] = {0.0, level ? 1.0 : 0.0, level ? 0.0 : 1.0};
        const double *const up = chosen ? gate.up : usual;
        cross(up, normal, along[0]);
        const double across = length_of(along[0], 3);
        if (!finite(up, 3) || !(across > exact * length_of(up, 3)))
            return says(Status::bad_number, "up of the gate at waypoint %lld is along its normal: give a direction in its plane", waypoint);
        for (double &value : along[0]) value /= across;
        snap(along[0], 3);
        cross(normal, along[0], along[1]);
        snap(along[1], 3);
    }
    for (int k = 0; k < 2; ++k)
        for (double &value : along[k]) value *= sides[k] / 2.0;
    const int ways[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    for (int corner = 0; corner < (dim_ == 2 ? 2 : 4); ++corner)
        for (int d = 0; d < dim_; ++d) {
            const double first = center[d] + ways[corner][0] * along[0][d];
            corners_[std::size_t(corner * dim_ + d)] = (dim_ == 2 ? first : first + ways[corner][1] * along[1][d]) - center[d];
        }
    return Status::done;
}

// What the sides leave, less the margin: along the axes as a box, else as half-spaces.
Status Regions::take_sides(const minsnap_gate &gate, const double *normal, std::int64_t corners, Says &says) {
    const Long waypoint = gate.waypoint;
    const int dim = dim_;
    Region made = {};
    made.waypoint = gate.waypoint, made.radius = infinite, made.first = all_sides_, made.slanted = true;
    std::copy(normal, normal + 3, made.normal);
    for (int d = 0; d < dim; ++d) {
        made.lower[d] = infinite, made.upper[d] = -infinite;
        for (std::int64_t j = 0; j < corners; ++j) {
            made.lower[d] = std::min(made.lower[d], corners_[std::size_t(j * dim + d)]);
            made.upper[d] = std::max(made.upper[d], corners_[std::size_t(j * dim + d)]);
        }
        if (std::fabs(normal[d]) == 1.0) made.lower[d] = made.upper[d] = 0.0, made.slanted = false;
        made.crossed = gate.crossing != 0, made.direction[d] = double(gate.crossing) * normal[d];
    }
    for (std::int64_t j = 0; j < corners; ++j) made.reach = std::max(made.reach, length_of(corners_.data() + j * dim, dim));
    for (std::int64_t j = 0; j < corners; ++j) {
        const double *const here = corners_.data() + j * dim, *const next = corners_.data() + (j + 1) % corners * dim;
        double outward[3], edge[3], square = 0.0;
        for (int d = 0; d < dim; ++d) edge[d] = next[d] - here[d];
        if (dim == 2)
            std::copy(here, here + 2, outward);
        else
            cross(edge, normal, outward);
        for (int d = 0; d < dim; ++d) square += outward[d] * outward[d];
        const double size = std::sqrt(square);
        if (!(size > 0.0)) return says(Status::bad_number, "two corners of the gate at waypoint %lld are at one place", waypoint);
        for (int d = 0; d < dim; ++d) outward[d] /= size;
        double bound = (dim == 2 ? size : dot(outward, here, 3)) - gate.margin;
        snap(outward, dim);
        for (std::int64_t i = 0; i < corners; ++i)
            if (dot(outward, corners_.data() + i * dim, dim) > bound + gate.margin + exact * made.reach)
                return says(Status::bad_number, "the corners of the gate at waypoint %lld go round no convex polygon about its normal",
                            waypoint);
        if (std::fabs(dot(normal, here, dim)) > exact * made.reach)
            return says(Status::bad_number, "a corner of the gate at waypoint %lld is not in the plane through it across its normal",
                        waypoint);
        if (!(bound > 0.0))
            return says(Status::bad_number, "the gate at waypoint %lld has an edge %.4g m from it, and a margin of %g m: nothing is left",
                        waypoint, bound + gate.margin, gate.margin);
        bool along = false;
        for (int d = 0; d < dim; ++d) {
            along = along || std::fabs(outward[d]) >= 1.0;
            if (gate.margin > 0.0 && outward[d] == -1.0) made.lower[d] = -bound;
            if (gate.margin > 0.0 && outward[d] == 1.0) made.upper[d] = bound;
        }
        if (along) continue;
        double *const row = sides_.data() + all_sides_++ * (dim + 1);
        std::copy(outward, outward + dim, row);
        row[dim] = bound;
        ++made.sides;
    }
    index_[std::size_t(gate.waypoint)] = count_, regions_[std::size_t(count_++)] = made;
    return Status::done;
}

}  // namespace minsnap

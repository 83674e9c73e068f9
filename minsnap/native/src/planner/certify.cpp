// What is proved of curves: walls, limits, waypoints, joints and ends; by the operations of the certificate.
#include "planner/answer.hpp"

#include "basics/border.hpp"
#include "certificate/proof.hpp"
#include "vehicle/motion_points.hpp"

extern "C" {
std::int32_t minsnap_largest_norms(std::int64_t count, std::int64_t degree, std::int64_t dim, const double *points, const double *durations,
                                   std::int64_t orders, const std::int64_t *order, double *values, std::int64_t *piece);
std::int32_t minsnap_thrust_axis(std::int64_t pieces, std::int64_t degree, const double *points, const double *durations, double gravity,
                                 std::int64_t count, const std::int64_t *measures, double *found);
std::int32_t minsnap_excess(const minsnap::WallsRecord *walls, minsnap::ExcessRecord *asked);
std::int32_t minsnap_vehicle_bounds(const minsnap::VehicleRecord *asked);
}

namespace minsnap {
namespace {

constexpr double kept = 1e-9;       // how far above 1 a use may be
constexpr double faint = 0x1p-500;  // squares below it lose digits

double root(double square) { return std::sqrt(square > 0.0 ? square : 0.0); }

// Derivative of an order at the start of a piece, or at its end, and what rounding may make of it.
void side(const CurveView &curve, std::int64_t piece, bool end, int order, double *value, double &rounding) {
    const int count = curve.degree + 1, dim = curve.dim;
    const double *const points = curve.points + piece * count * dim;
    const int first = end ? curve.degree : 0, step = end ? -1 : 1;
    double sizes[2] = {0.0, 0.0}, factor = 1.0, sum = 1.0;
    for (int j = 0; j < count; ++j)
        for (int d = 0; d < dim; ++d) {
            sizes[0] = std::max(sizes[0], std::fabs(points[j * dim + d] - points[first * dim + d]));
            sizes[1] = std::max(sizes[1], std::fabs(points[j * dim + d]));
        }
    for (int p = 0; p < order; ++p) factor *= (curve.degree - p) / (end ? -curve.durations[piece] : curve.durations[piece]), sum *= 2.0;
    for (int d = 0; d < dim; ++d) {
        double row[16];
        for (int j = 0; j <= order; ++j) row[j] = points[(first + step * j) * dim + d] - points[first * dim + d];
        for (int q = 0; q < order; ++q)
            for (int j = 0; j + q < order; ++j) row[j] = row[j + 1] - row[j];
        value[d] = factor * row[0];
    }
    rounding = std::fabs(factor) * sum * (exact * sizes[0] + stored * sizes[1]);
}

bool same_state(const CurveView &curve, const Course &course) {
    double value[3], other[3], rounding, more;
    const std::int64_t last = curve.legs * curve.pieces - 1;
    for (int order = 1; order < course.half; ++order) {
        side(curve, 0, false, order, value, rounding);
        side(curve, last, true, order, other, more);
        for (int d = 0; d < curve.dim; ++d) {
            const double start = course.state(0)[order * curve.dim + d], end = course.state(course.legs)[order * curve.dim + d];
            if (course.closed && !(std::fabs(value[d] - other[d]) <= std::max(rounding, more))) return false;
            if (!course.closed && !(std::fabs(value[d] - start) <= rounding + exact * std::fabs(start))) return false;
            if (!course.closed && !(std::fabs(other[d] - end) <= more + exact * std::fabs(end))) return false;
        }
    }
    return true;
}

bool same_times(const CurveView &curve, const Course &course) {
    double total = 0.0;
    for (std::int64_t leg = 0; leg < curve.legs; ++leg) {
        double own = 0.0;
        for (std::int64_t part = 0; part < curve.pieces; ++part) own += curve.durations[leg * curve.pieces + part];
        total += own;
        if (course.durations != nullptr && !(std::fabs(own - course.durations[leg]) <= exact * course.durations[leg])) return false;
    }
    return course.total == 0.0 || std::fabs(total - course.total) <= exact * course.total;
}

double square(double value) { return value * value; }

// Bounds of the rotors' thrusts, and with drag of thrust, tilt and body rate, on parts of a curve, which are divided until they are inside.
class VehicleProof {
public:
    VehicleProof(const CurveView &curve, const Bounds &bounds, double share)
        : curve_(curve), heading_{std::cos(bounds.vehicle->yaw), std::sin(bounds.vehicle->yaw), 0.0, 0.0},
          most_{infinite,
                infinite,
                infinite,
                infinite,
                (1.0 + kept) * (bounds.hover() + bounds.room_above()) - share * bounds.hover(),
                -((1.0 - kept) * (bounds.hover() - bounds.room_below()) + share * bounds.hover())} {
        if (bounds.drags()) {
            const double more = 1.0 + kept - share;
            most_[0] = more * bounds.gravity * bounds.most_thrust;
            if (bounds.least_thrust > 0.0) most_[1] = -bounds.gravity * bounds.least_thrust / more;
            if (bounds.tilt < infinite) most_[2] = square(more * std::tan(bounds.tilt));
            most_[3] = square(more * bounds.body_rate);
        }
        record_.parts = 1, record_.count = curve.degree, record_.mass = bounds.vehicle->mass, record_.medium = bounds.medium;
        record_.inertia = bounds.vehicle->inertia, record_.mixer = bounds.vehicle->mixer, record_.points = motion_, record_.half = &half_;
        record_.yaw = heading_, record_.bounds = found_;
    }

    bool holds() {
        for (std::int64_t piece = 0; piece < curve_.legs * curve_.pieces; ++piece) {
            const double *const points = curve_.points + piece * (curve_.degree + 1) * 3;
            if (!inside(points, curve_.durations[piece], 0)) return false;
        }
        return true;
    }

private:
    static constexpr int deepest = 14, most_points = 12;

    // Of a part that takes so long, control points (degree + 1, 3).
    bool inside(const double *points, double duration, int depth) {
        const int count = curve_.degree + 1;
        if (depth >= 2) {
            motion_points(points, curve_.degree, duration, motion_);
            half_ = 0.5 * duration;
            if (minsnap_vehicle_bounds(&record_) != 0) return false;
            bool all = true;
            for (int k = 0; k < 6; ++k) all = all && found_[k] <= most_[k];
            if (all) return true;
        }
        if (depth == deepest) return false;
        double left[3 * most_points], right[3 * most_points];
        std::copy(points, points + 3 * count, right);
        for (int j = 0; j < count; ++j) {
            for (int d = 0; d < 3; ++d) left[3 * j + d] = right[d];
            for (int i = 0; i + 1 < count - j; ++i)
                for (int d = 0; d < 3; ++d) right[3 * i + d] = 0.5 * (right[3 * i + d] + right[3 * (i + 1) + d]);
        }
        return inside(left, 0.5 * duration, depth + 1) && inside(right, 0.5 * duration, depth + 1);
    }

    const CurveView curve_;
    const double heading_[4];
    double most_[6], motion_[4 * 3 * most_points], half_ = 0.0, found_[6];
    VehicleRecord record_ = {};
};

}  // namespace

Status measure(const CurveView &curve, double gravity, bool thrust, Reached &reached) {
    const std::int64_t pieces = curve.legs * curve.pieces, orders[4] = {1, 2, 3, 4}, measures[4] = {0, 1, 3, 2};  // the tilt last
    std::int64_t piece[4], known = std::min(4, curve.degree);
    double values[12], found[12];
    Status status =
        Status(minsnap_largest_norms(pieces, curve.degree, curve.dim, curve.points, curve.durations, known, orders, values, piece));
    if (status != Status::done) return status;
    for (int k = 0; k < known; ++k) {
        if (values[3 * k + 1] < faint && values[3 * k + 1] > 0.0) return Status::not_proved;
        reached.norm[k] = root(values[3 * k + 1]);
    }
    if (!thrust) return Status::done;
    status = Status(minsnap_thrust_axis(pieces, curve.degree, curve.points, curve.durations, gravity, 4, measures, found));
    if (status == Status::unsupported) {  // it points down somewhere
        status = Status(minsnap_thrust_axis(pieces, curve.degree, curve.points, curve.durations, gravity, 3, measures, found));
        found[9] = infinite;
    }
    reached.thrust = root(found[0]), reached.least_thrust = root(-found[3]);
    reached.tilt = found[9] < infinite ? std::atan(root(found[9])) : 3.141592653589793, reached.body_rate = root(found[6]);
    for (int k = 0; k < 2; ++k) reached.piece[k] = std::int64_t(found[3 * k + 1]), reached.place[k] = found[3 * k + 2];
    return status;
}

double largest_use(const CurveView &curve, const Bounds &bounds) {
    Reached reached;
    if (measure(curve, bounds.gravity, bounds.lifts(), reached) != Status::done) return infinite;
    double used = 0.0;
    for (int k = 0; k < 4; ++k) used = std::max(used, reached.norm[k] / bounds.norm[k]);
    if (!bounds.lifts() || bounds.drags()) return used;
    used = std::max({used, reached.thrust / bounds.most_thrust, reached.body_rate / bounds.body_rate});
    if (bounds.tilt < infinite) used = std::max(used, reached.tilt / bounds.tilt);
    if (bounds.least_thrust > 0.0)
        used = std::max(used, reached.least_thrust > 0.0 ? bounds.least_thrust / reached.least_thrust : infinite);
    return used == used ? used : infinite;
}

bool vehicle_kept(const CurveView &curve, const Bounds &bounds, double share) {
    return bounds.vehicle == nullptr || VehicleProof(curve, bounds, share).holds();
}

double wall_excess(const CurveView &curve, const WallSets &walls) {
    double worst = -infinite;
    for (int g = 0; g < walls.count(); ++g) {
        ExcessRecord asked = {};
        asked.pieces = curve.legs * curve.pieces, asked.degree = curve.degree, asked.dim = curve.dim, asked.per_leg = curve.pieces;
        asked.points = curve.points, asked.durations = curve.durations;
        if (minsnap_excess(&walls[g], &asked) != 0) return infinite;
        worst = std::max(worst, asked.bound);
    }
    return worst;
}

// Whether gates are passed in their direction, to rounding of the largest speed.
bool crossed(const CurveView &curve, const Course &course) {
    double largest[3] = {0.0, -1.0, 0.0};
    const std::int64_t order = 1;
    for (std::int64_t k = 0; k < course.regions.count(); ++k) {
        const Region &region = course.regions[k];
        if (!region.crossed) continue;
        std::int64_t piece = 0;
        const std::int64_t pieces = curve.legs * curve.pieces;
        if (largest[1] < 0.0 &&
            minsnap_largest_norms(pieces, curve.degree, curve.dim, curve.points, curve.durations, 1, &order, largest, &piece))
            return false;
        double velocity[3], rounding, along = 0.0;
        side(curve, region.waypoint * curve.pieces, false, 1, velocity, rounding);
        for (int d = 0; d < curve.dim; ++d) along += velocity[d] * region.direction[d];
        if (!(along >= -exact * root(largest[1]))) return false;
    }
    return true;
}

double waypoint_excess(const CurveView &curve, const Course &course, bool &passes) {
    const int count = curve.degree + 1, dim = curve.dim;
    double worst = 0.0, size = 0.0, away = 0.0;
    for (std::int64_t i = 0; i <= course.legs; ++i) {
        for (int d = 0; d < dim; ++d)
            size = std::max(size, std::fabs(course.state(i)[d])), away = std::max(away, std::fabs(course.state(i)[d] - course.state(0)[d]));
        for (int end = 0; end < 2; ++end) {
            if ((end == 0 && i == course.legs) || (end == 1 && i == 0)) continue;
            const double *const at = curve.points + (end == 0 ? i * curve.pieces * count : i * curve.pieces * count - 1) * dim;
            double square = 0.0, offset[3];
            for (int d = 0; d < dim; ++d) offset[d] = at[d] - course.state(i)[d], square += offset[d] * offset[d];
            const Region *const region = course.regions.at(i);
            worst = std::max(worst, region == nullptr ? std::sqrt(square) : course.regions.excess(*region, offset));
        }
    }
    passes = worst <= exact * away + stored * size && crossed(curve, course);
    return worst;
}

Status certify(const CurveView &curve, const Course &course, minsnap_certificate &proved, Says &says) {
    const std::int64_t pieces = curve.legs * curve.pieces;
    if (curve.legs != course.legs || curve.dim != course.dim || curve.degree != 2 * course.half - 1)
        return says(Status::bad_size, "the curve has %lld legs, %d coordinates and degree %d, and the problem %lld, %d and %d",
                    static_cast<long long>(curve.legs), curve.dim, curve.degree, static_cast<long long>(course.legs), course.dim,
                    2 * course.half - 1);
    const Pieces all{curve.points, curve.durations, pieces, curve.degree, curve.dim};
    if (!all.sound())
        return says(Status::bad_number, "the curve has a control point that is not finite, or a duration that is not positive");
    Reached reached;
    Status status = measure(curve, course.bounds.gravity, course.dim == 3, reached);
    if (status != Status::done) return says(status, "the curve is too large or too small to be measured");
    std::int64_t continuity = 0;
    status = find_continuity(all, exact, stored, continuity);
    if (status != Status::done) return says(status, "there is no memory to look at %lld polynomials", static_cast<long long>(pieces));
    bool passes = false;
    const double waypoints = waypoint_excess(curve, course, passes), excess = wall_excess(curve, course.walls);
    const double used = course.limited ? largest_use(curve, course.bounds) : 0.0;
    if (excess == infinite) return says(Status::unsupported, "the curve cannot be compared with its walls");
    proved.continuity = continuity, proved.waypoints = std::max(waypoints, 0.0), proved.margin = 0.0 - excess;
    proved.speed = reached.norm[0], proved.acceleration = reached.norm[1], proved.jerk = reached.norm[2], proved.snap = reached.norm[3];
    proved.thrust = reached.thrust, proved.least_thrust = reached.least_thrust, proved.tilt = reached.tilt,
    proved.body_rate = reached.body_rate;
    const char *wrong = !passes                        ? "does not pass its waypoints"
                        : continuity < course.half - 1 ? "jumps at a knot"
                        : !same_state(curve, course)   ? "does not begin and end in the states that were asked for"
                        : !same_times(curve, course)   ? "has other times than were asked for"
                        : excess > 0.0                 ? "leaves its walls"
                        : !(used <= 1.0 + kept) || (course.limited && !vehicle_kept(curve, course.bounds)) ? "exceeds a limit"
                                                                                                           : nullptr;
    proved.kept = wrong == nullptr;
    if (wrong != nullptr) says(Status::done, "the curve %s", wrong);
    return Status::done;
}

}  // namespace minsnap

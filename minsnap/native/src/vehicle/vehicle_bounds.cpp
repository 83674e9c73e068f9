// Bounds of thrust, tilt, body rate and the rotors' thrusts on parts of a path, from ranges of their control points.
#include "arithmetic/rising.hpp"
#include "basics/border.hpp"
#include "basics/export.hpp"
#include "basics/status.hpp"
#include "vehicle/rotors.hpp"

namespace minsnap {
namespace {

// A coordinate of a derivative on a part, from its control points: their hull, and that of their differences.
Rising rising(const double *points, int count, double *room) {
    Range value{points[0], points[0]}, slope;
    const double factor = 0.5 * (count - 1);
    for (int k = 1; k < count; ++k) {
        const double step = factor * (points[k] - points[k - 1]);
        value = {std::min(value.low, points[k]), std::max(value.high, points[k])};
        slope = k == 1 ? Range{step, step} : Range{std::min(slope.low, step), std::max(slope.high, step)};
    }
    for (int k = 0; k < count; ++k) room[k] = points[k];
    for (int last = count - 1; last > 0; --last)  // de Casteljau
        for (int k = 0; k < last; ++k) room[k] = 0.5 * (room[k] + room[k + 1]);
    return {room[0], value, slope};
}

// The heading around the middle of a part, from its cosine, sine, rate and acceleration there and a bound of the third derivative.
TurningHeading<Rising> heading_of(const double *yaw, double jerk, double half) {
    const Range acceleration = Range::around(yaw[3], half * jerk), rate = Range::around(yaw[2], half * acceleration.reach());
    const double reach = half * rate.reach();
    const Range cosine = common(Range::around(yaw[0], reach), {-1.0, 1.0}), sine = common(Range::around(yaw[1], reach), {-1.0, 1.0});
    const Rising east(yaw[0], cosine, (-half) * (sine * rate)), north(yaw[1], sine, half * (cosine * rate));
    const Rising turn(yaw[2], rate, half * acceleration), bend(yaw[3], acceleration, Range::around(0.0, half * jerk));
    const Rising none(0.0), square = -1.0 * squared(turn);
    return {{east, north, none},
            {-1.0 * (turn * north), turn * east, none},
            {square * east - bend * north, square * north + bend * east, none}};
}

// An axis of the body that is known in the middle of a part and turns with the thrust axis z, by -(axis . f') z / |f|.
Space<Rising> axis_of(const double *middle, const Lift<Rising> &f, const Rising &size, double half) {
    const double reach = std::min(half * (norm(f.change, 0.0) / size).value.reach(), 2.0);
    const auto around = [&](int i, const Range &slope) { return within_one(Rising(middle[i], Range::around(middle[i], reach), slope)); };
    const Space<Rising> z = along(f.force, size), axis{around(0, Range::whole()), around(1, Range::whole()), around(2, Range::whole())};
    const Range turn = (-half) * (inner(axis, f.change) / size).value;
    return {around(0, turn * z.x.value), around(1, turn * z.y.value), around(2, turn * z.z.value)};
}

void bound(const VehicleRecord &asked, std::int64_t part, double *room, double *bounds) {
    const Medium m(asked.medium);
    const int count = static_cast<int>(asked.count);
    const double *points = asked.points + part * 12 * count, half = asked.half[part];
    Space<Rising> x[4];
    for (int q = m.drag() ? 0 : 1; q < 4; ++q) {
        const double *own = points + q * 3 * count;
        x[q] = {rising(own, count, room), rising(own + count, count, room), rising(own + 2 * count, count, room)};
    }
    const Lift<Rising> f(m, x, 2);
    const Rising size = norm(f.force, 0.0), thrust = f.thrust(m, size, x[0]), &up = f.force.z;
    bounds[0] = thrust.value.high;
    bounds[1] = -thrust.value.low;
    bounds[2] = up.value.low > 0.0 ? ((squared(f.force.x) + squared(f.force.y)) / squared(up)).value.high : HUGE_VAL;
    bounds[3] = (square(cross(f.force, f.change)) / squared(square(f.force))).value.high;
    bounds[4] = bounds[5] = 0.0;
    if (asked.yaw == nullptr && asked.axes == nullptr) return;
    Turning<Rising> turn;
    if (asked.axes != nullptr) {
        const double *axes = asked.axes + part * 6;
        turn = unspun(f, size, axis_of(axes, f, size, half), axis_of(axes + 3, f, size, half));
    } else {
        turn = turning(m, f, size, heading_of(asked.yaw + part * 4, asked.jerk, half));
    }
    Rising wrench[4];
    wrench_of(asked.mass, asked.inertia, thrust, turn, wrench);
    bounds[4] = bounds[5] = -HUGE_VAL;
    for (int i = 0; i < 4; ++i) {
        const Range rotor = rotor_of(asked.mixer + 4 * i, wrench).value;
        bounds[4] = std::max(bounds[4], rotor.high);
        bounds[5] = std::max(bounds[5], -rotor.low);
    }
}

}  // namespace
}  // namespace minsnap

MINSNAP_EXPORT std::int32_t minsnap_vehicle_bounds(const minsnap::VehicleRecord *asked) {
    using namespace minsnap;
    constexpr std::int64_t most = 64;
    double room[most];
    if (asked->count < 1 || asked->count > most || asked->parts < 0) return static_cast<std::int32_t>(Status::bad_size);
    for (std::int64_t part = 0; part < asked->parts; ++part) bound(*asked, part, room, asked->bounds + part * 6);
    return static_cast<std::int32_t>(Status::done);
}

// The largest thrust, tilt, body rate and rotors' thrusts of a vehicle along a curve: of many samples, and proved by bounds on parts.
//
// Largest samples are raised until bounds on parts (vehicle_bounds.cpp) prove that no value goes beyond: parts that are open are divided, and after
// some rounds sampled in their middle, where samples have missed a narrow peak.
#include "certificate/vehicle_use.hpp"

#include "basics/border.hpp"
#include "basics/buffer.hpp"
#include "basics/export.hpp"
#include "certificate/carried_frame.hpp"
#include "vehicle/motion_points.hpp"
#include "vehicle/rotors.hpp"

extern "C" std::int32_t minsnap_vehicle_bounds(const minsnap::VehicleRecord *asked);

namespace minsnap {
namespace {

constexpr int quantities = 6;
constexpr double parallel = 1e-6;  // share of the thrust across the heading below which the lateral axis is not known
constexpr double standard_gravity = 9.80665;
enum Heads : std::int64_t { unknown, by_yaw, unspun_body };

Space<double> of(const double *values) { return {values[0], values[1], values[2]}; }

class VehicleUse {
public:
    explicit VehicleUse(const VehicleUseRecord &asked)
        : asked_(asked), curve_(*asked.curve), medium_(asked.medium), frame_(curve_, medium_), hover_(asked.mass * medium_.gravity / 4.0) {}

    Status begin() { return asked_.heads == unspun_body ? frame_.carry(asked_.angle) : Status::done; }

    // The largest of samples, at equal steps on every piece and at the end.
    Status sample() {
        const std::int64_t count = curve_.pieces * asked_.samples + 1;
        Buffer<double> t, values;
        if (!t.allocate(std::size_t(count)) || !values.allocate(std::size_t(count * quantities))) return Status::no_memory;
        for (std::int64_t i = 0; i + 1 < count; ++i) {
            const std::int64_t piece = i / asked_.samples;
            t[std::size_t(i)] = curve_.breaks[piece] + curve_.durations[piece] * (double(i % asked_.samples) / double(asked_.samples));
        }
        t[std::size_t(count - 1)] = curve_.breaks[curve_.pieces];
        if (const Status status = sample(t.data(), count, values.data()); status != Status::done) return status;
        std::fill(asked_.values, asked_.values + quantities, -HUGE_VAL);
        for (std::int64_t i = 0; i < count; ++i) {
            const double *const own = values.data() + i * quantities;
            if (own[0] != own[0]) return Status::unsupported;  // no attitude is known there but from what is around
            for (int k = 0; k < quantities; ++k)
                if (own[k] > asked_.values[k]) asked_.values[k] = own[k], asked_.instants[k] = t[std::size_t(i)];
        }
        return Status::done;
    }

    // Raise values until they are proved.
    Status prove() {
        const int degree = curve_.degree, size = 12 * degree;
        std::int64_t count = curve_.pieces;
        Buffer<double> points[2], start[2], width[2], bounds;
        if (!room(points[0], start[0], width[0], bounds, count)) return Status::no_memory;
        for (std::int64_t i = 0; i < count; ++i) {
            start[0][std::size_t(i)] = curve_.breaks[i], width[0][std::size_t(i)] = curve_.durations[i];
            motion_points(curve_.points + i * (degree + 1) * 3, degree, curve_.durations[i], points[0].data() + i * size);
        }
        for (std::int64_t round = 0;; ++round) {
            const int own = int(round % 2), other = 1 - own;
            if (const Status status = bound(points[own].data(), start[own].data(), width[own].data(), count, bounds.data());
                status != Status::done)
                return status;
            if (round >= asked_.missed)
                if (const Status status = raise_to_samples(start[own].data(), width[own].data(), count, bounds.data());
                    status != Status::done)
                    return status;
            std::int64_t left = 0;
            for (std::int64_t i = 0; i < count; ++i) left += open(bounds.data() + i * quantities);
            if (left == 0) return Status::done;
            const std::int64_t parts = round == 0 ? asked_.first : asked_.parts;
            if (left * parts > asked_.most || round + 1 == asked_.rounds) break;
            Buffer<double> next;
            if (!room(points[other], start[other], width[other], next, left * parts)) return Status::no_memory;
            std::int64_t at = 0;
            for (std::int64_t i = 0; i < count; ++i) {
                if (!open(bounds.data() + i * quantities)) continue;
                divide(points[own].data() + i * size, parts, points[other].data() + at * size);
                for (std::int64_t part = 0; part < parts; ++part, ++at) {
                    start[other][std::size_t(at)] = start[own][std::size_t(i)] + width[own][std::size_t(i)] * double(part) / double(parts);
                    width[other][std::size_t(at)] = width[own][std::size_t(i)] / double(parts);
                }
            }
            count = left * parts, bounds.swap(next);
        }
        for (std::int64_t i = 0; i < count; ++i)
            for (int k = 0; k < quantities; ++k)
                if (wanted(k)) asked_.values[k] = std::max(asked_.values[k], bounds[std::size_t(i * quantities + k)]);
        return Status::done;
    }

private:
    bool wanted(int k) const { return (asked_.wanted >> k & 1) != 0; }

    bool open(const double *bounds) const {
        bool any = false;
        for (int k = 0; k < quantities; ++k) any = any || (wanted(k) && bounds[k] > asked_.values[k]);
        return any;
    }

    bool room(Buffer<double> &points, Buffer<double> &start, Buffer<double> &width, Buffer<double> &bounds, std::int64_t parts) const {
        const auto count = std::size_t(parts);
        return points.allocate(count * 12 * std::size_t(curve_.degree)) && start.allocate(count) && width.allocate(count) &&
               bounds.allocate(count * quantities);
    }

    // Into equal parts, a power of two, by halves.
    void divide(const double *points, std::int64_t parts, double *into) const {
        const int degree = curve_.degree, size = 12 * degree;
        std::copy(points, points + size, into);
        for (std::int64_t have = 1; have < parts; have *= 2)
            for (std::int64_t part = have - 1; part >= 0; --part) {
                double *const from = into + part * size, *const left = into + 2 * part * size, *const right = left + size;
                for (int row = 11; row >= 0; --row) halve(from + row * degree, degree, left + row * degree, right + row * degree);
            }
    }

    // Of one coordinate; the left half may take the place of the whole, and of what was divided before.
    static void halve(const double *whole, int count, double *left, double *right) {
        double rest[most_motion_points];
        std::copy(whole, whole + count, rest);
        for (int j = 0; j < count; ++j) {
            left[j] = rest[0], right[count - 1 - j] = rest[count - 1 - j];
            for (int k = 0; k + 1 < count - j; ++k) rest[k] = 0.5 * (rest[k] + rest[k + 1]);
        }
    }

    // Bounds of the quantities on parts.
    Status bound(const double *points, const double *start, const double *width, std::int64_t count, double *bounds) {
        Buffer<double> half, middle, heading;
        if (!half.allocate(std::size_t(count)) || !middle.allocate(std::size_t(count)) || !heading.allocate(std::size_t(6 * count)))
            return Status::no_memory;
        for (std::int64_t i = 0; i < count; ++i)
            half[std::size_t(i)] = 0.5 * width[i], middle[std::size_t(i)] = start[i] + half[std::size_t(i)];
        VehicleRecord record = {};
        record.parts = count, record.count = curve_.degree, record.mass = asked_.mass, record.jerk = asked_.jerk,
        record.medium = asked_.medium;
        record.inertia = asked_.inertia, record.mixer = asked_.mixer, record.points = points, record.half = half.data();
        record.bounds = bounds;
        if (asked_.heads != unknown) {
            const Status status = head(middle.data(), count, heading.data());
            if (status != Status::done) return status;
            (asked_.heads == by_yaw ? record.yaw : record.axes) = heading.data();
        }
        if (const auto status = Status(minsnap_vehicle_bounds(&record)); status != Status::done) return status;
        for (std::int64_t i = 0; i < count; ++i) {
            double *const own = bounds + i * quantities;
            const double tangent = own[2];
            own[0] /= medium_.gravity, own[1] /= medium_.gravity;
            own[2] = tangent < HUGE_VAL ? std::atan(std::sqrt(tangent)) : pi, own[3] = std::sqrt(own[3]);
            own[4] -= hover_, own[5] += hover_;
            for (int k = 0; k < quantities; ++k)
                if (own[k] != own[k]) own[k] = HUGE_VAL;
        }
        return Status::done;
    }

    Status raise_to_samples(const double *start, const double *width, std::int64_t count, const double *bounds) {
        std::int64_t left = 0;
        Buffer<double> t, values;
        if (!t.allocate(std::size_t(count)) || !values.allocate(std::size_t(count * quantities))) return Status::no_memory;
        for (std::int64_t i = 0; i < count; ++i)
            if (open(bounds + i * quantities)) t[std::size_t(left++)] = start[i] + 0.5 * width[i];
        if (left == 0) return Status::done;
        if (const Status status = sample(t.data(), left, values.data()); status != Status::done) return status;
        for (std::int64_t i = 0; i < left; ++i)
            for (int k = 0; k < quantities; ++k)
                if (const double here = values[std::size_t(i * quantities + k)] + asked_.finer[k]; wanted(k) && here > asked_.values[k])
                    asked_.values[k] = here;
        return Status::done;
    }

    // The heading at rising instants: cosine, sine, rate and acceleration of the yaw, (count, 4), or axes x and y of the body, (count, 2, 3).
    Status head(const double *t, std::int64_t count, double *heading) {
        if (asked_.heads == by_yaw) return turn(t, count, heading);
        Buffer<double> motion;
        if (!motion.allocate(std::size_t(6 * count))) return Status::no_memory;
        double *const velocity = motion.data(), *const acceleration = velocity + 3 * count;
        for (int order = 1; order <= 2; ++order)
            if (const Status status = evaluate_curve(curve_, order, t, count, order == 1 ? velocity : acceleration); status != Status::done)
                return status;
        for (std::int64_t i = 0; i < count; ++i) {
            const Space<double> x[4] = {of(velocity + 3 * i), of(acceleration + 3 * i), {}, {}};
            put(frame_.at(t[i], upright(Lift<double>(medium_, x, 0).force)), heading + 6 * i);
        }
        return Status::done;
    }

    Status turn(const double *t, std::int64_t count, double *heading) const {
        Buffer<double> clock, angles;
        if (!clock.allocate(std::size_t(count)) || !angles.allocate(std::size_t(3 * count))) return Status::no_memory;
        for (std::int64_t i = 0; i < count; ++i) clock[std::size_t(i)] = asked_.begin + asked_.rate * t[i];
        for (int order = 0; order < 3; ++order) {
            double *const own = angles.data() + order * count;
            std::fill(own, own + count, order == 0 ? asked_.angle : 0.0);
            if (asked_.yaw == nullptr) continue;
            if (const Status status = evaluate_curve(*asked_.yaw, order, clock.data(), count, own); status != Status::done) return status;
        }
        for (std::int64_t i = 0; i < count; ++i) {
            const double angle = angles[std::size_t(i)], rate = angles[std::size_t(count + i)], bend = angles[std::size_t(2 * count + i)];
            const double row[4] = {std::cos(angle), std::sin(angle), rate * asked_.rate, bend * asked_.rate * asked_.rate};
            std::copy(row, row + 4, heading + 4 * i);
        }
        return Status::done;
    }

    Space<double> upright(const Space<double> &force) const {
        return norm(force, 0.0) > CarriedSettings::free_fall * medium_.gravity ? force : Space<double>{0.0, 0.0, medium_.gravity};
    }

    static void put(const Frame &frame, double *axes) {
        const double row[6] = {frame.x.x, frame.x.y, frame.x.z, frame.y.x, frame.y.y, frame.y.z};
        std::copy(row, row + 6, axes);
    }

    // The quantities at rising instants, (count, 6); none are numbers where the attitude is singular.
    Status sample(const double *t, std::int64_t count, double *values) {
        Buffer<double> motion, heading;
        if (!motion.allocate(std::size_t(12 * count)) || !heading.allocate(std::size_t(6 * count))) return Status::no_memory;
        for (int order = 1; order <= 4; ++order)
            if (const Status status = evaluate_curve(curve_, order, t, count, motion.data() + (order - 1) * 3 * count);
                status != Status::done)
                return status;
        if (asked_.heads == by_yaw)
            if (const Status status = turn(t, count, heading.data()); status != Status::done) return status;
        side_ = 1.0, across_ = raised_ = 0.0, upright_ = true;
        for (std::int64_t i = 0; i < count; ++i) {
            Space<double> x[4];
            for (int q = 0; q < 4; ++q) x[q] = of(motion.data() + (q * count + i) * 3);
            if (!state(t[i], x, heading.data() + 4 * i, values + i * quantities))
                std::fill(values + i * quantities, values + (i + 1) * quantities, std::nan(""));
        }
        return Status::done;
    }

    // False where the attitude is singular.
    bool state(double t, const Space<double> *x, const double *heading, double *own) {
        const Lift<double> f(medium_, x, 2);
        const double size = norm(f.force, 0.0);
        if (!(size > CarriedSettings::free_fall * standard_gravity)) return false;
        const double thrust = f.thrust(medium_, size, x[0]);
        own[0] = thrust / medium_.gravity, own[1] = -own[0];
        own[2] = std::atan2(std::sqrt(f.force.x * f.force.x + f.force.y * f.force.y), f.force.z);
        own[3] = norm(cross(f.force, f.change), 0.0) / (size * size);
        own[4] = own[5] = -HUGE_VAL;
        if (asked_.heads == unknown) return true;
        Turning<double> turn;
        if (asked_.heads == unspun_body) {
            const Frame frame = frame_.at(t, f.force);
            turn = unspun(f, size, frame.x, frame.y);
        } else {
            const double c = heading[0], s = heading[1], rate = heading[2], bend = heading[3];
            const TurningHeading<double> faced = {
                {c, s, 0.0}, {-rate * s, rate * c, 0.0}, {-bend * s - rate * rate * c, bend * c - rate * rate * s, 0.0}};
            const Space<double> lateral = faced.across(f.force);
            const double reach = norm(lateral, 0.0);
            if (!(reach > parallel * size)) return false;
            turn = turning(medium_, f, size, faced);
            if (lies_over(faced, lateral, reach, f.force.z > 0.0))
                for (int axis = 0; axis < 2; ++axis) turn.rate[axis] = -turn.rate[axis], turn.change[axis] = -turn.change[axis];
        }
        double wrench[4];
        wrench_of(asked_.mass, asked_.inertia, thrust, turn, wrench);
        for (int i = 0; i < 4; ++i) {
            const double rotor = rotor_of(asked_.mixer + 4 * i, wrench);
            own[4] = std::max(own[4], rotor - hover_), own[5] = std::max(own[5], hover_ - rotor);
        }
        return true;
    }

    // Whether the lateral axis is the opposite one: both are right, and the one nearer to that before is taken where the body is not upright.
    bool lies_over(const TurningHeading<double> &faced, const Space<double> &lateral, double reach, bool upright) {
        const double across = (lateral.y * faced.direction.x - lateral.x * faced.direction.y) / reach, raised = lateral.z / reach;
        if (across * across_ + raised * raised_ < 0.0 && !(upright && upright_)) side_ = -side_;
        across_ = across, raised_ = raised, upright_ = upright;
        return side_ < 0.0;
    }

    static constexpr double pi = 3.141592653589793;

    const VehicleUseRecord &asked_;
    const PiecewiseCurve &curve_;
    const Medium medium_;
    CarriedFrame frame_;
    const double hover_;
    double side_ = 1.0, across_ = 0.0, raised_ = 0.0;
    bool upright_ = true;
};

Status begin(const VehicleUseRecord &asked) {
    const PiecewiseCurve *const curve = asked.curve;
    if (curve == nullptr || curve->pieces < 1 || curve->dim != 3 || curve->degree < 1 || curve->degree > most_motion_points)
        return Status::unsupported;
    if (asked.yaw != nullptr && (asked.yaw->dim != 1 || asked.yaw->pieces < 1)) return Status::bad_size;
    if (asked.heads < unknown || asked.heads > unspun_body || asked.samples < 1 || asked.samples > 1'000'000) return Status::bad_size;
    return curve->pieces > 100'000'000 / asked.samples ? Status::bad_size : Status::done;
}

}  // namespace
}  // namespace minsnap

// Largest samples and their instants; unsupported where an attitude is singular.
MINSNAP_EXPORT std::int32_t minsnap_vehicle_samples(const minsnap::VehicleUseRecord *asked) {
    using namespace minsnap;
    if (const Status status = begin(*asked); status != Status::done) return std::int32_t(status);
    VehicleUse use(*asked);
    const Status status = use.begin();
    return std::int32_t(status == Status::done ? use.sample() : status);
}

// Values, raised until bounds prove that none of those wanted goes beyond.
MINSNAP_EXPORT std::int32_t minsnap_vehicle_proof(const minsnap::VehicleUseRecord *asked) {
    using namespace minsnap;
    if (const Status status = begin(*asked); status != Status::done) return std::int32_t(status);
    if (asked->first < 1 || asked->parts < 1 || (asked->first & (asked->first - 1)) != 0 || (asked->parts & (asked->parts - 1)) != 0 ||
        asked->most < 0 || asked->rounds < 1)
        return std::int32_t(Status::bad_size);
    VehicleUse use(*asked);
    const Status status = use.begin();
    return std::int32_t(status == Status::done ? use.prove() : status);
}

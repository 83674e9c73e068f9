// The greatest and the least thrust over weight of a path without drag, its greatest tilt and body rate: with f = a / g + e3 and h = j / g the
// greatest |f|^2, -|f|^2, (fx^2 + fy^2) / fz^2 and |h x f|^2 / |f|^4, polynomials or quotients of polynomials on every piece. Pieces are halved
// where a bottom is near zero beside its greatest value, so that rounding of large forces hides no quotient of small ones.
//
// The greatest quotient p / q is the root t of max(p - t q) = 0; each step sets t to p / q where p - t q is greatest (W. Dinkelbach, "On nonlinear
// fractional programming", Management Science 13, 1967). At last p - t (1 + proved) q is proved to be nowhere positive. Control points times
// binomial coefficients multiply as coefficients of powers do (R. T. Farouki and V. T. Rajan, "Algorithms for polynomials in Bernstein form",
// Computer Aided Geometric Design 5, 1988).
#include <algorithm>
#include <new>

// As in certificate.cpp: short loops are slower when gcc vectorises them.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("no-tree-vectorize")
#endif

#include "basics/buffer.hpp"
#include "basics/export.hpp"
#include "basics/status.hpp"
#include "polynomials/enclosure.hpp"

namespace minsnap {
namespace {

enum class ThrustMeasure : std::int64_t { greatest, least, tilt, body_rate };

constexpr int most_degree = 64;  // of a quotient
constexpr double infinity = __builtin_huge_val();
constexpr double largest_force = 0x1p60;  // over weight, so that no product overflows
constexpr double no_direction = 1e-36;    // greatest bottom of a quotient of a thrust without direction
constexpr double least_share = 1e-5;      // of a bottom's greatest value: below it rounding hides quotients
constexpr double narrowest = 0x1p-44;     // part of a piece, on [0, 1]
constexpr int most_halved = 1024;         // parts of a piece
constexpr double proved = 1e-9;           // share above a greatest quotient that none is proved to exceed

// Control points times binomial coefficients.
struct Scaled {
    int degree = 0;
    double values[most_degree + 1] = {};

    void add_product(const Scaled &a, const Scaled &b, double sign = 1.0) {
        degree = a.degree + b.degree;
        for (int i = 0; i <= a.degree; ++i)
            for (int j = 0; j <= b.degree; ++j) values[i + j] += sign * a.values[i] * b.values[j];
    }

    double highest() const;  // control point

    double at(double s) const {
        double rest[most_degree + 1] = {1.0}, power = 1.0, sum = 0.0;
        for (int k = 1; k <= degree; ++k) rest[k] = rest[k - 1] * (1.0 - s);
        for (int k = 0; k <= degree; ++k, power *= s) sum += values[k] * (power * rest[degree - k]);
        return sum;
    }
};

Scaled one(int degree) {
    Scaled made;
    made.degree = degree;
    binomial_row(degree, made.values);
    return made;
}

double Scaled::highest() const {
    const Scaled weights = one(degree);
    double found = values[0];
    for (int k = 1; k <= degree; ++k) found = std::max(found, values[k] / weights.values[k]);
    return found;
}

// By de Casteljau's algorithm: the part becomes its left half, the right one comes back.
Scaled halve(Scaled &part) {
    const Scaled weights = one(part.degree);
    Scaled right = part;
    for (int k = 0; k <= part.degree; ++k) right.values[k] /= weights.values[k];
    for (int level = 0; level <= part.degree; ++level) {
        part.values[level] = weights.values[level] * right.values[0];
        for (int k = 0; k < part.degree - level; ++k) right.values[k] = 0.5 * (right.values[k] + right.values[k + 1]);
    }
    for (int k = 0; k <= part.degree; ++k) right.values[k] *= weights.values[k];
    return right;
}

// Force over weight and its change on a part of a piece.
struct Motion {
    double low = 0.0, width = 1.0;
    Scaled force[3], change[3];
};

// On a part; of a polynomial the top alone.
struct Quotient {
    Scaled top, bottom;
};

class ThrustAxis {
public:
    ThrustAxis(const Pieces &pieces, double gravity) : pieces_(pieces), gravity_(gravity) {}

    // The greatest value, the piece and the place on [0, 1].
    Status measure(ThrustMeasure what, double *found) {
        if (!memory_.allocate(1)) return Status::no_memory;
        const bool plain = what <= ThrustMeasure::least;
        Greatest best{-infinity, -infinity, 0.0, 0};
        for (std::int64_t piece = 0; piece < pieces_.count; ++piece) {
            Motion whole;
            Quotient own;
            if (!derivatives(piece, 2, whole.force) || !derivatives(piece, 3, whole.change)) return Status::unsupported;
            const Scaled up = one(whole.force[2].degree);
            for (int k = 0; k <= up.degree; ++k) whole.force[2].values[k] += up.values[k];
            if (!lay_out(whole, what, own)) return Status::unsupported;
            climb_ = new (memory_.data()) Climb<-1, most_degree>(own.top.degree);
            halved_ = 0;
            if (plain)
                raise(best, own.top, piece);
            else if (!raise_quotient(best, whole, what, piece))
                return Status::unsupported;
        }
        found[0] = plain ? best.bound : best.attained, found[1] = double(best.row), found[2] = best.s;
        return Status::done;
    }

private:
    // False where the force points down, if its tilt is asked for.
    static bool lay_out(const Motion &part, ThrustMeasure measure, Quotient &made) {
        const Scaled *force = part.force, *change = part.change;
        Scaled square;
        for (int d = 0; d < 3; ++d) square.add_product(force[d], force[d]);
        switch (measure) {
            case ThrustMeasure::greatest: made.top = square; break;
            case ThrustMeasure::least: made.top.add_product(square, one(0), -1.0); break;
            case ThrustMeasure::tilt:
                if (!(force[2].values[0] > 0.0)) return false;
                made.top.add_product(force[0], force[0]);
                made.top.add_product(force[1], force[1]);
                made.bottom.add_product(force[2], force[2]);
                break;
            case ThrustMeasure::body_rate: {
                Scaled turning;
                for (int d = 0; d < 3; ++d) {
                    const int next = (d + 1) % 3, last = (d + 2) % 3;
                    Scaled cross;
                    cross.add_product(change[next], force[last]);
                    cross.add_product(change[last], force[next], -1.0);
                    turning.add_product(cross, cross);
                }
                made.bottom.add_product(square, square);
                made.top.add_product(turning, one(made.bottom.degree - turning.degree));
            }
        }
        return true;
    }

    // Derivatives over gravity; false where they are too large.
    bool derivatives(std::int64_t piece, int order, Scaled *made) const {
        Curve curve;
        derivative(pieces_, piece, order, curve);
        const Scaled weights = one(curve.degree);
        for (int d = 0; d < 3; ++d) {
            made[d].degree = curve.degree;
            for (int k = 0; k <= curve.degree; ++k) {
                const double value = curve.value[d][k] / gravity_;
                if (!(std::fabs(value) < largest_force)) return false;
                made[d].values[k] = weights.values[k] * value;
            }
        }
        return true;
    }

    // Raise what is known by quotients on a part; those of a thrust without direction are infinite. False where the force points down.
    bool raise_quotient(Greatest &best, Motion &part, ThrustMeasure what, std::int64_t piece) {
        Quotient own;
        if (!lay_out(part, what, own)) return false;
        if (settled(best, own, part, piece)) return true;
        if (part.width <= narrowest || ++halved_ > most_halved || !(own.bottom.highest() > no_direction)) {
            best.attain(infinity, part.low, piece);
            return true;
        }
        Motion right;
        for (int d = 0; d < 3; ++d) right.force[d] = halve(part.force[d]), right.change[d] = halve(part.change[d]);
        right.width = part.width = 0.5 * part.width;
        right.low = part.low + part.width;
        return raise_quotient(best, part, what, piece) && raise_quotient(best, right, what, piece);
    }

    // Whether the greatest quotient on a part is known, or not needed.
    bool settled(Greatest &best, const Quotient &own, const Motion &part, std::int64_t piece) {
        if (best.attained == infinity) return true;
        const Quotient missing{{own.bottom.degree}, own.bottom};
        if (!(greatest(missing, 1.0).bound < -least_share * own.bottom.highest())) return false;
        best.attain(own.top.values[0] / own.bottom.values[0], part.low, piece);
        for (;;) {
            const double trial = best.attained;
            const Greatest here = greatest(own, trial);
            if (here.bound <= 0.0) return true;
            const double ratio = own.top.at(here.s) / own.bottom.at(here.s);
            if (!(ratio > trial + 8.0 * unit * trial)) return greatest(own, trial * (1.0 + proved)).bound <= 0.0;
            best.attain(ratio, part.low + here.s * part.width, piece);
        }
    }

    // Of top - factor bottom.
    Greatest greatest(const Quotient &own, double factor) {
        Scaled sum = own.top;
        for (int j = 0; j <= sum.degree; ++j) sum.values[j] -= factor * own.bottom.values[j];
        Greatest best{-infinity, -infinity, 0.0, 0};
        raise(best, sum, 0);
        return best;
    }

    // Raise what is known by a polynomial.
    void raise(Greatest &best, Scaled polynomial, std::int64_t piece) {
        static constexpr double exact[most_degree + 1] = {};
        const Scaled weights = one(polynomial.degree);
        for (int j = 0; j <= polynomial.degree; ++j) polynomial.values[j] /= weights.values[j];
        climb_->raise(best, polynomial.values, exact, piece);
    }

    const Pieces pieces_;
    double gravity_;
    Buffer<Climb<-1, most_degree>> memory_;
    Climb<-1, most_degree> *climb_ = nullptr;
    int halved_ = 0;
};

}  // namespace
}  // namespace minsnap

// The greatest values of `count` measures of a path in space: per measure (value, piece, s). Unsupported where the thrust points down.
MINSNAP_EXPORT std::int32_t minsnap_thrust_axis(std::int64_t pieces, std::int64_t degree, const double *points, const double *durations,
                                                double gravity, std::int64_t count, const std::int64_t *measures, double *found) {
    using namespace minsnap;
    const Pieces path{points, durations, pieces, static_cast<int>(degree), 3};
    if (pieces < 1 || degree < 0 || 4 * (degree - 2) > most_degree || !path.sound()) return static_cast<std::int32_t>(Status::unsupported);
    ThrustAxis axis(path, gravity);
    Status status = Status::done;
    for (std::int64_t k = 0; k < count && status == Status::done; ++k) status = axis.measure(ThrustMeasure(measures[k]), found + 3 * k);
    return static_cast<std::int32_t>(status);
}

// The greatest and the least thrust over weight of a path without drag, its greatest tilt and body rate: with f = a / g + e3 and h = j / g the
// greatest |f|^2, -|f|^2, (fx^2 + fy^2) / fz^2 and |h x f|^2 / |f|^4, polynomials or quotients of polynomials on every piece.
//
// The greatest quotient p / q is the root t of max(p - t q) = 0; each step sets t to p / q where p - t q is greatest (W. Dinkelbach, "On nonlinear
// fractional programming", Management Science 13, 1967), at last p - t (1 + proved) q is proved to be nowhere positive. Control points times binomial coefficients multiply as coefficients of powers do
// (R. T. Farouki and V. T. Rajan, "Algorithms for polynomials in Bernstein form", Computer Aided Geometric Design 5, 1988).
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
constexpr double least_bottom = 1e-48;    // of a quotient: below it thrust has no direction
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

// On one piece; of a polynomial the top alone.
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
            Quotient own;
            if (!lay_out(piece, what, own)) return Status::unsupported;
            climb_ = new (memory_.data()) Climb<-1, most_degree>(own.top.degree);
            if (plain)
                raise(best, own.top, piece);
            else if (!raise_quotient(best, own, piece))
                return Status::unsupported;
        }
        found[0] = plain ? best.bound : best.attained, found[1] = double(best.row), found[2] = best.s;
        return Status::done;
    }

private:
    // False where the force is too large, or points down where its tilt is asked for.
    bool lay_out(std::int64_t piece, ThrustMeasure measure, Quotient &made) const {
        Scaled force[3], square;
        if (!derivatives(piece, 2, force)) return false;
        const Scaled up = one(force[2].degree);
        for (int k = 0; k <= up.degree; ++k) force[2].values[k] += up.values[k];
        for (const Scaled &part : force) square.add_product(part, part);
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
                Scaled change[3], turning;
                if (!derivatives(piece, 3, change)) return false;
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

    // Derivatives over gravity.
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

    // False where the thrust has no direction, or rounding hides which value is the greatest: those of other pieces are not mixed in.
    bool raise_quotient(Greatest &best, const Quotient &own, std::int64_t piece) {
        const Quotient missing{{own.bottom.degree}, own.bottom};
        if (!(greatest(missing, 1.0).bound < -least_bottom)) return false;
        best.attain(own.top.values[0] / own.bottom.values[0], 0.0, piece);
        for (;;) {
            const double trial = best.attained;
            const Greatest here = greatest(own, trial);
            if (here.bound <= 0.0) return true;
            const double ratio = own.top.at(here.s) / own.bottom.at(here.s);
            if (!(ratio > trial + 8.0 * unit * trial)) return greatest(own, trial * (1.0 + proved)).bound <= 0.0;
            best.attain(ratio, here.s, piece);
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
};

}  // namespace
}  // namespace minsnap

// The greatest values of `count` measures of a path in space: per measure (value, piece, s). Unsupported where the thrust has no direction.
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

// What holds of a trajectory over all time: least distances to walls, greatest norms, continuity; and the greatest
// values and local maxima of polynomials that are given by their control points. Everything but local maxima is proved
// with running error bounds: the bound that is returned is on the safe side of the exact value.
#include <algorithm>
#include <cstdint>
#include <new>

// gcc 12 makes the short loops over control points a third slower when it vectorises them (measured).
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("no-tree-vectorize")
#endif

#include "basics/border.hpp"
#include "basics/buffer.hpp"
#include "certificate/proof.hpp"
#include "polynomials/enclosure.hpp"
#include "basics/export.hpp"
#include "polynomials/extrema.hpp"
#include "basics/status.hpp"
#include "polynomials/summits.hpp"

namespace minsnap {
namespace {

using Integer = std::int64_t;

constexpr Integer max_count = Integer{1} << 40;  // of values in any array
constexpr double infinity = __builtin_huge_val();

template <int Degree, class Job>
Status with_climb(int degree, Job &job) {
    Buffer<Climb<Degree>> memory;
    if (!memory.allocate(1)) return Status::no_memory;
    return job(*new (memory.data()) Climb<Degree>(degree));
}

// Run a job with a search for polynomials of that degree; the degrees of usual trajectories are known to the compiler.
template <class Job>
Status for_degree(int degree, Job job) {
    switch (degree) {
        case 5: return with_climb<5>(degree, job);
        case 6: return with_climb<6>(degree, job);
        case 7: return with_climb<7>(degree, job);
        case 8: return with_climb<8>(degree, job);
        case 9: return with_climb<9>(degree, job);
        case 10: return with_climb<10>(degree, job);
        case 11: return with_climb<11>(degree, job);
        case 12: return with_climb<12>(degree, job);
        case 14: return with_climb<14>(degree, job);
        default: return with_climb<-1>(degree, job);
    }
}

Status check(const Pieces &pieces, Integer degree, Integer dim) {
    if (pieces.count < 1 || degree < 0 || degree > max_curve_degree || dim < 1 || dim > max_curve_dim) return Status::bad_size;
    const Integer values = (degree + 1) * dim;
    if (pieces.count > max_count / values) return Status::bad_size;
    return pieces.sound() ? Status::done : Status::bad_number;
}

Status check_walls(const Pieces &pieces, const ExcessRecord &given, const WallsRecord &walls) {
    const Status checked = check(pieces, given.degree, given.dim);
    if (checked != Status::done) return checked;
    if (given.per_leg < 1 || pieces.count % given.per_leg != 0 || walls.count < 1 || walls.count > max_count) return Status::bad_size;
    if (walls.rows < 0 || walls.rows > max_curve_dim) return Status::bad_size;
    if (walls.order < 0 || walls.order > max_order) return Status::unsupported;
    for (Integer i = 0; i < walls.count; ++i) {
        if (walls.leg[i] < 0 || walls.leg[i] >= pieces.count / given.per_leg) return Status::bad_size;
        if (walls.rows == 0 && !(walls.radius[i] > -infinity)) return Status::bad_number;
    }
    const Integer numbers = walls.count * given.dim;
    for (Integer i = 0; walls.rows > 0 && i < numbers; ++i)
        if (walls.slope[i] != 0.0) return Status::unsupported;
    const bool fits = within(walls.slope, numbers, longest_normal) && within(walls.anchor, numbers, longest_vector) &&
                      (walls.rows == 0 ||
                       (within(walls.matrix, numbers * walls.rows, longest_normal) && within(walls.radius, walls.count, longest_vector)));
    return fits ? Status::done : Status::bad_number;
}

// Whether planes are pairs that face each other, the first half of all with the second.
bool are_pairs(const WallsRecord &planes, Integer dim) {
    const Integer half = planes.count / 2;
    if (planes.count % 2 != 0) return false;
    for (Integer i = 0; i < half * dim; ++i) {
        const Integer other = i + half * dim;
        if (planes.slope[i] != -planes.slope[other] || planes.anchor[i] != planes.anchor[other]) return false;
    }
    return std::equal(planes.leg, planes.leg + half, planes.leg + half);
}

// Raise what is known by sign component - bound, unless the bound is infinite.
template <class Search>
void climb_beyond(Search &climb, const Scalar &component, double bound, double sign, Integer row, Greatest &best) {
    if (!(bound < infinity)) return;
    Scalar excess;
    if (!beyond(component, bound, sign, best, excess)) climb.raise(best, excess.value, excess.error, row);
}

void report(const Greatest &best, double *values, Integer *row) {
    values[0] = best.attained;
    values[1] = best.bound;
    values[2] = best.s;
    *row = best.row;
}

Status report(const Greatest &best, ExcessRecord &found) {
    found.attained = best.attained, found.bound = best.bound, found.where = best.s, found.row = best.row;
    return Status::done;
}

// Upper bounds on the squared norms of derivatives of every piece: (orders, pieces), the orders ascending.
void derivative_hulls(const Pieces &pieces, int orders, const Integer *order, double *hulls) {
    const int n = pieces.degree, dim = pieces.dim;
    double value[(max_curve_degree + 1) * max_curve_dim], error[(max_curve_degree + 1) * max_curve_dim];
    for (Integer piece = 0; piece < pieces.count; ++piece) {
        int left = (n + 1) * dim, taken = 0;
        for (int j = 0; j < left; ++j) {
            value[j] = pieces.points[piece * left + j];
            error[j] = 0.0;
        }
        double factor = 1.0;
        for (int k = 0; k < orders; ++k) {
            for (; taken < order[k]; ++taken) {
                left -= left > 0 ? dim : 0;
                factor *= (n - taken) / pieces.durations[piece];
                for (int j = 0; j < left; ++j) {
                    value[j] = value[j + dim] - value[j];
                    error[j] += error[j + dim] + unit * std::fabs(value[j]);
                }
            }
            double highest = 0.0;
            for (int j = 0; j < left; j += dim) {
                double sum = 0.0;
                for (int d = 0; d < dim; ++d) {
                    const double size = std::fabs(value[j + d]) + error[j + d];
                    sum += size * size;
                }
                if (sum > highest) highest = sum;
            }
            hulls[k * pieces.count + piece] = highest * factor * factor * (1.0 + 0x1p-40);
        }
    }
}

// The greatest squared norm of a derivative; pieces whose control points stay below what is known are passed over.
template <class Search>
Status largest_norm(Search &climb, const Pieces &pieces, int order, int degree, const double *hulls, double *values, Integer *piece) {
    Integer first = 0;
    for (Integer i = 1; i < pieces.count; ++i) {
        if (hulls[i] > hulls[first]) first = i;
    }
    if (!(hulls[first] < 0x1p900)) return Status::unsupported;
    const Binomials binomials(degree);
    Curve curve;
    Scalar square;
    Greatest best{0.0, 0.0, 0.0, first};
    for (Integer k = 0; k < pieces.count; ++k) {
        const Integer i = k == 0 ? first : k <= first ? k - 1 : k;
        if (best.reaches(hulls[i])) {
            best.admit(hulls[i]);
            continue;
        }
        derivative(pieces, i, order, curve);
        squared_norm(curve, binomials.single, binomials.doubled, square);
        climb.raise(best, square.value, square.error, i);
    }
    report(best, values, piece);
    return Status::done;
}

double larger(double a, double b) { return a > b ? a : b; }

// Jumps of derivatives at knots, (degree + 1, pieces), and the largest control point of each derivative; of positions
// the largest distance of a coordinate from the first.
void knot_jumps(const Pieces &pieces, double *jumps, double *sizes) {
    const int n = pieces.degree, dim = pieces.dim;
    double value[(max_curve_degree + 1) * max_curve_dim], ends[(max_curve_degree + 1) * max_curve_dim] = {};
    for (Integer piece = 0; piece < pieces.count; ++piece) {
        int left = (n + 1) * dim;
        for (int j = 0; j < left; ++j) value[j] = pieces.points[piece * left + j];
        for (int order = 0; order <= n; ++order, left -= dim) {
            double jump = 0.0;
            for (int d = 0; d < dim; ++d) {
                jump = larger(jump, std::fabs(value[d] - ends[order * dim + d]));
                ends[order * dim + d] = value[left - dim + d];
            }
            if (piece > 0) jumps[order * pieces.count + piece - 1] = jump;
            double size = sizes[order];
            for (int j = 0; j < left; ++j) { size = larger(size, std::fabs(order > 0 ? value[j] : value[j] - pieces.points[j % dim])); }
            sizes[order] = size;
            const double factor = (n - order) / pieces.durations[piece];
            for (int j = 0; j + dim < left; ++j) value[j] = factor * (value[j + dim] - value[j]);
        }
    }
}

Integer place(Integer wall, Integer piece, Integer per_leg) { return wall * per_leg + piece; }

// Two planes that face each other are measured at once: both bound what is along the slope of the second.
template <class Search>
Status planes_excess(Search &climb, const Pieces &pieces, const WallsRecord &planes, ExcessRecord &found) {
    const Integer half = are_pairs(planes, pieces.dim) ? planes.count / 2 : 0;
    Relative relative(pieces);
    Scalar component;
    Greatest best{-infinity, -infinity, 0.0, 0};
    for (Integer wall = 0; wall < planes.count - half; ++wall)
        for (Integer part = 0; part < found.per_leg; ++part) {
            const Integer own = wall + half, row = place(wall, part, found.per_leg);
            along(relative(planes.leg[own] * found.per_leg + part, int(planes.order), planes.anchor + own * pieces.dim),
                  planes.slope + own * pieces.dim, component);
            if (half > 0) climb_beyond(climb, component, planes.radius[wall], 1.0, row, best);
            climb_beyond(climb, component, planes.radius[own], -1.0, row, best);
        }
    return report(best, found);
}

template <class Search>
Status balls_excess(Search &climb, const Pieces &pieces, const WallsRecord &balls, int degree, ExcessRecord &found) {
    const Binomials binomials(degree);
    const Integer dim = pieces.dim;
    Relative relative(pieces);
    Curve mapped;
    Scalar square;
    Greatest best{-infinity, -infinity, 0.0, 0};
    for (Integer ball = 0; ball < balls.count; ++ball)
        for (Integer part = 0; part < found.per_leg; ++part) {
            const Curve &curve = relative(balls.leg[ball] * found.per_leg + part, int(balls.order), balls.anchor + ball * dim);
            if (!map(curve, balls.matrix + ball * balls.rows * dim, int(balls.rows), mapped)) return Status::bad_number;
            squared_norm(mapped, binomials.single, binomials.doubled, square);
            climb_ball(climb, square, balls.radius[ball], place(ball, part, found.per_leg), best);
        }
    return report(best, found);
}

}  // namespace

Status find_continuity(const Pieces &pieces, double exact, double rounding, Integer &continuity) {
    const Integer count = pieces.count, degree = pieces.degree;
    const double *const points = pieces.points, *const durations = pieces.durations;
    Buffer<double> jumps;
    if (!jumps.allocate(std::size_t(count * (degree + 1)))) return Status::no_memory;
    double largest_point = 0.0, sizes[max_curve_degree + 1] = {};
    for (Integer i = 0; i < count * (degree + 1) * pieces.dim; ++i) {
        largest_point = std::fabs(points[i]) > largest_point ? std::fabs(points[i]) : largest_point;
    }
    knot_jumps(pieces, jumps.data(), sizes);
    for (Integer order = 0; order <= degree; ++order) {
        for (Integer knot = 0; knot + 1 < count; ++knot) {
            const double shorter = durations[knot] < durations[knot + 1] ? durations[knot] : durations[knot + 1];
            const double jump = jumps[order * count + knot];
            if (jump <= exact * sizes[order]) continue;
            double allowed = std::fmax(rounding * largest_point, steps_below);
            for (Integer p = 0; p < order; ++p) allowed *= (degree - p) * 2.0 / shorter;
            if (jump <= exact * sizes[order] + allowed) continue;
            continuity = order - 1;
            return Status::done;
        }
    }
    continuity = degree;
    return Status::done;
}

void binomial_row(int n, double *row) {
    row[0] = 1.0;
    for (int j = 1; j <= n; ++j) row[j] = 0.0;
    for (int m = 1; m <= n; ++m) {
        for (int j = m; j >= 1; --j) row[j] += row[j - 1];
    }
}

}  // namespace minsnap

using namespace minsnap;

// The greatest value of each group of polynomials on [0, 1]: points and errors (groups * rows, degree + 1); errors may
// be null. Per group: values (attained, bound, s) and the row that attains it.
MINSNAP_EXPORT std::int32_t minsnap_maxima(Integer groups, Integer rows, Integer degree, const double *points, const double *errors,
                                           double *values, Integer *row) {
    auto job = [&](auto &climb) {
        static const double zeros[max_scalar_degree + 1] = {};
        for (Integer group = 0; group < groups; ++group) {
            Greatest best{-infinity, -infinity, 0.0, group * rows};
            for (Integer i = group * rows; i < (group + 1) * rows; ++i) {
                climb.raise(best, points + i * (degree + 1), errors ? errors + i * (degree + 1) : zeros, i);
            }
            report(best, values + 3 * group, row + group);
        }
        return Status::done;
    };
    if (groups < 1 || rows < 1 || degree < 0 || degree > max_scalar_degree) return int(Status::bad_size);
    if (groups > max_count / (degree + 1) || rows > max_count / (groups * (degree + 1))) return int(Status::bad_size);
    const Integer count = groups * rows * (degree + 1);
    if (!within(points, count, longest_vector * longest_vector)) return int(Status::bad_number);
    if (errors && !within(errors, count, longest_vector * longest_vector)) return int(Status::bad_number);
    return int(for_degree(int(degree), job));
}

// The greatest norm of derivatives: per order values (attained, bound, s) of the squared norm over scale^2, the piece,
// and the scale, a power of two.
MINSNAP_EXPORT std::int32_t minsnap_largest_norms(Integer count, Integer degree, Integer dim, const double *points, const double *durations,
                                                  Integer orders, const Integer *order, double *values, Integer *piece) {
    const Pieces pieces{points, durations, count, int(degree), int(dim)};
    const Status checked = check(pieces, degree, dim);
    if (checked != Status::done) return int(checked);
    if (orders < 1 || orders > max_order) return int(Status::bad_size);
    if (orders < 1 || orders > max_order) return int(Status::bad_size);
    for (Integer k = 0; k < orders; ++k) {
        if (order[k] < 0 || order[k] > max_order) return int(Status::unsupported);
    }
    Buffer<double> hulls;
    if (!hulls.allocate(std::size_t(count * orders))) return int(Status::no_memory);
    derivative_hulls(pieces, int(orders), order, hulls.data());
    for (Integer k = 0; k < orders; ++k) {
        const int p = int(order[k]), n = p <= degree ? int(degree) - p : 0;
        auto job = [&](auto &climb) { return largest_norm(climb, pieces, p, n, hulls.data() + k * count, values + 3 * k, piece + k); };
        const Status done = for_degree(2 * n, job);
        if (done != Status::done) return int(done);
    }
    return int(Status::done);
}

// The greatest excess over planes or balls, each on the pieces of its leg; cones are not supported.
MINSNAP_EXPORT std::int32_t minsnap_excess(const WallsRecord *walls, ExcessRecord *asked) {
    const Pieces pieces{asked->points, asked->durations, asked->pieces, int(asked->degree), int(asked->dim)};
    const Status checked = check_walls(pieces, *asked, *walls);
    if (checked != Status::done) return int(checked);
    const int n = walls->order <= asked->degree ? int(asked->degree - walls->order) : 0;
    if (walls->rows == 0) return int(for_degree(n, [&](auto &climb) { return planes_excess(climb, pieces, *walls, *asked); }));
    return int(for_degree(2 * n, [&](auto &climb) { return balls_excess(climb, pieces, *walls, n, *asked); }));
}

// The highest order up to which the derivatives on both sides of every knot agree: to `exact` of their largest control
// point, and to what the rounding of positions, `rounding` of the largest, becomes when it is differentiated.
MINSNAP_EXPORT std::int32_t minsnap_continuity(Integer count, Integer degree, Integer dim, const double *points, const double *durations,
                                               double exact, double rounding, Integer *continuity) {
    const Pieces pieces{points, durations, count, int(degree), int(dim)};
    const Status checked = check(pieces, degree, dim);
    if (checked != Status::done) return int(checked);
    return int(find_continuity(pieces, exact, rounding, *continuity));
}

// Local maxima higher than `level` of polynomials (rows, degree + 1): row, s and value of each, `found` in all. At most
// `capacity` are kept; rows * (degree / 2 + 2) is always enough.
MINSNAP_EXPORT std::int32_t minsnap_local_maxima(Integer rows, Integer degree, const double *points, double level, Integer capacity,
                                                 Integer *row, double *s, double *value, Integer *found) {
    if (rows < 1 || degree < 0 || degree > max_scalar_degree || capacity < 0) return int(Status::bad_size);
    if (rows > max_count / (degree + 1)) return int(Status::bad_size);
    if (!within(points, rows * (degree + 1), longest_vector * longest_vector)) return int(Status::bad_number);
    Buffer<Summits> memory;
    if (!memory.allocate(1)) return int(Status::no_memory);
    Summits &summits = *new (memory.data()) Summits(int(degree));
    *found = 0;
    for (Integer i = 0; i < rows; ++i) {
        const bool room = summits.each(points + i * (degree + 1), level, [&](double where, double height) {
            if (*found == capacity) return false;
            row[*found] = i;
            s[*found] = where;
            value[*found] = height;
            ++*found;
            return true;
        });
        if (!room) return int(Status::bad_size);
    }
    return int(Status::done);
}

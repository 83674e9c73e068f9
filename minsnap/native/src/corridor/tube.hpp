// A tube around the legs as walls and units of a request; every curve from rest to rest in it, and how its cost changes.
#pragma once

#include <cmath>
#include <cstdint>

#include "arithmetic/elementary.hpp"
#include "chain/cost_slopes.hpp"
#include "corridor/exchange_solver.hpp"
#include "chain/unconstrained.hpp"

namespace minsnap {

// What is given: points (legs + 1, dim) [m], durations (legs,) [s], half-widths [m], the first for all if they are shared.
struct TubeProblem {
    const double *points, *durations, *widths;
    std::int64_t legs;
    int dim, half;
    bool shared;

    double width(std::int64_t leg) const { return widths[shared ? 0 : leg]; }
};

// A row of the projection that is shorter than this is one of a leg along that axis.
constexpr double rounding = 1e-12;

class TubeWalls {
public:
    double length = 0.0, time = 0.0;  // mean length of a leg, geometric mean of the durations

    // Two walls for each leg and axis across it. A status other than done if a number is out of range or a leg has no length.
    Status make(const TubeProblem &given) {
        const std::size_t most = std::size_t(given.legs) * given.dim * 2 + 1;
        if (!piece_.allocate(most) || !order_.allocate(most) || !normal_.allocate(most * given.dim) ||
            !anchor_.allocate(most * given.dim) || !bound_.allocate(most) || !axis_.allocate(most))
            return Status::no_memory;
        for (std::int64_t leg = 0; leg < given.legs; ++leg) {
            const double duration = given.durations[leg], width = given.width(leg);
            if (!(duration >= shortest_duration && duration <= longest_duration)) return Status::bad_number;
            if (!(width >= smallest_number && width <= largest_number)) return Status::bad_number;
            if (!around(given, leg)) return Status::bad_number;
        }
        length /= double(given.legs), time = typical_time(given.durations, given.legs);
        return Status::done;
    }

    GivenWalls walls() const {
        return {count_, piece_.data(), order_.data(), normal_.data(), anchor_.data(), bound_.data(), bound_.data(), nullptr, 0};
    }

    // The axis across which a wall stands; walls come in pairs, first the one on the positive side.
    int axis_of(std::int64_t wall) const { return axis_[wall]; }
    static double sign_of(std::int64_t wall) { return wall % 2 == 0 ? 1.0 : -1.0; }

private:
    bool around(const TubeProblem &given, std::int64_t leg) {
        const double *from = given.points + leg * given.dim;
        double along[max_dim], square = 0.0, largest = 0.0;
        for (int axis = 0; axis < given.dim; ++axis) {
            largest = std::fmax(largest, std::fmax(std::fabs(from[axis]), std::fabs(from[given.dim + axis])));
            along[axis] = from[given.dim + axis] - from[axis];
            square += along[axis] * along[axis];
        }
        const double size = std::sqrt(square);
        if (!(size > 0.0 && largest <= largest_number)) return false;
        length += size;
        for (int axis = 0; axis < given.dim; ++axis) along[axis] /= size;
        for (int axis = 0; axis < given.dim; ++axis) add_pair(given, leg, axis, along);
        return true;
    }

    // |e_axis . (I - u u') (r - r_leg)| <= width.
    void add_pair(const TubeProblem &given, std::int64_t leg, int axis, const double *along) {
        double row[max_dim], largest = 0.0;
        for (int other = 0; other < given.dim; ++other) {
            row[other] = (other == axis ? 1.0 : 0.0) - along[axis] * along[other];
            largest = std::fabs(row[other]) > largest ? std::fabs(row[other]) : largest;
        }
        if (largest <= rounding) return;
        for (int sign = 1; sign >= -1; sign -= 2, ++count_) {
            piece_[count_] = leg, order_[count_] = 0, axis_[count_] = axis, bound_[count_] = given.width(leg);
            for (int other = 0; other < given.dim; ++other) {
                normal_[count_ * given.dim + other] = sign * row[other];
                anchor_[count_ * given.dim + other] = given.points[leg * given.dim + other];
            }
        }
    }

    std::int64_t count_ = 0;
    Buffer<std::int64_t> piece_, order_;
    Buffer<int> axis_;
    Buffer<double> normal_, anchor_, bound_;
};

// Where an answer is written.
class TubeAnswer {
public:
    Answer answer;

    [[nodiscard]] bool allocate(const TubeProblem &given, double *points) {
        const std::size_t state = std::size_t(given.half) * given.dim, most = given.legs * state + 2;
        const bool found =
            knots_.allocate((given.legs + 1) * state) && wall_.allocate(most) && s_.allocate(most) && multiplier_.allocate(most);
        answer = {points, knots_.data(), wall_.data(), s_.data(), multiplier_.data(), 0.0, 0.0, 0.0, 0, 0};
        return found;
    }

private:
    Buffer<double> knots_, s_, multiplier_;
    Buffer<std::int64_t> wall_;
};

// Make the walls, and the request to stay inside of them from rest to rest; a status other than done if there is none.
inline Status request_tube(const TubeProblem &given, double gap, TubeWalls &walls, Request &request) {
    if (!corridor_sizes_fit(given.half, given.legs, given.dim, 2 * given.legs * given.dim)) return Status::bad_size;
    const Status status = walls.make(given);
    if (status != Status::done) return status;
    request = {given.half,   int(given.legs), given.dim, false,   walls.length,  walls.time,
               given.points, given.durations, nullptr,   nullptr, walls.walls(), gap};
    return check_request(request);
}

// Find the curve of least cost, proved to be inside; points (legs, 2k, dim). longest: where double precision does not end
// with a proof, try double-double arithmetic too.
inline Status solve_tube(const TubeProblem &given, double gap, bool longest, double *points, TubeWalls &walls, TubeAnswer &found) {
    Request request = {};
    const Status status = request_tube(given, gap, walls, request);
    if (status != Status::done) return status;
    if (!found.allocate(given, points)) return Status::no_memory;
    std::int64_t attempts = 0;
    return longest ? solve_request(request, found.answer, attempts) : solve_in_double(request, found.answer);
}

// What a normalised cost is worth [m^2/s^(2k-1)].
inline double cost_unit(const TubeProblem &given, const TubeWalls &walls) {
    return walls.length * walls.length / power(walls.time, 2 * given.half - 1);
}

// Derivatives of the optimal cost of a tube in durations (legs,), displacements of legs (legs, dim) and half-widths
// (legs,), by the envelope theorem: the derivatives at the knots and the multipliers are held. A wall of axis a has the
// normal n = e_a - u_a u, which turns with its leg: for a point r from the leg's start, d(n . r) = h . du with
// h = -(u . r) e_a - u_a r, and du = (I - u u') dd / |d|.
template <int half>
class TubeSlopes {
public:
    TubeSlopes(const TubeProblem &given, const TubeWalls &walls, const Answer &answer) : given_(given), walls_(walls), answer_(answer) {}

    void write(double *durations, double *displacements, double *widths) const {
        const double unit = cost_unit(given_, walls_);
        for (std::int64_t leg = 0; leg < given_.legs; ++leg) {
            durations[leg] = of_leg(leg, displacements + leg * given_.dim);
            widths[leg] = 0.0;
        }
        for (int row = 0; row < int(answer_.rows); ++row) {
            const std::int64_t leg = walls_.walls().piece[answer_.wall[row]];
            durations[leg] += of_row(row, leg, displacements + leg * given_.dim);
            widths[leg] -= answer_.multiplier[row];
        }
        for (std::int64_t leg = 0; leg < given_.legs; ++leg) {
            durations[leg] *= unit / given_.durations[leg];
            widths[leg] *= unit / walls_.length;
            for (int d = 0; d < given_.dim; ++d) displacements[leg * given_.dim + d] *= unit / walls_.length;
        }
    }

private:
    double step(std::int64_t leg, int d) const {
        const double *from = given_.points + leg * given_.dim + d;
        return (from[given_.dim] - from[0]) / walls_.length;
    }

    const double *state(std::int64_t knot, int d) const { return answer_.knots + knot * half * given_.dim + d; }

    double of_leg(std::int64_t leg, double *forces) const {
        double powers[half + 1];
        duration_powers<half>(given_.durations[leg] / walls_.time, powers);
        LegSlopes found;
        for (int d = 0; d < given_.dim; ++d) {
            const double *start = state(leg, d) + given_.dim, *end = state(leg + 1, d) + given_.dim;
            forces[d] = add_axis<half>(tables_, powers, start, end, given_.dim, step(leg, d), found);
        }
        return found.time;
    }

    double of_row(int row, std::int64_t leg, double *forces) const {
        const std::int64_t wall = answer_.wall[row];
        const double *normal = walls_.walls().normal + wall * given_.dim;
        double factors[max_points], place[max_dim], along[max_dim], time = 0.0, size = 0.0;
        row_factors(Degree<half>(half), tables_, given_.durations[leg] / walls_.time, 0, answer_.s[row], factors);
        for (int d = 0; d < given_.dim; ++d) {
            const double *start = state(leg, d), *end = state(leg + 1, d);
            along[d] = step(leg, d);
            place[d] = factors[half] * along[d];
            size += along[d] * along[d];
            for (int a = 1; a < half; ++a) {
                const double part = factors[a] * start[a * given_.dim] + factors[half + a] * end[a * given_.dim];
                place[d] += part;
                time += normal[d] * a * part;
            }
        }
        turn(wall, std::sqrt(size), along, place, factors[half], normal, answer_.multiplier[row], forces);
        return answer_.multiplier[row] * time;
    }

    // Add what a row changes for the displacement of its leg.
    void turn(std::int64_t wall, double size, double *along, const double *place, double share, const double *normal, double multiplier,
              double *forces) const {
        const int axis = walls_.axis_of(wall);
        double height = 0.0, slope[max_dim], radial = 0.0;
        for (int d = 0; d < given_.dim; ++d) along[d] /= size, height += along[d] * place[d];
        for (int d = 0; d < given_.dim; ++d) {
            slope[d] = -TubeWalls::sign_of(wall) * ((d == axis ? height : 0.0) + along[axis] * place[d]);
            radial += slope[d] * along[d];
        }
        for (int d = 0; d < given_.dim; ++d) forces[d] += multiplier * (share * normal[d] + (slope[d] - radial * along[d]) / size);
    }

    const TubeProblem &given_;
    const TubeWalls &walls_;
    const Answer &answer_;
    const LegTables<double> &tables_ = leg_tables<double>(half);
};

}  // namespace minsnap

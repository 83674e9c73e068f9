// Entry point for certified corridors.
#include <cmath>
#include <cstdint>

#include "basics/export.hpp"
#include "certificate/proof.hpp"
#include "corridor/windows.hpp"

namespace minsnap {
namespace {

constexpr std::int64_t most_pieces = 200'000;

bool all_positive(const double *values, std::int64_t count) {
    for (std::int64_t i = 0; i < count; ++i)
        if (!(values[i] > 0.0 && std::isfinite(values[i]))) return false;
    return true;
}

bool all_within(const std::int64_t *values, std::int64_t count, std::int64_t lowest, std::int64_t highest) {
    for (std::int64_t i = 0; i < count; ++i)
        if (values[i] < lowest || values[i] > highest) return false;
    return true;
}

bool walls_fit(const Request &given) {
    const GivenWalls &walls = given.walls;
    return all_within(walls.piece, walls.count, 0, given.pieces - 1) && all_within(walls.order, walls.count, 0, max_points) &&
           (walls.when == nullptr || all_within(walls.when, walls.count, -1, equal + 1)) && walls.balls >= 0 &&
           walls.balls <= walls.count && (walls.ball == nullptr || all_within(walls.ball, walls.count, -1, walls.balls - 1));
}

bool balls_have_room(const GivenWalls &walls) {
    for (std::int64_t i = 0; i < walls.count; ++i)
        if (walls.is_ball(i) && (walls.is_equality(i) || !(walls.bound[i] > 0.0))) return false;
    return true;
}

bool numbers_fit(const Request &given) {
    const GivenWalls &walls = given.walls;
    const double units[] = {given.length, given.time, given.gap};
    const std::int64_t knots = given.pieces + 1;
    return all_positive(units, 3) && all_finite(given.positions, knots * given.dim) && all_positive(given.durations, given.pieces) &&
           (given.values == nullptr || all_finite(given.values, knots * given.slots() * given.dim)) &&
           all_finite(walls.normal, walls.count * given.dim) && all_finite(walls.anchor, walls.count * given.dim) &&
           all_finite(walls.bound, walls.count) && all_positive(walls.width, walls.count) &&
           all_finite(walls.matrix, walls.balls * given.dim * given.dim) && balls_have_room(walls);
}

}  // namespace

bool corridor_sizes_fit(std::int64_t half, std::int64_t pieces, std::int64_t dim, std::int64_t walls) {
    return half >= 2 && half <= max_half && pieces >= 1 && pieces <= most_pieces && dim >= 1 && dim <= max_dim && walls >= 0 &&
           walls <= FlatWalls::most;
}

Status check_request(const Request &given) {
    if (given.continuity > 2 * given.half - 2 || given.smoothness() < given.half - 2) return Status::bad_size;
    if (!corridor_sizes_fit(given.half, given.pieces, given.dim, given.walls.count) || !walls_fit(given)) return Status::bad_size;
    return numbers_fit(given) ? Status::done : Status::bad_number;
}

Status take_request(const CorridorRecord &asked, std::int64_t pieces, const double *durations, FlatWalls &walls, Request &given) {
    if (!corridor_sizes_fit(asked.half, pieces, asked.dim, asked.groups)) return Status::bad_size;
    const Status taken = walls.take(asked.walls, asked.groups, int(asked.dim));
    if (taken != Status::done) return taken;
    given = {int(asked.half),       int(pieces),   int(asked.dim),
             asked.closed != 0,     asked.length,  asked.time,
             asked.positions,       durations,     asked.pinned,
             asked.values,          walls.walls(), asked.gap,
             int(asked.continuity), asked.effort,  instant_in(asked.seconds)};
    return check_request(given);
}

Status solve_in_double(const Request &given, Answer &answer) {
    if (given.pieces > most_whole) {
        const Status windows = Windows(given.half).solve(given, answer);
        if (windows == Status::done || windows == Status::infeasible || given.pieces > most_again) return windows;
    }
    return ExchangeSolver().solve(given, answer);
}

// What is too much work in double precision is more in the other one: of 300 extreme corridors none of 37 was solved.
Status solve_request(const Request &given, Answer &answer, std::int64_t &attempts) {
    attempts = 1;
    const Status status = solve_in_double(given, answer);
    if (status == Status::done || status == Status::no_memory || status == Status::spent) return status;
    if (status == Status::infeasible && given.effort < patient) return status;
    if (given.pieces > most_again || given.effort < hasty) return status;
    attempts = 2;
    return solve_extended(given, answer);
}

}  // namespace minsnap

// Least cost inside walls that hold at every instant, proved.
MINSNAP_EXPORT std::int32_t minsnap_corridor(const minsnap::CorridorRecord *asked, minsnap::CorridorAnswerRecord *found) {
    using namespace minsnap;
    FlatWalls walls;
    Request given = {};
    const Status taken = take_request(*asked, asked->pieces, asked->durations, walls, given);
    if (taken != Status::done) return std::int32_t(taken);
    Answer answer = {found->points, found->knots, found->wall, found->s, found->multiplier, 0.0, 0.0, 0.0, 0, 0, found->direction};
    const Status status = solve_request(given, answer, found->attempts);
    found->cost = answer.cost, found->bound = answer.bound, found->share = answer.share;
    found->rows = answer.rows, found->rounds = answer.rounds, found->work = answer.work;
    return std::int32_t(status);
}

// Whether each wall is kept at every instant by control points (pieces, 2k, dim), rounding included: the proof that
// ``minsnap_corridor`` asks for, on its own. kept (walls,): 1 where it is proved.
MINSNAP_EXPORT std::int32_t minsnap_walls_kept(std::int64_t half, std::int64_t pieces, std::int64_t dim, const double *points,
                                               const double *durations, const minsnap::WallsRecord *walls, std::uint8_t *kept) {
    using namespace minsnap;
    if (!corridor_sizes_fit(half, pieces, dim, walls->count)) return std::int32_t(Status::bad_size);
    FlatWalls flat;
    if (const Status taken = flat.take(walls, 1, int(dim)); taken != Status::done) return std::int32_t(taken);
    const GivenWalls given = flat.walls();
    const Request request = {int(half), int(pieces), int(dim), false, 1.0, 1.0, points, durations, nullptr, nullptr, given, 1.0};
    if (!walls_fit(request)) return std::int32_t(Status::bad_size);
    if (!all_finite(points, pieces * 2 * half * dim) || !numbers_fit(request)) return std::int32_t(Status::bad_number);
    Proof proof(given, points, durations, pieces, int(2 * half), int(dim));
    for (std::int64_t wall = 0; wall < walls->count; ++wall) kept[wall] = proof.excess(wall).bound <= 0.0;
    return std::int32_t(Status::done);
}

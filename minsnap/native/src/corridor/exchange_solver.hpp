// The exchange of exchange.hpp, compiled once for all who use it.
#pragma once

#include "basics/owned.hpp"
#include "corridor/contact.hpp"
#include "corridor/request.hpp"

namespace minsnap {

// What is written for the caller; normalised units but for the control points.
struct Answer {
    double *points;             // (pieces, 2k, dim) [m]
    double *knots;              // (pieces + 1, slots, dim)
    std::int64_t *wall;         // (pieces * slots * dim + 2,): the active rows' walls,
    double *s, *multiplier;     // their instants, and by how much the cost falls for each unit of their bounds
    double cost, bound, share;  // of the curve; a lower bound of any cost, zero unless proved; share of the widths moved inwards
    std::int64_t rows, rounds;
    double *direction = nullptr;  // (rows, dim): of balls' tangent planes; or null
    double work = 0.0;            // counted work of all solves so far; 1 is what a request is worth
    double *slack = nullptr;      // of a request with slacks, their values,
    double *remainder = nullptr;  // and what doubles leave of multipliers, of which the largest is 1
};

// What is asked of an answer.
enum class Aim {
    proved,    // inside every wall, the cost within the gap of a lower bound
    near,      // inside walls moved inwards, but for little: where windows begin
    measured,  // the cost to a tenth of the gap, for a search that compares many
    widened,   // the least sum of squares of slacks, whatever the cost, and what contradicts less
};

template <class Real, int Half>
class Exchange;

// Solves requests one after another, in double precision, and keeps its memory in between. Not for two threads at once.
class ExchangeSolver {
public:
    ExchangeSolver();
    ExchangeSolver(const ExchangeSolver &) = delete;
    ExchangeSolver &operator=(const ExchangeSolver &) = delete;
    ~ExchangeSolver();

    // See Exchange::solve.
    Status solve(const Request &given, Answer &answer, Aim aim = Aim::proved, const Contact *known = nullptr, int count = 0);

private:
    Owned<Exchange<double, 4>> snap_;  // degree 7, the usual one
    Owned<Exchange<double, 0>> any_;
    int half_ = 0;  // of the latter
};

// The same once, in double-double arithmetic.
Status solve_extended(const Request &given, Answer &answer, Aim aim = Aim::proved, const Contact *known = nullptr, int count = 0);

// Solve a request that was checked: as a whole or in windows, in double precision.
Status solve_in_double(const Request &given, Answer &answer);

// The same, and where that does not end with a proof once more in double-double arithmetic.
Status solve_request(const Request &given, Answer &answer, std::int64_t &attempts);

}  // namespace minsnap

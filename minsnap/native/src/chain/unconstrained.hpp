// What other areas need of plans without walls.
#pragma once

#include <cstdint>
#include <limits>

#include "basics/border.hpp"
#include "basics/buffer.hpp"
#include "chain/sweep.hpp"
#include "polynomials/control_points.hpp"

namespace minsnap {

// How far the durations of a chain are apart: wide ones are solved in double-double arithmetic.
enum class Spread { narrow, wide };

// By k: the ratio r of durations up to which doubles, and up to which double-doubles, give the optimum to about 1e-10 of
// its size.  Between long legs a short one leaves polynomials of degree k - 1 that vanish at its ends to the long legs,
// whose stiffness is less than its own by r^(2k - 5); so 16 digits more allow a ratio larger by 10^(16 / (2k - 5)).
// It is that of legs near each other: what happens at a knot fades by a half from leg to leg.
constexpr std::int64_t near_legs = 8;
constexpr double resolved[7] = {0, 0, std::numeric_limits<double>::infinity(), 1e4, 100.0, 10.0, 3.0};
constexpr double resolved_twice[7] = {0, 0, std::numeric_limits<double>::infinity(), 1e20, 1e7, 5e3, 100.0};

constexpr double shortest_duration = 1e-12, longest_duration = 1e9;  // [s], as in checks.py: their powers stay in range
constexpr double smallest_number = 1e-40, largest_number = 1e40;     // of lengths and derivatives, as in arrays.py

using Pins = Buffer<Pin>;

// The chain that a caller gives, with its pins in their own room; bad_size before anything is read.
Status read_chain(const ChainRecord &given, Pins &pins, ChainProblem &chain);

// Whether a chain is well formed and can be solved here; durations are those of all its legs. The ratio that doubles resolve may be a multiple of the
// usual one, where less is asked of them.
Status check_chain(const ChainProblem &chain, int half, Spread &spread, double multiple = 1.0);

// Whether a leg ends where it begins: a hold, which pins have to keep at rest.
bool has_hold(const ChainProblem &chain);

// The optimum of an open chain.
Status solve_chain(const ChainProblem &chain, int half, Spread spread, Output out);

// The same for degrees up to 7, and above.
constexpr int most_usual_half = 4;
Status solve_chain_usual(const ChainProblem &chain, int half, Output out);
Status solve_chain_high(const ChainProblem &chain, int half, Output out);

// The same in double-double arithmetic.
Status solve_chain_extended(const ChainProblem &chain, int half, Output out);

// Whether the optimum of an open chain without pins passes the last look.
Status looked_at(const ChainProblem &chain, int half, const double *out);

// The optimum of a closed lap, whose state at the end is that at the start, and free.
Status solve_closed(const ChainProblem &chain, int half, Spread spread, Output out);

// Instants of the knots, (legs + 1,).
void write_breaks(const double *durations, std::int64_t legs, double *breaks);

}  // namespace minsnap

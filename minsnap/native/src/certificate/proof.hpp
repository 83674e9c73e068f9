// Proof that a curve keeps its walls at every instant, rounding included: what ``minsnap.certify`` would say of them,
// by the same operations, and a little less.
#pragma once

#include "basics/status.hpp"
#include "polynomials/enclosure.hpp"
#include "corridor/walls.hpp"

namespace minsnap {

// Numbers below the smallest normal one are whole steps of 5e-324, of which the rounding of a position takes a few.
constexpr double steps_below = 16.0 * 4.9406564584124654e-324;

class Proof {
public:
    // points: control points (pieces, 2k, dim) [m].
    Proof(const GivenWalls &walls, const double *points, const double *durations, std::int64_t pieces, int count, int dim)
        : walls_(walls), pieces_{points, durations, pieces, count - 1, dim}, relative_(pieces_), sound_(pieces_.sound()) {}

    // The greatest excess over a wall, in the wall's unit: it is kept where ``bound`` is not positive; then ``attained``
    // and ``s`` may be left out.
    Greatest excess(std::int64_t wall);

private:
    bool takes(std::int64_t wall) const;
    Greatest ball_excess(std::int64_t wall);
    Greatest cone_excess(std::int64_t wall, const Curve &curve, const Curve &mapped);

    const GivenWalls walls_;
    const Pieces pieces_;
    Relative relative_;
    bool sound_;
};

// The highest order up to which the derivatives on both sides of every knot agree: to ``exact`` of their largest control
// point, and to what the rounding of positions, ``rounding`` of the largest, becomes when it is differentiated.
Status find_continuity(const Pieces &pieces, double exact, double rounding, std::int64_t &continuity);

}  // namespace minsnap

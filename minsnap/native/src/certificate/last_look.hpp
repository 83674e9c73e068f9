// The last look at curves before they leave: whether stored control points pass through the waypoints, begin and end in
// the states asked for, join, and stay inside a tube, whatever found them and in whatever units. What it does not confirm
// may still be right: a caller with more time asks the certificate.
#pragma once

#include <cstdint>

namespace minsnap {

// What is asked of a curve: waypoints (legs + 1, dim), durations of all pieces, states at
// the ends (pinned, dim) from the first derivative on, or null where these derivatives are zero, half-widths of a tube
// (legs,) or one for all, or null.
struct Asked {
    const double *points, *durations, *start, *end, *widths;
    bool shared;
    std::int64_t legs;
    int pieces, degree, dim, continuity, pinned;
};

// Whether a curve (legs * pieces, degree + 1, dim) is seen to keep all of it.
bool passes_last_look(const Asked &asked, const double *curve);

}  // namespace minsnap

// Every constant of the search for a costate.
#pragma once

namespace minsnap {

struct CostateSettings {
    static constexpr int sets = 5;                 // that bound accelerations, or velocities, at most
    static constexpr int iterations = 60;          // of one width
    static constexpr int halvings = 40;            // of a step
    static constexpr double first_width = 1.0;     // of the rounding of norms, relative
    static constexpr double refined_width = 0.02;  // at which cells are divided anew
    static constexpr double last_width = 5e-4;
    static constexpr double narrower = 0.25;   // factor from one width to the next
    static constexpr double settled = 1e-2;    // gain that a step promises below which a width is done, relative, times the width
    static constexpr double rise = 0.1;        // share of what a step promises that it must gain
    static constexpr double in_costate = 0.5;  // share of the time that rounding at width 1 takes in costates,
    static constexpr double in_rate = 0.5;     // in their rates,
    static constexpr double in_knots = 0.1;    // and at knots that are regions
    static constexpr double in_products =
        0.02;                                // share of a leg's first product that rounding at width 1 takes in what regions change of it
    static constexpr double trifle = 1e-12;  // added to diagonals, relative
};

}  // namespace minsnap

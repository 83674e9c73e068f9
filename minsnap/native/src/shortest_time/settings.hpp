// Every constant of the interior point for shortest times.
#pragma once

namespace minsnap {

struct ShortestSettings {
    static constexpr int instants = 20;         // per piece at which conditions stand
    static constexpr int more_instants = 40;    // the same where legs are not divided: fewer lose flight time on a long piece
    static constexpr int other_instants = 28;   // with other degrees or numbers of coordinates than usual
    static constexpr int iterations = 200;      // of one stage
    static constexpr int tries = 12;            // of a damping, until the matrix is positive definite
    static constexpr int halvings = 8;          // of a step
    static constexpr int failures = 6;          // steps in a row without progress that end a stage
    static constexpr int stalls = 3;            // steps in a row that barely change the time, after which the barrier falls
    static constexpr int longest_stall = 12;    // the same, or hopelessly damped, after which a stage ends although residuals are left
    static constexpr int rounds = 3;            // of margins that only grow, at the last barrier
    static constexpr int coupled_legs = 64;     // up to which a step knows how a yaw through angles changes with the durations of all legs
    static constexpr int repairs = 4;           // of walls or limits moved inwards after the last stage
    static constexpr double first_gap = 0.3;    // barrier times number of conditions, relative to the time
    static constexpr double divided_gap = 0.1;  // the same after a division
    static constexpr double easy_gap = 1.0, easy_end = 0.1;  // of the stage with a body that is easy to turn
    static constexpr double easy = 0.08;                     // its inertia, of the vehicle's
    static constexpr double coarse_gap = 0.03;               // at which a stage ends that is divided afterwards
    static constexpr double guess_gap = 0.03;                // at which a search for a curve ends from which another begins
    static constexpr double rough_gap = 0.01;                // at which a stage ends from whose curve another stage begins
    static constexpr double last_gap = 3e-4;                 // of the last stage: time lost is below that share
    static constexpr double held_gap = 3e-5;                 // the same where the time is given: cost lost
    static constexpr double barrier_fall = 0.2;              // factor on the barrier
    static constexpr double centred = 0.3;                   // decrement below which the barrier falls, relative to its gap
    static constexpr double margin_gap = 0.5;                // below which leaks become margins
    static constexpr double to_boundary = 0.995;             // share of the way to the boundary that a step may go
    static constexpr double to_boundary_within = 0.85;       // the same where every step stays inside: nearer ones crawl along it
    static constexpr double smoothing = 1e-6;                // weight of the squared jerk, in units of limits
    static constexpr double balance = 1e-3;                  // weight of the pull of neighbouring durations of a leg to their first ratio
    static constexpr double largest_step = 0.5;              // of the logarithm of a duration
    static constexpr double least_slack = 0.02;              // at a fresh start, in widths
    static constexpr double broken = 1e-6;                   // excess from which a plan breaks a row, in widths
    static constexpr double loosened = 3e-4;                 // by how much more than a plan its way back may break a row, in widths
    static constexpr double touched = 1e-3;                  // within which a guess touches its bounds, as an optimum does, in widths
    static constexpr double touched_gap = 0.01;              // at which the search of such a guess begins
    static constexpr double touched_slack = 3e-4;            // least slack then, in widths
    static constexpr int slowings = 15;                      // at the beginning, until limits on several derivatives are kept
    static constexpr double slowed = 1.1;                    // factor on time at which the search begins
    static constexpr double slowed_easy = 1.02;         // factor of each on the curve of that stage, and after the division that follows
    static constexpr double slowest = 10.0;             // factor on time beyond which no slower flight is tried
    static constexpr double slowed_again = 1.05;        // after a division
    static constexpr double eased = 1.03;               // from which a search with several pieces is repeated
    static constexpr double damping = 1e-3;             // first damping, in units of the metric
    static constexpr double damping_growth = 6.0;       // where a pivot is not positive
    static constexpr double damping_change = 3.0;       // after steps that were shortened or not
    static constexpr double damping_fall_within = 5.0;  // the same where every step stays inside, after one that was not shortened
    static constexpr double held = 10.0;                // damping above which a step is held back
    static constexpr double hopeless = 1e4;             // damping that lets nothing move, many times in a row
    static constexpr double settled = 0.1;    // least damping at the last barrier once the time stalls: stops drift along flat valleys
    static constexpr double stalled = 1e-4;   // change of the time that counts as none, relative
    static constexpr double residual = 5e-4;  // of a condition at the end, in widths
    static constexpr double usable = 1e-2;    // the same where a stage ends without progress at the last barrier: what is left is mended
    static constexpr double grown = 3e-4;     // growth of margins that counts as none, in widths
    static constexpr double near = 0.3;       // how far inside its bound a sampled peak is looked at, in widths
    static constexpr double level = 3e-4;     // by which a sample may be less than the one beside it that is looked at as a peak, in widths
    static constexpr double infeasibility = 1e-2;  // mean residual that a step may reach, and below which the barrier may fall
    static constexpr double asleep_gap = 1e-2;     // below which rows sleep that are far inside
    static constexpr double asleep = 0.3;          // how far inside all rows of a group are that sleeps, in widths
    static constexpr double woken = 0.1;           // how far inside a sleeping row is after a step that wakes it, in widths
    static constexpr double well_inside = 1e-3;    // how far inside a curve is that may be gone back to, in widths
    static constexpr int longest_wait = 4;         // steps after which a curve outside is tried again to be brought inside
    static constexpr double shorter = 0.999;       // share of the time of what is kept that a curve must be slowed to
    static constexpr double least_part = 0.05;     // of the way from a curve inside to the next one, tried
    static constexpr double barely = 1.01;         // factor on time to which that is found
    static constexpr double seen = 0.05;           // excess at the end, in widths, up to which a search has seen a limit
    static constexpr double leak = 1e-9;           // excess that counts as none, in widths
};

}  // namespace minsnap

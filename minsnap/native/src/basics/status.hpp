// How a call ended. The same numbers stand in status.py; a test compares them by name.
#pragma once

#include <cstdint>

namespace minsnap {

enum class Status : std::int32_t {
    done = 0,         // the answer is in the output arrays
    bad_size = 1,     // a count is negative, zero where it must not be, or beyond its bound
    bad_number = 2,   // an input is not finite, or a duration is not positive
    no_memory = 3,    // an allocation was refused
    unsupported = 4,  // the request is well formed, but this core does not do it
    singular = 5,     // a pivot is not positive to working precision
    not_proved = 6,   // an answer was found, but not proved; the output must not be used
    infeasible = 7,   // no answer seems to exist; only a guess, to be settled elsewhere
    no_progress = 8,  // the iteration stalled or reached its limit of rounds
    spent = 9,        // it took as much work as a request is worth
};

}  // namespace minsnap

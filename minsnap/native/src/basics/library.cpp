// What the library says about itself, so that Python never calls one built from other sources.
#include <cstdint>

#include "basics/export.hpp"
#include "basics/status.hpp"

namespace {

// Raise this number, and ABI in library.py, whenever the arguments or the meaning of an entry point change.
constexpr std::int32_t abi = 6;

}  // namespace

MINSNAP_EXPORT std::int32_t minsnap_abi() { return abi; }

MINSNAP_EXPORT const char *minsnap_compiler() { return __VERSION__; }

// Name of a status, or null past the last one.
MINSNAP_EXPORT const char *minsnap_status_name(std::int32_t status) {
    using minsnap::Status;
    switch (static_cast<Status>(status)) {
        case Status::done: return "DONE";
        case Status::bad_size: return "BAD_SIZE";
        case Status::bad_number: return "BAD_NUMBER";
        case Status::no_memory: return "NO_MEMORY";
        case Status::unsupported: return "UNSUPPORTED";
        case Status::singular: return "SINGULAR";
        case Status::not_proved: return "NOT_PROVED";
        case Status::infeasible: return "INFEASIBLE";
        case Status::no_progress: return "NO_PROGRESS";
        case Status::spent: return "SPENT";
    }
    return nullptr;
}

// What the library says about itself, so that Python never calls one built from other sources.
#include <cstdint>

#include "basics/border_fields.hpp"
#include "basics/export.hpp"
#include "basics/status.hpp"
#include "basics/public.hpp"

MINSNAP_EXPORT std::int32_t minsnap_abi() { return MINSNAP_ABI; }

// Name and version: the version of Clang begins with its name, that of GCC does not.
MINSNAP_EXPORT const char *minsnap_compiler() {
#ifdef __clang__
    return __VERSION__;
#else
    return "GCC " __VERSION__;
#endif
}

// A field of the border: the names of its record, of itself and of what it holds; past the last one bad_size.
MINSNAP_EXPORT std::int32_t minsnap_border_field(std::int64_t index, const char **names) {
    using minsnap::border_fields;
    using minsnap::Status;
    if (index < 0 || index >= std::int64_t(sizeof border_fields / sizeof border_fields[0]))
        return static_cast<std::int32_t>(Status::bad_size);
    const minsnap::BorderField &field = border_fields[index];
    names[0] = field.record, names[1] = field.name, names[2] = field.kind;
    return static_cast<std::int32_t>(Status::done);
}

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

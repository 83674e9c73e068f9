// What the library says about itself, so that Python never calls one built from other sources.
#include "basics/border.hpp"
#include "basics/export.hpp"
#include "basics/public.hpp"
#include "basics/status.hpp"
#include "bounds/border.hpp"
#include "certificate/vehicle_use.hpp"
#include "fleet/joint_question.hpp"
#include "fleet/questions.hpp"
#include "maps/questions.hpp"
#include "planner/border.hpp"
#include "polynomials/evaluate.hpp"

namespace minsnap {
namespace {

constexpr RecordText records[] = {
    CorridorRecord_text,  CorridorAnswerRecord_text, SlackRecord_text,        ChainRecord_text,       SplitRecord_text,
    ManyRecord_text,      VehicleRecord_text,        ExcessRecord_text,       ValuesRecord_text,      SetsRecord_text,
    PieceRecord_text,     StopRecord_text,           WallsRecord_text,        MomentaryLimit_text,    ShortestRequest_text,
    ShortestAnswer_text,  FleetCurves_text,          SeparationQuestion_text, ClearanceQuestion_text, AssignmentQuestion_text,
    TangentQuestion_text, GridWayQuestion_text,      SightQuestion_text,      JointQuestion_text,     JointRun_text,
    PiecewiseCurve_text,  CostateSearch_text,        PlansRecord_text,        VehicleUseRecord_text};

}  // namespace
}  // namespace minsnap

MINSNAP_EXPORT std::int32_t minsnap_abi() { return MINSNAP_ABI; }

// Name and version: the version of Clang begins with its name, that of GCC does not.
MINSNAP_EXPORT const char *minsnap_compiler() {
#ifdef __clang__
    return __VERSION__;
#else
    return "GCC " __VERSION__;
#endif
}

// A struct of the border: its name, the text of its fields, and its size; past the last one bad_size.
MINSNAP_EXPORT std::int32_t minsnap_record(std::int64_t index, const char **texts, std::int64_t *size) {
    using minsnap::Status;
    if (index < 0 || index >= std::int64_t(sizeof minsnap::records / sizeof minsnap::records[0]))
        return static_cast<std::int32_t>(Status::bad_size);
    const minsnap::RecordText &record = minsnap::records[index];
    texts[0] = record.name, texts[1] = record.fields, *size = record.size;
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

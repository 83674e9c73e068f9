// Curves of a whole fleet at once, for one common flight time: entry points of the joint search, which keeps its multipliers from run to run.
#include <memory>
#include <new>

#include "basics/export.hpp"
#include "fleet/joint_steps.hpp"

using namespace minsnap;

// Make a search; the arrays of the question must live as long as it does. The caller gives the search back with minsnap_fleet_joint_end.
MINSNAP_EXPORT std::int32_t minsnap_fleet_joint_begin(const JointQuestion *question, void **search) {
    const JointQuestion &q = *question;
    *search = nullptr;
    if (q.vehicles < 1 || q.vehicles > 100000 || q.pieces < 2 || q.pieces > 1000) return int(Status::bad_size);
    if (q.samples < 2 || q.samples > 100 || q.obstacles < 0 || q.threads < 1) return int(Status::bad_size);
    if (!(q.downwash >= 1.0) || !(q.length > 0.0)) return int(Status::bad_number);
    std::unique_ptr<JointSteps> made(new (std::nothrow) JointSteps(q));
    if (made == nullptr || !made->allocate()) return int(Status::no_memory);
    *search = made.release();
    return int(Status::done);
}

MINSNAP_EXPORT std::int32_t minsnap_fleet_joint_run(void *search, JointRun *run) {
    if (!(run->time > 0.0) || !(run->rho > 0.0) || !(run->tau > 0.0)) return int(Status::bad_number);
    return int(static_cast<JointSteps *>(search)->run(*run));
}

// Drop all multipliers.
MINSNAP_EXPORT std::int32_t minsnap_fleet_joint_forget(void *search) {
    static_cast<JointSteps *>(search)->forget();
    return int(Status::done);
}

MINSNAP_EXPORT std::int32_t minsnap_fleet_joint_end(void *search) {
    delete static_cast<JointSteps *>(search);
    return int(Status::done);
}

// Jobs compiled a second time for the wide registers of newer processors, to the same bits.
#pragma once

namespace minsnap {

#if defined(__x86_64__)
#define MINSNAP_WIDE __attribute__((target("avx2"), noinline))
inline bool wide() { return __builtin_cpu_supports("avx2"); }
#else
#define MINSNAP_WIDE
inline bool wide() { return false; }
#endif

template <class Job>
MINSNAP_WIDE __attribute__((flatten)) void run_wide(Job &job) {
    job();
}

// Run a job that is MINSNAP_INLINED, with all that it calls and that is not MINSNAP_APART, for wide registers where there are some.
template <class Job>
void widely(Job job) {
    wide() ? run_wide(job) : job();
}

}  // namespace minsnap

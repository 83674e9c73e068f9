// Jobs compiled again for newer processors, with registers of four numbers and with twice as many of them, to the same bits.
// Without optimisation nothing is inlined into them, and vectors would cross functions in the way of another processor.
#pragma once

namespace minsnap {

#if defined(__x86_64__) && defined(__OPTIMIZE__)
template <class Job>
__attribute__((target("avx2"), noinline, flatten)) void run_wide(Job &job) {
    job();
}
template <class Job>
__attribute__((target("avx512vl"), noinline, flatten)) void run_widest(Job &job) {
    job();
}

// Run a job that is MINSNAP_INLINED, with all that it calls and that is not MINSNAP_APART, for the best registers that there are.
template <class Job>
void widely(Job job) {
    if (__builtin_cpu_supports("avx512vl")) return run_widest(job);
    if (__builtin_cpu_supports("avx2")) return run_wide(job);
    job();
}
#else
template <class Job>
void widely(Job job) {
    job();
}
#endif

}  // namespace minsnap

// A call's work shared among threads.  Each begins with a run of chunks of its own and then helps the others: two that
// write side by side would both ask the system for the same fresh page of up to 2 MB, and both would clear it.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#if !defined(_WIN32)
#include <pthread.h>
#endif

namespace minsnap {

constexpr int most_threads = 256;

template <class Task>
class Chunks {
public:
    Chunks(std::int64_t count, Task &task) : count_(count), task_(task) {}

    // Call task(chunk) for 0 ... count - 1 on so many threads, the caller's among them.  A thread that cannot be had is
    // done without.
    void run(int threads) {
        runs_ = static_cast<int>(std::max<std::int64_t>(1, std::min<std::int64_t>({threads, most_threads, count_})));
        for (int run = 0; run < runs_; ++run) next_[run] = first(run);
#if defined(_WIN32)
        work();
#else
        pthread_t started[most_threads];
        int running = 0;
        for (int i = 1; i < runs_; ++i)
            if (pthread_create(&started[running], nullptr, &Chunks::enter, this) == 0) ++running;
        work();
        for (int i = 0; i < running; ++i) pthread_join(started[i], nullptr);
#endif
    }

private:
    static void *enter(void *self) {
        static_cast<Chunks *>(self)->work();
        return nullptr;
    }

    std::int64_t first(int run) const { return count_ * run / runs_; }

    void work() {
        const int own = joined_++;
        for (int i = 0; i < runs_; ++i) {
            const int run = (own + i) % runs_;
            const std::int64_t end = first(run + 1);
            for (std::int64_t chunk = next_[run]++; chunk < end; chunk = next_[run]++) task_(chunk);
        }
    }

    std::int64_t count_;
    Task &task_;
    int runs_ = 1;
    std::atomic<int> joined_{0};
    std::atomic<std::int64_t> next_[most_threads];  // of each run, the chunk to be taken next
};

}  // namespace minsnap

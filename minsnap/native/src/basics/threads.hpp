// A call's work shared among threads: chunks are taken in turn, so what is computed does not depend on their number.
#pragma once

#include <atomic>
#include <cstdint>
#if defined(_WIN32) || defined(__wasm__)
#define MINSNAP_ONE_THREAD
#else
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
#if defined(MINSNAP_ONE_THREAD)
        (void)threads;
        work();
#else
        pthread_t started[most_threads];
        int running = 0;
        for (int i = 1; i < threads && i < most_threads && i < count_; ++i)
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

    void work() {
        const Task task = task_;  // what other threads write beside the caller's would slow all of them down
        const std::int64_t count = count_;
        for (std::int64_t chunk = next_++; chunk < count; chunk = next_++) task(chunk);
    }

    std::int64_t count_;
    Task &task_;
    std::atomic<std::int64_t> next_{0};
};

}  // namespace minsnap

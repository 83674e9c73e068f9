// Many problems, each solved as if it were alone, shared among threads.
#pragma once

#include <algorithm>
#include <cstdint>

#include "basics/border.hpp"
#include "basics/threads.hpp"

namespace minsnap {

// Offsets of problems that stand one after the other: problem b has the legs offsets[b] ... offsets[b + 1] - 1.
inline bool ascending(const std::int64_t *offsets, std::int64_t count) {
    if (offsets[0] != 0) return false;
    for (std::int64_t b = 0; b < count; ++b)
        if (offsets[b + 1] < offsets[b]) return false;
    return true;
}

inline bool many_fit(const ManyRecord &many) {
    return many.count >= 0 && many.dim >= 1 && many.half >= 2 && ascending(many.offsets, many.count);
}

inline void nothing() {}

// Call solve(b) for all problems, taken in chunks, and keep what each returns; a thread calls settle() after each of its chunks.
template <class Solve>
inline void for_all(std::int64_t count, std::int64_t chunk_size, int threads, std::int32_t *statuses, Solve &&solve,
                    void (*settle)() = nothing) {
    auto task = [=](std::int64_t chunk) {
        const std::int64_t end = std::min(count, (chunk + 1) * chunk_size);
        for (std::int64_t b = chunk * chunk_size; b < end; ++b) statuses[b] = static_cast<std::int32_t>(solve(b));
        settle();
    };
    Chunks<decltype(task)> chunks((count + chunk_size - 1) / chunk_size, task);
    chunks.run(threads);
}

}  // namespace minsnap

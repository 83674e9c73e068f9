// Results larger than the caches, written past them: a usual store first reads the line that it overwrites, and threads
// share what the memory can move.
#pragma once

#include <cstdint>
#include <cstring>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace minsnap {

// Copy an even count of numbers between places aligned to 16 bytes. Another thread sees them once ``settle_copies`` was
// called.
inline void copy_past_caches(const double *from, double *to, std::int64_t count) {
#if defined(__SSE2__)
    for (std::int64_t i = 0; i < count; i += 2) _mm_stream_pd(to + i, _mm_load_pd(from + i));
#else
    std::memcpy(to, from, sizeof(double) * count);
#endif
}

inline void settle_copies() {
#if defined(__SSE2__)
    _mm_sfence();
#endif
}

}  // namespace minsnap

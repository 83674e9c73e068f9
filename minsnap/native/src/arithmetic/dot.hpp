// Inner product in four partial sums, which a processor adds side by side; the order of the additions is fixed.
#pragma once

#include <cstddef>

namespace minsnap {

inline double dot(const double *__restrict a, const double *__restrict b, std::size_t count) {
    double p = 0.0, q = 0.0, r = 0.0, s = 0.0;
    std::size_t i = 0;
    for (; i + 4 <= count; i += 4) {
        p += a[i] * b[i];
        q += a[i + 1] * b[i + 1];
        r += a[i + 2] * b[i + 2];
        s += a[i + 3] * b[i + 3];
    }
    for (; i < count; ++i) p += a[i] * b[i];
    return (p + q) + (r + s);
}

}  // namespace minsnap

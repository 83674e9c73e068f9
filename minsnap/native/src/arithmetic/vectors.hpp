// Inner products and sums of vectors, with four partial sums so that they may be computed side by side.
#pragma once

namespace minsnap {

template <class Real>
inline Real dot(const Real *a, const Real *b, int count) {
    Real sums[4] = {0, 0, 0, 0};
    int i = 0;
    for (; i + 4 <= count; i += 4)
        for (int lane = 0; lane < 4; ++lane) sums[lane] += a[i + lane] * b[i + lane];
    for (; i < count; ++i) sums[0] += a[i] * b[i];
    return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

// a += factor * b.
template <class Real>
inline void add_multiple(Real *a, Real factor, const Real *b, int count) {
    for (int i = 0; i < count; ++i) a[i] += factor * b[i];
}

template <class Real>
inline Real largest(Real a, Real b) {
    return a > b ? a : b;
}

template <class Real>
inline Real smallest(Real a, Real b) {
    return a < b ? a : b;
}

}  // namespace minsnap

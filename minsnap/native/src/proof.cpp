// The proof of proof.hpp, compiled once for all who use it.
#include "proof.hpp"

// As in certificate.cpp: short loops are slower when gcc vectorises them.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("no-tree-vectorize")
#endif

namespace minsnap {
namespace {

constexpr double infinity = __builtin_huge_val();

// The certificate's errors, doubled: it looks at walls in another order, and its bounds may differ by their last bits.
constexpr double more = 2.0;

}  // namespace

bool Proof::takes(std::int64_t wall) const {
    const int dim = pieces_.dim;
    return sound_ && within(walls_.normal + wall * dim, dim, longest_normal) &&
           within(walls_.anchor + wall * dim, dim, longest_vector) && within(walls_.bound + wall, 1, longest_vector);
}

Greatest Proof::excess(std::int64_t wall) {
    if (!takes(wall)) return {infinity, infinity, 0.5, wall};
    const int dim = pieces_.dim, order = int(walls_.order[wall]);
    Scalar component, excess;
    along(relative_(walls_.piece_of(wall), order, walls_.anchor + wall * dim), walls_.normal + wall * dim, component);
    Greatest kept{0.0, -infinity, 0.0, wall};
    if (beyond(component, walls_.bound[wall], 1.0, kept, excess)) return kept;
    const int n = excess.degree;
    for (int j = 0; j <= n; ++j) excess.error[j] *= more;
    if (walls_.when != nullptr && walls_.when[wall] >= 0) {
        const int end = walls_.when[wall] == 0 ? 0 : n;
        const double value = excess.value[end], error = excess.error[end];
        return {below(value, error), above(value, error), double(walls_.when[wall]), wall};
    }
    Greatest best{-infinity, -infinity, 0.0, wall};
    if (n == 7)
        Climb<7>(n).raise(best, excess.value, excess.error, wall);
    else
        Climb<-1, max_points - 1>(n).raise(best, excess.value, excess.error, wall);
    return best;
}

}  // namespace minsnap

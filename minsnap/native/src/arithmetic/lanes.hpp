// Numbers with several lanes: the same elimination runs on one problem, on both ends of one, or on four at once.
//
// An elimination is a chain of dependent operations, so the lanes cost almost nothing.  The vector types are those of
// gcc and clang; without wide registers the compiler splits them.
#pragma once

#include "arithmetic/double_double.hpp"

// Loops of constant length over orders and axes; a unit that need not be fast defines it empty, and compiles faster.
#if defined(MINSNAP_UNROLL)
#elif defined(__clang__)
#define MINSNAP_UNROLL _Pragma("unroll")
#else
#define MINSNAP_UNROLL _Pragma("GCC unroll 16")
#endif
#if !defined(MINSNAP_INLINE)
#define MINSNAP_INLINE inline __attribute__((always_inline))
#endif
#define MINSNAP_INLINED __attribute__((always_inline))  // of a lambda
#define MINSNAP_APART __attribute__((noinline))

namespace minsnap {

typedef double Pair __attribute__((vector_size(16)));
typedef double Quad __attribute__((vector_size(32)));

template <class Real>
struct Lanes {
    static constexpr int count = 1;
    static double get(const Real &value, int) { return to_double(value); }
    static void set(Real &value, int, double number) { value = Real(number); }
};

template <class Vector, int lanes>
struct VectorLanes {
    static constexpr int count = lanes;
    static MINSNAP_INLINE double get(const Vector &value, int lane) { return value[lane]; }
    static MINSNAP_INLINE void set(Vector &value, int lane, double number) { value[lane] = number; }
};

template <>
struct Lanes<Pair> : VectorLanes<Pair, 2> {};
template <>
struct Lanes<Quad> : VectorLanes<Quad, 4> {};

// Four numbers that lie in a row, read and written; the sum of four lanes, and the largest.
MINSNAP_INLINE Quad four(const double *from) {
    Quad numbers;
    __builtin_memcpy(&numbers, from, sizeof numbers);
    return numbers;
}
MINSNAP_INLINE void put_four(double *to, const Quad &numbers) { __builtin_memcpy(to, &numbers, sizeof numbers); }
MINSNAP_INLINE double total(const Quad &numbers) { return (numbers[0] + numbers[1]) + (numbers[2] + numbers[3]); }

// Lanes of two vectors, counted through both.
template <int i, int j, int k, int l>
MINSNAP_INLINE Quad mixed(const Quad &one, const Quad &two) {
#if defined(__clang__)
    return __builtin_shufflevector(one, two, i, j, k, l);
#else
    typedef long long Places __attribute__((vector_size(32)));
    return __builtin_shuffle(one, two, Places{i, j, k, l});
#endif
}

// The totals of four vectors, each to the same bits as alone.
MINSNAP_INLINE Quad totals(const Quad &a, const Quad &b, const Quad &c, const Quad &d) {
    const Quad ab = mixed<0, 4, 2, 6>(a, b) + mixed<1, 5, 3, 7>(a, b), cd = mixed<0, 4, 2, 6>(c, d) + mixed<1, 5, 3, 7>(c, d);
    return mixed<0, 1, 4, 5>(ab, cd) + mixed<2, 3, 6, 7>(ab, cd);
}

MINSNAP_INLINE double largest_of(const Quad &numbers) {
    const double one = numbers[0] > numbers[1] ? numbers[0] : numbers[1], two = numbers[2] > numbers[3] ? numbers[2] : numbers[3];
    return one > two ? one : two;
}

// The same number in every lane.
template <class Real>
MINSNAP_INLINE Real filled(double number) {
    Real value{};
    MINSNAP_UNROLL
    for (int lane = 0; lane < Lanes<Real>::count; ++lane) Lanes<Real>::set(value, lane, number);
    return value;
}

// The lesser of two numbers, lane by lane; not a number if the second is none.
template <class Real>
MINSNAP_INLINE Real lesser(Real one, Real two) {
    return one < two ? one : two;
}

}  // namespace minsnap

// Gram matrix of the k-th derivative of a polynomial of degree 2k - 1 in its end derivatives, on the unit interval.
//
// With e = (x(0), x'(0), ..., x^(k-1)(0), x(1), ..., x^(k-1)(1)), derivatives in s, the integral of x^(k)(s)^2 over
// [0, 1] is e' Q e (C. Richter, A. Bry and N. Roy, "Polynomial trajectory planning for aggressive quadrotor flight in
// dense indoor environments", ISRR 2013).  All entries are integers.  Here are the first k rows: start against start,
// then start against end.  Reversing time turns the sign of odd orders, so Q[k+a][k+b] = (-1)^(a+b) Q[a][b].
#pragma once

namespace minsnap {

template <int half>
struct Gram;

template <>
struct Gram<2> {
    static constexpr double rows[2][4] = {{12, 6, -12, 6}, {6, 4, -6, 2}};
};

template <>
struct Gram<3> {
    static constexpr double rows[3][6] = {{720, 360, 60, -720, 360, -60}, {360, 192, 36, -360, 168, -24}, {60, 36, 9, -60, 24, -3}};
};

template <>
struct Gram<4> {
    static constexpr double rows[4][8] = {{100800, 50400, 10080, 840, -100800, 50400, -10080, 840},
                                          {50400, 25920, 5400, 480, -50400, 24480, -4680, 360},
                                          {10080, 5400, 1200, 120, -10080, 4680, -840, 60},
                                          {840, 480, 120, 16, -840, 360, -60, 4}};
};

template <>
struct Gram<5> {
    static constexpr double rows[5][10] = {{25401600, 12700800, 2721600, 302400, 15120, -25401600, 12700800, -2721600, 302400, -15120},
                                           {12700800, 6451200, 1411200, 161280, 8400, -12700800, 6249600, -1310400, 141120, -6720},
                                           {2721600, 1411200, 317520, 37800, 2100, -2721600, 1310400, -267120, 27720, -1260},
                                           {302400, 161280, 37800, 4800, 300, -302400, 141120, -27720, 2760, -120},
                                           {15120, 8400, 2100, 300, 25, -15120, 6720, -1260, 120, -5}};
};

template <>
struct Gram<6> {
    static constexpr double rows[6][12] = {
        {10059033600, 5029516800, 1117670400, 139708800, 9979200, 332640, -10059033600, 5029516800, -1117670400, 139708800, -9979200,
         332640},
        {5029516800, 2540160000, 571536000, 72576000, 5292000, 181440, -5029516800, 2489356800, -546134400, 67132800, -4687200, 151200},
        {1117670400, 571536000, 130636800, 16934400, 1270080, 45360, -1117670400, 546134400, -117936000, 14212800, -967680, 30240},
        {139708800, 72576000, 16934400, 2257920, 176400, 6720, -139708800, 67132800, -14212800, 1673280, -110880, 3360},
        {9979200, 5292000, 1270080, 176400, 14700, 630, -9979200, 4687200, -967680, 110880, -7140, 210},
        {332640, 181440, 45360, 6720, 630, 36, -332640, 151200, -30240, 3360, -210, 6}};
};

// (-1)^order
constexpr double sign_of(int order) { return order % 2 ? -1.0 : 1.0; }

}  // namespace minsnap

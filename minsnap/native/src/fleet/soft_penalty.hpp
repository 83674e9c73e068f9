// A smooth penalty on what is positive, with an exponential and a logarithm of its own: the same bits from every mathematical library.
//
// value = rho / 2 softplus(a)^2, softplus(a) = tau log(1 + exp(a / tau)). Its curvature is positive everywhere and dies out below -9 tau, where it counts as 0.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

namespace minsnap {

// exp(x) for |x| <= 700: x = k log 2 + r, Taylor's series of r to the 13th power (|r| <= 0.35), times 2^k.
inline double own_exp(double x) {
    constexpr double log2_high = 0x1.62e42feep-1, log2_low = 0x1.a39ef35793c76p-33;
    const double k = std::floor(x * 1.4426950408889634 + 0.5);
    const double r = (x - k * log2_high) - k * log2_low;
    double sum = 1.0;
    for (int i = 13; i >= 1; --i) sum = 1.0 + r * sum / i;
    const std::uint64_t bits = std::uint64_t(std::int64_t(k) + 1023) << 52;
    double power;
    std::memcpy(&power, &bits, sizeof power);
    return sum * power;
}

// log(y) for normal y > 0: y = 2^k m with m near 1, and 2 atanh((m - 1) / (m + 1)) by its series.
inline double own_log(double y) {
    std::uint64_t bits;
    std::memcpy(&bits, &y, sizeof bits);
    std::int64_t k = std::int64_t(bits >> 52) - 1023;
    bits = (bits & 0xfffffffffffffULL) | (std::uint64_t(1023) << 52);
    double m;
    std::memcpy(&m, &bits, sizeof m);
    if (m > 1.4142135623730951) {
        m *= 0.5;
        ++k;
    }
    const double q = (m - 1.0) / (m + 1.0), square = q * q;
    double sum = 0.0;
    for (int i = 23; i >= 1; i -= 2) sum = sum * square + 1.0 / i;
    return 2.0 * q * sum + double(k) * 0.6931471805599453;
}

struct Penalty {
    double value, slope, curvature;
};

class SoftPenalty {
public:
    SoftPenalty(double rho, double tau) : rho_(rho), tau_(tau) {}

    double dead() const { return 9.0 * tau_; }  // below minus this it counts as 0

    Penalty operator()(double a) const {
        const double z = a / tau_;
        if (z < -9.0) return {0.0, 0.0, 0.0};
        if (z > 30.0) return {0.5 * rho_ * a * a, rho_ * a, rho_};
        const double e = own_exp(z), soft = tau_ * (e < 1e-3 ? e * (1.0 - e * (0.5 - e / 3.0)) : own_log(1.0 + e)), share = e / (1.0 + e);
        return {0.5 * rho_ * soft * soft, rho_ * soft * share, rho_ * (share * share + soft * share * (1.0 - share) / tau_)};
    }

private:
    double rho_, tau_;
};

}  // namespace minsnap

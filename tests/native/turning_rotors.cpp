// Reads parameters of a limit on rotors or on the body rate and cases of motion and heading; prints for each the values, then by function its gradient as sums have it,
// and as numbers with derivatives do: in the motion, and last in the logarithm of the duration.
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "shortest_time/instant_limits.hpp"

using namespace minsnap;

int main(int, char **arguments) {
    const int cases = std::atoi(arguments[1]), along = std::atoi(arguments[2]), kind = std::atoi(arguments[3]);
    std::vector<double> parameters(TurningRotors::values + 1), weight(4 * TurningRotors::functions);
    for (double &value : parameters)
        if (std::scanf("%lf", &value) != 1) return 1;
    InstantLimit limit(MomentaryLimit{kind, parameters.data()});
    limit.along = along != 0;
    if (limit.follows()) limit.span.low = 1;
    const int inputs = limit.inputs(), given = limit.given();
    for (int k = 0; k < cases; ++k) {
        Quad u[InstantLimit::most_inputs] = {}, out[InstantLimit::most_functions];
        for (int n = 0; n < given; ++n) {
            double value = 0.0;
            if (std::scanf("%lf", &value) != 1) return 1;
            u[n] = filled<Quad>(value);
        }
        limit.values(u, out);
        for (int f = 0; f < limit.functions; ++f) std::printf("%.17g ", out[f][0]);
        for (int f = 0; f < limit.functions; ++f) {
            InstantTerms terms;
            std::vector<double> none(weight.size(), 0.0), one = none;
            for (int lane = 0; lane < 4; ++lane) one[std::size_t(4 * f + lane)] = 1.0;
            limit.gather(u, {none.data(), none.data(), one.data()}, 4, terms);
            for (int n = 0; n < inputs; ++n) std::printf("%.17g ", terms.slope[n][0]);
            std::printf("%.17g ", terms.own_slope[0]);
            for (int n = 0; n <= inputs; ++n) {
                Quad step[InstantLimit::most_inputs] = {}, slope[InstantLimit::most_functions];
                if (n < inputs) step[n] = filled<Quad>(1.0);
                for (int m = inputs; n == inputs && m < given; ++m) step[m] = -double(limit.order(m)) * u[m];
                step[given - 1] = u[given - 1];
                if (limit.follows()) follow(step, step + inputs);
                limit.slopes(u, step, slope);
                std::printf("%.17g ", slope[f][0]);
            }
        }
        std::printf("\n");
    }
}

// What calls from C++ take: the least and the median of many, in microseconds. Not a test; `make cpp` builds it as build/cpp/tests/timing.
#include <algorithm>
#include <chrono>
#include <cstdio>

#include <minsnap.hpp>

namespace {

void measure(const char *name, minsnap::Planner &planner, const minsnap::Problem &problem, int calls) {
    std::vector<double> taken;
    for (int call = 0; call < calls; ++call) {
        const auto began = std::chrono::steady_clock::now();
        const minsnap::Plan plan = planner.plan(problem);
        taken.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - began).count());
        if (plan.status != MINSNAP_DONE) std::puts(planner.message());
    }
    std::sort(taken.begin(), taken.end());
    std::printf("| %s | %.1f | %.1f |\n", name, taken.front(), taken[taken.size() / 2]);
}

}  // namespace

int main() {
    minsnap::Planner planner;
    minsnap::Problem legs(3), rectangle(3);
    for (int i = 0; i <= 10; ++i) {
        legs.points.insert(legs.points.end(), {double(i), double(i % 3), 1.0});
        if (i > 0) legs.durations.push_back(1.0);
    }
    measure("10 legs, durations", planner, legs, 10000);
    rectangle.points = {0, 0, 1, 8, 0, 1, 8, 4, 1, 0, 4, 1, 0, 0, 1};
    rectangle.durations = {4, 2, 4, 2}, rectangle.widths = {0.3, 0.3, 0.3, 0.3};
    measure("rectangle in a tube, durations", planner, rectangle, 3000);
    rectangle.durations.clear(), rectangle.total_time = 12.0;
    measure("rectangle in a tube, best split of 12 s", planner, rectangle, 500);
    minsnap::Limits limits;
    limits.speed = 3.0, limits.acceleration = 5.0, limits.jerk = 30.0;
    rectangle.total_time = 0.0, rectangle.within(limits), rectangle.pieces = 1;
    measure("rectangle in a tube within limits, one polynomial a leg", planner, rectangle, 200);
    rectangle.pieces = 0;
    measure("the same, six chosen", planner, rectangle, 40);
}

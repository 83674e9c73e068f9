// A planner allocates nothing where it does what it did before: not for plans, not for plans in flight, nor for what it proves of them. Where an
// allocation is refused, the call ends with a status and writes nothing.
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

#include "expect.hpp"
#include "problems.hpp"

namespace {

long allocations = 0;                 // by any of the functions below
long refused_from = -1, refused = 0;  // which one of them is refused first, and how many are from there on

bool refuse() {
    const long place = allocations++;
    return refused_from >= 0 && place >= refused_from && place - refused_from < refused;
}

}  // namespace

#if defined(__GLIBC__)
#include <dlfcn.h>

namespace {

// The function of that name that this one stands before: of the system, or of a sanitizer.
template <class Function>
Function behind(Function, const char *name) {
    return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {
void *malloc(std::size_t bytes) noexcept {
    static const auto next = behind(&malloc, "malloc");
    return refuse() ? nullptr : next(bytes);
}
void *realloc(void *block, std::size_t bytes) noexcept {
    static const auto next = behind(&realloc, "realloc");
    return refuse() ? nullptr : next(block, bytes);
}
int posix_memalign(void **block, std::size_t alignment, std::size_t bytes) noexcept {
    static const auto next = behind(&posix_memalign, "posix_memalign");
    return refuse() ? ENOMEM : next(block, alignment, bytes);
}
void *aligned_alloc(std::size_t alignment, std::size_t bytes) noexcept {
    static const auto next = behind(&aligned_alloc, "aligned_alloc");
    return refuse() ? nullptr : next(alignment, bytes);
}
}
#endif

void *operator new(std::size_t bytes) {
    ++allocations;
    if (void *const block = std::malloc(bytes)) return block;
    std::abort();
}
void *operator new(std::size_t bytes, const std::nothrow_t &) noexcept { return ++allocations, std::malloc(bytes); }
void operator delete(void *block) noexcept { std::free(block); }
void operator delete(void *block, std::size_t) noexcept { std::free(block); }

namespace {

std::vector<minsnap::Problem> given_times() {
    std::vector<minsnap::Problem> all(5, rectangle());
    for (minsnap::Problem &problem : all) problem.durations = {4, 2, 4, 2};
    all[1].closed = true;
    all[2].widths = all[3].widths = all[4].widths = {0.3, 0.3, 0.3, 0.3};
    all[3].pieces = 2, all[3].degree = 9;
    all[4].durations.clear(), all[4].total_time = 12.0;
    return all;
}

std::vector<minsnap::Problem> within_limits() {
    std::vector<minsnap::Problem> all(5, rectangle());
    for (minsnap::Problem &problem : all) problem.within(usual());
    all[1].widths = {0.5, 0.5, 0.5, 0.5};
    all[2].radii = {0, 0.3, 0.3, 0.3, 0}, all[2].pieces = 6;
    all[3].box_lower = {-1, -1, 0, 7, -1, 0, -1, 3, 0, -1, -1, 0}, all[3].box_upper = {9, 1, 2, 9, 5, 2, 9, 5, 2, 1, 5, 2};
    minsnap::Limits lifted;
    lifted.max_thrust = 1.6, lifted.min_thrust = 0.5, lifted.tilt = 0.5, lifted.speed = 4.0, lifted.jerk = 30.0, lifted.body_rate = 3.0;
    all[4].within(lifted);
    return all;
}

// Do it until the planner is warm and allocates nothing: its two curves take turns, and a replan that the clock ends may end later the next time.
template <class Work>
void expect_nothing_allocated(const char *what, std::size_t index, Work work) {
    long made = 0;
    for (int round = 0; round < 12; ++round) {
        const long before = allocations;
        work();
        made = allocations - before;
        if (round > 0 && made == 0) return;
    }
    ++wrong, std::printf("%s %zu: %ld allocations\n", what, index, made);
}

bool same(const minsnap_curve &one, const minsnap_curve &other) {
    const auto count = std::size_t(one.legs * one.pieces);
    return one.legs == other.legs && one.pieces == other.pieces && one.degree == other.degree &&
           std::memcmp(one.points, other.points, sizeof(double) * count * std::size_t((one.degree + 1) * one.dim)) == 0 &&
           std::memcmp(one.durations, other.durations, sizeof(double) * count) == 0;
}

// Refuse one allocation of a plan, or all from there on: it ends without memory and writes nothing, or with another certified curve. Either way
// the planner then makes the plan that it would have made.
void expect_refusals_are_told(const char *what, std::size_t index, const minsnap::Problem &problem) {
    minsnap_problem asked;
    minsnap_planner *first = nullptr;
    minsnap_curve usual = minsnap_curve_new();
    EXPECT(problem.view(asked) && minsnap_open(MINSNAP_ABI, &first) == MINSNAP_DONE);
    const long before = allocations;
    EXPECT(minsnap_plan(first, &asked, &usual) == MINSNAP_DONE);
    const long made = allocations - before, tries = 20;
    EXPECT(made > 0);
    for (long place = 0; place < made; place += 1 + made / tries)
        for (const long count : {1L, LONG_MAX}) {
            minsnap_planner *planner = nullptr;
            minsnap_certificate proved = minsnap_certificate_new();
            minsnap_curve curve = minsnap_curve_new();
            EXPECT(minsnap_open(MINSNAP_ABI, &planner) == MINSNAP_DONE);
            refused_from = allocations + place, refused = count;
            const minsnap_status status = minsnap_plan(planner, &asked, &curve);
            refused_from = -1;
            bool right = status == MINSNAP_NO_MEMORY && curve.legs == 0 && minsnap_message(planner)[0] != 0;
            if (status == MINSNAP_DONE) right = minsnap_certify(planner, &asked, &curve, &proved) == MINSNAP_DONE && proved.kept == 1;
            if (!right)
                ++wrong, std::printf("%s %zu, allocation %ld of %ld: status %d: %s\n", what, index, place, made, status,
                                     minsnap_message(planner));
            EXPECT(minsnap_plan(planner, &asked, &curve) == MINSNAP_DONE && same(curve, usual));
            minsnap_close(planner);
        }
    minsnap_close(first);
}

}  // namespace

int main() {
    const std::vector<minsnap::Problem> given = given_times(), limited = within_limits();
    for (std::size_t k = 0; k < given.size(); ++k) {
        minsnap::Planner planner;
        minsnap::Plan plan;
        expect_nothing_allocated("plan in given times", k, [&] { planner.plan(given[k], plan); });
        EXPECT(plan.status == MINSNAP_DONE);
        expect_refusals_are_told("plan in given times", k, given[k]);
        expect_nothing_allocated("certificate in given times", k, [&] { EXPECT(planner.certify(given[k], plan.curve).kept == 1); });
    }
    for (std::size_t k = 0; k < limited.size(); ++k) {
        minsnap::Planner planner;
        minsnap::Plan plan, next, rest;
        minsnap::Problem ahead = limited[k];
        ahead.points[6] += 0.3;
        expect_nothing_allocated("plan", k, [&] { planner.plan(limited[k], plan); });
        EXPECT(plan.status == MINSNAP_DONE);
        expect_nothing_allocated("replan", k, [&] { planner.replan(ahead, plan.curve, 0.3, 0.7, next); });
        EXPECT(next.status != MINSNAP_BAD_NUMBER && next.status != MINSNAP_BAD_SIZE);
        expect_nothing_allocated("brake", k, [&] { planner.brake(limited[k], plan.curve, 1.0, rest); });
        EXPECT(rest.status == MINSNAP_DONE);
        expect_nothing_allocated("certificate", k, [&] { EXPECT(planner.certify(limited[k], plan.curve).kept == 1); });
        expect_nothing_allocated("least time", k, [&] { EXPECT(planner.least_time(limited[k]) > 0.0); });
    }
    minsnap::Problem leg(3), tube;
    leg.points = {0, 0, 1, 4, 1, 1.5}, leg.pieces = 1;
    leg.within(usual());
    tube = leg, tube.widths = {0.4};
    expect_refusals_are_told("leg within limits", 0, leg);
    expect_refusals_are_told("leg in a tube within limits", 0, tube);
    return wrong;
}

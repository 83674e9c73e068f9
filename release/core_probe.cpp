// Loads a native core and prints a number for each of 60 problems that depends on every bit of the answer: what two
// platforms print is compared.  Problems come from a generator of integers (Knuth's MMIX constants), so that they are alike.
#include <cstdint>
#include <cstdio>
#include <vector>

#if defined(_WIN32)
#include <windows.h>
static void *entry(const char *library, const char *name) {
    HMODULE core = LoadLibraryA(library);
    return core ? reinterpret_cast<void *>(GetProcAddress(core, name)) : nullptr;
}
#else
#include <dlfcn.h>
static void *entry(const char *library, const char *name) {
    void *core = dlopen(library, RTLD_NOW);
    if (core == nullptr) std::fprintf(stderr, "%s\n", dlerror());
    return core ? dlsym(core, name) : nullptr;
}
#endif

using Free = std::int32_t (*)(const double *, const double *, std::int64_t, std::int32_t, std::int32_t, double *);
using Tube = std::int32_t (*)(const double *, const double *, const double *, std::int64_t, std::int32_t, std::int32_t,
                              std::int32_t, double, double *, double *, double *);

static std::uint64_t state = 20261122;

static double uniform(double least, double most) {  // multiples of 2^-10, which are exact everywhere
    state = state * 6364136223846793005u + 1442695040888963407u;
    return least + (most - least) * double(state >> 54) / 1024.0;
}

static std::uint64_t digest(const std::vector<double> &values) {  // FNV-1a over the bytes
    std::uint64_t hash = 14695981039346656037u;
    const auto *bytes = reinterpret_cast<const unsigned char *>(values.data());
    for (std::size_t i = 0; i < values.size() * sizeof(double); ++i) hash = (hash ^ bytes[i]) * 1099511628211u;
    return hash;
}

int main(int count, char **arguments) {
    if (count != 2) return 2;
    const auto free = reinterpret_cast<Free>(entry(arguments[1], "minsnap_unconstrained"));
    const auto tube = reinterpret_cast<Tube>(entry(arguments[1], "minsnap_tube"));
    if (free == nullptr || tube == nullptr) return 1;
    for (int problem = 0; problem < 60; ++problem) {
        const int legs = 2 + problem % 12, half = 2 + problem % 5, dim = 3;
        std::vector<double> points, durations, out(std::size_t(legs) * 2 * half * dim), breaks(legs + 1), figures(4);
        for (int i = 0; i < (legs + 1) * dim; ++i) points.push_back(uniform(-8.0, 8.0));
        for (int i = 0; i < legs; ++i) durations.push_back(uniform(1.0, 4.0));
        const double width = uniform(0.25, 0.5);
        const std::int32_t status = free(points.data(), durations.data(), legs, dim, half, out.data());
        std::printf("free %2d %d %016llx\n", problem, int(status), static_cast<unsigned long long>(digest(out)));
        const std::int32_t held = tube(points.data(), durations.data(), &width, legs, dim, half, 1, 1e-6, out.data(),
                                       breaks.data(), figures.data());
        std::printf("tube %2d %d %016llx\n", problem, int(held), held ? 0ull : static_cast<unsigned long long>(digest(out)));
    }
    return 0;
}

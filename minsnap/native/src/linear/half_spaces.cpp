// Sets of half-spaces A x <= b with rows of unit length: their largest balls, and how far they reach along directions.
//
// The largest ball is a linear programme in its center and radius (S. Boyd and L. Vandenberghe, "Convex Optimization", 2004,
// section 4.3.1). Where centers have room it is halfway between the corners that two beginnings lead to.
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "basics/border.hpp"
#include "basics/export.hpp"
#include "basics/status.hpp"
#include "linear/few_unknowns.hpp"

namespace minsnap {
namespace {

using End = FewUnknowns::End;

constexpr double beyond = 1e6;  // reach of the cube in which centers are sought, over the largest radius

struct Rows {
    std::size_t dim, count;
    const double *normals, *bounds;

    Rows(const SetsRecord &asked, std::int64_t set)
        : dim(static_cast<std::size_t>(asked.dim)), count(static_cast<std::size_t>(asked.first[set + 1] - asked.first[set])) {
        normals = asked.normals + dim * static_cast<std::size_t>(asked.first[set]);
        bounds = asked.bounds + asked.first[set];
    }

    double size() const {
        double largest = 0.0;
        for (std::size_t i = 0; i < count; ++i) largest = std::fmax(largest, std::fabs(bounds[i]));
        return 1.0 + largest;
    }

    // Put the rows into a programme, with a last coefficient of 1 where that has a radius.
    bool put(FewUnknowns &programme, bool with_radius, double reach) const {
        if (!programme.begin(dim + with_radius, count + with_radius)) return false;
        programme.within(reach);
        for (std::size_t i = 0; i < count; ++i) {
            double *row = programme.add(bounds[i]);
            for (std::size_t j = 0; j < dim; ++j) row[j] = normals[dim * i + j];
            if (with_radius) row[dim] = 1.0;
        }
        return true;
    }
};

Status ball(const Rows &rows, double far, FewUnknowns &programme, double *center, double &radius) {
    const double reach = far * rows.size();
    if (!rows.put(programme, true, beyond * reach)) return Status::no_memory;
    double *last = programme.add(reach), growing[FewUnknowns::most] = {};
    for (std::size_t j = 0; j <= rows.dim; ++j) last[j] = j == rows.dim ? 1.0 : 0.0;
    growing[rows.dim] = -1.0;
    double corners[2][FewUnknowns::most];
    bool open[2];
    for (int k = 0; k < 2; ++k) {
        if (programme.solve(growing, k ? 1.0 : -1.0) != End::least) return Status::no_progress;
        for (std::size_t j = 0; j <= rows.dim; ++j) corners[k][j] = programme.x()[j];
        open[k] = programme.on_cube();
    }
    for (int k = 0; k < 2; ++k)
        if (open[k] && !open[1 - k])
            for (std::size_t j = 0; j <= rows.dim; ++j) corners[k][j] = corners[1 - k][j];
    for (std::size_t j = 0; j < rows.dim; ++j) center[j] = 0.5 * corners[0][j] + 0.5 * corners[1][j];
    radius = std::fmin(corners[0][rows.dim], corners[1][rows.dim]);
    return Status::done;
}

Status extent(const Rows &rows, double far, FewUnknowns &programme, const SetsRecord &asked, double *least) {
    if (!rows.put(programme, false, far * rows.size())) return Status::no_memory;
    for (std::int64_t k = 0; k < asked.ways; ++k) {
        const double *way = asked.along + asked.dim * k;
        const End end = programme.solve(way, -1.0);
        if (end != End::least) return end == End::empty ? Status::infeasible : Status::no_progress;
        least[k] = 0.0;
        for (std::size_t j = 0; j < rows.dim; ++j) least[k] += way[j] * programme.x()[j];
    }
    return Status::done;
}

bool fits(const SetsRecord &asked) {
    constexpr std::int64_t most = std::int64_t{1} << 27;
    if (asked.sets < 1 || asked.sets > most || asked.dim < 1 || asked.dim >= std::int64_t{FewUnknowns::most} || asked.ways < 0)
        return false;
    for (std::int64_t i = 0; i < asked.sets; ++i)
        if (asked.first[i] < 0 || asked.first[i + 1] < asked.first[i] || asked.first[i + 1] > most) return false;
    return true;
}

}  // namespace
}  // namespace minsnap

// Centers and radii of the largest balls, or the least products with directions where there are any: see SetsRecord.
MINSNAP_EXPORT std::int32_t minsnap_half_spaces(const minsnap::SetsRecord *asked) {
    using namespace minsnap;
    if (!fits(*asked)) return static_cast<std::int32_t>(Status::bad_size);
    FewUnknowns programme;
    for (std::int64_t i = 0; i < asked->sets; ++i) {
        const Rows rows(*asked, i);
        const Status status = asked->ways ? extent(rows, asked->far, programme, *asked, asked->least + asked->ways * i)
                                          : ball(rows, asked->far, programme, asked->centers + asked->dim * i, asked->radii[i]);
        if (status != Status::done) return static_cast<std::int32_t>(status);
    }
    return static_cast<std::int32_t>(Status::done);
}

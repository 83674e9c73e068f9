// Entry point of the cone programmes of the joint search for curve and durations.
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "basics/export.hpp"
#include "cones/interior_point.hpp"

namespace {

using namespace minsnap;

constexpr std::int64_t most_values = std::int64_t{1} << 27;

bool finite(const double *values, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
        if (!std::isfinite(values[i])) return false;
    }
    return true;
}

struct Request {
    std::size_t size, pieces, width, cones, rows;
    const std::int64_t *columns, *cone_piece, *cone_size;
};

// Whether the columns are places of unknowns or `size`, and the cones name pieces in rising order and fill the rows.
bool consistent(const Request &p) {
    for (std::size_t i = 0; i < p.pieces * p.width; ++i) {
        if (p.columns[i] < 0 || p.columns[i] > static_cast<std::int64_t>(p.size)) return false;
    }
    std::int64_t before = 0, rows = 0;
    for (std::size_t k = 0; k < p.cones; ++k) {
        const std::int64_t piece = p.cone_piece[k], count = p.cone_size[k];
        if (piece < before || piece >= static_cast<std::int64_t>(p.pieces)) return false;
        if (count < 1 || count > static_cast<std::int64_t>(p.rows) - rows) return false;
        before = piece;
        rows += count;
    }
    return rows == static_cast<std::int64_t>(p.rows);
}

// Cones of whole rows.
void list_cones(const Request &p, const double *matrix, ConeEntry *cones) {
    for (std::size_t k = 0; k < p.cones; ++k) {
        const auto count = static_cast<std::size_t>(p.cone_size[k]);
        cones[k] = ConeEntry{static_cast<std::size_t>(p.cone_piece[k]), count, RowForm::whole, nullptr, matrix};
        matrix += count * p.width;
    }
}

}  // namespace

// Sizes: size, pieces, width, cones, rows. Results: x (size), z (rows), iterations (1).
MINSNAP_EXPORT std::int32_t minsnap_cone_programme(const std::int64_t *sizes, const std::int64_t *columns, const double *hessian,
                                                   const double *diagonal, const double *linear, const std::int64_t *cone_piece,
                                                   const std::int64_t *cone_size, const double *matrix, const double *bound,
                                                   double tolerance, std::int64_t most, double *x, double *z, std::int64_t *iterations) {
    const auto answer = [](Status status) { return static_cast<std::int32_t>(status); };
    for (int i = 0; i < 5; ++i) {
        if (sizes[i] < 1 || sizes[i] > most_values) return answer(Status::bad_size);
    }
    const auto count = [&](int i) { return static_cast<std::size_t>(sizes[i]); };
    const Request p{count(0), count(1), count(2), count(3), count(4), columns, cone_piece, cone_size};
    const std::size_t widest = static_cast<std::size_t>(most_values);
    if (p.width > 4096 || p.rows > widest / p.width || p.pieces > widest / (p.width * p.width) || !consistent(p)) {
        return answer(Status::bad_size);
    }
    if (!finite(hessian, p.pieces * p.width * p.width) || !finite(diagonal, p.size) || !finite(linear, p.size) ||
        !finite(matrix, p.rows * p.width) || !finite(bound, p.rows) || !(tolerance > 0.0)) {
        return answer(Status::bad_number);
    }
    Buffer<ConeEntry> cones;
    ConeRows rows;
    if (!cones.allocate(p.cones)) return answer(Status::no_memory);
    list_cones(p, matrix, cones.data());
    if (!rows.set({0, 0, p.width}, p.pieces, cones.data(), p.cones)) return answer(Status::no_memory);
    const ChainProgramme programme{p.size, p.pieces, columns, hessian, diagonal, linear, &rows, bound};
    InteriorPoint method(programme, tolerance, most);
    const Status status = method.solve(x, z);
    *iterations = method.iterations();
    return answer(status);
}

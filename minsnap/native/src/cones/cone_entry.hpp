// One cone of a piece: what its rows are made of.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "cones/cone_scaling.hpp"

namespace minsnap {

struct PieceShape {
    std::size_t ends, dim, rest;
    std::size_t bound() const { return ends * dim; }
    std::size_t width() const { return ends * dim + rest; }
};

enum class RowForm : std::uint8_t { factored, whole, rest_only };

struct ConeEntry {
    std::size_t piece, size;
    RowForm form;
    const double *factors;  // ends, where factored
    const double *matrix;   // size x (dim + rest), size x width, or size x rest
};

// Add R'R to the lower triangle of a square block, for rows R whose number is a multiple of four.
inline void add_lower_squares(const double *__restrict panel, std::size_t rows, std::size_t width, double *__restrict block) {
    for (std::size_t row = 0; row < rows; row += 4) {
        const double *p = panel + row * width, *q = p + width, *r = q + width, *s = r + width;
        for (std::size_t a = 0; a < width; ++a) {
            const double pa = p[a], qa = q[a], ra = r[a], sa = s[a];
            if (pa == 0.0 && qa == 0.0 && ra == 0.0 && sa == 0.0) continue;
            double *line = block + a * width;
            for (std::size_t b = 0; b <= a; ++b) line[b] += (pa * p[b] + qa * q[b]) + (ra * r[b] + sa * s[b]);
        }
    }
}

// Rows of W^-1 G of one cone, for columns side by side.
inline void scale_columns(const ConeScaling &scaling, const double *g, std::size_t count, std::size_t width, double *out) {
    const double size = 1.0 / scaling.eta, first = scaling.w[0];
    for (std::size_t j = 0; j < width; ++j) {
        double along = 0.0;
        for (std::size_t i = 1; i < count; ++i) along += scaling.w[i] * g[i * width + j];
        const double share = along / (1.0 + first) - g[j];
        for (std::size_t i = 1; i < count; ++i) out[i * width + j] = size * (g[i * width + j] + scaling.w[i] * share);
        out[j] = size * (first * g[j] - along);
    }
}

}  // namespace minsnap

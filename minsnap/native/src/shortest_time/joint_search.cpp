// Entry points of the joint search for a curve and its durations: the peaks of a curve, and one step of the search.
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "basics/export.hpp"
#include "cones/interior_point.hpp"
#include "shortest_time/joint_peaks.hpp"
#include "shortest_time/joint_programme.hpp"

namespace {

using namespace minsnap;

constexpr std::int64_t most_values = std::int64_t{1} << 26;

bool finite(const double *values, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
        if (!std::isfinite(values[i])) return false;
    }
    return true;
}

// Sizes: pieces, ends, dim, blocks, conditions in all, values in all.
constexpr int term_sizes = 6;

JointTerms terms_of(const std::int64_t *sizes, const std::int64_t *table, const std::int64_t *condition_piece,
                    const double *values, const double *maps, const double *ends, const double *durations) {
    const auto count = [&](int i) { return static_cast<std::size_t>(sizes[i]); };
    JointTerms t{count(0), count(1), count(2), count(3), table, condition_piece, values, {}, ends, durations};
    for (std::size_t p = 0; p < joint_orders; ++p) {
        t.maps[p] = maps;
        if (p <= t.degree()) maps += (t.degree() + 1 - p) * t.ends;
    }
    return t;
}

// Whether a row of the table names conditions and values that are there.
bool row_consistent(const std::int64_t *row, const std::int64_t *sizes) {
    const std::int64_t pieces = sizes[0], dim = sizes[2], conditions = row[4];
    if (row[0] < 0 || row[0] > 8 || row[1] < 0 || row[2] < row[1] || row[2] >= static_cast<std::int64_t>(joint_orders)) return false;
    if (row[3] < 1 || row[3] > static_cast<std::int64_t>(joint_parts) || conditions < 1 || row[5] < 0 || row[5] > 1) return false;
    if (row[6] < 0 || conditions > sizes[4] - row[6] || row[7] < 0 || row[7] > sizes[5] - 2) return false;
    const std::int64_t room = sizes[5] - row[7] - 2;
    if (row[0] == 0) return row[1] == row[2] && conditions <= room / (row[3] * (dim + 1));
    const Form form = form_of(static_cast<Kind>(row[0]));
    const auto values = static_cast<std::int64_t>(joint_orders + form.parameters);
    const std::int64_t least = static_cast<Kind>(row[0]) == Kind::look_rate ? 0 : 1;
    return dim == 3 && row[3] == form.parts && conditions == form.functions * pieces && room >= values && row[1] >= least && row[2] <= row[1] + 3;
}

bool consistent(const std::int64_t *sizes, const std::int64_t *table, const std::int64_t *condition_piece) {
    for (int i = 0; i < term_sizes; ++i) {
        if (sizes[i] < 1 || sizes[i] > most_values) return false;
    }
    if (sizes[1] < 4 || sizes[1] > static_cast<std::int64_t>(joint_ends) || sizes[1] % 2 != 0) return false;
    if (sizes[2] > static_cast<std::int64_t>(joint_dim) || sizes[0] > (1 << 16) || sizes[3] > 4096) return false;
    for (std::int64_t k = 0; k < sizes[4]; ++k) {
        if (condition_piece[k] < 0 || condition_piece[k] >= sizes[0]) return false;
    }
    for (std::int64_t b = 0; b < sizes[3]; ++b) {
        if (!row_consistent(table + 8 * b, sizes)) return false;
    }
    return true;
}

bool positive(const double *values, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
        if (!(values[i] > 0.0)) return false;
    }
    return true;
}

bool proper(const JointTerms &t, const std::int64_t *sizes) {
    return finite(t.values, static_cast<std::size_t>(sizes[5])) && finite(t.state_ends, t.pieces * t.ends * t.dim) &&
           finite(t.durations, t.pieces) && positive(t.durations, t.pieces);
}

// Counts of a step: size, instants, peaks, given cones, rows of those, metrics, whether curved.
bool step_consistent(const JointTerms &t, const std::int64_t *counts, const StepRequest &r) {
    for (int i = 0; i < 7; ++i) {
        if (counts[i] < 0 || counts[i] > most_values) return false;
    }
    if (counts[0] < 1 || counts[1] < 2 || counts[5] > 16) return false;
    const std::size_t width = t.ends * t.dim + joint_rest;
    for (std::size_t i = 0; i < t.pieces * width; ++i) {
        if (r.columns[i] < 0 || r.columns[i] > counts[0]) return false;
    }
    for (std::size_t i = 0; i < t.pieces; ++i) {
        const std::int64_t *last = r.columns + (i + 1) * width;
        if (last[-4] == counts[0] || last[-2] == counts[0] || last[-1] == counts[0]) return false;
    }
    std::int64_t rows = 0, before = 0;
    for (std::size_t k = 0; k < r.given; ++k) {
        if (r.given_piece[k] < 0 || r.given_piece[k] >= static_cast<std::int64_t>(t.pieces)) return false;
        if (r.given_size[k] < 1 || r.given_size[k] > counts[4] - rows) return false;
        rows += r.given_size[k];
    }
    for (std::size_t k = 0; k < r.peaks; ++k) {
        if (r.peak_block[k] < before || r.peak_block[k] >= static_cast<std::int64_t>(t.blocks)) return false;
        before = r.peak_block[k];
        if (r.peak_index[k] < 0 || r.peak_index[k] >= t.table[8 * before + 4]) return false;
        if (!(r.peak_s[k] >= 0.0 && r.peak_s[k] <= 1.0)) return false;
    }
    for (std::size_t m = 0; m < r.metrics; ++m) {
        if (r.metric_order[m] < 0 || r.metric_order[m] > 16) return false;
    }
    return rows == counts[4];
}

}  // namespace

// Largest excesses and peaks on a grid of so many instants a piece; `room` for peaks.
MINSNAP_EXPORT std::int32_t minsnap_joint_measure(const std::int64_t *sizes, const std::int64_t *table,
                                                  const std::int64_t *condition_piece, const double *values,
                                                  const double *maps, const double *ends, const double *durations,
                                                  std::int64_t instants, std::int64_t room, double *tops, double *places,
                                                  std::int64_t *conditions, std::int64_t *counts, std::int64_t *index,
                                                  double *s) {
    const auto answer = [](Status status) { return static_cast<std::int32_t>(status); };
    if (!consistent(sizes, table, condition_piece) || instants < 3 || instants > 4096 || room < 0) return answer(Status::bad_size);
    const JointTerms terms = terms_of(sizes, table, condition_piece, values, maps, ends, durations);
    if (!proper(terms, sizes)) return answer(Status::bad_number);
    JointPeaks out{tops, places, conditions, counts, index, s, static_cast<std::size_t>(room)};
    return answer(PeakSearch(terms, out).run(static_cast<std::size_t>(instants)));
}

// One step: x (size) and the forces of its multipliers in and out. The objective is linear and quadratic (or null). A
// step that was tried, without slacks (size), and the curve after it correct the bounds, or are null. `numbers`: proximity, reach, longest, shortest,
// penalties (2), inwards (2), accuracy, seconds after which no iteration begins.
MINSNAP_EXPORT std::int32_t minsnap_joint_step(
    const std::int64_t *sizes, const std::int64_t *table, const std::int64_t *condition_piece, const double *values,
    const double *maps, const double *ends, const double *durations, const std::int64_t *counts,
    const std::int64_t *columns, const double *scales, const double *exponents, const std::int64_t *peak_block,
    const std::int64_t *peak_index, const std::int64_t *peak_own, const double *peak_s, const std::int64_t *given_piece,
    const std::int64_t *given_size, const double *given_matrix, const double *given_bound,
    const std::int64_t *metric_order, const double *metric_matrix, const double *metric_size, const double *lengths,
    const double *numbers, const double *linear, const double *quadratic, const double *tried,
    const double *tried_ends, const double *tried_durations, std::int64_t most, double *force, double *own, double *x,
    std::int64_t *iterations) {
    const auto answer = [](Status status) { return static_cast<std::int32_t>(status); };
    if (!consistent(sizes, table, condition_piece)) return answer(Status::bad_size);
    const JointTerms terms = terms_of(sizes, table, condition_piece, values, maps, ends, durations);
    if (!proper(terms, sizes) || !finite(numbers, 9)) return answer(Status::bad_number);
    const auto count = [&](int i) { return static_cast<std::size_t>(counts[i]); };
    const StepRequest request{
        count(0), count(1), count(2), count(3), count(5), columns, scales, exponents, peak_block, peak_index, peak_own, peak_s,
        given_piece, given_size, given_matrix, given_bound, metric_order, metric_matrix, metric_size, lengths, numbers[0],
        numbers[1], numbers[2], numbers[3], {numbers[4], numbers[5]}, {numbers[6], numbers[7]}, force, own, counts[6] != 0, linear,
        quadratic, tried, tried_ends, tried_durations};
    if (!step_consistent(terms, counts, request)) return answer(Status::bad_size);
    if (!positive(scales, terms.pieces * terms.ends) || !positive(lengths, terms.pieces)) return answer(Status::bad_number);
    if (!finite(linear, count(0))) return answer(Status::bad_number);
    if (tried != nullptr && !(finite(tried, count(0)) && proper(terms.with(tried_ends, tried_durations), sizes))) {
        return answer(Status::bad_number);
    }
    JointProgramme programme(terms, request);
    if (!programme.build()) return answer(Status::no_memory);
    const std::size_t rows = programme.rows().rows(terms.pieces);
    Buffer<double> z;
    if (!z.allocate(rows + 1)) return answer(Status::no_memory);
    if (!finite(programme.bound(), rows) ||
        !finite(programme.hessian(), terms.pieces * programme.width() * programme.width())) {
        return answer(Status::bad_number);
    }
    const ChainProgramme chain{count(0), terms.pieces, columns, programme.hessian(), programme.diagonal(),
                               programme.linear(), &programme.rows(), programme.bound(), programme.start()};
    InteriorPoint method(chain, numbers[8], most, numbers[9]);
    const Status status = method.solve(x, z.data());
    *iterations = method.iterations();
    if (status == Status::done) programme.take_forces(z.data());
    return answer(status);
}

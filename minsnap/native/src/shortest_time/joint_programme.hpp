// The cone programme of one step of the joint search around a curve: its cones and its Hessian.
//
// The same programme in Python is time_allocation/joint_model.py.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "basics/buffer.hpp"
#include "cones/cone_rows.hpp"
#include "cones/cone_scaling.hpp"
#include "cones/interior_point.hpp"
#include "shortest_time/joint_curvature.hpp"
#include "shortest_time/joint_grid.hpp"
#include "shortest_time/joint_terms.hpp"

namespace minsnap {

constexpr std::size_t slacks = 2, joint_rest = neighbours + slacks;
constexpr double curvature_share = 0.5;  // of the positive part, which exceeds the whole along the active rows

// Arrays of the caller.
struct StepRequest {
    std::size_t size, instants, peaks, given, metrics;
    const std::int64_t *columns;              // pieces x width, `size` for none
    const double *scales, *exponents;         // pieces x ends, pieces x ends x 3
    const std::int64_t *peak_block, *peak_index, *peak_own;  // peaks; own ones are kept even if one like them is
    const double *peak_s;
    const std::int64_t *given_piece, *given_size;  // cones of whole rows
    const double *given_matrix, *given_bound;
    const std::int64_t *metric_order;         // metrics
    const double *metric_matrix, *metric_size;  // metrics x ends x ends, metrics x pieces
    const double *lengths;                    // pieces
    double proximity, reach, longest, shortest;
    double penalties[slacks], inwards[slacks];
    double *force, *own;                      // pieces x ends x dim, pieces
    bool curved;
    const double *linear, *quadratic;         // objective: size; pieces x width x width, or none
    const double *tried, *tried_ends, *tried_durations;  // a step without slacks (size) and its curve, or none
};

class JointProgramme {
public:
    JointProgramme(const JointTerms &terms, const StepRequest &step) : t_(terms), r_(step) {}

    std::size_t width() const { return t_.ends * t_.dim + joint_rest; }
    ConeRows &rows() { return rows_; }
    const double *bound() const { return bound_.data(); }
    const double *hessian() const { return hessian_.data(); }
    const double *diagonal() const { return diagonal_.data(); }
    const double *linear() const { return linear_.data(); }

    [[nodiscard]] bool build() { return list_conditions() && list_cones() && fill_cones() && fill_costs(); }

    // The curve as it is, with slacks that leave room in all cones.
    const double *start() {
        double most[slacks] = {};
        const double *bound = bound_.data();
        for (std::size_t k = 0; k < cones_; bound += entries_[k].size, ++k) {
            if (items_[k].block < 0) continue;
            const JointBlock block(t_, static_cast<std::size_t>(items_[k].block));
            most[block.slack] = std::max(most[block.slack], cone_depth(bound, entries_[k].size) / block.weight);
        }
        std::fill(start_.data(), start_.data() + r_.size, 0.0);
        for (std::size_t k = 0; k < slacks; ++k) start_[slack_column(k)] = most[k] + start_room;
        return start_.data();
    }

    // Forces of a solution's multipliers in the ends and in the durations.
    void take_forces(const double *z) {
        const std::size_t bound = t_.ends * t_.dim;
        std::fill(r_.force, r_.force + t_.pieces * bound, 0.0);
        std::fill(r_.own, r_.own + t_.pieces, 0.0);
        for (std::size_t k = 0; k < cones_; z += entries_[k].size, ++k) {
            if (items_[k].block >= 0) add_force(items_[k], entries_[k], z);
        }
        for (std::size_t i = 0; i < t_.pieces * t_.ends; ++i) {
            for (std::size_t d = 0; d < t_.dim; ++d) r_.force[i * t_.dim + d] /= r_.scales[i];
        }
    }

private:
    struct Item {
        std::size_t piece;
        std::int64_t block;  // -1 for a bound of a step, -2 for a cone that is given
        std::size_t index;
        double s;
    };

    static constexpr std::size_t kinds_of_bounds = 6;

    // ---- which cones there are

    bool list_conditions() {
        if (!grid_.set(t_, r_.instants)) return false;
        std::size_t most = r_.peaks + r_.given + kinds_of_bounds * t_.pieces;
        for (std::size_t b = 0; b < t_.blocks; ++b) most += JointBlock(t_, b).conditions * r_.instants;
        if (!found_.allocate(most + 1) || !items_.allocate(most + 1)) return false;
        cones_ = 0;
        std::size_t peak = 0;
        for (std::size_t b = 0; b < t_.blocks; ++b) {
            const JointBlock block(t_, b);
            for (std::size_t c = 0; c < block.conditions; ++c) {
                const double *v = grid_.row(block, c);
                for (std::size_t g = 0; g < r_.instants; ++g) {
                    if (v[g] > -block.band) add_item(block, b, c, grid_.at(g));
                }
            }
            const std::size_t end = end_of_peaks(peak, b);
            if (!add_peaks(block, b, peak, end)) return false;
            peak = end;
        }
        list_bounds();
        return true;
    }

    void add_item(const JointBlock &block, std::size_t b, std::size_t condition, double s) {
        const auto piece = static_cast<std::size_t>(block.piece[condition]);
        found_[cones_++] = Item{piece, static_cast<std::int64_t>(b), condition, s};
    }

    std::size_t end_of_peaks(std::size_t first, std::size_t block) const {
        while (first < r_.peaks && static_cast<std::size_t>(r_.peak_block[first]) == block) ++first;
        return first;
    }

    // Peaks of a block without those remembered that are within 1/250 of a piece of another one.
    bool add_peaks(const JointBlock &block, std::size_t b, std::size_t first, std::size_t end) {
        if (!order_.allocate(end - first + 1)) return false;
        for (std::size_t k = first; k < end; ++k) order_[k - first] = k;
        const auto key = [&](std::size_t k) {
            return 1000 * r_.peak_index[k] + static_cast<std::int64_t>(std::lround(250.0 * r_.peak_s[k]));
        };
        std::sort(order_.data(), order_.data() + (end - first), [&](std::size_t k, std::size_t l) {
            const std::int64_t a = key(k), c = key(l);
            return a != c ? a < c : k < l;
        });
        for (std::size_t i = 0; i < end - first; ++i) {
            const std::size_t k = order_[i];
            const bool alike = i > 0 && key(order_[i - 1]) == key(k);
            if (!alike || r_.peak_own[k] != 0) add_item(block, b, static_cast<std::size_t>(r_.peak_index[k]), r_.peak_s[k]);
        }
        return true;
    }

    void list_bounds() {
        for (std::size_t i = 0; i < t_.pieces; ++i) {
            const bool next = t_.pieces > 1 && present(i, 2);
            for (std::size_t kind = 0; kind < kinds_of_bounds; ++kind) {
                if ((kind < 2) || (kind < 4 && next) || (kind >= 4 && i == 0)) found_[cones_++] = Item{i, -1, kind, 0.0};
            }
        }
        for (std::size_t k = 0; k < r_.given; ++k) {
            found_[cones_++] = Item{static_cast<std::size_t>(r_.given_piece[k]), -2, k, 0.0};
        }
    }

    bool present(std::size_t piece, std::size_t neighbour) const {
        return r_.columns[piece * width() + t_.ends * t_.dim + neighbour] < static_cast<std::int64_t>(r_.size);
    }

    // ---- the cones in the order of their pieces

    bool list_cones() {
        if (!count_.allocate(t_.pieces + 1) || !entries_.allocate(cones_ + 1) || !given_at_.allocate(r_.given + 1)) return false;
        std::fill(count_.data(), count_.data() + t_.pieces + 1, std::size_t{0});
        for (std::size_t k = 0; k < cones_; ++k) ++count_[found_[k].piece + 1];
        for (std::size_t i = 0; i < t_.pieces; ++i) count_[i + 1] += count_[i];
        for (std::size_t k = 0; k < cones_; ++k) items_[count_[found_[k].piece]++] = found_[k];
        given_at_[0] = 0;
        for (std::size_t k = 0; k < r_.given; ++k) given_at_[k + 1] = given_at_[k] + static_cast<std::size_t>(r_.given_size[k]);
        std::size_t values = 0, rows = 0;
        for (std::size_t k = 0; k < cones_; ++k) {
            ConeEntry &entry = entries_[k];
            entry = shape_of(items_[k]);
            rows += entry.size;
            values += length_of(entry, items_[k]);
        }
        if (!values_.allocate(values + 1) || !bound_.allocate(rows + 1)) return false;
        place_values();
        return true;
    }

    ConeEntry shape_of(const Item &item) const {
        if (item.block == -1) return {item.piece, 1, RowForm::rest_only, nullptr, nullptr};
        if (item.block == -2) return {item.piece, static_cast<std::size_t>(r_.given_size[item.index]), RowForm::whole, nullptr, nullptr};
        const JointBlock block(t_, static_cast<std::size_t>(item.block));
        return {item.piece, block.components, block.flat() ? RowForm::factored : RowForm::whole, nullptr, nullptr};
    }

    std::size_t length_of(const ConeEntry &entry, const Item &item) const {
        if (item.block == -2) return 0;
        if (entry.form == RowForm::rest_only) return joint_rest;
        return entry.form == RowForm::whole ? entry.size * width() : t_.ends + entry.size * (t_.dim + joint_rest);
    }

    void place_values() {
        double *next = values_.data();
        for (std::size_t k = 0; k < cones_; ++k) {
            ConeEntry &entry = entries_[k];
            if (items_[k].block == -2) {
                entry.matrix = r_.given_matrix + given_at_[items_[k].index] * width();
                continue;
            }
            const std::size_t length = length_of(entry, items_[k]);
            if (entry.form == RowForm::factored) entry.factors = next;
            entry.matrix = entry.form == RowForm::factored ? next + t_.ends : next;
            next += length;
        }
    }

    // ---- what they say

    bool fill_cones() {
        double *bound = bound_.data();
        for (std::size_t k = 0; k < cones_; bound += entries_[k].size, ++k) {
            const Item &item = items_[k];
            double *matrix = const_cast<double *>(entries_[k].matrix);
            if (item.block == -1) {
                bound[0] = fill_bound(item.index, matrix);
            } else if (item.block == -2) {
                std::copy(r_.given_bound + given_at_[item.index], r_.given_bound + given_at_[item.index + 1], bound);
            } else {
                const JointBlock block(t_, static_cast<std::size_t>(item.block));
                if (block.flat()) {
                    fill_wall(block, item, const_cast<double *>(entries_[k].factors), matrix, bound);
                } else {
                    for (std::size_t c = 0; c < block.components; ++c) {
                        bound[c] = fill_momentary(block, item, c, matrix + c * width());
                    }
                }
                if (r_.tried != nullptr) correct(block, item, entries_[k], bound);
                bound[0] -= block.weight * r_.inwards[block.slack];
            }
        }
        return rows_.set({t_.ends, t_.dim, joint_rest}, t_.pieces, entries_.data(), cones_);
    }

    // Bounds of a duration's change, of its difference to the next one, and of the slacks.
    double fill_bound(std::size_t kind, double *row) const {
        std::fill(row, row + joint_rest, 0.0);
        if (kind >= 4) {
            row[neighbours + kind - 4] = -1.0;
            return 0.0;
        }
        row[1] = kind % 2 == 0 ? 1.0 : -1.0;
        if (kind < 2) return kind == 0 ? r_.longest : r_.shortest;
        row[2] = -row[1];
        return r_.reach;
    }

    // Derivatives of a derivative in the logarithms of the durations around, by axis: (dim, 3).
    void bends(std::size_t piece, const double *f, double share, double *out) const {
        const double *end = t_.state_ends + piece * t_.ends * t_.dim, *e = r_.exponents + piece * t_.ends * neighbours;
        std::fill(out, out + t_.dim * neighbours, 0.0);
        for (std::size_t j = 0; j < t_.ends; ++j, end += t_.dim, e += neighbours) {
            const double factor = f[j] / share;
            for (std::size_t d = 0; d < t_.dim; ++d) {
                for (std::size_t q = 0; q < neighbours; ++q) out[d * neighbours + q] += factor * end[d] * e[q];
            }
        }
    }

    void fill_wall(const JointBlock &block, const Item &item, double *factors, double *matrix, double *bound) {
        const std::size_t p = block.first_order, dim = t_.dim;
        double f[joint_ends], x[joint_dim], bent[joint_dim * neighbours];
        t_.factors(p, item.s, f);
        t_.derivative(item.piece, p, f, x);
        const double share = JointTerms::power(t_.durations[item.piece], p);
        bends(item.piece, f, share, bent);
        for (std::size_t j = 0; j < t_.ends; ++j) factors[j] = f[j] * r_.scales[item.piece * t_.ends + j] / share;
        block.parts(item.index, x, bound);
        const double *row = block.rows(item.index), *offset = block.offset(item.index);
        for (std::size_t c = 0; c < block.components; ++c, row += dim, matrix += dim + joint_rest) {
            double *rest = matrix + dim;
            std::fill(rest, rest + joint_rest, 0.0);
            for (std::size_t d = 0; d < dim; ++d) {
                matrix[d] = -row[d];
                for (std::size_t q = 0; q < neighbours; ++q) rest[q] -= row[d] * bent[d * neighbours + q];
            }
            rest[1] -= static_cast<double>(p) * offset[c];
            if (c == 0) rest[neighbours + block.slack] = -block.weight;
        }
    }

    // Row and bound of minus a function, or of a part of a cone.
    double fill_momentary(const JointBlock &block, const Item &item, std::size_t part, double *row) {
        Derivatives at;
        double gradient[12] = {}, bent[joint_dim * neighbours], f[joint_ends];
        fill_derivatives(t_, block, item.piece, item.s, at);
        const bool cone = block.components > 1;
        const double value = block.slopes(cone ? part : item.index % block.functions, at, gradient);
        for (double &slope : gradient) slope *= cone ? -1.0 : 1.0;
        std::fill(row, row + width(), 0.0);
        double *rest = row + t_.ends * t_.dim;
        const double *g = gradient;
        for (std::size_t p = block.first_order; p <= block.last_order; ++p, g += 3) {
            t_.factors(p, item.s, f);
            const double share = JointTerms::power(t_.durations[item.piece], p);
            bends(item.piece, f, share, bent);
            for (std::size_t j = 0; j < t_.ends; ++j) {
                const double factor = f[j] * r_.scales[item.piece * t_.ends + j] / share;
                for (std::size_t d = 0; d < 3; ++d) row[j * 3 + d] += factor * g[d];
            }
            for (std::size_t d = 0; d < 3; ++d) {
                for (std::size_t q = 0; q < neighbours; ++q) rest[q] += g[d] * bent[d * neighbours + q];
                rest[1] -= static_cast<double>(p) * g[d] * at.x[p][d];
            }
        }
        if (part == 0) rest[neighbours + block.slack] = -block.weight;
        return cone ? value : -value;
    }

    // The second-order correction (R. Fletcher, "Practical Methods of Optimization", 1987): bounds for which the rows at
    // the step that was tried are what the conditions turned out to be.
    void correct(const JointBlock &block, const Item &item, const ConeEntry &entry, double *bound) {
        const std::size_t piece = item.piece, dim = t_.dim, ends = t_.ends * dim;
        double x[joint_ends * joint_dim + joint_rest], f[joint_ends];
        for (std::size_t j = 0; j < width(); ++j) {
            const auto column = static_cast<std::size_t>(r_.columns[piece * width() + j]);
            x[j] = column < r_.size ? r_.tried[column] : 0.0;
        }
        const JointTerms after = t_.with(r_.tried_ends, r_.tried_durations);
        if (block.flat()) {
            const std::size_t p = block.first_order;
            double at[joint_dim], along[joint_dim] = {};
            t_.factors(p, item.s, f);
            after.derivative(piece, p, f, at);
            block.parts(item.index, at, bound);
            const double share = JointTerms::power(after.durations[piece] / t_.durations[piece], p);
            for (std::size_t j = 0; j < t_.ends; ++j) {
                for (std::size_t d = 0; d < dim; ++d) along[d] += entry.factors[j] * x[j * dim + d];
            }
            const double *row = entry.matrix;
            for (std::size_t c = 0; c < entry.size; ++c, row += dim + joint_rest) {
                bound[c] = share * bound[c] + dot(row, along, dim) + dot(row + dim, x + ends, joint_rest);
            }
            return;
        }
        Derivatives at;
        double gradient[12];
        fill_derivatives(after, block, piece, item.s, at);
        for (std::size_t c = 0; c < entry.size; ++c) {
            const double value = entry.size > 1 ? block.slopes(c, at, gradient) : -block.slopes(item.index % block.functions, at, gradient);
            bound[c] = value + dot(entry.matrix + c * width(), x, width());
        }
    }

    void add_force(const Item &item, const ConeEntry &entry, const double *z) {
        const std::size_t bound = t_.ends * t_.dim;
        double *force = r_.force + item.piece * bound;
        if (entry.form == RowForm::whole) {
            for (std::size_t c = 0; c < entry.size; ++c) {
                for (std::size_t j = 0; j < bound; ++j) force[j] += entry.matrix[c * width() + j] * z[c];
            }
            return;
        }
        const JointBlock block(t_, static_cast<std::size_t>(item.block));
        const auto p = static_cast<double>(block.first_order);
        double along[joint_dim] = {};
        for (std::size_t c = 0; c < entry.size; ++c) {
            const double *row = entry.matrix + c * (t_.dim + joint_rest);
            for (std::size_t d = 0; d < t_.dim; ++d) along[d] += row[d] * z[c];
            r_.own[item.piece] -= p * (p - 1.0) * block.offset(item.index)[c] * z[c];
        }
        for (std::size_t j = 0; j < t_.ends; ++j, force += t_.dim) {
            for (std::size_t d = 0; d < t_.dim; ++d) force[d] += entry.factors[j] * along[d];
        }
    }

    // ---- the objective, the proximal term and the curvature

    bool fill_costs() {
        const std::size_t w = width(), bound = t_.ends * t_.dim;
        if (!hessian_.allocate(t_.pieces * w * w) || !diagonal_.allocate(r_.size) || !start_.allocate(r_.size) || !linear_.allocate(r_.size)) return false;
        std::fill(hessian_.data(), hessian_.data() + t_.pieces * w * w, 0.0);
        std::fill(diagonal_.data(), diagonal_.data() + r_.size, 1e-10);
        std::copy(r_.linear, r_.linear + r_.size, linear_.data());
        if (r_.quadratic != nullptr) std::copy(r_.quadratic, r_.quadratic + t_.pieces * w * w, hessian_.data());
        double total = 0.0;
        for (std::size_t i = 0; i < t_.pieces; ++i) total += t_.durations[i];
        for (std::size_t i = 0; i < t_.pieces; ++i) {
            const double share = t_.durations[i] / total;
            const auto own = static_cast<std::size_t>(r_.columns[i * w + bound + 1]);
            diagonal_[own] += 0.1 * r_.proximity * share;
            add_metric(i, r_.proximity * share, hessian_.data() + i * w * w);
            if (r_.curved) add_curvature(i, hessian_.data() + i * w * w);
        }
        for (std::size_t k = 0; k < slacks; ++k) {
            diagonal_[slack_column(k)] = 1e-6;
            linear_[slack_column(k)] = r_.penalties[k];
        }
        return true;
    }

    std::size_t slack_column(std::size_t slack) const {
        return static_cast<std::size_t>(r_.columns[t_.ends * t_.dim + neighbours + slack]);
    }

    void add_metric(std::size_t piece, double weight, double *block) const {
        const double *scale = r_.scales + piece * t_.ends;
        for (std::size_t m = 0; m < r_.metrics; ++m) {
            const double size = r_.metric_size[m * t_.pieces + piece] /
                                JointTerms::power(t_.durations[piece], static_cast<std::size_t>(r_.metric_order[m]));
            const double *matrix = r_.metric_matrix + m * t_.ends * t_.ends;
            for (std::size_t i = 0; i < t_.ends; ++i) {
                for (std::size_t j = 0; j < t_.ends; ++j) {
                    const double value = weight * size * size * matrix[i * t_.ends + j] * scale[i] * scale[j];
                    for (std::size_t d = 0; d < t_.dim; ++d) block[(i * t_.dim + d) * width() + j * t_.dim + d] += value;
                }
            }
        }
    }

    void add_curvature(std::size_t piece, double *block) const {
        const std::size_t bound = t_.ends * t_.dim;
        bool free[joint_ends * joint_dim], there[neighbours];
        const std::int64_t *column = r_.columns + piece * width();
        for (std::size_t j = 0; j < bound; ++j) free[j] = column[j] < static_cast<std::int64_t>(r_.size);
        for (std::size_t q = 0; q < neighbours; ++q) there[q] = present(piece, q);
        const PieceForces forces{t_.state_ends + piece * bound, r_.scales + piece * t_.ends,
                                 r_.exponents + piece * t_.ends * neighbours, r_.force + piece * bound, r_.own[piece],
                                 r_.lengths[piece], free, there};
        PositiveCurvature(t_.ends, t_.dim).add(forces, curvature_share, block, width());
    }

    const JointTerms &t_;
    const StepRequest &r_;
    JointGrid grid_;
    ConeRows rows_;
    std::size_t cones_ = 0;
    Buffer<Item> found_, items_;
    Buffer<ConeEntry> entries_;
    Buffer<std::size_t> order_, count_, given_at_;
    Buffer<double> values_, bound_, hessian_, diagonal_, linear_, start_;
};

}  // namespace minsnap

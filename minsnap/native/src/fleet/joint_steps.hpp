// Levenberg-Marquardt steps of the joint search.
//
// The joint Gauss-Newton matrix is P + O: P couples the knots of one vehicle, O two vehicles through their rows. Conjugate gradients are preconditioned by P,
// factored for four vehicles at a time; since P z = r, the product P p follows its own recursion and costs nothing.
#pragma once

#include "fleet/joint_terms.hpp"
#include "fleet/lane_cholesky.hpp"

namespace minsnap {

class JointSteps {
public:
    explicit JointSteps(const JointQuestion &question)
        : q_(question), terms_(q_), size_(int(question.pieces - 1) * knot_size),
          groups_((question.vehicles + fleet_lanes - 1) / fleet_lanes) {}

    [[nodiscard]] bool allocate() {
        const std::size_t entries = std::size_t(groups_) * std::size_t(size_);
        bool all = terms_.allocate() && factors_.allocate(entries * band) && mask_.allocate(entries) &&
                   trial_.allocate(std::size_t(q_.vehicles * (q_.pieces + 1)) * knot_size);
        for (Buffer<Quad> *each : {&gradient_, &step_, &residual_, &solved_, &way_, &known_, &image_}) all = all && each->allocate(entries);
        if (!all) return false;
        for (Integer v = 0; v < groups_ * fleet_lanes; ++v)
            for (int r = 0; r < size_; ++r)
                lane(mask_, v)[r * fleet_lanes] = v < q_.vehicles ? q_.free[v * (q_.pieces + 1) * knot_size + knot_size + r] : 0.0;
        return true;
    }

    void forget() { terms_.forget(); }

    Status run(JointRun &run) {
        double *x = run.curves;
        Integer waited = 0, taken = 0;
        double least = infinite;
        for (; taken < run.iterations && *run.stop == 0; ++taken) {
            if (!terms_.evaluate(run, x, true, false)) return Status::no_memory;
            const double before = terms_.value;
            report(run, taken);
            const bool kept = taken > 0 && terms_.short_by < run.short_by && terms_.over_by < run.over_by;
            if (kept && run.settle == 0) break;
            const double off = std::fmax(terms_.short_by, terms_.over_by);
            waited = kept || off < 0.9 * least ? 0 : waited + 1;
            least = std::fmin(least, off);
            if (waited > run.patience) break;
            if (!factor()) return Status::singular;
            conjugate_gradients(int(run.inner));
            const double descent = dot(gradient_, step_);
            const double share = search(run, before, descent);
            if (share < 0.0) return Status::no_memory;
            damping_ = share == 1.0 ? std::fmax(damping_ / 3.0, 1e-7) : share < 0.3 ? std::fmin(damping_ * 4.0, 1e3) : damping_;
            if (share > 0.0) std::copy_n(trial_.data(), std::size_t(q_.vehicles * (q_.pieces + 1)) * knot_size, x);
            if (kept && -descent < 1e-3 * std::fabs(before)) break;
            if (share > 0.0 && terms_.short_by < 0.15 && terms_.over_by < 0.5 && !terms_.evaluate(run, x, false, true))
                return Status::no_memory;
        }
        if (!terms_.evaluate(run, x, false, false)) return Status::no_memory;
        report(run, taken);
        return Status::done;
    }

private:
    double *lane(Buffer<Quad> &values, Integer v) const {
        return reinterpret_cast<double *>(values.data() + (v / fleet_lanes) * size_) + v % fleet_lanes;
    }

    void report(const JointRun &run, Integer taken) const {
        run.found[0] = terms_.short_by;
        run.found[1] = terms_.over_by;
        run.found[2] = terms_.value;
        run.found[3] = double(taken);
    }

    // Try the step and shorter ones; the share that was taken, 0 for none, -1 for no memory.
    double search(const JointRun &run, double before, double descent) {
        double share = 1.0;
        for (int attempt = 0; attempt < 5; ++attempt, share *= 0.4) {
            for (Integer v = 0; v < q_.vehicles; ++v) {
                const double *from = run.curves + v * (q_.pieces + 1) * knot_size, *s = lane(step_, v);
                double *to = trial_.data() + v * (q_.pieces + 1) * knot_size;
                std::copy_n(from, (q_.pieces + 1) * knot_size, to);
                for (int r = 0; r < size_; ++r) to[knot_size + r] += share * s[r * fleet_lanes];
            }
            if (!terms_.evaluate(run, trial_.data(), false, false)) return -1.0;
            if (terms_.value <= before + 1e-4 * share * descent) return share;
        }
        return 0.0;
    }

    bool factor() {
        std::atomic<bool> good{true};
        auto task = [this, &good](Integer group) {
            gather(group);
            if (!lane_factor(factors_.data() + group * size_ * band, size_)) good = false;
        };
        Chunks<decltype(task)>(groups_, task).run(int(q_.threads));
        return good;
    }

    // Blocks and slopes of four vehicles, damped, into the band and the gradient; what is given has a unit row.
    void gather(Integer group) {
        Quad *matrix = factors_.data() + group * size_ * band, *slope = gradient_.data() + group * size_;
        std::fill_n(reinterpret_cast<double *>(matrix), std::size_t(size_) * band * fleet_lanes, 0.0);
        std::fill_n(reinterpret_cast<double *>(slope), std::size_t(size_) * fleet_lanes, 0.0);
        for (int i = 0; i < fleet_lanes && group * fleet_lanes + i < q_.vehicles; ++i)
            for (Integer m = 0; m < q_.pieces; ++m)
                gather_piece(m, group * fleet_lanes + i, reinterpret_cast<double *>(matrix) + i, reinterpret_cast<double *>(slope) + i);
        const Quad *mask = mask_.data() + group * size_;
        for (int r = 0; r < size_; ++r) {
            slope[r] *= mask[r];
            for (int b = 0; b < band; ++b) {
                const int c = r + b - half_band;
                if (c >= 0) matrix[r * band + b] *= mask[r] * mask[c];
            }
            matrix[r * band + half_band] = matrix[r * band + half_band] * (1.0 + 1e-10) + (1.0 - mask[r]);
        }
    }

    void gather_piece(Integer m, Integer v, double *matrix, double *slope) const {
        static constexpr int kind[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
        const double *block = terms_.block(m, v), *pull = terms_.slope(m, v), *gram = terms_.position_gram(m);
        const double damping = damping_ / (q_.length * q_.length);
        for (int e = 0; e < ends; ++e) {
            const int row = first_of(m, e);
            if (row < 0) continue;
            for (int a = 0; a < 3; ++a) slope[(row + a) * fleet_lanes] += pull[3 * e + a];
            for (int g = 0; g <= e; ++g) {
                const int column = first_of(m, g);
                if (column < 0) continue;
                const double *b = block + 6 * end_pair(e, g), damped = damping * gram[end_pair(e, g)];
                for (int a = 0; a < 3; ++a)
                    for (int c = 0; c < 3 && column + c <= row + a; ++c)
                        matrix[((row + a) * band + (column + c - row - a + half_band)) * fleet_lanes] +=
                            b[kind[a][c]] + (a == c ? damped : 0.0);
            }
        }
    }

    // Index of the first unknown of an end of a piece, negative where it is given.
    int first_of(Integer m, int e) const {
        const Integer knot = m + (e >= 4);
        return knot < 1 || knot >= q_.pieces ? -1 : int(knot - 1) * knot_size + (e & 3) * 3;
    }

    double dot(const Buffer<Quad> &one, const Buffer<Quad> &two) const {
        Quad sum{};
        for (Integer i = 0; i < groups_ * size_; ++i) sum += one[std::size_t(i)] * two[std::size_t(i)];
        return (sum[0] + sum[1]) + (sum[2] + sum[3]);
    }

    void precondition() {
        auto task = [this](Integer group) {
            std::copy_n(residual_.data() + group * size_, size_, solved_.data() + group * size_);
            lane_solve(factors_.data() + group * size_ * band, size_, solved_.data() + group * size_);
        };
        Chunks<decltype(task)>(groups_, task).run(many() ? int(q_.threads) : 1);
    }

    bool many() const { return q_.vehicles * q_.pieces >= 2000; }  // threads are started anew for every product

    // image = known + O way: pieces with even numbers share no knot, nor do those with odd ones.
    void multiply() {
        std::copy_n(known_.data(), groups_ * size_, image_.data());
        for (Integer parity = 0; parity < 2; ++parity) {
            auto task = [this, parity](Integer half) { multiply_piece(2 * half + parity); };
            Chunks<decltype(task)>((q_.pieces + 1 - parity) / 2, task).run(many() ? int(q_.threads) : 1);
        }
        for (Integer i = 0; i < groups_ * size_; ++i) image_[std::size_t(i)] *= mask_[std::size_t(i)];
    }

    void multiply_piece(Integer m) {
        const int low = m == 0 ? 4 : 0, high = m + 1 == q_.pieces ? 4 : 8;
        for (const NearRow &row : terms_.rows(m)) {
            const int first = int(m - 1) * knot_size;  // of the knot where the piece begins
            const double *one = lane(way_, row.one) + first * fleet_lanes, *two = lane(way_, row.two) + first * fleet_lanes;
            double left[3] = {}, right[3] = {};
            for (int e = low; e < high; ++e)
                for (int c = 0; c < 3; ++c) {
                    left[c] += row.basis[e] * one[(3 * e + c) * fleet_lanes];
                    right[c] += row.basis[e] * two[(3 * e + c) * fleet_lanes];
                }
            const double *w = row.way;
            const double from_one = -row.curvature * (w[0] * left[0] + w[1] * left[1] + w[2] * left[2]);
            const double from_two = -row.curvature * (w[0] * right[0] + w[1] * right[1] + w[2] * right[2]);
            double *to_one = lane(image_, row.one) + first * fleet_lanes, *to_two = lane(image_, row.two) + first * fleet_lanes;
            for (int e = low; e < high; ++e)
                for (int c = 0; c < 3; ++c) {
                    const double share = row.basis[e] * w[c];
                    to_one[(3 * e + c) * fleet_lanes] += share * from_two;
                    to_two[(3 * e + c) * fleet_lanes] += share * from_one;
                }
        }
    }

    void conjugate_gradients(int most) {
        const Integer entries = groups_ * size_;
        for (std::size_t i = 0; i < std::size_t(entries); ++i) {
            residual_[i] = -gradient_[i];
            step_[i] = Quad{};
        }
        precondition();
        std::copy_n(solved_.data(), entries, way_.data());
        std::copy_n(residual_.data(), entries, known_.data());
        double size = dot(residual_, solved_);
        const double end = 1e-4 * size;
        for (int taken = 0; taken < most && size > end && size > 1e-30; ++taken) {
            multiply();
            const double bend = dot(way_, image_);
            if (!(bend > 0.0)) break;
            const double share = size / bend;
            for (std::size_t i = 0; i < std::size_t(entries); ++i) {
                step_[i] += share * way_[i];
                residual_[i] -= share * image_[i];
            }
            precondition();
            const double next = dot(residual_, solved_), keep = next / size;
            size = next;
            for (std::size_t i = 0; i < std::size_t(entries); ++i) {
                way_[i] = solved_[i] + keep * way_[i];
                known_[i] = residual_[i] + keep * known_[i];
            }
        }
    }

    const JointQuestion q_;
    JointTerms terms_;
    const int size_;
    const Integer groups_;
    double damping_ = 1e-2;
    Buffer<Quad> factors_, mask_, gradient_, step_, residual_, solved_, way_, known_, image_;
    Buffer<double> trial_;
};

}  // namespace minsnap

// Minimum of a smooth function by L-BFGS: J. Nocedal, "Updating quasi-Newton matrices with limited storage", Mathematics
// of Computation 35, 1980; steps by backtracking with a parabola (J. Nocedal and S. Wright, "Numerical Optimization",
// 2nd ed., 2006, sections 3.5 and 7.2).
#pragma once

#include <cmath>
#include <cstddef>

#include "basics/buffer.hpp"
#include "basics/status.hpp"

namespace minsnap {

struct Stopping {
    double slope = 1e-7;    // largest entry of the gradient that counts as zero
    double gain = 1e-10;    // fall of the function that counts as none
    double farthest = 9.2;  // largest entry that the arguments may have
    double step = 1.0;      // largest entry of a change of the arguments: few of them may weigh far more than all others
    int evaluations = 2000;
};

class QuasiNewton {
public:
    [[nodiscard]] bool allocate(int size) {
        size_ = size;
        const std::size_t n = std::size_t(size);
        return x_.allocate(n) && trial_.allocate(n) && gradient_.allocate(n) && fresh_.allocate(n) && direction_.allocate(n) &&
               moves_.allocate(n * memory) && changes_.allocate(n * memory);
    }

    // Start at zero. evaluate(x, gradient, value) returns whether there is a value at x; there must be one at zero.
    template <class Function>
    Status minimise(const Stopping &stopping, Function &&evaluate) {
        for (int i = 0; i < size_; ++i) x_[i] = 0.0;
        evaluations_ = 1, kept_ = 0;
        double value;
        if (!evaluate(x_.data(), gradient_.data(), value)) return Status::infeasible;
        for (int idle = 0; idle < 2;) {
            if (largest(gradient_.data()) < stopping.slope) return Status::done;
            const double slope = find_direction();
            if (idle > 0 && -slope < stopping.gain) return Status::done;  // by its model a step falls by half of that
            double trial_value = value;
            if (!search(stopping, slope, value, trial_value, evaluate)) {
                if (kept_ == 0) return Status::done;  // not even along the gradient: rounding
                kept_ = 0;
                continue;
            }
            idle = value - trial_value < stopping.gain ? idle + 1 : 0;
            remember();
            value = trial_value;
            if (largest(x_.data()) > stopping.farthest) return Status::no_progress;
            if (evaluations_ >= stopping.evaluations) return Status::no_progress;
        }
        return Status::done;
    }

    const double *place() const { return x_.data(); }

private:
    static constexpr int memory = 12;

    double dot(const double *a, const double *b) const {
        double sum = 0.0;
        for (int i = 0; i < size_; ++i) sum += a[i] * b[i];
        return sum;
    }

    double largest(const double *a) const {
        double size = 0.0;
        for (int i = 0; i < size_; ++i) size = std::fabs(a[i]) > size ? std::fabs(a[i]) : size;
        return size;
    }

    double *move(int i) { return moves_.data() + std::size_t(i % memory) * size_; }
    double *change(int i) { return changes_.data() + std::size_t(i % memory) * size_; }

    // The two-loop recursion; the slope along the direction, negative.
    double find_direction() {
        double *p = direction_.data(), share[memory];
        for (int i = 0; i < size_; ++i) p[i] = -gradient_[i];
        const int first = kept_ > memory ? kept_ - memory : 0;
        for (int q = kept_ - 1; q >= first; --q) {
            const double a = share[q % memory] = dot(move(q), p) / products_[q % memory];
            for (int i = 0; i < size_; ++i) p[i] -= a * change(q)[i];
        }
        const double scale = first_scale();
        for (int i = 0; i < size_; ++i) p[i] *= scale;
        for (int q = first; q < kept_; ++q) {
            const double a = share[q % memory] - dot(change(q), p) / products_[q % memory];
            for (int i = 0; i < size_; ++i) p[i] += a * move(q)[i];
        }
        return dot(p, gradient_.data());
    }

    // Of the inverse Hessian; without a memory, a step of at most a half.
    double first_scale() {
        if (kept_ > 0) return products_[(kept_ - 1) % memory] / dot(change(kept_ - 1), change(kept_ - 1));
        const double length = std::sqrt(dot(gradient_.data(), gradient_.data()));
        return length > 0.5 ? 0.5 / length : 1.0;
    }

    template <class Function>
    bool search(const Stopping &stopping, double slope, double value, double &found, Function &evaluate) {
        if (!(slope < 0.0)) return false;
        const double farthest = largest(direction_.data());
        double length = farthest > stopping.step ? stopping.step / farthest : 1.0;
        for (int turn = 0; turn < 24 && evaluations_ < stopping.evaluations; ++turn) {
            for (int i = 0; i < size_; ++i) trial_[i] = x_[i] + length * direction_[i];
            ++evaluations_;
            if (!evaluate(trial_.data(), fresh_.data(), found)) {
                length *= 0.3;
                continue;
            }
            if (found <= value + 1e-4 * length * slope) return true;
            const double parabola = -slope * length / (2.0 * (found - value - slope * length));
            length *= parabola < 0.1 ? 0.1 : parabola > 0.5 ? 0.5 : parabola;
        }
        return false;
    }

    // Go to the trial; keep the pair of changes if the function curves upwards along it.
    void remember() {
        double *s = move(kept_), *y = change(kept_);
        for (int i = 0; i < size_; ++i) {
            s[i] = trial_[i] - x_[i];
            y[i] = fresh_[i] - gradient_[i];
            x_[i] = trial_[i];
            gradient_[i] = fresh_[i];
        }
        const double product = dot(s, y);
        if (!(product > 1e-12 * dot(s, s))) return;
        products_[kept_ % memory] = product;
        ++kept_;
    }

    int size_ = 0, kept_ = 0, evaluations_ = 0;
    double products_[memory] = {};
    Buffer<double> x_, trial_, gradient_, fresh_, direction_, moves_, changes_;
};

}  // namespace minsnap

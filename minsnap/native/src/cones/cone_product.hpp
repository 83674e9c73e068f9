// The product of the cones of a programme: scalings, and what an interior-point method does with every cone.
//
// Four cones of the same size that stand side by side are taken at once, one in each lane; the last four of such a run
// may overlap those before.
#pragma once

#include <algorithm>
#include <cstddef>
#include <type_traits>

#include "basics/buffer.hpp"
#include "cones/cone_scaling.hpp"
#include "arithmetic/lanes.hpp"
#include "arithmetic/wide.hpp"

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"  // g++ 12 sets a Quad lane by lane, and misses those not set yet
#endif

namespace minsnap {

class ConeProduct {
public:
    // Take cones of the sizes `size_of(k)`. False if there is no memory.
    template <class Sizes>
    [[nodiscard]] bool set(std::size_t cones, std::size_t rows, Sizes size_of) {
        bool made = true;
        for (Buffer<double> *v : {&w_, &lambda_, &one_, &two_, &three_}) made = made && v->allocate(rows + 1);
        if (!made || !scalings_.allocate(cones + 1) || !parts_.allocate(cones + 1)) return false;
        cones_ = cones;
        rows_ = rows;
        count_ = 0;
        for (std::size_t k = 0, row = 0; k < cones;) {
            const std::size_t size = size_of(k);
            std::size_t end = k;
            for (; end < cones && size_of(end) == size; ++end) {
                scalings_[end].w = w_.data() + row + (end - k) * size;
                scalings_[end].lambda = lambda_.data() + row + (end - k) * size;
            }
            list(k, end, row, size);
            row += (end - k) * size;
            k = end;
        }
        return true;
    }

    const ConeScaling *scalings() const { return scalings_.data(); }

    // W = 1
    void unscale() {
        std::fill(w_.data(), w_.data() + rows_, 0.0);
        for (std::size_t k = 0; k < cones_; ++k) scalings_[k].eta = scalings_[k].w[0] = 1.0;
    }

    // By how much first components must grow for a point to lie in all cones; negative inside.
    double depth(const double *u) const {
        double most = -1.0;
        each_single([&](const Part &part, auto count) { most = std::max(most, cone_depth(u + part.row, count)); });
        return most;
    }

    // Add to the first components.
    void raise(double *u, double by) const {
        each_single([&](const Part &part, auto) { u[part.row] += by; });
    }

    // Leave `room` in every cone, and set z = room s^-1.
    void center(double *s, double *z, double room) const {
        each_single([&](const Part &part, auto count) {
            double *u = s + part.row, *v = z + part.row;
            u[0] += std::max(0.0, room + cone_depth(u, count));
            const double share = room / (count == 1 ? u[0] * u[0] : cone_determinant(u, count));
            v[0] = share * u[0];
            for (std::size_t i = 1; i < count; ++i) v[i] = -share * u[i];
        });
    }

    // Find the scalings of a pair; false where it is not inside.
    [[nodiscard]] bool scale(const double *s, const double *z) {
        bool inside = true;
        widely([&]() MINSNAP_INLINED {
            each([&](const Part &part, auto count)
                     MINSNAP_INLINED { inside = scalings_[part.cone].set(s + part.row, z + part.row, count) && inside; },
                 [&](const Part &part, auto count) MINSNAP_INLINED {
                     Quad u[count], v[count], w[count], lambda[count];
                     load(s + part.row, u, count), load(z + part.row, v, count);
                     Scaling<Quad> found{Quad{}, w, lambda};
                     inside = found.set(u, v, count) && inside;
                     store(w, w_.data() + part.row, count), store(lambda, lambda_.data() + part.row, count);
                     for (int lane = 0; lane < lanes; ++lane) scalings_[part.cone + lane].eta = found.eta[lane];
                 });
        });
        return inside;
    }

    // out = W^2 u
    void square(const double *u, double *out) const {
        apply(u, out, [](const auto &scaling, const auto *x, auto *y, auto count) MINSNAP_INLINED { scaling.square(x, y, count); });
    }

    // out = W^-2 u
    void divide_square(const double *u, double *out) const {
        apply(u, out, [](const auto &scaling, const auto *x, auto *y, auto count) MINSNAP_INLINED { scaling.divide_square(x, y, count); });
    }

    // aim = W (lambda \ (center e - lambda o lambda - (W^-1 ds) o (W dz)))
    void correct(double center, const double *ds, const double *dz, double *aim) {
        widely([&]() MINSNAP_INLINED {
            each(
                [&](const Part &part, auto count) MINSNAP_INLINED {
                    double *a = one_.data() + part.row, *b = two_.data() + part.row, *c = three_.data() + part.row;
                    scalings_[part.cone].correct(center, ds + part.row, dz + part.row, aim + part.row, a, b, c, count);
                },
                [&](const Part &part, auto count) MINSNAP_INLINED {
                    Quad w[count], lambda[count], s[count], z[count], found[count], a[count], b[count], c[count];
                    load(lambda_.data() + part.row, lambda, count);
                    load(ds + part.row, s, count), load(dz + part.row, z, count);
                    at(part, w, lambda, count).correct(center, s, z, found, a, b, c, count);
                    store(found, aim + part.row, count);
                });
        });
    }

    // Largest step in [0, most] for which u + step d stays in all cones, u inside.
    double longest(const double *u, const double *d, double most = 1.0) const {
        widely([&]() MINSNAP_INLINED {
            each([&](const Part &part, auto count) MINSNAP_INLINED { most = cone_step(u + part.row, d + part.row, count, most); },
                 [&](const Part &part, auto count) MINSNAP_INLINED {
                     Quad x[count], y[count];
                     load(u + part.row, x, count), load(d + part.row, y, count);
                     if (all(cone_holds(x, y, count, most))) return;
                     for (std::size_t k = part.row; k < part.row + lanes * count; k += count) most = cone_step(u + k, d + k, count, most);
                 });
        });
        return most;
    }

private:
    static constexpr int lanes = 4;

    // One cone, or four of a size.
    struct Part {
        std::size_t cone, row, size;
        bool four;
    };

    void list(std::size_t first, std::size_t end, std::size_t row, std::size_t size) {
        const bool known = size == 1 || size == 3 || size == 4;
        for (std::size_t k = first; k < end;) {
            const bool four = known && end - first >= lanes;
            const std::size_t cone = four ? std::min(k, end - lanes) : k;
            parts_[count_++] = Part{cone, row + (cone - first) * size, size, four};
            k = cone + (four ? lanes : 1);
        }
    }

    template <class Single, class Four>
    MINSNAP_INLINE void each(Single &&single, Four &&four) const {
        for (std::size_t i = 0; i < count_; ++i) {
            const Part &part = parts_[i];
            const auto one_or_four = [&](auto size) MINSNAP_INLINED { part.four ? four(part, size) : single(part, size); };
            switch (part.size) {
                case 1: one_or_four(std::integral_constant<std::size_t, 1>{}); break;
                case 3: one_or_four(std::integral_constant<std::size_t, 3>{}); break;
                case 4: one_or_four(std::integral_constant<std::size_t, 4>{}); break;
                default: single(part, part.size); break;
            }
        }
    }

    template <class Single>
    void each_single(Single &&single) const {
        std::size_t next = 0;
        for (std::size_t i = 0; i < count_; ++i) {
            Part part = parts_[i];
            const std::size_t end = part.cone + (part.four ? lanes : 1);
            for (part.row += (next - part.cone) * part.size, part.cone = next; part.cone < end; ++part.cone, part.row += part.size) {
                single(part, part.size);
            }
            next = end;
        }
    }

    template <class Action>
    void apply(const double *u, double *out, Action action) const {
        widely([&]() MINSNAP_INLINED {
            each([&](const Part &part, auto count) MINSNAP_INLINED { action(scalings_[part.cone], u + part.row, out + part.row, count); },
                 [&](const Part &part, auto count) MINSNAP_INLINED {
                     Quad w[count], x[count], y[count];
                     load(u + part.row, x, count);
                     action(at(part, w, nullptr, count), x, y, count);
                     store(y, out + part.row, count);
                 });
        });
    }

    // The scaling of four cones.
    template <class Count>
    MINSNAP_INLINE Scaling<Quad> at(const Part &part, Quad *w, Quad *lambda, Count count) const {
        load(w_.data() + part.row, w, count);
        Scaling<Quad> found{Quad{}, w, lambda};
        for (int lane = 0; lane < lanes; ++lane) found.eta[lane] = scalings_[part.cone + lane].eta;
        return found;
    }

    template <class Count>
    MINSNAP_INLINE static void load(const double *u, Quad *x, Count count) {
        for (std::size_t i = 0; i < count; ++i) x[i] = Quad{u[i], u[count + i], u[2 * count + i], u[3 * count + i]};
    }

    template <class Count>
    MINSNAP_INLINE static void store(const Quad *x, double *u, Count count) {
        for (std::size_t i = 0; i < count; ++i) {
            for (int lane = 0; lane < lanes; ++lane) u[lane * count + i] = x[i][lane];
        }
    }

    std::size_t cones_ = 0, rows_ = 0, count_ = 0;
    Buffer<ConeScaling> scalings_;
    Buffer<Part> parts_;
    Buffer<double> w_, lambda_, one_, two_, three_;
};

}  // namespace minsnap

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif

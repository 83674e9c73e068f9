// Value, gradient and Gauss-Newton blocks of what the joint search minimises, one piece of all vehicles at a time.
//
//     sum over vehicles of smoothness/2 int |x''''(u)|^2 du + sum over rows of penalty(r + lambda/rho)
//
// Rows: limits and room at uniform samples, relative; pairs and obstacles at the nearest instant of the chord in each part between samples. Multipliers turn
// the penalty into an augmented Lagrangian (J. Nocedal and S. Wright, "Numerical Optimization", 2nd ed., section 17.4). Distances are convex, so the penalty
// of a row's plane bounds the true one, and the Gauss-Newton model is safe.
#pragma once

#include <algorithm>

#include "basics/owned.hpp"
#include "basics/status.hpp"
#include "basics/threads.hpp"
#include "fleet/joint_question.hpp"
#include "fleet/joint_rows.hpp"
#include "fleet/soft_penalty.hpp"

namespace minsnap {

constexpr int block_size = end_pairs * 6;  // symmetric 3 x 3 of each pair of ends: xx, yy, zz, xy, xz, yz
constexpr int slots = limit_kinds;         // multipliers of one order at one sample; the room's are those of order 0
constexpr double infinite = __builtin_huge_val();

struct HeldMultiplier {
    std::uint64_t name;
    double value;
};

// What one piece adds.
struct PieceWork {
    Growing<NearRow> rows;
    Growing<HeldMultiplier> held;
    double value, short_by, over_by;
    bool failed;
};

struct PairNear {
    double share;     // where between two samples the chord comes nearest
    double distance;  // then
};

inline PairNear chord_nearest(const double *from, const double *to) {
    double along = 0.0, square = 0.0, sum = 0.0;
    for (int c = 0; c < 3; ++c) {
        const double move = to[c] - from[c];
        along += from[c] * move;
        square += move * move;
    }
    const double share = square > 1e-18 ? std::fmin(1.0, std::fmax(0.0, -along / square)) : 0.0;
    for (int c = 0; c < 3; ++c) {
        const double value = from[c] + share * (to[c] - from[c]);
        sum += value * value;
    }
    return {share, std::sqrt(sum)};
}

class JointTerms {
public:
    JointTerms(const JointQuestion &question) : q(question) {}

    [[nodiscard]] bool allocate() {
        const std::size_t n = std::size_t(q.vehicles), m = std::size_t(q.pieces), k = std::size_t(q.samples);
        work_ = owned_array<PieceWork>(m);
        const bool all = work_ != nullptr && blocks_.allocate(m * n * block_size) && slopes_.allocate(m * n * 24) &&
                         places_.allocate(m * (k + 1) * n * 3) && order_.allocate(m * n) &&
                         held_.allocate(n * (m * k + 1) * septic_orders * slots) && basis_.allocate(m * septic_orders * (k + 1) * ends) &&
                         products_.allocate(m * septic_orders * (k + 1) * end_pairs) && scales_.allocate(m * ends) &&
                         grams_.allocate(m * 2 * end_pairs);
        if (!all) return false;
        tabulate();
        forget();
        return true;
    }

    // Drop all multipliers.
    void forget() {
        const std::size_t count = std::size_t(q.vehicles * (q.pieces * q.samples + 1)) * septic_orders * slots;
        for (std::size_t i = 0; i < count; ++i) held_[i] = 0.0;
        near_.clear();
    }

    // Value of the curves; with `full` also blocks, slopes and rows; with `update` the multipliers become what the penalties push with.
    [[nodiscard]] bool evaluate(const JointRun &run, const double *curves, bool full, bool update) {
        auto task = [this, &run, curves, full, update](Integer piece) {
            evaluate_piece({run, SoftPenalty(run.rho, run.tau), curves, piece, full, update});
        };
        Chunks<decltype(task)>(q.pieces, task).run(int(q.threads));
        value = 0.0;
        short_by = over_by = -infinite;
        std::size_t count = 0;
        for (Integer m = 0; m < q.pieces; ++m) {
            if (work_[m].failed) return false;
            value += work_[m].value;
            short_by = std::fmax(short_by, work_[m].short_by);
            over_by = std::fmax(over_by, work_[m].over_by);
            count += work_[m].held.size();
        }
        if (!update) return true;
        if (!near_.restart(count)) return false;
        for (Integer m = 0; m < q.pieces; ++m)
            for (const HeldMultiplier &held : work_[m].held) near_.add(held.name, held.value);
        return true;
    }

    const double *block(Integer piece, Integer vehicle) const { return blocks_.data() + (piece * q.vehicles + vehicle) * block_size; }
    const double *slope(Integer piece, Integer vehicle) const { return slopes_.data() + (piece * q.vehicles + vehicle) * 24; }
    const Growing<NearRow> &rows(Integer piece) const { return work_[piece].rows; }
    const double *position_gram(Integer piece) const { return grams_.data() + (2 * piece + 1) * end_pairs; }

    double value = 0.0, short_by = 0.0, over_by = 0.0;

private:
    // A sum of slopes and curvatures that one sample, or one row, has in three axes.
    struct Push {
        double slope[3] = {}, curve[6] = {};
        bool any = false, mixed = false;

        void plane(const double *way, const Penalty &p, double sign) {  // residual along way
            for (int c = 0; c < 3; ++c) {
                slope[c] += sign * p.slope * way[c];
                curve[c] += p.curvature * way[c] * way[c];
            }
            curve[3] += p.curvature * way[0] * way[1];
            curve[4] += p.curvature * way[0] * way[2];
            curve[5] += p.curvature * way[1] * way[2];
            any = mixed = true;
        }
    };

    double *block_at(Integer m, Integer v) { return blocks_.data() + (m * q.vehicles + v) * block_size; }
    double *slope_at(Integer m, Integer v) { return slopes_.data() + (m * q.vehicles + v) * 24; }
    double *place(Integer m, Integer k, Integer v) { return places_.data() + ((m * (q.samples + 1) + k) * q.vehicles + v) * 3; }
    double *held(Integer v, Integer sample, int order) {
        return held_.data() + ((v * (q.pieces * q.samples + 1) + sample) * septic_orders + order) * slots;
    }
    const double *basis(Integer m, int order, Integer k) const {
        return basis_.data() + ((m * septic_orders + order) * (q.samples + 1) + k) * ends;
    }
    const double *products(Integer m, int order, Integer k) const {
        return products_.data() + ((m * septic_orders + order) * (q.samples + 1) + k) * end_pairs;
    }
    const double *snap_gram(Integer m) const { return grams_.data() + 2 * m * end_pairs; }
    const double *data(const double *curves, Integer v, Integer m) const { return curves + (v * (q.pieces + 1) + m) * knot_size; }
    double asked(Integer one, Integer two) const { return q.radii[one] + q.radii[two]; }

    // Knots keep derivatives in units of the mean duration h; those of a piece r h long are r^q times as large in its own units.
    void place_basis(Integer m, double u, double *row) const {
        septic_basis(u, 0, row);
        for (int e = 0; e < ends; ++e) row[e] *= scales_[std::size_t(m * ends + e)];
    }

    void tabulate() {
        double gram[end_pairs];
        septic_gram(4, gram);
        for (Integer m = 0; m < q.pieces; ++m) {
            const double r = q.shares[m] * double(q.pieces), square = r * r, weight = 1.0 / (square * square * square * r);
            double *scale = scales_.data() + m * ends, *snap = grams_.data() + 2 * m * end_pairs, *position = snap + end_pairs;
            for (int e = 0; e < ends; ++e) scale[e] = e % 4 == 0 ? 1.0 : e % 4 == 1 ? r : e % 4 == 2 ? square : square * r;
            for (int e = 0; e < ends; ++e)
                for (int g = 0; g <= e; ++g) snap[end_pair(e, g)] = weight * scale[e] * scale[g] * gram[end_pair(e, g)];
            for (int order = 0; order < septic_orders; ++order)
                for (Integer k = 0; k <= q.samples; ++k) tabulate_sample(m, order, k, scale);
            for (int i = 0; i < end_pairs; ++i) {
                position[i] = 0.0;
                for (Integer k = 0; k < q.samples; ++k) position[i] += products(m, 0, k)[i];
            }
        }
        for (Integer v = 0; v < q.vehicles; ++v) largest_ = std::fmax(largest_, q.radii[v]);
    }

    void tabulate_sample(Integer m, int order, Integer k, const double *scale) {
        const Integer at = (m * septic_orders + order) * (q.samples + 1) + k;
        double *b = basis_.data() + at * ends, *p = products_.data() + at * end_pairs;
        septic_basis(double(k) / double(q.samples), order, b);
        for (int e = 0; e < ends; ++e) b[e] *= scale[e];
        for (int e = 0; e < ends; ++e)
            for (int g = 0; g <= e; ++g) p[end_pair(e, g)] = b[e] * b[g];
    }

    // One evaluation of one piece.
    struct Pass {
        const JointRun &run;
        const SoftPenalty penalty;
        const double *curves;
        Integer m;
        bool full, update;
    };

    void evaluate_piece(const Pass &pass) {
        const Integer m = pass.m;
        PieceWork &work = work_[m];
        work.rows.clear();
        work.held.clear();
        work.value = 0.0;
        work.short_by = work.over_by = -infinite;
        work.failed = false;
        for (Integer v = 0; v < q.vehicles; ++v) {
            if (pass.full) {
                std::fill_n(block_at(m, v), block_size, 0.0);
                std::fill_n(slope_at(m, v), 24, 0.0);
            }
            smooth(pass, data(pass.curves, v, m), v);
            const Integer last = m + 1 == q.pieces ? q.samples : q.samples - 1;
            for (Integer k = 0; k <= q.samples; ++k) {
                const double *at = data(pass.curves, v, m);
                double *p = place(m, k, v);
                at_sample(at, basis(m, 0, k), p);
                if (k <= last) sample_terms(pass, at, k, v);
                p[2] /= q.downwash;
            }
        }
        for (Integer k = 0; k < q.samples; ++k) {
            pairs(pass, k);
            if (q.obstacles > 0) obstacles(pass, k);
        }
    }

    static void at_sample(const double *at, const double *b, double *p) {
        for (int c = 0; c < 3; ++c) {
            double sum = 0.0;
            for (int e = 0; e < ends; ++e) sum += b[e] * at[3 * e + c];
            p[c] = sum;
        }
    }

    void smooth(const Pass &pass, const double *at, Integer v) {
        const Integer m = pass.m;
        double *block = block_at(m, v), *slope = slope_at(m, v), sum = 0.0;
        for (int e = 0; e < ends; ++e) {
            double pull[3] = {};
            for (int g = 0; g < ends; ++g) {
                const double weight = snap_gram(m)[e >= g ? end_pair(e, g) : end_pair(g, e)];
                for (int c = 0; c < 3; ++c) pull[c] += weight * at[3 * g + c];
            }
            for (int c = 0; c < 3; ++c) {
                sum += 0.5 * pull[c] * at[3 * e + c];
                if (pass.full) slope[3 * e + c] += pass.run.smoothness * pull[c];
            }
        }
        work_[m].value += pass.run.smoothness * sum;
        if (!pass.full) return;
        for (int i = 0; i < end_pairs; ++i)
            for (int c = 0; c < 3; ++c) block[6 * i + c] += pass.run.smoothness * snap_gram(m)[i];
    }

    void sample_terms(const Pass &pass, const double *at, Integer k, Integer v) {
        const Integer m = pass.m;
        const Integer sample = m * q.samples + k;
        Push push;
        const double *room = q.room + (v * q.pieces + m) * 6, *p = place(m, k, v);
        for (int c = 0; c < 3; ++c) {
            if (room[c] == -infinite && room[3 + c] == infinite) continue;
            two_sided(pass, (p[c] - room[3 + c]) / q.length, (room[c] - p[c]) / q.length, 1.0 / q.length, c, held(v, sample, 0)[c], push);
        }
        if (pass.full && push.any) spread(push, basis(m, 0, k), products(m, 0, k), block_at(m, v), slope_at(m, v));
        const double h = pass.run.time * q.shares[m];
        double unit_length = 1.0;
        for (int order = 1; order <= limit_orders; ++order) {
            unit_length *= h;
            const double *limit = q.limits + (v * limit_orders + order - 1) * limit_kinds;
            if (limit[0] == infinite && limit[1] == infinite && limit[2] == infinite && limit[3] == infinite && limit[4] == infinite)
                continue;
            limit_terms(pass, at, order, unit_length, limit, k, v);
        }
    }

    void limit_terms(const Pass &pass, const double *at, int order, double length, const double *limit, Integer k, Integer v) {
        const Integer m = pass.m;
        double x[3];
        at_sample(at, basis(m, order, k), x);
        Push push;
        double *lambda = held(v, m * q.samples + k, order);
        for (int c = 0; c < 3; ++c) {
            if (limit[c] == infinite) continue;
            const double size = 1.0 / (limit[c] * length), u = x[c] * size;
            two_sided(pass, u - 1.0, -u - 1.0, size, c, lambda[c], push);
        }
        for (int kind = 3; kind < limit_kinds; ++kind)
            if (limit[kind] < infinite) norm_term(pass, x, kind == 3 ? 3 : 2, limit[kind] * length, lambda[kind], push);
        if (pass.full && push.any) spread(push, basis(m, order, k), products(m, order, k), block_at(m, v), slope_at(m, v));
    }

    // Two planes; lambda > 0 belongs to the upper one, < 0 to the lower.
    void two_sided(const Pass &pass, double up, double down, double size, int axis, double &lambda, Push &push) {
        PieceWork &work = work_[pass.m];
        work.over_by = std::fmax(work.over_by, std::fmax(up, down));
        const double a = up + (lambda > 0.0 ? lambda : 0.0) / pass.run.rho, b = down + (lambda < 0.0 ? -lambda : 0.0) / pass.run.rho;
        if (a < -pass.penalty.dead() && b < -pass.penalty.dead()) {
            if (pass.update) lambda = 0.0;
            return;
        }
        const Penalty one = pass.penalty(a), two = pass.penalty(b);
        work.value += one.value + two.value;
        push.slope[axis] += (one.slope - two.slope) * size;
        push.curve[axis] += (one.curvature + two.curvature) * size * size;
        push.any = true;
        if (pass.update) lambda = one.slope > two.slope ? one.slope : -two.slope;
    }

    void norm_term(const Pass &pass, const double *x, int axes, double limit, double &lambda, Push &push) {
        double square = 0.0;
        for (int c = 0; c < axes; ++c) square += x[c] * x[c];
        const double norm = std::sqrt(square), u = norm / limit;
        PieceWork &work = work_[pass.m];
        work.over_by = std::fmax(work.over_by, u - 1.0);
        const Penalty p = pass.penalty(u - 1.0 + lambda / pass.run.rho);
        work.value += p.value;
        if (pass.update) lambda = p.slope;
        if (!(p.curvature > 0.0) || !(norm > 0.0)) return;
        double way[3] = {};
        for (int c = 0; c < axes; ++c) way[c] = x[c] / (norm * limit);
        const double round = p.slope / (limit * norm);
        push.plane(way, {0.0, p.slope, p.curvature - round * limit * limit}, 1.0);
        for (int c = 0; c < axes; ++c) push.curve[c] += round;
    }

    static void spread(const Push &push, const double *b, const double *products, double *block, double *slope) {
        for (int e = 0; e < ends; ++e)
            for (int c = 0; c < 3; ++c) slope[3 * e + c] += b[e] * push.slope[c];
        const int kinds = push.mixed ? 6 : 3;
        for (int i = 0; i < end_pairs; ++i)
            for (int c = 0; c < kinds; ++c) block[6 * i + c] += products[i] * push.curve[c];
    }

    void pairs(const Pass &pass, Integer k) {
        const Integer m = pass.m;
        std::int32_t *order = order_.data() + m * q.vehicles;
        const double *now = place(m, k, 0), *next = place(m, k + 1, 0);
        const Integer count = q.vehicles;
        if (k == 0) {
            for (Integer v = 0; v < count; ++v) order[v] = std::int32_t(v);
            std::sort(order, order + count,
                      [now](std::int32_t a, std::int32_t b) { return now[3 * a] != now[3 * b] ? now[3 * a] < now[3 * b] : a < b; });
        }
        double step = 0.0;
        for (Integer a = 0; a < count; ++a) {  // nearly in order already
            const std::int32_t v = order[a];
            Integer b = a - 1;
            for (; b >= 0 && now[3 * order[b]] > now[3 * v]; --b) order[b + 1] = order[b];
            order[b + 1] = v;
            double square = 0.0;
            for (int c = 0; c < 3; ++c) square += (next[3 * a + c] - now[3 * a + c]) * (next[3 * a + c] - now[3 * a + c]);
            step = std::fmax(step, square);
        }
        step = 2.0 * std::sqrt(step);
        const double wide = pass.run.inflation + 0.05 + pass.penalty.dead();
        for (Integer a = 0; a < count; ++a) {
            const std::int32_t i = order[a];
            const double farthest = wide * (q.radii[i] + largest_) + step, *from = now + 3 * i;
            for (Integer b = a + 1; b < count; ++b) {
                const std::int32_t j = order[b];
                const double *to = now + 3 * j, x = to[0] - from[0], y = to[1] - from[1], z = to[2] - from[2];
                if (x > farthest) break;
                if (x * x + y * y + z * z <= farthest * farthest) pair_row(pass, k, std::min(i, j), std::max(i, j));
            }
        }
    }

    void pair_row(const Pass &pass, Integer k, std::int32_t i, std::int32_t j) {
        const Integer m = pass.m;
        const double *a = place(m, k, i), *b = place(m, k, j), *c = place(m, k + 1, i), *d = place(m, k + 1, j);
        const double from[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]}, to[3] = {c[0] - d[0], c[1] - d[1], c[2] - d[2]};
        const PairNear near = chord_nearest(from, to);
        const double apart = asked(i, j);
        if (near.distance > apart * (pass.run.inflation + 0.03 + pass.penalty.dead())) return;
        NearRow row;
        place_basis(m, (double(k) + near.share) / double(q.samples), row.basis);
        double one[3], two[3], way[3], square = 0.0;
        at_sample(data(pass.curves, i, m), row.basis, one);
        at_sample(data(pass.curves, j, m), row.basis, two);
        for (int e = 0; e < 3; ++e) {
            way[e] = (one[e] - two[e]) / (e == 2 ? q.downwash : 1.0);
            square += way[e] * way[e];
        }
        double norm = std::sqrt(square);
        row.one = i;
        row.two = j;
        row.name = (std::uint64_t(i) * std::uint64_t(q.vehicles) + std::uint64_t(j)) * std::uint64_t(q.pieces * q.samples) +
                   std::uint64_t(m * q.samples + k);
        const double residual = pass.run.inflation - norm / apart;
        if (norm < 1e-9) {  // no way to go: one that the pair alone decides
            const double turn = double((row.name * 0x9e3779b97f4a7c15ULL) >> 40) / 16777216.0 - 0.5;
            way[0] = turn;
            way[1] = 0.5 - std::fabs(turn);
            way[2] = 0.3;
            norm = std::sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
        }
        for (int e = 0; e < 3; ++e) row.way[e] = way[e] / (norm * apart * (e == 2 ? q.downwash : 1.0));
        add_row(pass, row, residual);
    }

    void add_row(const Pass &pass, NearRow &row, double residual) {
        const Integer m = pass.m;
        PieceWork &work = work_[m];
        work.short_by = std::fmax(work.short_by, residual);
        const Penalty p = pass.penalty(residual + near_(row.name) / pass.run.rho);
        work.value += p.value;
        if (!(p.curvature > 0.0)) return;
        if (pass.update && p.slope > 1e-12 && !work.held.add({row.name, p.slope})) work.failed = true;
        if (!pass.full) return;
        row.slope = p.slope;
        row.curvature = p.curvature;
        double products[end_pairs];
        for (int e = 0; e < ends; ++e)
            for (int g = 0; g <= e; ++g) products[end_pair(e, g)] = row.basis[e] * row.basis[g];
        Push push;
        push.plane(row.way, p, -1.0);
        spread(push, row.basis, products, block_at(m, row.one), slope_at(m, row.one));
        if (row.two < 0) return;
        for (double &slope : push.slope) slope = -slope;
        spread(push, row.basis, products, block_at(m, row.two), slope_at(m, row.two));
        if (!work.rows.add(row)) work.failed = true;
    }

    void obstacles(const Pass &pass, Integer k) {
        const Integer m = pass.m;
        const std::uint64_t first = std::uint64_t(q.vehicles) * std::uint64_t(q.vehicles), parts = std::uint64_t(q.pieces * q.samples);
        for (Integer v = 0; v < q.vehicles; ++v)
            for (Integer o = 0; o < q.obstacles; ++o) {
                const Obstacle &obstacle = q.obstacle[o];
                const double *a = place(m, k, v), *b = place(m, k + 1, v);
                double from[3], to[3], step = 0.0;
                for (int c = 0; c < 3; ++c) {
                    const double size = c == 2 ? q.downwash : 1.0;
                    from[c] = a[c] * size - obstacle.center[c];
                    to[c] = b[c] * size - obstacle.center[c];
                    step += (to[c] - from[c]) * (to[c] - from[c]);
                }
                double way[3] = {};
                const double reach = q.length * (pass.penalty.dead() + 0.05) + std::sqrt(step);
                if (depth(obstacle, from, way) > reach) continue;
                NearRow row;
                row.one = std::int32_t(v);
                row.two = -1;
                row.name = (first + std::uint64_t(v * q.obstacles + o)) * parts + std::uint64_t(m * q.samples + k);
                place_basis(m, (double(k) + nearest_share(obstacle, from, to)) / double(q.samples), row.basis);
                at_sample(data(pass.curves, v, m), row.basis, from);
                for (int c = 0; c < 3; ++c) from[c] -= obstacle.center[c];
                const double away = depth(obstacle, from, way);
                for (int c = 0; c < 3; ++c) row.way[c] = way[c] / q.length;
                add_row(pass, row, (pass.run.inflation - 1.0) - away / q.length);
            }
    }

    // Depth is convex, so a chord is nearest to an obstacle with faces where a search by thirds ends.
    static double nearest_share(const Obstacle &obstacle, const double *from, const double *to) {
        bool faces = false;
        for (int c = 0; c < 3; ++c) faces = faces || obstacle.low[c] > -infinite || obstacle.high[c] < infinite;
        if (faces) {
            double low = 0.0, high = 1.0;
            for (int step = 0; step < 16; ++step) {
                const double third = (high - low) / 3.0;
                if (depth_between(obstacle, from, to, low + third) < depth_between(obstacle, from, to, high - third))
                    high -= third;
                else
                    low += third;
            }
            return 0.5 * (low + high);
        }
        double one[3], two[3];
        for (int c = 0; c < 3; ++c) {
            one[c] = from[c] * obstacle.scale[c];
            two[c] = to[c] * obstacle.scale[c];
        }
        return chord_nearest(one, two).share;
    }

    static double depth_between(const Obstacle &obstacle, const double *from, const double *to, double share) {
        double at[3], way[3];
        for (int c = 0; c < 3; ++c) at[c] = from[c] + share * (to[c] - from[c]);
        return depth(obstacle, at, way);
    }

    // How far outside a place (relative to the center) is by the set that it is farthest from, and the way out.
    static double depth(const Obstacle &obstacle, const double *at, double *way) {
        double best = -infinite;
        if (obstacle.radius >= 0.0) {
            double square = 0.0;
            for (int c = 0; c < 3; ++c) {
                way[c] = obstacle.scale[c] * at[c];
                square += way[c] * way[c];
            }
            const double norm = std::sqrt(square);
            best = norm - obstacle.radius;
            for (int c = 0; c < 3; ++c) way[c] = norm > 1e-9 ? obstacle.scale[c] * way[c] / norm : c == 0 ? 1.0 : 0.0;
        }
        for (int c = 0; c < 3; ++c)
            for (int side = 0; side < 2; ++side) {
                const double x = at[c] + obstacle.center[c], away = side == 0 ? obstacle.low[c] - x : x - obstacle.high[c];
                if (!(away > best)) continue;
                best = away;
                for (int e = 0; e < 3; ++e) way[e] = e != c ? 0.0 : side == 0 ? -1.0 : 1.0;
            }
        return best;
    }

    const JointQuestion &q;
    std::unique_ptr<PieceWork[]> work_;
    Buffer<double> blocks_, slopes_, places_, held_, basis_, products_, scales_, grams_;
    Buffer<std::int32_t> order_;
    Multipliers near_;
    double largest_ = 0.0;
};

}  // namespace minsnap

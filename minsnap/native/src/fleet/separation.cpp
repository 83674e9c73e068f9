// Least distances of the pairs of a fleet over all time, proved.
//
// Cells of time are the pieces of the vehicle that has most. In a cell: a tree of boxes, then chords with how far the curves are from them, then
// the control points of the difference along its mean, then the squared distance, a polynomial whose least value `Climb` proves.
// Chunks are blocks of one cell's order, so what is found does not depend on the number of threads.
#include <new>

#include "basics/export.hpp"
#include "basics/owned.hpp"
#include "basics/status.hpp"
#include "basics/threads.hpp"
#include "fleet/box_tree.hpp"
#include "basics/growing.hpp"
#include "fleet/questions.hpp"
#include "polynomials/extrema.hpp"

namespace minsnap {
namespace {

constexpr Integer block = 256;  // vehicles of one chunk

// A pair that comes near in a cell.
struct Near {
    Integer one, two;
    double least, attained, instant;  // never nearer, so near at least, and when; heights divided by the downwash
};

class PairSearch {
public:
    PairSearch(const SeparationQuestion &question) : q_(question), usual_(14), other_(2 * max_fleet_degree) {}

    // Whether a pair comes nearer than `reach` [m] in a cell, and then how near.
    bool nearest(Integer one, Integer two, double a, double b, double reach, Near &near) {
        const FleetCurves &fleet = q_.fleet;
        const double *t = clock_of(fleet, one), *u = clock_of(fleet, two);
        Integer i = piece_at(t, fleet.pieces[one], a), j = piece_at(u, fleet.pieces[two], a);
        Greatest best{-reach * reach, -__builtin_huge_val(), 0.0, -1};
        double instant = 0.0;
        Integer row = 0;
        for (double from = a; from < b; ++row) {
            const double to = std::fmin(b, std::fmin(t[i + 1], u[j + 1]));
            if (apart_between(one, i, two, j, from, to, reach)) climb(best, row);
            if (best.row == row) instant = from + best.s * (to - from);
            from = to;
            if (t[i + 1] <= from && i + 1 < fleet.pieces[one]) ++i;
            if (u[j + 1] <= from && j + 1 < fleet.pieces[two]) ++j;
        }
        if (best.row < 0) return false;
        near = {one, two, root(-best.bound, 1.0 - 4.0 * unit), root(-best.attained, 1.0 + 4.0 * unit), instant};
        return true;
    }

private:
    static double root(double square, double rounding) { return square > 0.0 ? std::sqrt(square) * rounding : 0.0; }

    // Put the difference of two pieces into arc_; false if its control points show that it stays beyond `reach`.
    bool apart_between(Integer one, Integer i, Integer two, Integer j, double from, double to, double reach) {
        part_of(q_.fleet, one, i, from, to, arc_);
        part_of(q_.fleet, two, j, from, to, other_arc_);
        const int n = std::max(arc_.degree, other_arc_.degree);
        elevate(arc_, n);
        elevate(other_arc_, n);
        double mean[fleet_axes] = {}, length = 0.0;
        for (int d = 0; d < fleet_axes; ++d) {
            const double divisor = d == 2 ? q_.downwash : 1.0;
            for (int k = 0; k <= n; ++k) {
                const double difference = arc_.value[d][k] - other_arc_.value[d][k];
                arc_.error[d][k] = (arc_.error[d][k] + other_arc_.error[d][k] + unit * std::fabs(difference)) / divisor;
                arc_.value[d][k] = difference / divisor;
                if (d == 2) arc_.error[d][k] += unit * std::fabs(arc_.value[d][k]);
                mean[d] += arc_.value[d][k];
            }
            length += mean[d] * mean[d];
        }
        length = std::sqrt(length);
        if (!(length > 0.0)) return true;
        for (int k = 0; k <= n; ++k) {
            double along = 0.0, error = 0.0;
            for (int d = 0; d < fleet_axes; ++d) {
                const double share = mean[d] / length;
                along += share * arc_.value[d][k];
                error += arc_.error[d][k] + 16.0 * unit * std::fabs(arc_.value[d][k]);
            }
            if (along - error <= reach) return true;
        }
        return false;
    }

    void climb(Greatest &best, Integer row) {
        const int n = arc_.degree;
        squared_norm(arc_, binomials_[n].single, binomials_[n].doubled, square_);
        for (int k = 0; k <= 2 * n; ++k) square_.value[k] = -square_.value[k];
        if (n == 7) {
            usual_.raise(best, square_.value, square_.error, row);
        } else {
            Climb<-1, 2 * max_fleet_degree> &climb = *new (&other_) Climb<-1, 2 * max_fleet_degree>(2 * n);
            climb.raise(best, square_.value, square_.error, row);
        }
    }

    struct Tables {
        Binomials of[max_fleet_degree + 1] = {Binomials(0),  Binomials(1),  Binomials(2),  Binomials(3), Binomials(4),  Binomials(5),
                                              Binomials(6),  Binomials(7),  Binomials(8),  Binomials(9), Binomials(10), Binomials(11),
                                              Binomials(12), Binomials(13), Binomials(14), Binomials(15)};
        const Binomials &operator[](int n) const { return of[n]; }
    };

    const SeparationQuestion &q_;
    Curve arc_, other_arc_;
    Scalar square_;
    Climb<14> usual_;
    Climb<-1, 2 * max_fleet_degree> other_;
    Tables binomials_;
};

class Separation {
public:
    explicit Separation(const SeparationQuestion &question) : q_(question) {}

    Status run() {
        const Integer vehicles = q_.fleet.vehicles;
        Integer most = 0;
        for (Integer v = 1; v < vehicles; ++v)
            if (q_.fleet.pieces[v] > q_.fleet.pieces[most]) most = v;
        cell_ = clock_of(q_.fleet, most);
        cells_ = q_.fleet.pieces[most];
        blocks_ = (vehicles + block - 1) / block;
        for (Integer v = 0; v < vehicles; ++v) largest_ = std::fmax(largest_, q_.radii[v]);
        const std::size_t entries = std::size_t(cells_) * std::size_t(vehicles);
        if (!chords_.allocate(entries) || !order_.allocate(entries) || !nodes_.allocate(std::size_t(cells_ * most_nodes(vehicles))))
            return Status::no_memory;
        lists_ = owned_array<Growing<Near>>(std::size_t(cells_ * blocks_));
        if (lists_ == nullptr) return Status::no_memory;
        const int threads = int(q_.threads);
        auto fill = [this](Integer cell) { prepare(cell); };
        Chunks<decltype(fill)>(cells_, fill).run(threads);
        start_ = q_.nearest_only != 0 ? guess() : q_.reach;
        auto search = [this](Integer chunk) { look_around(chunk); };
        Chunks<decltype(search)>(cells_ * blocks_, search).run(threads);
        return failed_ ? Status::no_memory : hand_over();
    }

private:
    const Chord *chords(Integer cell) const { return chords_.data() + cell * q_.fleet.vehicles; }
    const Sorted *order(Integer cell) const { return order_.data() + cell * q_.fleet.vehicles; }
    const BoxNode *nodes(Integer cell) const { return nodes_.data() + cell * most_nodes(q_.fleet.vehicles); }
    double asked(Integer one, Integer two) const { return q_.radii[one] + q_.radii[two]; }

    void prepare(Integer cell) {
        Buffer<Curve> arc;
        if (!arc.allocate(1)) {
            failed_ = true;
            return;
        }
        const Integer vehicles = q_.fleet.vehicles, at = cell * vehicles;
        fill_cell(q_.fleet, cell_[cell], cell_[cell + 1], q_.downwash, arc[0], chords_.data() + at, order_.data() + at);
        BoxTree(order_.data() + at, nodes_.data() + cell * most_nodes(vehicles), vehicles);
    }

    // A share of the separation that some pair comes down to: of neighbours in the order, where cells begin.
    double guess() const {
        constexpr Integer neighbours = 8;
        double least = __builtin_huge_val();
        for (Integer cell = 0; cell < cells_; ++cell)
            for (Integer a = 0; a < q_.fleet.vehicles; ++a)
                for (Integer b = a + 1; b < q_.fleet.vehicles && b <= a + neighbours; ++b) {
                    const Integer one = order(cell)[a].vehicle, two = order(cell)[b].vehicle;
                    const Chord &first = chords(cell)[one], &second = chords(cell)[two];
                    least = std::fmin(least, (chord_distance(first, second) + first.spread + second.spread) / asked(one, two));
                }
        return least * (1.0 + 1e-9) + 1e-9;
    }

    void look_around(Integer chunk) {
        Buffer<PairSearch> memory;
        if (!memory.allocate(1)) {
            failed_ = true;
            return;
        }
        PairSearch &search = *new (memory.data()) PairSearch(q_);
        const Integer cell = chunk / blocks_, first = chunk % blocks_ * block;
        const Integer vehicles = q_.fleet.vehicles, last = std::min(vehicles, first + block);
        const Sorted *boxes = order(cell);
        Growing<Near> &found = lists_[chunk];
        double share = start_;
        for (Integer a = first; a < last; ++a) {
            const double widest = (q_.radii[boxes[a].vehicle] + largest_) * (1.0 + 1e-12);
            auto reach = [&share, widest] { return share * widest; };
            auto look = [&](Integer b) {
                Near near;
                if (!meets(boxes[a], boxes[b], cell, share, search, near)) return;
                if (q_.nearest_only != 0) {
                    share = std::fmin(share, near.attained / asked(near.one, near.two));
                    found.clear();
                }
                if (!found.add(near)) failed_ = true;
            };
            visit_near(boxes, nodes(cell), a, reach, look);
        }
    }

    bool meets(const Sorted &a, const Sorted &b, Integer cell, double share, PairSearch &search, Near &near) const {
        const double reach = share * asked(a.vehicle, b.vehicle) * (1.0 + 1e-12);
        if (squared_gap(a, b) > reach * reach) return false;
        const Integer one = std::min(a.vehicle, b.vehicle), two = std::max(a.vehicle, b.vehicle);
        const Chord &first = chords(cell)[one], &second = chords(cell)[two];
        if (chord_distance(first, second) - (first.spread + second.spread) > reach) return false;
        return search.nearest(one, two, cell_[cell], cell_[cell + 1], reach, near);
    }

    Status hand_over() {
        Integer count = 0;
        for (Integer chunk = 0; chunk < cells_ * blocks_; ++chunk)
            for (const Near &near : lists_[chunk]) {
                if (count < q_.capacity) {
                    q_.pairs[2 * count] = near.one;
                    q_.pairs[2 * count + 1] = near.two;
                    q_.values[3 * count] = near.least;
                    q_.values[3 * count + 1] = near.attained;
                    q_.values[3 * count + 2] = near.instant;
                }
                ++count;
            }
        *q_.found = count;
        return Status::done;
    }

    const SeparationQuestion &q_;
    const double *cell_ = nullptr;
    Integer cells_ = 0, blocks_ = 0;
    double largest_ = 0.0, start_ = 0.0;
    Buffer<Chord> chords_;
    Buffer<Sorted> order_;
    Buffer<BoxNode> nodes_;
    std::unique_ptr<Growing<Near>[]> lists_;
    std::atomic<bool> failed_{false};
};

}  // namespace
}  // namespace minsnap

using namespace minsnap;

MINSNAP_EXPORT std::int32_t minsnap_fleet_separation(const SeparationQuestion *question) {
    const SeparationQuestion &q = *question;
    if (q.fleet.vehicles < 2 || q.threads < 1 || q.capacity < 0) return int(Status::bad_size);
    if (!sound(q.fleet) || !(q.downwash >= 1.0) || !(q.reach > 0.0)) return int(Status::bad_number);
    for (Integer v = 0; v < q.fleet.vehicles; ++v)
        if (!(q.radii[v] > 0.0 && q.radii[v] < 0x1p100)) return int(Status::bad_number);
    return int(Separation(q).run());
}

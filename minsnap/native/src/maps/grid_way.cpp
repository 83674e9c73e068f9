// A way through the free cells of a grid whose lines have any angle.
//
// Lazy Theta* (A. Nash, S. Koenig and C. Tovey, "Lazy Theta*: any-angle path planning and path length analysis in 3D", AAAI 2010): a cell takes its
// predecessor's own, as if it were in sight; whether it is, is looked at once the cell is expanded. A line between centers of cells is free where all cells that
// it touches are, told in whole numbers. Whether start and goal are joined at all is looked at first: a search that ends nowhere expands all cells.
#include <cmath>
#include <cstdlib>

#include "basics/buffer.hpp"
#include "basics/export.hpp"
#include "basics/status.hpp"
#include "maps/questions.hpp"

namespace minsnap {
namespace {

constexpr Integer most_cells = Integer(1) << 31;

struct Open {
    double expected;
    std::int32_t cell;
};

class GridWay {
public:
    explicit GridWay(const GridWayQuestion &q) : q_(q), cells_(q.shape[0] * q.shape[1] * q.shape[2]) {}

    Status find() {
        if (!length_.allocate(std::size_t(cells_)) || !before_.allocate(std::size_t(cells_)) || !heap_.allocate(1024))
            return Status::no_memory;
        start_ = index(q_.start);
        goal_ = index(q_.goal);
        prepare_steps();
        bool joined = false;
        if (!flood(joined)) return Status::no_memory;
        if (!joined) {
            *q_.found = 0;
            return Status::done;
        }
        for (Integer i = 0; i < cells_; ++i) before_[std::size_t(i)] = untouched;
        length_[std::size_t(start_)] = 0.0;
        before_[std::size_t(start_)] = start_;
        if (!push(start_, apart(q_.start, q_.goal))) return Status::no_memory;
        while (count_ > 0) {
            const std::int32_t cell = pop();
            if (before_[std::size_t(cell)] < 0) continue;  // expanded before, by a shorter way
            look_back(cell);
            if (cell == goal_) break;
            if (!expand(cell)) return Status::no_memory;
        }
        trace();
        return Status::done;
    }

private:
    // A cell that is expanded has its predecessor's number as -2 - number: what is known of it does not change any more.
    static constexpr std::int32_t untouched = -1;
    static std::int32_t closed(std::int32_t before) { return -2 - before; }
    std::int32_t predecessor(std::int32_t cell) const {
        const std::int32_t before = before_[std::size_t(cell)];
        return before < untouched ? -2 - before : before;
    }

    std::int32_t index(const Integer *at) const { return std::int32_t((at[0] * q_.shape[1] + at[1]) * q_.shape[2] + at[2]); }
    void place(std::int32_t cell, Integer *at) const {
        at[2] = cell % q_.shape[2];
        at[1] = cell / q_.shape[2] % q_.shape[1];
        at[0] = cell / q_.shape[2] / q_.shape[1];
    }
    bool free(const Integer *at) const { return q_.free[std::size_t(index(at))] != 0; }

    double apart(const Integer *here, const Integer *there) const {
        double sum = 0.0;
        for (int d = 0; d < 3; ++d) {
            const double way = q_.size[d] * double(here[d] - there[d]);
            sum += way * way;
        }
        return std::sqrt(sum);
    }

    // Tell whether the goal can be reached from the start. Steps through faces do: others need all cells free that meet there.
    bool flood(bool &joined) {
        Buffer<std::int32_t> waiting;
        if (!waiting.allocate(std::size_t(cells_))) return false;
        for (Integer i = 0; i < cells_; ++i) before_[std::size_t(i)] = q_.free[i] != 0 ? untouched : start_;
        std::size_t count = 0;
        waiting[count++] = start_;
        before_[std::size_t(start_)] = start_;
        while (count > 0 && before_[std::size_t(goal_)] == untouched) {
            const std::int32_t cell = waiting[--count];
            Integer at[3];
            place(cell, at);
            for (int i = 0; i < step_count_; ++i) {
                const Step &step = steps_[i];
                if (step.meets != 1) continue;
                bool inside = true;
                for (int d = 0; d < 3; ++d) inside = inside && at[d] + step.by[d] >= 0 && at[d] + step.by[d] < q_.shape[d];
                const std::int32_t other = cell + step.adds;
                if (!inside || before_[std::size_t(other)] != untouched) continue;
                before_[std::size_t(other)] = start_;
                waiting[count++] = other;
            }
        }
        joined = goal_ == start_ || (q_.free[goal_] != 0 && before_[std::size_t(goal_)] != untouched);
        return true;
    }

    // Whether all cells that the line between two centers touches are free.
    bool in_sight(std::int32_t a, std::int32_t b) const {
        Integer at[3], end[3], steps[3], sign[3], crossed[3] = {0, 0, 0};
        place(a, at);
        place(b, end);
        for (int d = 0; d < 3; ++d) {
            steps[d] = std::llabs(end[d] - at[d]);
            sign[d] = end[d] > at[d] ? 1 : -1;
        }
        while (crossed[0] < steps[0] || crossed[1] < steps[1] || crossed[2] < steps[2]) {
            // The next border along axis d is crossed at (2 crossed + 1) / (2 steps) of the way.
            int first = -1;
            for (int d = 0; d < 3; ++d)
                if (crossed[d] < steps[d] && (first < 0 || (2 * crossed[d] + 1) * steps[first] < (2 * crossed[first] + 1) * steps[d]))
                    first = d;
            bool together[3];
            for (int d = 0; d < 3; ++d)
                together[d] = crossed[d] < steps[d] && (2 * crossed[d] + 1) * steps[first] == (2 * crossed[first] + 1) * steps[d];
            if (!all_free(at, sign, together)) return false;
            for (int d = 0; d < 3; ++d)
                if (together[d]) {
                    at[d] += sign[d];
                    ++crossed[d];
                }
        }
        return true;
    }

    // Whether the cells that meet at a border, an edge or a corner ahead are free.
    bool all_free(const Integer *at, const Integer *sign, const bool *together) const {
        for (int part = 1; part < 8; ++part) {
            Integer there[3];
            bool meets = true;
            for (int d = 0; d < 3; ++d) {
                const bool moves = (part >> d & 1) != 0;
                meets = meets && (!moves || together[d]);
                there[d] = at[d] + (moves ? sign[d] : 0);
            }
            if (meets && !free(there)) return false;
        }
        return true;
    }

    // Put a cell right whose predecessor is not in sight: the best of its expanded neighbours is.
    void look_back(std::int32_t cell) {
        const std::int32_t before = predecessor(cell);
        if (before == cell || in_sight(before, cell)) {
            before_[std::size_t(cell)] = closed(before);
            return;
        }
        double best = __builtin_huge_val();
        std::int32_t from = cell;
        each_neighbour(cell, [&](std::int32_t other, const Integer *, double step) {
            if (before_[std::size_t(other)] >= untouched) return true;
            const double length = length_[std::size_t(other)] + step;
            if (length < best || (length == best && other < from)) {
                best = length;
                from = other;
            }
            return true;
        });
        length_[std::size_t(cell)] = best;
        before_[std::size_t(cell)] = closed(from);
    }

    bool expand(std::int32_t cell) {
        const std::int32_t from = predecessor(cell);
        const double so_far = length_[std::size_t(from)];
        Integer at[3];
        place(from, at);
        return each_neighbour(cell, [&](std::int32_t other, const Integer *there, double) {
            const std::int32_t known = before_[std::size_t(other)];
            if (known < untouched) return true;
            const double length = so_far + apart(at, there);
            if (known >= 0 && !(length < length_[std::size_t(other)])) return true;
            length_[std::size_t(other)] = length;
            before_[std::size_t(other)] = from;
            return push(other, length + apart(there, q_.goal));
        });
    }

    // A step to a neighbour: what it adds to a cell's number, its length, and the cells that meet between both, by what they add.
    struct Step {
        Integer by[3];
        std::int32_t adds, meeting[7];
        int meets;
        double length;
    };

    void prepare_steps() {
        const Integer deep = q_.dim == 3 ? 1 : 0;
        for (Integer i = -1; i <= 1; ++i)
            for (Integer j = -1; j <= 1; ++j)
                for (Integer k = -deep; k <= deep; ++k) {
                    if (!(i || j || k)) continue;
                    Step &step = steps_[step_count_++];
                    const Integer by[3] = {i, j, k};
                    step.meets = 0;
                    double square = 0.0;
                    for (int d = 0; d < 3; ++d) {
                        step.by[d] = by[d];
                        square += q_.size[d] * q_.size[d] * double(by[d] * by[d]);
                    }
                    step.length = std::sqrt(square);
                    step.adds = added(by);
                    for (int part = 1; part < 8; ++part) {
                        const Integer some[3] = {(part & 1) ? i : 0, (part & 2) ? j : 0, (part & 4) ? k : 0};
                        const bool whole = !((part & 1) && !i) && !((part & 2) && !j) && !((part & 4) && !k);
                        if (whole) step.meeting[step.meets++] = added(some);
                    }
                }
    }

    std::int32_t added(const Integer *by) const { return std::int32_t((by[0] * q_.shape[1] + by[1]) * q_.shape[2] + by[2]); }

    // Call a function of each free neighbour, its place and the length of the step there, until it returns false.
    template <class Function>
    bool each_neighbour(std::int32_t cell, Function function) const {
        Integer at[3];
        place(cell, at);
        for (int i = 0; i < step_count_; ++i) {
            const Step &step = steps_[i];
            Integer there[3];
            bool open = true;
            for (int d = 0; d < 3; ++d) {
                there[d] = at[d] + step.by[d];
                open = open && there[d] >= 0 && there[d] < q_.shape[d];
            }
            for (int k = 0; open && k < step.meets; ++k) open = q_.free[cell + step.meeting[k]] != 0;
            if (open && !function(std::int32_t(cell + step.adds), there, step.length)) return false;
        }
        return true;
    }

    // The least first; of equal ones that of the lower number, so that the way does not depend on the heap.
    static bool sooner(const Open &a, const Open &b) { return a.expected < b.expected || (a.expected == b.expected && a.cell < b.cell); }

    bool push(std::int32_t cell, double expected) {
        if (count_ == heap_.capacity()) {
            Buffer<Open> larger;
            if (!larger.allocate(2 * count_)) return false;
            for (std::size_t i = 0; i < count_; ++i) larger[i] = heap_[i];
            heap_.swap(larger);
        }
        std::size_t at = count_++;
        const Open added{expected, cell};
        for (; at > 0 && sooner(added, heap_[(at - 1) / 2]); at = (at - 1) / 2) heap_[at] = heap_[(at - 1) / 2];
        heap_[at] = added;
        return true;
    }

    std::int32_t pop() {
        const std::int32_t least = heap_[0].cell;
        const Open last = heap_[--count_];
        std::size_t at = 0;
        for (std::size_t child = 1; child < count_; child = 2 * at + 1) {
            if (child + 1 < count_ && sooner(heap_[child + 1], heap_[child])) ++child;
            if (!sooner(heap_[child], last)) break;
            heap_[at] = heap_[child];
            at = child;
        }
        heap_[at] = last;
        return least;
    }

    void trace() {
        Integer count = 0;
        if (before_[std::size_t(goal_)] != untouched) {
            count = 1;
            for (std::int32_t cell = goal_; cell != start_; cell = predecessor(cell)) ++count;
            std::int32_t cell = goal_;
            for (Integer i = count - 1; i >= 0; --i, cell = predecessor(cell))
                if (i < q_.capacity) place(cell, q_.way + 3 * i);
        }
        *q_.found = count;
    }

    const GridWayQuestion &q_;
    Integer cells_;
    std::int32_t start_ = 0, goal_ = 0;
    Buffer<double> length_;
    Buffer<std::int32_t> before_;
    Buffer<Open> heap_;
    std::size_t count_ = 0;
    Step steps_[26];
    int step_count_ = 0;
};

}  // namespace
}  // namespace minsnap

using namespace minsnap;

MINSNAP_EXPORT std::int32_t minsnap_grid_way(const GridWayQuestion *question) {
    const GridWayQuestion &q = *question;
    if (q.dim < 2 || q.dim > 3 || q.capacity < 1) return int(Status::bad_size);
    Integer cells = 1;
    for (int d = 0; d < 3; ++d) {
        if (q.shape[d] < 1 || q.shape[d] > most_cells / cells) return int(Status::bad_size);
        cells *= q.shape[d];
        if (q.start[d] < 0 || q.start[d] >= q.shape[d] || q.goal[d] < 0 || q.goal[d] >= q.shape[d]) return int(Status::bad_size);
        if (!(q.size[d] > 0.0)) return int(Status::bad_number);
    }
    if (cells >= most_cells) return int(Status::bad_size);
    return int(GridWay(q).find());
}

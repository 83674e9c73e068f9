// What a sensor sees from one place: cells that its lines pass are free, those of points are occupied.
//
// A line passes the cell that it begins in, and those that it enters where it crosses a side of the grid: along each axis the crossings are counted, and the cell
// behind each is found on its own (J. Amanatides and A. Woo, "A fast voxel traversal algorithm for ray tracing", Eurographics 1987, without its sums).
#include <cmath>

#include "basics/export.hpp"
#include "basics/status.hpp"
#include "maps/questions.hpp"

namespace minsnap {
namespace {

constexpr std::uint8_t free_state = 1, occupied_state = 2;
constexpr double parts = 255.0;

class Sight {
public:
    explicit Sight(const SightQuestion &q) : q_(q) {
        for (Integer d = 0; d < q.dim; ++d) begin_[d] = q.place[d] / q.size;
    }

    void mark() const {
        Integer at[3];
        for (Integer d = 0; d < q_.dim; ++d) at[d] = Integer(std::floor(begin_[d]));
        pass(at);
        for (Integer i = 0; i < q_.points; ++i) follow(q_.point + i * q_.dim);
        for (Integer i = 0; i < q_.rays; ++i) follow(q_.end + i * q_.dim);
        for (Integer i = 0; i < q_.points; ++i) meet(q_.point + i * q_.dim);
    }

private:
    // The number of a cell in the block; -1 outside of it.
    Integer index(const Integer *at) const {
        Integer number = 0;
        for (Integer d = 0; d < q_.dim; ++d) {
            const Integer here = at[d] - q_.first[d];
            if (here < 0 || here >= q_.shape[d]) return -1;
            number = number * q_.shape[d] + here;
        }
        return number;
    }

    void pass(const Integer *at) const {
        const Integer cell = index(at);
        if (cell >= 0 && q_.states[cell] < free_state) q_.states[cell] = free_state;
    }

    // Mark the cells that a line to an end enters. On its way back along an axis, what is on a side of the grid is in the cell before that side.
    void follow(const double *end) const {
        double span[3];
        for (Integer d = 0; d < q_.dim; ++d) span[d] = (end[d] - q_.place[d]) / q_.size;
        for (Integer axis = 0; axis < q_.dim; ++axis) {
            if (span[axis] == 0.0) continue;
            const bool forth = span[axis] > 0.0;
            const double border = std::floor(begin_[axis]) + (forth ? 1.0 : 0.0);
            const double reach = forth ? begin_[axis] + span[axis] - border : border - begin_[axis] - span[axis];
            for (double step = 0.0; step < reach; step += 1.0) {
                const double line = border + (forth ? step : -step), share = (line - begin_[axis]) / span[axis];
                Integer at[3];
                for (Integer d = 0; d < q_.dim; ++d) {
                    const double there = begin_[d] + share * span[d];
                    at[d] = span[d] < 0.0 ? Integer(std::ceil(there)) - 1 : Integer(std::floor(there));
                }
                at[axis] = Integer(line) - (forth ? 0 : 1);
                pass(at);
            }
        }
    }

    // Mark the cell of a point, and where in it the point is.
    void meet(const double *point) const {
        Integer at[3];
        for (Integer d = 0; d < q_.dim; ++d) at[d] = Integer(std::floor(point[d] / q_.size));
        const Integer cell = index(at);
        if (cell < 0) return;
        q_.states[cell] = occupied_state;
        std::uint8_t *low = q_.spans + cell * 2 * q_.dim, *high = low + q_.dim;
        for (Integer d = 0; d < q_.dim; ++d) {
            const double share = (point[d] / q_.size - double(at[d])) * parts;
            const std::uint8_t below = std::uint8_t(std::fmin(std::fmax(std::floor(share), 0.0), parts));
            const std::uint8_t above = std::uint8_t(std::fmin(std::fmax(std::ceil(share), 0.0), parts));
            if (below < low[d]) low[d] = below;
            if (above > high[d]) high[d] = above;
        }
    }

    const SightQuestion &q_;
    double begin_[3] = {0.0, 0.0, 0.0};
};

}  // namespace
}  // namespace minsnap

using namespace minsnap;

MINSNAP_EXPORT std::int32_t minsnap_sight(const SightQuestion *question) {
    const SightQuestion &q = *question;
    if (q.dim < 2 || q.dim > 3 || q.points < 0 || q.rays < 0) return int(Status::bad_size);
    if (!(q.size > 0.0)) return int(Status::bad_number);
    for (Integer d = 0; d < q.dim; ++d)
        if (q.shape[d] < 1) return int(Status::bad_size);
    Sight(q).mark();
    return int(Status::done);
}

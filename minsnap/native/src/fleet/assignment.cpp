// Assignment of goals to vehicles by auction, with the sum of squared ways at most `vehicles * step` above the least.
//
// A vehicle without a goal bids for the one that costs it least, way and price together: it raises the price by how much better that is than the next best, and by
// `step` (D. P. Bertsekas, "The auction algorithm: a distributed relaxation method for the assignment problem", Annals of Operations Research 14, 1988). No matrix of
// costs is held. A call ends after some bids, and the next goes on from its prices.
#include <cmath>

#include "basics/buffer.hpp"
#include "basics/export.hpp"
#include "basics/status.hpp"
#include "fleet/questions.hpp"
#include "polynomials/enclosure.hpp"

namespace minsnap {
namespace {

class Auction {
public:
    explicit Auction(const AssignmentQuestion &question) : q_(question) {}

    Status run() {
        const Integer count = q_.goals;
        if (!costs_.allocate(std::size_t(count)) || !waiting_.allocate(std::size_t(count)) || !owner_.allocate(std::size_t(count)))
            return Status::no_memory;
        for (Integer j = 0; j < count; ++j) owner_[j] = -1;
        Integer waiting = 0;
        for (Integer i = count - 1; i >= 0; --i) {
            if (q_.goal_of[i] >= 0)
                owner_[q_.goal_of[i]] = i;
            else
                waiting_[waiting++] = i;
        }
        for (Integer bids = 0; waiting > 0 && bids < q_.bids; ++bids) {
            const Integer bidder = waiting_[--waiting], goal = bid(bidder), former = owner_[goal];
            if (former >= 0) {
                q_.goal_of[former] = -1;
                waiting_[waiting++] = former;
            }
            owner_[goal] = bidder;
            q_.goal_of[bidder] = goal;
        }
        *q_.waiting = waiting;
        return Status::done;
    }

private:
    // Raise the price of the goal that is best for a vehicle, and return which it is.
    Integer bid(Integer vehicle) {
        const Integer count = q_.goals;
        const double *x = q_.goal, *y = x + count, *z = y + count;
        double *cost = costs_.data();
        if (vehicle < q_.vehicles) {
            const double a = q_.start[vehicle], b = q_.start[q_.vehicles + vehicle], c = q_.start[2 * q_.vehicles + vehicle];
            for (Integer j = 0; j < count; ++j) {
                const double u = a - x[j], v = b - y[j], w = c - z[j];
                cost[j] = u * u + v * v + w * w + q_.price[j];
            }
        } else {
            for (Integer j = 0; j < count; ++j) cost[j] = q_.price[j];
        }
        double best = __builtin_huge_val(), next = __builtin_huge_val();
        Integer goal = 0;
        for (Integer j = 0; j < count; ++j) {
            if (cost[j] >= next) continue;
            if (cost[j] < best) {
                next = best;
                best = cost[j];
                goal = j;
            } else {
                next = cost[j];
            }
        }
        q_.price[goal] += (count > 1 ? next - best : 0.0) + q_.step;
        return goal;
    }

    const AssignmentQuestion &q_;
    Buffer<double> costs_;
    Buffer<Integer> waiting_, owner_;
};

}  // namespace
}  // namespace minsnap

using namespace minsnap;

MINSNAP_EXPORT std::int32_t minsnap_fleet_assignment(const AssignmentQuestion *question) {
    const AssignmentQuestion &q = *question;
    if (q.vehicles < 1 || q.goals < q.vehicles || q.bids < 1) return int(Status::bad_size);
    if (!within(q.start, 3 * q.vehicles, 0x1p100) || !within(q.goal, 3 * q.goals, 0x1p100) || !within(q.price, q.goals, 0x1p210))
        return int(Status::bad_number);
    if (!(q.step > 0.0 && q.step < 0x1p210)) return int(Status::bad_number);
    for (Integer i = 0; i < q.goals; ++i)
        if (q.goal_of[i] < -1 || q.goal_of[i] >= q.goals) return int(Status::bad_size);
    return int(Auction(q).run());
}

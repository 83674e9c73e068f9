// By how much walls must give way for a curve to keep them, and what presses against them then: why there is none.
//
// Slacks are further unknowns of the exchange: sigma_g moves the walls of its group outwards by sigma_g times weight times
// width, and K^2 sum sigma_g^2 is added to the cost. A solution always exists. With rows a_i, multipliers mu_i and whitened
// deviations z its conditions are
//
//   sum mu_i a_i = -z,   sum of mu_i weight_i width_i over a group = K^2 sigma_g,
//
// so that for large K the curve has no part in it: sigma is least, and mu / (K^2 sigma) are multipliers after Farkas, whose
// rows add up to next to nothing on one side and to -sigma on the other. (This is the proximal point method of R. T.
// Rockafellar, "Monotone operators and the proximal point algorithm", 1976, with one step.) K rises in stages, each beginning
// with the contacts of the one before; the last ones need double-double arithmetic. Where it is sufficient to know that sigma is
// not zero, a stage ends once z, which is what is left of the rows, is little beside K sigma, and the first and the last do.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>

#include "basics/export.hpp"
#include "corridor/exchange_solver.hpp"

namespace minsnap {
namespace {

constexpr double prices[] = {1e3, 1e6, 1e12, 1e18};  // K^2, over the cost of the curve without walls and of stops at all knots
constexpr double most_in_double = 1e6;               // price beyond which slacks need double-double arithmetic
constexpr double absurd = 1e6;                       // slack that rounding made

bool slacks_fit(const SlackRecord &slacks, const Request &given) {
    if (slacks.count < 1 || slacks.count > given.pieces) return false;
    for (std::int64_t i = 0; i < given.walls.count; ++i)
        if (slacks.group[i] < -1 || slacks.group[i] >= slacks.count || !std::isfinite(slacks.weight[i])) return false;
    return true;
}

// The contacts of an answer, for the next stage to begin with.
int take_contacts(const Answer &answer, int dim, Buffer<Contact> &known) {
    int count = 0;
    for (std::int64_t k = 0; k < answer.rows; ++k)
        if (answer.multiplier[k] != 0.0)
            known[count++] = contact(int(answer.wall[k]), answer.s[k], answer.multiplier[k], answer.direction + k * dim, dim);
    return count;
}

// The stages of one request.
class Stages {
public:
    Stages(Request &given, Answer &answer) : given_(given), answer_(answer), most_(given.effort) {}

    // Go through the prices, each from the contacts of the last one that ended with a solution. Where the highest has none, that
    // of the price before is the answer: multipliers of lower prices, or of a stage that did not end, prove less often.
    Status run() {
        if (!known_.allocate(std::size_t(given_.pieces) * given_.slots() * given_.dim + given_.slacks.count + 2)) return Status::no_memory;
        Status status = Status::no_progress;
        double solved = 0.0;
        bool extended = false;
        for (const double price : prices) {
            if (spent()) break;
            if (given_.slacks.sign && price != prices[0] && price != *(std::end(prices) - 1)) continue;
            if (price > most_in_double) extended = true;
            status = stage(price, extended);
            // It creeps, which no precision helps; slacks that rounding made are another thing.
            if (status == Status::spent && price == prices[0] &&
                *std::max_element(answer_.slack, answer_.slack + given_.slacks.count) < absurd)
                return answer_.rows = 0, status;
            if (status != Status::done && !extended && !spent()) extended = true, status = stage(price, true);
            if (status == Status::no_memory) return status;
            if (status == Status::done)
                solved = price, count_ = take_contacts(answer_, given_.dim, known_);
            else if (solved > most_in_double && !spent())
                return stage(solved, true);
        }
        return status;
    }

private:
    Request &given_;
    Answer &answer_;
    double most_;  // work
    ExchangeSolver quick_;
    Buffer<Contact> known_;
    int count_ = 0;

    bool spent() const { return answer_.work >= most_; }

    Status stage(double price, bool extended) {
        given_.slacks.price = price;
        given_.effort = most_ - answer_.work;
        return extended ? solve_extended(given_, answer_, Aim::widened, known_.data(), count_)
                        : quick_.solve(given_, answer_, Aim::widened, known_.data(), count_);
    }
};

}  // namespace
}  // namespace minsnap

// The least slacks, and the rows that press. What is written holds at any status that is about the method; slacks are least
// where it is ``done``.
MINSNAP_EXPORT std::int32_t minsnap_least_slack(const minsnap::CorridorRecord *asked, const minsnap::SlackRecord *slacks,
                                                minsnap::CorridorAnswerRecord *found) {
    using namespace minsnap;
    FlatWalls walls;
    Request given = {};
    const Status taken = take_request(*asked, asked->pieces, asked->durations, walls, given);
    if (taken != Status::done) return std::int32_t(taken);
    if (!slacks_fit(*slacks, given)) return std::int32_t(Status::bad_size);
    given.slacks = {int(slacks->count), slacks->group, slacks->weight, slacks->sign != 0};
    Answer answer = {found->points, found->knots, found->wall, found->s, found->multiplier, 0.0, 0.0, 0.0, 0, 0, found->direction};
    answer.slack = slacks->slack, answer.remainder = slacks->remainder;
    const Status status = Stages(given, answer).run();
    found->rows = answer.rows, found->rounds = answer.rounds, found->work = answer.work;
    return std::int32_t(status);
}

// Decides before every iteration whether a search goes on: its work is counted here, and what Python has to say is asked now and then.
#pragma once

#include <algorithm>
#include <chrono>

#include "shortest_time/border.hpp"

namespace minsnap {

class Watch {
public:
    Watch(const ShortestRequest &request, ShortestAnswer &answer) : request_(request), answer_(answer) {}

    // Count an iteration from a curve of a total time; true where the search must end.
    [[nodiscard]] bool ends(double total, std::int64_t rows) {
        answer_.totals[answer_.told++] = total;
        answer_.longest = std::max(answer_.longest, total);
        answer_.work += request_.row_work * static_cast<double>(rows) + request_.iteration_work;
        const bool over = total < request_.vanishing * answer_.longest || answer_.work > request_.worth;
        if (!over && request_.live == 0 && answer_.told < request_.room && Clock::now() - polled_ < pause) return false;
        polled_ = Clock::now();
        return request_.poll(request_.context) != 0 || over;
    }

private:
    using Clock = std::chrono::steady_clock;
    static constexpr std::chrono::milliseconds pause{10};  // after which Ctrl-C is seen

    const ShortestRequest &request_;
    ShortestAnswer &answer_;
    Clock::time_point polled_ = Clock::now();
};

}  // namespace minsnap

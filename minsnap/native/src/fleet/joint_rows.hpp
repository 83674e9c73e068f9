// Rows of the joint search: two vehicles that come near, or one that comes near an obstacle, in a part of a piece.
//
// A row keeps its identity (who, and which part of the time) and its multiplier; its instant moves with the curves.
#pragma once

#include "basics/buffer.hpp"
#include "basics/growing.hpp"
#include "fleet/septic.hpp"

namespace minsnap {

struct NearRow {
    std::int32_t one, two;  // two < 0: an obstacle
    double basis[ends];
    double way[3];            // derivative of the residual in the difference, negated
    double slope, curvature;  // of the penalty
    std::uint64_t name;
};

// Multipliers by the name of their row: a table with open addresses.
class Multipliers {
public:
    double operator()(std::uint64_t name) const {
        if (room_ == 0) return 0.0;
        for (std::size_t at = place(name);; at = (at + 1) & (room_ - 1)) {
            if (slots_[at].name == name) return slots_[at].value;
            if (slots_[at].name == none) return 0.0;
        }
    }

    void clear() {
        for (std::size_t i = 0; i < room_; ++i) slots_[i].name = none;
    }

    // Empty it and make room for so many.
    [[nodiscard]] bool restart(std::size_t count) {
        std::size_t room = 64;
        while (room < 2 * count) room *= 2;
        if (room > room_) {
            if (!slots_.allocate(room)) return false;
            room_ = room;
        }
        clear();
        return true;
    }

    void add(std::uint64_t name, double value) {
        std::size_t at = place(name);
        while (slots_[at].name != none) at = (at + 1) & (room_ - 1);
        slots_[at] = {name, value};
    }

private:
    static constexpr std::uint64_t none = ~std::uint64_t(0);
    struct Slot {
        std::uint64_t name;
        double value;
    };
    std::size_t place(std::uint64_t name) const { return std::size_t((name * 0x9e3779b97f4a7c15ULL) >> 20) & (room_ - 1); }

    Buffer<Slot> slots_;
    std::size_t room_ = 0;
};

}  // namespace minsnap

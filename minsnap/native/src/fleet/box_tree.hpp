// A tree over the boxes of vehicles in a cell of time: which boxes come near a given one, in logarithmic time for each.
//
// Boxes are halved at the median of their centers along the axis on which these lie widest apart (J. L. Bentley, "Multidimensional binary search trees used for
// associative searching", 1975). Nodes lie in the order of a walk that visits a node before its halves, so that boxes behind a given one are found by their place
// alone. Medians and leaves are ordered by vehicle where they tie: the order is the same from every library.
#pragma once

#include <algorithm>

#include "fleet/cells.hpp"

namespace minsnap {

constexpr Integer leaf_boxes = 8;  // no more of them are looked at one by one

// Boxes from `first` to before `last` in the order, and the box around them.
struct BoxNode {
    double low[fleet_axes], high[fleet_axes];
    Integer first, last, second;  // `second`: the node of the second half; 0 for a leaf
};

// The largest number of nodes over so many boxes: a leaf has at least half of `leaf_boxes`.
inline Integer most_nodes(Integer boxes) { return 4 * (boxes / leaf_boxes) + 1; }

// Order boxes, (count,), and write the nodes over them.
class BoxTree {
public:
    BoxTree(Sorted *boxes, BoxNode *nodes, Integer count) : boxes_(boxes), nodes_(nodes) { build(0, count); }

private:
    void build(Integer first, Integer last) {
        BoxNode &node = nodes_[used_++];
        node.first = first;
        node.last = last;
        node.second = 0;
        double least[fleet_axes], most[fleet_axes];
        for (int d = 0; d < fleet_axes; ++d) {
            node.low[d] = least[d] = __builtin_huge_val();
            node.high[d] = most[d] = -__builtin_huge_val();
            for (Integer i = first; i < last; ++i) {
                node.low[d] = std::fmin(node.low[d], boxes_[i].low[d]);
                node.high[d] = std::fmax(node.high[d], boxes_[i].high[d]);
                least[d] = std::fmin(least[d], boxes_[i].low[d] + boxes_[i].high[d]);
                most[d] = std::fmax(most[d], boxes_[i].low[d] + boxes_[i].high[d]);
            }
        }
        int axis = 0;
        for (int d = 1; d < fleet_axes; ++d)
            if (most[d] - least[d] > most[axis] - least[axis]) axis = d;
        if (last - first <= leaf_boxes) {
            std::sort(boxes_ + first, boxes_ + last, [](const Sorted &one, const Sorted &two) { return one.vehicle < two.vehicle; });
            return;
        }
        const Integer middle = first + (last - first) / 2;
        std::nth_element(boxes_ + first, boxes_ + middle, boxes_ + last, [axis](const Sorted &one, const Sorted &two) {
            const double left = one.low[axis] + one.high[axis], right = two.low[axis] + two.high[axis];
            return left != right ? left < right : one.vehicle < two.vehicle;
        });
        build(first, middle);
        node.second = used_;
        build(middle, last);
    }

    Sorted *boxes_;
    BoxNode *nodes_;
    Integer used_ = 0;
};

// Square of the gap between two boxes, 0 where they overlap.
template <class One, class Two>
double squared_gap(const One &one, const Two &two) {
    double square = 0.0;
    for (int d = 0; d < fleet_axes; ++d) {
        const double gap = std::fmax(0.0, std::fmax(two.low[d] - one.high[d], one.low[d] - two.high[d]));
        square += gap * gap;
    }
    return square;
}

// Call visit(b) for every place b behind a whose box may come nearer to that at place a than `reach()`, which may fall meanwhile.
template <class Reach, class Visit>
void visit_near(const Sorted *boxes, const BoxNode *nodes, Integer a, const Reach &reach, const Visit &visit) {
    Integer open[64] = {0}, depth = 1;  // halves that are still to be looked at, one for each level
    while (depth > 0) {
        const BoxNode &node = nodes[open[--depth]];
        if (node.last <= a + 1) continue;
        const double near = reach();
        if (squared_gap(boxes[a], node) > near * near) continue;
        if (node.second != 0) {
            open[depth++] = node.second;
            open[depth++] = Integer(&node - nodes) + 1;
            continue;
        }
        for (Integer b = std::max(node.first, a + 1); b < node.last; ++b) visit(b);
    }
}

}  // namespace minsnap

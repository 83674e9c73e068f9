// Open chains of degrees 3, 5 and 7.
#include "chain/chain_solver.hpp"

namespace minsnap {

Status solve_chain_usual(const ChainProblem &chain, int half, Output out) {
    switch (half) {
        case 2: return solve_all_axes<2>(chain, out);
        case 3: return solve_all_axes<3>(chain, out);
        case 4: return solve_all_axes<4>(chain, out);
        default: return Status::unsupported;
    }
}

}  // namespace minsnap

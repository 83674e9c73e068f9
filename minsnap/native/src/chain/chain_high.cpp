// Open chains of degrees 9 and 11; apart from the others, so that both are compiled at the same time.
#include "chain/chain_solver.hpp"

namespace minsnap {

Status solve_chain_high(const ChainProblem &chain, int half, Output out) {
    switch (half) {
        case 5: return solve_all_axes<5>(chain, out);
        case 6: return solve_all_axes<6>(chain, out);
        default: return Status::unsupported;
    }
}

}  // namespace minsnap

"""Costs of plans beside the optima that sums of squares find: the largest excess of each kind.

    python benchmarks/compare_optima.py --problems 300

The programme solved for comparison has its own accuracy, the gap between its primal and its dual value, which is
printed beside; where no curve fits, both must say so.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from oracles.small_questions import KINDS, small_question  # noqa: E402
from oracles.sum_of_squares import enclosed  # noqa: E402

import minsnap  # noqa: E402


def compared(kind, seed):
    """Cost of the plan and bounds of the optimum; None for one that was not found."""
    (points, durations, plan), (_, _, oracle) = small_question(kind, seed)
    try:
        cost = minsnap.plan(points, durations, **plan).cost()
    except minsnap.InfeasibleError:
        cost = None
    try:
        bounds = enclosed(points, durations, **oracle)
    except ArithmeticError:
        bounds = None
    return cost, bounds


def main() -> int:
    """Compare, print a table, and leave with 1 if a cost is more than 1e-6 above its optimum, or one side has none."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--problems", type=int, default=300)
    parser.add_argument("--kind", choices=KINDS)
    asked = parser.parse_args()
    print(
        "| kind | problems | without a solution | cost / optimum - 1: median | most | least | gap of the optima, most |"
    )
    print("|---|---|---|---|---|---|---|", flush=True)
    wrong = 0
    for kind in (asked.kind,) if asked.kind else KINDS:
        excess, gaps, none = [], [], 0
        for seed in range(asked.problems):
            cost, bounds = compared(kind, seed)
            if cost is None or bounds is None:
                none += cost is None and bounds is None
                wrong += (cost is None) != (bounds is None)
                if (cost is None) != (bounds is None):
                    print(f"{kind} {seed}: cost {cost}, optimum within {bounds}", flush=True)
                continue
            excess.append(cost / bounds[1] - 1.0)
            gaps.append((bounds[1] - bounds[0]) / bounds[1])
            if abs(excess[-1]) > 1e-6:
                wrong += 1
                print(f"{kind} {seed}: cost / optimum - 1 is {excess[-1]:.2e}, gap {gaps[-1]:.1e}", flush=True)
        figures = f"{np.median(excess):.1e} | {max(excess):.1e} | {min(excess):.1e} | {np.abs(gaps).max():.1e}"
        print(f"| {kind} | {asked.problems} | {none} | {figures} |", flush=True)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())

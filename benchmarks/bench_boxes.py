"""Against fastpathplanning on its own problem: a sequence of boxes, fixed durations, least snap, rest to rest.

fastpathplanning keeps the control points of each piece in its box, at degree 9 unless told otherwise, and is then
continuous up to snap; minsnap keeps the curve itself there, at degree 7, continuous up to jerk.  Three ways to compare:
as each comes, at the same degree, and with ours at the same continuity.  The other's time is that of its one programme,
without its choice of boxes and durations.  Run it by hand: ``python benchmarks/bench_boxes.py``. It prints one row a
size.
"""

from __future__ import annotations

import time
import warnings

import numpy as np
from measure import least_times

import minsnap
from minsnap import Boxes

SIZES = (1, 2, 5, 10, 20, 50, 100)
SEEDS = 3


def staircase(count, seed):
    """Boxes that each begin in the last one, with the points where a path starts and ends."""
    draw = np.random.default_rng(seed)
    lower, upper, at = [], [], np.zeros(3)
    for box in range(count):
        step = draw.uniform(0.2, 0.6, 3)
        step[box % 2] = draw.uniform(2.0, 4.0)
        step[:2] *= draw.choice([1.0, 1.0, -1.0])
        lower.append(np.minimum(at, at + step) - 0.4)
        upper.append(np.maximum(at, at + step) + 0.4)
        at = at + step
    return np.array(lower), np.array(upper), np.zeros(3), at


class Staircase:
    """One question, for both."""

    def __init__(self, count, seed):
        self.lower, self.upper, self.start, self.end = staircase(count, seed)
        self.durations = np.full(count, 2.0)
        self.boxes = Boxes(self.lower, self.upper)

    def plan(self, **rest):
        ends = {"start": {"position": self.start}, "end": {"position": self.end}}
        return minsnap.plan(None, self.durations, corridor=self.boxes, **ends, **rest)

    def hull(self, points):
        from fastpathplanning.smooth import optimize_bezier

        still = {order: np.zeros(3) for order in (1, 2, 3)}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return optimize_bezier(
                self.lower,
                self.upper,
                self.durations,
                {4: 1.0},
                {0: self.start, **still},
                {0: self.end, **still},
                n_points=points,
            )[1]


def compare(count, seed):
    case = Staircase(count, seed)
    (mine, theirs), (traj, nine) = least_times([case.plan, lambda: case.hull(10)], 0.0, 5, time.perf_counter)
    smooth = case.plan(continuity=4, pieces=2)
    if not min(traj.report.corridor_margin, smooth.report.corridor_margin) >= 0.0:
        raise RuntimeError(f"outside a box: {traj.report.corridor_margin}")
    seven = case.hull(8)
    return (
        nine["cost"] / traj.cost(),
        seven["cost"] / traj.cost(),
        nine["cost"] / smooth.cost(),
        mine,
        theirs / mine,
        nine["runtime"] / mine,
    )


def main():
    compare(2, 0)
    print(
        "| boxes | cost, degree 9 / ours | cost, degree 7 / ours | cost, degree 9 / ours at C4, 2 pieces | ours | "
        "their call / ours | their solver alone / our call |"
    )
    print("|---|---|---|---|---|---|---|")
    for count in SIZES:
        rows = np.array([compare(count, 100 * count + seed) for seed in range(SEEDS)])
        low, high = rows.min(axis=0), rows.max(axis=0)
        costs = " | ".join(f"{low[i]:.3f} … {high[i]:.3f}" for i in range(3))
        print(
            f"| {count} | {costs} | {1e3 * np.median(rows[:, 3]):.1f} ms | {np.median(rows[:, 4]):.1f} | "
            f"{np.median(rows[:, 5]):.2f} |"
        )


if __name__ == "__main__":
    main()

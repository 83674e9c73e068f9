"""Round tubes: plans by the native and by the Python core, in the same run.

Both add tangent planes where the curve sticks out. Run it by hand: ``python benchmarks/bench_round.py``. It prints one
row per problem; times are the least processor times of several plans.
"""

from __future__ import annotations

import time

import numpy as np

import minsnap
from minsnap import RoundTube
from minsnap.native.library import using

SIZES = (2, 4, 10, 30, 100)
RECTANGLE = np.array([(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)], dtype=float)


def course(legs, seed):
    draw = np.random.default_rng(seed)
    steps = draw.normal(size=(legs, 3))
    steps *= draw.uniform(1.0, 6.0, (legs, 1)) / np.linalg.norm(steps, axis=1, keepdims=True)
    return np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])


def best_of(core, points, durations, tube, seconds):
    """Least processor time of a plan [s], and the plan."""
    best, traj, began = np.inf, None, time.process_time()
    with using(core):
        while traj is None or time.process_time() - began < seconds:
            start = time.process_time()
            traj = minsnap.plan(points, durations=durations, corridor=tube)
            best = min(best, time.process_time() - start)
    return best, traj


def main():
    print("| problem | native core | Python core | rounds | contacts | cost native / Python |")
    print("|---|---|---|---|---|---|")
    problems = [(f"rectangle, {radius} m", RECTANGLE, [4, 2, 4, 2], radius) for radius in (1.0, 0.3, 0.01)]
    for legs in SIZES:
        points = course(legs, legs)
        times = np.linalg.norm(np.diff(points, axis=0), axis=1) / 1.5
        problems.append((f"{legs} random legs, 0.3 m", points, times, 0.3))
    for name, points, durations, radius in problems:
        tube = RoundTube(radius)
        fast, first = best_of("native", points, durations, tube, 0.5)
        slow, second = best_of("python", points, durations, tube, 1.0)
        if not (minsnap.certify(first, points, tube).ok and first.report.core == "native"):
            raise RuntimeError(f"{name}: not certified, or not by the native core")
        print(
            f"| {name} | {1e3 * fast:.2f} ms | {1e3 * slow:.1f} ms | {first.report.rounds}, {second.report.rounds} | "
            f"{first.report.rows}, {second.report.rows} | {first.cost() / second.cost():.7f} |"
        )


if __name__ == "__main__":
    main()

"""Many plans of many kinds, in processes: how long 20,000 of them take.

``python benchmarks/varied_plans.py [--count 20000] [--processes 2]``. Each problem is drawn from its seed: 3 to 10
waypoints in a room of 10 m, one of four kinds in turn: given durations, durations inside a tube, a total time, and the
shortest time within speed, acceleration and jerk, whose number of polynomials a leg is that of ``pieces="auto"``.
Printed are the wall time, the processor time of all processes, and how many of the plans were found and certified.
"""

from __future__ import annotations

import argparse
import os
import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np

import minsnap


def planned(seed: int) -> bool:
    """Plan the problem of a seed, and return whether its plan keeps what was asked for."""
    random = np.random.default_rng(seed)
    points = random.uniform((0.0, 0.0, 0.5), (10.0, 10.0, 3.0), (random.integers(3, 11), 3))
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    within = minsnap.Limits(*random.uniform((2.0, 4.0, 20.0), (8.0, 15.0, 80.0)))
    width = random.uniform(0.2, 0.6)
    kinds = (
        {"durations": lengths / 2.0},
        {"durations": lengths / 2.0, "corridor": width},
        {"total_time": float(lengths.sum()) / 2.0},
        {"limits": within},
    )
    asked = kinds[seed % len(kinds)]
    curve = minsnap.plan(points, **asked)
    held = {name: asked[name] for name in ("corridor", "limits") if name in asked}
    return minsnap.certify(curve, points, **held).ok


def worked(first: int, count: int) -> tuple[int, float]:
    """Plan the problems from one seed on; return how many plans are certified, and the processor time [s]."""
    begin = time.process_time()
    return sum(planned(seed) for seed in range(first, first + count)), time.process_time() - begin


def main() -> None:
    """Plan them all, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--processes", type=int, default=min(2, os.cpu_count() or 1))
    asked = parser.parse_args()
    starts = range(0, asked.count, 250)
    begin = time.monotonic()
    with ProcessPoolExecutor(asked.processes) as pool:
        found = list(pool.map(worked, starts, [min(250, asked.count - first) for first in starts]))
    held, processor = sum(good for good, _ in found), sum(spent for _, spent in found)
    print(f"{asked.count} plans, {held} certified, {asked.processes} processes")
    each = f"{1e3 * processor / asked.count:.2f} ms a plan"
    print(f"wall {time.monotonic() - begin:.1f} s, processor {processor:.1f} s, {each}")


if __name__ == "__main__":
    main()

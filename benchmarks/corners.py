"""Random corridors at the ends of what is asked: which are slow, refused or handed over by the native core.

``python benchmarks/corners.py [COUNT]``: degrees 7, 9 and 11, 1 to 5 pieces per leg, 2 to 10 legs in 2 to 4 dimensions,
durations of ratio 1 to 10,000, half-widths of 1e-4 to 0.1 mean lengths of a leg. One line for each problem that takes
over a second of processor time, is refused, or takes fallbacks; then how many there are of each kind.
"""

from __future__ import annotations

import sys
from collections import Counter
from time import process_time

import numpy as np

import minsnap
from minsnap.basics.arrays import FloatArray
from minsnap.errors import MinsnapError

SLOW = 1.0


def problem(seed: int) -> tuple[FloatArray, FloatArray, float, int, int]:
    """Return waypoints, durations, half-width, degree and pieces."""
    draw = np.random.default_rng(seed)
    legs, dim = int(draw.integers(2, 11)), int(draw.integers(2, 5))
    degree, pieces = 2 * int(draw.integers(4, 7)) - 1, int(draw.integers(1, 6))
    steps = draw.normal(size=(legs, dim))
    steps *= draw.uniform(1.0, 10.0, (legs, 1)) / np.linalg.norm(steps, axis=1)[:, None]
    exponents = draw.uniform(size=legs)
    exponents = (exponents - exponents.min()) / np.ptp(exponents)
    durations = 2.0 * 10.0 ** (draw.uniform(0.0, 4.0) * (exponents - 0.5))
    width = 10.0 ** draw.uniform(-4.0, -1.0) * float(np.linalg.norm(steps, axis=1).mean())
    return np.concatenate((np.zeros((1, dim)), np.cumsum(steps, axis=0))), durations, width, degree, pieces


def main(count: int) -> None:
    """Plan and certify all problems."""
    kinds, times = Counter[str](), []
    for seed in range(count):
        points, durations, width, degree, pieces = problem(seed)
        began = process_time()
        try:
            traj = minsnap.plan(points, durations, corridor=width, degree=degree, pieces=pieces)
            inside = minsnap.certify(traj, points, width).ok
            kind = " ".join((traj.report.core, *traj.report.rungs[-1:], "" if inside else "OUTSIDE")).strip()
        except MinsnapError as error:
            kind = f"refused: {error}"
        times.append(process_time() - began)
        kinds[kind] += 1
        if kind != "native" or times[-1] > SLOW:
            ratio = durations.max() / durations.min()
            print(
                f"{seed:4} {times[-1]:6.2f} s  degree {degree}, {pieces} x {len(durations)}, ratio {ratio:.0f}: {kind}"
            )
    print(f"{dict(kinds)}; processor time: median {np.median(times):.3f} s, most {max(times):.2f} s")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)

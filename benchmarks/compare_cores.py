"""Random plans by the native core and by the Python core: costs to 1e-6, and free curves to 1e-6 of a leg.

``python benchmarks/compare_cores.py [--count 20000] [--first 0]``. Problem by problem from seeds: degrees 3 to 11, one
to three coordinates, 1 to 8 legs, durations that differ by up to 30, from rest or moving, pinned, closed, half of them
in a tube. In a tube each core may give away a share of 1e-6, so that curves may differ by the root of it, and
more along directions that cost nothing: there the native cost decides, which must not be above the other.
"""

from __future__ import annotations

import argparse
from collections import Counter

import numpy as np

import minsnap
from minsnap.native.library import using

SAME = 1e-6
STATES = ("velocity", "acceleration", "jerk", "snap", "crackle")


def problem(seed):
    """Arguments of a plan."""
    rng = np.random.default_rng(seed)
    half, dim, legs = int(rng.integers(2, 7)), int(rng.integers(1, 4)), int(rng.integers(1, 9))
    points = np.cumsum(rng.normal(size=(legs + 1, dim)) * rng.uniform(0.3, 5.0, (legs + 1, 1)), axis=0)
    asked = {"durations": np.exp(rng.uniform(-1.7, 1.7, legs)), "degree": 2 * half - 1}
    if dim > 1 and rng.random() < 0.5:
        asked["corridor"] = float(np.exp(rng.uniform(np.log(0.01), np.log(2.0))))
    elif legs > 1 and rng.random() < 0.2:
        points[-1] = points[0]
        asked["closed"] = True
    elif rng.random() < 0.5:
        names = STATES[: half - 1]
        asked["start"] = {name: rng.normal(size=dim) for name in names}
        if legs > 1:
            asked["pins"] = {int(rng.integers(1, legs)): {"velocity": rng.normal(size=dim)}}
    return points, asked


def compare(seed):
    """What became of one problem, and how far the cores are apart in cost and in curve."""
    points, asked = problem(seed)
    native = minsnap.plan(points, **asked)
    if native.report.core != "native":
        return f"handed over: {native.report.handed_over}", 0.0, 0.0
    with using("python"):
        python = minsnap.plan(points, **asked)
    leg = np.linalg.norm(np.diff(points, axis=0), axis=1).mean()
    apart = np.abs(native.control_points - python.control_points).max() / leg
    costs = native.cost(), python.cost()
    relative = (costs[0] - costs[1]) / max(*costs, 1e-300)
    if "corridor" not in asked:
        alike = abs(relative) <= SAME and apart <= SAME
        return f"free: {'the same' if alike else 'apart'}", abs(relative), apart
    if abs(relative) <= 2.0 * SAME:
        return "in a tube: the same", abs(relative), apart
    return f"in a tube: {'native' if relative > 0.0 else 'Python'} cost apart above", abs(relative), apart


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--first", type=int, default=0)
    chosen = parser.parse_args()
    outcomes, worst = Counter(), {}
    for seed in range(chosen.first, chosen.first + chosen.count):
        try:
            outcome, relative, apart = compare(seed)
        except minsnap.MinsnapError as error:
            outcome, relative, apart = f"{type(error).__name__}", 0.0, 0.0
        outcomes[outcome] += 1
        before = worst.get(outcome, (0.0, 0.0))
        worst[outcome] = max(before[0], relative), max(before[1], apart)
        if "apart" in outcome:
            print(f"seed {seed}: costs apart by {relative:.1e}, curves by {apart:.1e} of a leg", flush=True)
    for outcome, count in outcomes.most_common():
        print(
            f"{count:7,} {outcome}; costs apart by at most {worst[outcome][0]:.1e}, curves by {worst[outcome][1]:.1e}"
        )


if __name__ == "__main__":
    main()

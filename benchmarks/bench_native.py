"""The native core through the public calls: plans without walls, corridors, evaluation, many plans, beside scipy.

``python benchmarks/bench_native.py [--large]``.  Least of many short runs, made in turn with the other program's, so
that a busy machine distorts ratios little.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from time import perf_counter

import numpy as np
from scipy.interpolate import make_interp_spline

import minsnap
from minsnap.native.library import describe

RECTANGLE = np.array([(0.0, 0.0, 1.0), (8.0, 0.0, 1.0), (8.0, 4.0, 1.0), (0.0, 4.0, 1.0), (0.0, 0.0, 1.0)])
TIMES = np.array([4.0, 2.0, 4.0, 2.0])


def least(calls, seconds=2.0):
    """Least duration of each call, all made in turn for some seconds [s]."""
    for call in calls:
        call()
    best = [float("inf")] * len(calls)
    end = perf_counter() + seconds
    while perf_counter() < end:
        for index, call in enumerate(calls):
            began = perf_counter()
            call()
            best[index] = min(best[index], perf_counter() - began)
    return best


def question(legs, seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(legs + 1, 3)), rng.uniform(0.5, 2.0, legs)


def septic(points, durations):
    """scipy's septic spline of the same knots, at rest at both ends: the same curve in B-form."""
    rest = [(order, np.zeros(3)) for order in (1, 2, 3)]
    return make_interp_spline(np.concatenate(([0.0], np.cumsum(durations))), points, k=7, bc_type=(rest, rest))


def plans(large):
    print("\n| legs | plan | make_interp_spline(k=7) | ours / scipy's |\n|---|---|---|---|")
    for legs in (10, 100, 1_000, 10_000, 100_000, *((1_000_000,) if large else ())):
        points, durations = question(legs)
        ours, theirs = least(
            [lambda p=points, t=durations: minsnap.plan(p, durations=t), lambda p=points, t=durations: septic(p, t)],
            3.0 if legs < 100_000 else 8.0,
        )
        print(f"| {legs:,} | {text(ours)} | {text(theirs)} | {ours / theirs:.2f} |")


def corridors():
    print("\n| rectangle, half-width [m] | plan | core |\n|---|---|---|")
    for width in (1.0, 0.3, 0.1, 0.01, 0.001, 0.0001):
        (took,) = least([lambda w=width: minsnap.plan(RECTANGLE, durations=TIMES, corridor=w)])
        core = minsnap.plan(RECTANGLE, durations=TIMES, corridor=width).report.core
        print(f"| {width:g} | {text(took)} | {core} |")


def evaluation():
    points, durations = question(10)
    traj = minsnap.plan(points, durations=durations)
    many = np.linspace(0.0, traj.duration, 100_000)
    print("\n| evaluation, 10 legs | one instant | 100,000 instants |\n|---|---|---|")
    for order in range(5):
        one, all_of_them = least([lambda o=order: traj(3.3, o), lambda o=order: traj(many, o)])
        print(f"| order {order} | {text(one)} | {text(all_of_them)} |")


def batches():
    rng = np.random.default_rng(0)
    points, durations = rng.normal(size=(100_000, 11, 3)), rng.uniform(0.5, 2.0, (100_000, 10))
    one, two = least([lambda n=n: minsnap.plan_many(points, durations, threads=n) for n in (1, 2)], 10.0)
    print(
        f"\n100,000 problems of 10 legs: {text(one)} on one thread, {text(two)} on two (efficiency {one / two / 2:.2f})"
    )


def processes():
    command = [sys.executable, "-m", "minsnap", "rect", "--corridor", "0.3", "--time", "12", "-o", "-"]
    (took,) = least([lambda: subprocess.run(command, check=True, capture_output=True)], 6.0)
    print(f"\n`minsnap rect --corridor 0.3 --time 12` as a process: {text(took)}")


def text(seconds):
    """A duration in the unit that suits it."""
    for unit, scale in (("s", 1.0), ("ms", 1e3)):
        if seconds * scale >= 1.0:
            return f"{seconds * scale:.3g} {unit}"
    return f"{seconds * 1e6:.3g} us"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--large", action="store_true", help="a million legs too")
    chosen = parser.parse_args()
    print(describe())
    plans(chosen.large)
    corridors()
    evaluation()
    batches()
    processes()

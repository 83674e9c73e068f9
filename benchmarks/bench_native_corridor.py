"""Certified corridors by the native core alone, and whole plans by both cores in the same run.

Run it by hand: ``python benchmarks/bench_native_corridor.py``.
"""

from __future__ import annotations

import time

import numpy as np
from problems import DURATIONS, RECTANGLE, walk

import minsnap
from minsnap.native.corridor import solve_corridor
from minsnap.native.library import using
from minsnap.native.status import Status
from minsnap.optimisation.native_solve import corridor_question
from minsnap.optimisation.task import Task


def question(points, durations, widths):
    """Rest to rest through tubes, as the native core is asked."""
    zero = np.zeros(points.shape)
    rest = {order: np.zeros(points.shape[1]) for order in (1, 2, 3)}
    pins = {0: rest, len(points) - 1: rest}
    walls = minsnap.Tube(widths).walls(points)
    task = Task(points, zero, zero, pins, 4, 3, False, 1, walls, "auto")
    return corridor_question(task, durations, task.units(durations))


def least(call, seconds=0.5):
    """Least wall time of a call [s] over as many repeats as fit."""
    best, began = np.inf, time.perf_counter()
    while time.perf_counter() - began < seconds:
        start = time.perf_counter()
        call()
        best = min(best, time.perf_counter() - start)
    return best


def row(name, points, durations, widths):
    asked = question(points, durations, widths)
    answer = solve_corridor(asked)
    assert answer is not None and answer.status is Status.DONE
    alone = least(lambda: solve_corridor(asked))
    whole = least(lambda: minsnap.plan(points, durations, corridor=widths))
    with using("python"):
        python = least(lambda: minsnap.plan(points, durations, corridor=widths))
    gap = (answer.cost - answer.bound) / answer.cost
    print(f"| {name} | {1e3 * alone:.3f} | {1e3 * whole:.2f} | {1e3 * python:.2f} | {answer.rounds} | {gap:.1e} |")


def main():
    print("| problem | native solver / ms | plan / ms | plan, Python core / ms | rounds | gap |")
    print("|---|---|---|---|---|---|")
    for width in (1.0, 0.3, 0.1, 0.01, 1e-3, 1e-4):
        row(f"rectangle, {width} m", RECTANGLE, DURATIONS, width)
    for legs in (10, 28, 100, 1000):
        row(f"{legs} random legs", *walk(legs))


if __name__ == "__main__":
    main()

"""The command that measures this machine: how long plans take here, and which budget a replan needs."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from statistics import median
from typing import TYPE_CHECKING, Annotated, Any

import typer

from minsnap.basics.storage.text_columns import labelled
from minsnap.cli import options
from minsnap.cli.command import command
from minsnap.cli.summary import as_json

if TYPE_CHECKING:
    from minsnap.basics.arrays import FloatArray
    from minsnap.limits.limits import Limits

SPARE = 1.5
"""Factor from the longest replan to the budget that is advised."""

MANY = 1000
"""Problems of one call of plan_many."""


@command()
def bench(
    *,
    seconds: Annotated[
        float, typer.Option("--seconds", metavar="S", min=0.0, max=600.0, help="Least time of each measurement [s].")
    ] = 0.5,
    json: options.Json = False,
) -> None:
    """Measure this machine: plans, corridors, limits, and the budget that a replan needs here.

    Each line is the median of repeated calls of one process with nothing else to do; the budget is half as long again
    as the longest of the replans.
    """
    results = dict(_measured(seconds))
    if json:
        print(as_json(results))
        return
    times = [(name, f"{1e3 * took:.3g} ms") for name, took in results.items() if isinstance(took, float)]
    print(labelled([*((name, text) for name, text in results.items() if isinstance(text, str)), *times]))


def _measured(seconds: float) -> Iterator[tuple[str, Any]]:
    """Yield name and seconds of each measurement; names of core and processors first."""
    import numpy as np

    import minsnap
    from minsnap.native.library import describe

    yield "core", f"{describe()}, {os.cpu_count()} processors"
    draw = np.random.default_rng(0)
    points = np.cumsum(draw.uniform((2.0, -1.5, -0.4), (4.0, 1.5, 0.4), (11, 3)), axis=0)
    limits, times, many = minsnap.Limits(speed=3.0, acceleration=6.0), np.full(10, 2.0), np.tile(points, (MANY, 1, 1))
    plan = minsnap.plan
    calls: dict[str, Callable[[], Any]] = {
        "plan, 10 legs": lambda: plan(points, durations=times),
        "plan in a corridor": lambda: plan(points, durations=times, corridor=0.3),
        "best split": lambda: plan(points, total_time=20.0, corridor=0.3),
        "within limits": lambda: plan(points, limits=limits, corridor=0.3),
        "with pieces=auto": lambda: plan(points, limits=limits, corridor=0.3, pieces="auto"),
        f"plan_many, {MANY}": lambda: minsnap.plan_many(many, durations=times),
    }
    for name, call in calls.items():
        yield name, median(_times(call, seconds))
    replans = list(_replans(points[:5], limits, seconds))
    yield "replan, 4 legs", median(replans)
    yield "longest replan", max(replans)
    yield "budget to give", SPARE * max(replans)


def _times(call: Callable[[], Any], seconds: float) -> list[float]:
    """Return how long each of at least three calls took [s], the first left out."""
    call()
    took: list[float] = []
    while sum(took) < seconds or len(took) < 3:
        began = time.perf_counter()
        call()
        took.append(time.perf_counter() - began)
    return took


def _replans(points: FloatArray, limits: Limits, seconds: float) -> Iterator[float]:
    """Yield how long replans took whose waypoints ahead have moved by up to 5 cm [s]."""
    import numpy as np

    import minsnap

    flown, draw = minsnap.plan(points, limits=limits, corridor=1.0), np.random.default_rng(1)
    total, count = 0.0, 0
    while total < seconds or count < 20:
        replanner = minsnap.Replanner(limits, 1.0)
        ahead = points[1:] + draw.uniform(-0.05, 0.05, points[1:].shape)
        change = replanner.replan(flown, 0.1 * flown.leg_breaks[1], ahead, min(1.0, 0.5 * flown.leg_breaks[1]))
        total, count = total + change.took, count + 1
        yield change.took

"""Given times of legs: when each vehicle is to be at its waypoints, and common knots that have these instants."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, bounded, numbers
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import EXACT
from minsnap.errors import FleetError, TimingError
from minsnap.fleet.fleet_task import FleetTask, knot_shares, one_each, ways_by_norm
from minsnap.limits.trapezoid import trapezoid_time

SAME = 1e-9
"""Instants are the same if they differ by less, in units of the flight time."""


def timed_legs(task: FleetTask, durations: Any, total_time: float | None) -> FleetTask:
    """Return the task in which vehicles are at their waypoints when the durations of their legs say.

    Its total time is the one given, or that of the vehicle whose legs and holds last longest.

    Raises
    ------
    FleetError
        If they are malformed.
    TimingError
        If a leg is shorter than its limits allow, or a vehicle takes longer than the total time.
    """
    sentence = f"durations must be a list of {len(task)}, of each vehicle the seconds of its legs, or None"
    entries = one_each(durations, len(task), sentence)
    instants = tuple(None if each is None else _instants(task, i, each) for i, each in enumerate(entries))
    ends = [0.0 if each is None else float(each[-1, 1]) for each in instants]
    last = int(np.argmax(ends))
    if ends[last] == 0.0:
        return task if total_time is None else replace(task, total_time=total_time)
    total = ends[last] if total_time is None else total_time
    if ends[last] > total * (1.0 + EXACT):
        text = f"the legs and holds of vehicle {last} last {ends[last]:g} s, and the total time is {total:g} s"
        raise TimingError(f"{text}: give it more, or the legs less")
    for each in instants:
        if each is not None:
            each[-1, 1] = total  # it stays at its goal
    return replace(task, instants=instants, total_time=total)


def _instants(task: FleetTask, vehicle: int, durations: Any) -> FloatArray:
    """Return when a vehicle arrives at its waypoints and leaves them, shape (n, 2) [s]."""
    legs, seconds = len(task.waypoints[vehicle]) - 1, numbers(durations)
    if seconds is None or seconds.shape != (legs,) or not (bounded(seconds) & (seconds > 0.0)).all():
        text = f"the durations of vehicle {vehicle} are {shown(durations)}"
        raise FleetError(f"{text}: give {legs} positive numbers [s], one a leg, or None", vehicle=vehicle)
    holds = task.holds_of(vehicle)
    for leg, least in enumerate(least_times_of_legs(task, vehicle)):
        if seconds[leg] < least * (1.0 - EXACT):
            text = (
                f"leg {leg} of vehicle {vehicle} is to last {seconds[leg]:g} s, and within its speed and acceleration"
            )
            raise TimingError(f"{text} it takes {least:.4g} s at least: give it more time")
    arrives = np.concatenate(([0.0], np.cumsum(holds[:-1] + seconds)))
    return np.column_stack((arrives, arrives + holds))


def least_times_of_legs(task: FleetTask, vehicle: int) -> list[float]:
    """Return a time that each leg of a vehicle takes at least, by its length, and rest at its ends [s]."""
    points, table = task.waypoints[vehicle], task.limit_table[vehicle]
    rests = task.holds_of(vehicle) > 0.0
    rests[[0, -1]] = not task.moves(vehicle), True
    least = []
    for leg, step in enumerate(np.diff(points, axis=0)):
        both = zip(ways_by_norm(step[None]), table[0].tolist(), table[1].tolist(), strict=True)
        least.append(max(_least(way, v, a, int(rests[leg]) + int(rests[leg + 1])) for way, v, a in both))
    return least


def _least(way: float, speed: float, acceleration: float, rests: int) -> float:
    """Return the least time along a way with so many ends at rest [s]: with one, half of that of twice the way."""
    if rests == 0:
        return trapezoid_time(way, speed, inf)
    return 0.5 * rests * trapezoid_time(2.0 / rests * way, speed, acceleration)


def with_knots(task: FleetTask, pieces: int) -> FleetTask:
    """Return the task with the instants of its vehicles among its knots, which else are about as dense as others."""
    given = [each.ravel() for each in task.instants if each is not None]
    if not given or task.total_time is None:
        return task
    fixed = np.unique(np.concatenate(given)) / task.total_time
    fixed = fixed[(fixed > SAME) & (fixed < 1.0 - SAME)]
    fixed = np.concatenate(([0.0], fixed[np.diff(fixed, prepend=0.0) > SAME], [1.0]))
    parts = (np.histogram(knot_shares(pieces)[1:-1], fixed)[0] + 1).tolist()
    ends = zip(fixed[:-1].tolist(), fixed[1:].tolist(), parts, strict=True)
    knots = [one + (two - one) / n * np.arange(n) for one, two, n in ends]
    return replace(task, shares=np.append(np.concatenate(knots), 1.0))

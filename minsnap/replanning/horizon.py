"""Long courses: the first legs are planned anew, the others stay as they are flown or wait for later."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from minsnap.corridors.constraint import Walls
from minsnap.corridors.margins import nearest_wall
from minsnap.limits.compliance import keeps
from minsnap.limits.limits import Limits
from minsnap.optimisation.task import Task
from minsnap.replanning.splice import divided
from minsnap.time_allocation.timing import AttachHeading
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Near:
    """The part of a task that is planned.

    Parameters
    ----------
    task : Task
        The first legs, up to rest or to where ``tail`` begins.
    guess : Trajectory or None
        What is flown on these legs.
    tail : Trajectory or None
        What is flown after them.
    """

    task: Task
    guess: Trajectory | None
    tail: Trajectory | None


def joined_with(curve: Trajectory, tail: Trajectory, finish: AttachHeading) -> Trajectory:
    """Fly a curve through the first legs, then the tail."""
    pieces = max(curve.pieces, tail.pieces)
    return finish(grouped(curve, pieces).then(grouped(tail, pieces)))


def near(
    task: Task, limits: Limits | None, legs: int | None, rest: Trajectory | None, flown: Trajectory | None
) -> Near:
    """Return the part of a task that is planned.

    Parameters
    ----------
    task : Task
    limits : Limits or None
    legs : int or None
        Number of legs; None for all.
    rest : Trajectory or None
        What is flown through all waypoints of the task; the plan then joins it, where it is inside and keeps the limits
        beyond the horizon.
    flown : Trajectory or None
        What is flown, wherever it passes: the first guess.
    """
    if legs is None or task.legs <= legs:
        return Near(task, flown, None)
    head = legs_of(flown, 0, legs) if flown is not None and flown.legs >= legs else None
    tail = None
    if rest is not None:
        tail = legs_of(rest, legs, rest.legs)
        nearest = nearest_wall(tail, walls_from(task.walls, legs, task.legs))
        outside = nearest is not None and nearest.value < 0.0
        tail = None if outside or not (limits is None or keeps(limits, tail)) else tail
    return Near(_first(task, legs, tail), head, tail)


def _first(task: Task, legs: int, tail: Trajectory | None) -> Task:
    state = {
        order: np.zeros(task.dim) if tail is None else np.asarray(tail(0.0, order)) for order in range(1, task.half)
    }
    lower, upper = task.lower[: legs + 1].copy(), task.upper[: legs + 1].copy()
    points = task.waypoints[: legs + 1].copy()
    lower[-1] = upper[-1] = 0.0
    if tail is not None:
        points[-1] = tail.control_points[0, 0]
    for array in (lower, upper, points):
        array.flags.writeable = False
    pins = {knot: pinned for knot, pinned in task.pins.items() if knot < legs} | {legs: state}
    regions = {knot: region for knot, region in task.regions.items() if knot < legs}
    walls = walls_from(task.walls, 0, legs)
    return replace(task, waypoints=points, lower=lower, upper=upper, pins=pins, walls=walls, regions=regions)


def legs_of(curve: Trajectory, first: int, last: int) -> Trajectory:
    """Return the polynomials of legs from ``first`` to before ``last``."""
    part = slice(first * curve.pieces, last * curve.pieces)
    return Trajectory(curve.control_points[part], curve.durations[part], pieces=curve.pieces)


def walls_from(walls: Sequence[Walls], first: int, last: int) -> list[Walls]:
    """Return the walls of legs from ``first`` to before ``last``, counted from the first of them."""
    rest = []
    for wall in walls:
        own = np.flatnonzero((wall.leg >= first) & (wall.leg < last))
        arrays = {entry.name: getattr(wall, entry.name) for entry in fields(wall)}
        chosen: dict[str, Any] = {name: value[own] for name, value in arrays.items() if isinstance(value, np.ndarray)}
        if len(own):
            rest.append(replace(wall, **{**chosen, "leg": wall.leg[own] - first}))
    return rest


def grouped(curve: Trajectory, pieces: int) -> Trajectory:
    """Return the same curve with more pieces on each leg: the first one of each is divided equally."""
    parts = pieces - curve.pieces + 1
    if parts == 1:
        return curve
    points, durations = [], []
    for leg in range(curve.legs):
        own = slice(leg * curve.pieces, (leg + 1) * curve.pieces)
        first, *rest = curve.control_points[own]
        points += [*divided(first, parts), *rest]
        durations += [np.repeat(curve.durations[own.start] / parts, parts), curve.durations[own][1:]]
    return Trajectory(np.stack(points), np.concatenate(durations), curve.yaw, pieces)

"""What is searched: the first legs of a long course, with walls moved inwards; later legs stay as flown, or wait.

Walls that are measured anew shift: a curve that was planned with some clearance from them stays inside.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.constraint import Walls
from minsnap.corridors.margins import nearest_wall
from minsnap.limits.compliance import keeps
from minsnap.limits.limits import Limits
from minsnap.optimisation.task import Task
from minsnap.replanning.splice import divided
from minsnap.time_allocation.timing import AttachHeading
from minsnap.trajectory.trajectory import Trajectory

SHARE = 1.0 - 1e-6
"""Of the room that a waypoint has: what is taken of it at most."""

MOST = 0.9
"""Of the radius of a ball: what is taken of it at most."""


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
    if tail is None:
        state = np.concatenate((task.waypoints[legs : legs + 1], np.zeros((task.half - 1, task.dim))))
    else:
        state = np.stack((tail.control_points[0, 0], *(tail(0.0, order) for order in range(1, task.half))))
    return part_of(task, 0, legs, {legs: state})


def part_of(task: Task, first: int, last: int, states: Mapping[int, FloatArray]) -> Task:
    """Return the legs of a task between two waypoints, with states (k, dim) prescribed at some of these."""
    points, lower, upper = (array[first : last + 1].copy() for array in (task.waypoints, task.lower, task.upper))
    pins = {knot - first: pinned for knot, pinned in task.pins.items() if first <= knot <= last}
    regions = {knot - first: region for knot, region in task.regions.items() if first <= knot <= last}
    for knot, state in states.items():
        points[knot - first], lower[knot - first], upper[knot - first] = state[0], 0.0, 0.0
        pins[knot - first] = {order: state[order] for order in range(1, task.half)}
        regions.pop(knot - first, None)
    for array in (points, lower, upper):
        array.flags.writeable = False
    walls = walls_from(task.walls, first, last)
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
        if len(own):
            rest.append(replace(wall.chosen(own), leg=wall.leg[own] - first))
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


def moved_inwards(walls: Sequence[Walls], points: FloatArray, clearance: float) -> list[Walls]:
    """Return walls on positions moved inwards, less where a waypoint of their leg has less room.

    Parameters
    ----------
    walls : sequence of Walls
    points : ndarray, shape (n, dim)
        Start and waypoints [m].
    clearance : float
        [m]
    """
    return [_moved(wall, points, clearance) if wall.order == 0 and clearance else wall for wall in walls]


def _moved(wall: Walls, points: FloatArray, clearance: float) -> Walls:
    ends = np.stack((points[wall.leg], points[wall.leg + 1]), axis=1)
    slack = wall.slack(ends).min(axis=1)
    size = clearance * np.linalg.norm(wall.slope, axis=1) if wall.flat else np.full(len(slack), clearance)
    inwards = np.minimum(SHARE * np.maximum(slack, 0.0), size)
    return replace(wall, radius=wall.radius - (inwards if wall.flat else np.minimum(inwards, MOST * wall.radius)))

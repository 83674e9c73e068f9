"""The last look at a plan before it leaves: every wall, limit, waypoint, pin, continuity and time that was asked for.

It judges the curve by its stored control points alone, with the proofs of ``certify``, whatever found it.  Of what the
solver believes it takes nothing over.  A margin that ``certify``'s own proof gave of this very curve and this very wall
counts as looked at: both are compared by identity, so that another curve, the same one at another speed, or a wall that
the solver did not know is proved anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import comb, perm

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import EXACT
from minsnap.certificate import continuity
from minsnap.corridors.constraint import Walls
from minsnap.corridors.knot_regions import STORED, Placement
from minsnap.corridors.margins import margin_to
from minsnap.corridors.passing import passing
from minsnap.limits.compliance import KEPT, use_from
from minsnap.limits.limits import Limits
from minsnap.optimisation.problem import Task
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.trajectory.trajectory import Trajectory


def fault(
    task: Task,
    curve: Trajectory,
    limits: Limits | None,
    times: FloatArray | float | None = None,
    limits_from: float = 0.0,
    solved: SolvedTask | None = None,
) -> str | None:
    """Return what a curve does not keep of all that was asked, or None.

    Parameters
    ----------
    task : Task
        What was asked; without walls, they are not looked at.
    curve : Trajectory
        With its yaw.
    limits : Limits, optional
    times : ndarray, shape (legs,), or float, optional
        Durations that were asked for, or their total [s].
    limits_from : float
        Instant from which the limits are asked for [s].
    solved : SolvedTask, optional
        Whose proved margins count where they are of this very curve and of these very walls.
    """
    return (
        _wrong_times(curve, times)
        or _wrong_waypoints(task, curve)
        or _wrong_knots(task, curve)
        or _left_walls(task.walls, curve, solved)
        or _broken_limits(limits, curve, limits_from)
    )


def _wrong_times(curve: Trajectory, times: FloatArray | float | None) -> str | None:
    if times is None:
        return None
    own: FloatArray | float = curve.duration if isinstance(times, float) else np.diff(curve.leg_breaks)
    apart = float(np.abs(np.subtract(own, times)).max())
    return (
        f"it takes {curve.duration:.9g} s, and other times were asked for" if apart > EXACT * curve.duration else None
    )


def _wrong_waypoints(task: Task, curve: Trajectory) -> str | None:
    if curve.legs != task.legs or curve.dim != task.dim:
        return f"it has {curve.legs} legs and {curve.dim} coordinates, and {task.legs} and {task.dim} were asked for"
    placement = Placement(task.waypoints, task.lower, task.upper, None, None, regions=task.regions)
    outside, passes = passing(curve, placement)
    return None if passes else f"it passes a waypoint {outside:.3g} m outside of where it may, or the wrong way"


def _wrong_knots(task: Task, curve: Trajectory) -> str | None:
    if len(curve.durations) > 1 and continuity(curve) < task.continuity:
        return f"its derivatives are continuous up to order {continuity(curve)}, and {task.continuity} was asked for"
    starts, ends, rounding = _end_derivatives(curve, max(task.half - 1, task.continuity if task.closed else 0))
    for waypoint, state in task.pins.items():
        for order, value in state.items():
            sides = [starts[waypoint, order]] if waypoint < task.legs else []
            sides += [ends[waypoint - 1, order]] if waypoint else []
            leg = slice(max(waypoint - 1, 0), waypoint + 1)
            allowed = rounding[leg, order].max() + EXACT * float(np.abs(value).max())
            if any(float(np.abs(side - value).max()) > allowed for side in sides):
                return f"derivative {order} at waypoint {waypoint} is not the one that is pinned there"
    if task.closed:
        for order in range(1, task.continuity + 1):
            if np.abs(ends[-1, order] - starts[0, order]).max() > rounding[[0, -1], order].max():
                return f"derivative {order} at the end of the lap is not that at its start"
    return None


def _end_derivatives(curve: Trajectory, highest: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return derivatives at both ends of the legs, (legs, highest + 1, dim), and what rounding may make of them."""
    degree, pieces = curve.degree, curve.pieces
    highest = min(highest, degree)
    differences = _differences(degree, highest)
    first, last = curve.control_points[::pieces], curve.control_points[pieces - 1 :: pieces]
    powers = np.arange(highest + 1.0)
    before = curve.durations[::pieces, None] ** -powers
    after = curve.durations[pieces - 1 :: pieces, None] ** -powers
    starts = (differences @ (first - first[:, :1])) * before[:, :, None]
    ends = (differences @ (last[:, ::-1] - last[:, -1:])) * (after * (-1.0) ** powers)[:, :, None]
    size = np.abs(curve.control_points).max()
    extent = np.maximum(np.ptp(first, axis=1).max(axis=1), np.ptp(last, axis=1).max(axis=1))[:, None]
    rounding = np.abs(differences).sum(axis=1) * np.maximum(before, after) * (EXACT * extent + STORED * size)
    return starts, ends, rounding


@cache
def _differences(degree: int, highest: int) -> FloatArray:
    """Return derivatives at the start of [0, 1] from control points: (highest + 1, degree + 1)."""
    found = np.zeros((highest + 1, degree + 1))
    for order in range(highest + 1):
        for j in range(order + 1):
            found[order, j] = perm(degree, order) * comb(order, j) * (-1) ** (order - j)
    return found


def _left_walls(walls: Sequence[Walls], curve: Trajectory, solved: SolvedTask | None) -> str | None:
    known = {} if solved is None else solved.proved_margins(curve)
    for wall in walls:
        if not len(wall.leg):
            continue
        margin = known.get(id(wall)) or margin_to(curve, wall)
        if not margin.value >= 0.0:
            return (
                f"it leaves the {wall.name} of leg {margin.leg} by {-margin.value:.3g} at {margin.instant:.4g} s"
                f"{f', in derivative {wall.order}' if wall.order else ''}"
            )
    return None


def _broken_limits(limits: Limits | None, curve: Trajectory, start: float) -> str | None:
    if limits is None:
        return None
    for used in use_from(limits, curve, start):
        if not used.fraction <= 1.0 + KEPT:
            return f"{used.name} reaches {used.value:.9g} at {used.instant:.4g} s where {used.limit:.9g} is allowed"
    return None

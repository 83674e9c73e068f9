"""Fleets that one curve decides: a single vehicle, and straight lines with one common profile."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.checks import DERIVATIVES
from minsnap.errors import InfeasibleError, SolverError
from minsnap.fleet.assignment import line_distance
from minsnap.fleet.fleet_task import FleetTask
from minsnap.limits.limits import Limits
from minsnap.planning.planner import plan
from minsnap.trajectory.trajectory import Trajectory

PIECES = 5
"""Polynomials of one curve unless the caller says otherwise: more than that fly hardly shorter from rest to rest."""


def one_curve(
    task: FleetTask, total_time: float | None, polish: float, pieces: int
) -> tuple[list[Trajectory], str] | None:
    """Return the trajectories of a fleet that one curve decides, and by which method; None for another fleet."""
    if any(task.holds_of(vehicle).any() for vehicle in range(len(task))):
        return None
    if len(task) + len(task.fixed) == 1:
        return [_single(task, total_time, polish, pieces)], "single"
    lines = _straight(task, total_time, polish, pieces)
    return None if lines is None else (lines, "straight")


def _single(task: FleetTask, total_time: float | None, polish: float, pieces: int) -> Trajectory:
    """Return the plan of the only vehicle."""
    walls = [each for each in (*task.corridors, task.room) if each is not None]
    start = {DERIVATIVES[order]: value for order, value in task.states[0].items()} or None
    arguments: dict[str, Any] = {"corridor": walls or None, "start": start, "avoid": task.avoid or None}
    arguments["limits"] = None if task.limits is None else task.limits[0]
    arguments["pieces"] = 1 if task.avoid else pieces  # legs are cut where they go around
    return _polished(task.waypoints[0], total_time, polish, arguments)


def _polished(points: npt.ArrayLike, total_time: float | None, polish: float, arguments: dict[str, Any]) -> Trajectory:
    """Plan for a total time; without one, for the shortest and a share of it more."""
    curve = plan(points, total_time=total_time, **arguments)
    if total_time is not None or polish == 0.0:
        return curve
    return plan(points, total_time=(1.0 + polish) * curve.duration, **arguments)


def _straight(task: FleetTask, total_time: float | None, polish: float, pieces: int) -> list[Trajectory] | None:
    """Return straight lines with one common profile; None where there are other conditions, or they meet.

    The profile is the curve of one vehicle on a line whose limits are the strictest of all, in units of their ways.
    """
    if task.through or not task.free_time or task.avoid or task.corridors or len(task) < 2:
        return None
    if task.separation is not None and not line_distance(task.starts, task.goals, task.separation).apart:
        return None
    way = np.abs(task.goals - task.starts)
    norms = np.sqrt((way * way).sum(axis=1))
    longest = float(norms.max())
    if longest == 0.0:
        return None
    ways = np.column_stack((way, norms, np.sqrt((way[:, :2] ** 2).sum(axis=1))))
    line = [(0.0, 0.0, 0.0), (longest, 0.0, 0.0)]
    try:
        limits = _strictest(task, ways, longest)
        profile = _polished(line, total_time, polish, {"limits": limits, "pieces": pieces})
    except (InfeasibleError, SolverError):
        return None
    return _along(task, profile, longest)


def _strictest(task: FleetTask, ways: np.ndarray, longest: float) -> Limits | None:
    """Return limits of progress along the longest line that keep those of every vehicle."""
    if task.limits is None:
        return None
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = np.where(ways[:, None] > 0.0, task.limit_table / ways[:, None], np.inf)
    least = longest * shares.min(axis=(0, 2))
    speed, acceleration, jerk, snap = (float(value) if np.isfinite(value) else None for value in least)
    return Limits(speed, acceleration, jerk, snap)


def _along(task: FleetTask, profile: Trajectory, longest: float) -> list[Trajectory]:
    share = profile.control_points[:, :, 0] / longest
    share[0, 0], share[-1, -1] = 0.0, 1.0
    count = len(profile.durations)
    lines = []
    for start, goal in zip(task.starts, task.goals, strict=True):
        points = start + share[:, :, None] * (goal - start)
        points[-1, -1] = goal
        lines.append(Trajectory(points, profile.durations, pieces=count))
    return lines

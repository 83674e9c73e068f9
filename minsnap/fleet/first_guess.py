"""Fleets that one curve decides, and curves from which the joint search begins.

Curves of a fleet are arrays (m, pieces + 1, 4, 3): at each knot the derivatives 0 to 3, times h^q with the mean
duration h of a piece, so that they are lengths and do not change when all of time is stretched.
"""

from __future__ import annotations

from contextlib import nullcontext, suppress
from itertools import pairwise
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray
from minsnap.basics.checks import DERIVATIVES
from minsnap.basics.tolerances import EXACT
from minsnap.errors import InfeasibleError, SolverError, TimingError
from minsnap.fleet.assignment import line_distance
from minsnap.fleet.common_clock import at_rest_after
from minsnap.fleet.fleet_task import FleetTask
from minsnap.limits.limits import Limits
from minsnap.planning.planner import plan
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory

RAMP = 0.15
"""Share of the time in which the profile of the straight lines speeds up, and slows down."""


def uniform(count: int, seed: int) -> FloatArray:
    """Return numbers from -1 to 1 that only the seed and their place decide: splitmix64 of a counter."""
    with np.errstate(over="ignore"):
        x = (np.arange(count, dtype=np.uint64) + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
        x += np.uint64(seed % 2**63) * np.uint64(0xD1342543DE82EF95)
        x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        x ^= x >> np.uint64(31)
    return (x >> np.uint64(11)).astype(np.float64) * 2.0**-52 - 1.0


def powers(h: float) -> FloatArray:
    """Return the powers 0 to 3, by products: those of a mathematical library differ between machines."""
    return np.array([1.0, h, h * h, h * h * h])


def profile(s: FloatArray) -> FloatArray:
    """Progress from 0 to 1 and its derivatives at knots, shape (pieces + 1, 4): speed rises and falls in ramps."""
    # The speed is the smooth step 10 x^3 - 15 x^4 + 6 x^5 in either ramp, where x goes from 0 to 1, and 1 between;
    # `way` is its integral. Half a ramp is lost at either end, so all is divided by 1 - RAMP to come to 1. The second
    # half is the first one backwards.
    x = np.minimum(np.minimum(s, 1.0 - s) / RAMP, 1.0)
    rises, inside = np.where(s <= 0.5, 1.0, -1.0), x < 1.0
    cube = x * x * x
    way = RAMP * cube * x * (2.5 - 3.0 * x + x * x) + np.maximum(np.minimum(s, 1.0 - s) - RAMP, 0.0)
    speed = cube * (10.0 - 15.0 * x + 6.0 * x * x)
    slope = np.where(inside, 30.0 * x * x * (1.0 - x) * (1.0 - x) / RAMP, 0.0)
    bend = np.where(inside, 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / (RAMP * RAMP), 0.0)
    scaled = np.stack([way, speed, rises * slope, bend], axis=1) / (1.0 - RAMP)
    scaled[s > 0.5, 0] = 1.0 - scaled[s > 0.5, 0]
    return np.asarray(scaled * powers(1.0 / (len(s) - 1)))


def bump(s: FloatArray) -> FloatArray:
    """Return 16 s^2 (1 - s)^2 and its derivatives at knots, shape (pieces + 1, 4), at rest at both ends."""
    rest = 1.0 - s
    rows = [s * s * rest * rest, 2.0 * s * rest * (rest - s), 2.0 - 12.0 * s * rest, -12.0 + 24.0 * s]
    values = 16.0 * np.stack(rows, axis=1) * powers(1.0 / (len(s) - 1))
    values[[0, -1], 1:] = 0.0
    return np.asarray(values)


def straight(starts: FloatArray, goals: FloatArray, shares: FloatArray) -> FloatArray:
    """Straight lines with one common profile."""
    curves = profile(shares)[None, :, :, None] * (goals - starts)[:, None, None, :]
    curves[:, :, 0] += starts[:, None]
    curves[:, -1, 0] = goals
    return np.asarray(curves)


def guess(task: FleetTask, pieces: int, seed: int, kind: int) -> FloatArray:
    """Return first curves: kind 0 bends as suits the fleet, 1 the other way, 2 and 3 twice as far, 4 and 5 thrice."""
    curves = np.concatenate([_through(task, vehicle, pieces) for vehicle in range(len(task))])
    flat = bool(np.ptp(np.concatenate((task.starts, task.goals))[:, 2]) <= 0.2 * np.ptp(task.starts[:, :2]))
    offsets = _offsets(task, flat if kind % 2 == 0 else not flat, 1 + kind // 2, seed)
    offsets[[task.is_pinned(vehicle) for vehicle in range(len(task))]] = 0.0  # these are where they are on their way
    return np.asarray(curves + bump(task.shares_of(pieces))[None, :, :, None] * offsets[:, None, None, :])


def _offsets(task: FleetTask, bends: bool, times: int, seed: int) -> FloatArray:
    noise = uniform(3 * len(task), seed).reshape(-1, 3)
    if not bends:
        return 0.3 * times * task.length * noise
    way = task.goals - task.starts
    length = np.sqrt((way * way).sum(axis=1))
    mean = max(float(length.mean()), 1e-9)
    share = min(0.3, max(0.05, 1.2 * len(task) * task.length / (2.0 * np.pi * mean))) * times
    right = np.stack([way[:, 1], -way[:, 0], np.zeros(len(way))], axis=1) * share
    right[:, 2] += 0.1 * task.length * noise[:, 2]
    return np.asarray(right + 0.02 * task.length * noise)


def _through(task: FleetTask, vehicle: int, pieces: int) -> FloatArray:
    """Return curves of one vehicle, (1, pieces + 1, 4, 3), through its waypoints at knots of their own."""
    points, knots = task.waypoints[vehicle], task.knots_of(vehicle, pieces)
    if not task.is_pinned(vehicle):
        return straight(points[:1], points[1:], task.shares_of(pieces))
    instants, data = task.shares_of(pieces) * pieces, np.zeros((pieces + 1, 4, 3))
    ends = np.unique([0, *np.flatnonzero(knots[:, 1] > knots[:, 0]), len(points) - 1])
    for one, two in pairwise(ends.tolist()):  # from rest to rest
        first, last, here = knots[one, 1], knots[two, 0], knots[one : two + 1].copy()
        here[0, 0], here[-1, 1] = first, last
        curve = plan(points[one : two + 1], durations=np.diff(instants[here[:, 0]]))
        passed = np.minimum(instants[first : last + 1] - instants[first], curve.duration)
        data[first : last + 1] = curve.states(passed, 4)
    for (arrives, leaves), point in zip(knots, points, strict=True):
        data[arrives : leaves + 1, 0] = point
        data[arrives : leaves + 1, 1:] *= leaves == arrives
    return data[None]


def frozen(fixed: Path, time: float, shares: FloatArray) -> FloatArray:
    """Return the curve of a vehicle that flies as it does, on the knots of the others: (pieces + 1, 4, 3)."""
    curve, instants = fixed.as_trajectory(), shares * time
    scales = enumerate(powers(time / (len(shares) - 1)))
    return np.stack([at_rest_after(curve, instants, order) * scale for order, scale in scales], axis=1)


PIECES = 5
"""Polynomials of the profile of straight lines unless the caller says otherwise: more fly hardly shorter."""


def one_curve(task: FleetTask, polish: float, pieces: int | str) -> tuple[list[Trajectory], str] | None:
    """Return the trajectories of a fleet that one curve decides, and by which method; None for another fleet."""
    if any(task.holds_of(vehicle).any() for vehicle in range(len(task))):
        return None
    if len(task) + len(task.fixed) == 1:
        with suppress(InfeasibleError, TimingError) if task.instants else nullcontext():
            return [_single(task, polish, pieces)], "single"
    if task.instants:
        return None
    lines = _straight(task, polish, pieces if isinstance(pieces, int) else PIECES)
    return None if lines is None else (lines, "straight")


def _single(task: FleetTask, polish: float, pieces: int | str) -> Trajectory:
    """Return the plan of the only vehicle."""
    walls = [each for each in (*task.corridors, task.room) if each is not None]
    start = {DERIVATIVES[order]: value for order, value in task.states[0].items()} or None
    arguments: dict[str, Any] = {"corridor": walls or None, "start": start, "avoid": task.avoid or None}
    arguments["limits"] = None if task.limits is None else task.limits[0]
    arguments["pieces"] = 1 if task.avoid else pieces  # legs are cut where they go around
    instants = task.instants_of(0)
    if instants is not None and instants[-1, 0] >= (task.total_time or 0.0) * (1.0 - EXACT):
        return plan(task.waypoints[0], durations=np.diff(instants[:, 0]), **arguments)
    return _polished(task.waypoints[0], task.total_time, polish, arguments)


def _polished(points: ArrayLike, total_time: float | None, polish: float, arguments: dict[str, Any]) -> Trajectory:
    """Plan for a total time; without one, for the shortest and a share of it more."""
    curve = plan(points, total_time=total_time, **arguments)
    if total_time is not None or polish == 0.0:
        return curve
    return plan(points, total_time=(1.0 + polish) * curve.duration, **arguments)


def _straight(task: FleetTask, polish: float, pieces: int) -> list[Trajectory] | None:
    """Return straight lines with one common profile; None where there are other conditions, or they meet.

    The profile is the curve of one vehicle on a line whose limits are the strictest of all, in units of their ways.
    """
    through = any(len(points) > 2 for points in task.waypoints)
    if through or not task.free_time or task.avoid or task.corridors or len(task) < 2:
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
        profile = _polished(line, task.total_time, polish, {"limits": limits, "pieces": pieces})
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

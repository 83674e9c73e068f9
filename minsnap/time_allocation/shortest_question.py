"""What is question_of of the native search for the shortest time: waypoints, walls and limits of a task in its form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray
from minsnap.basics.checks import SHORTEST
from minsnap.corridors.constraint import Walls
from minsnap.corridors.regions import KnotRegion
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.native.shortest_time import ConeSets, Guess, ShortestQuestion
from minsnap.optimisation.solve import solve
from minsnap.optimisation.task import Task
from minsnap.time_allocation.initial_guess import guessed_lengths, norm_limits
from minsnap.time_allocation.instant_limits import instant_limits
from minsnap.time_allocation.recovery import state_at
from minsnap.trajectory.heading import Heading
from minsnap.trajectory.trajectory import Trajectory

DIVISIONS = (3, 2)
"""Parts into which pieces are divided one time after another where their number is left to the search."""

WORTHWHILE = 0.08
"""Relative gain by which pieces are divided once more: that gains about a sixteenth of it, here half a percent."""

INWARD = 2e-4
"""Share of their widths by which walls are moved inwards."""

DIRECTED = 0.1
"""Share of the weight below which thrust is taken to have no direction: there a small change turns it by any angle."""


def question_of(
    task: Task, limits: Limits, refine: bool, heading: Heading | None = None, guess: Guess | None = None
) -> ShortestQuestion:
    """Return the question for a task within limits.

    Parameters
    ----------
    task : Task
        Without walls of limits.
    limits : Limits
    refine : bool
        Whether the search chooses the number of pieces.
    heading : Heading, optional
        Of any curve of the task, where limits depend on it.
    guess : Guess, optional
        To begin from.
    """
    pinned, free, turned = _waypoints(task)
    sets = [_sets(wall) for wall in _walls(task, limits)]
    sets += _least_thrust(task, limits)
    sets += [one for waypoint, region in _regions(task).items() for one in _region_sets(task, waypoint, region)]
    parts = DIVISIONS if refine else () if task.pieces == 1 else (task.pieces,)
    lengths = guessed_lengths(task)
    return ShortestQuestion(
        pinned,
        free,
        lengths,
        norm_limits(limits),
        [one for one in sets if len(one.place)],
        instant_limits(limits, heading, lengths),
        parts if guess is None or guess.pieces < task.pieces or refine and guess.least is None else (),
        task.closed,
        not scales(task, limits),
        WORTHWHILE,
        0.0 if task.touches.any() else INWARD,
        guess=guess,
        turned=turned,
    )


def coasting_guess(task: Task, times: FloatArray) -> Guess:
    """Return the curve of least cost through all waypoints that goes on as a moving start does, and so ends.

    From rest at every waypoint a search that begins in motion finds a loop back to a waypoint that is close ahead.

    Parameters
    ----------
    times : ndarray, shape (legs,)
        Of legs from rest to rest [s].
    """
    durations = times.copy()
    for leg, waypoint in ((0, 0), (task.legs - 1, task.legs)):
        speed = float(np.linalg.norm(task.pins.get(waypoint, {}).get(1, 0.0)))
        if speed > 0.0:
            durations[leg] = min(durations[leg], max(float(task.lengths[leg]) / speed, SHORTEST))
    pinned = np.zeros(task.waypoints.shape)
    free = replace(task, pieces=1, walls=(), regions={}, lower=pinned, upper=pinned, continuity=task.half - 1)
    curve = solve(free, durations).trajectory
    return Guess(1, durations, state_at(curve, curve.breaks, task.half), 1.0)


def scales(task: Task, limits: Limits) -> bool:
    """Whether every curve keeps the limits that is flown slowly enough: a slow thrust may turn faster in free fall."""
    return task.still and limits.body_rate is None and not isinstance(limits, VehicleLimits)


def guess_of(curve: Trajectory, task: Task, slower: float = 1.0) -> Guess | None:
    """Return a curve through the same legs as a guess; None where its pieces are others than those question_of for."""
    if curve.legs != task.legs or task.pieces not in (1, curve.pieces):
        return None
    instants = curve.leg_breaks if task.pieces == 1 else curve.breaks
    return Guess(task.pieces, np.diff(instants), state_at(curve, instants, task.half), slower)


def _waypoints(task: Task) -> tuple[FloatArray, BoolArray, FloatArray | None]:
    """Return derivatives that are pinned, which ones are free, and the axes of positions in slanted planes."""
    pinned = np.zeros((task.legs + 1, task.half, task.dim))
    pinned[:, 0] = task.waypoints
    for waypoint, state in task.pins.items():
        for order, value in state.items():
            pinned[waypoint, order] = value
    free = task.free[:: task.pieces, : task.half].copy()
    planes = {k: r.plane for k, r in task.regions.items() if r.plane is not None}
    if not planes:
        return pinned, free, None
    turned = np.zeros((task.legs + 1, task.dim, task.dim))
    for waypoint, normal in planes.items():
        turned[waypoint] = _axes(normal)
        pinned[waypoint, 0] = (turned[waypoint] * task.waypoints[waypoint][:, None]).sum(axis=0)
        free[waypoint, 0] = np.arange(task.dim) > 0
    return pinned, free, turned


def _axes(normal: FloatArray) -> FloatArray:
    """Orthogonal axes of which the first is along a unit normal: a reflection (A. S. Householder, 1958)."""
    mirror = normal.copy()
    mirror[0] += 1.0 if normal[0] >= 0.0 else -1.0
    return np.asarray(np.eye(len(normal)) - 2.0 / (mirror * mirror).sum() * mirror[:, None] * mirror)


def _walls(task: Task, limits: Limits) -> list[Walls]:
    """Walls of the corridor and of the limits, without those that are stricter than the limit or leave out the drag."""
    other = ("min_thrust", "max_thrust", "tilt") if limits.medium.drags else ("min_thrust",) if _bounded(limits) else ()
    return [*task.walls, *(wall for wall in limits.walls(task.waypoints) if wall.name not in other)]


def _bounded(limits: Limits) -> bool:
    """Whether accelerations are bounded, so that no curve leaps through free fall between instants."""
    return limits.max_thrust is not None or limits.acceleration is not None


def _sets(cones: Walls) -> ConeSets:
    return ConeSets(cones.leg, cones.matrix, cones.anchor, cones.slope, cones.radius, cones.width, cones.order)


def _least_thrust(task: Task, limits: Limits) -> list[ConeSets]:
    """Accelerations no nearer to free fall than the least thrust."""
    turned = limits.body_rate is not None or isinstance(limits, VehicleLimits)
    directed = turned and (limits.min_thrust is None or limits.min_thrust < DIRECTED)
    least = DIRECTED if directed else limits.min_thrust if _bounded(limits) else None
    if least is None or limits.medium.drags:
        return []
    legs, radius = task.legs, np.full(task.legs, least * limits.gravity)
    width = np.full(task.legs, limits.gravity) if directed else radius
    fall = np.tile((0.0, 0.0, -limits.gravity), (legs, 1))
    matrix, slope = np.tile(np.eye(3), (legs, 1, 1)), np.zeros((legs, 3))
    return [ConeSets(np.arange(legs), matrix, fall, slope, radius, width, 2, outside=True)]


def _regions(task: Task) -> dict[int, KnotRegion]:
    """Regions of all waypoints that are free, boxes among them; of a lap only that of its first waypoint."""
    regions = dict(task.own_regions)
    for waypoint in np.flatnonzero((task.upper > task.lower).any(axis=1)).tolist():
        if waypoint not in regions and not (task.closed and waypoint == task.legs):
            lower, upper = task.lower[waypoint], task.upper[waypoint]
            regions[waypoint] = KnotRegion(lower, upper, np.inf, np.zeros((0, task.dim)), np.zeros(0), what="box")
    return regions


def _region_sets(task: Task, waypoint: int, region: KnotRegion) -> list[ConeSets]:
    """Return the flat sides, the ball and the crossing of a region."""
    center = task.waypoints[waypoint]
    axes = np.eye(task.dim)[region.upper > region.lower]
    normals, bounds = region.normals.reshape(-1, task.dim), region.bounds
    if np.isinf(region.radius):
        sides = region.upper > region.lower
        normals = np.concatenate((axes, -axes, normals))
        bounds = np.concatenate((region.upper[sides], -region.lower[sides], bounds))
    width = float((region.upper - region.lower).max()) / 2.0
    sets = [_flat(waypoint, normals, bounds, width, center)]
    if np.isfinite(region.radius):
        radius = np.array([region.radius])
        ball = np.array([waypoint]), np.eye(task.dim)[None], center[None], np.zeros((1, task.dim)), radius, radius
        sets.append(ConeSets(*ball, 0, at_knots=True))
    if region.crossing is not None:
        sets.append(_flat(waypoint, -region.crossing[None], np.zeros(1), 1.0, np.zeros(task.dim), order=1))
    return sets


def _flat(
    waypoint: int, normals: FloatArray, bounds: FloatArray, width: float, anchor: FloatArray, order: int = 0
) -> ConeSets:
    count, dim = normals.shape
    none, size = np.zeros((count, 0, dim)), np.full(count, width)
    return ConeSets(
        np.full(count, waypoint), none, np.tile(anchor, (count, 1)), -normals, bounds, size, order, at_knots=True
    )

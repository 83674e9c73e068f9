"""The shortest time by the native interior point: the question in its form, and its answer made certain.

The native search keeps walls and limits at instants and at the peaks that it sees between them.  Here exact extrema
have the last word: a curve outside a wall is searched again with the walls moved further inwards, and the time is
scaled until the most used limit is just kept.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.constraint import Cones, Walls
from minsnap.corridors.regions import KnotRegion
from minsnap.limits.compliance import KEPT, largest_use
from minsnap.limits.kinds import KIND
from minsnap.limits.limits import Limits
from minsnap.native.library import core
from minsnap.native.shortest_time import ConeSets, ShortestFound, ShortestQuestion, search_shortest
from minsnap.optimisation.optimum import Optimum
from minsnap.optimisation.problem import Task
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.time_allocation.initial_guess import guessed_lengths, norm_limits
from minsnap.time_allocation.time_stretch import nearby_factor, touching_factor
from minsnap.time_allocation.timing import Finish
from minsnap.trajectory.cut_pieces import LONGEST_PIECE
from minsnap.trajectory.trajectory import Trajectory

DIVISIONS = (3, 2)
"""Parts into which pieces are divided one time after another where their number is left to the search."""

WORTHWHILE = 0.08
"""Relative gain by which pieces are divided once more: that gains about a sixteenth of it, here half a percent."""

INWARDS = (2e-4, 2e-3)
"""Shares of their widths by which walls are moved inwards, one after the other."""

FAR = 1e-3
"""Share by which the certified curve may be slower than the one found; beyond, the search did not see a limit."""

GRAIN = 2.0**32
"""Factors on time are rounded up to its fractions, so that the last bits of exact extrema do not decide a plan."""

ORDERS = 4
"""Highest derivative that walls may bound."""

MEASURED = ("norm", "horizontal", "upwards", "downwards", "vertical", "thrust", "least_thrust", "tilt")
"""What the limits may measure that the native search knows."""

BOUNDING = ("acceleration", "max_thrust")
"""One of these must be given beside a least thrust, so that no curve leaps through free fall between instants."""

ENDING = ("speed", "jerk", "snap", *BOUNDING)
"""Limits of which one must be given: each bounds the time of every path."""


def serves(task: Task, limits: Limits) -> bool:
    """Whether the native search knows everything that a task and its limits ask for."""
    given = limits.given()
    known = type(limits) is Limits and all(KIND[name].measure in MEASURED for name in given)
    bounded = any(name in given for name in (ENDING if limits.min_thrust is None else BOUNDING))
    plain = (
        task.half == 4
        and (not task.closed or task.legs > 1)
        and task.dim in (2, 3)
        and task.continuity >= task.half - 1
    )
    regions = all(region.plane is None for region in task.regions.values())
    orders = all(wall.order <= ORDERS for wall in task.walls)
    return core().name == "native" and known and bounded and plain and regions and orders and not task.touches.any()


def interior_search(
    task: Task, limits: Limits, finish: Finish, refine: bool, poll: Callable[[float], bool]
) -> SolvedTask | None:
    """Return a certified plan; None where the native search finds none, or not one that can be certified nearby.

    Parameters
    ----------
    task : Task
        Without walls of limits, such that it ``serves``.
    limits : Limits
    finish : callable
        Gives a curve its yaw.
    refine : bool
        Whether the search chooses the number of pieces.
    poll : callable
        Called with the total time before every iteration [s]; True ends the search.
    """
    question = asked(task, limits, refine)
    for inwards in INWARDS:
        found = search_shortest(replace(question, inwards=inwards), poll)
        if found is None or not found.durations.max() <= LONGEST_PIECE:
            return None
        solved = _solved(task, found, 1.0)
        if solved.inside or found.stopped:
            return _within(task, limits, finish, found, solved)
    return None


def _within(task: Task, limits: Limits, finish: Finish, found: ShortestFound, solved: SolvedTask) -> SolvedTask | None:
    """Fly the same path at the speed at which the most used limit is just kept, if that is about the one found."""
    if not solved.inside:
        return None
    if not task.still:
        return solved if largest_use(limits, finish(solved.trajectory)) <= 1.0 + KEPT else None
    curve = finish(solved.trajectory)
    factor = float(np.ceil(_slowdown(limits, curve) * GRAIN)) / GRAIN
    return _solved(task, found, factor) if factor <= 1.0 + FAR or found.stopped else None


def _slowdown(limits: Limits, curve: Trajectory) -> float:
    """Factor on time at which the most used limit is just kept; it divides a derivative by its power of that order."""
    orders = [KIND[name].order for name in limits.given()]
    if all(orders):
        used = limits.utilisation(curve)
        return max(float(entry.fraction ** (1.0 / order)) for entry, order in zip(used, orders, strict=True))
    return nearby_factor(limits, curve) or touching_factor(limits, curve)


def _solved(task: Task, found: ShortestFound, factor: float) -> SolvedTask:
    """Wrap what was found, flown more slowly by a factor, as a solved task."""
    pieces = len(found.durations) // task.legs
    task, durations = replace(task, pieces=pieces), found.durations * factor
    units = task.units(durations)
    scale, knots = 1.0, np.empty_like(found.knots)
    for order in range(task.half):
        knots[:, order] = found.knots[:, order] * (scale / units.of_order(order))
        scale /= factor
    knots[:, 0] = (found.knots[:, 0] - task.positions) / units.length
    optimum = Optimum(knots, None, np.zeros(0), found.iterations, "interior point", core="native", points=found.points)
    return SolvedTask(task, durations, units, optimum)


def asked(task: Task, limits: Limits, refine: bool) -> ShortestQuestion:
    """Return the question in the form of the native search."""
    coarse = replace(task, pieces=1)
    pinned = np.zeros((task.legs + 1, task.half, task.dim))
    pinned[:, 0] = task.waypoints
    for waypoint, state in task.pins.items():
        for order, value in state.items():
            pinned[waypoint, order] = value
    sets = [_sets(wall.cones) for wall in _walls(task, limits)]
    sets += _least_thrust(task, limits)
    sets += [one for waypoint, region in _regions(task).items() for one in _region_sets(task, waypoint, region)]
    parts = DIVISIONS if refine else () if task.pieces == 1 else (task.pieces,)
    lengths = guessed_lengths(task)
    given = pinned, coarse.free[:, : task.half], lengths, norm_limits(limits), [one for one in sets if len(one.place)]
    return ShortestQuestion(*given, parts, task.closed, not task.still, WORTHWHILE, INWARDS[0])


def _walls(task: Task, limits: Limits) -> list[Walls]:
    """Walls of the corridor and of the limits, but for a least thrust, whose wall is stricter than the limit."""
    return [*task.walls, *(wall for wall in limits.walls(task.waypoints) if wall.name != "min_thrust")]


def _sets(cones: Cones) -> ConeSets:
    return ConeSets(cones.leg, cones.matrix, cones.anchor, cones.slope, cones.radius, cones.width, cones.order)


def _least_thrust(task: Task, limits: Limits) -> list[ConeSets]:
    """Accelerations no nearer to free fall than the least thrust."""
    if limits.min_thrust is None:
        return []
    legs, radius = task.legs, np.full(task.legs, limits.min_thrust * limits.gravity)
    fall = np.tile((0.0, 0.0, -limits.gravity), (legs, 1))
    matrix, slope = np.tile(np.eye(3), (legs, 1, 1)), np.zeros((legs, 3))
    return [ConeSets(np.arange(legs), matrix, fall, slope, radius, radius, 2, outside=True)]


def _regions(task: Task) -> dict[int, KnotRegion]:
    """Regions of all waypoints that are free, boxes among them; of a lap only that of its first waypoint."""
    found = dict(task.own_regions)
    for waypoint in np.flatnonzero((task.upper > task.lower).any(axis=1)).tolist():
        if waypoint not in found and not (task.closed and waypoint == task.legs):
            lower, upper = task.lower[waypoint], task.upper[waypoint]
            found[waypoint] = KnotRegion(lower, upper, np.inf, np.zeros((0, task.dim)), np.zeros(0), what="box")
    return found


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
    found = [_flat(waypoint, normals, bounds, width, center)]
    if np.isfinite(region.radius):
        radius = np.array([region.radius])
        ball = np.array([waypoint]), np.eye(task.dim)[None], center[None], np.zeros((1, task.dim)), radius, radius
        found.append(ConeSets(*ball, 0, at_knots=True))
    if region.crossing is not None:
        found.append(_flat(waypoint, -region.crossing[None], np.zeros(1), 1.0, np.zeros(task.dim), order=1))
    return found


def _flat(
    waypoint: int, normals: FloatArray, bounds: FloatArray, width: float, anchor: FloatArray, order: int = 0
) -> ConeSets:
    count, dim = normals.shape
    none, size = np.zeros((count, 0, dim)), np.full(count, width)
    return ConeSets(
        np.full(count, waypoint), none, np.tile(anchor, (count, 1)), -normals, bounds, size, order, at_knots=True
    )

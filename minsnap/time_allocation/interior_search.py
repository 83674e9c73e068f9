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
from minsnap.corridors.constraint import Walls
from minsnap.corridors.regions import KnotRegion
from minsnap.limits.compliance import KEPT, largest_use
from minsnap.limits.kinds import KIND
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.native.library import core
from minsnap.native.shortest_time import ConeSets, ShortestFound, ShortestQuestion, search_shortest
from minsnap.optimisation.optimum import Optimum
from minsnap.optimisation.problem import Task
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.time_allocation.initial_guess import guessed_lengths, norm_limits, stop_and_go_times
from minsnap.time_allocation.instant_limits import instant_limits
from minsnap.time_allocation.time_stretch import nearby_factor, touching_factor
from minsnap.time_allocation.timing import Finish
from minsnap.trajectory.cut_pieces import LONGEST_PIECE
from minsnap.trajectory.heading import ConstantHeading, Heading
from minsnap.trajectory.look_at import LookAtHeading
from minsnap.trajectory.trajectory import Trajectory

DIVISIONS = (3, 2)
"""Parts into which pieces are divided one time after another where their number is left to the search."""

WORTHWHILE = 0.08
"""Relative gain by which pieces are divided once more: that gains about a sixteenth of it, here half a percent."""

INWARD, INWARDS = 2e-4, 10.0
"""Share of their widths by which walls are moved inwards, and factor on it where a curve is outside."""

TRIES, SEEN, ENOUGH = 3, 0.05, 2.0
"""How often is searched, the excess of a limit beyond which the search has not seen it, and how far it is tightened."""

FAR = 1e-3
"""Share by which the certified curve may be slower than the one found; beyond, the search did not see a limit."""

GRAIN = 2.0**32
"""Factors on time are rounded up to its fractions, so that the last bits of exact extrema do not decide a plan."""

DIRECTED = 0.05
"""Share of the weight below which thrust is taken to have no direction: there a small change turns it by any angle."""

ORDERS = 4
"""Highest derivative that walls may bound."""

MEASURED = (
    "norm",
    "horizontal",
    "upwards",
    "downwards",
    "vertical",
    "thrust",
    "least_thrust",
    "tilt",
    "body_rate",
    "yaw_rate",
    "rotors",
)
"""What the limits may measure that the native search knows."""

BOUNDING = ("acceleration", "max_thrust")
"""One of these must be given beside a least thrust, so that no curve leaps through free fall between instants."""

ENDING = ("speed", "jerk", "snap", *BOUNDING)
"""Limits of which one must be given: each bounds the time of every path."""


def serves(task: Task, limits: Limits) -> bool:
    """Whether the native search knows everything that a task and its limits ask for."""
    given = limits.given()
    known = all(KIND[name].measure in MEASURED for name in given)
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
    heading = _heading(task, limits, finish)
    if limits.yaw_rate is not None and not isinstance(heading, LookAtHeading | ConstantHeading):
        return None
    question = asked(task, limits, refine, heading)
    for _ in range(TRIES):
        found = search_shortest(question, poll)
        if found is None or not found.durations.max() <= LONGEST_PIECE:
            return None
        solved = _solved(task, found, 1.0)
        if not solved.inside:
            question = replace(question, inwards=INWARDS * question.inwards)
            continue
        kept, excess = _within(task, limits, finish, found, solved)
        if kept is not None or found.stopped or excess > SEEN:
            return kept
        question = replace(question, tightened=question.tightened + ENOUGH * excess)
    return None


def _within(
    task: Task, limits: Limits, finish: Finish, found: ShortestFound, solved: SolvedTask
) -> tuple[SolvedTask | None, float]:
    """Fly the same path at the speed at which the most used limit is just kept, if that is about the one found.

    Returns
    -------
    solved : SolvedTask or None
    excess : float
        Of the most used limit, relative.
    """
    curve = finish(solved.trajectory)
    if not _scales(task, limits):
        excess = largest_use(limits, curve) - 1.0
        return (solved if excess <= KEPT else None), excess
    factor = float(np.ceil(_slowdown(limits, curve) * GRAIN)) / GRAIN
    return (_solved(task, found, factor) if factor <= 1.0 + FAR or found.stopped else None), factor - 1.0


def _scales(task: Task, limits: Limits) -> bool:
    """Whether every curve keeps the limits that is flown slowly enough: a slow thrust may turn faster in free fall."""
    return task.still and limits.body_rate is None and not isinstance(limits, VehicleLimits)


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


def _heading(task: Task, limits: Limits, finish: Finish) -> Heading | None:
    """Heading of any curve of the task, where limits depend on it: of that along the straight legs."""
    if not isinstance(limits, VehicleLimits) and limits.yaw_rate is None:
        return None
    ends = (
        np.repeat(task.waypoints[:-1, None], task.half, axis=1),
        np.repeat(task.waypoints[1:, None], task.half, axis=1),
    )
    times = stop_and_go_times(guessed_lengths(task), limits)
    return finish(Trajectory(np.concatenate(ends, axis=1), times)).yaw


def asked(task: Task, limits: Limits, refine: bool, heading: Heading | None = None) -> ShortestQuestion:
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
    norms = norm_limits(limits)
    typical = float(lengths.mean()), float((lengths / stop_and_go_times(lengths, limits)).mean())
    kinds = [one for one in sets if len(one.place)], instant_limits(limits, heading, typical)
    return ShortestQuestion(
        pinned,
        coarse.free[:, : task.half],
        lengths,
        norms,
        *kinds,
        parts,
        task.closed,
        not _scales(task, limits),
        WORTHWHILE,
        INWARD,
    )


def _walls(task: Task, limits: Limits) -> list[Walls]:
    """Walls of the corridor and of the limits, but for a least thrust, whose wall is stricter than the limit."""
    other = ("min_thrust", "max_thrust", "tilt") if limits.medium.drags else ("min_thrust",)
    return [*task.walls, *(wall for wall in limits.walls(task.waypoints) if wall.name not in other)]


def _sets(cones: Walls) -> ConeSets:
    return ConeSets(cones.leg, cones.matrix, cones.anchor, cones.slope, cones.radius, cones.width, cones.order)


def _least_thrust(task: Task, limits: Limits) -> list[ConeSets]:
    """Accelerations no nearer to free fall than the least thrust."""
    directed = limits.body_rate is not None and limits.min_thrust is None
    least = DIRECTED if directed else limits.min_thrust
    if least is None or limits.medium.drags:
        return []
    legs, radius = task.legs, np.full(task.legs, least * limits.gravity)
    width = np.full(task.legs, limits.gravity) if directed else radius
    fall = np.tile((0.0, 0.0, -limits.gravity), (legs, 1))
    matrix, slope = np.tile(np.eye(3), (legs, 1, 1)), np.zeros((legs, 3))
    return [ConeSets(np.arange(legs), matrix, fall, slope, radius, width, 2, outside=True)]


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

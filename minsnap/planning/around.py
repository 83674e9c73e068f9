"""Plans around obstacles: a joint search of one vehicle finds ways around, and planes turn each way into a corridor.

What keeps out is not convex, and a plan is. Each leg is cut, each part of it gets one plane between it and each
obstacle, and the plan within these planes is an ordinary one, proved as all are. Planes from that plan give a better
one, until it hardly gains.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from math import ceil
from time import monotonic

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import point_text
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.constraint import Walls
from minsnap.corridors.keep_out import Obstacle, clearance_of, supporting_planes
from minsnap.corridors.obstacle_margins import in_space, nearest_obstacle
from minsnap.errors import CorridorError, InfeasibleError, SolverError, TimingError, UnprovedError
from minsnap.native.joint_fleet import KINDS, ORDERS, FleetSearch, Settings
from minsnap.optimisation.task import Task
from minsnap.time_allocation.allocate import looked_at, plan_timed
from minsnap.time_allocation.timing import Timed, Timing
from minsnap.trajectory.trajectory import Trajectory

PARTS, LEAST_PARTS, MOST_PARTS = 16, 4, 64
"""Parts into which all legs are cut at first; each leg at least, and at most where ways wind."""

SAMPLES = 17
"""Points of each part by which planes are chosen."""

BENDS = (0.0, 0.25, -0.25, 0.5, -0.5)
"""Sideways bend of the first guesses, in lengths of their legs."""

ROUNDS, GAIN = 8, 1e-3
"""Most plans of one way, and the share below which another one gains too little."""


def plan_around(task: Task, timing: Timing, obstacles: Sequence[Obstacle]) -> Timed:
    """Choose durations and solve, out of all obstacles at every instant.

    Raises
    ------
    CorridorError
        If a waypoint is inside an obstacle.
    UnprovedError
        If the search ends without a way around.
    SolverError
        If the plan does not keep everything at the last look.
    """
    for index in np.flatnonzero((task.lower == task.upper).all(axis=1)):
        for which, obstacle in enumerate(obstacles):
            point = task.waypoints[index]
            depth = -clearance_of(obstacle, in_space(point))
            if depth > EXACT:
                raise CorridorError(
                    f"waypoint {index}, {point_text(point)}, is {depth:.3g} m inside obstacle {which}: move it"
                )
    timed = looked_at(_planned_around(task, timing, obstacles), task, timing)
    near = nearest_obstacle(timed.trajectory, obstacles)
    if near.value < -EXACT:
        raise SolverError(f"the plan is refused at the last look: it is {near.inside}; please report this question")
    return timed


def _planned_around(task: Task, timing: Timing, obstacles: Sequence[Obstacle]) -> Timed:
    """Search for a way around and plan along it."""
    first = plan_timed(task, timing)
    direct = nearest_obstacle(first.trajectory, obstacles)
    if direct.value >= 0.0:
        return first
    best: tuple[float, Timed] | None = None
    for parts in _parts(task):
        attempt = partial(_attempt, task, timing, obstacles, parts)
        for way in _ways(task, first.trajectory, obstacles, parts):
            timed = attempt(way)
            best = timed if best is None or (timed is not None and timed[0] < best[0]) else best
            if best is not None and monotonic() > timing.due:
                return best[1]
        # Finer parts cost a search of twice the size each: they are for ways that coarser ones miss.
        if best is not None:
            return _improved(best, attempt, timing.due)
    give = "or more room" if timing.limits is None else "more room, or more time"  # which changes no path by itself
    raise UnprovedError(
        f"no way around the obstacles was found; without them the path is {direct.inside}: give a waypoint beside it, "
        f"{give}"
    )


def _parts(task: Task) -> Iterator[int]:
    parts = max(LEAST_PARTS, ceil(PARTS / task.legs))
    while parts <= MOST_PARTS:
        yield parts
        parts *= 2


def _improved(
    best: tuple[float, Timed], attempt: Callable[[Trajectory], tuple[float, Timed] | None], due: float
) -> Timed:
    for _ in range(ROUNDS):
        timed = None if monotonic() > due else attempt(best[1].trajectory)
        if timed is None or timed[0] >= best[0]:
            break
        gain, best = best[0] - timed[0], timed
        if gain < GAIN * best[0]:
            break
    return best[1]


def _attempt(
    task: Task, timing: Timing, obstacles: Sequence[Obstacle], parts: int, way: Trajectory
) -> tuple[float, Timed] | None:
    """Return the plan on one side of planes along a way, after what it costs; None if there is none."""
    planes = _planes(way, parts * task.legs, obstacles, task)
    if planes is None:
        return None
    cut = _cut(task, way, parts).with_walls([planes])
    if timing.durations is not None:
        timing = replace(timing, durations=np.repeat(timing.durations / parts, parts))
    try:
        timed = plan_timed(cut, timing)
    except (InfeasibleError, SolverError, TimingError):
        return None
    timed = replace(timed, trajectory=_joined(timed.trajectory, parts))
    if nearest_obstacle(timed.trajectory, obstacles).value < -EXACT:
        return None
    return _price(timed, timing), timed


def _price(attempt: Timed, timing: Timing) -> float:
    if timing.time_weight is not None:
        return attempt.cost + timing.time_weight * attempt.trajectory.duration
    timed = timing.durations is not None or timing.total_time is not None
    return attempt.cost if timed else attempt.trajectory.duration


def _joined(curve: Trajectory, parts: int) -> Trajectory:
    """Return a curve whose parts belong to one leg again."""
    return curve.changed(pieces=curve.pieces * parts)


def _planes(way: Trajectory, count: int, obstacles: Sequence[Obstacle], task: Task) -> Walls | None:
    """Return one plane for each part and obstacle, between them; None if there is none that lies between."""
    share, breaks = np.linspace(0.0, 1.0, SAMPLES), way.breaks[:: len(way.durations) // count]
    points = in_space(way(breaks[:-1, None] + np.diff(breaks)[:, None] * share))
    normals, heights = [], []
    for obstacle in obstacles:
        normal, height = supporting_planes(obstacle, points)
        least = (np.einsum("pid,pkd->pik", normal, points) - height[:, :, None]).min(axis=2)
        least[~normal.any(axis=2)] = -np.inf
        chosen = least.argmax(axis=1)[:, None]
        if (np.take_along_axis(least, chosen, axis=1) < -EXACT).any():
            return None
        normals.append(np.take_along_axis(normal, chosen[:, :, None], axis=1)[:, 0])
        heights.append(np.take_along_axis(height, chosen, axis=1)[:, 0])
    normal, lower = np.concatenate(normals)[:, : task.dim], np.concatenate(heights)
    leg = np.tile(np.arange(count), len(obstacles))
    upper, width = np.full(len(leg), np.inf), np.full(len(leg), task.length)
    return Walls.planes(leg, normal, np.zeros(normal.shape), lower, upper, width, name="obstacle")


def _cut(task: Task, way: Trajectory, parts: int) -> Task:
    """Return a task each of whose legs is cut at instants of a way, where it passes anywhere."""
    points = np.array(way(way.breaks[:: len(way.durations) // (parts * task.legs)]))
    reach = np.full(points.shape, float(np.ptp(points, axis=0).max() + task.length))
    lower, upper = -reach, reach.copy()
    points[::parts], lower[::parts], upper[::parts] = task.waypoints, task.lower, task.upper
    pins = {knot * parts: state for knot, state in task.pins.items()}
    regions = {knot * parts: region for knot, region in task.regions.items()}
    cut = replace(task, waypoints=points, lower=lower, upper=upper, pins=pins, regions=regions, explained=False)

    def finish(curve: Trajectory) -> Trajectory:
        # Angles belong to waypoints, and the parts have knots between them: the heading is that of the joined curve.
        return curve.with_yaw(task.finish(_joined(curve, parts)).yaw)

    return replace(cut, walls=[wall.cut(parts) for wall in task.walls], finish=finish)


def _ways(task: Task, curve: Trajectory, obstacles: Sequence[Obstacle], parts: int) -> Iterator[Trajectory]:
    """Find ways around obstacles from a curve that is not clear of them, each from another guess."""
    pieces = parts * task.legs * task.pieces
    durations = np.repeat(np.diff(curve.leg_breaks) / (parts * task.pieces), parts * task.pieces)
    knots = np.concatenate(([0.0], np.cumsum(durations)))
    h, time = curve.duration / pieces, curve.duration
    scale = np.array([1.0, h, h * h, h * h * h])
    data = in_space(curve.states(np.minimum(knots, time), ORDERS))
    free = np.ones((1, pieces + 1, ORDERS, 3))
    free[0, [0, -1]] = 0.0
    free[0, :: parts * task.pieces, 0, : task.dim] = task.upper > task.lower
    free[..., task.dim :] = 0.0
    numbers = np.stack([each.numbers() for each in obstacles])
    limits, length = np.full((1, ORDERS, KINDS), np.inf), 0.05 * task.length
    known = np.array([1e-9]), limits, _bounds(task, pieces), free, durations / time, numbers
    for bend in BENDS:
        guess = np.ascontiguousarray(_bent(data, task, bend)[None] * scale[:, None])
        search = FleetSearch(*known, 12, 1.0, length, 1)
        search.run(guess, time, task.length / time**2, Settings(iterations=200), lambda: False)
        yield _curve(guess[0] / scale[:, None], durations, task)


def _bounds(task: Task, pieces: int) -> FloatArray:
    """Return the box of each piece, shape (1, pieces, 2, 3), from walls along the axes [m]."""
    bounds = np.empty((task.legs, 2, 3))
    bounds[:, 0], bounds[:, 1] = -np.inf, np.inf
    for wall in task.walls:
        if wall.order or not wall.flat:
            continue
        for row in np.flatnonzero((wall.slope != 0.0).sum(axis=1) == 1):
            leg, axis = wall.leg[row], int(np.flatnonzero(wall.slope[row])[0])
            slope = wall.slope[row, axis]
            end, place = int(slope < 0.0), wall.anchor[row, axis] - wall.radius[row] / slope
            bounds[leg, end, axis] = (min if end else max)(bounds[leg, end, axis], place)
    return np.repeat(bounds, pieces // task.legs, axis=0)[None]


def _bent(data: FloatArray, task: Task, bend: float) -> FloatArray:
    """Return the derivatives at knots of a curve that is moved aside between waypoints."""
    moved, each = data.copy(), (len(data) - 1) // task.legs
    share = np.arange(each + 1) / each
    for leg in range(task.legs):
        way = in_space(task.waypoints[leg + 1] - task.waypoints[leg])
        aside = np.array([way[1], -way[0], 0.0]) if way[:2].any() else np.array([way[2], 0.0, 0.0])
        moved[leg * each : (leg + 1) * each + 1, 0] += bend * np.outer(16.0 * (share * (1.0 - share)) ** 2, aside)
    return moved


def _curve(data: FloatArray, durations: FloatArray, task: Task) -> Trajectory:
    from scipy.interpolate import BPoly

    breaks = np.concatenate(([0.0], np.cumsum(durations)))
    curve = BPoly.from_derivatives(breaks, data[:, :, : task.dim])
    return Trajectory(curve.c.transpose(1, 0, 2), durations, pieces=len(durations) // task.legs)

"""Plans around obstacles: a line around them, polytopes along it, and an ordinary plan through these.

What keeps out is not convex, and a plan is. Each leg is cut at the corners of a line that leads around all obstacles,
and each part stays in the polytope around its segment, which no obstacle reaches into. The plan is proved as all are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray
from minsnap.basics.checks import point_text
from minsnap.basics.deadline import Deadline, LateError
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.constraint import Walls, walls_from
from minsnap.corridors.half_spaces import one_sided
from minsnap.corridors.keep_out import Avoided, clearance_in
from minsnap.corridors.margins import nearest_wall
from minsnap.corridors.moving import Moving
from minsnap.corridors.obstacle_margins import ObstacleMargin, in_space, nearest_obstacle
from minsnap.corridors.prism import Prism
from minsnap.corridors.tangent_polytopes import TANGENT, polytopes_along
from minsnap.corridors.way_around import Inside, Kept, cells_around, way_around
from minsnap.corridors.way_in_time import WayInTime
from minsnap.durations.allocate import plan_timed, require_kept
from minsnap.durations.timing import Timed, Timing
from minsnap.durations.within_limits import limits_kept
from minsnap.errors import CorridorError, InfeasibleError, SolverError, UnprovedError
from minsnap.native.half_space_sets import HalfSpaceRows
from minsnap.optimisation.optimum import GaveUpError, InfeasibleRowsError
from minsnap.optimisation.solve import Effort, solve
from minsnap.optimisation.task import Task
from minsnap.planning.among_moving import Surroundings, among_moving, least_margin
from minsnap.planning.other_ways import OTHER_WAYS, other_ways
from minsnap.trajectory.trajectory import Trajectory, made

FLIGHT = 0.15
"""Share of a time_limit that the search for a flight has after the way around was found, however late."""

FINER = (1, 2, 4)
"""Into how many parts segments of a way are cut, where fewer have no plan."""


@dataclass(frozen=True, eq=False)
class _Around(Timed):
    """A plan whose legs were cut around obstacles, and are one again; its margin is to the walls of the request."""

    limits_from: float = 0.0
    corridor_margin: float | None = None


def plan_around(task: Task, timing: Timing, obstacles: Sequence[Avoided]) -> Timed:
    """Choose durations and solve, out of all obstacles at every instant.

    Raises
    ------
    CorridorError
        If a waypoint is inside an obstacle.
    UnprovedError
        If no way around was found.
    SolverError
        If the plan does not keep everything at the last look.
    """
    fixed = np.flatnonzero((task.lower == task.upper).all(axis=1))
    depths = _depths(task.waypoints[fixed], fixed == 0, obstacles)
    if (depths > EXACT).any():
        row, which = (int(number) for number in np.argwhere(depths > EXACT)[0])
        beyond = ObstacleMargin.of(-float(depths[row, which]), which, 0.0, obstacles).beyond
        give = " at 0 s: begin elsewhere, or later" if isinstance(obstacles[which], Moving) else ": move it"
        raise CorridorError(f"waypoint {fixed[row]}, {point_text(task.waypoints[fixed[row]])}, is {beyond}{give}")
    still = [each for each in obstacles if not isinstance(each, Moving)]
    moving = tuple(each for each in obstacles if isinstance(each, Moving))
    first = _plan_around(task, timing, still) if still else plan_timed(task, timing)
    timed = require_kept(_among(task, timing, still, moving, first) if moving else first, task, timing)
    near = nearest_obstacle(timed.trajectory, obstacles)
    if near.value < -EXACT:
        raise SolverError(f"the plan is refused at the last look: it is {near.inside}; please report this question")
    return timed


def _depths(points: FloatArray, first: BoolArray, obstacles: Sequence[Avoided]) -> FloatArray:
    """Return how far inside of obstacles, or outside of fences, points (n, dim) are: (n, obstacles) [m].

    Those that move may be elsewhere when a point is passed that is not the first.
    """
    depths, places = np.full((len(points), len(obstacles)), -np.inf), in_space(points)
    simple = [which for which, each in enumerate(obstacles) if not isinstance(each, Moving | Prism)]
    if simple:
        numbers = np.stack([obstacles[which].numbers() for which in simple])  # type: ignore[union-attr]
        depths[:, simple] = -clearance_in(numbers, places[:, None])
    for which, each in enumerate(obstacles):
        if isinstance(each, Prism):
            depths[:, which] = -each.clearances(points)
        elif isinstance(each, Moving):
            depths[first, which] = [-float(each.clearances(point, 0.0)) for point in points[first]]
    return depths


def _plan_around(task: Task, timing: Timing, obstacles: Sequence[Avoided]) -> Timed:
    """Plan as if there were no obstacles, and if that leads through one, along a way around all."""
    clock = task.deadline.clock
    limit = timing.due - clock()
    first = plan_timed(task, timing)
    direct = nearest_obstacle(first.trajectory, obstacles)
    if direct.value >= 0.0:
        return first
    ways = _line_around(task, first.trajectory, Kept.of(obstacles, task.dim), timing.due - clock())
    if ways is None:
        raise UnprovedError(
            f"no way around the obstacles was found; without them the path is {direct.inside}: give a waypoint beside "
            "it, or more room"
        )
    parts, until = max(len(way) - 1 for way in ways), max(timing.due, clock() + FLIGHT * limit)
    within = replace(timing, due=until)
    in_time = replace(task, deadline=task.deadline.until(max(task.deadline.due, until)))
    for finer in FINER:
        try:
            found = _plan_along([_in_parts(way, finer * parts) for way in ways], in_time, within, obstacles)
            return _quicker(found, ways, task, timing, obstacles, first.trajectory.duration)
        except LateError:
            raise
        except (InfeasibleError, SolverError) as error:
            refused = error
    raise UnprovedError(
        f"no plan was found along the way that leads around the obstacles: {refused}; give a waypoint beside them, or "
        "more room"
    )


def _quicker(
    found: Timed, ways: list[FloatArray], task: Task, timing: Timing, obstacles: Sequence[Avoided], least: float
) -> Timed:
    """Try ways of other topology for one leg at a time, where bends cost time; return the quickest flight."""
    if not timing.shortest or found.trajectory.duration < (1.0 + OTHER_WAYS.gain) * least:
        return found
    kept, tried = Kept.of(obstacles, task.dim), 0
    for leg, way in enumerate(list(ways)):
        if len(way) < 3 or timing.in_time(task).deadline.late:
            continue
        seconds = (timing.due - task.deadline.clock()) / task.legs
        grid = next(cells_around(kept, way[0], way[-1], _inside(task, leg), seconds))
        cells = grid.free, grid.lower, np.full(grid.dim, grid.size)
        others = other_ways(*cells, way, found.trajectory, partial(grid.way_within, way[0], way[-1]))
        while tried < OTHER_WAYS.bends and not timing.in_time(task).deadline.late:
            other = next(others, None)
            if other is None:
                break
            tried += 1
            changed = [*ways[:leg], other, *ways[leg + 1 :]]
            parts = max(len(each) - 1 for each in changed)
            try:
                along = _plan_along([_in_parts(each, parts) for each in changed], task, timing, obstacles)
            except (CorridorError, InfeasibleError, SolverError):  # LateError too: the first one flies
                continue
            if along.trajectory.duration < found.trajectory.duration:
                found, ways = along, changed
    return found


def _among(task: Task, timing: Timing, still: Sequence[Avoided], moving: tuple[Moving, ...], first: Timed) -> Timed:
    """Return a plan that keeps away from what moves, too: the first one, if it does."""
    curve = first.trajectory
    if least_margin(curve, moving) >= 0.0:
        return first
    passed = _find_passed_waypoints(task, curve)
    inside = tuple(_inside(task, leg) for leg in range(task.legs))
    around = Surroundings(Kept.of(still, task.dim), moving, inside, _reach(task))

    def plan(ways: list[WayInTime], sets: list[HalfSpaceRows]) -> Timed:
        parts = len(ways[0].times) - 1
        points = np.concatenate([way.points[:-1] for way in ways] + [ways[-1].points[-1:]])
        durations = np.concatenate([np.diff(way.times) for way in ways])
        cut = _cut(task, points, parts).with_walls([_walls_of(sets, task.length)])
        return _one_leg_again(task, _in_durations(cut, durations, timing), parts)

    def late() -> bool:
        return timing.in_time(task).deadline.late

    found = among_moving(around, curve, passed, not timing.shortest, plan, late)
    if found is not None:
        return found
    near = nearest_obstacle(curve, [*still, *moving])
    raise UnprovedError(
        f"no plan was found among the moving obstacles; without them the path is {near.inside}: give more time, more "
        "room, or a waypoint beside them"
    )


def _in_durations(task: Task, durations: FloatArray, timing: Timing) -> Timed:
    """Return the plan for fixed durations, tried but for a glance: others will be, where there is none."""
    task = replace(task, deadline=Deadline(min(task.deadline.due, timing.due), task.deadline.clock))
    fixed = Timing(durations, limits=timing.limits)
    try:
        solved = solve(fixed.bounded(task), task.piece_durations(durations), task.samples, effort=Effort.GLANCE)
    except (GaveUpError, InfeasibleRowsError) as reason:
        raise SolverError(f"no curve was found in these durations: {reason}") from None
    planned = Timed(solved, solved.flown)
    if timing.limits is not None:
        planned = limits_kept(planned, task, fixed).plan()
    return require_kept(planned, task, fixed)


def _find_passed_waypoints(task: Task, curve: Trajectory) -> FloatArray:
    """Return where a curve passes its waypoints, the fixed ones as they are, (legs + 1, dim) [m]."""
    passed, fixed = np.array(curve(curve.leg_breaks)), task.lower == task.upper
    passed[fixed] = (task.waypoints + task.lower)[fixed]
    return passed


def _line_around(task: Task, curve: Trajectory, kept: Kept, seconds: float) -> list[FloatArray] | None:
    """Return the corners of a line around obstacles for each leg, from where a curve passes its waypoints, or None.

    There are so many seconds for all of them.
    """
    passed, ways = _find_passed_waypoints(task, curve), []
    for leg in range(task.legs):
        way = way_around(kept, passed[leg], passed[leg + 1], _inside(task, leg), seconds / task.legs)
        if way is None:
            return None
        ways.append(way)
    return ways


def _inside(task: Task, leg: int) -> Inside | None:
    """Return what tells whether points are inside the walls of a leg; None where there are none."""
    walls = [wall for wall in walls_from(task.walls, leg, leg + 1) if wall.order == 0]

    def inside(points: FloatArray) -> BoolArray:
        kept = np.stack([(wall.excess_at(points) <= EXACT).all(axis=-1) for wall in walls])
        return np.asarray(kept.all(axis=0))

    return inside if walls else None


def _plan_along(ways: list[FloatArray], task: Task, timing: Timing, obstacles: Sequence[Avoided]) -> Timed:
    """Plan with each leg cut at the corners of its way, all of as many, in the polytopes around the segments."""
    parts = len(ways[0]) - 1
    points = np.concatenate([way[:-1] for way in ways] + [ways[-1][-1:]])
    kept = Kept.of(obstacles, task.dim)
    sets = polytopes_along(points, kept.obstacles, kept.points, 0.0, _reach(task), prisms=kept.prisms)
    cut = _cut(task, points, parts).with_walls([_walls_of(sets, task.length)])
    if timing.durations is not None:
        shares = np.stack([_shares(way) for way in ways])
        timing = replace(timing, durations=(timing.durations[:, None] * shares).reshape(-1))
    return _one_leg_again(task, plan_timed(cut, timing), parts)


def _one_leg_again(task: Task, timed: Timed, parts: int) -> _Around:
    """Return a plan whose legs were cut as one of the task."""
    curve = _join(timed.trajectory, parts)
    margin = nearest_wall(curve, [wall for wall in task.walls if wall.order == 0])
    known = timed.solved, curve, timed.steps, timed.interrupted
    return _Around(*known, limits_from=timed.limits_from, corridor_margin=None if margin is None else margin.value)


def _reach(task: Task) -> float:
    """How far polytopes extend: enough for the bends of legs of a typical length [m]."""
    return max(TANGENT.reach, task.length)


def _in_parts(way: FloatArray, parts: int) -> FloatArray:
    """Return a line with so many segments: the longest are halved."""
    while len(way) - 1 < parts:
        longest = int(np.argmax(np.linalg.norm(np.diff(way, axis=0), axis=1)))
        way = np.insert(way, longest + 1, 0.5 * (way[longest] + way[longest + 1]), axis=0)
    return way


def _shares(way: FloatArray) -> FloatArray:
    """Return the shares of a line that its segments have."""
    lengths = np.linalg.norm(np.diff(way, axis=0), axis=1)
    return np.asarray(lengths / lengths.sum() if lengths.any() else np.full(len(lengths), 1.0 / len(lengths)))


def _walls_of(sets: list[HalfSpaceRows], width: float) -> Walls:
    """Return the planes of polytopes, one of these a leg, as walls."""
    leg = np.repeat(np.arange(len(sets)), [len(b) for _, b in sets])
    normal, upper = (np.concatenate(part) for part in zip(*sets, strict=True))
    return one_sided(leg, normal, upper, np.full(len(leg), width), 0, "obstacle")


def _cut(task: Task, corners: FloatArray, parts: int) -> Task:
    """Return a task each of whose legs is cut at corners, which it passes anywhere within the walls."""
    points = corners.copy()
    reach = np.full(points.shape, float(np.ptp(points, axis=0).max() + task.length))
    lower, upper = -reach, reach.copy()
    points[::parts], lower[::parts], upper[::parts] = task.waypoints, task.lower, task.upper
    pins = {knot * parts: state for knot, state in task.pins.items()}
    regions = {knot * parts: region for knot, region in task.regions.items()}
    cut = replace(task, waypoints=points, lower=lower, upper=upper, pins=pins, regions=regions, explains=False)

    def finish(curve: Trajectory) -> Trajectory:
        # Angles belong to waypoints, and the parts have knots between them: the heading is that of the joined curve.
        return curve.with_yaw(task.finish(_join(curve, parts)).yaw)

    return replace(cut, walls=[wall.cut(parts) for wall in task.walls], finish=finish)


def _join(curve: Trajectory, parts: int) -> Trajectory:
    """Return a curve whose parts belong to one leg again."""
    return made(curve.control_points, curve.durations, curve.pieces * parts, curve.yaw)

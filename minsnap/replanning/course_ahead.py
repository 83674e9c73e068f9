"""The question of a replan: its options, checked, and what is still to be flown, as a task from the splice on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray, numbers
from minsnap.basics.checks import check_array, check_degree, check_number, check_position, is_number, refuse_repeated
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.constraint import Constraint, walls_from, walls_of
from minsnap.corridors.given_waypoints import as_knots
from minsnap.corridors.knot_regions import place
from minsnap.corridors.precheck import check_reach
from minsnap.errors import CorridorError, DegreeError, WaypointError, YawError
from minsnap.limits.limits import Limits, VehicleLimits, check_one_speed
from minsnap.optimisation.task import Task
from minsnap.replanning.splice import Splice
from minsnap.trajectory.planned_heading import ChosenHeading, chosen_heading
from minsnap.trajectory.trajectory import Trajectory
from minsnap.vehicle import Quadrotor

LEAST_HALF = 4
"""Jerk is taken over at the splice, so that polynomials have degree 7 at least."""


def check_half(degree: Any) -> int:
    """Return k of a degree 2k - 1; DegreeError for one that cannot take over the jerk."""
    half = check_degree(degree)
    if half < LEAST_HALF:
        raise DegreeError(f"degree {degree} cannot take over the jerk at a splice: use 7, 9 or 11")
    return half


def all_limits(limits: Limits | None, vehicle: Quadrotor | None) -> Limits | None:
    """Return limits with those of a vehicle; the reserve of its rotors is that of limits that have one."""
    if limits is not None:
        check_one_speed(limits, "a replanner")
    if vehicle is None:
        return limits
    others: dict[str, Any] = {} if limits is None else {**limits.given(), "norm": limits.norm}
    others |= {"reserve": limits.reserve} if isinstance(limits, VehicleLimits) else {}
    return Limits.of(vehicle, **others)


def replan_heading(yaw: Any, limits: Limits | None) -> ChosenHeading | None:
    """Return the function that gives a curve its heading; None where the heading is held."""
    if yaw is None:
        return None
    if not isinstance(yaw, str) and not is_number(yaw):
        raise YawError(f"yaw is {shown(yaw)}: give an angle [rad], 'velocity' or 'tilt', or nothing to hold it")
    return chosen_heading(yaw, 1, False, limits)


def waypoint_angles(yaw: Any, legs: int) -> FloatArray | None:
    """Return one angle for each waypoint ahead (legs,) [rad]; None without angles."""
    if yaw is None:
        return None
    give = (
        f"one finite angle [rad] for each of the {legs} waypoints ahead; the Replanner itself takes an angle, "
        "'velocity' or 'tilt'"
    )
    return check_array("yaw", yaw, ((legs,),), give, YawError)


def check_horizon(horizon: Any) -> int | None:
    """Return a number of legs, or None for all."""
    give = "give a number of legs, 1 or more"
    return None if horizon is None else int(check_number("horizon", horizon, 1, inf, give, whole=True))


@dataclass(frozen=True, eq=False)
class CourseAhead:
    """What is ahead of a splice.

    Parameters
    ----------
    task : Task
        From the state at the splice.
    outside : float
        Distance by which the start is outside the walls of its leg [m]; 0 inside.
    wall : str
        Name of the wall that it is outside of.
    """

    task: Task
    outside: float
    wall: str

    def fits(self, rest: Trajectory | None) -> bool:
        """Whether a rest passes all waypoints ahead, leg by leg, or goes from box to box to the same end."""
        if rest is None or rest.legs != self.task.legs or rest.dim != self.task.dim:
            return False
        knots = np.concatenate((rest.control_points[:: rest.pieces, 0], rest.control_points[-1:, -1]))
        offset = knots - self.task.waypoints
        size = EXACT * max(float(np.ptp(self.task.waypoints, axis=0).max()), float(np.abs(knots).max()))
        pinned = (self.task.upper <= self.task.lower).all(axis=1)
        return bool((np.abs(offset[pinned]) <= size).all())


def course_ahead(
    splice: Splice,
    waypoints: npt.ArrayLike | None,
    goal: npt.ArrayLike | None,
    leg_start: FloatArray,
    constraints: Sequence[Constraint],
    pieces: int,
) -> CourseAhead:
    """Check what is ahead and return it.

    Parameters
    ----------
    splice : Splice
    waypoints : array_like, shape (n, dim), or None
        Still to be passed; with None the course leads from box to box to the goal.
    goal : array_like, shape (dim,), or None
        Without waypoints; by default the end of the flown plan.
    leg_start : ndarray, shape (dim,)
        Where the first leg begins, for corridors that run along legs [m].
    constraints : sequence of Constraint
    pieces : int
        Polynomials per leg.

    Raises
    ------
    WaypointError, CorridorError
        If the waypoints are malformed or outside the walls of their legs, the start left aside.
    """
    start = splice.state[0]
    if waypoints is None:
        goal = splice.flown(splice.flown.duration) if goal is None else goal
        placement = place(None, constraints, start, check_position({"position": goal}, "end")[0])
    else:
        if goal is not None:
            raise WaypointError("a goal is where a course without waypoints ends: leave out the goal or the waypoints")
        placement = place(as_knots(_points(start, waypoints)), constraints)
    points = placement.points
    along = points.copy()
    along[0] = leg_start if np.linalg.norm(points[1] - leg_start) > 0.0 else points[0]
    walls = walls_of(constraints, along)
    own = walls_from([wall for wall in walls if wall.order == 0], 0, 1)
    found = [(float(-wall.slack(start[None, None, :]).min()), wall.name) for wall in own]
    outside, name = max(found, key=lambda one: one[0], default=(-inf, ""))
    end = {len(points) - 1: {order: np.zeros(len(start)) for order in range(1, splice.half)}}
    if outside <= 0.0:
        check_reach(placement, end, walls)
    refuse_repeated(points, "leave out waypoints that have been passed")
    bounds = placement.lower, placement.upper
    pins = {0: dict(enumerate(splice.state[1:], 1))} | end
    task = Task(points, *bounds, pins, splice.half, splice.half - 1, False, pieces, walls, "auto", placement.regions)
    return CourseAhead(task, max(outside, 0.0), name)


def _points(start: FloatArray, waypoints: npt.ArrayLike) -> FloatArray:
    """Start and waypoints, (n + 1, dim)."""
    points = numbers(waypoints)
    ahead = np.zeros((0, 0)) if points is None else np.atleast_2d(points)
    if ahead.ndim != 2 or not ahead.size or ahead.shape[1] != len(start):
        are = f"are {shown(waypoints)}" if points is None else f"have shape {ahead.shape}"
        raise WaypointError(
            f"the waypoints ahead {are}: give those still to be passed, at least one, of {len(start)} coordinates"
        )
    return np.concatenate((start[None], ahead))


def refuse_outside(course: CourseAhead, recover: float) -> None:
    """Raise CorridorError unless the way back from a start outside is within what may be recovered."""
    if course.outside > recover:
        raise CorridorError(
            f"the start is {course.outside:.3g} m outside the {course.wall} of leg 0: widen it, or allow the way back "
            f"with recover={1.01 * course.outside:.3g} or more",
            leg=0,
            waypoint=0,
        )

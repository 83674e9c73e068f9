"""Flights through what a sensor sees on the way: observations as lines of JSON, each answered with what is flown then.

``{"position": [x, y, z], "points": [[x, y, z], ...], "rays": [[x, y, z], ...]}`` is where the sensor is, what it saw of
obstacles, and ends of lines on which it saw nothing, in the axes of the plan [m]. Points and rays may be missing, and
an ``"id"`` comes back with the answer. Of several lines that wait all are taken, and one plan is made.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray
from minsnap.basics.checks import check_positive, is_number
from minsnap.basics.deadline import Clock
from minsnap.basics.messages import finite, shown
from minsnap.corridors import Gate
from minsnap.errors import FlightError, InputError, MinsnapError
from minsnap.flight.mavlink.changed_flight import BUDGETS, ChangeableFlight, ChangedFlight
from minsnap.limits import Limits
from minsnap.paths.missions import Course
from minsnap.paths.routes import Explorer
from minsnap.replanning import Change
from minsnap.trajectory import ConstantHeading, Trajectory, made, rest_of

HANDED_OVER = 0.08
"""What of the time of an answer is left for handing it over [s]: a setpoint's slot and a half."""

ARRIVED = 1e-6
"""Distance to the goal at which a plan ends there [m]."""

KEYS = ("position", "points", "rays", "id")
"""Entries of an observation."""


@dataclass(frozen=True, eq=False)
class Exploring:
    """Where a flight leads through what is not known, and how.

    Parameters
    ----------
    start, goal : ndarray, shape (3,)
        Where the vehicle hovers at first, and where it is to be [m].
    limits : Limits
    heading : float
        Of the whole flight [rad].
    plane : bool
        Whether the sensor sees at one height: its observations have two coordinates, and the flight keeps its height.
    lost : float
        Seconds without an observation after which the stop is flown.
    explorer : dict
        Further arguments of :class:`minsnap.routes.Explorer`.

    Raises
    ------
    InputError, WaypointError, LimitError
        If one of them is malformed, or start and goal are not at the one height of the sensor.
    """

    start: FloatArray
    goal: FloatArray
    limits: Limits
    heading: float = 0.0
    plane: bool = False
    lost: float = 1.0
    explorer: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_positive("the time after which a sensor is lost", self.lost, "s", InputError)
        low, high = self.start[2], self.goal[2]
        if self.plane and low != high:
            raise InputError(
                f"start and goal are at {low:g} and {high:g} m: a sensor that sees a plane flies at one height"
            )
        self.explores()

    @property
    def dim(self) -> int:
        """Coordinates of observations."""
        return 2 if self.plane else 3

    def explores(self, clock: Clock = time.monotonic) -> Explorer:
        """Return what plans by observations."""
        return Explorer(self.goal[: self.dim], limits=self.limits, clock=clock, **self.explorer)

    @property
    def flown(self) -> Trajectory:
        """Hovering at the start, for a moment."""
        return Trajectory(np.tile(self.start, (1, 8, 1)), [0.1], yaw=ConstantHeading(self.heading))


def exploring_course(
    course: Course, name: str, *, plane: bool = False, lost: float = 1.0, clearance: float = 0.3, **explorer: float
) -> Exploring:
    """Return how to fly from the first waypoint of a course to the second by what a sensor sees.

    Parameters
    ----------
    course : Course
        Of two waypoints (3,) [m], with limits, and a yaw if any.
    name : str
        What messages call it.
    plane, lost
        See :class:`Exploring`.
    clearance, **explorer
        Of :class:`minsnap.routes.Explorer`: ``sensing`` and ``resolution`` besides.

    Raises
    ------
    InputError, WaypointError, LimitError
        If the course says more, or an argument is malformed.
    """
    more = [
        key for key in ("closed", "tube", "boxes", "start", "end", "takeoff", "land", "avoid") if getattr(course, key)
    ]
    ends = [stop.place for stop in course.stops if not (stop.ball or stop.hold or isinstance(stop.place, Gate))]
    if more or course.laps > 1 or not (len(ends) == len(course.stops) == 2) or any(len(end) != 3 for end in ends):
        raise InputError(f"{name}: a flight that explores has two waypoints, its start and its goal, and limits alone")
    if not (course.yaw is None or is_number(course.yaw)):
        raise InputError(f"{name}: a flight that explores has one yaw [rad]")
    heading = float(course.yaw or 0.0)
    how = {"clearance": clearance, **explorer}
    return Exploring(ends[0], ends[1], course.bounds, heading, plane, lost, how)


class Exploration(ChangedFlight):
    """Takes observations and hands plans over to the flight.

    Parameters
    ----------
    flight : ChangeableFlight
        That flies ``how.flown``, and stays at its end.
    how : Exploring
    clock : callable
        Reads a monotonic clock [s].
    """

    def __init__(self, flight: ChangeableFlight, how: Exploring, clock: Clock = time.monotonic) -> None:
        self._dim, self._height, self._lost, self._clock = how.dim, float(how.start[2]), how.lost, clock
        hover = how.flown
        plane = Trajectory(hover.control_points[..., : self._dim], hover.durations, yaw=ConstantHeading(how.heading))
        super().__init__(flight, plane if how.plane else hover, how.limits)
        self._explorer = how.explores(clock)
        self._heard: float | None = None
        self._flew = self._finished = False
        _warmed_up(how, self._flown)

    def answers(self, lines: Sequence[str]) -> Iterator[str]:
        """Take the observations of lines, plan once, and return the answer to each, a line of JSON.

        Raises
        ------
        EOFError, OSError
            If the flight is over and cannot be reached any more.
        """
        replies = [self._read(line) for line in lines]
        taken = [reply for reply in replies if reply["ok"]]
        if taken:
            taken[-1].update(self.plan())
        return (json.dumps(finite(reply), allow_nan=False) for reply in replies)

    def observe(self, position: ArrayLike, points: ArrayLike, rays: ArrayLike | None = None) -> None:
        """Take what the sensor saw, as :meth:`minsnap.routes.Explorer.observe` does."""
        self._explorer.observe(position, points, rays)
        self._heard = self._clock()

    def plan(self) -> dict[str, Any]:
        """Plan from what is flown through what is known by now, hand it over, and tell what came of it."""
        if self._finished:
            return {"duration": 0.0, "goal": True, "arrived": True}
        now = self._flight.now
        try:
            if now is None and self._flew:
                return {"flying": False}
            if now is None:  # not yet: what would be flown
                curve = self._explorer.replan(self._flown, 0.0, BUDGETS[-1]).trajectory
                where = curve(curve.duration).tolist()
                return {"flying": False, "duration": curve.duration, "end": where}
            self._flew = True
            if now < 0.0:  # a plan waits for its splice: what is seen meanwhile is for the next one
                return {"waiting": -now}
            if self._leads_to_goal and now + BUDGETS[0] >= self._flown.duration:
                return self._arriving(now)
            change = self._planned(self._replanned)
        except MinsnapError as error:
            if now is not None and self._leads_to_goal and now + BUDGETS[-1] >= self._flown.duration:
                return self._arriving(now)
            return {"ok": False, "error": str(error)}
        return {**self._told(change), "goal": self._leads_to_goal, "took": change.took}

    def quiet(self) -> str | None:
        """Fly the stop where nothing was seen for too long, and return a line that says so; None else."""
        now = self._flight.now
        if now is None or self._heard is None or self._clock() - self._heard < self._lost:
            return None
        told = {"ok": False, "error": f"nothing was observed for {self._lost:g} s", **self.stopped()}
        self._heard = None
        return json.dumps(finite(told), allow_nan=False)

    def stopped(self) -> dict[str, Any]:
        """Fly the certified stop inside what is known; where there is none, on to the end of the plan, at rest."""
        now = self._now()
        left = self._flown.duration - now
        if left <= BUDGETS[0]:
            return {"duration": max(left, 0.0), "note": "it is at rest, or comes to rest here"}
        try:
            change = self._planned(self._stop_from)
        except MinsnapError as error:
            return {"duration": left, "note": f"the plan is flown to its end, which is at rest: {error}"}
        return self._told(change)

    def ended(self) -> None:
        """Stop, and end the flight where that does, for no more observations come."""
        if self._flight.now is not None:
            self.stopped()
        self._flight.finish()

    @property
    def _leads_to_goal(self) -> bool:
        end = self._flown(self._flown.duration)
        return bool(np.linalg.norm(end - self._explorer.goal) <= ARRIVED)

    def _arriving(self, now: float) -> dict[str, Any]:
        """Tell that the goal is reached, or will be without a change, and end the flight there."""
        left = self._flown.duration - now
        if left > 0.0:
            return {"duration": left, "goal": True}
        self._finished = True
        self._flight.finish()
        return {"duration": 0.0, "goal": True, "arrived": True}

    def _read(self, line: str) -> dict[str, Any]:
        """Take the observation of a line; return whether that went well."""
        named: dict[str, Any] = {}
        try:
            seen = _observation_of(line)
            named = {"id": seen["id"]} if "id" in seen else {}
            points, rays = seen.get("points", []), seen.get("rays")
            position = seen["position"]
            if self._dim == 2 and isinstance(position, list):
                position = position[:2]
            self.observe(position, points, rays)
        except MinsnapError as error:
            return {**named, "ok": False, "error": str(error)}
        return {**named, "ok": True}

    def _replanned(self, now: float, budget: float) -> Change:
        """Return a change that leaves time to be handed over."""
        return self._explorer.replan(self._flown, now + HANDED_OVER, budget - HANDED_OVER)

    def _stop_from(self, now: float, budget: float) -> Change:
        change = self._replanned(now, budget)
        if change.stop is None:
            raise FlightError(f"no stop was found: {change.no_stop}")
        return replace(change, trajectory=change.stop, certified=True, kept=False)

    def _handed_over(self, change: Change) -> Trajectory:
        """Let the flight take a change, at the height of the flight where it is planned in a plane."""
        if self._dim == 3:
            return self._flight.change(change)
        stop = None if change.stop is None else self._lifted(change.stop)
        self._flight.change(replace(change, trajectory=self._lifted(change.trajectory), stop=stop))
        flown = change.trajectory if change.certified else change.stop
        assert flown is not None
        return flown

    def _lifted(self, curve: Trajectory) -> Trajectory:
        points, whole = curve.control_points, rest_of(curve)
        height = np.full((*points.shape[:2], 1), self._height)
        own = None if whole is None else (self._lifted(whole[0]), whole[1])
        return made(np.concatenate((points, height), axis=2), curve.durations, curve.pieces, curve.yaw, own)


def _warmed_up(how: Exploring, hover: Trajectory) -> None:
    """Plan once through nothing, so that what is loaded at the first plan does not delay one in flight."""
    explorer, here = how.explores(), hover(0.0)
    rays = here + np.concatenate((np.eye(how.dim), -np.eye(how.dim)))
    with suppress(MinsnapError):
        explorer.observe(here, [], rays)
        change = explorer.replan(hover, 0.0, BUDGETS[-1])
        explorer.replan(change.trajectory, 0.0, 0.5 * change.trajectory.duration)


def _observation_of(line: str) -> dict[str, Any]:
    """Return the entries of a line.

    Raises
    ------
    InputError
        If it is no observation.
    """
    try:
        seen = json.loads(line)
    except (ValueError, RecursionError):
        raise InputError(
            f"the line is {shown(line)}: give an observation in JSON, with position, points and rays"
        ) from None
    if not isinstance(seen, dict) or "position" not in seen:
        raise InputError(f"the observation is {shown(seen)}: give the position of the sensor, points and rays")
    other = [name for name in seen if name not in KEYS]
    if other:
        raise InputError(f"the observation has {shown(other[0])}: it has position, points, rays and id")
    if not isinstance(seen.get("id", ""), str | int | float):
        raise InputError(f"the id is {shown(seen['id'])}: give a text or a number")
    return seen

"""One search for a better plan ahead, from the rest of the flown plan as a guess, within some seconds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.checks import SHORTEST, check_durations, check_time
from minsnap.corridors.margins import nearest_wall
from minsnap.errors import SolverError, TimingError
from minsnap.limits.compliance import KEPT, kept_from
from minsnap.limits.limits import Limits
from minsnap.optimisation.task import Task
from minsnap.replanning.horizon import near
from minsnap.replanning.splice import Splice
from minsnap.time_allocation.allocate import looked_at, plan_timed
from minsnap.time_allocation.last_look import fault
from minsnap.time_allocation.recovery import connect_start, start_state
from minsnap.time_allocation.timing import AttachHeading, Timing
from minsnap.time_allocation.ways import from_end, joined, shortest_from
from minsnap.trajectory.trajectory import Trajectory

EQUAL_TIMES = 1e-9
"""Relative difference of times that counts as none."""


@dataclass(frozen=True, eq=False)
class Aim:
    """What is minimised, and how long it may take.

    Parameters
    ----------
    limits : Limits or None
    durations : array_like, shape (legs,), or None
        Of the legs ahead [s].
    total_time : float or None
        Of all legs ahead [s].
    """

    limits: Limits | None = None
    durations: npt.ArrayLike | None = None
    total_time: float | None = None

    @classmethod
    def of(cls, limits: Limits | None, durations: npt.ArrayLike | None, total_time: Any, legs: int) -> Aim:
        """Check what a caller asks for, or raise TimingError."""
        times = None if durations is None else check_durations(durations, legs)
        return cls(limits, times, None if total_time is None else check_time("total_time", total_time, TimingError))

    @property
    def timed(self) -> bool:
        """Whether the time is what is minimised."""
        return self.durations is None and self.total_time is None

    def value(self, curve: Trajectory) -> float:
        """Objective of a curve: its duration [s], or its cost."""
        return curve.duration if self.timed else curve.cost()

    def compares(self, rest: Trajectory) -> bool:
        """Whether a rest takes the requested time."""
        if self.durations is not None:
            durations = np.asarray(self.durations, dtype=np.float64)
            own = np.diff(rest.leg_breaks)
            return durations.shape == own.shape and bool(np.allclose(own, durations, rtol=EQUAL_TIMES, atol=0.0))
        return self.total_time is None or abs(rest.duration - self.total_time) <= EQUAL_TIMES * self.total_time

    def after(self, left: float) -> Aim | None:
        """Return the conditions of the legs after the first, if that may be flown in ``left`` seconds; None if not."""
        if self.durations is not None:
            first, *others = np.asarray(self.durations, dtype=np.float64).ravel()
            same = bool(others) and np.isclose(first, left, rtol=EQUAL_TIMES, atol=0.0)
            return replace(self, durations=others) if same else None
        if self.total_time is None:
            return self
        rest = self.total_time - left
        return replace(self, total_time=rest) if rest >= SHORTEST else None

    def timing(self, seconds: float) -> Timing:
        """Return how durations are chosen within a time [s]."""
        limit = seconds if self.timed else None
        return Timing(self.durations, self.total_time, self.limits, time_limit=limit)


@dataclass(frozen=True, eq=False)
class Better:
    """A plan, and from when on it keeps the limits and is inside [s]."""

    curve: Trajectory
    limits_from: float = 0.0
    inside_from: float = 0.0


def search_ahead(task: Task, aim: Aim, finish: AttachHeading, guess: Trajectory | None, seconds: float) -> Better:
    """Search from a start inside its corridor.

    Parameters
    ----------
    task : Task
    aim : Aim
    finish : callable
        Gives a curve its yaw.
    guess : Trajectory or None
        From the same start through as many legs.
    seconds : float
        After which the search ends with the best that it has.

    Raises
    ------
    InfeasibleError, SolverError, LimitError
        If none was found.
    """
    timing = aim.timing(seconds)
    timing.check()
    task.deadline.check()
    if aim.timed and aim.limits is not None:
        timed = looked_at(shortest_from(task, aim.limits, timing, finish, guess), task, timing)
    else:
        timed = plan_timed(task, timing, finish)
    return Better(timed.trajectory, timed.limits_from)


def search_back(task: Task, aim: Aim, finish: AttachHeading, seconds: float) -> Better:
    """Search from a start outside its corridor: the shortest way back first; like ``search_ahead`` otherwise."""
    assert aim.limits is not None
    way = connect_start(start_state(task), task.walls, aim.limits, task.deadline)
    if way is None:
        raise SolverError("no way back into the corridor of leg 0 was found: stop, or widen it")
    ahead = search_ahead(from_end(task, way), aim, finish, None, seconds)
    whole = finish(joined(way.piece, ahead.curve))
    start = way.piece.duration * (1.0 + KEPT)
    limited, inside = kept_from(aim.limits, whole), inside_from(whole, task)
    if max(limited, inside) > start:
        raise SolverError("the way back into the corridor could not be certified: stop, or widen it")
    return seen_joined(Better(whole, limited, inside), replace(task, walls=()), Aim())


def seen_joined(better: Better, task: Task, aim: Aim) -> Better:
    """Return parts that were looked at alone, once their whole is seen to go on without a jump and to be inside.

    Limits are proved of the parts: what is left of a leg has few digits of its derivatives.

    Raises
    ------
    SolverError
        If a waypoint, a joint, the state at the start, a time or a wall is not kept.
    """
    times = aim.durations if aim.total_time is None else float(aim.total_time)
    near_task = near(task, None, better.curve.legs, None, None).task
    wrong = fault(near_task, better.curve, None, times)  # type: ignore[arg-type]
    if wrong is not None:
        raise SolverError(f"the plan is refused at the last look: {wrong}; please report this replan")
    return better


def inside_from(curve: Trajectory, task: Task) -> float:
    """First instant from which a curve is inside all walls to the end [s], by bisection on its first leg."""
    low, high = 0.0, float(curve.leg_breaks[1])
    if _inside_after(curve, task, 0.0):
        return 0.0
    while high - low > 1e-9 * curve.duration:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _inside_after(curve, task, middle) else (middle, high)
    return high


def _inside_after(curve: Trajectory, task: Task, start: float) -> bool:
    rest = Splice(curve, start, task.half).rest
    assert rest is not None
    nearest = nearest_wall(rest, [wall for wall in task.walls if wall.order == 0])
    return nearest is None or nearest.value >= 0.0

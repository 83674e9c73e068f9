"""What is searched: the first legs of a long course, with walls moved inwards; later legs stay as flown, or wait.

Walls that are measured anew shift: a curve that was planned with some clearance from them stays inside.

The little that is left of a leg is flown on as it is: the control points of a polynomial of duration h lie so close
together that its derivatives of order p have the rounding of positions divided by h^p, so a new plan begins at the
waypoint.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from math import inf
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import SHORTEST, check_durations, check_time
from minsnap.basics.deadline import LateError
from minsnap.basics.tolerances import EXACT
from minsnap.certificate import continuity
from minsnap.corridors.constraint import Walls, walls_from
from minsnap.corridors.margins import margin_to
from minsnap.durations.allocate import plan_timed, require_kept
from minsnap.durations.connector import CONNECTOR, connect_start, pinned_state, state_use
from minsnap.durations.least_cost import distance_split
from minsnap.durations.timing import Timing
from minsnap.durations.ways import from_end, joined, shortest_from
from minsnap.errors import SolverError, TimingError
from minsnap.last_look import fault
from minsnap.limits.compliance import KEPT, first_from, keeps, kept_from, turns_within
from minsnap.limits.limits import Limits
from minsnap.optimisation.task import AttachHeading, Task
from minsnap.replanning.splice import Splice, divided
from minsnap.trajectory.report import Progress, Step
from minsnap.trajectory.trajectory import Trajectory, as_rest_of, made, turned

SHARE = 1.0 - 1e-6
"""Of the room that a waypoint has: what is taken of it at most."""

MOST = 0.9
"""Of the radius of a ball: what is taken of it at most."""


@dataclass(frozen=True, eq=False)
class Near:
    """The part of a task that is planned.

    Parameters
    ----------
    task : Task
        The first legs, up to rest or to where ``tail`` begins.
    aim : Aim
        Of these legs.
    guess : Trajectory or None
        What is flown on these legs.
    tail : Trajectory or None
        What is flown after them.
    """

    task: Task
    aim: Aim
    guess: Trajectory | None
    tail: Trajectory | None


def joined_with(curve: Trajectory, tail: Trajectory, finish: AttachHeading) -> Trajectory:
    """Fly a curve through the first legs, then the tail."""
    pieces = max(curve.pieces, tail.pieces)
    return finish(grouped(curve, pieces).then(grouped(tail, pieces)))


def near(task: Task, aim: Aim, legs: int | None, rest: Trajectory | None, flown: Trajectory | None) -> Near:
    """Return the part of a task that is planned.

    Parameters
    ----------
    task : Task
    aim : Aim
        Of all legs.
    legs : int or None
        Number of legs; None for all.
    rest : Trajectory or None
        What is flown through all waypoints of the task; the plan then joins it, where it is inside and keeps the limits
        and the requested times beyond the horizon, and later than there where it is on a limit: a search needs a way to
        such a state.
    flown : Trajectory or None
        What is flown, wherever it passes: the first guess.
    """
    limits = aim.limits
    if legs is not None and rest is not None and limits is not None:
        states = (rest.states(float(rest.leg_breaks[leg]), task.half) for leg in range(legs, rest.legs))
        uses = (state_use(state, limits) for state in states)
        legs += sum(1 for _ in takewhile(lambda use: 1.0 - CONNECTOR.on_limit < use <= 1.0 + KEPT, uses))
    if legs is None or task.legs <= legs:
        return Near(task, aim, flown, None)
    head = legs_of(flown, 0, legs) if flown is not None and flown.legs >= legs else None
    tail = None
    if rest is not None:
        tail = legs_of(rest, legs, rest.legs)
        inside = room_of(tail, walls_from(task.walls, legs, task.legs)) >= 0.0
        in_time = aim.with_last(tail)
        tail = tail if inside and in_time and (within(rest, limits) or within(tail, limits)) else None
    return Near(_first(task, legs, tail), aim.of_first(task, legs, tail), head, tail)


def _first(task: Task, legs: int, tail: Trajectory | None) -> Task:
    if tail is None:
        state = np.concatenate((task.waypoints[legs : legs + 1], np.zeros((task.half - 1, task.dim))))
    else:
        state = tail.states(0.0, task.half)
    return part_of(task, 0, legs, {legs: state})


def part_of(task: Task, first: int, last: int, states: Mapping[int, FloatArray]) -> Task:
    """Return the legs of a task between two waypoints, with states (k, dim) prescribed at some of these."""
    points, lower, upper = (array[first : last + 1].copy() for array in (task.waypoints, task.lower, task.upper))
    pins = {knot - first: pinned for knot, pinned in task.pins.items() if first <= knot <= last}
    regions = {knot - first: region for knot, region in task.regions.items() if first <= knot <= last}
    for knot, state in states.items():
        points[knot - first], lower[knot - first], upper[knot - first] = state[0], 0.0, 0.0
        pins[knot - first] = {order: state[order] for order in range(1, task.half)}
        regions.pop(knot - first, None)
    for array in (points, lower, upper):
        array.flags.writeable = False
    walls = walls_from(task.walls, first, last)
    return replace(task, waypoints=points, lower=lower, upper=upper, pins=pins, walls=walls, regions=regions)


def as_smooth(task: Task, flown: Trajectory) -> Task:
    """Return a task with no more continuous derivatives, at its ends too, than a curve has that is flown on."""
    order = min(task.continuity, continuity(flown))
    pins = {
        knot: {each: state for each, state in pinned.items() if each <= order} for knot, pinned in task.pins.items()
    }
    return task if order == task.continuity else replace(task, continuity=order, pins=pins)


def legs_of(curve: Trajectory, first: int, last: int) -> Trajectory:
    """Return the polynomials of legs from ``first`` to before ``last``."""
    part = slice(first * curve.pieces, last * curve.pieces)
    points, durations = curve.control_points[part], curve.durations[part]
    return made(points, durations, curve.pieces)


def grouped(curve: Trajectory, pieces: int) -> Trajectory:
    """Return the same curve with more pieces on each leg: the first one of each is divided equally."""
    parts = pieces - curve.pieces + 1
    if parts == 1:
        return curve
    points, durations = [], []
    for leg in range(curve.legs):
        own = slice(leg * curve.pieces, (leg + 1) * curve.pieces)
        first, *rest = curve.control_points[own]
        points += [*divided(first, parts), *rest]
        durations += [np.repeat(curve.durations[own.start] / parts, parts), curve.durations[own][1:]]
    return Trajectory(np.stack(points), np.concatenate(durations), curve.yaw, pieces)


def moved_inwards(walls: Sequence[Walls], points: FloatArray, clearance: float) -> list[Walls]:
    """Return walls on positions moved inwards, less where a waypoint of their leg has less room.

    Parameters
    ----------
    walls : sequence of Walls
    points : ndarray, shape (n, dim)
        Start and waypoints [m].
    clearance : float
        [m]
    """
    return [_moved(wall, points, clearance) if wall.order == 0 and clearance else wall for wall in walls]


def _moved(wall: Walls, points: FloatArray, clearance: float) -> Walls:
    ends = np.stack((points[wall.leg], points[wall.leg + 1]), axis=1)
    slack = wall.slack(ends).min(axis=1)
    size = clearance * np.linalg.norm(wall.slope, axis=1) if wall.flat else np.full(len(slack), clearance)
    inwards = np.minimum(SHARE * np.maximum(slack, 0.0), size)
    return replace(wall, radius=wall.radius - (inwards if wall.flat else np.minimum(inwards, MOST * wall.radius)))


@dataclass(frozen=True, eq=False)
class Aim:
    """What is minimised, and how long it may take.

    Parameters
    ----------
    limits : Limits or None
    durations : ndarray, shape (legs,), or None
        Of the legs ahead [s].
    total_time : float or None
        Of all legs ahead [s].
    """

    limits: Limits | None = None
    durations: FloatArray | None = None
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

    def like(self, other: Aim) -> bool:
        """Whether another gives as much: the times of legs, their total, or neither."""
        return (self.durations is None, self.total_time is None) == (other.durations is None, other.total_time is None)

    def value(self, curve: Trajectory) -> float:
        """Objective of a curve: its duration [s], or its cost."""
        return curve.duration if self.timed else curve.cost()

    def compares(self, rest: Trajectory) -> bool:
        """Whether a rest takes the requested time."""
        if self.durations is not None:
            own = np.diff(rest.leg_breaks)
            return self.durations.shape == own.shape and bool(np.allclose(own, self.durations, rtol=EXACT, atol=0.0))
        return self.total_time is None or abs(rest.duration - self.total_time) <= EXACT * self.total_time

    def after(self, left: float) -> Aim | None:
        """Return the conditions of the legs after the first, if that may be flown in ``left`` seconds; None if not."""
        if self.durations is not None:
            others = self.durations[1:]
            same = len(others) > 0 and np.isclose(self.durations[0], left, rtol=EXACT, atol=0.0)
            return replace(self, durations=others) if same else None
        if self.total_time is None:
            return self
        rest = self.total_time - left
        return replace(self, total_time=rest) if rest >= SHORTEST else None

    def later(self, spent: float) -> Aim | None:
        """Return the conditions of what is left of the same legs after ``spent`` seconds; None if nothing is left."""
        if self.durations is not None:
            left = self.durations - spent * (np.arange(len(self.durations)) == 0)
            return replace(self, durations=left) if left[0] >= SHORTEST else None
        return self.after(spent)

    def with_last(self, tail: Trajectory) -> bool:
        """Whether the last legs may be flown so: in their durations, or in less than the total time."""
        if self.durations is not None:
            return replace(self, durations=self.durations[-tail.legs :]).compares(tail)
        return self.after(tail.duration) is not None

    def of_first(self, task: Task, legs: int, tail: Trajectory | None) -> Aim:
        """Return the conditions of the first legs: of a total what the tail leaves, or else their share by length."""
        if self.durations is not None:
            return replace(self, durations=self.durations[:legs])
        if self.total_time is None:
            return self
        shares = distance_split(task, self.total_time)[:legs].sum()
        return replace(self, total_time=float(shares) if tail is None else self.total_time - tail.duration)

    def timing(self, due: float, flown: float) -> Timing:
        """Return how durations are chosen until an instant, to fly less than a time [s]."""
        timing = Timing(self.durations, self.total_time, self.limits)
        return replace(timing, due=due, progress=_patience(flown)) if self.timed else timing


@dataclass(frozen=True, eq=False)
class Better:
    """A plan, and from when on it keeps the limits and is inside [s]."""

    curve: Trajectory
    limits_from: float = 0.0
    inside_from: float = 0.0


class NotShorterError(LateError):
    """A search ended because it promises nothing shorter than what is flown."""


@dataclass(frozen=True)
class SearchPatience:
    """When a search is begun, and when it ends, that must beat what is flown.

    Parameters
    ----------
    touching : float
        Share of its width: walls farther away than that have no part in where a search ends.
    recent : float
        Share of the flight ahead after which is searched again although no wall that matters has changed: a polynomial
        that is to be flown through less of its leg can be a faster one.
    least, most : int
        Iterations after which it may end, and for which it may be longer.
    each : float
        Share by which it may be longer for each iteration that is left of these, and must be shorter for each beyond.
    """

    touching: float = 0.01
    recent: float = 0.15
    least: int = 8
    most: int = 20
    each: float = 2e-5


PATIENCE = SearchPatience()


def _patience(flown: float) -> Progress:
    """Return what ends a search that promises nothing shorter than a time [s]."""

    def end(step: Step) -> None:
        allowed = flown * (1.0 + PATIENCE.each * (PATIENCE.most - step.evaluation))
        if step.evaluation > PATIENCE.least and step.total_time > allowed:
            raise NotShorterError("nothing better was found")

    return end


def search_ahead(
    task: Task, aim: Aim, finish: AttachHeading, guess: Trajectory | None, seconds: float, flown: float = inf
) -> Better:
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
    flown : float
        What the plan must be shorter than, where times are free [s].

    Raises
    ------
    InfeasibleError, SolverError, LimitError
        If none was found.
    """
    timing, task = aim.timing(task.deadline.clock() + seconds, flown), replace(task, finish=finish)
    timing.check()
    task.deadline.check()
    if aim.timed and aim.limits is not None:
        timed = require_kept(shortest_from(task, timing, guess, again=False).plan(), task, timing)
    else:
        timed = plan_timed(task, timing)
    return Better(timed.trajectory, timed.limits_from)


def search_back(task: Task, aim: Aim, finish: AttachHeading, seconds: float) -> Better:
    """Search from a start outside its corridor: the shortest way back first; like ``search_ahead`` otherwise."""
    assert aim.limits is not None
    way = connect_start(pinned_state(task), task.walls, aim.limits, task.deadline)
    if way is None:
        raise SolverError("no way back into the corridor of leg 0 was found: stop, or widen it")
    later = aim.later(way.duration)
    if later is None:
        raise SolverError(f"the way back into the corridor of leg 0 takes {way.duration:.3g} s: give more time")
    ahead = search_ahead(from_end(task, way), later, finish, None, seconds)
    whole = finish(joined(way, ahead.curve))
    start = way.duration * (1.0 + KEPT)
    limited, inside = kept_from(aim.limits, whole), inside_from(whole, task)
    if max(limited, inside) > start:
        raise SolverError("the way back into the corridor could not be certified: stop, or widen it")
    return seen_joined(Better(whole, limited, inside), replace(task, walls=()), aim)


def seen_joined(better: Better, task: Task, aim: Aim) -> Better:
    """Return parts that were looked at alone, once their whole is seen to go on without a jump and to be inside.

    Limits are proved of the parts: what is left of a leg has few digits of its derivatives.

    Raises
    ------
    SolverError
        If a waypoint, a joint, the state at the start, a time or a wall is not kept.
    """
    legs = better.curve.legs
    times = aim.durations[:legs] if aim.durations is not None else aim.total_time if legs == task.legs else None
    near_task = near(task, Aim(), legs, None, None).task
    wrong = fault(near_task.conditions, better.curve, None, times)
    if wrong is not None:
        raise SolverError(f"the plan is refused at the last look: {wrong}; please report this replan")
    return better


def inside_from(curve: Trajectory, task: Task) -> float:
    """First instant from which a curve is inside all walls to the end [s], by bisection on its first leg."""
    places = [wall for wall in task.walls if wall.order == 0]

    def inside(start: float) -> bool:
        rest = Splice(curve, start, task.half).rest
        return rest is not None and room_of(rest, places) >= 0.0

    return first_from(inside, float(curve.leg_breaks[1]), 1e-9 * curve.duration)


def room_of(curve: Trajectory, walls: Sequence[Walls]) -> float:
    """Proved least distance of a curve to the walls of its legs [m], negative outside."""
    return room_beside(curve, walls, 0.0)[0]


def room_beside(curve: Trajectory, walls: Sequence[Walls], clearance: float) -> tuple[float, bool]:
    """Room of a curve, and whether it touches no wall, where it was searched with a clearance from walls [m]."""
    least, free = inf, True
    for wall in walls_from(walls, 0, curve.legs):
        if not len(wall.leg):
            continue
        room = margin_to(curve, wall).value
        least, free = min(least, room), free and room > _touching(wall, clearance)
    return least, free


def _touching(wall: Walls, clearance: float) -> float:
    """Slack up to which a curve touches one of these walls, in the unit of their slopes."""
    moved = clearance * (float(np.linalg.norm(wall.slope, axis=1).max(initial=0.0)) if wall.flat else 1.0)
    return moved * (wall.order == 0) + PATIENCE.touching * float(wall.width.min(initial=inf))


def within(curve: Trajectory, limits: Limits | None, start: float = 0.0) -> bool:
    """Whether a curve keeps all limits from an instant on [s]."""
    return limits is None or keeps(limits, curve, start)


LITTLE = 0.1
"""Share of a leg, or of the next one if that is longer, below which what is left of it is flown on."""


@dataclass(frozen=True, eq=False)
class LegEnd:
    """What is left of a leg.

    Parameters
    ----------
    splice : Splice
    leg : Trajectory
        The whole leg.
    instant : float
        The splice on its clock [s].
    left : Trajectory
        What is left of it, with the flown heading.
    """

    splice: Splice
    leg: Trajectory
    instant: float
    left: Trajectory

    @property
    def after(self) -> Splice:
        """The instant of the waypoint."""
        return replace(self.splice, instant=self.splice.instant + self.left.duration)

    @property
    def state(self) -> FloatArray:
        """Derivatives 0 ... k - 1 at its end, (k, dim): the next leg may begin with others, of an order that jumps."""
        return self.leg.states(self.leg.duration, self.splice.half)

    def within(self, limits: Limits | None) -> bool:
        """Whether it keeps the limits; the last tenth of the leg at least is judged: its polynomial has more digits."""
        begin = min(self.instant, (1.0 - LITTLE) * self.leg.duration)
        judged = Splice(self.leg, begin, self.splice.half).rest or self.left
        return within(judged, limits) and turns_within(limits, self.left)

    def before(self, curve: Trajectory) -> Trajectory:
        """Fly it, then a curve from its end."""
        pieces = max(self.leg.pieces, curve.pieces)
        leg, left, following = (grouped(part, pieces) for part in (self.leg, self.left, curve))
        return as_rest_of(left.then(following), leg.then(following), self.instant)


def leg_end_of(splice: Splice) -> LegEnd | None:
    """Return the rest of the leg in flight if it is short; None otherwise."""
    rest, (whole, at) = splice.rest, splice.source
    if rest is None:
        return None
    index = whole.legs - rest.legs
    if rest.leg_breaks[1] >= LITTLE * np.diff(whole.leg_breaks[index : index + 3]).max():
        return None
    leg, left = legs_of(whole, index, index + 1), legs_of(rest, 0, 1)
    return LegEnd(splice, leg, at - float(whole.leg_breaks[index]), turned(rest, left, 0.0))


def flown_on(splice: Splice, task: Task, limits: Limits | None) -> LegEnd | None:
    """Return the end of a leg that is flown on: it passes its waypoint inside the walls of the leg and the limits."""
    end = leg_end_of(splice)
    if end is None or task.legs < 2 or not _meets(task, end.left.control_points[-1, -1]):
        return None
    return end if room_of(end.left, task.walls) >= 0.0 and end.within(limits) else None


def rest_within(splice: Splice, limits: Limits | None) -> bool:
    """Whether the rest of the flown plan keeps the limits."""
    rest = splice.rest
    if rest is None or within(rest, limits):
        return rest is not None
    end = leg_end_of(splice)
    if end is None or not end.within(limits):
        return False
    return rest.legs == 1 or within(turned(rest, legs_of(rest, 1, rest.legs), float(rest.leg_breaks[1])), limits)


def _meets(task: Task, position: FloatArray) -> bool:
    """Whether a position is in the region of the first waypoint ahead."""
    offset, rounding = position - task.waypoints[1], EXACT * float(np.abs(task.waypoints).max())
    if 1 in task.regions and task.regions[1].excess(offset) > rounding:
        return False
    return bool((np.maximum(offset - task.upper[1], task.lower[1] - offset) <= rounding).all())


def after_first_leg(curve: Trajectory | None) -> Trajectory | None:
    """Return a curve without its first leg; None if it has no other."""
    return None if curve is None or curve.legs == 1 else legs_of(curve, 1, curve.legs)

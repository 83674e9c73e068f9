"""The Replanner: changes of a plan that is being flown, each within its budget, with a memory of the last one."""

from __future__ import annotations

import gc
import operator
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_distance, check_pieces
from minsnap.basics.deadline import Clock, Deadline, LateError, Stopwatch, checked_clock
from minsnap.basics.messages import explains_names
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.boxes import Room, as_room
from minsnap.corridors.constraint import Constraint
from minsnap.corridors.keep_out import Avoided, as_obstacles
from minsnap.corridors.moving import Moving
from minsnap.corridors.obstacle_margins import nearest_obstacle
from minsnap.corridors.tubes import as_constraints
from minsnap.durations.stopping import Stopping
from minsnap.errors import CorridorError, InfeasibleError, InputError, LimitError, SolverError, TimingError
from minsnap.limits.compliance import largest_use
from minsnap.limits.limits import Limits
from minsnap.optimisation.task import AttachHeading, Task
from minsnap.planning.around import plan_around
from minsnap.planning.planner import plan
from minsnap.replanning import course_ahead, horizon
from minsnap.replanning.horizon import Aim, Better, Near, NotShorterError
from minsnap.replanning.memory import UNCHANGED, Change, Memory, Takes, due_of, leg_start_of
from minsnap.replanning.splice import Splice, braked, ends_at_rest, has_angles, splice_of, spliced, through_angles
from minsnap.trajectory.trajectory import Trajectory
from minsnap.vehicle import Quadrotor

FULL = 1.0 - 2e-3
"""Use of a limit above which a plan counts as made for these limits."""

GAIN = 1e-6
"""Relative gain of the objective below which the rest is kept."""

SPLIT_GAIN = 1e-2
"""The same for a total time, where it is not known what the rest was planned for."""

AFTER_STOP, CLOSING = 0.1, 0.5
"""Shares of the budget left after the stop, and after the last instant at which a search may end, until it is known how
long its certified end and what follows it take."""

IN_THE_WAY = "an obstacle is in the way of the stop"
NO_STOP = "no way to hover inside leg 0 and the limits was found from this state"
LATE_STOP = "the time was over before a way to hover was found"
"""Why there is no stop."""


@dataclass(frozen=True, eq=False)
class _Call:
    """One call, checked."""

    splice: Splice
    due: float
    course: course_ahead.CourseAhead
    aim: Aim
    seconds: float
    deadline: Deadline
    watch: Stopwatch
    angles: FloatArray | None
    given: tuple[Avoided, ...] = ()

    @property
    def avoid(self) -> tuple[Avoided, ...]:
        """The obstacles, those that move on a clock that begins at the splice."""
        begin = self.splice.instant
        return tuple(each.after(begin) if isinstance(each, Moving) else each for each in self.given)

    def passes(self, curve: Trajectory) -> bool:
        """Whether a curve from the splice on keeps out of all obstacles."""
        return not self.avoid or nearest_obstacle(curve, self.avoid).value >= -EXACT


@explains_names({"search": "budget= of replan"}, positional=2, last="0.3")
class Replanner:
    """Replans in flight.

    Parameters
    ----------
    limits : Limits, optional
        Limits of the shortest plan, which is made where neither durations nor a total time are set.
    corridor : float, Constraint or sequence of Constraint, optional
        As for ``plan``; one per leg ahead.
    room : Room or pair of corners, optional
        Room of all legs, besides the corridor.
    vehicle : Quadrotor, optional
        Vehicle whose rotor limits are kept too (``Limits.of``).
    yaw : float, "velocity", "tilt", optional
        Heading of new plans, reached smoothly from the flown one. By default the heading at the splice is held, unless
        :meth:`replan` gets one per waypoint.
    recover : float
        Distance by which a start may be outside the walls of its leg [m]; the plan then flies back first.
    clearance : float
        Distance of new plans to the walls, where waypoints and start allow it [m]. The plan then stays inside if walls
        are measured again and shift by as much.
    horizon : int, optional
        Number of legs to plan. After them the flown plan continues, or the new one ends at rest.
    degree : int
        7, 9 or 11.
    pieces : int
        Polynomials per leg.
    clock : callable
        Reads a monotonic clock [s]; a simulated one in tests.

    Raises
    ------
    DegreeError, LimitError, CorridorError, YawError, InputError
        If an argument is malformed.
    """

    def __init__(
        self,
        limits: Limits | None = None,
        corridor: npt.ArrayLike | Constraint | Any = None,
        *,
        room: Room | Sequence[npt.ArrayLike] | None = None,
        vehicle: Quadrotor | None = None,
        yaw: float | str | None = None,
        recover: float = 0.0,
        clearance: float = 0.0,
        horizon: int | None = None,
        degree: int = 7,
        pieces: int = 1,
        clock: Clock = time.monotonic,
    ) -> None:
        self._half, self._pieces = course_ahead.check_half(degree), check_pieces(pieces)[0]
        self._limits = course_ahead.all_limits(limits, vehicle)
        self._corridor, self._room = as_constraints(corridor), as_room(room)
        self._chosen = course_ahead.replan_heading(yaw, self._limits)
        self._recover = check_distance("recover", recover, InputError)
        self._clearance = check_distance("clearance", clearance, InputError)
        self._horizon = course_ahead.check_horizon(horizon)
        self._clock, self._lock = checked_clock(clock), threading.Lock()
        self._memory: Memory | None = None
        self._takes = Takes()
        self._avoided: tuple[Avoided, ...] = ()
        _wake()

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the lock: a copy has its own."""
        return {name: value for name, value in vars(self).items() if name != "_lock"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, _lock=threading.Lock())

    @property
    def limits(self) -> Limits | None:
        """The limits that new plans keep, those of the vehicle with them."""
        return self._limits

    def replan(
        self,
        flown: Trajectory,
        now: float,
        waypoints: npt.ArrayLike | None = None,
        budget: float = 0.02,
        *,
        boxes: Constraint | None = None,
        corridor: npt.ArrayLike | Constraint | Any = None,
        goal: npt.ArrayLike | None = None,
        durations: npt.ArrayLike | None = None,
        total_time: float | None = None,
        yaw: npt.ArrayLike | None = None,
        began: float | None = None,
        avoid: Avoided | Sequence[Avoided] | None = None,
    ) -> Change:
        """Return what to fly from ``now + budget`` on, and how to stop from there.

        Parameters
        ----------
        flown : Trajectory
            What is being flown.
        now : float
            Instant of this call on its clock, 0 at its start [s].
        waypoints : array_like, shape (n, dim), optional
            Still to be passed [m], without the position now.
        budget : float
            Seconds from ``now`` to the splice, within which the answer comes.
        boxes : Boxes or Polytopes, optional
            One per leg ahead, the first around the splice; instead of waypoints, or with them.
        corridor : float, Constraint or sequence of Constraint, optional
            For this call instead of the replanner's own.
        goal : array_like, shape (dim,), optional
            Without waypoints; by default the end of the flown plan [m].
        durations : array_like, shape (n,), optional
            Of the legs ahead [s]: least cost instead of least time.
        total_time : float, optional
            Of all legs ahead [s], divided for the least cost. With a horizon its legs have what the flown ones beyond
            leave of it, or their share by length where they end at rest.
        yaw : array_like, shape (n,), optional
            Heading at each waypoint ahead [rad], of which whole turns do not count: a spline through them that begins
            with the flown heading and its rate at the splice.
        began : float, optional
            Reading of the clock at time 0 of ``flown``: the answer is then due at ``began + now + budget``.
        avoid : obstacle or sequence of obstacles, optional
            To keep out of, as ``plan`` takes them: those that move, on the clock of ``flown``. What is kept and a stop
            keep out of them too; where the stop does not, there is none. A way around takes longer than the rest: give
            a budget of 0.2 s and more.

        Returns
        -------
        Change

        Raises
        ------
        TimingError
            If ``now`` is beyond a flown plan that does not end at rest, the splice has passed, or the budget is below
            what a stop plan takes.
        WaypointError, CorridorError, YawError
            If what is ahead is malformed, outside its walls, or the start is further outside than ``recover``.
        InputError
            If another thread is inside this replanner, or the clock reads no number.
        """
        if not self._lock.acquire(blocking=False):
            raise InputError("this Replanner is at work for another thread: use one per thread, or one after the other")
        collects = gc.isenabled()
        gc.disable()  # one collection of garbage takes longer than an answer
        try:
            watch = Stopwatch(self._clock)
            splice = splice_of(flown, now, budget, self._half)
            now, budget = float(now), float(budget)
            due = due_of(watch.began, now, budget, began)
            if self._memory is not None and self._memory.answer is not flown:
                self._memory = None
            self._refuse_short(budget)
            own = self._corridor if corridor is None else as_constraints(corridor)
            walls, start = [*as_constraints(boxes), *own, *self._room], leg_start_of(splice, self._memory)
            course = course_ahead.course_ahead(splice, waypoints, goal, start, walls, self._pieces)
            course_ahead.refuse_outside(course, self._recover)
            aim = Aim.of(self._limits, durations, total_time, course.task.legs)
            angles = course_ahead.waypoint_angles(yaw, course.task.legs)
            closing = self._takes.most("closing", CLOSING * budget)
            deadline = Deadline(due - closing, self._clock, self._takes.most("check"))
            return self._answer(_Call(splice, due, course, aim, budget, deadline, watch, angles, as_obstacles(avoid)))
        finally:
            if collects:
                gc.enable()
            self._lock.release()

    def _answer(self, call: _Call) -> Change:
        """Stop first, then the rest, then something better."""
        if call.aim.timed and self._limits is None:
            raise TimingError("nothing says how fast to fly: give limits to the Replanner, or durations or total_time")
        # What an answer must have comes first, so that the budget may end at any instant from there on: a way to stop,
        # then what is left of the flown plan, judged anew, and only then a search for something better.
        splice, task = call.splice, call.course.task
        stops, (room, free) = self._stop_first(call)
        safe = room >= 0.0 and (not call.avoid or splice.rest is None or call.passes(splice.rest))
        if stops[0] is not None and not call.passes(stops[0]):
            stops = None, IN_THE_WAY
        rest = splice.rest if call.course.fits(splice.rest) else None
        standing = self._with_angles(call, rest) if rest is not None and safe else None
        memory, better, settled = self._memory, None, True
        same = len(call.avoid) == len(self._avoided) and all(map(operator.is_, call.given, self._avoided))
        self._avoided = call.given
        reason = "" if standing is None or not same else self._unchanged(call, standing, free)
        since = inf if memory is None else memory.since + splice.instant
        if not reason:
            better, settled, reason = self._searched(call, rest, standing is not None)
            since = 0.0
        chosen, reason = self._chosen_of(call, standing, better, reason)
        if chosen is None and standing is not None and standing is not rest:
            chosen, reason = Better(standing), "" if call.aim.compares(standing) else reason
        if chosen is not None:
            free = horizon.room_beside(chosen.curve, task.walls, self._clearance)[1]
        change = self._change(call, chosen, stops, safe, reason)
        guess = None if better is None or chosen is not None else better.curve
        start = leg_start_of(splice, memory)
        self._memory = Memory(change.trajectory, start, task, call.aim, settled, since, free, guess)
        for part, taken in (("check", call.deadline.longest), ("closing", call.deadline.since)):
            self._takes.add(part, taken) if call.deadline.longest else self._takes.skip(part)
        return change

    def _refuse_short(self, seconds: float) -> None:
        """Raise TimingError for a budget below the processor time that a stop plan takes, as far as is known."""
        takes = self._takes.usual("stop")
        if takes > seconds:
            self._takes.skip("stop")
            raise TimingError(
                f"the budget is {seconds:.3g} s and a stop plan takes {takes:.3g} s here: give at least "
                f"{2.0 * takes:.2g} s"
            )

    def _stop_first(self, call: _Call) -> tuple[tuple[Trajectory | None, str], tuple[float, bool]]:
        """Return a way to hover, or None and why there is none; and the room of what is left of the plan."""
        until = Deadline(call.due - AFTER_STOP * call.seconds, self._clock)
        stopping = Stopping(replace(call.course.task, finish=self._held(call.splice)), self._limits, until)
        (stop, no_stop), room = self._stop(call, stopping.braking), self._room_of_rest(call)
        if stop is None and room[0] >= 0.0 and ends_at_rest(call.splice.flown):
            stop = call.splice.rest
        known, late = self._takes.usual("stop"), stop is None and no_stop == LATE_STOP
        self._takes.add("stop", call.watch.seconds)
        if late or not known:
            self._refuse_short(call.seconds)
        if late:
            raise TimingError(f"the budget of {call.seconds:.3g} s was over before a stop plan was found: replan again")
        if stop is None:
            until.resume()
            stop, no_stop = self._stop(call, stopping.aside)
        return (stop, no_stop), room

    def _stop(self, call: _Call, way: Callable[[], Trajectory | None]) -> tuple[Trajectory | None, str]:
        """Return a stop, or None and why there is none."""
        try:
            stop = way()
        except LateError:
            return None, LATE_STOP
        return stop, NO_STOP if stop is None else ""

    def _held(self, splice: Splice) -> AttachHeading:
        """Return the function that gives a stop its heading, so that limits are judged with it."""
        return lambda stop: stop.with_yaw(braked(splice.flown, splice.instant, stop))

    def _room_of_rest(self, call: _Call) -> tuple[float, bool]:
        """Room of the rest in all walls ahead, leg by leg, wherever the waypoints are; negative if it is not safe.

        And whether it touches none of them.
        """
        rest, task, outside = call.splice.rest, call.course.task, call.course.outside
        if rest is None or rest.legs != task.legs or outside or not horizon.rest_within(call.splice, self._limits):
            return -inf, False
        return horizon.room_beside(rest, task.walls, self._clearance)

    def _with_angles(self, call: _Call, rest: Trajectory) -> Trajectory | None:
        """Return a rest with the requested headings at the waypoints; None where it does not keep the limits so."""
        if has_angles(rest, call.angles):
            return rest
        turned = self._finish(call, call.splice)(rest)
        return turned if horizon.within(turned, self._limits) else None

    def _unchanged(self, call: _Call, rest: Trajectory, free: bool) -> str:
        """Say that a certified rest was planned for the same: by memory, its durations or its use of limits; or "".

        Parameters
        ----------
        call : _Call
        rest : Trajectory
        free : bool
            Whether it touches no wall.
        """
        memory, known = self._memory, call.aim.compares(rest)
        if memory is not None:
            if not (known and memory.aim.like(call.aim)):
                return ""
            legs = min(self._horizon or rest.legs, rest.legs)
            ahead = 0.0 if call.splice.passed and legs < rest.legs else float(rest.leg_breaks[legs])
            return memory.unchanged(call.splice, call.course.task, free, ahead)
        if not call.aim.timed or self._limits is None:
            return UNCHANGED if call.aim.durations is not None and known else ""
        return UNCHANGED if largest_use(self._limits, call.splice.flown) >= FULL else ""

    def _searched(self, call: _Call, rest: Trajectory | None, stands: bool) -> tuple[Better | None, bool, str]:
        """Search in the time that is left; return the better plan, whether the search ended by itself, and why not."""
        call.deadline.resume()
        seconds = call.deadline.left
        if call.aim.timed and seconds <= 0.0:
            return None, False, f"the budget of {call.seconds:g} s leaves no time to search"
        better, reason = None, "nothing better was found"
        try:
            call.deadline.check()
            better = self._better(call, rest, rest if stands else None, seconds)
        except NotShorterError:
            pass
        except LateError:
            reason = f"the budget of {call.seconds:g} s was over before anything better was found"
        except (CorridorError, InfeasibleError, SolverError, LimitError) as none:
            reason = str(none)
        return better, call.deadline.left > 0.0, reason

    @np.errstate(over="ignore", invalid="ignore", divide="ignore")  # a step that overflows has no merit, and is refused
    def _better(self, call: _Call, rest: Trajectory | None, standing: Trajectory | None, seconds: float) -> Better:
        splice, aim = call.splice, call.aim
        task = replace(call.course.task, deadline=call.deadline, explains=False)
        if call.avoid:
            timing, task = aim.timing(call.due, inf), replace(task, finish=self._finish(call, splice))
            timed = plan_around(task, replace(timing, progress=None), call.avoid)
            return Better(timed.trajectory, timed.limits_from)
        if call.course.outside:
            part = self._part(task, aim, None, None)
            return horizon.search_back(part.task, part.aim, self._finish(call, splice), seconds)
        known = None if self._memory is None else self._memory.first_guess(splice, task.legs)
        # A polynomial over the little that is left of a leg loses digits (see horizon.py): that part is flown on.
        guess, end = known or splice.rest, horizon.flown_on(splice, task, self._limits)
        end = end if end is not None and has_angles(end.left, call.angles) else None
        later = None if end is None else aim.after(end.left.duration)
        if end is None or later is None:
            part = self._part(task, aim, rest, guess)
            better = self._search(part, self._finish(call, splice), seconds, standing)
            if part.tail is None:
                return better
        else:
            later_legs = horizon.part_of(task, 1, task.legs, {1: end.state})
            rest, guess, standing = map(horizon.after_first_leg, (rest, guess, standing))
            part = self._part(later_legs, later, rest, guess)
            better = self._search(part, self._finish(call, end.after, 1), seconds, standing)
            starts = (start and start + end.left.duration for start in (better.limits_from, better.inside_from))
            better = Better(end.before(better.curve), *starts)
        return horizon.seen_joined(better, horizon.as_smooth(task, splice.flown), aim)

    def _part(self, task: Task, aim: Aim, rest: Trajectory | None, guess: Trajectory | None) -> Near:
        """Return the legs of the horizon, with the clearance from their walls."""
        walls = horizon.moved_inwards(task.walls, task.waypoints, self._clearance)
        return horizon.near(replace(task, walls=walls), aim, self._horizon, rest, guess)

    def _search(self, part: Near, finish: AttachHeading, seconds: float, standing: Trajectory | None) -> Better:
        """Search the legs of the horizon; for less time than they take in a rest that stands, where that goes on."""
        goes_on = standing is not None and (part.tail is not None or standing.legs == part.task.legs)
        flown = float(standing.leg_breaks[part.task.legs]) if standing is not None and goes_on else inf
        better = horizon.search_ahead(part.task, part.aim, finish, part.guess, seconds, flown)
        if part.tail is None:
            return better
        curve = horizon.joined_with(better.curve, part.tail, finish)
        if not horizon.within(curve, self._limits, better.limits_from):
            raise SolverError("what is flown beyond the horizon exceeds the limits with the new headings")
        return replace(better, curve=curve)

    def _finish(self, call: _Call, splice: Splice, passed: int = 0) -> AttachHeading:
        """Return the function that gives a curve its heading, from a splice or ``passed`` waypoints after it."""
        flown, instant, chosen = splice.flown, splice.instant, self._chosen
        limit = None if self._limits is None else self._limits.yaw_rate
        if call.angles is not None:
            chosen = through_angles(flown, instant, call.angles[passed:])
        return lambda curve: curve.with_yaw(spliced(flown, instant, chosen, limit, curve))

    def _chosen_of(
        self, call: _Call, rest: Trajectory | None, better: Better | None, reason: str
    ) -> tuple[Better | None, str]:
        """Return the plan to fly instead of the rest, or None and the reason."""
        if better is None:
            return None, reason
        late = self._clock() - call.due
        if late > 0.0:
            return None, f"a plan was found {late:.3g} s late"
        if rest is not None and call.aim.compares(rest):
            gain = GAIN if self._memory is not None or call.aim.total_time is None else SPLIT_GAIN
            if call.aim.value(better.curve) >= (1.0 - gain) * call.aim.value(rest):
                return None, "nothing better was found"
        return better, ""

    def _change(
        self, call: _Call, chosen: Better | None, stops: tuple[Trajectory | None, str], safe: bool, reason: str
    ) -> Change:
        splice, (stop, no_stop) = call.splice, stops
        kept, rest = chosen is None, splice.rest
        if chosen is None:
            if rest is None:
                raise TimingError(f"the flown plan is over at {splice.instant:.6g} s, and no plan was found: {reason}")
            chosen = Better(rest)
        certified = safe or not kept
        if stop is None and certified and no_stop != IN_THE_WAY and ends_at_rest(chosen.curve):
            stop = chosen.curve
        why, times = "" if stop is not None else no_stop, (chosen.limits_from, chosen.inside_from)
        took, late = call.watch.on_clock, max(0.0, self._clock() - call.due)
        known = chosen.curve, splice.instant, stop, kept, certified, reason, why
        return Change(*known, *times, took, late, splice.passed)


def replan(
    flown: Trajectory,
    now: float,
    waypoints: npt.ArrayLike | None = None,
    budget: float = 0.02,
    *,
    boxes: Constraint | None = None,
    goal: npt.ArrayLike | None = None,
    durations: npt.ArrayLike | None = None,
    total_time: float | None = None,
    yaw: float | str | npt.ArrayLike | None = None,
    began: float | None = None,
    avoid: Avoided | Sequence[Avoided] | None = None,
    **options: Any,
) -> Change:
    """Replan once, without memory; see :meth:`Replanner.replan`.

    Parameters
    ----------
    flown, now, waypoints, budget, boxes, goal, durations, total_time, began, avoid
        As for :meth:`Replanner.replan`.
    yaw : float, "velocity", "tilt", or array_like, shape (n,), optional
        As for :class:`Replanner`, or one per waypoint ahead [rad].
    **options
        As for :class:`Replanner`, such as ``limits``, ``corridor``, ``room``, ``vehicle`` and ``recover``.
    """
    each = isinstance(yaw, Sequence | np.ndarray) and not isinstance(yaw, str) and getattr(yaw, "ndim", 1) > 0
    whole: Any = None if each else yaw
    times = {"durations": durations, "total_time": total_time, "began": began, "avoid": avoid}
    times |= {"yaw": None if whole is yaw else yaw}
    return Replanner(yaw=whole, **options).replan(flown, now, waypoints, budget, boxes=boxes, goal=goal, **times)  # type: ignore[arg-type]


_awake = threading.Event()


def _wake() -> None:
    """Replan once in a process, so that the first answer of a flight does not wait for modules and tables."""
    if not _awake.is_set():
        _awake.set()
        points, limits = np.array([(0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (8.0, 1.0, 0.0)]), Limits(speed=2.0)
        flown = plan(points, durations=[4.0, 4.0])
        for corridor in (None, 1.0):
            Replanner(limits, corridor, clock=lambda: 0.0).replan(flown, 0.5, points[1:], 1.0)

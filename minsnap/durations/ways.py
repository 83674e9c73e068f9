"""Plans from starts in motion, and with ends on their limits: a way back, a way out, and a plan with room between.

A search moves limits inwards, which a state on or outside of a limit does not allow.  The shortest polynomials between
such states and states with room are found first, as in ``connector.py``; a way out is a way back flown backwards.  The
shortest time is then searched once more from the whole, in which a way back may exceed what it does, as far, and may
be any that takes no longer; that search also finds plans where there is none between the ways, or their whole is none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.margins import nearest_wall
from minsnap.durations.connector import CONNECTOR, connect_start, pinned_state, pinned_use
from minsnap.durations.outcome import End, PlanOutcome, if_possible, outcome_of
from minsnap.durations.shortest_question import coasting
from minsnap.durations.starts import shortest_of_starts
from minsnap.durations.strategy import Strategy
from minsnap.durations.timing import Run, Timed, Timing, timed
from minsnap.errors import LimitError, SolverError, UnprovedError
from minsnap.limits.compliance import KEPT, keeps, kept_from
from minsnap.limits.limits import Limits
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.task import Task
from minsnap.polynomials.bernstein import divided_pieces, split
from minsnap.refusals.sentences import connector_too_long, no_connector
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Recovered(Timed):
    """A plan whose first leg begins with a way back to the limits.

    Parameters
    ----------
    limits_from : float
        Instant from which the limits hold [s].
    """

    limits_from: float = 0.0

    @property
    def corridor_margin(self) -> float | None:
        """Least distance to the walls on positions [m], way back included; None where there are none."""
        nearest = nearest_wall(self.trajectory, [wall for wall in self.solved.task.walls if wall.order == 0])
        return None if nearest is None else nearest.value


@dataclass(frozen=True, eq=False)
class EndConnectors:
    """What is flown before and after a plan whose ends have room.

    Parameters
    ----------
    task : Task
        Between them.
    before, after : Trajectory or None
        One polynomial each; None where that end has room.
    """

    task: Task
    before: Trajectory | None = None
    after: Trajectory | None = None

    def between(self, timing: Timing) -> Timing | UnprovedError:
        """Return the same times without those of the ways; an error where that leaves a leg no time."""
        first, last = self._taken
        if timing.total_time is not None:
            total = float(timing.total_time) - (first + last)
            short = total <= 0.0
            return connector_too_long(timing.total, first + last, None) if short else replace(timing, total_time=total)
        if timing.durations is None:
            return timing
        durations = np.array(timing.durations, dtype=np.float64)
        for leg, taken in ((0, first), (-1, last)):
            if taken >= durations[leg]:
                return connector_too_long(float(durations[leg]), taken, leg % len(durations))
            durations[leg] -= taken
        return replace(timing, durations=durations)

    def planned(self, plan: Callable[[Task], PlanOutcome], fly: Callable[[PlanOutcome], PlanOutcome]) -> PlanOutcome:
        """Plan between the ways with the pieces of the request, then with more, and fly them before and after.

        Parameters
        ----------
        plan : callable
            Plans between them.
        fly : callable
            Makes the whole of that.
        """
        if self.task.pieces < CONNECTOR.pieces:
            few = fly(outcome_of(lambda: plan(replace(self.task, explains=False))))
            if few.refused is None and not few.stands_in:
                return few
            more = fly(plan(replace(self.task, pieces=CONNECTOR.pieces)))
            return more if few.planned is None else few.or_quicker(more)
        return fly(plan(self.task))

    def in_time(self, plan: Callable[[Task, Timing], PlanOutcome], timing: Timing) -> PlanOutcome:
        """Plan as :meth:`planned` does in the times of a request, of which a refusal speaks too."""
        between = self.between(timing)
        if not isinstance(between, Timing):
            return PlanOutcome(reason=between)
        fly = partial(self.around, limits=timing.bounds)
        outcome = outcome_of(lambda: self.planned(lambda task: plan(task, between), fly))
        refused = outcome.refused
        if refused is not None:
            first, last = self._taken
            asked = timing.total_time if timing.durations is None else float(np.sum(timing.durations))
            if asked is not None:
                ways = f"the ways between limits and states with room take {first + last:.4g} s"
                refused.args = (f"of {asked:.6g} s {ways}, and in the rest {refused}",)
            for name, taken in (("instant", first), ("shortest", first + last)):
                if getattr(refused, name, None) is not None:
                    setattr(refused, name, getattr(refused, name) + taken)
        return outcome

    @property
    def _taken(self) -> tuple[float, float]:
        """Durations of the ways before and after [s]."""
        first, last = (0.0 if way is None else way.duration for way in (self.before, self.after))
        return first, last

    @property
    def _needless(self) -> bool:
        """Whether both ends have room."""
        return self.before is None and self.after is None

    def around(self, outcome: PlanOutcome, limits: Limits) -> PlanOutcome:
        """Fly the ways before and after a plan between them, if the whole keeps the limits and the walls."""
        planned = outcome.planned
        if planned is None or self._needless:
            return outcome
        allowed = planned.limits_from if self.before is None else self.before.duration
        whole = certified(replace(planned, trajectory=self.whole(planned.trajectory)), limits, allowed)
        if whole is not None:
            return PlanOutcome(whole)
        reason = SolverError("the ways to a state on its limits could not be certified: loosen a limit")
        return PlanOutcome(reason=reason)

    def whole(self, between: Trajectory) -> Trajectory:
        """Fly the ways before and after a curve between them."""
        curve = between if self.before is None else joined(self.before, between)
        if self.after is not None:
            curve = joined(self.after.reversed(), curve.reversed()).reversed()
        return self.task.finish(curve)

    def as_one(self, outcome: PlanOutcome, task: Task, timing: Timing) -> PlanOutcome:
        """Fly the ways before and after a plan between them, and search on from the whole; take the shorter flight.

        Where there is no plan between them, or the whole does not keep the limits, that search may find one.

        Parameters
        ----------
        outcome : PlanOutcome
            Between the ways.
        task : Task
            From the first state to the last.
        timing : Timing
        """
        flown, planned = self.around(outcome, timing.bounds), outcome.planned
        if self._needless or outcome.end is End.SPENT:
            return flown
        if planned is None:
            planned = if_possible(lambda: self._coasting(timing)) if outcome.refused else None
        if planned is None:
            return flown
        again = if_possible(lambda: self._searched_on(planned, task, timing))
        best = flown.or_quicker(PlanOutcome(again))
        if again is None or best.planned is None or not again.interrupted:
            return best
        return PlanOutcome(replace(best.planned, interrupted=True))

    def _coasting(self, timing: Timing) -> Timed:
        """Return the curve of least cost between the ways, which need not keep anything, in enough pieces."""
        coast = coasting(self.task, Strategy(self.task, timing).times)
        count = max(self.task.pieces, CONNECTOR.pieces)
        counts = np.full(self.task.legs, count)
        durations, points = divided_pieces(coast.durations, coast.trajectory.control_points, counts)
        return Timed(coast, Trajectory(points, durations, pieces=count))

    def _searched_on(self, planned: Timed, task: Task, timing: Timing) -> Recovered | None:
        """Search from the whole of a curve between the ways; None without a plan."""
        first, limits, allowed = self.whole(planned.trajectory), timing.bounds, 0.0
        if self.before is not None and not keeps(limits, first.between(0.0, self.before.duration)):
            allowed = self.before.duration
        search = Strategy(replace(task, pieces=first.pieces), replace(timing, refine=False))

        def certify(solved: SolvedTask) -> Recovered | None:
            run = Run((*planned.steps, *search.watched.log.steps), search.interrupted)
            return certified(replace(timed(solved, run), stands_in=planned.stands_in), limits, allowed)

        return search.on_from(first, certify)


def certified(planned: Timed, limits: Limits, allowed: float) -> Recovered | None:
    """Return a plan with the instant from which it keeps the limits, if that is early enough and it keeps the walls.

    Parameters
    ----------
    planned : Timed
    limits : Limits
    allowed : float
        Latest such instant [s].
    """
    start = kept_from(limits, planned.trajectory)
    answer = Recovered(**{one.name: getattr(planned, one.name) for one in fields(Timed)}, limits_from=start)
    return None if start > allowed * (1.0 + KEPT) or (answer.corridor_margin or 0.0) < 0.0 else answer


def shortest_from(task: Task, timing: Timing, first: Trajectory | None = None, again: bool = True) -> PlanOutcome:
    """Find the shortest plan from a start in motion, or to an end on its limits, or why there is none.

    Parameters
    ----------
    task : Task
        Without walls of the limits.
    timing : Timing
    first : Trajectory, optional
        To search from.
    again : bool
        Whether a plan with ways is searched on from as a whole.
    """
    limits = timing.bounds

    def search(part: Task, curve: Trajectory | None = None) -> PlanOutcome:
        timing.in_time(part).deadline.require()
        return shortest_of_starts(part, timing, curve)

    def flown(ways: EndConnectors, outcome: PlanOutcome) -> PlanOutcome:
        return ways.as_one(outcome, task, timing) if again else ways.around(outcome, limits)

    direct = PlanOutcome()
    if pinned_use(task, limits) <= (1.0 - CONNECTOR.on_limit if first is None else 1.0 + KEPT):
        ways = connect_ends(task, limits, start=False)
        if not isinstance(ways, EndConnectors):
            return PlanOutcome(reason=ways)
        direct = outcome_of(lambda: flown(ways, search(ways.task, first)))
        bounded = limits.use_of_state(task.pins.get(0, {}), task.dim)  # by limits that a state may be outside of
        if not bounded or (direct.refused is None and not direct.stands_in):
            return direct
    back = connect_ends(task, limits, start=True)
    if not isinstance(back, EndConnectors):
        return direct if direct.planned is not None else PlanOutcome(reason=direct.reason or back)
    outcome = outcome_of(lambda: back.planned(search, partial(flown, back)))
    if direct.planned is not None:
        return direct.or_quicker(outcome)
    return outcome if direct.reason is None or outcome.end is not End.REFUSED else direct


def connect_ends(task: Task, limits: Limits, start: bool) -> EndConnectors | LimitError:
    """Return the ways that a task needs, or an error that says where there is none.

    Parameters
    ----------
    task : Task
    limits : Limits
    start : bool
        Whether the start needs one.
    """
    before = after = None
    if start:
        before = connect_start(pinned_state(task), task.walls, limits, task.deadline)
        if before is None:
            return _unconnected(task, limits, 0)
        task = from_end(task, before)
    if end_on_limit(task, limits):
        backwards = (-1.0) ** np.arange(task.half)[:, None] * pinned_state(task, task.legs)
        way = connect_start(backwards, task.walls, limits, task.deadline, task.legs - 1)
        if way is None:
            return _unconnected(task, limits, task.legs)
        after = way.reversed()
        task = _moved(task, task.legs, after.states(0.0, task.half))
    return EndConnectors(task, before, after)


def start_on_limit(task: Task, limits: Limits) -> bool:
    """Whether the start of a task is on its limits or outside of them."""
    return not task.closed and pinned_use(task, limits) > 1.0 - CONNECTOR.on_limit


def end_on_limit(task: Task, limits: Limits) -> bool:
    """Whether the end of a task is on a limit."""
    moves = task.legs in task.moving and not task.closed
    return moves and pinned_use(task, limits, task.legs) > 1.0 - CONNECTOR.on_limit


def _unconnected(task: Task, limits: Limits, waypoint: int) -> LimitError:
    used = limits.use_of_state(task.pins[waypoint], task.dim)
    return no_connector(waypoint, max(used, key=lambda entry: entry.fraction))


def from_end(task: Task, way: Trajectory) -> Task:
    """Return the same task from the end of a way back; its walls are the same."""
    return _moved(task, 0, way.states(way.duration, task.half))


def _moved(task: Task, waypoint: int, state: FloatArray) -> Task:
    """Return the same task with another state (k, dim), position included, at its first or last waypoint."""
    points, lower, upper = task.waypoints.copy(), task.lower.copy(), task.upper.copy()
    points[waypoint], lower[waypoint], upper[waypoint] = state[0], 0.0, 0.0
    for array in (points, lower, upper):
        array.flags.writeable = False
    regions = {knot: region for knot, region in task.regions.items() if knot != waypoint}
    pins = dict(task.pins) | {waypoint: {order: state[order] for order in range(1, task.half)}}
    return replace(task, waypoints=points, lower=lower, upper=upper, regions=regions, pins=pins)


def joined(first: Trajectory, rest: Trajectory) -> Trajectory:
    """Fly one polynomial before a plan, as part of its first leg; the other legs are divided to have as many pieces."""
    pieces = rest.pieces
    points, durations = [first.control_points, rest.control_points[:pieces]], [first.durations, rest.durations[:pieces]]
    for leg in range(1, rest.legs):
        part = slice(leg * pieces, (leg + 1) * pieces)
        halves = np.stack(split(rest.control_points[part.start], 0.5))
        points += [halves, rest.control_points[part][1:]]
        durations += [np.repeat(0.5 * rest.durations[part.start], 2), rest.durations[part][1:]]
    return Trajectory(np.concatenate(points), np.concatenate(durations), pieces=pieces + 1)

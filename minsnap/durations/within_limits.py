"""Plans within limits: the shortest, or for a total or a price of time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray, significant
from minsnap.basics.deadline import Deadline, LateError
from minsnap.durations.connector import pinned_use
from minsnap.durations.initial_guess import priced_first_guess, worth_of_time
from minsnap.durations.least_cost import cheapest_durations, distance_split
from minsnap.durations.outcome import PlanOutcome, if_possible
from minsnap.durations.starts import shortest_of_starts
from minsnap.durations.stopping import Stopping
from minsnap.durations.strategy import Strategy
from minsnap.durations.time_scaling import scaled_plan
from minsnap.durations.time_stretch import grained, measuring_work, touching_factor
from minsnap.durations.timing import NO_RUN, Run, Timed, Timing, attempted, found_in, solved_or_explained, timed
from minsnap.durations.watched_search import INTERRUPTED
from minsnap.durations.ways import EndConnectors, end_on_limit, from_end, shortest_from
from minsnap.errors import InfeasibleError, LimitError, MinsnapError, SolverError
from minsnap.limits.compliance import KEPT, keeps, largest_use, most_used
from minsnap.limits.limits import Limits
from minsnap.native.library import core
from minsnap.optimisation.optimum import InfeasibleRowsError
from minsnap.optimisation.solve import Effort, solve
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.task import Task
from minsnap.refusals.given_times import explain
from minsnap.refusals.sentences import (
    UnlimitedError,
    exceeded_at_least_cost,
    only_found,
    pinned_beyond,
    shorter_than_found,
)
from minsnap.trajectory.report import Utilisation

AT_LIMIT, LIMIT_ROOM = 1e-6, 1e-2
"""How near to a limit a pinned state counts as at it, and the share of room that it should be left."""


NEAR_FREE = 3.0
"""Use of limits by the plan without them up to which a search from it is tried."""

HIGH = 100.0
"""Price of time for a short plan, over what its time is worth where it rests at every waypoint."""

SLOWER = (1.0, 2.0, 4.0)
"""Factors on the time of that rest: totals that are searched where that price has no plan either."""


def shortest_plan(task: Task, timing: Timing) -> PlanOutcome:
    """Find the shortest plan within limits, whose walls the task does not have."""
    limits = timing.bounds
    if timing.split != "optimal":
        return scaled_plan(task, timing)
    if 0 in task.moving or end_on_limit(task, limits):
        return shortest_from(task, timing)
    return shortest_of_starts(task, timing)


def at_rest_everywhere(task: Task, timing: Timing, again: bool = False) -> Timed | None:
    """Return the plan that rests at every waypoint, in place of a shortest one; None without one.

    What moves at the start is brought to rest in the first leg before, and goes on from there; ``again``: the shortest
    time is searched on from the whole of that.
    """
    asked = task
    if not timing.shortest or not (task.still or (task.moving == {0} and not task.closed)):
        return None
    ways, task = EndConnectors(task), replace(task, deadline=Deadline(), explains=False)
    if not task.still:
        stopping = Stopping(replace(task, finish=lambda curve: curve), timing.bounds)
        stop = stopping.braking() or (stopping.aside() if again else None)
        if stop is None or len(stop.durations) > 1:
            return None
        ways = EndConnectors(from_end(task, stop), stop)
    rest = if_possible(lambda: Strategy(ways.task, timing).resting)
    if rest is None:
        return None
    between = PlanOutcome(timed(rest))
    whole = (ways.as_one(between, asked, timing) if again else ways.around(between, timing.bounds)).planned
    # The stop was found without its heading, which may ask the rotors for more.
    beyond = pinned_use(task, timing.bounds) > 1.0
    return whole if whole is None or beyond or keeps(timing.bounds, whole.trajectory) else None


def plans_for(
    bounded: Task, timing: Timing, search: Run, effort: Effort = Effort.WHOLE
) -> Callable[[FloatArray], Timed | None]:
    """Return what plans for durations, within limits as walls; None where there is no plan, or it is not certified.

    Parameters
    ----------
    bounded : Task
        With the walls of the limits.
    timing : Timing
    search : Run
        The one before.
    effort : Effort
        After which the native core gives up.
    """
    limits = timing.limits

    def plan(durations: FloatArray) -> Timed | None:
        work = 0.0 if limits is None else measuring_work(limits, bounded.legs * bounded.pieces)
        if not bounded.deadline.affords(work):
            return None
        bounded.deadline.spend(work)
        solved = found_in(bounded, durations, effort)
        return None if solved is None or not (limits is None or keeps(limits, solved.flown)) else timed(solved, search)

    return plan


def limited_plan(task: Task, timing: Timing) -> PlanOutcome:
    """Plan for a total or a price, and limits besides, whose walls the task does not have.

    The plan without limits is returned where it keeps them; else the curve and its durations are searched together.
    """
    limits, price = timing.bounds, timing.time_weight
    if price is None and timing.split != "optimal":
        durations = distance_split(task, timing.total)
        return of_solved(solved_or_explained(timing.bounded(task), task.piece_durations(durations)), task, timing)
    free = _without_limits(task, timing)
    if isinstance(free, MinsnapError):
        return PlanOutcome(reason=free)
    if free is not None and keeps(limits, free.trajectory):
        return PlanOutcome(free)
    if free is not None and free.interrupted and price is not None:
        slower = limits_kept(free, task, timing, True)
        return slower if slower.planned is not None else PlanOutcome(reason=LateError(INTERRUPTED))
    search = Strategy(task, timing)
    search.watched.log.steps = [] if free is None else list(free.steps)
    found = _at_total(search, free) if price is None else _at_price(search, price, free)
    if isinstance(found.reason, UnlimitedError):  # of the shortest: a total, or a price, has an end
        found = PlanOutcome(reason=SolverError("no plan of this total, or price, within the limits was found"))
    if free is None and found.refused is not None and not isinstance(found.reason, InfeasibleError):
        proved = explain(timing.in_time(task), task.piece_durations(search.times))
        return found if isinstance(proved, SolverError) else PlanOutcome(reason=proved)
    return found if found.planned is None or price is None else limits_kept(found.planned, task, timing, True)


def of_solved(solved: SolvedTask | MinsnapError, task: Task, timing: Timing) -> PlanOutcome:
    """Return the plan of a solve with the limits as walls, or of a search where it does not keep the others."""
    return limits_kept(timed(solved), task, timing) if isinstance(solved, SolvedTask) else PlanOutcome(reason=solved)


def _without_limits(task: Task, timing: Timing) -> Timed | MinsnapError | None:
    """Return the plan of least cost without limits; None where the durations that were chosen have none."""
    price = timing.time_weight
    first = distance_split(task, timing.total) if price is None else priced_first_guess(task, price)
    if isinstance(first, MinsnapError):
        return first
    durations, run = cheapest_durations(task, timing, first, price)
    solved = attempted(solve, task, task.piece_durations(durations))
    if isinstance(solved, SolvedTask):
        return timed(solved, run)
    return None if isinstance(solved, InfeasibleRowsError) else solved


def _at_price(search: Strategy, price: float, free: Timed | None) -> PlanOutcome:
    """Search for a price of time [1/s], from the plan without limits, flown as slowly as they ask for, or from rest.

    Else from the shortest plan, which is returned where nothing cheaper is found.
    """

    def searched_from(plan: SolvedTask) -> SolvedTask | None:
        slower = max(1.0, min(largest_use(search.limits, plan.flown), 10.0)) if search.task.still else 1.0
        return search.cheapest(plan, price=price, slower=significant(slower))

    solved = None if free is None else searched_from(free.solved)
    if solved is None and not search.interrupted:
        solved = search.cheapest(search.rest, price=price)
    if solved is None:
        ended = search.watched.ended
        if ended is not None:
            return PlanOutcome(reason=ended)
        shortest = search.run()
        if shortest.planned is None:
            return shortest
        fastest = shortest.planned.solved
        solved = (None if search.interrupted else searched_from(fastest)) or fastest
    return PlanOutcome(timed(solved, search.found))


def _at_total(search: Strategy, free: Timed | None) -> PlanOutcome:
    """Search for a total from the plan of about its price, and the one without limits near them; take the cheaper.

    Where neither has one, search from the shortest plan; where that has none, lengthen it.
    """
    task, timing, total = search.task, search.timing, search.timing.total
    early, found = free is not None and free.interrupted, list[SolvedTask | None]()
    if not early:
        near = None if free is None or not _is_near(search, free) else search.cheapest(free.solved, total=total)
        found = [near, search.of_total(total)]
    if not any(found):
        shortest = search.run()
        if shortest.planned is None:
            return shortest
        fastest, least = shortest.planned.solved, shortest.planned.trajectory.duration
        if least * (1.0 - KEPT) > total:
            ended = search.watched.ended if search.watched.lost else None
            return PlanOutcome(reason=ended or shorter_than_found(total, fastest.trajectory.duration))
        found = [None if early or search.interrupted else search.cheapest(fastest, total=total)]
    run = Run(search.found.steps, early or search.interrupted)
    plans = [_cheaper(one, task, timing, run) for one in found if one is not None]
    if plans:
        return PlanOutcome(min(plans, key=lambda one: one.cost))
    slower = _lengthened(fastest, timing, run)
    return PlanOutcome(slower, None if slower else only_found(total, fastest.trajectory.duration))


def _is_near(search: Strategy, free: Timed) -> bool:
    """Whether a plan without limits exceeds them by so little that a search from it is worth its time."""
    search.deadline.spend(measuring_work(search.limits, len(free.trajectory.durations)))
    return largest_use(search.limits, free.trajectory) <= NEAR_FREE


def from_rest(task: Task, timing: Timing) -> Timed | None:
    """Search from rest at every waypoint for a total or a price of time, within limits or without; None without a plan.

    The shortest time is searched as a high price of it, since a smooth curve has an end where others have none, else as
    the total of that rest, or of a slower one.
    """
    deadline = timing.in_time(task).deadline
    over = deadline.late or (deadline.spent and not deadline.has_last_try())
    if task.samples is not None or core().name != "native" or over:
        return None
    search = if_possible(lambda: Strategy(task, replace(timing, limits=timing.limits or Limits())))
    if search is None:
        return None
    rest = search.rest
    if timing.total_time is not None:
        found = search.cheapest(rest, total=timing.total_time)
    elif timing.time_weight is not None:
        found = search.cheapest(rest, price=timing.time_weight)
    else:
        found = search.cheapest(rest, price=significant(HIGH * worth_of_time(rest.trajectory)))
        slower = (rest.slowed(factor) for factor in SLOWER)
        tried = (search.cheapest(one, total=one.trajectory.duration) for one in slower)
        found = found or next((one for one in tried if one is not None), None)
    return None if found is None else _cheaper(found, task, timing, search.found)


def _cheaper(found: SolvedTask, asked: Task, timing: Timing, run: Run) -> Timed:
    """Return the plan of a search, or of least cost in its durations, with the limits as walls, where that costs less.

    A search stands off from peaks between its instants as they are, and joins more derivatives than may be asked for.
    """
    task = timing.in_time(replace(timing.bounded(asked), pieces=found.trajectory.pieces))
    planned = plans_for(task, timing, run, Effort.GLANCE)(found.trajectory.durations)
    whole = timed(found, run)
    return whole if planned is None or planned.cost > whole.cost else planned


def _lengthened(best: SolvedTask, timing: Timing, run: Run) -> Timed | None:
    """Take more time: the same path flown more slowly, or a search where pinned derivatives do not scale."""
    factor = timing.total / best.trajectory.duration
    slower = timed(best, run, factor)
    if (best.task.still or factor <= 1.0 + KEPT) and keeps(timing.bounds, slower.trajectory):
        return slower
    return searched_in_time(best, best.task, timing, factor * best.trajectory.durations, run)


def searched_in_time(
    first: SolvedTask, task: Task, timing: Timing, durations: FloatArray | None = None, run: Run = NO_RUN
) -> Timed | None:
    """Search a curve that keeps the limits in piece durations [s], from one in others or beyond; None without one.

    Parameters
    ----------
    first : SolvedTask
    task : Task
        Without the walls of the limits.
    timing : Timing
    durations : ndarray, shape (pieces in all,), optional
        By default those of the first curve [s].
    run : Run
        The search before; where that was interrupted there is no other.

    Raises
    ------
    LateError
        Where time or Ctrl-C ends it before it has a curve; work that is spent leaves the refusal to be said.
    """
    if run.interrupted or core().name != "native" or not task.deadline.affords(0.0):
        return None
    search = if_possible(lambda: Strategy(task, timing))
    if search is None:
        return None
    durations = first.trajectory.durations if durations is None else durations
    found = search.cheapest_in_durations(first, durations)
    if found is None and search.eases and not search.interrupted:  # the way round the heading is not that of least cost
        found = _in_proportion_of_shortest(search, durations)
    if found is None and search.watched.ended is not None and not search.deadline.spent:
        raise search.watched.ended
    return None if found is None else timed(found, Run((*run.steps, *search.watched.log.steps), search.interrupted))


def _in_proportion_of_shortest(search: Strategy, durations: FloatArray) -> SolvedTask | None:
    """Search from the shortest plan, whose pieces divide the legs as they do there."""
    shortest = search.solve(None).solved
    if shortest is None or search.interrupted or len(shortest.trajectory.durations) != len(durations):
        return None
    legs, pieces = search.task.legs, shortest.trajectory.durations
    longer = durations.reshape(legs, -1).sum(axis=1) / pieces.reshape(legs, -1).sum(axis=1)
    return search.cheapest_in_durations(shortest, pieces * np.repeat(longer, len(pieces) // legs))


def limits_kept(planned: Timed, task: Task, timing: Timing, stretchable: bool = False) -> PlanOutcome:
    """Return a plan that keeps all limits, those that are not walls of the QP too, or say how long it would take.

    There is none if the plan of least cost exceeds a limit, and a search finds no other curve of its durations.
    """
    limits = timing.bounds
    used = most_used(limits, planned.trajectory)
    if used.fraction <= 1.0 + KEPT:
        return PlanOutcome(planned)
    total = planned.trajectory.duration
    other = None if stretchable else searched_in_time(planned.solved, task, timing)
    if other is not None:
        return PlanOutcome(other)
    factor = grained(touching_factor(limits, planned.trajectory, deadline=task.deadline)) if task.still else None
    if stretchable and factor is not None:
        return PlanOutcome(replace(planned, trajectory=planned.trajectory.stretched(factor)))
    return PlanOutcome(reason=exceeded_at_least_cost(total, used, limits.medium.drags, factor))


def check_pinned_limits(task: Task, limits: Limits, mended: bool = False) -> None:
    """Raise LimitError if a pinned state already exceeds a limit, or leaves it no room.

    Parameters
    ----------
    task : Task
    limits : Limits
    mended : bool
        Whether a start on or outside its limits, and an end on them, is left to ways back and out.
    """
    mended = mended and not task.closed
    thrusts = 1.0 / (limits.max_thrust or np.inf), limits.min_thrust or 0.0  # what rest uses of limits, if anything
    at_rest = max(thrusts) <= 1.0 - AT_LIMIT
    for waypoint, state in task.pins.items():
        if (at_rest and waypoint not in task.moving) or (mended and waypoint == 0):
            continue
        last = mended and waypoint == task.legs
        for used in limits.use_of_state(state, task.dim):
            if used.fraction > (1.0 + KEPT if last else 1.0 - AT_LIMIT):
                raise _pinned_at(waypoint, used)


def _pinned_at(waypoint: int, used: Utilisation) -> LimitError:
    at = used.fraction <= 1.0 + KEPT  # beyond it, what the state has is room enough
    room = 0.0 if not at else -LIMIT_ROOM if used.name == "min_thrust" else LIMIT_ROOM
    return pinned_beyond(waypoint, used, used.value * (1.0 + room), at)

"""Durations and plan together: given, split from a total, priced, or the shortest within limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from minsnap.basics.checks import check_durations
from minsnap.basics.deadline import LATE, LateError
from minsnap.durations.initial_guess import priced_first_guess
from minsnap.durations.least_cost import cheapest_durations, distance_split
from minsnap.durations.outcome import End, PlanOutcome, if_possible, outcome_of, quickest
from minsnap.durations.refused_times import AskedTimes
from minsnap.durations.timing import Run, Timed, Timing, solved_or_explained, timed
from minsnap.durations.within_limits import from_rest
from minsnap.errors import InfeasibleError, LimitError, MinsnapError, SolverError, UnprovedError
from minsnap.last_look import fault
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.task import Task
from minsnap.refusals.sentences import UnlimitedError

if TYPE_CHECKING:
    from minsnap.limits.limits import Limits

PARTS = 3
"""Pieces a leg where their number is left to the plan, and its search has no end."""


def plan_timed(task: Task, timing: Timing) -> Timed:
    """Choose durations and solve; a refusal says whether it is proved for other durations than those of the request.

    Parameters
    ----------
    task : Task
    timing : Timing
        Checked.

    Raises
    ------
    TimingError, LimitError
        If what is asked for is malformed or contradictory.
    InfeasibleError
        If nothing fits, with the reason.
    """
    return outcome_of(lambda: _answer(task, timing)).plan()


def _answer(task: Task, timing: Timing) -> PlanOutcome:
    """Plan as asked; where the number of pieces is left to the plan and there is none, with a number of them.

    A limit on a derivative that jumps between polynomials, as snap of degree 5, limits one alone; else three are tried.
    They are searched besides where the rate of a yaw is limited, whose searches end at many curves.
    """
    outcome, several = _try_once(task, timing), replace(timing, refine=False)
    if not timing.refine:
        return _answer_otherwise(outcome, task, timing)
    if isinstance(outcome.reason, UnlimitedError):
        return _answer_otherwise(_try_once(task, several), task, several)
    refused = outcome.refused
    if refused is None or not task.explains:
        outcome = _answer_otherwise(outcome, task, timing)
        turns = timing.shortest and timing.bounds.yaw_rate is not None and outcome.end is End.KEPT
        if not ((outcome.stands_in or turns) and task.explains):
            return outcome
    else:
        short = AskedTimes(task, timing).too_short()  # a refusal of one piece proves nothing of more
        if short is not None:
            return PlanOutcome(reason=short)
    parted = timing.in_time(replace(task, pieces=PARTS))
    other = outcome_of(lambda: _answer_otherwise(_try_once(parted, several), parted, several))
    if refused is None or not isinstance(other.reason, UnprovedError):
        return other.or_quicker(outcome)
    shortest = min(other.reason, refused, key=lambda error: getattr(error, "shortest", None) or inf)
    return PlanOutcome(reason=shortest)


def _try_once(task: Task, timing: Timing) -> PlanOutcome:
    """Plan once, and look at the plan before it leaves."""
    outcome = outcome_of(lambda: _choose_times(task, timing, AskedTimes(task, timing).too_short))
    return outcome if outcome.planned is None else _look_at(outcome.planned, task, timing)


def _answer_otherwise(outcome: PlanOutcome, task: Task, timing: Timing) -> PlanOutcome:
    """Return a plan; of a refusal what stands in its place.

    1. The time is over: rest at every waypoint, where that is shorter; without a plan what is proved at no cost is
       said, although the work is spent.
    2. A proof by walls that are sufficient for a limit, but not necessary, is none: plan by those that are.
    3. The shorter one of a search from rest, where the request leaves a choice of times, and of rest at every waypoint;
       of what stands in for a search without an end, too.
    4. What is proved of the times of the request.
    """
    asked = AskedTimes(task, timing)
    if isinstance(outcome.reason, UnlimitedError):
        return PlanOutcome(reason=LimitError(str(outcome.reason)))
    if outcome.end is End.SPENT:
        outcome = _or_rest(outcome, task, timing)
    if isinstance(outcome.reason, LateError):
        short = None if task.deadline.late else asked.too_short()
        return outcome if short is None else PlanOutcome(reason=short)
    if outcome.stands_in:
        found = if_possible(lambda: from_rest(task, timing))
        return outcome if found is None else outcome.or_quicker(_look_at(found, task, timing))
    refused = outcome.refused
    if refused is None or not task.explains:
        return outcome
    again = asked.by_necessary_walls(refused)
    if isinstance(again, Timed):
        return _look_at(again, task, timing)
    other = asked.in_other_times(again)
    if isinstance(other, InfeasibleError):
        return PlanOutcome(reason=other)
    longer = quickest((other, _at_rest(task, timing, again=True)))
    if longer is not None:
        return _look_at(replace(longer, stands_in=True), task, timing)
    if isinstance(again, SolverError) and timing.in_time(task).deadline.late:
        return PlanOutcome(reason=LateError(LATE))
    return PlanOutcome(reason=asked.explained(again))


def _at_rest(task: Task, timing: Timing, again: bool = False) -> Timed | None:
    from minsnap.durations.within_limits import at_rest_everywhere

    return at_rest_everywhere(task, timing, again)


def _or_rest(outcome: PlanOutcome, task: Task, timing: Timing) -> PlanOutcome:
    """Return what a search that was ended found, or rest at every waypoint, with which what is still was compared."""
    planned = outcome.planned
    rest = None if planned is not None and task.still else _at_rest(task, timing)
    if rest is None:
        return outcome
    steps = () if planned is None else planned.steps
    return outcome.or_quicker(_look_at(replace(rest, interrupted=True, stands_in=True, steps=steps), task, timing))


def require_kept(planned: Timed, task: Task, timing: Timing) -> Timed:
    """Return a plan that keeps all its conditions at a last look, or raise SolverError."""
    return _look_at(planned, task, timing).plan()


def _look_at(planned: Timed, task: Task, timing: Timing) -> PlanOutcome:
    """Return a plan, or a refusal where a last look finds what it does not keep."""
    checked = task if task.samples is None else replace(task, walls=())
    times = timing.total_time if timing.durations is None else timing.durations
    curve, solved = planned.trajectory, planned.solved
    proved = None if solved is None else solved.proved_margins(curve)
    wrong = fault(checked.conditions, curve, timing.limits, times, planned.limits_from, proved)
    if wrong is None:
        return PlanOutcome(planned)
    reason = SolverError(f"the plan is refused at the last look: {wrong}; please report this question")
    return PlanOutcome(reason=reason)


def _choose_times(task: Task, timing: Timing, refuse: Callable[[], MinsnapError | None] | None = None) -> PlanOutcome:
    """Plan once as the request has its times: given, of a total, priced, or the shortest within limits.

    ``refuse`` returns what is proved of given durations; it is asked where a solve gives up.
    """
    if timing.limits is None and timing.durations is not None:
        return _wrap(solved_or_explained(task, task.piece_durations(timing.durations)))
    if timing.limits is None:
        return _plan_at_least_cost(task, timing)
    from minsnap.durations import within_limits
    from minsnap.durations.ways import end_on_limit, start_on_limit

    limits = timing.limits
    shortest = timing.durations is None and timing.total_time is None and timing.time_weight is None
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # what overflows is refused
        limits.check_dim(task.dim)
        mended = task.continuity <= task.half - 1
        within_limits.check_pinned_limits(task, limits, mended)
        started = mended and not shortest and start_on_limit(task, limits)
        if started or (mended and not shortest and end_on_limit(task, limits)):
            return _plan_from_limits(task, timing, limits, started)
        if timing.durations is not None:
            solved = solved_or_explained(timing.bounded(task), task.piece_durations(timing.durations), refuse)
            return within_limits.of_solved(solved, task, timing)
        return (within_limits.shortest_plan if shortest else within_limits.limited_plan)(task, timing)


def _plan_from_limits(task: Task, timing: Timing, limits: Limits, start: bool) -> PlanOutcome:
    """Plan with an end on its limits: without limits if that keeps them, else between ways back and out."""
    from minsnap.durations.ways import EndConnectors, connect_ends
    from minsnap.limits.compliance import keeps

    free = _choose_times(task, replace(timing, limits=None))
    if free.planned is None or keeps(limits, free.planned.trajectory):
        return free
    ways = connect_ends(task, limits, start)
    return ways.in_time(_choose_times, timing) if isinstance(ways, EndConnectors) else PlanOutcome(reason=ways)


def _plan_at_least_cost(task: Task, timing: Timing) -> PlanOutcome:
    """Plan a total time, or with a price of time, where nothing limits derivatives."""
    price, search = timing.time_weight, None
    durations = distance_split(task, timing.total) if price is None else priced_first_guess(task, price)
    if isinstance(durations, MinsnapError):
        return PlanOutcome(reason=durations)
    if timing.split == "distance":
        durations = check_durations(durations, task.legs)
    else:
        durations, search = cheapest_durations(task, timing, durations, price)
    return _wrap(solved_or_explained(task, task.piece_durations(durations)), search)


def _wrap(solved: SolvedTask | MinsnapError, search: Run | None = None) -> PlanOutcome:
    return PlanOutcome(timed(solved, search)) if isinstance(solved, SolvedTask) else PlanOutcome(reason=solved)

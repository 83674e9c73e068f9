"""Durations and plan together: given, split from a total, priced, or the shortest within limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from minsnap.basics.checks import check_durations
from minsnap.basics.deadline import LATE, LateError
from minsnap.durations.initial_guess import priced_first_guess
from minsnap.durations.last_look import fault
from minsnap.durations.least_cost import cheapest_durations, distance_split
from minsnap.durations.refused_times import by_necessary_walls, explained_by_times, in_other_times, refuse_short
from minsnap.durations.time_stretch import UnlimitedError
from minsnap.durations.timing import Timed, Timing, nothing, solved_or_explained, timed
from minsnap.errors import InfeasibleError, LimitError, SolverError, UnprovedError
from minsnap.optimisation.task import Task

if TYPE_CHECKING:
    from minsnap.limits.limits import Limits

PARTS = 3
"""Pieces a leg where their number is left to the plan, and one has no plan."""


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
    try:
        planned = _timed(task, timing, partial(refuse_short, task, timing))
        return looked_at(planned, task, timing)
    except UnlimitedError as reason:
        if timing.refine:  # a limit on a derivative that jumps between polynomials, as snap of degree 5, limits one
            return plan_timed(task, replace(timing, refine=False))
        raise LimitError(str(reason)) from None
    except LateError:
        if not task.deadline.late:
            refuse_short(task, timing)  # what is proved at no cost is said, although the work is spent
        raise
    except (InfeasibleError, SolverError) as refused:
        if not task.explained:
            raise
        if timing.refine:  # a refusal of one piece proves nothing of more
            refuse_short(task, timing)
            parted = timing.in_time(replace(task, pieces=PARTS))
            try:
                return plan_timed(parted, replace(timing, refine=False))
            except UnprovedError as other:
                raise min(other, refused, key=lambda error: getattr(error, "shortest", None) or inf) from None
        again = by_necessary_walls(task, timing, refused)
        if isinstance(again, Timed):
            return looked_at(again, task, timing)
        refused = again
        from minsnap.durations.within_limits import at_rest_everywhere

        others = in_other_times(task, timing, refused), at_rest_everywhere(task, timing)
        longer = min(filter(None, others), key=lambda one: one.trajectory.duration, default=None)
        if longer is not None:
            return looked_at(longer, task, timing)
        if isinstance(refused, SolverError) and timing.in_time(task).deadline.late:
            raise LateError(LATE) from None
        raise explained_by_times(refused, task, timing) from None


def looked_at(planned: Timed, task: Task, timing: Timing) -> Timed:
    """Return a plan that keeps all its conditions at a last look, or raise SolverError."""
    checked = task if task.samples is None else replace(task, walls=())
    times = timing.total_time if timing.durations is None else timing.durations
    wrong = fault(checked, planned.trajectory, timing.limits, times, planned.limits_from, planned.solved)
    if wrong is not None:
        raise SolverError(f"the plan is refused at the last look: {wrong}; please report this question")
    return planned


def _timed(task: Task, timing: Timing, refuse: Callable[[], None] = nothing) -> Timed:
    if timing.limits is None and timing.durations is not None:
        solved = solved_or_explained(task, task.piece_durations(timing.durations))
        return timed(solved)
    if timing.limits is None:
        return _of_least_cost(task, timing)
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
            return _from_limits(task, timing, limits, started)
        if timing.durations is not None:
            solved = solved_or_explained(timing.bounded(task), task.piece_durations(timing.durations), refuse)
            return within_limits.require_limits_kept(timed(solved), task, timing)
        return (within_limits.shortest_plan if shortest else within_limits.limited_plan)(task, timing)


def _from_limits(task: Task, timing: Timing, limits: Limits, start: bool) -> Timed:
    """Plan with an end on its limits: without limits if that keeps them, else between ways back and out."""
    from minsnap.durations.ways import connect_ends
    from minsnap.limits.compliance import keeps

    free = _timed(task, replace(timing, limits=None))
    if keeps(limits, free.trajectory):
        return free
    return connect_ends(task, limits, start).in_time(_timed, timing)


def _of_least_cost(task: Task, timing: Timing) -> Timed:
    """Plan a total time, or with a price of time, where nothing limits derivatives."""
    price, search = timing.time_weight, None
    durations = distance_split(task, timing.total) if price is None else priced_first_guess(task, price)
    if timing.split == "distance":
        durations = check_durations(durations, task.legs)
    else:
        durations, search = cheapest_durations(task, timing, durations, price)
    solved = solved_or_explained(task, task.piece_durations(durations))
    return timed(solved, search)

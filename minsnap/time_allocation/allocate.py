"""Durations and plan together: given, split from a total, priced, or the shortest within limits."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_durations, refuse_repeated
from minsnap.basics.deadline import LateError
from minsnap.errors import InfeasibleError, SolverError, TimingError
from minsnap.optimisation.problem import Task
from minsnap.time_allocation.least_cost import CostSearch, distance_split
from minsnap.time_allocation.timing import (
    Finish,
    Run,
    Timed,
    Timing,
    priced_first_guess,
    searched,
    solved_or_explained,
    timed,
)

if TYPE_CHECKING:
    from minsnap.limits.limits import Limits
    from minsnap.optimisation.contradiction import Contradiction
    from minsnap.time_allocation.ways import Ways

EACH = "give every leg a duration of its own"
"""Advice where waypoints repeat."""


def plan_timed(task: Task, timing: Timing, finish: Finish, samples: int | None = None) -> Timed:
    """Choose durations and solve; a refusal says whether it is proved for other durations than those asked for.

    Parameters
    ----------
    task : Task
    timing : Timing
        Checked.
    finish : callable
        Gives a curve its yaw.
    samples : int, optional
        Instants per polynomial at which walls hold; at every instant unless given.

    Raises
    ------
    TimingError, LimitError
        If what is asked for is malformed or contradictory.
    InfeasibleError
        If nothing fits, with the reason.
    """
    try:
        return _timed(task, timing, finish, samples)
    except LateError:
        raise
    except (InfeasibleError, SolverError) as refused:
        proof = refused.contradiction if isinstance(refused, InfeasibleError) else None
        if proof is not None and _asked_for(proof, task, timing):
            raise
        _refuse_short(task, timing, getattr(refused, "shortest", None))
        if proof is not None:
            tried = f"{proof.durations.sum():.4g} s in all"
            refused.args = (f"{refused}; this is proved for the durations chosen last, {tried}, not for others",)
        raise


def _refuse_short(task: Task, timing: Timing, shortest: float | None) -> None:
    """Raise InfeasibleError if the times asked for are proved too short for the velocity alone.

    ``shortest`` is the shortest total found [s], if any.
    """
    if timing.limits is None or not task.explained:
        return
    from minsnap.time_allocation.short_total import short_leg, short_total

    bounded = task.with_walls(timing.limits.walls(task.waypoints))
    if timing.durations is not None:
        proof = short_leg(bounded, check_durations(timing.durations, task.legs))
        if proof is not None:
            leg = proof.rows[0].piece
            raise InfeasibleError(
                f"leg {leg} has {proof.total:.6g} s, and the velocity alone needs {float(proof.least):.6g} s: give it "
                "more time",
                leg=leg,
                contradiction=proof,
            )
    if timing.total_time is not None:
        proof = short_total(bounded, timing.total)
        if proof is not None:
            found = "" if shortest is None else f", and the shortest found is {shortest:.6g} s"
            raise InfeasibleError(
                f"{timing.total:.6g} s are too short for the limits: the velocity alone needs "
                f"{float(proof.least):.6g} s{found}",
                shortest=shortest,
                contradiction=proof,
            )


def _asked_for(proof: Contradiction, task: Task, timing: Timing) -> bool:
    """Whether a proof is of the durations asked for: it may be of others that a search chose."""
    if timing.durations is not None:
        asked = task.piece_durations(check_durations(timing.durations, task.legs))
        return np.array_equal(proof.durations, asked)
    return timing.total_time is not None and len(proof.durations) == 1


def _timed(task: Task, timing: Timing, finish: Finish, samples: int | None = None) -> Timed:
    if timing.limits is not None:
        return _within_limits(task, timing, timing.limits, finish, samples)
    if timing.durations is not None:
        durations = task.piece_durations(check_durations(timing.durations, task.legs))
        return timed(solved_or_explained(task, durations, samples), finish)
    refuse_repeated(task.waypoints, EACH)
    durations, search = _unlimited(task, timing)
    return timed(solved_or_explained(task, task.piece_durations(durations), samples), finish, search)


@np.errstate(over="ignore", invalid="ignore", divide="ignore")  # a step that overflows has no merit, and is refused
def _within_limits(task: Task, timing: Timing, limits: Limits, finish: Finish, samples: int | None) -> Timed:
    from minsnap.time_allocation.ways import on_limits
    from minsnap.time_allocation.within_limits import check_pinned_limits, kept, limited_plan, shortest_plan

    bounded, mended = task.with_walls(limits.walls(task.waypoints)), task.continuity <= task.half - 1
    check_pinned_limits(task, limits, mended)
    if mended and not _shortest(timing) and on_limits(task, limits):
        return _from_limits(task, _checked(timing, task), limits, finish)
    if timing.durations is not None:
        durations = task.piece_durations(check_durations(timing.durations, task.legs))
        return kept(timed(solved_or_explained(bounded, durations, samples), finish), limits)
    refuse_repeated(task.waypoints, EACH)
    if _shortest(timing):
        return shortest_plan(task, bounded, timing, limits, finish)
    return limited_plan(task, bounded, timing, limits, finish)


def _from_limits(task: Task, timing: Timing, limits: Limits, finish: Finish) -> Timed:
    """Plan with an end on its limits: without limits if that keeps them, else between ways back and out."""
    from minsnap.limits.compliance import keeps
    from minsnap.time_allocation.ways import ways_of

    if timing.split != "trapezoid":
        free = _timed(task, replace(timing, limits=None, enforce=None), finish)
        if keeps(limits, free.trajectory):
            return free
    ways = ways_of(task, limits)
    return ways.around(_between(ways, ways.between(timing), limits, finish), limits, finish)


def _between(ways: Ways, timing: Timing, limits: Limits, finish: Finish) -> Timed:
    """Plan between two ways with the pieces asked for, then with more."""
    from minsnap.time_allocation.ways import FINER

    try:
        return _within_limits(replace(ways.task, explained=False), timing, limits, finish, None)
    except LateError:
        raise
    except (InfeasibleError, SolverError):
        return _within_limits(replace(ways.task, pieces=max(FINER, ways.task.pieces)), timing, limits, finish, None)


def _checked(timing: Timing, task: Task) -> Timing:
    """Return the same with times that have been checked."""
    if timing.durations is not None:
        return replace(timing, durations=check_durations(timing.durations, task.legs))
    return timing


def _shortest(timing: Timing) -> bool:
    """Whether the shortest time is asked for."""
    return timing.durations is None and timing.total_time is None and timing.time_weight is None


def _unlimited(task: Task, timing: Timing) -> tuple[FloatArray, Run | None]:
    """Leg durations where nothing limits derivatives."""
    if timing.time_weight is not None:
        price = timing.time_weight
        return searched(
            CostSearch(task, priced_first_guess(task, price), price, timing.progress), timing.best_on_interrupt
        )
    if timing.split == "trapezoid":
        raise TimingError("split='trapezoid' needs limits on speed or acceleration: give limits=")
    first = distance_split(task, timing.total)
    return (
        (check_durations(first, task.legs), None)
        if timing.split == "distance"
        else searched(CostSearch(task, first, None, timing.progress), timing.best_on_interrupt)
    )

"""Shortest plans from a moving start: also from one on or outside its limits, which is first brought back."""

from __future__ import annotations

from dataclasses import replace

from minsnap.basics.deadline import LATE, LateError
from minsnap.errors import InfeasibleError, SolverError
from minsnap.limits.compliance import KEPT, kept_from
from minsnap.limits.limits import Limits
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.task import Task
from minsnap.time_allocation.recovery import connect_start, start_state, start_use
from minsnap.time_allocation.strategy import Strategy
from minsnap.time_allocation.timing import AttachHeading, Run, Timed, Timing, timed
from minsnap.time_allocation.ways import (
    ON_LIMIT,
    PIECES_BETWEEN,
    Recovered,
    connect_ends,
    end_on_limit,
    from_end,
    joined,
    no_connector,
)
from minsnap.trajectory.trajectory import Trajectory


def moves(task: Task) -> bool:
    """Whether the start has a derivative that is not zero."""
    return any(value.any() for value in task.pins.get(0, {}).values())


def shortest_from(
    task: Task, limits: Limits, timing: Timing, finish: AttachHeading, first: Trajectory | None = None
) -> tuple[SolvedTask, Run] | Recovered:
    """Find the shortest plan from a moving start.

    Parameters
    ----------
    task : Task
        Without walls of the limits.
    limits : Limits
    timing : Timing
    finish : callable
        Gives a curve its yaw.
    first : Trajectory, optional
        To search from.

    Raises
    ------
    InfeasibleError, SolverError
        If no plan was found from the start, nor from the end of any way back.
    LimitError
        If the start exceeds a limit, and no way back was found.
    """
    began = task.deadline.clock()
    if end_on_limit(task, limits):
        ways = connect_ends(task, limits, start=False)
        solved = shortest_from(ways.task, limits, _remaining(timing, task, began), finish, first)
        return ways.around(as_timed(solved, finish), limits, finish)
    if start_use(task, limits) > (1.0 - ON_LIMIT if first is None else 1.0 + KEPT):
        return _brought_back(task, limits, timing, finish, None)
    try:
        return Strategy(task, limits, timing, finish).run(first)
    except LateError:
        raise
    except (InfeasibleError, SolverError) as refused:
        return _brought_back(task, limits, _remaining(timing, task, began), finish, refused)


def _remaining(timing: Timing, task: Task, began: float) -> Timing:
    """Return the same with the time that is left of its limit."""
    if timing.time_limit is None:
        return timing
    left = timing.time_limit - (task.deadline.clock() - began)
    if left <= 0.0:
        raise LateError(LATE)
    return replace(timing, time_limit=left)


def _brought_back(
    task: Task, limits: Limits, timing: Timing, finish: AttachHeading, refused: InfeasibleError | SolverError | None
) -> Recovered:
    """Go the shortest way back, and plan from its end; raise ``refused`` where that fails too."""
    began = task.deadline.clock()
    way = connect_start(start_state(task), task.walls, limits, task.deadline)
    timing = _remaining(timing, task, began)
    if way is None:
        raise refused or no_connector(task, limits, 0)
    solved, run = _searched_from_end(from_end(task, way), limits, timing, finish, refused)
    whole = finish(joined(way.piece, solved.trajectory))
    start = kept_from(limits, whole)
    if start > way.piece.duration * (1.0 + KEPT):
        raise refused or SolverError(f"the limits are kept from {start:.4g} s only, after the way back: loosen a limit")
    return Recovered(solved, whole, run.steps, run.interrupted, limits_from=start)


def _searched_from_end(
    task: Task, limits: Limits, timing: Timing, finish: AttachHeading, refused: InfeasibleError | SolverError | None
) -> tuple[SolvedTask, Run]:
    """Search with the pieces of the request, then with more."""
    began = task.deadline.clock()
    try:
        return Strategy(task, limits, timing, finish).run()
    except LateError:
        raise
    except (InfeasibleError, SolverError) as again:
        if task.pieces < PIECES_BETWEEN:
            timing = _remaining(timing, task, began)
            return _searched_from_end(replace(task, pieces=PIECES_BETWEEN), limits, timing, finish, refused or again)
        raise refused or again from None


def as_timed(solved: tuple[SolvedTask, Run] | Recovered, finish: AttachHeading) -> Timed:
    """Wrap the result of a search."""
    return solved if isinstance(solved, Recovered) else timed(solved[0], finish, solved[1])

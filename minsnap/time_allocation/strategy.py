"""What is tried for the shortest plan within limits, in which order, and when it ends.

1. One interior point on the whole problem, natively, where it knows all that is asked (``interior_search``); a plan
   that exact extrema certify is the answer.
2. Else the sequence of cone programmes (``least_time``), which knows every limit, begins from curves that are given,
   and says why where it finds nothing.

Both end when the time allowed is over, and where Ctrl-C asks for the best so far.
"""

from __future__ import annotations

from minsnap.basics.deadline import LATE, LateError
from minsnap.limits.limits import Limits
from minsnap.optimisation.problem import Task
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.time_allocation.interior_search import interior_search, serves
from minsnap.time_allocation.least_cost import Log
from minsnap.time_allocation.least_time import FirstGuess, LeastTime
from minsnap.time_allocation.timing import Finish, Run, Timing


def searched_from(
    task: Task, limits: Limits, timing: Timing, finish: Finish, first: FirstGuess | None = None
) -> tuple[SolvedTask, Run]:
    """Search for the shortest plan.

    Parameters
    ----------
    task : Task
        Without walls of the limits.
    limits : Limits
    timing : Timing
    finish : callable
        Gives a curve its yaw.
    first : callable, optional
        Gives the state to search from.

    Raises
    ------
    InfeasibleError, SolverError, LateError, LimitError
        As ``LeastTime`` does.
    """
    task.deadline.check()
    began = task.deadline.clock()
    if first is None and serves(task, limits):
        search = InteriorRun(task, limits, timing, finish)
        solved = search.run()
        if search.interrupted and solved is None:
            solved = LeastTime(task, limits, finish).resting()
        if solved is not None:
            return solved, Run(tuple(search.log.steps), search.interrupted)
    left = timing.time_limit
    if left is not None:
        left -= task.deadline.clock() - began
        if left <= 0.0:
            raise LateError(LATE)
    progress, best = timing.progress, timing.best_on_interrupt
    return LeastTime(task, limits, finish, progress, left, timing.refine, best, first).run()


class InteriorRun:
    """One run of the interior point until the time allowed is over or Ctrl-C ends it.

    Parameters
    ----------
    task : Task
    limits : Limits
    timing : Timing
    finish : callable
    """

    def __init__(self, task: Task, limits: Limits, timing: Timing, finish: Finish) -> None:
        self.task, self.limits, self.timing, self.finish = task, limits, timing, finish
        self.log, self.interrupted = Log(timing.progress), False
        limit = timing.time_limit
        self.due = task.deadline.due if limit is None else min(task.deadline.due, task.deadline.clock() + limit)

    def run(self) -> SolvedTask | None:
        """Return a certified plan, if there is one."""
        try:
            return interior_search(self.task, self.limits, self.finish, self.timing.refine, self._poll)
        except KeyboardInterrupt:
            if not self.timing.best_on_interrupt:
                raise
            self.interrupted = True
            return None

    def _poll(self, total: float) -> bool:
        try:
            self.log.add(total, total)
        except KeyboardInterrupt:
            if not self.timing.best_on_interrupt:
                raise
            self.interrupted = True
        self.interrupted = self.interrupted or self.task.deadline.clock() > self.due
        return self.interrupted

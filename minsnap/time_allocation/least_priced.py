"""The least cost within limits for a price of time or for a total: one search over the curve and its durations.

It begins from the plan of least cost without limits, which is returned where it keeps them; else from that curve, flown
as slowly as they ask for.
"""

from __future__ import annotations

from minsnap.basics.arrays import FloatArray
from minsnap.limits.compliance import keeps
from minsnap.limits.limits import Limits
from minsnap.optimisation.problem import Task
from minsnap.optimisation.solve import solve
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.time_allocation.joint_layout import JointState
from minsnap.time_allocation.joint_search import Evaluated, JointSearch
from minsnap.time_allocation.least_cost import CostSearch
from minsnap.time_allocation.least_time import LeastTime
from minsnap.time_allocation.objectives import PricedCost
from minsnap.time_allocation.timing import Finish, Run, Timing, priced_first_guess, searched

ROUNDS = 12
"""Searches with other prices until the total is reached."""

NEAR = 1e-5
"""Share of the total by which the search ends before it; the plan is flown more slowly by that."""

STIFFNESS, STIFFER = 100.0, 4.0
"""Price of the distance to the total, first and from search to search: prices per share of the total."""


class LeastPriced(LeastTime):
    """One such search.

    Parameters
    ----------
    task : Task
        Without walls of limits.
    limits : Limits
    timing : Timing
    finish : callable
        Gives a trajectory its yaw.
    """

    def __init__(self, task: Task, limits: Limits, timing: Timing, finish: Finish) -> None:
        progress, ends = timing.progress, timing.best_on_interrupt
        super().__init__(task, limits, finish, progress, timing.time_limit, best_on_interrupt=ends)
        units = self.problem.units
        self.value_unit = units.length**2 * units.time ** (1.0 - 2.0 * task.half)
        self.layout = self.problem.layout(task.pieces)

    def priced(self, price: float) -> tuple[SolvedTask, Run]:
        """Return the plan of least cost and price of time [1/s], and how it was found.

        A search that was interrupted before it had a plan within the limits returns one beyond them.

        Raises
        ------
        InfeasibleError
            If limits or walls cannot be kept at any speed.
        """
        solved, run = self.free(priced_first_guess(self.task, price), price)
        if run.interrupted or keeps(self.limits, self.finish(solved.trajectory)):
            return solved, run
        search = self._search(price * self.problem.units.time / self.value_unit)
        found = self._settled(search, self._start(search, solved))
        return self._ended(search, found), Run(tuple(self.log.steps), self.interrupted)

    def at_total(self, total: float, solved: SolvedTask) -> SolvedTask | None:
        """Return the plan of least cost with a total time [s], from the one without limits; None if none was found."""
        goal = (1.0 - NEAR) * total / self.problem.units.time
        price = (2 * self.task.half - 1) * solved.cost / self.value_unit / goal
        stiffness = STIFFNESS * price / goal
        search = self._search(price)
        state = self._start(search, solved)
        for _ in range(ROUNDS):
            search.objective = PricedCost(self.layout, price, goal, stiffness)
            found = self._settled(search, state)
            state, apart = found.state, found.state.total - goal
            if self.interrupted or abs(apart) <= NEAR * goal:
                break
            price, stiffness = max(price + stiffness * apart, 0.0), STIFFER * stiffness
        return self._certified(search, found)

    def free(self, first: FloatArray, price: float | None = None) -> tuple[SolvedTask, Run]:
        """Return the plan of least cost without limits, for a price or for the total of first durations."""
        durations, run = searched(CostSearch(self.task, first, price, self.log.progress), self.best_on_interrupt)
        self.log.steps = list(run.steps)
        return solve(self.task, self.task.piece_durations(durations), units=self.problem.units), run

    def _search(self, price: float) -> JointSearch:
        return self.problem.search(self.task.pieces, self._tell, self._tick, objective=PricedCost(self.layout, price))

    def _start(self, search: JointSearch, solved: SolvedTask) -> JointState:
        state = self.layout.state(solved.optimum.knots, solved.problem.durations)
        return self._slow_enough(search, state) if self.task.still else state

    def _ended(self, search: JointSearch, found: Evaluated) -> SolvedTask:
        solved = self._certified(search, found)
        if solved is None:
            raise self._reason(search, found)
        return solved

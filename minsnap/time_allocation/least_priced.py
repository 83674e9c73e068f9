"""The least cost within limits for a price of time or for a total: one search over the curve and its durations.

It begins from the plan of least cost without limits, which is returned where it keeps them; else from that curve, flown
as slowly as they ask for.
"""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.limits.compliance import keeps, largest_use
from minsnap.limits.limits import Limits
from minsnap.optimisation.solve import solve
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.task import Task
from minsnap.time_allocation.least_cost import CostSearch
from minsnap.time_allocation.shortest_question import guess_of
from minsnap.time_allocation.strategy import Strategy
from minsnap.time_allocation.timing import AttachHeading, Run, Timing, priced_first_guess, searched
from minsnap.trajectory.trajectory import Trajectory

ROUNDS = 12
"""Searches with other prices until the total is reached."""

BELOW_TOTAL = 1e-5
"""Share of the total by which the search ends before it; the plan is flown more slowly by that."""

TOTAL_MET, PRICE_STEP = 5e-5, 2.0
"""How near to the total, as a share of it, is near enough, and how far the logarithm of the price goes at once."""


class LeastPriced:
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

    def __init__(self, task: Task, limits: Limits, timing: Timing, finish: AttachHeading) -> None:
        self.task, self.limits, self.timing, self.finish = task, limits, timing, finish
        self.strategy = Strategy(task, limits, timing, finish)
        self.log = self.strategy.log

    @property
    def interrupted(self) -> bool:
        """Whether it was ended from outside."""
        return self.strategy.interrupted

    def priced(self, price: float) -> tuple[SolvedTask, Run]:
        """Return the plan of least cost and price of time [1/s], and its search.

        A search that was interrupted before it had a plan within the limits returns one beyond them.

        Raises
        ------
        InfeasibleError
            If limits or walls cannot be kept at any speed.
        SolverError
            If none was found that does.
        """
        free, run = self.free(priced_first_guess(self.task, price), price)
        if run.interrupted or keeps(self.limits, self.finish(free.trajectory)):
            return free, run
        solved = self._from(free.trajectory, price)
        if solved is None:
            raise self.strategy.reason()
        return solved, Run(tuple(self.log.steps), self.interrupted)

    def at_total(self, total: float, free: SolvedTask) -> SolvedTask | None:
        """Return the plan of least cost in barely less than a total [s]; None without one.

        The price of time is changed until the plan for it takes that long: the logarithm of the time is about linear in
        that of the price.
        """
        goal, slope = total * (1.0 - BELOW_TOTAL), -0.5 / self.task.half
        price = _grained((2 * self.task.half - 1) * free.cost / goal)
        best: SolvedTask | None = None
        solved, low, high, before = self._from(free.trajectory, price), 0.0, np.inf, (np.nan, np.nan)
        for _ in range(ROUNDS):
            if solved is None or self.interrupted:
                break
            apart, place = float(np.log(solved.trajectory.duration / goal)), float(np.log(price))
            if apart <= 0.0 and (best is None or solved.trajectory.duration > best.trajectory.duration):
                best = solved
            if -TOTAL_MET <= apart <= 0.0:
                break
            low, high = (price, high) if apart > 0.0 else (low, price)
            if place != before[0] and np.isfinite(before[0]):
                slope = float(np.clip((apart - before[1]) / (place - before[0]), -1.0, -1e-3))
            before = place, apart
            price = float(
                np.exp(np.clip(place - (apart + 0.5 * TOTAL_MET) / slope, place - PRICE_STEP, place + PRICE_STEP))
            )
            price = _grained(price if low < price < high else float(np.sqrt(low * high)))
            solved = self._from(solved.trajectory, price)
        return best

    def free(self, first: FloatArray, price: float | None = None) -> tuple[SolvedTask, Run]:
        """Return the plan of least cost without limits, for a price or for the total of first durations."""
        search = CostSearch(self.task, first, price, self.log.progress)
        durations, run = searched(search, self.timing.best_on_interrupt)
        self.log.steps = list(run.steps)
        return solve(self.task, self.task.piece_durations(durations)), run

    def _from(self, curve: Trajectory, price: float) -> SolvedTask | None:
        slower = max(1.0, min(largest_use(self.limits, self.finish(curve)), 10.0)) if self.task.still else 1.0
        guess = guess_of(curve, self.task, _grained(slower))
        return self.strategy.solve(guess, price)


def _grained(value: float) -> float:
    """Six digits, as no rounding of a library may decide a plan."""
    return float(f"{value:.6g}")

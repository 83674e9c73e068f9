"""How a total time is split over the legs: by distance, or so that the cost is least."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray, rounded
from minsnap.basics.deadline import LateError
from minsnap.durations.native_split import native_split
from minsnap.durations.timing import Run, Timing, attempted, searched
from minsnap.optimisation.solve import Effort, solve
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.task import Task
from minsnap.trajectory.report import Progress, Step


@dataclass(frozen=True)
class SplitSettings:
    """How a total is split by distance, and how a search for the least cost ends.

    Parameters
    ----------
    least_length : float
        Least share of the length of all legs that one has in a split by distance.
    least_share : float
        Least share of its first guess that a leg may get; the most is one over it.
    barred : float
        Added to the logarithm of the best cost where durations cannot be flown, so that a line search turns back.
    iterations, accuracy, flat : int, float
        Iterations of L-BFGS at most, and the relative change of the cost and the slope at which it ends.
    memory : int
        Steps from which it knows the curvature.
    decimals, digits : int
        To which what it sees is rounded: the logarithm of the cost with its slopes, and the durations.
    """

    least_length: float = 1e-12
    least_share: float = 1e-4
    barred: float = 3.0
    iterations: int = 500
    accuracy: float = 1e-10
    flat: float = 1e-7
    memory: int = 20
    decimals: int = 9
    digits: int = 8


SPLITS = SplitSettings()


class Log:
    """The steps of a search, told as they are made."""

    def __init__(self, progress: Progress | None) -> None:
        self.progress = progress
        self.steps: list[Step] = []
        self.best = np.inf

    def forget(self) -> None:
        """Begin anew with the least value: excesses have another price from now on."""
        self.best = np.inf

    def add(self, total_time: float, value: float) -> None:
        """Record one evaluation."""
        self.best = min(value, self.best)
        self.steps.append(Step(len(self.steps) + 1, total_time, value, self.best))
        if self.progress is not None:
            self.progress(self.steps[-1])


def distance_split(task: Task, total: float) -> FloatArray:
    """Leg durations (legs,) [s] in proportion to the straight lengths, of the shortest legs a least share of all."""
    lengths = np.maximum(task.lengths, SPLITS.least_length * task.lengths.sum())
    return np.asarray(total * lengths / lengths.sum())


class CostSearch:
    """Search for leg durations of least cost: at a fixed total, or with a price on time.

    The logarithm of cost + price * time is minimised over logarithms of the durations by L-BFGS, with exact gradients;
    at a fixed total the durations are the shares of it. The native core does it where it can; else scipy does.

    Parameters
    ----------
    task : Task
    first : ndarray, shape (legs,)
        Durations to begin with [s]; their sum is the total.
    price : float, optional
        Cost of a second (Richter et al. 2013); without it the total is fixed.
    progress : callable, optional
        Called with every Step.
    """

    def __init__(
        self, task: Task, first: FloatArray, price: float | None = None, progress: Progress | None = None
    ) -> None:
        self.task, self.first, self.price = task, first, price
        self.units = task.units(task.piece_durations(first))
        self.best = (np.inf, first)
        self.log = Log(progress)

    def run(self) -> FloatArray:
        """Return the best leg durations, shape (legs,) [s]; the first ones where there is no time for others."""
        if self.task.legs == 1 and self.price is None:
            return self.first
        with suppress(LateError):
            split = native_split(self.task, self.first, self.price)
            if split is None:
                self._by_gradients()
            else:
                self.best = (float(split.history[:, 1].min()), split.durations)
                for total, value in split.history.tolist():
                    self.log.add(total, value)
        return self.best[1]

    def _by_gradients(self) -> None:
        from scipy.optimize import minimize

        reach = -np.log(SPLITS.least_share)
        bounds = [(-reach, reach)] * self.task.legs
        ends = {"maxiter": SPLITS.iterations, "ftol": SPLITS.accuracy, "gtol": SPLITS.flat, "maxcor": SPLITS.memory}
        minimize(self.evaluate, np.zeros(len(bounds)), jac=True, method="L-BFGS-B", bounds=bounds, options=ends)

    def evaluate(self, logarithms: FloatArray) -> tuple[float, FloatArray]:
        """Logarithm of what is minimised and its gradient, at logarithms of factors on the first durations.

        All are rounded: L-BFGS rounds otherwise with other kernels of linear algebra, and must not decide a plan.
        """
        self.task.deadline.check()
        if np.isfinite(self.best[0]) and self.task.deadline.spent:
            raise self.task.deadline.error()
        durations = self._durations(logarithms)
        times = self.task.piece_durations(durations)
        effort = Effort.TRY if np.isfinite(self.best[0]) else Effort.WHOLE
        solved = attempted(solve, self.task, times, units=self.units, prove=False, effort=effort)
        if not isinstance(solved, SolvedTask):
            return float(np.log(self.best[0])) + SPLITS.barred, np.zeros(len(durations))
        from minsnap.optimisation.gradient import cost_gradient

        relative = leg_sums(cost_gradient(solved) * solved.problem.durations * self.units.time, self.task.pieces)
        value = solved.cost
        if self.price is None:
            relative = relative - durations / durations.sum() * relative.sum()
        else:
            value, relative = value + self.price * durations.sum(), relative + self.price * durations
        if value < self.best[0]:
            self.best = (value, durations)
        self.log.add(float(durations.sum()), float(value))
        if not value > 0.0:  # it rests: nothing costs less
            return float(np.log(np.finfo(np.float64).tiny)), np.zeros(len(durations))
        return round(float(np.log(value)), SPLITS.decimals), (relative / value).round(SPLITS.decimals)

    def _durations(self, logarithms: FloatArray) -> FloatArray:
        durations = rounded(self.first * np.exp(logarithms), SPLITS.digits)
        return durations if self.price is not None else np.asarray(self.first.sum() / durations.sum() * durations)


def cheapest_durations(task: Task, timing: Timing, first: FloatArray, price: float | None) -> tuple[FloatArray, Run]:
    """Return the leg durations of least cost found in time, from first ones (legs,) [s], and their search."""
    return searched(CostSearch(timing.in_time(task), first, price, timing.progress), timing.best_on_interrupt)


def leg_sums(values: FloatArray, pieces: int) -> FloatArray:
    """Sum values of pieces (pieces in all,) over each leg."""
    return np.asarray(values.reshape(-1, pieces).sum(axis=1))

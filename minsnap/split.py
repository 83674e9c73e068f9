"""How a total time is split over the legs: by distance, by a trapezoid of speed, or so that the cost is least."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from minsnap.compiled import Rows
from minsnap.errors import TimingError
from minsnap.samples import FloatArray
from minsnap.sensitivity import cost_gradient
from minsnap.solver import Solved, solve
from minsnap.task import Task

SHORTEST = 1e-4
"""Least share of an equal split that a leg may get."""

ACCURACY = 1e-10
"""Relative change of the cost at which the search ends."""

ITERATIONS = 500


def distance_split(task: Task, total: float) -> FloatArray:
    """Leg durations (legs,) [s] in proportion to the straight lengths."""
    return np.asarray(total * task.lengths / task.lengths.sum())


@dataclass(frozen=True, eq=False)
class Step:
    """One evaluation of a search.

    Parameters
    ----------
    evaluation : int
        Counted from 1.
    total_time : float
        [s].
    value : float
        What is minimised there: a cost, or a time [s].
    """

    evaluation: int
    total_time: float
    value: float


class OptimalSplit:
    """Search for the leg durations of a given total that make the optimal cost least.

    The logarithm of the cost is minimised over logarithms of the shares by L-BFGS (scipy), with exact gradients.
    """

    def __init__(self, task: Task, total: float, progress: Callable[[Step], None] | None = None) -> None:
        self.task, self.total, self.progress = task, total, progress
        self.units = task.units(task.piece_durations(distance_split(task, total)))
        self.seed: Rows | None = None
        self.best = (np.inf, distance_split(task, total))
        self.history: list[Step] = []

    def run(self) -> FloatArray:
        """Return the best leg durations found, shape (legs,) [s]."""
        if self.task.legs == 1:
            return np.array([self.total])
        from scipy.optimize import minimize

        first = np.log(distance_split(self.task, self.total) / self.total)
        bounds = [(np.log(SHORTEST / self.task.legs), 0.0)] * self.task.legs
        options = {"maxiter": ITERATIONS, "ftol": ACCURACY, "gtol": 1e-7, "maxcor": 20}
        minimize(self._evaluate, first, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
        return self.best[1]

    def durations(self, logarithms: FloatArray) -> FloatArray:
        """Leg durations from logarithms of shares."""
        shares = np.exp(logarithms - logarithms.max())
        return np.asarray(self.total * shares / shares.sum())

    def _evaluate(self, logarithms: FloatArray) -> tuple[float, FloatArray]:
        durations = self.durations(logarithms)
        solved = solve(self.task, self.task.piece_durations(durations), units=self.units, seed=self.seed)
        self.seed = active_rows(solved)
        cost = solved.cost
        if cost < self.best[0]:
            self.best = (cost, durations)
        self._tell(cost)
        relative = leg_sums(cost_gradient(solved) * solved.problem.durations * self.units.time, self.task.pieces)
        share = durations / self.total
        return float(np.log(cost)), (relative - share * relative.sum()) / cost

    def _tell(self, cost: float) -> None:
        self.history.append(Step(len(self.history) + 1, self.total, cost))
        if self.progress is not None:
            self.progress(self.history[-1])


def active_rows(solved: Solved) -> Rows | None:
    """Rows of a solved task whose multipliers are not zero, to begin the next solve with."""
    rows, multipliers = solved.outcome.rows, solved.outcome.multipliers
    if rows is None or not (multipliers > 0.0).any():
        return None
    kept = multipliers > 1e-9 * multipliers.max()
    return rows.source.chosen(kept)


def leg_sums(values: FloatArray, pieces: int) -> FloatArray:
    """Sum values of pieces (pieces in all,) over each leg."""
    return np.asarray(values.reshape(-1, pieces).sum(axis=1))


def check_split(split: str) -> str:
    """Return the name of a split, or raise TimingError."""
    if split not in ("optimal", "distance", "trapezoid"):
        raise TimingError(f"split is {split!r}: use 'optimal', 'distance' or 'trapezoid'")
    return split

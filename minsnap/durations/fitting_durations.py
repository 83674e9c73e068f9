"""Durations for which a curve fits between all walls, where those that a search chose leave none.

A search without gradients (J. A. Nelder and R. Mead, "A simplex method for function minimization", The Computer Journal
7, 1965) changes them until the least slack of all walls is gone.  Where that is not known, it is the largest excess of
the curve of least cost.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import FloatArray, rounded, significant
from minsnap.basics.deadline import WORK, Deadline
from minsnap.corridors.constraint import Walls
from minsnap.durations.timing import attempted, found_in
from minsnap.native.status import Status
from minsnap.optimisation.least_slacks import common_slack, native_slacks
from minsnap.optimisation.solve import Effort
from minsnap.optimisation.task import Task
from minsnap.optimisation.task_walls import all_walls
from minsnap.polynomials.bernstein import basis, differentiate
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True)
class FittingSettings:
    """When a search for durations ends.

    Parameters
    ----------
    wanted_room : float
        Room inside all walls at which the search ends, in widths.
    effort : float
        Of the least slacks of one try.
    same_minimum : float
        Two starts whose least excesses differ by less than this share count as one minimum.
    hopeless_slack : float
        Slack above which durations count as having no curve where the work ended before its least value was found.
    patience, least_fall : int, float
        The excess must fall to this share within this many iterations for each leg, or the search ends.
    slow_fall_excess : float
        Excess beyond the wanted room below which it may fall more slowly, in widths.
    """

    wanted_room: float = 0.01
    effort: float = 0.4
    same_minimum: float = 0.99
    hopeless_slack: float = 0.3
    patience: int = 5
    least_fall: float = 0.7
    slow_fall_excess: float = 0.05


FITTING = FittingSettings()


def fitting_durations(
    task: Task, starts: Iterable[FloatArray], total: float | None, deadline: Deadline
) -> FloatArray | None:
    """Find durations of the legs.

    Parameters
    ----------
    task : Task
        With all walls.
    starts : iterable of ndarray, shape (legs,)
        Durations to begin with [s], one after another; without a total they are scaled first.
    total : float or None
        Of all legs together [s]; it leaves one leg nothing to choose.
    deadline : Deadline
        At which the search ends.

    Returns
    -------
    ndarray, shape (legs,), or None
        [s]; None where none were found.
    """
    if total is not None and task.legs == 1:
        return None
    least = np.inf
    for first in starts:
        search = _LeastExcess(task, first, total, deadline)
        search.run()
        excess, at = search.best
        if excess < 0.0:
            return search.durations(at)
        if excess == np.inf or excess > FITTING.same_minimum * least:  # no curve at all, or the last minimum
            return None
        least = excess
    return None


class _LeastExcess:
    """The least excess over all walls at logarithms of factors on the first durations; parameters as above."""

    def __init__(self, task: Task, first: FloatArray, total: float | None, deadline: Deadline) -> None:
        self.task = replace(task, touching=False, deadline=deadline)
        self.free, self.give = replace(self.task, walls=()), common_slack(all_walls(self.task))
        self.first, self.total, self.deadline = first, total, deadline
        self.best, self.excesses = (np.inf, np.zeros(len(first))), list[float]()

    def durations(self, logarithms: FloatArray) -> FloatArray:
        """Return durations of the legs [s], of six digits, as no rounding of a library may decide a plan."""
        durations = self.first * np.exp(logarithms)
        durations *= 1.0 if self.total is None else self.total / durations.sum()
        durations = rounded(durations, 6)
        return durations if self.total is None else np.asarray(durations * (self.total / durations.sum()))

    def excess(self, logarithms: FloatArray) -> float:
        """Return the least excess in widths, of six digits; that of no curve once the work is done."""
        if self.deadline.spent:
            return 1e3
        least = attempted(self._least, self.free.piece_durations(self.durations(logarithms)))
        if not isinstance(least, float):
            return 1e3
        excess = significant(least)
        if excess < self.best[0]:
            self.best = (excess, logarithms.copy())
        return excess

    def _least(self, durations: FloatArray) -> float | None:
        known = native_slacks(self.task, durations, self.give, -2.0 * FITTING.wanted_room, effort=FITTING.effort)
        self.deadline.spend(WORK.free_curve)
        if known is not None and known.status is Status.DONE:
            return float(known.slacks.max())
        if known is not None and known.status is Status.SPENT and known.slacks.max() > FITTING.hopeless_slack:
            return None  # it is far from gone, and its work is spent
        free = found_in(self.free, durations, Effort.WHOLE)
        return None if free is None else _largest_excess(self.task.walls, free.trajectory)

    def run(self) -> None:
        """Find the best logarithms, of one scale for all first."""
        from scipy.optimize import minimize

        start = np.zeros(self.task.legs)
        if self.total is None:
            scales = sorted(np.linspace(-3.0, 3.0, 25), key=abs)  # the first where it does not matter
            start += scales[np.argmin([self.excess(np.full(len(start), scale)) for scale in scales])]
        else:
            self.excess(start)
        if self.best[0] == np.inf:
            return
        simplex = start + np.vstack((np.zeros(len(start)), 0.3 * np.eye(len(start))))
        options = {"maxfev": 40 * len(start), "xatol": 1e-4, "fatol": 1e-5, "initial_simplex": simplex}
        minimize(self.excess, start, method="Nelder-Mead", callback=self.check, options=options)

    def check(self, _: FloatArray) -> None:
        """End the search where a curve has some room, its excess barely falls, or the time is over."""
        self.excesses.append(self.best[0] + FITTING.wanted_room)
        window, now = FITTING.patience * self.task.legs, self.excesses[-1]
        before = self.excesses[-1 - window] if len(self.excesses) > window else np.inf
        if now < 0.0 or now > max(FITTING.least_fall * before, FITTING.slow_fall_excess) or self.deadline.passed:
            raise StopIteration


def _largest_excess(walls: Sequence[Walls], curve: Trajectory) -> float:
    """Return the largest excess over walls, in widths, at 33 instants of each piece."""
    instants, largest = np.linspace(0.0, 1.0, 33), -np.inf
    for wall in walls:
        points = differentiate(curve.control_points, wall.order) / curve.durations[:, None, None] ** wall.order
        values = np.einsum("sn,pnd->psd", basis(points.shape[1] - 1, instants), points)
        row, piece = wall.on_pieces(curve.pieces)
        slack = wall.chosen(row).slack(values[piece]) / wall.width[row, None]
        largest = max(largest, float(-slack.min(initial=np.inf)))
    return largest

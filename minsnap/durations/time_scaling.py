"""Plans that keep limits by their time scale alone, in given proportions or the best ones."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from minsnap.basics.arrays import FloatArray, rounded, significant
from minsnap.basics.deadline import LateError
from minsnap.corridors.constraint import Walls
from minsnap.durations.initial_guess import stop_and_go_times
from minsnap.durations.least_cost import SPLITS, Log, distance_split
from minsnap.durations.outcome import PlanOutcome
from minsnap.durations.time_stretch import (
    kept_factor,
    measuring_work,
    nearby_factor,
    without_derivative_walls,
)
from minsnap.durations.timing import (
    Run,
    Timed,
    Timing,
    attempted,
    found_in,
    searched,
    solved_or_explained,
    timed,
)
from minsnap.errors import SolverError, TimingError
from minsnap.limits.compliance import keeps, largest_use, most_used
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.optimisation.solve import Effort
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.task import Task
from minsnap.refusals.sentences import yaw_too_fast

SCALED_LEGS = 20
"""Legs up to which the proportions of a plan that is only scaled are searched."""


def scaled_plan(task: Task, timing: Timing) -> PlanOutcome:
    """Plan in given proportions, or the best ones, and scale to touch the limits."""
    if not task.still:
        raise TimingError("derivatives that are pinned do not scale with time: use split='optimal'")
    limits, shape = timing.bounds, without_derivative_walls(task)
    first = task.piece_durations(distance_split(task, float(task.legs)))
    search = None
    if timing.split == "optimal" and 1 < task.legs <= SCALED_LEGS:
        scaled = _ScaledSearch(task, timing)
        first, search = searched(scaled, timing.best_on_interrupt)
    solved = solved_or_explained(shape, first)
    if not isinstance(solved, SolvedTask):
        return PlanOutcome(reason=solved)
    return PlanOutcome(flown_fastest(solved, limits, task.walls, search))


def flown_fastest(solved: SolvedTask, limits: Limits, walls: Sequence[Walls], search: Run | None) -> Timed:
    """Fly a path as fast as limits and walls on derivatives allow.

    Raises
    ------
    LimitError
        If a yaw that is a function of time turns too fast at that speed.
    SolverError
        If no speed was found at which it leaves the rotors enough.
    """
    yaw, deadline = solved.flown.yaw, solved.task.deadline
    limited = isinstance(limits, VehicleLimits) or limits.yaw_rate is not None
    turns = limited and yaw.constant is None and yaw.medium is None
    factor = kept_factor(limits, walls, solved.flown, roughly=turns, deadline=deadline)
    planned = timed(solved, search, factor)
    if not turns or keeps(limits, planned.trajectory):
        return planned
    nearby = nearby_factor(limits, lambda slower: timed(solved, factor=factor * slower).trajectory, deadline=deadline)
    if nearby is not None:
        return timed(solved, search, factor * nearby)
    used = most_used(limits, planned.trajectory)
    if used.name == "yaw_rate":
        raise yaw_too_fast(used)
    raise SolverError("no speed was found at which the path keeps its limits with a yaw that is a function of time")


class _ScaledSearch:
    """Proportions of the durations whose plan of least cost, scaled to the limits, is shortest; without gradients.

    Parameters
    ----------
    task, timing
        As of a plan within limits.
    """

    def __init__(self, task: Task, timing: Timing) -> None:
        self.task, self.limits = task, timing.bounds
        self.deadline = timing.in_time(task).deadline
        self.price = measuring_work(self.limits, task.legs * task.pieces)
        self.first = task.piece_durations(stop_and_go_times(task.lengths, self.limits))
        self.shape = without_derivative_walls(task)
        self.best: tuple[float, FloatArray] = (np.inf, self.first)
        self.log = Log(timing.progress)

    def run(self) -> FloatArray:
        """Return the best durations (proportions matter), shape (pieces in all,)."""
        from scipy.optimize import minimize

        start = np.zeros(self.task.legs - 1)
        if np.isfinite(self.evaluate(start)):
            options = {"maxfev": 100 * self.task.legs, "xtol": 1e-3, "ftol": 1e-4}
            with suppress(LateError):
                minimize(self.evaluate, start, method="Powell", options=options)
        return self.best[1]

    def evaluate(self, logarithms: FloatArray) -> float:
        """Logarithm of the scaled total; above the best by ``barred`` where there is no plan."""
        durations = self.first * np.repeat(rounded(np.exp(np.append(logarithms, 0.0)), 9), self.task.pieces)
        barred = self.best[0] + SPLITS.barred
        if np.isfinite(barred) and self.deadline.passed:
            raise self.deadline.error()
        solved = found_in(self.shape, durations, Effort.TRY if np.isfinite(barred) else Effort.WHOLE)
        if solved is None:
            return barred
        trajectory = solved.flown
        guess = np.exp(self.best[0]) / trajectory.duration if np.isfinite(barred) else None
        if guess is not None:
            self.deadline.spend(self.price)
            used = largest_use(self.limits, trajectory.stretched(guess), proved=False)
            if used > 1.05:  # slower than the best by about the root of it, which will do
                return self.best[0] + min(0.5 * float(np.log(used)), SPLITS.barred)
        factor = attempted(kept_factor, self.limits, self.task.walls, trajectory, guess, True, self.deadline)
        if not isinstance(factor, float):
            return barred
        value = significant(float(np.log(trajectory.duration * factor)), 9)
        if value < self.best[0]:
            self.best = (value, durations)
        total = float(np.exp(value))
        self.log.add(total, total)
        return value

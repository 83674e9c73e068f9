"""Plans that keep limits by their time scale alone, in given proportions or the best ones."""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import TimingError
from minsnap.limits.limits import Limits
from minsnap.optimisation.task import Task
from minsnap.time_allocation.derivative_walls import kept_factor, without_derivative_walls
from minsnap.time_allocation.initial_guess import norm_limits, stop_and_go_times
from minsnap.time_allocation.least_cost import Log, distance_split, trapezoid_times
from minsnap.time_allocation.timing import AttachHeading, Timed, Timing, searched, solved_or_explained, timed

SCALE_PRECISION = 1e-6
"""Of the logarithm of the time scale while proportions are searched."""

SCALED_LEGS = 20
"""Legs up to which the proportions of a plan that is only scaled are searched."""


def scaled_plan(task: Task, timing: Timing, limits: Limits, finish: AttachHeading) -> Timed:
    """Plan in given proportions, or the best ones, and scale to touch the limits."""
    if not task.still:
        raise TimingError("derivatives that are pinned do not scale with time: use split='optimal' and enforce='qp'")
    split = "distance" if timing.split == "optimal" else timing.split
    first, shape = task.legs * proportions(task, split, limits), without_derivative_walls(task)
    search = None
    if timing.split == "optimal" and 1 < task.legs <= SCALED_LEGS:
        first, search = searched(_ScaledSearch(task, timing, limits, finish), timing.best_on_interrupt)
    solved = solved_or_explained(shape, task.piece_durations(first))
    return timed(solved, finish, search, kept_factor(limits, task.walls, finish(solved.trajectory)))


class _ScaledSearch:
    """Proportions of the durations whose plan of least cost, scaled to the limits, is shortest; without gradients."""

    def __init__(self, task: Task, timing: Timing, limits: Limits, finish: AttachHeading) -> None:
        self.task, self.limits, self.finish = task, limits, finish
        self.first, self.shape = stop_and_go_times(task.lengths, limits), without_derivative_walls(task)
        self.best: tuple[float, FloatArray] = (np.inf, self.first)
        self.log = Log(timing.progress)
        self.factor = 1.0

    def run(self) -> FloatArray:
        """Return the best leg durations found (proportions matter), shape (legs,)."""
        from scipy.optimize import minimize

        options = {"maxfev": 100 * self.task.legs, "xtol": 1e-4, "ftol": 1e-6}
        minimize(self.evaluate, np.zeros(self.task.legs - 1), method="Powell", options=options)
        return self.best[1]

    def evaluate(self, logarithms: FloatArray) -> float:
        """Logarithm of the scaled total."""
        durations = self.first * np.exp(np.append(logarithms, 0.0))
        trajectory = self.finish(solved_or_explained(self.shape, self.task.piece_durations(durations)).trajectory)
        self.factor = kept_factor(self.limits, self.task.walls, trajectory, self.factor, SCALE_PRECISION)
        value = float(np.log(trajectory.duration * self.factor))
        if value < self.best[0]:
            self.best = (value, durations)
        self.log.add(np.exp(value), np.exp(value))
        return value


def proportions(task: Task, split: str, limits: Limits) -> FloatArray:
    """Shares of the legs in the total, by their lengths or by a trapezoid of speed: shape (legs,), sum 1."""
    if split == "distance":
        return distance_split(task, 1.0)
    speed, acceleration = norm_limits(limits)[:2]
    if np.isinf(speed) and np.isinf(acceleration):
        raise TimingError("split='trapezoid' needs a limit on speed or acceleration")
    times = trapezoid_times(task.lengths, speed, acceleration)
    return np.asarray(times / times.sum())

"""A plan with its durations, and what every way of choosing them shares."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.arrays import FloatArray
from minsnap.errors import LimitError, TimingError
from minsnap.limits.limits import Limits
from minsnap.optimisation.master_qp import InfeasibleRowsError
from minsnap.optimisation.problem import Task
from minsnap.optimisation.solve import Solved, solve
from minsnap.time_allocation.least_cost import Progress, Step, check_split
from minsnap.time_allocation.refusal import explain
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Timing:
    """How durations are chosen.

    Parameters
    ----------
    durations : array_like, shape (legs,), optional
    total_time : float, optional
    limits : Limits, optional
    split : str
        ``"optimal"``, ``"distance"`` or ``"trapezoid"``.
    time_weight : float, optional
        Price of a second.
    enforce : str
        How limits are kept: ``"qp"`` as walls of the QP, ``"scaling"`` by the time scale alone.
    progress : callable, optional
    """

    durations: npt.ArrayLike | None = None
    total_time: float | None = None
    limits: Limits | None = None
    split: str = "optimal"
    time_weight: float | None = None
    enforce: str = "qp"
    progress: Progress | None = None

    def check(self) -> None:
        """Raise unless exactly one way of choosing durations is asked for."""
        check_split(self.split)
        if self.enforce not in ("qp", "scaling"):
            raise TimingError(f"enforce is {self.enforce!r}: use 'qp' or 'scaling'")
        if self.limits is not None and not isinstance(self.limits, Limits):
            raise LimitError(f"limits must be a Limits, not {type(self.limits).__name__}")
        if self.limits is not None and not self.limits.given():
            raise LimitError("the limits are empty: set at least one, such as Limits(speed=3)")
        names = ("durations", "total_time", "time_weight")
        given = [name for name in names if getattr(self, name) is not None]
        if len(given) > 1:
            raise TimingError(
                f"{' and '.join(given)} were given: give one of durations, total_time, time_weight, limits"
            )
        if not given and self.limits is None:
            raise TimingError("no durations were asked for: give one of durations, total_time, time_weight, limits")


@dataclass(frozen=True, eq=False)
class Timed:
    """A plan with its durations.

    Parameters
    ----------
    solved : Solved
    trajectory : Trajectory
        Stretched where limits asked for it, with its yaw.
    cost : float
    steps : tuple of Step
    interrupted : bool
    """

    solved: Solved
    trajectory: Trajectory
    cost: float
    steps: tuple[Step, ...] = ()
    interrupted: bool = False


Finish = Callable[[Trajectory], Trajectory]
"""Gives a trajectory its yaw."""


def timed(solved: Solved, finish: Finish, search: Run | None = None, factor: float = 1.0) -> Timed:
    """Wrap a solved task, stretched by a factor on time, with what its search left."""
    trajectory = solved.trajectory
    if factor != 1.0:
        trajectory = trajectory.stretched(factor)
    steps, interrupted = (tuple(search.steps), search.interrupted) if search else ((), False)
    return Timed(solved, finish(trajectory), solved.cost * factor ** (1 - 2 * solved.task.half), steps, interrupted)


def solved_or_explained(task: Task, durations: FloatArray, samples: int | None = None, certify: bool = True) -> Solved:
    """Solve, or raise the reason why nothing fits."""
    try:
        return solve(task, durations, samples, certify)
    except InfeasibleRowsError:
        raise explain(task, durations) from None


@dataclass(frozen=True, eq=False)
class Run:
    """What a search left: its steps, and whether it was interrupted."""

    steps: tuple[Step, ...]
    interrupted: bool = False


def searched(search: Any) -> tuple[FloatArray, Run]:
    """Run a search; Ctrl-C ends it with the best it has, if it has any."""
    interrupted = False
    try:
        durations = search.run()
    except KeyboardInterrupt:
        if not np.isfinite(search.best[0]):
            raise
        durations, interrupted = search.best[1], True
    return durations, Run(tuple(search.log.steps), interrupted)

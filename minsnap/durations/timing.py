"""A plan with its durations, and what every way of choosing them shares."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from minsnap.basics.arrays import FloatArray, set_fields
from minsnap.basics.checks import check_time
from minsnap.basics.deadline import Deadline
from minsnap.basics.messages import shown
from minsnap.errors import MinsnapError, SolverError, TimingError
from minsnap.optimisation.optimum import GaveUpError, InfeasibleRowsError
from minsnap.optimisation.solve import Effort, solve, solve_by_reference
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.task import Task
from minsnap.refusals.sentences import no_limits
from minsnap.trajectory.report import Progress, Step
from minsnap.trajectory.trajectory import Trajectory

if TYPE_CHECKING:
    from minsnap.limits.limits import Limits


@dataclass(frozen=True, eq=False)
class Timing:
    """How durations are chosen.

    Parameters
    ----------
    durations : ndarray, shape (legs,), optional
    total_time : float, optional
    limits : Limits, optional
    split : str
        ``"optimal"`` or ``"distance"``.
    time_weight : float, optional
        Price of a second.
    progress : callable, optional
    refine : bool
        Whether such a search chooses the number of polynomials a leg.
    on_interrupt : str
        What Ctrl-C does: ``"raise"`` KeyboardInterrupt, or ``"return"`` the best plan so far.
    due : float
        Reading of the task's clock from which a plan that was found is not improved any more [s].
    """

    durations: FloatArray | None = None
    total_time: float | None = None
    limits: Limits | None = None
    split: str = "optimal"
    time_weight: float | None = None
    progress: Progress | None = None
    refine: bool = False
    on_interrupt: str = "raise"
    due: float = inf

    def __post_init__(self) -> None:
        if self.total_time is not None:
            set_fields(self, total_time=check_time("total_time", self.total_time, TimingError))

    @property
    def total(self) -> float:
        """The total time of the request [s]; only where there is one."""
        return cast(float, self.total_time)

    @property
    def bounds(self) -> Limits:
        """The limits of the request; only where there are any."""
        return cast("Limits", self.limits)

    @property
    def shortest(self) -> bool:
        """Whether the shortest time within the limits is asked for."""
        chosen = self.durations is None and self.total_time is None and self.time_weight is None
        return self.limits is not None and chosen

    def bounded(self, task: Task) -> Task:
        """Return a task with the walls of the limits, if there are any."""
        return task if self.limits is None else task.with_walls(self.limits.walls(task.waypoints))

    def in_time(self, task: Task) -> Task:
        """Return a task that is due when the search is."""
        return replace(task, deadline=task.deadline.until(min(task.deadline.due, self.due)))

    @property
    def deadline(self) -> Deadline:
        """When a plan for fixed durations ends; a search has its own deadline."""
        return Deadline(inf if self.durations is None else self.due)

    @property
    def best_on_interrupt(self) -> bool:
        """Whether Ctrl-C ends a search with the best plan so far."""
        return self.on_interrupt == "return"

    def check(self) -> None:
        """Raise unless exactly one way of choosing durations is set, and nothing that it would ignore."""
        if self.limits is not None and not self.limits.given():
            raise no_limits()
        names = ("durations", "total_time", "time_weight")
        chosen = [name for name in names if getattr(self, name) is not None]
        if len(chosen) > 1:
            raise TimingError(f"{' and '.join(chosen)} exclude each other: give one of them")
        if not chosen and self.limits is None:
            raise TimingError("the plan has no times: give one of durations, total_time, time_weight, limits")
        if self.due < inf and self.durations is None and self.limits is None:
            raise TimingError("time_limit goes with durations or limits: end a search for a split with Ctrl-C")
        if self.split != "optimal" and chosen in (["durations"], ["time_weight"]):
            raise TimingError(f"split={shown(self.split)} does not go with {chosen[0]}, which determines the split")


@dataclass(frozen=True, eq=False)
class Timed:
    """A plan with its durations.

    Parameters
    ----------
    solved : SolvedTask
    trajectory : Trajectory
        Stretched where limits asked for it, with its yaw.
    steps : tuple of Step
    interrupted : bool
    stands_in : bool
        Whether it stands in for the end of a search that had none, so that others may be far shorter.
    """

    solved: SolvedTask
    trajectory: Trajectory
    steps: tuple[Step, ...] = ()
    interrupted: bool = False
    stands_in: bool = False

    @property
    def limits_from(self) -> float:
        """Instant from which the limits hold [s]."""
        return 0.0

    @property
    def corridor_margin(self) -> float | None:
        """Exact least distance to the walls on positions [m]; None where there are none."""
        return self.solved.corridor_margin

    @property
    def cost(self) -> float:
        """Integral of the squared norm of the k-th derivative of the trajectory as it is."""
        return self.trajectory.cost(self.solved.task.half)

    def facts(self) -> dict[str, Any]:
        """Return the entries of a report that are known by now: it is made later, without what the solve has left."""
        names = "solver", "rounds", "fallback", "core", "handed_over", "rungs"
        known = {name: getattr(self.solved.optimum, name) for name in names}
        own = {name: getattr(self, name) for name in ("corridor_margin", "steps", "interrupted", "limits_from")}
        return {**known, **own, "rows": len(self.solved.optimum.contacts.wall)}


def timed(solved: SolvedTask, search: Run | None = None, factor: float = 1.0) -> Timed:
    """Wrap a solved task, stretched by a factor on time, with what its search left."""
    curve = solved.flown if factor == 1.0 else solved.task.finish(solved.trajectory.stretched(factor))
    return Timed(solved, curve) if search is None else Timed(solved, curve, search.steps, search.interrupted)


Value = TypeVar("Value")

Unsolved = InfeasibleRowsError | SolverError
"""Why durations have no curve: what a solve raises."""


def attempted(solving: Callable[..., Value], *asked: Any, **how: Any) -> Value | Unsolved:
    """Solve for given durations, or return what was raised, which is no more than an answer where times are chosen."""
    try:
        return solving(*asked, **how)
    except (InfeasibleRowsError, SolverError) as unsolved:
        return unsolved


def found_in(task: Task, durations: FloatArray, effort: Effort = Effort.TRY) -> SolvedTask | None:
    """Return the curve of least cost in piece durations (pieces in all,) [s]; None where none is found."""
    solved = attempted(solve, task, durations, effort=effort)
    return solved if isinstance(solved, SolvedTask) else None


def solved_or_explained(
    task: Task, durations: FloatArray, refuse: Callable[[], MinsnapError | None] | None = None
) -> SolvedTask | MinsnapError:
    """Solve, with walls at samples only if there are any, or return the reason why nothing fits.

    Parameters
    ----------
    refuse : callable, optional
        Returns what is proved besides, which is asked where a try gives up.
    """
    # A solve that has no end and one that only takes long look alike. So effort grows: a glance, which most solvable
    # questions pass; a proof that the time is too short, which is cheap; a try; a proof by the walls; all that is left.
    effort = Effort.WHOLE
    if refuse is not None:
        effort = Effort.TRY  # limits have a proof more often than a late curve
        glanced = attempted(solve, task, durations, task.samples, effort=Effort.GLANCE)
        if not isinstance(glanced, GaveUpError):
            return _or_explained(glanced, task, durations)
        short = refuse()
        if short is not None:
            return short
    solved = attempted(solve, task, durations, task.samples, effort=effort)
    refused = _or_explained(solved, task, durations)
    if not isinstance(solved, GaveUpError) or getattr(refused, "contradiction", None) is not None:
        return refused
    if task.deadline.solves > effort.value:
        last = attempted(solve, task, durations, task.samples, effort=Effort.LAST)
        if not isinstance(last, InfeasibleRowsError):
            return last
    whole = attempted(solve_by_reference, task, durations, str(solved))
    return refused if isinstance(whole, InfeasibleRowsError) else whole


def _or_explained(solved: SolvedTask | Unsolved, task: Task, durations: FloatArray) -> SolvedTask | MinsnapError:
    return _explained(task, durations) if isinstance(solved, InfeasibleRowsError) else solved


def _explained(task: Task, durations: FloatArray) -> MinsnapError:
    if not task.explains:
        return SolverError("no curve was found that keeps the walls and the limits in these durations")
    from minsnap.refusals.given_times import explain

    return explain(task, durations)


@dataclass(frozen=True, eq=False)
class Run:
    """What a search left: its steps, and whether it was interrupted."""

    steps: tuple[Step, ...]
    interrupted: bool = False


NO_RUN = Run(())


def searched(search: Any, best: bool) -> tuple[FloatArray, Run]:
    """Run a search; Ctrl-C ends it, and with ``best`` gives the best it has, if it has any."""
    interrupted = False
    try:
        durations = search.run()
    except KeyboardInterrupt:
        if not (best and np.isfinite(search.best[0])):
            raise
        durations, interrupted = search.best[1], True
    return durations, Run(tuple(search.log.steps), interrupted)

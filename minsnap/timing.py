"""Durations and plan together: given, split from a total, priced, or the shortest within limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.errors import InfeasibleError, LimitError, TimingError
from minsnap.exchange import InfeasibleRowsError
from minsnap.explain import explain
from minsnap.inputs import check_durations, check_positive_time, check_weight, refuse_repeated
from minsnap.limits import Limits
from minsnap.measures import Utilisation, measure_state
from minsnap.samples import FloatArray
from minsnap.shortest import ShortestSearch, most_used, norm_limits, stop_and_go_times, touching_factor
from minsnap.solver import Solved, solve
from minsnap.split import (
    CostSearch,
    Progress,
    Step,
    check_split,
    distance_split,
    priced_first_guess,
    trapezoid_times,
)
from minsnap.task import Task
from minsnap.trajectory import Trajectory

RESERVES = (5e-4, 3e-3, 0.02, 0.1, 0.5)
"""Shares by which the shortest durations found are lengthened until the final plan succeeds."""

SCALE_PRECISION = 1e-6
"""Of the logarithm of the time scale while proportions are searched."""

TOUCHING, ROOM = 1e-6, 1e-2
"""How near to a limit a pinned state counts as at it, and the share of room that it should be left."""

KEPT = 1e-9
"""How far above 1 a utilisation may be."""

SCALED_LEGS = 20
"""Legs up to which the proportions of a plan that is only scaled are searched."""


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


def plan_timed(task: Task, timing: Timing, finish: Finish, samples: int | None, certify: bool) -> Timed:
    """Choose durations and solve.

    Raises
    ------
    TimingError, LimitError
        If what is asked for is malformed or contradictory.
    InfeasibleError
        If nothing fits, with the reason.
    """
    timing.check()
    limits, bounded = timing.limits, task
    if limits is not None:
        bounded = task.with_walls(limits.walls(task.waypoints))
        _check_pins(task, limits)
    if timing.durations is not None:
        durations = task.piece_durations(check_durations(timing.durations, task.legs))
        timed = _timed(_solved(bounded, durations, samples, certify), finish)
        return timed if limits is None else _kept(timed, limits)
    refuse_repeated(task.waypoints, "give every leg a duration of its own")
    if limits is None:
        durations, search = _unlimited(task, timing)
        return _timed(_solved(task, task.piece_durations(durations), samples, certify), finish, search)
    if timing.total_time is None and timing.time_weight is None:
        return _shortest(task, bounded, timing, limits, finish)
    return _limited(bounded, timing, limits, finish)


def _timed(solved: Solved, finish: Finish, search: _Run | None = None, factor: float = 1.0) -> Timed:
    trajectory = solved.trajectory
    if factor != 1.0:
        trajectory = trajectory.stretched(factor)
    steps, interrupted = (tuple(search.steps), search.interrupted) if search else ((), False)
    return Timed(solved, finish(trajectory), solved.cost * factor ** (1 - 2 * solved.task.half), steps, interrupted)


def _solved(task: Task, durations: FloatArray, samples: int | None = None, certify: bool = True) -> Solved:
    try:
        return solve(task, durations, samples, certify)
    except InfeasibleRowsError:
        raise explain(task, durations) from None


@dataclass(frozen=True, eq=False)
class _Run:
    """What a search left: its steps, and whether it was interrupted."""

    steps: tuple[Step, ...]
    interrupted: bool = False


def _searched(search: Any) -> tuple[FloatArray, _Run]:
    """Run a search; Ctrl-C ends it with the best it has, if it has any."""
    interrupted = False
    try:
        durations = search.run()
    except KeyboardInterrupt:
        if not np.isfinite(search.best[0]):
            raise
        durations, interrupted = search.best[1], True
    return durations, _Run(tuple(search.log.steps), interrupted)


def _unlimited(task: Task, timing: Timing) -> tuple[FloatArray, _Run | None]:
    """Leg durations where nothing limits derivatives."""
    if timing.time_weight is not None:
        price = check_weight(timing.time_weight)
        return _searched(CostSearch(task, priced_first_guess(task, price), price, timing.progress))
    total = check_positive_time(timing.total_time)
    if timing.split == "trapezoid":
        raise TimingError("split='trapezoid' needs limits on speed or acceleration: give limits=")
    first = distance_split(task, total)
    return (first, None) if timing.split == "distance" else _searched(CostSearch(task, first, None, timing.progress))


def _shortest(task: Task, bounded: Task, timing: Timing, limits: Limits, finish: Finish) -> Timed:
    """Find the shortest plan within limits."""
    walled = any(wall.order for wall in bounded.walls)
    if timing.enforce == "scaling" or timing.split != "optimal" or not walled:
        return _scaled(task, timing, limits, finish)
    shortest = ShortestSearch(bounded, stop_and_go_times(task.lengths, limits), timing.progress)
    durations, search = _searched(shortest)
    return _touching(bounded, task.piece_durations(durations), limits, finish, search, shortest)


def _touching(
    task: Task,
    durations: FloatArray,
    limits: Limits,
    finish: Finish,
    search: _Run,
    shortest: ShortestSearch | None = None,
) -> Timed:
    """Plan at durations barely longer than the shortest, then scale so that a limit is touched and none exceeded."""
    units, seed = (None, None) if shortest is None else (shortest.units, shortest.seed)
    for reserve in RESERVES:
        try:
            solved = solve(task, durations * (1.0 + reserve), units=units, seed=seed)
        except InfeasibleRowsError:
            continue
        trajectory = finish(solved.trajectory)
        if task.still:
            return _timed(solved, finish, search, touching_factor(limits, trajectory))
        if most_used(limits, trajectory).fraction <= 1.0 + KEPT:
            return _timed(solved, finish, search)
    raise explain(task, durations)


def _factor(limits: Limits, trajectory: Trajectory) -> float:
    """Factor to touch the limits; 1 where only the vertical part of a minimum thrust, a sufficient limit, binds."""
    try:
        return touching_factor(limits, trajectory)
    except LimitError:
        return 1.0


def _scaled(task: Task, timing: Timing, limits: Limits, finish: Finish) -> Timed:
    """Plan in given proportions, or the best ones, and scale to touch the limits."""
    if not task.still:
        raise TimingError("derivatives that are pinned do not scale with time: use split='optimal' and enforce='qp'")
    split = "distance" if timing.split == "optimal" else timing.split
    first = task.legs * _proportions(task, split, limits)
    search = None
    if timing.split == "optimal" and 1 < task.legs <= SCALED_LEGS:
        first, search = _searched(_ScaledSearch(task, timing, limits, finish))
    solved = _solved(task, task.piece_durations(first))
    return _timed(solved, finish, search, touching_factor(limits, finish(solved.trajectory)))


class _ScaledSearch:
    """Proportions of the durations whose plan of least cost, scaled to the limits, is shortest; without gradients."""

    def __init__(self, task: Task, timing: Timing, limits: Limits, finish: Finish) -> None:
        from minsnap.split import Log

        self.task, self.limits, self.finish = task, limits, finish
        self.first = stop_and_go_times(task.lengths, limits)
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
        trajectory = self.finish(_solved(self.task, self.task.piece_durations(durations)).trajectory)
        self.factor = touching_factor(self.limits, trajectory, self.factor, SCALE_PRECISION)
        value = float(np.log(trajectory.duration * self.factor))
        if value < self.best[0]:
            self.best = (value, durations)
        self.log.add(np.exp(value), np.exp(value))
        return value


def _limited(task: Task, timing: Timing, limits: Limits, finish: Finish) -> Timed:
    """Plan for a total or a price, and limits besides."""
    if timing.total_time is not None and timing.split != "optimal":
        total = check_positive_time(timing.total_time)
        durations = total * _proportions(task, timing.split, limits)
        return _kept(_timed(_solved(task, task.piece_durations(durations)), finish), limits)
    fastest, search = _fastest(task, timing, limits)
    price, durations = _wished(task, timing, fastest)
    tight = timing.total_time is not None and durations.sum() < fastest.sum() * (1.0 + RESERVES[1])
    if tight:
        return _tightest(task, float(durations.sum()), fastest, limits, finish, search)
    if not search.interrupted:
        durations, last = _searched(CostSearch(task, durations, price, timing.progress))
        search = _Run(search.steps + last.steps, last.interrupted)
    for reserve in (0.0, *(RESERVES if price is not None else ())):
        try:
            solved = solve(task, task.piece_durations(durations * (1.0 + reserve)))
        except InfeasibleRowsError:
            continue
        return _kept(_timed(solved, finish, search), limits, price is not None)
    return _tightest(task, float(durations.sum()), fastest, limits, finish, search)


def _tightest(task: Task, total: float, fastest: FloatArray, limits: Limits, finish: Finish, search: _Run) -> Timed:
    """Plan for a total near the shortest: the shortest plan, stretched to it, or say that it is too short."""
    found = _touching(task, task.piece_durations(fastest), limits, finish, search)
    shortest = found.trajectory.duration
    if total < shortest * (1.0 - KEPT) or (total > shortest * (1.0 + KEPT) and not task.still):
        message = f"{total:.6g} s are too short for the limits: the shortest found is {shortest:.6g} s"
        raise InfeasibleError(message, shortest=shortest)
    return _timed(found.solved, finish, search, total / float(found.solved.trajectory.duration))


def _fastest(task: Task, timing: Timing, limits: Limits) -> tuple[FloatArray, _Run]:
    first = stop_and_go_times(task.lengths, limits)
    if not any(wall.order for wall in task.walls):
        return first, _Run(())
    return _searched(ShortestSearch(task, first, timing.progress))


def _wished(task: Task, timing: Timing, fastest: FloatArray) -> tuple[float | None, FloatArray]:
    """Price of a second, if any, and durations to begin with, at which the limits can be kept."""
    if timing.time_weight is not None:
        price = check_weight(timing.time_weight)
        wished = priced_first_guess(replace(task, walls=[w for w in task.walls if w.order == 0]), price)
        return price, fastest * max(1.0 + RESERVES[2], wished.sum() / fastest.sum())
    total = check_positive_time(timing.total_time)
    return None, fastest * (total / fastest.sum())


def _proportions(task: Task, split: str, limits: Limits) -> FloatArray:
    """Shares of the legs in the total, by their lengths or by a trapezoid of speed: shape (legs,), sum 1."""
    if split == "distance":
        return distance_split(task, 1.0)
    speed, acceleration = norm_limits(limits)[:2]
    if np.isinf(speed) and np.isinf(acceleration):
        raise TimingError("split='trapezoid' needs a limit on speed or acceleration")
    times = trapezoid_times(task.lengths, speed, acceleration)
    return np.asarray(times / times.sum())


def _kept(timed: Timed, limits: Limits, stretchable: bool = False) -> Timed:
    """Return a plan that keeps all limits, those that are not walls of the QP too, or say how long it would take."""
    used = most_used(limits, timed.trajectory)
    if used.fraction <= 1.0 + KEPT:
        return timed
    task, total = timed.solved.task, timed.trajectory.duration
    where = f"on leg {used.leg} at {used.instant:.4g} s"
    message = f"{used.name} cannot be kept in {total:.6g} s: it reaches {used.value:.6g} {where}"
    if not task.still:
        raise InfeasibleError(f"{message}; give more time", leg=used.leg, instant=used.instant)
    factor = touching_factor(limits, timed.trajectory)
    if stretchable:
        curve = timed.trajectory.stretched(factor)
        return replace(timed, trajectory=curve, cost=timed.cost * factor ** (1 - 2 * task.half))
    raise InfeasibleError(
        f"{message}; {total * factor:.6g} s would do in these proportions",
        leg=used.leg,
        instant=used.instant,
        shortest=total * factor,
        stretch=factor,
    )


def _check_pins(task: Task, limits: Limits) -> None:
    """Raise LimitError if a pinned state already exceeds a limit, or leaves it no room."""
    for waypoint, state in task.pins.items():
        for used in measure_state(limits, state, task.dim):
            if used.fraction > 1.0 - TOUCHING:
                raise _pinned_at(waypoint, used)


def _pinned_at(waypoint: int, used: Utilisation) -> LimitError:
    lower = used.name == "min_thrust"
    change = "lower the limit to at most" if lower else "raise the limit to at least"
    where, value = "beyond", used.value
    if used.fraction <= 1.0 + KEPT:
        where, value = "at", used.value * (1.0 - ROOM if lower else 1.0 + ROOM)
    return LimitError(
        f"the state pinned at waypoint {waypoint} has {used.name} {used.value:.6g}, {where} its limit "
        f"{used.limit:.6g}: {change} {value:.6g}",
        waypoint=waypoint,
        smallest=value,
    )

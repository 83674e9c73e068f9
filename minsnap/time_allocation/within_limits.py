"""Plans within limits: the shortest, or for a total or a price of time."""

from __future__ import annotations

from dataclasses import replace

from minsnap.arrays import FloatArray
from minsnap.checks import check_positive_time, check_weight
from minsnap.errors import InfeasibleError, LimitError
from minsnap.limits.limits import Limits
from minsnap.limits.utilisation import measure_state
from minsnap.optimisation.master_qp import InfeasibleRowsError
from minsnap.optimisation.problem import Task
from minsnap.optimisation.solve import solve
from minsnap.time_allocation.least_cost import CostSearch, priced_first_guess
from minsnap.time_allocation.least_time import LeastTime
from minsnap.time_allocation.nested_search import ShortestSearch, stop_and_go_times
from minsnap.time_allocation.refusal import explain
from minsnap.time_allocation.time_scaling import proportions, scaled_plan
from minsnap.time_allocation.time_stretch import most_used, touching_factor
from minsnap.time_allocation.timed import Finish, Run, Timed, Timing, searched, solved_or_explained, timed
from minsnap.trajectory.report import Utilisation

RESERVES = (5e-4, 3e-3, 0.02, 0.1, 0.5)
"""Shares by which the shortest durations found are lengthened until the final plan succeeds."""

TOUCHING, ROOM = 1e-6, 1e-2
"""How near to a limit a pinned state counts as at it, and the share of room that it should be left."""

KEPT = 1e-9
"""How far above 1 a utilisation may be."""


def shortest_plan(task: Task, bounded: Task, timing: Timing, limits: Limits, finish: Finish) -> Timed:
    """Find the shortest plan within limits."""
    walled = any(wall.order for wall in bounded.walls)
    if timing.enforce == "scaling" or timing.split != "optimal" or not walled:
        return scaled_plan(task, timing, limits, finish)
    solved, search = LeastTime(task, limits, finish, timing.progress).run()
    return timed(solved, finish, search)


def _touching(
    task: Task,
    durations: FloatArray,
    limits: Limits,
    finish: Finish,
    search: Run,
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
            return timed(solved, finish, search, touching_factor(limits, trajectory))
        if most_used(limits, trajectory).fraction <= 1.0 + KEPT:
            return timed(solved, finish, search)
    raise explain(task, durations)


def limited_plan(task: Task, timing: Timing, limits: Limits, finish: Finish) -> Timed:
    """Plan for a total or a price, and limits besides."""
    if timing.total_time is not None and timing.split != "optimal":
        total = check_positive_time(timing.total_time)
        durations = total * proportions(task, timing.split, limits)
        return kept(timed(solved_or_explained(task, task.piece_durations(durations)), finish), limits)
    fastest, search = _fastest(task, timing, limits)
    price, durations = _wished(task, timing, fastest)
    tight = timing.total_time is not None and durations.sum() < fastest.sum() * (1.0 + RESERVES[1])
    if tight:
        return _tightest(task, float(durations.sum()), fastest, limits, finish, search)
    if not search.interrupted:
        durations, last = searched(CostSearch(task, durations, price, timing.progress))
        search = Run(search.steps + last.steps, last.interrupted)
    for reserve in (0.0, *(RESERVES if price is not None else ())):
        try:
            solved = solve(task, task.piece_durations(durations * (1.0 + reserve)))
        except InfeasibleRowsError:
            continue
        return kept(timed(solved, finish, search), limits, price is not None)
    return _tightest(task, float(durations.sum()), fastest, limits, finish, search)


def _tightest(task: Task, total: float, fastest: FloatArray, limits: Limits, finish: Finish, search: Run) -> Timed:
    """Plan for a total near the shortest: the shortest plan, stretched to it, or say that it is too short."""
    found = _touching(task, task.piece_durations(fastest), limits, finish, search)
    shortest = found.trajectory.duration
    if total < shortest * (1.0 - KEPT) or (total > shortest * (1.0 + KEPT) and not task.still):
        message = f"{total:.6g} s are too short for the limits: the shortest found is {shortest:.6g} s"
        raise InfeasibleError(message, shortest=shortest)
    return timed(found.solved, finish, search, total / float(found.solved.trajectory.duration))


def _fastest(task: Task, timing: Timing, limits: Limits) -> tuple[FloatArray, Run]:
    first = stop_and_go_times(task.lengths, limits)
    if not any(wall.order for wall in task.walls):
        return first, Run(())
    return searched(ShortestSearch(task, first, timing.progress))


def _wished(task: Task, timing: Timing, fastest: FloatArray) -> tuple[float | None, FloatArray]:
    """Price of a second, if any, and durations to begin with, at which the limits can be kept."""
    if timing.time_weight is not None:
        price = check_weight(timing.time_weight)
        wished = priced_first_guess(replace(task, walls=[w for w in task.walls if w.order == 0]), price)
        return price, fastest * max(1.0 + RESERVES[2], wished.sum() / fastest.sum())
    total = check_positive_time(timing.total_time)
    return None, fastest * (total / fastest.sum())


def kept(found: Timed, limits: Limits, stretchable: bool = False) -> Timed:
    """Return a plan that keeps all limits, those that are not walls of the QP too, or say how long it would take."""
    used = most_used(limits, found.trajectory)
    if used.fraction <= 1.0 + KEPT:
        return found
    task, total = found.solved.task, found.trajectory.duration
    where = f"on leg {used.leg} at {used.instant:.4g} s"
    message = f"{used.name} cannot be kept in {total:.6g} s: it reaches {used.value:.6g} {where}"
    if not task.still:
        raise InfeasibleError(f"{message}; give more time", leg=used.leg, instant=used.instant)
    factor = touching_factor(limits, found.trajectory)
    if stretchable:
        curve = found.trajectory.stretched(factor)
        return replace(found, trajectory=curve)
    raise InfeasibleError(
        f"{message}; {total * factor:.6g} s would do in these proportions",
        leg=used.leg,
        instant=used.instant,
        shortest=total * factor,
        stretch=factor,
    )


def check_pinned_limits(task: Task, limits: Limits) -> None:
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

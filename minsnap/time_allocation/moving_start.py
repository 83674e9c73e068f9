"""Shortest plans from a moving start: also from one on or outside its limits, which is first brought back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import monotonic

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.corridors.margins import nearest_wall
from minsnap.errors import InfeasibleError, LimitError, SolverError
from minsnap.limits.limits import Limits
from minsnap.limits.span import KEPT, kept_from
from minsnap.limits.utilisation import measure_state
from minsnap.optimisation.problem import Task
from minsnap.optimisation.solved import Solved
from minsnap.time_allocation.least_time import LATE, FirstGuess, LateError, LeastTime
from minsnap.time_allocation.recovery import Recovery, start_state, start_use, way_back
from minsnap.time_allocation.timed import Finish, Run, Timed, Timing, timed
from minsnap.trajectory.trajectory import Trajectory

TOUCHING = 1e-5
"""How near to a limit a start counts as on it."""

FINER = 3
"""Pieces a leg with which is searched again where fewer find nothing from the end of a way back."""


@dataclass(frozen=True, eq=False)
class Recovered(Timed):
    """A plan whose first leg begins with a way back to the limits.

    Parameters
    ----------
    limits_from : float
        Instant from which the limits hold [s].
    """

    limits_from: float = 0.0

    @property
    def corridor_margin(self) -> float | None:
        """Least distance to the walls on positions [m], way back included; None where there are none."""
        nearest = nearest_wall(self.trajectory, [wall for wall in self.solved.task.walls if wall.order == 0])
        return None if nearest is None else nearest.value


def moves(task: Task) -> bool:
    """Whether the start is given with a derivative that is not zero."""
    return any(value.any() for value in task.pins.get(0, {}).values())


def shortest_from(
    task: Task, limits: Limits, timing: Timing, finish: Finish, first: FirstGuess | None = None
) -> tuple[Solved, Run] | Recovered:
    """Find the shortest plan from a moving start.

    Parameters
    ----------
    task : Task
        Without walls of the limits.
    limits : Limits
    timing : Timing
    finish : callable
        Gives a curve its yaw.
    first : callable, optional
        Gives the state to search from.

    Raises
    ------
    InfeasibleError, SolverError
        If no plan was found from the start, nor from the end of any way back.
    LimitError
        If the start exceeds a limit, and no way back was found.
    """
    began = monotonic()
    if start_use(task, limits) > (1.0 - TOUCHING if first is None else 1.0 + KEPT):
        return _brought_back(task, limits, timing, finish, None)
    try:
        return searched_from(task, limits, timing, finish, first)
    except LateError:
        raise
    except (InfeasibleError, SolverError) as refused:
        return _brought_back(task, limits, _remaining(timing, began), finish, refused)


def _remaining(timing: Timing, began: float) -> Timing:
    """Return the same with the time that is left of its limit."""
    if timing.time_limit is None:
        return timing
    left = timing.time_limit - (monotonic() - began)
    if left <= 0.0:
        raise LateError(LATE)
    return replace(timing, time_limit=left)


def searched_from(
    task: Task, limits: Limits, timing: Timing, finish: Finish, first: FirstGuess | None = None
) -> tuple[Solved, Run]:
    """Search for the shortest plan."""
    search = LeastTime(
        task, limits, finish, timing.progress, timing.time_limit, timing.refine, timing.best_on_interrupt, first
    )
    return search.run()


def _brought_back(
    task: Task, limits: Limits, timing: Timing, finish: Finish, refused: InfeasibleError | SolverError | None
) -> Recovered:
    """Go the shortest way back, and plan from its end; raise ``refused`` where that fails too."""
    began = monotonic()
    way = way_back(start_state(task), task.walls, limits, task.deadline)
    timing = _remaining(timing, began)
    if way is None and monotonic() > task.deadline:
        raise LateError(LATE)
    if way is None:
        raise refused or _no_way_back(task, limits)
    solved, run = _searched_from_end(from_end(task, way), limits, timing, finish, refused)
    whole = finish(joined(way.piece, solved.trajectory))
    start = kept_from(limits, whole)
    if start > way.piece.duration * (1.0 + KEPT):
        raise refused or SolverError(f"the limits are kept from {start:.4g} s only, after the way back: loosen a limit")
    return Recovered(solved, whole, run.steps, run.interrupted, limits_from=start)


def _searched_from_end(
    task: Task, limits: Limits, timing: Timing, finish: Finish, refused: InfeasibleError | SolverError | None
) -> tuple[Solved, Run]:
    """Search with the pieces asked for, then with more."""
    began = monotonic()
    try:
        return searched_from(task, limits, timing, finish)
    except LateError:
        raise
    except (InfeasibleError, SolverError) as again:
        if task.pieces < FINER:
            timing = _remaining(timing, began)
            return _searched_from_end(replace(task, pieces=FINER), limits, timing, finish, refused or again)
        raise refused or again from None


def from_end(task: Task, way: Recovery) -> Task:
    """Return the same task from the end of a way back; its walls are the same."""
    state = way.state(task.half)
    points = task.waypoints.copy()
    points[0] = state[0]
    points.flags.writeable = False
    pins = dict(task.pins) | {0: {order: state[order] for order in range(1, task.half)}}
    return replace(task, waypoints=points, pins=pins)


def joined(first: Trajectory, rest: Trajectory) -> Trajectory:
    """Fly one polynomial before a plan, as part of its first leg; the other legs are divided to have as many pieces."""
    pieces = rest.pieces
    points, durations = [first.control_points, rest.control_points[:pieces]], [first.durations, rest.durations[:pieces]]
    for leg in range(1, rest.legs):
        part = slice(leg * pieces, (leg + 1) * pieces)
        halves = _halved(rest.control_points[part.start])
        points += [halves, rest.control_points[part][1:]]
        durations += [np.repeat(0.5 * rest.durations[part.start], 2), rest.durations[part][1:]]
    return Trajectory(np.concatenate(points), np.concatenate(durations), pieces=pieces + 1)


def _halved(points: FloatArray) -> FloatArray:
    """Control points of both halves of a polynomial, (2, n + 1, dim), by de Casteljau's algorithm."""
    rows, left, right = points, [points[0]], [points[-1]]
    while len(rows) > 1:
        rows = 0.5 * (rows[:-1] + rows[1:])
        left.append(rows[0])
        right.append(rows[-1])
    return np.stack((left, right[::-1]))


def _no_way_back(task: Task, limits: Limits) -> LimitError:
    used = max(measure_state(limits, task.pins[0], task.dim), key=lambda entry: entry.fraction)
    return LimitError(
        f"the start has {used.name} {used.value:.6g} where {used.limit:.6g} is allowed, and no way back inside the "
        f"corridor was found: widen the corridor of leg 0, or slow down first",
        waypoint=0,
        smallest=used.value,
    )


def as_timed(found: tuple[Solved, Run] | Recovered, finish: Finish) -> Timed:
    """Wrap what was found."""
    return found if isinstance(found, Recovered) else timed(found[0], finish, found[1])

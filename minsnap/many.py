"""plan_many: the same call for many problems, over threads; what fails is an error of its problem alone."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.arrays import FloatArray, IntArray
from minsnap.checks import DERIVATIVES, check_degree, check_state
from minsnap.corridors.constraint import Constraint
from minsnap.errors import CorridorError, InputError, MinsnapError, TimingError, WaypointError
from minsnap.native.many import many_optima, many_tubes
from minsnap.native.status import Status
from minsnap.optimisation.tube_report import TubeReport
from minsnap.planner import plan
from minsnap.trajectory.report import LinearSystem, Report
from minsnap.trajectory.trajectories import Trajectories
from minsnap.trajectory.trajectory import ReportMaker, Trajectory

State = Mapping[str, npt.ArrayLike]


def plan_many(
    waypoints: npt.ArrayLike | Sequence[npt.ArrayLike],
    durations: npt.ArrayLike | Sequence[npt.ArrayLike],
    corridor: npt.ArrayLike | Constraint | Sequence[npt.ArrayLike | Constraint | None] | None = None,
    *,
    degree: int = 7,
    start: State | None = None,
    end: State | None = None,
    threads: int | None = None,
) -> Trajectories:
    """Plan many problems with given durations; see ``plan``.

    Parameters
    ----------
    waypoints : array_like, shape (B, n, dim), or sequence of B array_like, each (n_b, dim)
        Positions to pass through [m].
    durations : array_like, shape (B, n - 1) or (n - 1,), or sequence of B array_like, each (n_b - 1,)
        Seconds a leg; one row of them serves all problems of an array.
    corridor : float, Constraint, or sequence of B of what ``plan`` takes, optional
        One for all problems, or one for each; an array's first axis counts problems.
    degree : int
        2k - 1: 3, 5, 7, 9 or 11.
    start, end : mapping, optional
        Derivatives at the ends, such as ``{"velocity": v}`` with v of shape (dim,) or (B, dim) [m/s]; those up to order
        k - 1 that are not named are zero.
    threads : int, optional
        Threads to use; as many as processors unless given.  The result does not depend on it.

    Returns
    -------
    Trajectories
        ``many[i]`` is a Trajectory, ``many.errors[i]`` the MinsnapError of a problem that has none.

    Raises
    ------
    InputError
        If it is not clear what the problems are: another number of durations, corridors or end states than of
        waypoints, or a degree that does not exist.  What is wrong with one problem is in ``errors``.
    """
    began = perf_counter()
    half = check_degree(degree)
    batch = _Batch.of(waypoints, durations)
    ends = _states(start, "start", batch, half), _states(end, "end", batch, half)
    workers = _workers(threads)
    corridors = _corridors(corridor, len(batch))
    solved = _solved_together(batch, half, ends, corridors, workers)
    if solved is None:
        return _solved_one_by_one(batch, corridors, half, ends, workers)
    return _mended(batch, half, ends, corridors, solved, workers, began)


@dataclass(frozen=True, eq=False)
class _Batch:
    """The problems: those that are numbers of the right shape in long arrays, the others as they came.

    Parameters
    ----------
    points : ndarray, shape (knots in all, dim)
    durations : ndarray, shape (legs in all,)
    offsets : ndarray of int64, shape (problems + 1,)
    odd : mapping of int to tuple
        Waypoints and durations of problems that are not; here they have one knot and no leg.
    """

    points: FloatArray
    durations: FloatArray
    offsets: IntArray
    odd: Mapping[int, tuple[Any, Any]] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @property
    def dim(self) -> int:
        return int(self.points.shape[1])

    def problem(self, index: int) -> tuple[Any, Any]:
        """Waypoints and durations of one problem."""
        if index in self.odd:
            return self.odd[index]
        first, last = int(self.offsets[index]), int(self.offsets[index + 1])
        return self.points[first + index : last + index + 1], self.durations[first:last]

    @classmethod
    def of(cls, waypoints: Any, durations: Any) -> _Batch:
        """Sort what a caller gave."""
        points, times = _numbers(waypoints), _numbers(durations)
        if points is not None and times is not None and points.ndim == 3 and min(points.shape[1:]) > 0:
            count, knots, dim = points.shape
            if times.shape in ((knots - 1,), (count, knots - 1)) and knots > 1:
                times = np.ascontiguousarray(np.broadcast_to(times, (count, knots - 1)))
                offsets = np.arange(count + 1, dtype=np.int64) * (knots - 1)
                return cls(points.reshape(-1, dim), times.reshape(-1), offsets)
        return cls._of_rows(_rows(waypoints, "waypoints"), _rows(durations, "durations"))

    @classmethod
    def _of_rows(cls, waypoints: list[Any], durations: list[Any]) -> _Batch:
        if len(waypoints) != len(durations):
            raise TimingError(f"{len(waypoints)} problems need as many rows of durations, {len(durations)} given")
        pairs = [(_numbers(p), _numbers(t)) for p, t in zip(waypoints, durations, strict=True)]
        dim = next((p.shape[1] for p, t in pairs if _fit(p, t)), 1)
        odd, points, times, offsets = {}, [], [], [0]
        for index, (p, t) in enumerate(pairs):
            if not _fit(p, t) or p.shape[1] != dim:
                odd[index] = waypoints[index], durations[index]
                p, t = np.zeros((1, dim)), np.zeros(0)
            points.append(p)
            times.append(t)
            offsets.append(offsets[-1] + len(t))
        joined = np.concatenate(points) if points else np.zeros((0, dim))
        return cls(joined, np.concatenate([*times, np.zeros(0)]), np.array(offsets, dtype=np.int64), odd)


def _numbers(values: Any) -> Any:
    """Return a C-contiguous array of doubles that is nobody else's, or None."""
    try:
        return np.array(values, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        return None


def _fit(points: Any, times: Any) -> bool:
    if points is None or times is None or points.ndim != 2 or times.ndim != 1:
        return False
    return len(points) == len(times) + 1 > 1 and points.shape[1] > 0


def _rows(values: Any, name: str) -> list[Any]:
    try:
        return list(values)
    except TypeError:
        raise InputError(f"{name} are {values!r}: give one row for each problem") from None


def _workers(threads: Any) -> int:
    if threads is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if isinstance(threads, bool) or not isinstance(threads, (int, np.integer)) or not 1 <= threads <= 256:
        raise InputError(f"threads is {threads!r}: use 1 to 256")
    return int(threads)


def _states(state: State | None, where: str, batch: _Batch, half: int) -> FloatArray | None:
    """Return derivatives 1 … k - 1 at an end, (problems, k - 1, dim), or None at rest."""
    if state is None:
        return None
    check_state(
        {name: np.zeros(batch.dim) for name in state} if isinstance(state, Mapping) else state, where, half, batch.dim
    )
    states = np.zeros((len(batch), half - 1, batch.dim))
    for name, value in state.items():
        try:
            states[:, DERIVATIVES.index(name) - 1] = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            shapes = f"({batch.dim},) or ({len(batch)}, {batch.dim})"
            raise WaypointError(f"the {name} of {where} must be numbers of shape {shapes}") from None
    return states


def _corridors(corridor: Any, count: int) -> list[Any] | None:
    """Corridor of every problem; None where there is none at all."""
    if corridor is None:
        return None
    if hasattr(corridor, "walls") or not hasattr(corridor, "__len__") or getattr(corridor, "ndim", 1) == 0:
        return [corridor] * count
    each = list(corridor)
    if len(each) != count:
        raise CorridorError(f"{count} problems need one corridor, or one for each, {len(each)} given")
    return each


@dataclass(frozen=True, eq=False)
class _Together:
    """What the native core made of all problems at once.

    Parameters
    ----------
    points : ndarray, shape (legs in all, 2k, dim)
    breaks : ndarray, shape (knots in all,)
    statuses : ndarray of int, shape (problems,)
    widths, figures : ndarray, shape (legs in all,) and (problems, 4), or None
        Half-widths of tubes, and what is known of the plans in them.
    """

    points: FloatArray
    breaks: FloatArray
    statuses: IntArray
    widths: FloatArray | None = None
    figures: FloatArray | None = None

    def reports(self, batch: _Batch, seconds: float) -> list[Report | ReportMaker]:
        """Return what makes the report of each problem."""
        if self.widths is None or self.figures is None:
            return [LinearSystem(0.0, seconds, "native")] * len(batch)
        first = batch.offsets.tolist()
        return [
            TubeReport(seconds, figures, batch.problem(index)[0], self.widths[first[index] : first[index + 1]])
            for index, figures in enumerate(self.figures)
        ]


def _solved_together(
    batch: _Batch,
    half: int,
    ends: tuple[FloatArray | None, FloatArray | None],
    corridors: list[Any] | None,
    workers: int,
) -> _Together | None:
    arrays = batch.points, batch.durations, batch.offsets, half
    if corridors is None:
        free = many_optima(*arrays, ends, workers)
        return None if free is None else _Together(*free)
    widths = _leg_widths(batch, corridors) if ends == (None, None) and batch.dim > 1 else None
    tubes = None if widths is None else many_tubes(*arrays, widths, workers)
    return None if tubes is None else _Together(tubes[0], tubes[1], tubes[3], widths, tubes[2])


def _leg_widths(batch: _Batch, corridors: list[Any]) -> FloatArray | None:
    """Return the half-width of every leg; None unless all corridors are one number, or one per leg, and as asked."""
    rows = []
    for corridor, legs in zip(corridors, np.diff(batch.offsets).tolist(), strict=True):
        width = None if corridor is None or hasattr(corridor, "walls") else _numbers(corridor)
        if width is None or width.shape not in ((), (legs,)):
            return None
        rows.append(np.broadcast_to(width, legs))
    return np.concatenate([*rows, np.zeros(0)])


def _alone(
    batch: _Batch, index: int, corridor: Any, half: int, ends: tuple[FloatArray | None, FloatArray | None]
) -> Trajectory | MinsnapError:
    """Plan one problem by itself."""
    points, durations = batch.problem(index)
    names = DERIVATIVES[1:half]
    start, end = (None if e is None else dict(zip(names, e[index], strict=True)) for e in ends)
    dim = batch.dim if batch.dim > 3 and index not in batch.odd else None
    try:
        curve = plan(points, durations, corridor=corridor, degree=2 * half - 1, start=start, end=end, dim=dim)
        if curve.dim != batch.dim:
            raise WaypointError(
                f"problem {index} has {curve.dim} coordinates and the others {batch.dim}: plan it apart"
            )
    except MinsnapError as error:
        return error
    return curve


def _mended(
    batch: _Batch,
    half: int,
    ends: tuple[FloatArray | None, FloatArray | None],
    corridors: list[Any] | None,
    solved: _Together,
    workers: int,
    began: float,
) -> Trajectories:
    """Plan by themselves the problems that the native core left, and wrap all."""
    left = np.flatnonzero(solved.statuses != Status.DONE)
    reports = solved.reports(batch, (perf_counter() - began) / max(len(batch), 1))
    errors: list[MinsnapError | None] = [None] * len(batch)
    for index in left.tolist():
        found = _alone(batch, index, None if corridors is None else corridors[index], half, ends)
        if isinstance(found, MinsnapError):
            errors[index] = found
            continue
        first, last = int(batch.offsets[index]), int(batch.offsets[index + 1])
        solved.points[first:last], solved.breaks[first + index : last + index + 1] = found.control_points, found.breaks
        reports[index] = found.report or reports[index]
    return _wrapped(solved.points, batch.durations, solved.breaks, batch.offsets, errors, reports, workers)


def _solved_one_by_one(
    batch: _Batch,
    corridors: list[Any] | None,
    half: int,
    ends: tuple[FloatArray | None, FloatArray | None],
    workers: int,
) -> Trajectories:
    """Plan every problem by itself."""

    def solve(index: int) -> Trajectory | MinsnapError:
        return _alone(batch, index, None if corridors is None else corridors[index], half, ends)

    with ThreadPoolExecutor(workers) as pool:
        found = list(pool.map(solve, range(len(batch))))
    blank = LinearSystem(0.0, 0.0, "python")
    curves = [curve if isinstance(curve, Trajectory) else None for curve in found]
    points = [np.zeros((0, 2 * half, batch.dim)), *(c.control_points for c in curves if c)]
    durations = [np.zeros(0), *(c.durations for c in curves if c)]
    breaks = [np.zeros(0), *(np.zeros(1) if c is None else c.breaks for c in curves)]
    offsets = np.cumsum([0, *(0 if c is None else len(c.durations) for c in curves)])
    errors = [None if isinstance(f, Trajectory) else f for f in found]
    reports = [blank if c is None or c.report is None else c.report for c in curves]
    arrays = np.concatenate(points), np.concatenate(durations), np.concatenate(breaks), np.asarray(offsets)
    return _wrapped(*arrays, errors, reports, workers)


def _wrapped(
    points: FloatArray,
    durations: FloatArray,
    breaks: FloatArray,
    offsets: IntArray,
    errors: Sequence[MinsnapError | None],
    reports: Sequence[Report | ReportMaker],
    workers: int,
) -> Trajectories:
    for array in (points, durations, breaks, offsets):
        array.setflags(write=False)
    return Trajectories(points, durations, breaks, offsets, tuple(errors), tuple(reports), workers)

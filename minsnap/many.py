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
from minsnap.corridors.tubes import Tube
from minsnap.errors import CorridorError, InputError, LimitError, MinsnapError, TimingError, WaypointError
from minsnap.limits.limits import Limits
from minsnap.native.many import ManySlopes, many_gradients, many_optima, many_tubes
from minsnap.native.status import Status
from minsnap.optimisation.outcome import GAP
from minsnap.optimisation.tube_report import TubeReport
from minsnap.planner import plan
from minsnap.trajectory.gradients import Gradients, free_slopes
from minsnap.trajectory.report import LinearSystem, Report
from minsnap.trajectory.trajectories import Trajectories
from minsnap.trajectory.trajectory import ReportMaker, Trajectory

GRADIENT_GAP = 1e-10
"""Share of the cost of a plan in a tube that may be given away where gradients are asked for: their error goes as its
square root."""

State = Mapping[str, npt.ArrayLike]
Pins = Mapping[int, State]


def plan_many(
    waypoints: npt.ArrayLike | Sequence[npt.ArrayLike],
    durations: npt.ArrayLike | Sequence[npt.ArrayLike] | None = None,
    corridor: npt.ArrayLike | Constraint | Sequence[npt.ArrayLike | Constraint | None] | None = None,
    *,
    limits: Limits | Sequence[Limits | None] | None = None,
    pins: Pins | Sequence[Pins | None] | None = None,
    total_time: float | Sequence[float] | None = None,
    degree: int = 7,
    start: State | None = None,
    end: State | None = None,
    gradients: bool = False,
    threads: int | None = None,
) -> Trajectories:
    """Plan many problems; see ``plan``.

    Parameters
    ----------
    waypoints : array_like, shape (B, n, dim), or sequence of B array_like, each (n_b, dim)
        Positions to pass through [m].
    durations : array_like, shape (B, n - 1) or (n - 1,), or sequence of B array_like, each (n_b - 1,)
        Seconds a leg; one row of them serves all problems of an array. Left out where ``limits`` or ``total_time``
        choose them.
    corridor : float, Constraint, or sequence of B of what ``plan`` takes, optional
        One for all problems, or one for each; an array's first axis counts problems.
    limits, pins, total_time : optional
        What ``plan`` takes: one for all problems, or a sequence of B.
    degree : int
        2k - 1: 3, 5, 7, 9 or 11.
    start, end : mapping, optional
        Derivatives at the ends, such as ``{"velocity": v}`` with v of shape (dim,) or (B, dim) [m/s]; those up to order
        k - 1 that are not named are zero.
    gradients : bool
        Whether ``many.gradients`` holds the exact derivatives of every optimal cost in durations, waypoints and the
        half-widths of tubes: for given durations, without limits, pins and constraints other than tubes. Plans in tubes
        are then solved more accurately, and may differ from those of ``plan`` by some 1e-6 of their cost.
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
        waypoints, or a degree that does not exist; or if gradients are asked for that are not known.  What is wrong
        with one problem is in ``errors``.
    """
    began = perf_counter()
    half = check_degree(degree)
    batch = _Batch.of(waypoints, _no_durations(waypoints) if durations is None else durations)
    ends = _states(start, "start", batch, half), _states(end, "end", batch, half)
    others = _others(len(batch), durations is None, limits=limits, pins=pins, total_time=total_time)
    asked = _Asked(batch, half, ends, _corridors(corridor, len(batch)), others, _workers(threads), began)
    widths = asked.widths()
    if gradients:
        _check_gradients(asked, widths)
    if others:
        return _solved_one_by_one(asked, False)
    if asked.corridors is None:
        return _solved_free(asked, gradients)
    return _solved_one_by_one(asked, gradients) if widths is None else _solved_in_tubes(asked, widths, gradients)


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
        shapes = [p.shape for p, _ in pairs if p is not None and p.ndim == 2 and p.shape[1]]
        dim = next((p.shape[1] for p, t in pairs if _fit(p, t)), shapes[0][1] if shapes else 1)
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


def _no_durations(waypoints: Any) -> list[Any]:
    """Return a row of no durations for each problem."""
    return [None] * len(_rows(waypoints, "waypoints"))


def _others(count: int, without_durations: bool, **given: Any) -> list[dict[str, Any]] | None:
    """Return the further arguments of ``plan`` by problem; None where there are none.

    Raises
    ------
    InputError
        If there are others than one for all, or one for each.
    """
    if not without_durations and all(value is None for value in given.values()):
        return None
    each: list[dict[str, Any]] = [{"durations": None} if without_durations else {} for _ in range(count)]
    for name, value in given.items():
        if (
            isinstance(value, (Limits, Mapping))
            or value is None
            or np.ndim(value) == 0
            and not hasattr(value, "__len__")
        ):
            values = [value] * count
        else:
            values = list(value)
        if len(values) != count:
            kind = LimitError if name == "limits" else WaypointError if name == "pins" else TimingError
            raise kind(f"{count} problems need one {name}, or one for each, {len(values)} given")
        for own, one in zip(each, values, strict=True):
            own[name] = one
    return each


@dataclass(frozen=True, eq=False)
class _Asked:
    """All that a call asks for.

    Parameters
    ----------
    batch : _Batch
    half : int
    ends : tuple of ndarray, shape (problems, k - 1, dim), or None
    corridors : list, or None
        By problem; None where there are none at all.
    others : list of dict, or None
        Further arguments of ``plan`` by problem.
    workers : int
    began : float
        Reading of ``time.perf_counter`` [s].
    """

    batch: _Batch
    half: int
    ends: tuple[FloatArray | None, FloatArray | None]
    corridors: list[Any] | None
    others: list[dict[str, Any]] | None
    workers: int
    began: float

    def alone(self, index: int) -> Trajectory | MinsnapError:
        """Plan one problem by itself."""
        points, durations = self.batch.problem(index)
        names = DERIVATIVES[1 : self.half]
        start, end = (None if e is None else dict(zip(names, e[index], strict=True)) for e in self.ends)
        given: dict[str, Any] = {"durations": durations} | (self.others[index] if self.others else {})
        corridor = None if self.corridors is None else self.corridors[index]
        try:
            curve = plan(points, corridor=corridor, degree=2 * self.half - 1, start=start, end=end, **given)
            if curve.dim != self.batch.dim:
                raise WaypointError(
                    f"problem {index} has {curve.dim} coordinates and the others {self.batch.dim}: plan it apart"
                )
        except MinsnapError as error:
            return error
        return curve

    def widths(self) -> FloatArray | None:
        """Half-widths of all legs (legs in all,) where every corridor is a tube of numbers; else None.

        Not a number where a corridor is malformed: its problem is then planned by itself, and refused.
        """
        if self.corridors is None or self.others or any(end is not None for end in self.ends):
            return None
        legs, values = np.diff(self.batch.offsets), []
        for corridor, count in zip(self.corridors, legs.tolist(), strict=True):
            width = _plain_widths(corridor, count)
            if width is None:
                return None
            values.append(width)
        if values and all(isinstance(width, float) for width in values):
            return np.repeat(np.array(values), legs)
        return np.concatenate(
            [np.zeros(0), *(np.broadcast_to(w, n) for w, n in zip(values, legs.tolist(), strict=True))]
        )


def _plain_widths(corridor: Any, legs: int) -> FloatArray | float | None:
    """Return half-widths of one tube; None for what is no tube, or one with a width per axis."""
    if isinstance(corridor, float):
        return corridor
    width = _numbers(corridor.half_width if isinstance(corridor, Tube) else corridor)
    if corridor is None or width is None or width.ndim > 1:
        return None
    return np.full(legs, np.nan) if width.ndim and len(width) != legs else np.asarray(width)


def _check_gradients(asked: _Asked, widths: FloatArray | None) -> None:
    if asked.others or (asked.corridors is not None and widths is None):
        raise InputError(
            "gradients are known for given durations, without limits and pins, with tubes from rest to rest or without "
            "a corridor: leave out gradients=True, or the rest"
        )


def _solved_free(asked: _Asked, gradients: bool) -> Trajectories:
    """Plan without walls, all at once where the native core is."""
    batch = asked.batch
    arrays = batch.points, batch.durations, batch.offsets, asked.half, asked.ends, asked.workers
    solved = many_optima(*arrays)
    if solved is None:
        return _solved_one_by_one(asked, gradients)
    slopes = many_gradients(*arrays) if gradients else None
    how: ReportMaker = LinearSystem(0.0, (perf_counter() - asked.began) / max(len(batch), 1), "native")
    return _mended(asked, solved, [how] * len(batch), slopes)


def _solved_in_tubes(asked: _Asked, widths: FloatArray, gradients: bool) -> Trajectories:
    """Plan from rest to rest in tubes, all at once where the native core is."""
    batch = asked.batch
    gap = GRADIENT_GAP if gradients else GAP
    found = many_tubes(batch.points, batch.durations, batch.offsets, asked.half, widths, asked.workers, gradients, gap)
    if found is None:
        return _solved_one_by_one(asked, gradients)
    share = (perf_counter() - asked.began) / max(len(batch), 1)
    first = batch.offsets.tolist()
    reports: list[ReportMaker] = [
        TubeReport(share, found.figures[b], batch.points[i + b : j + b + 1], widths[i:j])
        for b, (i, j) in enumerate(zip(first[:-1], first[1:], strict=True))
    ]
    return _mended(asked, (found.points, found.breaks, found.statuses), reports, found.slopes)


def _mended(
    asked: _Asked,
    solved: tuple[FloatArray, FloatArray, IntArray],
    made: list[ReportMaker],
    slopes: ManySlopes | None,
) -> Trajectories:
    """Plan by themselves the problems that the native core left, and wrap all."""
    points, breaks, statuses = solved
    batch = asked.batch
    errors: list[MinsnapError | None] = [None] * len(batch)
    reports: list[Report | ReportMaker] = [*made]
    for index in np.flatnonzero(statuses != Status.DONE).tolist():
        found = asked.alone(index)
        if isinstance(found, MinsnapError):
            errors[index] = found
            continue
        legs = slice(int(batch.offsets[index]), int(batch.offsets[index + 1]))
        points[legs], breaks[legs.start + index : legs.stop + index + 1] = found.control_points, found.breaks
        reports[index] = found.report or made[index]
        if slopes is not None and slopes.widths is None:
            slopes.durations[legs], slopes.displacements[legs] = free_slopes(found.control_points, found.durations)
    gradients = None if slopes is None else Gradients.of_legs(*slopes, batch.offsets)
    return _wrapped(points, batch.durations, breaks, batch.offsets, errors, reports, asked.workers, gradients)


def _solved_one_by_one(asked: _Asked, gradients: bool) -> Trajectories:
    """Plan every problem by itself."""
    with ThreadPoolExecutor(asked.workers) as pool:
        found = list(pool.map(asked.alone, range(len(asked.batch))))
    blank = LinearSystem(0.0, 0.0, "python")
    curves = [curve if isinstance(curve, Trajectory) else None for curve in found]
    points = np.concatenate([np.zeros((0, 2 * asked.half, asked.batch.dim)), *(c.control_points for c in curves if c)])
    durations = np.concatenate([np.zeros(0), *(c.durations for c in curves if c)])
    breaks = np.concatenate([np.zeros(0), *(np.zeros(1) if c is None else c.breaks for c in curves)])
    offsets = np.cumsum([0, *(0 if c is None else len(c.durations) for c in curves)])
    errors = [None if isinstance(f, Trajectory) else f for f in found]
    reports = [blank if c is None or c.report is None else c.report for c in curves]
    known = _gradients_of(points, durations, offsets, asked.corridors is None) if gradients else None
    return _wrapped(points, durations, breaks, np.asarray(offsets), errors, reports, asked.workers, known)


def _gradients_of(points: FloatArray, durations: FloatArray, offsets: IntArray, free: bool) -> Gradients:
    """Return the gradients of plans of the Python core: not numbers inside walls."""
    if free:
        return Gradients.of_legs(*free_slopes(points, durations), None, offsets)
    blank = np.full(len(durations), np.nan)
    return Gradients.of_legs(blank, np.full((len(durations), points.shape[2]), np.nan), blank.copy(), offsets)


def _wrapped(
    points: FloatArray,
    durations: FloatArray,
    breaks: FloatArray,
    offsets: IntArray,
    errors: Sequence[MinsnapError | None],
    reports: Sequence[Report | ReportMaker],
    workers: int,
    gradients: Gradients | None,
) -> Trajectories:
    for array in (points, durations, breaks, offsets):
        array.setflags(write=False)
    return Trajectories(points, durations, breaks, offsets, tuple(errors), tuple(reports), workers, gradients)

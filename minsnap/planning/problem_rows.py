"""The problems of plan_many: rows of arguments as long arrays, and the other arguments of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, IntArray, numbers
from minsnap.basics.checks import DERIVATIVES, check_state, free_orders
from minsnap.basics.messages import shown
from minsnap.corridors.tubes import Tube, as_constraints
from minsnap.errors import InputError, MinsnapError, SolverError, TimingError, WaypointError
from minsnap.planning.many_limits import PlainProblem, plan_together
from minsnap.planning.planner import plan, task_of
from minsnap.planning.request import PlanRequest
from minsnap.trajectory.trajectories import Slopes, free_slopes
from minsnap.trajectory.trajectory import Trajectory

GRADIENT_GAP = 1e-10
"""Share of the cost of a plan in walls that may be lost where gradients are computed: their error goes as its
square root."""

State = Mapping[str, ArrayLike]
Pins = Mapping[int, State]


@dataclass(frozen=True, eq=False)
class ProblemRows:
    """The problems: those that are numbers of the right shape in long arrays, the others as they came.

    Parameters
    ----------
    points : ndarray, shape (knots in all, dim)
        Perhaps the caller's own: what is kept of them is copied.
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
        """Number of coordinates."""
        return int(self.points.shape[1])

    def problem(self, index: int) -> tuple[Any, Any]:
        """Waypoints and durations of one problem."""
        if index in self.odd:
            return self.odd[index]
        first, last = int(self.offsets[index]), int(self.offsets[index + 1])
        return self.points[first + index : last + index + 1], self.durations[first:last]

    def ends(self, state: State | None, where: str, half: int) -> FloatArray | None:
        """Return derivatives 1 … k - 1 at an end, (problems, k - 1, dim), or None at rest."""
        if state is None:
            return None
        names = {name: np.zeros(self.dim) for name in state} if isinstance(state, Mapping) else state
        check_state(names, where, half, self.dim)
        if free_orders(state, half):
            raise WaypointError(f"{where} leaves a derivative free: plan each of these by itself")
        states = np.zeros((len(self), half - 1, self.dim))
        for name, value in state.items():
            values = numbers(value)
            if values is None or values.shape not in ((self.dim,), (len(self), self.dim)):
                shapes = f"({self.dim},) or ({len(self)}, {self.dim})"
                raise WaypointError(f"the {name} of {where} must be numbers of shape {shapes}")
            states[:, DERIVATIVES.index(name) - 1] = values
        return states

    def each(self, name: str, value: Any, error: type[MinsnapError]) -> list[Any]:
        """Return an argument of every problem, from one for all or one for each."""
        one = hasattr(value, "walls") or not hasattr(value, "__len__") or isinstance(value, (str, bytes, Mapping))
        values = [value] * len(self) if one or getattr(value, "ndim", 1) == 0 else list(value)
        if len(values) != len(self):
            raise error(f"{len(self)} problems need one {name}, or one for each, not {len(values)}")
        return values

    @classmethod
    def of(cls, waypoints: Any, durations: Any) -> ProblemRows:
        """Sort what a caller gave."""
        if durations is None:
            durations = [None] * len(_rows(waypoints, "waypoints"))
        points, times = numbers(waypoints, copy=False), numbers(durations)
        if points is not None and times is not None and points.ndim == 3 and min(points.shape[1:]) > 0:
            count, knots, dim = points.shape
            if times.shape in ((knots - 1,), (count, knots - 1)) and knots > 1:
                times = np.ascontiguousarray(np.broadcast_to(times, (count, knots - 1)))
                offsets = np.arange(count + 1, dtype=np.int64) * (knots - 1)
                return cls(points.reshape(-1, dim), times.reshape(-1), offsets)
        return cls._of_rows(_rows(waypoints, "waypoints"), _rows(durations, "durations"))

    @classmethod
    def _of_rows(cls, waypoints: list[Any], durations: list[Any]) -> ProblemRows:
        if len(waypoints) != len(durations):
            raise TimingError(f"{len(waypoints)} problems need as many rows of durations, not {len(durations)}")
        pairs: list[Any] = [(numbers(p), numbers(t)) for p, t in zip(waypoints, durations, strict=True)]
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


def _fit(points: Any, times: Any) -> bool:
    if points is None or times is None or points.ndim != 2 or times.ndim != 1:
        return False
    return len(points) == len(times) + 1 > 1 and points.shape[1] > 0


def _rows(values: Any, name: str) -> list[Any]:
    try:
        return list(values)
    except TypeError:
        raise InputError(f"{name} are {shown(values)}: give one row for each problem") from None


@dataclass(frozen=True, eq=False)
class ManyProblems:
    """All that a call asks for.

    Parameters
    ----------
    batch : ProblemRows
    half : int
    ends : tuple of ndarray, shape (problems, k - 1, dim), or None
    corridors : list, or None
        By problem; None where there are none at all.
    others : mapping of str to list
        Further arguments of ``plan`` by problem; empty where there are none.
    workers : int
    began : float
        Reading of ``time.perf_counter`` [s].
    watch : callable, or None
        Called with the number of problems that are planned, now and then, and with all of them.
    """

    batch: ProblemRows
    half: int
    ends: tuple[FloatArray | None, FloatArray | None]
    corridors: list[Any] | None
    others: Mapping[str, list[Any]]
    workers: int
    began: float
    watch: Callable[[int, int], None] | None = None

    def request(self, index: int) -> PlanRequest:
        """Return the question of one problem."""
        points, durations = self.batch.problem(index)
        names = DERIVATIVES[1 : self.half]
        start, end = (None if e is None else dict(zip(names, e[index], strict=True)) for e in self.ends)
        corridor = None if self.corridors is None else self.corridors[index]
        own = {"durations": durations} | {name: values[index] for name, values in self.others.items()}
        return PlanRequest(waypoints=points, corridor=corridor, start=start, end=end, degree=2 * self.half - 1, **own)

    def alone(self, index: int) -> Trajectory | MinsnapError:
        """Plan one problem by itself."""
        try:
            curve = plan(**self.request(index).arguments())
            if curve.dim != self.batch.dim:
                raise WaypointError(
                    f"problem {index} has {curve.dim} coordinates and the others {self.batch.dim}: plan it apart"
                )
        except MinsnapError as error:
            return error
        return curve

    def all_alone(self) -> list[Trajectory | MinsnapError]:
        """Plan every problem by itself, over threads: plain ones within limits in the native core alone."""
        together = plan_together([self.plain(index) for index in range(len(self.batch))], self.workers, self._told)
        rest = [index for index, curve in enumerate(together) if curve is None]
        curves: list[Any] = list(together)
        with ThreadPoolExecutor(self.workers) as pool:
            for done, (index, curve) in enumerate(zip(rest, pool.map(self.alone, rest), strict=True)):
                curves[index] = curve
                self._told(len(curves) - len(rest) + done + 1)
        return curves

    def plain(self, index: int) -> PlainProblem | None:
        """Return one problem where it is a plain one within limits, else None."""
        known = {"limits"} <= self.others.keys() <= {"limits", "durations"}
        if not known or self.half != 4 or any(end is not None for end in self.ends):
            return None
        waypoints, durations = self.batch.problem(index)
        if durations is not None or np.shape(waypoints)[-1:] != (self.batch.dim,):
            return None
        corridor = None if self.corridors is None else self.corridors[index]
        return PlainProblem.of(waypoints, self.others["limits"][index], corridor)

    def _told(self, done: int) -> None:
        if self.watch is not None:
            self.watch(done, len(self.batch))

    def slopes(self, index: int, curve: Trajectory) -> Slopes:
        """Return how the optimal cost of one problem changes, whose plan this is."""
        from minsnap.optimisation.gradient import cost_gradient
        from minsnap.optimisation.optimum import InfeasibleRowsError
        from minsnap.optimisation.place_gradient import place_gradient
        from minsnap.optimisation.solve import solve

        request = self.request(index)
        constraints = as_constraints(None if self.corridors is None else self.corridors[index])
        if not constraints:
            times, forces = free_slopes(curve.control_points, curve.durations)
            return Slopes(times, np.diff(-forces, axis=0, prepend=0.0, append=0.0), np.zeros(len(times)))
        try:
            solved = solve(task_of(request), curve.durations, gap=GRADIENT_GAP)
        except (SolverError, InfeasibleRowsError):
            return Slopes.unknown(curve.legs, curve.dim)
        return Slopes(cost_gradient(solved), *place_gradient(solved, constraints))

    def widths(self) -> FloatArray | None:
        """Half-widths of all legs (legs in all,) where every corridor is a tube of numbers; else None.

        Not a number where a corridor is malformed: its problem is then planned by itself, and refused.
        """
        if self.corridors is None or self.others or any(end is not None for end in self.ends):
            return None
        legs, values, known = np.diff(self.batch.offsets), [], {}
        for corridor, count in zip(self.corridors, legs.tolist(), strict=True):
            if (id(corridor), count) not in known:  # one corridor may serve many problems
                known[id(corridor), count] = _plain_widths(corridor, count)
            width = known[id(corridor), count]
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
    width = numbers(corridor.half_width if isinstance(corridor, Tube) else corridor)
    if corridor is None or width is None or width.ndim > 1:
        return None
    if width.ndim == 0:
        return float(width)
    return width if len(width) == legs else np.full(legs, np.nan)

"""Trajectory: piecewise polynomials over [0, duration], the value every other part takes or gives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf, perm
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, cast

import numpy as np

from minsnap.basics.arrays import SMALLEST, ArrayLike, FloatArray, bounded, numbers, owned, read_only
from minsnap.basics.checks import DEGREES, check_number, is_number, is_whole
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import EXACT, ROUNDING
from minsnap.errors import InputError, IntervalError, TimingError, WaypointError
from minsnap.native.evaluation import Evaluator, PieceCosts
from minsnap.polynomials.bernstein import basis, careful_differences, differentiate, gram_root
from minsnap.trajectory.heading import ZERO_YAW, Heading, YawFunction, as_heading
from minsnap.trajectory.instants import LONGEST_PIECE, SHORTEST_PIECE, check_order
from minsnap.trajectory.norm_maxima import arc_length, cut, elevated_points, extent_along, norm_maxima
from minsnap.trajectory.path import Path

if TYPE_CHECKING:
    from scipy.interpolate import BPoly, PPoly

    from minsnap.trajectory.report import Report

T = TypeVar("T")

FARTHEST = 1e150
"""Largest control point [m]: those of a plan whose durations lie far apart are far beyond its waypoints."""

MOST_DEGREE = 100
"""Highest degree to which a curve is elevated."""

LEAST_TOLERANCE = 1e-13
"""Least relative tolerance of a length, above the rounding of its terms."""


class ReportMaker(Protocol):
    """Makes the report of a plan from the finished curve."""

    def report(self, curve: Trajectory) -> Report:
        """Return how the plan was made."""
        ...


class Trajectory(Path):
    r"""Piecewise polynomials, each on its own unit interval.

    Piece i is :math:`r(t) = \sum_j B_j^n(s)\, p_{ij}` with :math:`s = (t - t_i) / T_i`; pieces are half-open, the
    last is closed.

    Parameters
    ----------
    control_points : array_like, shape (pieces in all, degree + 1, dim)
        Bernstein control points [m].
    durations : array_like, shape (pieces in all,)
        T, from ``SHORTEST_PIECE`` to ``LONGEST_PIECE`` [s].
    yaw : Heading or callable, optional
        Yaw as a function of time, see ``with_yaw``; by default zero.
    pieces : int
        Polynomials per leg; a divisor of the number of pieces.

    Raises
    ------
    WaypointError
        If the control points are not finite or not of that shape.
    TimingError
        If the durations are not positive, in that range, one per piece.
    """

    __slots__ = ("_breaks", "_durations", "_how", "_measured", "_native", "_pieces", "_points", "_rest_of", "_yaw")

    def __init__(
        self,
        control_points: ArrayLike,
        durations: ArrayLike,
        yaw: Heading | YawFunction = ZERO_YAW,
        pieces: int = 1,
    ) -> None:
        heading = as_heading(yaw)
        self._hold(*_checked(control_points, durations, pieces), heading)

    def _hold(
        self,
        points: FloatArray,
        durations: FloatArray,
        pieces: int,
        yaw: Heading,
        how: ReportMaker | None = None,
        rest_of: tuple[Trajectory, float] | None = None,
    ) -> None:
        """Keep what is known to be valid, arrays without a copy; see :func:`made`."""
        self._points, self._durations = read_only(points), read_only(durations)
        self._yaw, self._pieces, self._how, self._rest_of = yaw, pieces, how, rest_of
        self._breaks: FloatArray | None = None
        self._native: Evaluator | None = None
        self._measured: dict[str, tuple[object, Any]] = {}

    @property
    def control_points(self) -> FloatArray:
        """Bernstein control points, shape (pieces in all, degree + 1, dim) [m]."""
        return self._points

    @property
    def durations(self) -> FloatArray:
        """Durations of the pieces, shape (pieces in all,) [s]."""
        return self._durations

    @property
    def yaw(self) -> Heading:  # type: ignore[override]
        """Yaw as a function of time."""
        return self._yaw

    @property
    def pieces(self) -> int:
        """Polynomials per leg."""
        return self._pieces

    @property
    def report(self) -> Report | None:
        """How a :class:`Plan` was made; None for other trajectories."""
        return None

    @property
    def waypoints(self) -> FloatArray:
        """Where legs begin and end, shape (legs + 1, dim) [m]."""
        return np.concatenate([self._points[:: self._pieces, 0], self._points[-1:, -1]])

    @property
    def breaks(self) -> FloatArray:
        """Instants at which pieces begin and end, shape (pieces in all + 1,) [s]."""
        if self._breaks is None:
            breaks = np.zeros(len(self.durations) + 1)
            self.durations.cumsum(out=breaks[1:])
            self._breaks = read_only(breaks)
        return self._breaks

    @property
    def duration(self) -> float:
        """Length of the interval [s]."""
        return float(self.breaks[-1])

    @property
    def dim(self) -> int:
        """Number of coordinates."""
        return int(self.control_points.shape[2])

    @property
    def degree(self) -> int:
        """Degree of the polynomials."""
        return int(self.control_points.shape[1]) - 1

    @property
    def legs(self) -> int:
        """Number of legs, from waypoint to waypoint."""
        return len(self.durations) // self.pieces

    @property
    def leg_breaks(self) -> FloatArray:
        """Instants of the waypoints, shape (legs + 1,) [s]."""
        return self.breaks[:: self.pieces]

    def __repr__(self) -> str:
        return f"Trajectory(legs={self.legs}, duration={self.duration:g} s, dim={self.dim}, degree={self.degree})"

    def _repr_html_(self) -> str:
        """Return the card of a notebook: a small drawing of the path, and the facts."""
        from minsnap.trajectory.report import trajectory_card

        return trajectory_card(self)

    def __call__(self, t: ArrayLike, order: int = 0) -> FloatArray:
        """Position, or a derivative of it, at any instants; see ``Path``."""
        if type(order) is int and 0 <= order <= self.degree:
            native = self._native or self._evaluator()
            values = native.one(t, order) if isinstance(t, float) else native.many(t, order)
            if values is not None:
                return values
        return super().__call__(t, order)

    def states(self, t: ArrayLike, orders: int) -> FloatArray:
        """Position and its derivatives below an order, at any instants; see ``Path``."""
        known = type(orders) is int and 0 < orders <= self.degree + 1
        values = (self._native or self._evaluator()).states(t, orders) if known else None
        return super().states(t, orders) if values is None else values

    def _evaluator(self) -> Evaluator:
        """Return the curve in the native core; what that refuses goes to ``Path`` and ``_evaluate``."""
        self._native = Evaluator(*self._polynomials)
        return self._native

    @property
    def _polynomials(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Control points, durations and breaks of what is evaluated: the whole curve where this is the rest of one."""
        whole, start = self._rest_of or (self, 0.0)
        return whole.control_points, whole.durations, whole.breaks - start

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy the parameters, not what was measured."""
        return made, (self._points, self._durations, self._pieces, self._yaw, self._rest_of)

    def _evaluate(self, t: FloatArray, order: int) -> FloatArray:
        if order > self.degree:
            return np.zeros((len(t), self.dim))
        control_points, durations, breaks = self._polynomials
        piece = np.clip(np.searchsorted(breaks, t, side="right") - 1, 0, len(durations) - 1)
        duration = durations[piece]
        s = np.clip((t - breaks[piece]) / duration, 0.0, 1.0)
        s[t == breaks[piece + 1]] = 1.0
        points = differentiate(control_points[piece], order)
        values = np.einsum("mj,mjd->md", basis(self.degree - order, s), points)
        return np.asarray(values / duration[:, None] ** order) if order else values

    def with_yaw(self, yaw: Heading | YawFunction) -> Trajectory:
        """Return the same curve with another yaw and without a report.

        Parameters
        ----------
        yaw : Heading or callable
            A function ``yaw(t, order)`` gives the yaw, or its derivative of that order, at instants of any shape.

        Raises
        ------
        YawError
            If it is neither, or does not give a finite number for each instant.
        """
        heading = as_heading(yaw)
        return made(self._points, self._durations, self._pieces, heading, self._rest_of)

    def derivative(self, order: int = 1) -> Trajectory:
        """Return the derivative of that order as a trajectory of lower degree; zero past the degree."""
        order = min(check_order(order), self.degree + 1)
        points = differentiate(self.control_points, order)
        rest_of = None if self._rest_of is None else (self._rest_of[0].derivative(order), self._rest_of[1])
        points = points / self.durations[:, None, None] ** order
        return made(*_checked(points, self._durations, self._pieces), self._yaw, rest_of)

    @property
    def cost_order(self) -> int:
        """Order k of the derivative that a plan of this degree minimises: degree 2k - 1; 4 (snap) for other degrees."""
        degree = self.degree
        return (degree + 1) // 2 if degree in DEGREES else 4

    def cost(self, order: int | None = None) -> float:
        r"""Integral of the squared norm of a derivative, :math:`\int \|r^{(p)}\|^2 dt`, without a factor 1/2.

        Parameters
        ----------
        order : int, optional
            p; by default ``cost_order``, so that the cost is the one that a plan minimises.

        Returns
        -------
        float
            [m^2 / s^(2p - 1)]
        """
        order = self.cost_order if order is None else check_order(order)
        total: float | None = 0.0
        if order <= self.degree:
            costs = remembered(self, "costs", None, lambda: PieceCosts(self.control_points, self.durations))
            total = costs.total(order)
        return float(self.piece_costs(order).sum()) if total is None else total

    def piece_costs(self, order: int | None = None) -> FloatArray:
        """Contribution of each piece to ``cost(order)``, shape (pieces in all,) [m^2 / s^(2 order - 1)]."""
        order = self.cost_order if order is None else check_order(order)
        if order > self.degree:
            return np.zeros(len(self.durations))
        return costs_of_pieces(self.control_points, self.durations, order)

    def max_norm(self, order: int = 0) -> tuple[float, float]:
        """Maximum over time of the Euclidean norm of a derivative, and the instant where it is attained.

        Proved: the norm never exceeds it, whatever the rounding, and reaches it to some 1e-13 of it.
        """
        return self.max_norms((min(check_order(order), self.degree + 1),))[0]

    def max_norms(self, orders: Sequence[int]) -> list[tuple[float, float]]:
        """Maxima of the norms of several derivatives, their orders ascending; see ``max_norm``."""
        return norm_maxima(self.control_points, self.durations, self.breaks, [check_order(order) for order in orders])

    def extent(self, direction: ArrayLike, order: int = 0) -> tuple[float, float]:
        """Least and greatest value over time of a derivative along a direction; proved bounds, exact to rounding.

        Parameters
        ----------
        direction : array_like, shape (dim,)
            Any non-zero vector; it is not normalised.
        order : int
            0 position, 1 velocity, …
        """
        along = numbers(direction)
        if along is None or along.shape != (self.dim,) or not bounded(along).all():
            raise InputError(f"a direction has {self.dim} finite components here, not {shown(direction)}")
        return extent_along(self.control_points, self.durations, along, min(check_order(order), self.degree + 1))

    def arc_length(self, tolerance: float = 1e-10) -> float:
        """Length of the curve [m], by adaptive quadrature to that relative tolerance, or 1e-7 where it turns back."""
        check_number("the tolerance of a length", tolerance, LEAST_TOLERANCE, inf, f"give {LEAST_TOLERANCE:g} or more")
        return arc_length(self.derivative(1).control_points, self.durations, float(tolerance))

    def between(self, start: float, end: float) -> Trajectory:
        """Cut out [start, end] as a trajectory that begins at time 0.

        Raises
        ------
        IntervalError
            Unless 0 <= start < end <= duration.
        """
        if not (is_number(start) and is_number(end) and 0.0 <= start < end <= self.duration):
            raise IntervalError(f"[{shown(start)}, {shown(end)}] s is not an interval within [0, {self.duration}] s")
        points, durations = cut(self.control_points, self.durations, self.breaks, float(start), float(end))
        return turned(self, Trajectory(points, durations), float(start))

    def stretched(self, factor: float) -> Trajectory:
        """Fly the same path ``factor`` times slower: the p-th derivative is divided by factor^p."""
        if not (is_number(factor) and float(factor) >= SMALLEST):
            raise TimingError(f"time can be stretched by a positive factor, not by {shown(factor)}")
        slower = Trajectory(self._points, self._durations * float(factor), pieces=self._pieces)
        return turned(self, slower, 0.0, 1.0 / factor)

    def reversed(self) -> Trajectory:
        """Fly the same path backwards."""
        points, durations = self.control_points[::-1, ::-1], self.durations[::-1]
        return turned(self, Trajectory(points, durations, pieces=self._pieces), self.duration, -1.0)

    def elevated(self, degree: int) -> Trajectory:
        """Return the same curve written in polynomials of a higher degree."""
        check_number("the degree", degree, -inf, MOST_DEGREE, f"give a whole number up to {MOST_DEGREE}", whole=True)
        points = elevated_points(self.control_points, degree)
        known = _checked(points, self._durations, self._pieces)
        curve, report = made(*known, self._yaw), self.report  # whose cost is of the first degree
        return curve if report is None else as_plan(curve, report)

    def _is_like(self, other: Path) -> bool:
        """Whether another path is the same polynomials."""
        return isinstance(other, Trajectory) and (
            np.array_equal(self.control_points, other.control_points)
            and np.array_equal(self.durations, other.durations)
        )

    def as_trajectory(self) -> Trajectory:
        """Return the trajectory itself."""
        return self

    def then(self, other: Path) -> Trajectory:
        """Fly ``other`` after this one: a trajectory, or a shape, of which the polynomials are taken.

        Raises
        ------
        InputError
            If ``other`` is no path, or one of which no polynomials are known.
        WaypointError
            If the dimensions differ or ``other`` does not begin where this one ends.
        """
        if not isinstance(other, Path):
            raise InputError(f"a {type(other).__name__} cannot be flown after a trajectory: join plans and shapes")
        following: Trajectory = other.as_trajectory()
        if following.dim != self.dim:
            raise WaypointError(f"trajectories of {self.dim} and {following.dim} coordinates cannot be joined")
        gap = np.abs(following.control_points[0, 0] - self.control_points[-1, -1]).max()
        both = np.concatenate([part.control_points.reshape(-1, self.dim) for part in (self, following)])
        if gap > EXACT * np.abs(both - both[0]).max() + ROUNDING * np.abs(both).max():
            raise WaypointError(f"the second trajectory begins {gap} m away from where the first one ends")
        degree = max(self.degree, following.degree)
        points = np.concatenate([elevated_points(part.control_points, degree) for part in (self, following)])
        pieces = self.pieces if self.pieces == following.pieces else 1
        joined = Trajectory(points, np.concatenate([self.durations, following.durations]), pieces=pieces)
        return joined.with_yaw(self.yaw.before(following.yaw, joined, self.duration))

    def to_ppoly(self) -> PPoly:
        """Return the same curve as scipy.interpolate.PPoly: local powers of seconds, descending."""
        from scipy.interpolate import PPoly

        return PPoly.from_bernstein_basis(self.to_bpoly())

    @classmethod
    def from_ppoly(cls, ppoly: PPoly, yaw: Heading | None = None) -> Trajectory:
        """Take over a scipy.interpolate.PPoly of one trailing dimension; its first break becomes time 0."""
        from scipy.interpolate import BPoly

        return cls.from_bpoly(BPoly.from_power_basis(ppoly), yaw)

    def to_bpoly(self) -> BPoly:
        """Return the same curve as scipy.interpolate.BPoly: the control points as they are."""
        from scipy.interpolate import BPoly

        return BPoly(self.control_points.transpose(1, 0, 2), self.breaks)

    @classmethod
    def from_bpoly(cls, bpoly: BPoly, yaw: Heading | None = None) -> Trajectory:
        """Take over a scipy.interpolate.BPoly of one trailing dimension; its first break becomes time 0."""
        points = bpoly.c
        if points.ndim not in (2, 3):
            raise WaypointError(f"a piecewise polynomial must have one trailing dimension, not {points.ndim - 2}")
        return cls(points.reshape(*points.shape[:2], -1).swapaxes(0, 1), np.diff(bpoly.x), yaw or ZERO_YAW)


class Plan(Trajectory):
    """A trajectory that was planned: its ``report`` says how."""

    __slots__ = ()

    @property
    def report(self) -> Report:
        """How the plan was made."""
        how = cast("ReportMaker", self._how)
        self._how = told = how.report(self)
        return told

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy the report, not how that is made."""
        make, parameters = super().__reduce__()
        return as_plan, (make(*parameters), self.report)


def made(
    points: FloatArray,
    durations: FloatArray,
    pieces: int = 1,
    yaw: Heading = ZERO_YAW,
    rest_of: tuple[Trajectory, float] | None = None,
) -> Trajectory:
    """Return a trajectory of what is known to be valid, as from a core; arrays are kept without a copy.

    Parameters
    ----------
    points, durations, pieces, yaw
        As :class:`Trajectory` takes them.
    rest_of : (Trajectory, float), optional
        The curve of which this is the rest, and the instant on its clock at which this begins [s]. The polynomials of
        that curve are evaluated: the control points of a short rest of a piece lie close together, and derivatives of
        order p from them would have the rounding of positions divided by the p-th power of its duration.
    """
    curve = object.__new__(Trajectory)
    curve._hold(points, durations, pieces, yaw, None, rest_of)
    return curve


def as_plan(curve: Trajectory, how: ReportMaker) -> Plan:
    """Return a curve as a plan, with what makes its report at its first use; a ``Report`` is its own."""
    plan = object.__new__(Plan)
    plan._hold(curve._points, curve._durations, curve._pieces, curve._yaw, how, curve._rest_of)
    return plan


def planned(points: FloatArray, durations: FloatArray, how: ReportMaker, pieces: int = 1) -> Plan:
    """Return a plan of what is known to be valid; see :func:`made` and :func:`as_plan`."""
    plan = object.__new__(Plan)
    plan._hold(points, durations, pieces, ZERO_YAW, how)
    return plan


def report_maker(curve: Trajectory) -> ReportMaker | None:
    """Return what makes the report of a plan, a ``Report`` once it was made; None of other trajectories."""
    return curve._how


def remembered(curve: Trajectory, what: str, by: object, ask: Callable[[], T]) -> T:
    """Return what was asked of this very curve and by this very object, both compared by identity; asked once."""
    known = curve._measured.get(what)
    if known is None or known[0] is not by:
        known = curve._measured[what] = by, ask()
    return cast(T, known[1])


def turned(flown: Trajectory, curve: Trajectory, start: float, rate: float = 1.0) -> Trajectory:
    """Give a curve on another clock the heading of one that is flown, from an instant on."""
    return curve.with_yaw(flown.yaw.on(curve, start, rate))


def rest_of(curve: Trajectory) -> tuple[Trajectory, float] | None:
    """Return the curve of which this is the rest, and the instant on its clock at which it begins [s]."""
    return curve._rest_of


def as_rest_of(curve: Trajectory, whole: Trajectory, start: float) -> Trajectory:
    """Return a curve as the rest of another from an instant on its clock [s], whose polynomials are evaluated."""
    return made(curve._points, curve._durations, curve._pieces, curve._yaw, (whole, start))


def _checked(control_points: ArrayLike, times: ArrayLike, pieces: int) -> tuple[FloatArray, FloatArray, int]:
    """Return arrays of its own, and how many polynomials a leg has; raise an error for what is wrong."""
    points, durations = owned(control_points), owned(times)
    if points.ndim != 3 or 0 in points.shape or not (np.abs(points) <= FARTHEST).all():
        raise WaypointError(
            f"control points must be finite, of shape (pieces, degree + 1, dim), not {points.shape}, and at most "
            f"{FARTHEST:g} in size"
        )
    if not (is_whole(pieces) and pieces >= 1 and len(points) % int(pieces) == 0):
        raise InputError(f"{len(points)} polynomials are no whole number of legs with pieces={shown(pieces)}")
    if durations.shape != points.shape[:1]:
        raise TimingError(f"durations must be numbers, one for each of {len(points)} pieces")
    if not (durations.min() >= SHORTEST_PIECE and durations.max() <= LONGEST_PIECE):
        wrong = int(np.argmin((durations >= SHORTEST_PIECE) & (durations <= LONGEST_PIECE)))
        raise TimingError(
            f"durations must be positive and finite, from {SHORTEST_PIECE:g} to {LONGEST_PIECE:g} s, and that of "
            f"piece {wrong} is {durations[wrong]} s"
        )
    return points, durations, int(pieces)


def costs_of_pieces(points: FloatArray, durations: FloatArray, order: int) -> FloatArray:
    """Integral of the squared norm of a derivative over each piece, from a sum of squares: shape (pieces,)."""
    costs = PieceCosts(points, durations).each(order)
    if costs is not None:
        return costs
    degree = points.shape[1] - 1
    roots = np.matmul(gram_root(degree - order), perm(degree, order) * careful_differences(points, order))
    with np.errstate(over="ignore"):  # a cost beyond all numbers is infinite
        return np.asarray((roots * roots).sum(axis=(1, 2)) * durations ** (1.0 - 2.0 * order))


def concatenate(trajectories: Sequence[Trajectory]) -> Trajectory:
    """Join trajectories end to end; see ``Trajectory.then``."""
    if not trajectories:
        raise WaypointError("there is no trajectory to join")
    joined = trajectories[0]
    for trajectory in trajectories[1:]:
        joined = joined.then(trajectory)
    return joined


def widest_step(curve: Trajectory) -> tuple[float, float, int]:
    """Return the widest step between the end of a piece and the start of the next [m], when [s], and after which."""
    steps = np.linalg.norm(curve.control_points[1:, 0] - curve.control_points[:-1, -1], axis=1)
    if not len(steps):
        return 0.0, 0.0, 0
    piece = int(steps.argmax())
    return float(steps[piece]), float(curve.breaks[piece + 1]), piece

"""Trajectories: many plans as a few long arrays, with an error where one of them could not be made."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import perm
from typing import NamedTuple, Protocol

import numpy as np

from minsnap.basics.arrays import ArrayLike, BoolArray, FloatArray, IntArray, ReadOnly, read_only, set_fields
from minsnap.basics.cached import cached_property
from minsnap.errors import InputError, IntervalError, MinsnapError
from minsnap.native.plan_batches import many_values
from minsnap.polynomials.bernstein import careful_differences, ends_to_highest, gram_root
from minsnap.trajectory.instants import as_instants, check_order
from minsnap.trajectory.trajectory import Plan, ReportMaker, Trajectory, costs_of_pieces, planned


class Slopes(NamedTuple):
    """How the optimal cost of one plan changes; not numbers where that is not known.

    Parameters
    ----------
    durations : ndarray, shape (legs,)
    waypoints : ndarray, shape (legs + 1, dim)
    widths : ndarray, shape (legs,)
        In half-widths of tubes; zero where there is none.
    """

    durations: FloatArray
    waypoints: FloatArray
    widths: FloatArray

    @classmethod
    def unknown(cls, legs: int, dim: int) -> Slopes:
        """Return those of a plan that has none."""
        return cls(np.full(legs, np.nan), np.full((legs + 1, dim), np.nan), np.full(legs, np.nan))


@dataclass(frozen=True, eq=False)
class Gradients(ReadOnly):
    """How the optimal cost of every plan changes with its durations, waypoints and half-widths; read-only arrays.

    Plan b has the entries ``offsets[b]`` to ``offsets[b + 1]`` of legs, and one waypoint more. Not a number where a
    plan failed.

    Parameters
    ----------
    durations : ndarray, shape (legs in all,)
        [m^2 / s^(2k)].
    waypoints : ndarray, shape (waypoints in all, dim)
        [m / s^(2k - 1)].
    corridor : ndarray, shape (legs in all,), or None
        In the half-width of each leg's tube, never positive [m / s^(2k - 1)]; zero where there is no tube, None without
        any corridor.
    offsets : ndarray of int, shape (plans + 1,)
    """

    durations: FloatArray
    waypoints: FloatArray
    corridor: FloatArray | None
    offsets: IntArray

    def __post_init__(self) -> None:
        set_fields(self, **vars(self))

    @property
    def stacked(self) -> Gradients:
        """The same with a row for each plan: shapes (plans, legs), (plans, legs + 1, dim) and (plans, legs).

        Raises
        ------
        InputError
            If the plans have different numbers of legs.
        """
        plans, dim = len(self.offsets) - 1, self.waypoints.shape[-1]
        legs = equal_legs(self.offsets, "take durations, waypoints and offsets")
        widths = None if self.corridor is None else self.corridor.reshape(plans, legs)
        durations, waypoints = self.durations.reshape(plans, legs), self.waypoints.reshape(plans, legs + 1, dim)
        return replace(self, durations=durations, waypoints=waypoints, corridor=widths)

    @classmethod
    def of_legs(
        cls, durations: FloatArray, displacements: FloatArray, corridor: FloatArray | None, offsets: IntArray
    ) -> Gradients:
        """Return the gradients that follow from derivatives in the displacements of legs (legs in all, dim)."""
        counts = np.diff(offsets)
        first = np.arange(len(durations)) + np.repeat(np.arange(len(counts)), counts)
        waypoints = np.zeros((len(durations) + len(counts), displacements.shape[1]))
        waypoints[first] -= displacements
        waypoints[first + 1] += displacements
        return cls(durations, waypoints, corridor, offsets)

    @classmethod
    def of_plans(cls, each: Sequence[Slopes], dim: int, walls: bool) -> Gradients:
        """Return the gradients of plans that were made one by one, with walls or without any."""
        durations, widths = (np.concatenate([np.zeros(0), *(one[k] for one in each)]) for k in (0, 2))
        waypoints = np.concatenate([np.zeros((0, dim)), *(one.waypoints for one in each)])
        offsets = np.asarray(np.cumsum([0, *(len(one.durations) for one in each)]))
        return cls(durations, waypoints, widths if walls else None, offsets)


def moved_ends(points: FloatArray) -> FloatArray:
    """Return the end derivatives in s of pieces (pieces, 2k, dim), each moved to begin at the origin."""
    degree = points.shape[1] - 1
    half = (degree + 1) // 2
    steps = [perm(degree, order) * careful_differences(points, order) for order in range(half)]
    ends = np.stack([*(step[:, 0] for step in steps), *(step[:, -1] for step in steps)], axis=1)
    ends[:, half] -= ends[:, 0]
    ends[:, 0] = 0.0
    return ends


def free_slopes(points: FloatArray, durations: FloatArray) -> tuple[FloatArray, FloatArray]:
    r"""Return how the optimal cost of a curve without walls changes with durations and displacements of its pieces.

    By the envelope theorem the derivatives at the knots are held. With the scaled ends e of a piece, A their orders and
    :math:`c = T^{1-2k} |R e|^2`: :math:`\partial c / \partial T = T^{-2k} \, 2 (R e) \cdot R ((1 - 2k)/2 + A) e`.

    Parameters
    ----------
    points : ndarray, shape (pieces, 2k, dim)
        Control points of the optimum [m].
    durations : ndarray, shape (pieces,)
        [s].

    Returns
    -------
    ndarray, shape (pieces,), and ndarray, shape (pieces, dim)
    """
    degree = points.shape[1] - 1
    half = (degree + 1) // 2
    ends = moved_ends(points)
    root = gram_root(half - 1) @ ends_to_highest(degree)
    orders = np.tile(np.arange(half), 2)[:, None]
    value, slope = np.matmul(root, ends), np.matmul(root, ((1.0 - 2.0 * half) + 2.0 * orders) * ends)
    times = (value * slope).sum(axis=(1, 2)) * durations ** (-2.0 * half)
    forces = 2.0 * (value * root[:, half, None]).sum(axis=1) * durations[:, None] ** (1.0 - 2.0 * half)
    return np.asarray(times), np.asarray(forces)


def equal_legs(offsets: IntArray, instead: str) -> int:
    """Return the number of legs of plans that are stacked: the same of all."""
    counts = set(np.diff(offsets).tolist())
    if len(counts) > 1:
        raise InputError(f"the plans have different numbers of legs: {instead}")
    return int(next(iter(counts), 0))


class Reports(Protocol):
    """Reports by plan, or what makes them: a list, or what makes each at its first use."""

    def __getitem__(self, index: int, /) -> ReportMaker:
        """Return the report of one plan, or what makes it."""
        ...


@dataclass(frozen=True, eq=False, repr=False)
class Trajectories(ReadOnly):
    """Plans of one degree and dimension, one after the other in read-only arrays.

    Plan b has the polynomials ``offsets[b]`` to ``offsets[b + 1]``: one per leg, or as many as ``pieces`` says. It has
    one knot more than polynomials. A plan that failed has none, or values without meaning.

    Parameters
    ----------
    control_points : ndarray, shape (polynomials in all, degree + 1, dim)
        [m].
    durations : ndarray, shape (polynomials in all,)
        [s].
    breaks : ndarray, shape (polynomials in all + plans,)
        Instants of the knots, from 0 in each plan [s].
    offsets : ndarray of int, shape (plans + 1,)
    errors : tuple of MinsnapError or None
        Error of each plan that failed, else None.
    reports : Reports
        By plan.
    threads : int
        With how many threads all are evaluated.
    gradients : Gradients or None
        Derivatives of the costs, where they were computed.
    pieces : mapping of int to int
        Polynomials per leg of the plans that have several, as one that first flies back within its limits.
    """

    control_points: FloatArray
    durations: FloatArray
    breaks: FloatArray
    offsets: IntArray
    errors: tuple[MinsnapError | None, ...]
    reports: Reports
    threads: int = 1
    gradients: Gradients | None = None
    pieces: Mapping[int, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for array in (self.control_points, self.durations, self.breaks, self.offsets):
            read_only(array)

    def __len__(self) -> int:
        return len(self.errors)

    def __repr__(self) -> str:
        failed = len(self) - int(self.present.sum())
        return f"Trajectories({len(self)} plans, {failed} failed, dim={self.dim}, degree={self.degree})"

    @property
    def dim(self) -> int:
        """Number of coordinates."""
        return int(self.control_points.shape[2])

    @property
    def degree(self) -> int:
        """Degree of the polynomials."""
        return int(self.control_points.shape[1]) - 1

    @cached_property
    def present(self) -> BoolArray:
        """Which plans were made, shape (plans,)."""
        return np.array([error is None for error in self.errors], dtype=bool)

    @property
    def duration(self) -> FloatArray:
        """Duration of every plan, shape (plans,) [s]; not a number where it failed."""
        last = self.offsets[1:] + np.arange(len(self))
        return np.where(self.present, self.breaks[last], np.nan)

    @cached_property
    def costs(self) -> FloatArray:
        """Integral of the squared norm of the k-th derivative of every plan, shape (plans,) [m^2 / s^(2k - 1)].

        Not a number where it failed.
        """
        made = np.repeat(self.present, np.diff(self.offsets))
        pieces = np.zeros(len(self.durations) + 1)
        pieces[:-1][made] = costs_of_pieces(self.control_points[made], self.durations[made], (self.degree + 1) // 2)
        sums = np.add.reduceat(pieces, self.offsets[:-1]) if len(self) else np.zeros(0)
        return np.where(self.present, sums, np.nan)

    @property
    def stacked(self) -> FloatArray:
        """Control points of plans of equally many legs, shape (plans, legs, degree + 1, dim) [m].

        Raises
        ------
        InputError
            If the plans have different numbers of legs.
        """
        legs = equal_legs(self.offsets, "take control_points and offsets")
        return self.control_points.reshape(len(self), legs, *self.control_points.shape[1:])

    def __getitem__(self, index: int) -> Plan:
        """One plan.

        Raises
        ------
        MinsnapError
            Its error, if it failed.
        IndexError
            If there is no plan of this number.
        """
        if not -len(self) <= index < len(self):
            raise IndexError(f"there is no plan {index}: {len(self)} plans are counted from 0")
        number = range(len(self))[index]
        error, how = self.errors[number], self.reports[number]
        if error is not None:
            raise error
        first, last = int(self.offsets[number]), int(self.offsets[number + 1])
        points, durations = self.control_points[first:last], self.durations[first:last]
        return planned(points, durations, how, self.pieces.get(number, 1))

    def __iter__(self) -> Iterator[Trajectory]:
        return (self[index] for index in range(len(self)))

    def __call__(self, t: ArrayLike, order: int = 0) -> FloatArray:
        """Position, or a derivative of it, of all plans at once.

        Parameters
        ----------
        t : array_like, shape (), (m,) or (plans, m)
            Instants [s]: one, the same for all plans, or each plan's own.
        order : int
            0 position, 1 velocity, 2 acceleration, …

        Returns
        -------
        ndarray, shape (plans, dim) or (plans, m, dim)
            Not a number where a plan failed.

        Raises
        ------
        IntervalError
            If an instant is outside the interval of a plan that was made.
        """
        instants = as_instants(t)
        if instants.ndim > 2 or (instants.ndim == 2 and len(instants) != len(self)):
            raise InputError(f"instants have shape {instants.shape}: give (), (m,) or ({len(self)}, m)")
        values = self._values(np.atleast_1d(instants), check_order(order))
        return values if instants.ndim else values[:, 0]

    def _values(self, t: FloatArray, order: int) -> FloatArray:
        if order <= self.degree:
            curves = self.control_points, self.durations, self.breaks, np.asarray(self.offsets, dtype=np.int64)
            rows = many_values(curves, self.present, order, t, self.threads)
            if rows is not None and not rows[1].any():
                return rows[0]
        values = np.full((len(self), t.shape[-1], self.dim), np.nan)
        for index in np.flatnonzero(self.present).tolist():
            try:
                values[index] = self[index](t if t.ndim == 1 else t[index], order)
            except IntervalError as error:
                raise IntervalError(f"plan {index}: {error}") from None
        return values

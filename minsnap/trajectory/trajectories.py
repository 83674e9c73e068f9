"""Trajectories: many plans as a few long arrays, with an error where one of them could not be made."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.errors import InputError, IntervalError, MinsnapError
from minsnap.native.plan_batches import many_values
from minsnap.trajectory.gradients import Gradients
from minsnap.trajectory.instants import as_instants, check_order
from minsnap.trajectory.trajectory import ReportMaker, Trajectory, costs_of_pieces


class Reports(Protocol):
    """Reports by plan, or what makes them: a list, or what makes each at its first use."""

    def __getitem__(self, index: int, /) -> ReportMaker:
        """Return the report of one plan, or what makes it."""
        ...


@dataclass(frozen=True, eq=False)
class ReportsExcept:
    """Reports of ``all`` plans but for some that have their ``own``."""

    all: Reports
    own: Mapping[int, ReportMaker]

    def __getitem__(self, index: int) -> ReportMaker:
        return self.own[index] if index in self.own else self.all[index]


@dataclass(frozen=True, eq=False, repr=False)
class Trajectories:
    """Plans of one degree and dimension, one after the other in read-only arrays.

    Plan b has the legs ``offsets[b]`` to ``offsets[b + 1]``, and one knot more than legs; one that failed has none, or
    values that mean nothing.

    Parameters
    ----------
    control_points : ndarray, shape (legs in all, degree + 1, dim)
        [m].
    durations : ndarray, shape (legs in all,)
        [s].
    breaks : ndarray, shape (legs in all + plans,)
        Instants of the knots, from 0 in each plan [s].
    offsets : ndarray of int, shape (plans + 1,)
    errors : tuple of MinsnapError or None
        By plan, what was wrong; None where nothing was.
    reports : Reports
        By plan.
    threads : int
        With how many threads all are evaluated.
    gradients : Gradients or None
        Derivatives of the costs, where they were computed.
    """

    control_points: FloatArray
    durations: FloatArray
    breaks: FloatArray
    offsets: IntArray
    errors: tuple[MinsnapError | None, ...]
    reports: Reports
    threads: int = 1
    gradients: Gradients | None = None

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
        legs = np.diff(self.offsets)
        if len(legs) and (legs != legs[0]).any():
            raise InputError("the plans have different numbers of legs: take control_points and offsets")
        return self.control_points.reshape(len(self), -1, *self.control_points.shape[1:])

    def __getitem__(self, index: int) -> Trajectory:
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
        return Trajectory.unchecked(control_points=points, durations=durations, how=how)

    def __iter__(self) -> Iterator[Trajectory]:
        return (self[index] for index in range(len(self)))

    def __call__(self, t: npt.ArrayLike, order: int = 0) -> FloatArray:
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
        for index in np.flatnonzero(self.present):
            values[index] = self._one(int(index), t if t.ndim == 1 else t[index], order)
        return values

    def _one(self, index: int, t: FloatArray, order: int) -> FloatArray:
        try:
            return self[index](t, order)
        except IntervalError as error:
            raise IntervalError(f"plan {index}: {error}") from None

r"""The reduced problem: pinned and free values at the knots, the Hessian and the rows.

The unknowns of a trajectory of degree 2k - 1 are the derivatives 0 … k - 1 at its knots, shared by the pieces
on both sides, so that continuity and waypoints hold by construction.  A piece of duration T has the cost
:math:`T^{1-2k} e^\top Q e`, where :math:`e` holds its end derivatives, each times :math:`T^{order}`, and Q is
constant (C. Richter, A. Bry and N. Roy, "Polynomial trajectory planning for aggressive quadrotor flight in dense
indoor environments", ISRR 2013, in the scaled form).  The Hessian is block tridiagonal.

Lengths and times are normalised, and positions are deviations from nominal ones, so that results do not depend on units
or on the position of the origin.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray, set_fields
from minsnap.basics.cached import cached_property
from minsnap.polynomials.bernstein import (
    basis,
    derivative_basis_map,
    ends_gram,
    ends_to_highest,
    ends_to_points,
    gram_root,
    mapped,
    rising_powers,
)


@dataclass(frozen=True, eq=False)
class Slots:
    """Layout of the derivatives of a knot.

    Derivatives up to the continuity have one slot; those above it have one for the piece that ends at the knot and
    one for the piece that starts there.

    Parameters
    ----------
    half : int
        k, for degree 2k - 1.
    continuity : int
        Derivatives shared by both sides.

    Attributes
    ----------
    start, end : ndarray of int, shape (k,)
        Slots of the derivatives of the piece that starts, and that ends at the knot.
    order : ndarray of int, shape (count,)
        Of the derivative in each slot.
    """

    half: int
    continuity: int
    start: IntArray = field(init=False)
    end: IntArray = field(init=False)
    order: IntArray = field(init=False)

    def __post_init__(self) -> None:
        orders = range(self.half)
        apart = [max(order - self.continuity, 0) for order in orders]
        start = [order + more for order, more in zip(orders, apart, strict=True)]
        end = [order - (more > 0) for order, more in zip(start, apart, strict=True)]
        order = [q for q in orders for _ in {start[q], end[q]}]
        set_fields(self, start=np.array(start), end=np.array(end), order=np.array(order))

    @property
    def count(self) -> int:
        """Slots per knot."""
        return int(self.start[-1]) + 1


@cache
def slots_of(half: int, continuity: int) -> Slots:
    """Return the layout, made once."""
    return Slots(half, continuity)


@dataclass(frozen=True, eq=False)
class ReducedProblem:
    """A chain of pieces with the values pinned at its knots; normalised units.

    Parameters
    ----------
    slots : Slots
        Layout of a knot's derivatives.
    durations : ndarray, shape (pieces,)
        Normalised durations.
    nominal : ndarray, shape (knots, dim)
        Positions from which deviations are measured; knots = pieces + 1.
    values : ndarray, shape (knots, slots, dim)
        Pinned values (deviations in slot 0); zero where free.
    free : ndarray of bool, shape (knots, slots, dim)
        What may vary.
    held : ndarray of bool, shape (knots,)
        Knots whose free position is bounded and therefore held at its nominal value by the unbounded solve.
    closed : bool
        The last knot is the first.
    joined_orders : tuple of int
        Orders above k - 1 that must be continuous too, by extra equality rows.
    planes : tuple of (int, ndarray of shape (dim,))
        Knots whose position must stay in a plane through the nominal one, and its unit normal.
    """

    slots: Slots
    durations: FloatArray
    nominal: FloatArray
    values: FloatArray
    free: BoolArray
    held: BoolArray
    closed: bool = False
    joined_orders: tuple[int, ...] = ()
    planes: tuple[tuple[int, FloatArray], ...] = ()

    @property
    def half(self) -> int:
        """Return k, for degree 2k - 1."""
        return self.slots.half

    @property
    def degree(self) -> int:
        """Degree of the pieces."""
        return 2 * self.half - 1

    @property
    def dim(self) -> int:
        """Number of coordinates."""
        return int(self.nominal.shape[1])

    @cached_property
    def powers(self) -> FloatArray:
        """T^0 … T^(k-1) of each piece, shape (pieces, k)."""
        return rising_powers(self.durations, 0, self.half)

    @cached_property
    def end_powers(self) -> FloatArray:
        """Powers for the end derivatives of each piece, start then end: shape (pieces, 2k)."""
        return np.concatenate((self.powers, self.powers), axis=1)

    @cached_property
    def weights(self) -> FloatArray:
        """T^(1-2k) of each piece, shape (pieces,), by products alone."""
        return np.asarray(1.0 / rising_powers(self.durations, 1, 2 * self.half - 1)[:, -1])

    @cached_property
    def steps(self) -> FloatArray:
        """Nominal displacement of each piece, shape (pieces, dim)."""
        return np.diff(self.nominal, axis=0)

    @cached_property
    def columns(self) -> IntArray:
        """Column of each free value in the unknowns, -1 where pinned: shape (knots, slots, dim), axis by axis."""
        free = self.free.copy()
        if self.closed:
            free[-1] = False
        columns = np.full(free.shape, -1, dtype=np.intp)
        by_axis = columns.transpose(2, 0, 1)
        by_axis[free.transpose(2, 0, 1)] = np.arange(free.sum())
        if self.closed:
            columns[-1] = columns[0]
        return columns

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.columns.max()) + 1

    @cached_property
    def piece_columns(self) -> IntArray:
        """Columns of each piece's end derivatives, start then end, -1 where pinned: shape (pieces, dim, 2k)."""
        starts = self.columns[:-1, self.slots.start]
        ends = self.columns[1:, self.slots.end]
        return np.ascontiguousarray(np.concatenate((starts, ends), axis=1).transpose(0, 2, 1))

    def plain_ends(self, knots: FloatArray) -> FloatArray:
        """Unscaled end derivatives of every piece, positions relative to its nominal start: (pieces, 2k, dim)."""
        ends = np.concatenate((knots[:-1, self.slots.start], knots[1:, self.slots.end]), axis=1)
        ends[:, self.half] += self.steps
        return ends

    def piece_ends(self, knots: FloatArray) -> FloatArray:
        """Scaled end derivatives of every piece, positions relative to its nominal start: (pieces, 2k, dim)."""
        return self.plain_ends(knots) * self.end_powers[:, :, None]

    def relative_points(self, knots: FloatArray) -> FloatArray:
        """Control points relative to the nominal start of each piece: (pieces, 2k, dim)."""
        return np.asarray(np.matmul(ends_to_points(self.degree), self.piece_ends(knots)))

    def control_points(self, knots: FloatArray, positions: FloatArray, length: float) -> FloatArray:
        """Control points in metres, exact at the knots.

        Parameters
        ----------
        knots : ndarray, shape (knots, slots, dim)
        positions : ndarray, shape (knots, dim)
            Nominal positions [m].
        length : float
            The unit of length [m].

        Returns
        -------
        ndarray, shape (pieces, 2k, dim)
        """
        k, ends = self.half, ends_to_points(self.degree)
        points = np.empty((len(self.durations), 2 * k, self.dim))
        powers = length * self.powers[:, :, None]
        points[:, :k] = np.matmul(ends[:k, :k], knots[:-1, self.slots.start] * powers)
        points[:, k:] = np.matmul(ends[k:, k:], knots[1:, self.slots.end] * powers)
        points[:, :k] += positions[:-1, None]
        points[:, k:] += positions[1:, None]
        return points

    def cost(self, knots: FloatArray) -> float:
        """Return the integral of the squared norm of the k-th derivative, normalised: a sum of squares."""
        roots = mapped(gram_root(self.half - 1), mapped(ends_to_highest(self.degree), self.moved_ends(knots)))
        return float(((roots * roots).sum(axis=(1, 2)) * self.weights).sum())

    def moved_ends(self, knots: FloatArray) -> FloatArray:
        """Scaled end derivatives of every piece, positions relative to its start: (pieces, 2k, dim)."""
        ends = self.piece_ends(knots)
        ends[:, self.half] -= ends[:, 0]
        ends[:, 0] = 0.0
        return ends

    @cached_property
    def hessian(self) -> Any:
        """Half the Hessian of the cost in the unknowns, sparse, (size, size)."""
        from scipy.sparse import csc_matrix

        columns, powers = self.piece_columns, self.end_powers
        blocks = powers[:, :, None] * powers[:, None, :] * (self.weights[:, None, None] * ends_gram(self.degree))
        shape = (*columns.shape, columns.shape[2])
        row, column = np.broadcast_to(columns[:, :, :, None], shape), np.broadcast_to(columns[:, :, None, :], shape)
        used = (row >= 0) & (column >= 0)
        entries = np.broadcast_to(blocks[:, None], shape)[used]
        return csc_matrix((entries, (row[used], column[used])), shape=(self.size, self.size))

    def slope(self, knots: FloatArray, moving: BoolArray) -> FloatArray:
        """Half the gradient of the cost in the unknowns, (size,), of those at some knots (knots,); 0 for others."""
        scale = self.end_powers * self.weights[:, None]
        forces = np.matmul(ends_gram(self.degree), self.piece_ends(knots)) * scale[:, :, None]
        slope, moves = np.zeros(self.size + 1), np.zeros(self.size + 1, dtype=bool)
        np.add.at(slope, self.piece_columns, forces.transpose(0, 2, 1))
        moves[self.columns[moving]] = True
        return np.asarray(np.where(moves, slope, 0.0)[:-1])

    def row_factors(self, piece: IntArray, s: FloatArray, order: int) -> FloatArray:
        """Factors of a piece's end derivatives in its derivative of that order at s: (rows, 2k)."""
        if order > self.degree:
            return np.zeros((len(s), 2 * self.half))
        local = basis(self.degree - order, s) @ _ends_derivative(self.degree, order)
        local *= self.end_powers[piece]
        return np.asarray(local / self.durations[piece, None] ** order if order else local)

    def add(self, knots: FloatArray, unknowns: FloatArray) -> FloatArray:
        """Add unknowns, shape (size,), to knot values (knots, slots, dim)."""
        padded = np.append(unknowns, 0.0)
        return np.asarray(knots + padded[self.columns])


@cache
def _ends_derivative(degree: int, order: int) -> FloatArray:
    return np.asarray(derivative_basis_map(degree, order) @ ends_to_points(degree))

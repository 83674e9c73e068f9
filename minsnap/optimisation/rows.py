"""Rows of the QP: where the curve sticks out of its walls, and what that means for the unknowns."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from minsnap.arrays import FloatArray, IntArray
from minsnap.optimisation.constraint_blocks import KnotBalls, KnotBounds
from minsnap.optimisation.contacts import Contacts
from minsnap.optimisation.normalised_constraints import Compiled, Rows
from minsnap.optimisation.reduced_qp import Problem
from minsnap.polynomials.extrema import maxima
from minsnap.polynomials.local_maxima import peaks

WITHIN = 1.01
"""Distance to a wall, in widths, up to which a curve is near: from the middle of a corridor to its walls and a bit."""

FEWEST, MOST, BUDGET = 3, 8, 96
"""Rows to begin with on each wall of a small problem, and about how many in all."""


@dataclass(frozen=True, eq=False)
class RowSet:
    """Rows of the QP in its unknowns.

    Parameters
    ----------
    source : Rows
        Where they come from.
    columns : ndarray of int, shape (r, dim * 2k)
        Unknowns that entry (r, j) of ``values`` multiplies; -1 for none.
    values : ndarray, shape (r, dim * 2k)
    bound : ndarray, shape (r,)
        For deviations from the base.
    width : ndarray, shape (r,)
        Width of each row's wall, or less: its distance from the straight leg there, which stays inside when walls move.
    """

    source: Rows
    columns: IntArray
    values: FloatArray
    bound: FloatArray
    width: FloatArray

    def __len__(self) -> int:
        return len(self.bound)

    def chosen(self, mask: npt.NDArray[np.bool_]) -> RowSet:
        """Return some of the rows."""
        rest = (getattr(self, name)[mask] for name in ("columns", "values", "bound", "width"))
        return RowSet(self.source.chosen(mask), *rest)

    def joined(self, other: RowSet) -> RowSet:
        """Return these rows and the other ones."""
        source = self.source.joined(other.source)
        rest = (np.concatenate((getattr(self, n), getattr(other, n))) for n in ("columns", "values", "bound", "width"))
        return RowSet(source, *rest)


def rows_in_unknowns(problem: Problem, ends: FloatArray, compiled: Compiled, rows: Rows) -> RowSet:
    """Express rows in the deviations from a base with these plain end derivatives (pieces, 2k, dim)."""
    factors = _factors(problem, rows)
    straight = factors[:, problem.half] * (problem.steps[rows.piece] * rows.normal).sum(axis=1)
    room = np.where(rows.order == 0, np.maximum(rows.bound - straight, 0.0), np.inf)
    values = rows.normal[:, :, None] * factors[:, None, :]
    present = np.einsum("rdj,rjd->r", values, ends[rows.piece])
    flat = (len(factors), problem.dim * 2 * problem.half)
    columns = problem.piece_columns[rows.piece].reshape(flat)
    width = np.minimum(compiled.widths[rows.wall], room)
    return RowSet(rows, columns, values.reshape(flat), rows.bound - present, width)


def _factors(problem: Problem, rows: Rows) -> FloatArray:
    """Factors of the end derivatives of each row's piece, (r, 2k)."""
    if not len(rows.s) or (rows.order == rows.order[0]).all():
        return problem.row_factors(rows.piece, rows.s, int(rows.order[0]) if len(rows.s) else 0)
    factors = np.empty((len(rows.s), 2 * problem.half))
    for order in np.unique(rows.order):
        chosen = rows.order == order
        factors[chosen] = problem.row_factors(rows.piece[chosen], rows.s[chosen], int(order))
    return factors


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve as its walls see it.

    Parameters
    ----------
    problem : Problem
    compiled : Compiled
    knots : ndarray, shape (knots, slots, dim)
    """

    problem: Problem
    compiled: Compiled
    knots: FloatArray

    @cached_property
    def points(self) -> FloatArray:
        """Control points relative to the nominal start of each piece: (pieces, 2k, dim)."""
        return self.problem.relative_points(self.knots)

    @cached_property
    def excess(self) -> list[FloatArray]:
        """Control points of the excess over every wall, block by block."""
        return self.compiled.excess(self.problem, self.points)

    def rows(self, block: int, index: IntArray, s: FloatArray) -> Rows:
        """Rows for some walls of a block, each at its own s."""
        return self.compiled.rows(self.problem, self.points, block, index, s)


def momentary_rows(curve: Curve) -> list[Rows]:
    """Rows of all walls that hold at one instant only: without them free knots would fly away."""
    sizes = [len(block.piece) if isinstance(block, KnotBounds) else 0 for block in curve.compiled.blocks]
    return [curve.rows(number, np.arange(size), np.zeros(size)) for number, size in enumerate(sizes) if size]


def spread_rows(curve: Curve) -> list[Rows]:
    """Return a few rows at Chebyshev points of every wall that the curve comes near to and moves along or against."""
    near = [_near(excess) for excess in curve.excess]
    count = min(max(BUDGET // max(sum(len(index) for index in near), 1), FEWEST), MOST)
    s = 0.5 - 0.5 * np.cos(np.pi * (np.arange(count) + 0.5) / count)
    return [
        curve.rows(number, np.repeat(index, count), np.tile(s, len(index)))
        for number, index in enumerate(near)
        if len(index)
    ]


def _near(excess: FloatArray) -> IntArray:
    """Which of the polynomials (m, n + 1) are not constant and rise above minus ``WITHIN``."""
    highest, lowest = excess.max(axis=1), excess.min(axis=1)
    return np.flatnonzero((highest > -WITHIN) & (highest > lowest))


def sticking_out(
    curve: Curve, floor: float, exact: bool = False, contacts: Contacts | None = None
) -> tuple[list[Rows], float]:
    """Rows where a curve is more than ``floor`` widths out of a wall, and the largest such excess.

    With ``contacts``, there are also rows where contacts are expected.  With ``floor`` zero and ``exact``, finding none
    is a proof that the curve is inside at every instant.
    """
    found = [peaks(values, floor) for values in curve.excess]
    if exact and floor == 0.0 and not any(len(row) for row, _, _ in found):
        found = [_exact_peaks(values) for values in curve.excess]
    rows = []
    for number, (row, s, _) in enumerate(found):
        if contacts is not None and len(row):
            index, where = contacts.expected(curve.compiled.first[number] + row, s)
            row, s = np.concatenate((row, row[index])), np.concatenate((s, where))
        if len(row):
            rows.append(curve.rows(number, row, s))
        block = curve.compiled.blocks[number]
        if contacts is not None and len(row) and isinstance(block, KnotBalls):
            rows.append(_pressed(block, int(curve.compiled.first[number]), row, contacts))
    return rows, max((float(value.max(initial=0.0)) for _, _, value in found), default=0.0)


def _pressed(balls: KnotBalls, first: int, row: IntArray, contacts: Contacts) -> Rows:
    """Tangent planes of balls where their present rows press together: where the contact is if the force stays."""
    force = contacts.forces(first + row)
    pressed = force.any(axis=1)
    row = row[pressed]
    normal, bound = balls.cuts(row, force[pressed] - balls.offset[row])
    return Rows(first + row, balls.piece[row], balls.s[row], np.zeros(len(row), dtype=np.intp), normal, bound)


def _exact_peaks(values: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Where polynomials (m, n + 1) are positive: proof that none is, or the highest place of each that is."""
    may = np.flatnonzero(values.max(axis=1) > 0.0)
    if not len(may):
        return may, np.zeros(0), np.zeros(0)
    found = maxima(values[may])
    out = found.values > 0.0
    return may[out], found.where[out], found.values[out]

"""Rows of the QP: where the curve violates its walls, and the same rows in the unknowns."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.tolerances import ROUNDING
from minsnap.corridors.constraint import Walls
from minsnap.optimisation.linear_rows import rows_on_pieces
from minsnap.optimisation.normalised_constraints import WallRows
from minsnap.optimisation.reduced_qp import ReducedProblem
from minsnap.optimisation.task_walls import AllWalls
from minsnap.polynomials.bernstein import basis, differentiate
from minsnap.polynomials.extrema import maxima, peaks


@dataclass(frozen=True, eq=False)
class RowSet:
    """Rows of the QP in its unknowns.

    Parameters
    ----------
    source : WallRows
        Where they come from.
    matrix : csr_matrix, shape (r, size)
    bound : ndarray, shape (r,)
        For deviations from the base.
    width : ndarray, shape (r,)
        Width of each row's wall, or less: its distance from the straight leg there, which stays inside when walls move.
    """

    source: WallRows
    matrix: Any
    bound: FloatArray
    width: FloatArray

    def __len__(self) -> int:
        return len(self.bound)

    def joined(self, other: RowSet) -> RowSet:
        """Return these rows and the other ones."""
        from scipy.sparse import vstack

        bound, width = (np.concatenate((getattr(self, n), getattr(other, n))) for n in ("bound", "width"))
        return RowSet(self.source.joined(other.source), vstack((self.matrix, other.matrix), "csr"), bound, width)


def rows_in_unknowns(problem: ReducedProblem, ends: FloatArray, compiled: AllWalls, rows: WallRows) -> RowSet:
    """Express rows in the deviations from a base with these plain end derivatives (pieces, 2k, dim)."""
    factors, widths = _factors(problem, rows), compiled.width[rows.wall]
    present = np.einsum("rd,rj,rjd->r", rows.normal, factors, ends[rows.piece])
    width = np.where(rows.order == 0, np.minimum(widths, _room(problem, rows, factors, widths)), widths)
    matrix = rows_on_pieces(problem, rows.piece, factors, rows.normal)
    return RowSet(rows, matrix, rows.bound - present, width)


def _room(problem: ReducedProblem, rows: WallRows, factors: FloatArray, widths: FloatArray) -> FloatArray:
    """Distance of each row's wall from a curve that stays inside, (r,), normalised.

    That curve is stop-and-go; where the whole leg lies on the wall, it is one that leaves the wall between the knots.
    """
    step = (problem.steps[rows.piece] * rows.normal).sum(axis=1)
    room = np.maximum(rows.bound - factors[:, problem.half] * step, 0.0)
    flat = np.maximum(rows.bound, rows.bound - step) <= ROUNDING**0.5 * widths
    return np.asarray(np.where(flat, np.maximum(room, widths * (rows.s * (1.0 - rows.s)) ** 2), room))


def _factors(problem: ReducedProblem, rows: WallRows) -> FloatArray:
    """Factors of the end derivatives of each row's piece, (r, 2k)."""
    factors = np.empty((len(rows.s), 2 * problem.half))
    for order in np.unique(rows.order):
        chosen = rows.order == order
        factors[chosen] = problem.row_factors(rows.piece[chosen], rows.s[chosen], int(order))
    return factors


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve and its excess over the walls.

    Parameters
    ----------
    problem : ReducedProblem
    compiled : AllWalls
    knots : ndarray, shape (knots, slots, dim)
    """

    problem: ReducedProblem
    compiled: AllWalls
    knots: FloatArray

    @cached_property
    def points(self) -> FloatArray:
        """Control points relative to the nominal start of each piece: (pieces, 2k, dim)."""
        return self.problem.relative_points(self.knots)

    @cached_property
    def excess(self) -> list[FloatArray]:
        """Control points of the excess over every wall, block by block."""
        return [block.excess_along(self._bounded(block)) for block in self.compiled.blocks]

    def _bounded(self, walls: Walls) -> FloatArray:
        """Control points of what each wall bounds: on its piece (m, n, dim), or the value at one end (m, 1, dim)."""
        points = differentiate(self.points[walls.leg], walls.order)
        points = points / self.problem.durations[walls.leg, None, None] ** walls.order
        return points if walls.at is None else points[np.arange(len(walls.at)), -walls.at][:, None]

    def rows(self, block: int, index: IntArray, s: FloatArray) -> WallRows:
        """Rows for some walls of a block, each at its own s."""
        walls = self.compiled.blocks[block].chosen(index)
        points = self._bounded(walls)
        s = s if walls.at is None else walls.at.astype(np.float64)
        value = np.einsum("rj,rjd->rd", basis(points.shape[1] - 1, s), points)
        return self.of(block, index, s, walls.tangents_at(value))

    def of(self, block: int, index: IntArray, s: FloatArray, planes: tuple[FloatArray, FloatArray]) -> WallRows:
        """Return the rows of planes at places of walls."""
        walls = self.compiled.blocks[block]
        return WallRows(self.compiled.first[block] + index, walls.leg[index], s, np.full(len(s), walls.order), *planes)


def momentary_rows(curve: Curve) -> list[WallRows]:
    """Rows of all planes that hold at one instant only; without them free knots would be unbounded."""
    rows = []
    for number, block in enumerate(curve.compiled.blocks):
        if block.at is not None and block.flat:
            rows.append(curve.rows(number, np.arange(len(block.at)), block.at.astype(np.float64)))
    return rows


def sampled_rows(curve: Curve, s: FloatArray) -> list[WallRows]:
    """Rows of every wall at places (m,) of its piece, or at its knot."""
    return [curve.rows(number, index, places) for number, index, places in _at_places(curve, s)]


def all_walls_rows(curve: Curve) -> list[WallRows]:
    """Rows of every wall: at its knot, or at as many Chebyshev points as a piece has control points.

    Balls and cones have the tangent planes of both directions of every row of their matrix there.
    """
    count = curve.problem.degree + 1
    rows = []
    for number, index, places in _at_places(curve, 0.5 - 0.5 * np.cos(np.pi * (np.arange(count) + 0.5) / count)):
        walls = curve.compiled.blocks[number].chosen(index)
        along = np.eye(walls.matrix.shape[1])
        for direction in np.vstack((along, -along)) if len(along) else np.zeros((1, 0)):
            planes = walls.tangents(np.broadcast_to(direction, (len(index), len(along))))
            rows.append(curve.of(number, index, places, planes))
    return rows


def _at_places(curve: Curve, s: FloatArray) -> Iterator[tuple[int, IntArray, FloatArray]]:
    """Yield the number of each block, walls of it, and where each has a row."""
    for number, block in enumerate(curve.compiled.blocks):
        walls = np.arange(len(block.leg))
        if block.at is None:
            yield number, np.repeat(walls, len(s)), np.tile(s, len(walls))
        else:
            yield number, walls, block.at.astype(np.float64)


def rows_outside(curve: Curve, floor: float = 0.0) -> tuple[list[WallRows], float]:
    """Rows at the local maxima of a curve's excess over its walls, and the largest excess, in widths.

    Parameters
    ----------
    floor : float
        Excess, in widths, up to which there is no row.
    """
    outside, largest = [], 0.0
    for number, values in enumerate(curve.excess):
        row, s, value = peaks(values, floor)
        if len(row):
            largest = max(largest, float(value.max()))
            outside.append(curve.rows(number, row, s))
    return outside, largest


def proved_rows(curve: Curve) -> list[WallRows]:
    """Rows where exact extrema find a curve outside its walls; none is a proof that it is inside."""
    failed = []
    for number, values in enumerate(curve.excess):
        row = np.flatnonzero(values.max(axis=1) > 0.0)
        if len(row):
            exact = maxima(values[row])
            out = exact.values > 0.0
            failed.append(curve.rows(number, row[out], exact.where[out]))
    return [rows for rows in failed if len(rows.s)]

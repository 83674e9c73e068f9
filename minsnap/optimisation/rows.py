"""Rows of the QP: where the curve violates its walls, and the same rows in the unknowns."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.basics.tolerances import ROUNDING
from minsnap.corridors.constraint import Walls
from minsnap.optimisation.normalised_constraints import Compiled, WallRows
from minsnap.optimisation.reduced_qp import ReducedProblem
from minsnap.polynomials.extrema import maxima, peaks


@dataclass(frozen=True, eq=False)
class RowSet:
    """Rows of the QP in its unknowns.

    Parameters
    ----------
    source : WallRows
        Where they come from.
    columns : ndarray of int, shape (r, dim * 2k)
        Unknowns that entry (r, j) of ``values`` multiplies; -1 for none.
    values : ndarray, shape (r, dim * 2k)
    bound : ndarray, shape (r,)
        For deviations from the base.
    width : ndarray, shape (r,)
        Width of each row's wall, or less: its distance from the straight leg there, which stays inside when walls move.
    """

    source: WallRows
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


def rows_in_unknowns(problem: ReducedProblem, ends: FloatArray, compiled: Compiled, rows: WallRows) -> RowSet:
    """Express rows in the deviations from a base with these plain end derivatives (pieces, 2k, dim)."""
    factors, widths = _factors(problem, rows), compiled.widths[rows.wall]
    values = rows.normal[:, :, None] * factors[:, None, :]
    present = np.einsum("rdj,rjd->r", values, ends[rows.piece])
    flat = (len(factors), problem.dim * 2 * problem.half)
    columns = problem.piece_columns[rows.piece].reshape(flat)
    width = np.where(rows.order == 0, np.minimum(widths, _room(problem, rows, factors, widths)), widths)
    return RowSet(rows, columns, values.reshape(flat), rows.bound - present, width)


def _room(problem: ReducedProblem, rows: WallRows, factors: FloatArray, widths: FloatArray) -> FloatArray:
    """Distance of each row's wall from a curve that stays inside, (r,), normalised.

    That curve is stop-and-go; where the whole leg lies on the wall, it is one that leaves the wall between the knots,
    at each as slowly as the derivatives pinned there demand.
    """
    step = (problem.steps[rows.piece] * rows.normal).sum(axis=1)
    room = np.maximum(rows.bound - factors[:, problem.half] * step, 0.0)
    flat = np.flatnonzero(np.maximum(rows.bound, rows.bound - step) <= ROUNDING**0.5 * widths)
    if len(flat):
        piece, s, normal = rows.piece[flat], rows.s[flat], rows.normal[flat]
        leaving = _first_free(problem.free[piece][:, problem.slots.start], normal)
        meeting = _first_free(problem.free[piece + 1][:, problem.slots.end], normal)
        room[flat] = np.maximum(room[flat], widths[flat] * s**leaving * (1.0 - s) ** meeting)
    return np.asarray(room)


def _first_free(free: BoolArray, normal: FloatArray) -> IntArray:
    """Least order above 1 of a derivative with a free component along a normal; free (r, k, dim), k where none is."""
    along = (free & (normal != 0.0)[:, None]).any(axis=2)
    along[:, :2] = False
    return np.asarray(np.where(along.any(axis=1), along.argmax(axis=1), free.shape[1]), dtype=np.intp)


def _factors(problem: ReducedProblem, rows: WallRows) -> FloatArray:
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
    """A curve and its excess over the walls.

    Parameters
    ----------
    problem : ReducedProblem
    compiled : Compiled
    knots : ndarray, shape (knots, slots, dim)
    """

    problem: ReducedProblem
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

    def rows(self, block: int, index: IntArray, s: FloatArray) -> WallRows:
        """Rows for some walls of a block, each at its own s."""
        return self.compiled.rows(self.problem, self.points, block, index, s)


def momentary_rows(curve: Curve) -> list[WallRows]:
    """Rows of all planes that hold at one instant only; without them free knots would be unbounded."""
    rows = []
    for number, block in enumerate(curve.compiled.blocks):
        if block.at is not None and block.flat:
            rows.append(curve.rows(number, np.arange(len(block.at)), block.at.astype(np.float64)))
    return rows


def all_walls_rows(curve: Curve) -> list[WallRows]:
    """Rows of every wall: at its knot, or at as many Chebyshev points as a piece has control points.

    Balls and cones have the tangent planes of both directions of every row of their matrix there.
    """
    count = curve.problem.degree + 1
    s = 0.5 - 0.5 * np.cos(np.pi * (np.arange(count) + 0.5) / count)
    rows = []
    for number, block in enumerate(curve.compiled.blocks):
        walls = np.arange(len(block.leg))
        if block.at is None:
            index, places = np.repeat(walls, count), np.tile(s, len(walls))
        else:
            index, places = walls, block.at.astype(np.float64)
        rows += _both_directions(curve, number, index, places)
    return rows


def _both_directions(curve: Curve, number: int, index: IntArray, s: FloatArray) -> list[WallRows]:
    walls, numbers = curve.compiled.blocks[number].chosen(index), curve.compiled.first[number] + index
    along = np.eye(walls.matrix.shape[1])
    directions = np.vstack((along, -along)) if len(along) else np.zeros((1, 0))
    every = (np.broadcast_to(direction, (len(s), len(along))) for direction in directions)
    return [WallRows.of(walls, numbers, s, walls.tangents(direction)) for direction in every]


def rows_outside(
    curve: Curve, rows: RowSet | None, multipliers: FloatArray, floor: float = 0.0
) -> tuple[list[WallRows], float]:
    """Rows at the local maxima of a curve's excess over its walls, and the largest excess, in widths.

    Parameters
    ----------
    rows : RowSet or None
        Rows so far.
    multipliers : ndarray, shape (r,)
        Of the first r of them.
    floor : float
        Excess, in widths, up to which there is no row.
    """
    outside, largest = [], 0.0
    for number, values in enumerate(curve.excess):
        row, s, value = peaks(values, floor)
        if not len(row):
            continue
        largest = max(largest, float(value.max()))
        outside.append(curve.rows(number, row, s))
        block = curve.compiled.blocks[number]
        if not block.flat and block.at is not None and rows is not None:
            outside.append(_pressed(block, row, outside[-1], rows.source, multipliers))
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


def _pressed(balls: Walls, row: IntArray, tangents: WallRows, rows: WallRows, multipliers: FloatArray) -> WallRows:
    """Tangent planes of balls at knots in the direction of the total force of their rows, where contact is expected."""
    force = _forces(tangents.wall, rows, multipliers)
    pressed = np.flatnonzero(force.any(axis=1))
    chosen = balls.chosen(row[pressed])
    normal, bound = chosen.tangents_at(chosen.anchor + force[pressed])
    return replace(tangents.chosen(pressed), normal=normal, bound=bound)


def _forces(wall: IntArray, rows: WallRows, multipliers: FloatArray) -> FloatArray:
    """Sum of multiplier times normal of the rows of some walls, in ascending order: (m, dim)."""
    known = len(multipliers)
    pressing = np.isin(rows.wall[:known], wall)
    place = np.searchsorted(wall, rows.wall[:known][pressing])
    forces = np.zeros((len(wall), rows.normal.shape[1]))
    np.add.at(forces, place, multipliers[pressing, None] * rows.normal[:known][pressing])
    return forces

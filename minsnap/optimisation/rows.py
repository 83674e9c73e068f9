"""Rows of the QP: where the curve violates its walls, and the planes of the walls there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.cached import cached_property
from minsnap.basics.tolerances import ROUNDING
from minsnap.corridors.constraint import Walls
from minsnap.optimisation.linear_rows import rows_on_pieces
from minsnap.optimisation.reduced_qp import ReducedProblem
from minsnap.optimisation.task_walls import AllWalls
from minsnap.polynomials.bernstein import basis, differentiate
from minsnap.polynomials.extrema import maxima, peaks


class Places(NamedTuple):
    """Places of some walls of one block.

    Parameters
    ----------
    block : int
    wall : ndarray of int, shape (r,)
        Walls in the block.
    s : ndarray, shape (r,)
        Where on the piece of each; not read of walls that hold at one end.
    direction : ndarray, shape (q,), or None
        In which round walls have their planes; None for that of the curve there.
    """

    block: int
    wall: IntArray
    s: FloatArray
    direction: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of the QP in its unknowns: planes normal . r^(order)(s) <= bound, one of each wall at an instant.

    Parameters
    ----------
    wall : ndarray of int, shape (r,)
        Counted over all blocks.
    s : ndarray, shape (r,)
        Where on its piece.
    normal : ndarray, shape (r, dim)
    matrix : csr_matrix, shape (r, size)
    bound : ndarray, shape (r,)
        For deviations from the base.
    width : ndarray, shape (r,)
        Width of each row's wall, or less: its distance from the straight leg there, which stays inside when walls move.
    """

    wall: IntArray
    s: FloatArray
    normal: FloatArray
    matrix: Any
    bound: FloatArray
    width: FloatArray

    def __len__(self) -> int:
        return len(self.bound)

    def joined(self, other: Rows) -> Rows:
        """Return these rows and the other ones."""
        from scipy.sparse import vstack

        names = ("wall", "s", "normal", "bound", "width")
        both = {name: np.concatenate((getattr(self, name), getattr(other, name))) for name in names}
        return Rows(**both, matrix=vstack((self.matrix, other.matrix), "csr"))


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve and its excess over the walls.

    Parameters
    ----------
    problem : ReducedProblem
    walls : AllWalls
        In the units of the problem.
    knots : ndarray, shape (knots, slots, dim)
    """

    problem: ReducedProblem
    walls: AllWalls
    knots: FloatArray

    @cached_property
    def points(self) -> FloatArray:
        """Control points relative to the nominal start of each piece: (pieces, 2k, dim)."""
        return self.problem.relative_points(self.knots)

    @cached_property
    def excess(self) -> list[FloatArray]:
        """Control points of the excess over every wall, block by block."""
        return [block.excess_along(self._bounded(block)) for block in self.walls.blocks]

    def _bounded(self, walls: Walls) -> FloatArray:
        """Control points of what each wall bounds: on its piece (m, n, dim), or the value at one end (m, 1, dim)."""
        points = differentiate(self.points[walls.leg], walls.order)
        points = points / self.problem.durations[walls.leg, None, None] ** walls.order
        return points if walls.at is None else points[np.arange(len(walls.at)), -walls.at][:, None]

    def rows(self, places: Sequence[Places], ends: FloatArray, moved: FloatArray | None = None) -> Rows:
        """Return the rows of walls at places.

        Parameters
        ----------
        places : sequence of Places
            At least one.
        ends : ndarray, shape (pieces, 2k, dim)
            Plain end derivatives of the base.
        moved : ndarray, shape (walls,), optional
            How far inwards each wall is moved.
        """
        wall, s, normal, bound = map(np.concatenate, zip(*map(self._planes, places), strict=True))
        bound = bound if moved is None else bound - moved[wall]
        piece, order, width = self.walls.piece[wall], self.walls.order[wall], self.walls.width[wall]
        factors = np.empty((len(s), 2 * self.problem.half))
        for one in np.unique(order):
            chosen = order == one
            factors[chosen] = self.problem.row_factors(piece[chosen], s[chosen], int(one))
        step = (self.problem.steps[piece] * normal).sum(axis=1)
        room = _room(bound, step, factors[:, self.problem.half], s, width)
        width = np.where(order == 0, np.minimum(width, room), width)
        present = np.einsum("rd,rj,rjd->r", normal, factors, ends[piece])
        return Rows(wall, s, normal, rows_on_pieces(self.problem, piece, factors, normal), bound - present, width)

    def _planes(self, places: Places) -> tuple[IntArray, FloatArray, FloatArray, FloatArray]:
        """Return the walls at places, where on their pieces, and their planes: normals (r, dim) and bounds (r,)."""
        number, index, s, direction = places
        walls = self.walls.blocks[number].chosen(index)
        s = s if walls.at is None else walls.at.astype(np.float64)
        if direction is None:
            points = self._bounded(walls)
            planes = walls.tangents_at(np.einsum("rj,rjd->rd", basis(points.shape[1] - 1, s), points))
        else:
            planes = walls.tangents(np.broadcast_to(direction, (len(index), len(direction))))
        return self.walls.first[number] + index, s, *planes


def _room(bound: FloatArray, step: FloatArray, passed: FloatArray, s: FloatArray, width: FloatArray) -> FloatArray:
    """Distance of each row's wall from a curve that stays inside, (r,), normalised.

    That curve is stop-and-go; where the whole leg lies on the wall, it is one that leaves the wall between the knots.

    Parameters
    ----------
    step : ndarray, shape (r,)
        Of the leg along the normal.
    passed : ndarray, shape (r,)
        Share of it that stop-and-go has passed.
    """
    room = np.maximum(bound - passed * step, 0.0)
    flat = np.maximum(bound, bound - step) <= ROUNDING**0.5 * width
    return np.asarray(np.where(flat, np.maximum(room, width * (s * (1.0 - s)) ** 2), room))


def momentary(walls: AllWalls) -> list[Places]:
    """Places of all planes that hold at one instant only; without them free knots would be unbounded."""
    return [one for one in sampled(walls, np.zeros(0)) if len(one.wall) and walls.blocks[one.block].flat]


def sampled(walls: AllWalls, s: FloatArray) -> list[Places]:
    """Every wall at places (m,) of its piece, or at its knot."""
    every = []
    for number, block in enumerate(walls.blocks):
        places = s if block.at is None else np.zeros(1)
        index = np.arange(len(block.leg))
        every.append(Places(number, np.repeat(index, len(places)), np.tile(places, len(index))))
    return every


def everywhere(walls: AllWalls, count: int) -> list[Places]:
    """Every wall at its knot, or at so many Chebyshev points of its piece.

    Balls and cones are there with the planes of both directions of every row of their matrix.
    """
    every = []
    for places in sampled(walls, 0.5 - 0.5 * np.cos(np.pi * (np.arange(count) + 0.5) / count)):
        along = np.eye(walls.blocks[places.block].matrix.shape[1])
        directions = np.vstack((along, -along)) if len(along) else np.zeros((1, 0))
        every += [places._replace(direction=direction) for direction in directions]
    return every


def outside(curve: Curve, floor: float = 0.0) -> tuple[list[Places], float]:
    """Places of the local maxima of a curve's excess over its walls, and the largest excess, in widths.

    Parameters
    ----------
    floor : float
        Excess, in widths, up to which a place does not count.
    """
    places, largest = [], 0.0
    for number, values in enumerate(curve.excess):
        row, s, value = peaks(values, floor)
        if len(row):
            largest = max(largest, float(value.max()))
            places.append(Places(number, row, s))
    return places, largest


def proved_outside(curve: Curve) -> list[Places]:
    """Places where exact extrema find a curve outside its walls; none is a proof that it is inside."""
    places = []
    for number, values in enumerate(curve.excess):
        row = np.flatnonzero(values.max(axis=1) > 0.0)
        if len(row):
            exact = maxima(values[row])
            out = exact.values > 0.0
            places.append(Places(number, row[out], exact.where[out]))
    return [one for one in places if len(one.wall)]

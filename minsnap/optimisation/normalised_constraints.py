"""All constraints of a problem as one list of one-sided excesses, in normalised units, per piece."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.tolerances import ROUNDING
from minsnap.corridors.constraint import Walls
from minsnap.optimisation.constraint_blocks import Block, FlatWalls, Spheres
from minsnap.optimisation.knot_walls import ends_of_pieces, knot_walls
from minsnap.optimisation.problem import Task
from minsnap.optimisation.reduced_qp import Problem
from minsnap.optimisation.touches import Side
from minsnap.optimisation.units import Units
from minsnap.polynomials.bernstein import basis, differentiate


@dataclass(frozen=True, eq=False)
class WallRows:
    """Rows of the QP, not yet in its unknowns: normal . r^(order)(s) <= bound on a piece, relative to its start.

    Parameters
    ----------
    wall : ndarray of int, shape (r,)
        Which one-sided wall each belongs to, counted over all blocks.
    piece : ndarray of int, shape (r,)
    s : ndarray, shape (r,)
    order : ndarray of int, shape (r,)
    normal : ndarray, shape (r, dim)
    bound : ndarray, shape (r,)
    """

    wall: IntArray
    piece: IntArray
    s: FloatArray
    order: IntArray
    normal: FloatArray
    bound: FloatArray

    def chosen(self, index: npt.NDArray[Any]) -> WallRows:
        """Return some of the rows, by indices or a mask."""
        return WallRows(*(getattr(self, name)[index] for name in WallRows.__annotations__))

    def joined(self, other: WallRows) -> WallRows:
        """Return these rows and the other ones."""
        return WallRows(
            *(np.concatenate((getattr(self, name), getattr(other, name))) for name in WallRows.__annotations__)
        )


@dataclass(frozen=True, eq=False)
class Compiled:
    """All walls of a problem.

    Parameters
    ----------
    blocks : tuple of Block
        In the order of the walls they came from.
    first : ndarray of int
        Where each block's walls begin in the common count.
    """

    blocks: tuple[Block, ...]
    first: IntArray

    @cached_property
    def widths(self) -> FloatArray:
        """Widths of all walls, in their common numbering."""
        return np.concatenate([block.width for block in self.blocks]) if self.blocks else np.zeros(0)

    @cached_property
    def momentary(self) -> npt.NDArray[np.bool_]:
        """Which walls hold at one instant only, in their common numbering."""
        parts = [np.full(len(block.piece), block.s is not None) for block in self.blocks]
        return np.concatenate([np.zeros(0, dtype=bool), *parts])

    def excess(self, problem: Problem, points: FloatArray) -> list[FloatArray]:
        """Control points of the excess over every wall, block by block."""
        by_order = {0: points}
        for order in {block.order for block in self.blocks} - {0}:
            by_order[order] = differentiate(points, order) / problem.durations[:, None, None] ** order
        return [block.excess(by_order[block.order]) for block in self.blocks]

    def relaxed(self, amounts: FloatArray) -> Compiled:
        """Return the same walls, each moved outwards by so many of its widths."""
        parts = np.split(amounts, self.first[1:-1])
        return replace(self, blocks=tuple(b.moved(part * b.width) for b, part in zip(self.blocks, parts, strict=True)))

    def rows(self, problem: Problem, points: FloatArray, block: int, index: IntArray, s: FloatArray) -> WallRows:
        """Rows for some walls of a block, each at its own s."""
        chosen = self.blocks[block]
        piece = chosen.piece[index]
        s = s if chosen.s is None else chosen.s[index]
        value = points[piece, 0]
        if isinstance(chosen, Spheres):
            local = differentiate(points[piece], chosen.order)
            value = np.einsum("rj,rjd->rd", basis(local.shape[1] - 1, s), local)
            value /= problem.durations[piece, None] ** chosen.order
        normal, bound = chosen.cuts(index, value)
        return WallRows(self.first[block] + index, piece, s, np.full(len(s), chosen.order), normal, bound)


def compile_walls(task: Task, problem: Problem, units: Units) -> Compiled:
    """Convert a task's walls and the bounds of its waypoints to a problem's units, pieces and origins."""
    blocks = [_on_pieces(walls, problem, units, task.pieces) for walls in task.walls]
    blocks += [_at_knots(walls, task, problem) for walls in knot_walls(task)]
    blocks += _touching(task)
    sizes = [len(block.piece) for block in blocks]
    return Compiled(tuple(blocks), np.concatenate(([0], np.cumsum(sizes))).astype(np.intp))


def _on_pieces(cones: Walls, problem: Problem, units: Units, pieces: int) -> Block:
    """Walls of legs on all their pieces; a plane that a nominal knot lies on, but for rounding, goes through it."""
    row, piece = cones.on_pieces(pieces)
    unit, anchor = units.of_order(cones.order), cones.anchor[row]
    origin = problem.nominal[piece] - (anchor - units.origin) / unit if cones.order == 0 else -anchor / unit
    block = _block(cones, row, piece, origin, unit)
    if cones.order or isinstance(block, Spheres):
        return block
    farther = np.maximum((problem.steps[piece] * block.normal).sum(axis=1), 0.0)
    return replace(block, bound=np.where(np.abs(block.bound - farther) <= ROUNDING * block.width, farther, block.bound))


def _at_knots(cones: Walls, task: Task, problem: Problem) -> Block:
    """Walls of waypoints where these begin or end a piece; those of derivatives go through zero, in normal units."""
    piece, end = ends_of_pieces(task, cones.leg)
    origin = np.where((end == 1)[:, None] & (cones.order == 0), -problem.steps[piece], 0.0)
    unit = 1.0 if cones.order else task.length
    return _block(cones, np.arange(len(piece)), piece, origin, unit, end.astype(np.float64))


def _block(
    cones: Walls, row: IntArray, piece: IntArray, origin: FloatArray, unit: float, s: FloatArray | None = None
) -> Block:
    """Wall ``row[i]`` on piece ``piece[i]``, whose control points are relative to ``origin[i]`` from its anchor."""
    slope, width = cones.slope[row], cones.width[row] / unit
    radius = cones.radius[row] / unit + (slope * origin).sum(axis=1)
    if cones.flat:
        return FlatWalls(cones.order, piece, -slope, radius, width, s)
    matrix = cones.matrix[row]
    return Spheres(cones.order, piece, matrix, np.einsum("rqd,rd->rq", matrix, origin), radius, slope, width, s)


def _touching(task: Task) -> list[Block]:
    """Return, for each touched wall, the bound of the first derivative that is not pinned; one block for each order."""
    found: dict[int, list[tuple[int, int, FloatArray]]] = {}
    for side, above, waypoint, axis in np.argwhere(task.touches).tolist():
        knot, end = waypoint * task.pieces, int(side == Side.BEFORE)
        if not 0 <= knot - end < task.legs * task.pieces:
            continue
        slots = task.slots.end if end else task.slots.start
        order = next((q for q in range(1, task.half) if task.free[knot, slots[q], axis]), task.half)
        outwards = (-1.0 if above else 1.0) * (-1.0) ** (order * end)
        found.setdefault(order, []).append((knot - end, end, outwards * np.eye(task.dim)[axis]))
    return [_derivative_bounds(rows, order) for order, rows in sorted(found.items())]


def _derivative_bounds(rows: list[tuple[int, int, FloatArray]], order: int) -> FlatWalls:
    piece, s, normal = (np.array(column) for column in zip(*rows, strict=True))
    return FlatWalls(order, piece, normal, np.zeros(len(rows)), np.ones(len(rows)), s.astype(np.float64))

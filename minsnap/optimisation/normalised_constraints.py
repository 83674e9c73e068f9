"""All constraints of a problem as one list of one-sided excesses, in normalised units, per piece."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.arrays import FloatArray, IntArray
from minsnap.corridors.constraint import Cones
from minsnap.optimisation.constraint_blocks import AT_KNOTS, Block, FlatWalls, KnotBalls, KnotBounds, Spheres
from minsnap.optimisation.knot_blocks import knot_places, region_blocks, touching_blocks
from minsnap.optimisation.problem import Task
from minsnap.optimisation.reduced_qp import Problem
from minsnap.optimisation.units import Units
from minsnap.polynomials.bernstein import basis, differentiate
from minsnap.tolerances import ROUNDING


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
        parts = [np.full(len(block.piece), isinstance(block, AT_KNOTS)) for block in self.blocks]
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
        if isinstance(chosen, (KnotBounds, KnotBalls)):
            s = chosen.s[index]
        value = points[piece, 0]
        if isinstance(chosen, Spheres):
            local = differentiate(points[piece], chosen.order)
            value = np.einsum("rj,rjd->rd", basis(local.shape[1] - 1, s), local)
            value /= problem.durations[piece, None] ** chosen.order
        normal, bound = chosen.cuts(index, value)
        return WallRows(self.first[block] + index, piece, s, np.full(len(s), chosen.order), normal, bound)


def compile_walls(task: Task, problem: Problem, units: Units) -> Compiled:
    """Convert a task's walls and the bounds of its waypoints to a problem's units, pieces and origins."""
    blocks: list[Block] = []
    for cones in (walls.cones for walls in task.walls):
        build: Callable[[Cones, Problem, Units, int], Block] = _planes if cones.flat else _spheres
        blocks.append(build(cones, problem, units, task.pieces))
    if problem.held.any():
        blocks.append(_knot_boxes(task, problem))
    blocks += [*region_blocks(task, problem), *touching_blocks(task)]
    sizes = [len(block.piece) for block in blocks]
    return Compiled(tuple(blocks), np.concatenate(([0], np.cumsum(sizes))).astype(np.intp))


def _repeat(leg: IntArray, pieces: int) -> tuple[IntArray, IntArray]:
    if pieces == 1:
        return np.arange(len(leg)), leg
    return np.repeat(np.arange(len(leg)), pieces), (leg[:, None] * pieces + np.arange(pieces)).reshape(-1)


def _planes(planes: Cones, problem: Problem, units: Units, pieces: int) -> FlatWalls:
    """Planes; one that a nominal knot lies on, but for rounding, goes exactly through it."""
    row, piece = _repeat(planes.leg, pieces)
    unit, normal = units.of_order(planes.order), -planes.slope[row]
    offset = np.einsum("rd,rd->r", normal, _reference(planes, problem, units, row, piece))
    bound, width = planes.radius[row] / unit - offset, planes.width[row] / unit
    if planes.order == 0:
        farther = np.maximum((problem.steps[piece] * normal).sum(axis=1), 0.0)
        bound = np.where(np.abs(bound - farther) <= ROUNDING * width, farther, bound)
    return FlatWalls(planes.order, piece, normal, bound, width)


def _spheres(balls: Cones, problem: Problem, units: Units, pieces: int) -> Spheres:
    row, piece = _repeat(balls.leg, pieces)
    matrix, reference, slope = balls.matrix[row], _reference(balls, problem, units, row, piece), balls.slope[row]
    unit = units.of_order(balls.order)
    offset = np.einsum("rqd,rd->rq", matrix, reference)
    radius = balls.radius[row] / unit + (slope * reference).sum(axis=1)
    return Spheres(balls.order, piece, matrix, offset, radius, slope, balls.width[row] / unit)


def _knot_boxes(task: Task, problem: Problem) -> KnotBounds:
    """Bounds on single coordinates of knots."""
    waypoint, axis = np.nonzero(task.upper > task.lower)
    if task.closed:
        waypoint, axis = waypoint[waypoint < task.legs], axis[waypoint < task.legs]
    piece, s, start = knot_places(task, problem, waypoint)
    offset = start[np.arange(len(axis)), axis]
    upper, lower = task.upper[waypoint, axis] / task.length, task.lower[waypoint, axis] / task.length
    normal = np.eye(task.dim)[axis]
    return KnotBounds(
        np.tile(piece, 2),
        np.tile(s, 2),
        np.concatenate((normal, -normal)),
        np.concatenate((upper + offset, -lower - offset)),
        np.tile((upper - lower) / 2.0, 2),
    )


def _reference(walls: Cones, problem: Problem, units: Units, row: IntArray, piece: IntArray) -> FloatArray:
    """Origin of a piece's relative control points, seen from the wall's anchor: (r, dim)."""
    if walls.order > 0:
        return -walls.anchor[row] / units.of_order(walls.order)
    return np.asarray(problem.nominal[piece] - (walls.anchor[row] - units.origin) / units.length)

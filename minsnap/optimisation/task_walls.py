"""The walls of a task on its pieces, with those of waypoints: boxes, gates, balls, directions of crossing.

Both cores read these, and so do proofs. Walls of waypoints hold at one end of a piece. The slanted planes of gates, on
which waypoints must lie, come last; the reference core has them in its own form, as equality rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.corridors.constraint import Walls
from minsnap.optimisation.task import Task


@dataclass(frozen=True, eq=False)
class AllWalls:
    """All walls of a task, in one count.

    Parameters
    ----------
    blocks : tuple of Walls
        ``leg`` is the piece.
    """

    blocks: tuple[Walls, ...]

    @cached_property
    def first(self) -> IntArray:
        """Where each block begins in the count, and the number of all walls."""
        return np.cumsum([0, *(len(block.leg) for block in self.blocks)], dtype=np.intp)

    def __len__(self) -> int:
        return int(self.first[-1])

    @cached_property
    def piece(self) -> IntArray:
        """Piece of each wall."""
        return np.concatenate([np.zeros(0, dtype=np.intp), *(block.leg for block in self.blocks)])

    @cached_property
    def width(self) -> FloatArray:
        """Width of each wall."""
        return np.concatenate([np.zeros(0), *(block.width for block in self.blocks)])

    @cached_property
    def radius(self) -> FloatArray:
        """Radius of each wall, of planes the bound at their anchor."""
        return np.concatenate([np.zeros(0), *(block.radius for block in self.blocks)])

    @cached_property
    def order(self) -> IntArray:
        """Order of the derivative that each wall bounds."""
        return self._of_each([block.order for block in self.blocks])

    @cached_property
    def equal(self) -> BoolArray:
        """Which are planes on which the curve lies."""
        return self._of_each([block.equal for block in self.blocks]).astype(bool)

    @cached_property
    def momentary(self) -> BoolArray:
        """Which hold at one end of their piece."""
        return self._of_each([block.at is not None for block in self.blocks]).astype(bool)

    def _of_each(self, values: Sequence[int]) -> IntArray:
        return np.repeat(np.array(values, dtype=np.intp), np.diff(self.first))

    def place(self, wall: int) -> tuple[Walls, int]:
        """Return the block of a wall, and its index there."""
        block = int(np.searchsorted(self.first, wall, side="right")) - 1
        return self.blocks[block], wall - int(self.first[block])

    def relaxed(self, amounts: FloatArray) -> AllWalls:
        """Return the same walls, each moved outwards by so many of its widths, (walls,)."""
        moved = amounts * self.width
        parts = zip(self.blocks, self.first, strict=False)
        return AllWalls(tuple(block.moved(moved[first : first + len(block.leg)]) for block, first in parts))


def all_walls(task: Task) -> AllWalls:
    """Return all walls of a task in metres, with pieces in the place of legs."""
    return AllWalls((*(_on_pieces(walls, task.pieces) for walls in task.walls), *_knot_walls(task)))


def _on_pieces(walls: Walls, pieces: int) -> Walls:
    if pieces == 1:
        return walls
    row, piece = walls.on_pieces(pieces)
    return replace(walls.chosen(row), leg=piece)


def _knot_walls(task: Task) -> list[Walls]:
    """Return the walls at waypoints that may vary, each on a piece that begins or ends there; planes of gates last."""
    if not task.held.any():
        return []
    at = task.own_regions
    sides = [k for k, region in at.items() for _ in region.bounds]
    normals = [normal for region in at.values() for normal in region.normals]
    bounds = np.array([bound for region in at.values() for bound in region.bounds])
    crossings = {k: -region.crossing for k, region in at.items() if region.crossing is not None}
    gates = {k: region.plane for k, region in at.items() if region.plane is not None}
    still, flat = np.zeros(len(crossings)), np.zeros(len(gates))
    result = [
        _boxes(task),
        _planes(task, sides, normals, bounds, bounds),
        _balls(task, {k: region.radius for k, region in at.items() if np.isfinite(region.radius)}),
        _planes(task, list(crossings), list(crossings.values()), still, still + 1.0, order=1),
        replace(_planes(task, list(gates), list(gates.values()), flat, flat + task.length), equal=True),
    ]
    return [_at_ends(task, walls) for walls in result if len(walls.leg)]


def _at_ends(task: Task, walls: Walls) -> Walls:
    """Return walls of waypoints as walls at the start of pieces, or at the end of the last one."""
    knot = walls.leg * task.pieces
    end = (knot == task.legs * task.pieces).astype(np.intp)
    return replace(walls, leg=knot - end, at=end)


def _boxes(task: Task) -> Walls:
    """Two planes for each coordinate that may vary within bounds, upper ones first."""
    waypoint, axis = np.nonzero(task.upper > task.lower)
    if task.closed:
        waypoint, axis = waypoint[waypoint < task.legs], axis[waypoint < task.legs]
    upper, lower = task.upper[waypoint, axis], task.lower[waypoint, axis]
    normal, width = np.eye(task.dim)[axis], np.tile((upper - lower) / 2.0, 2)
    return _planes(task, np.tile(waypoint, 2), np.vstack((normal, -normal)), np.concatenate((upper, -lower)), width)


def _balls(task: Task, radii: dict[int, float]) -> Walls:
    waypoint, radius = np.array(list(radii), dtype=np.intp), np.array(list(radii.values()))
    matrix, still = np.tile(np.eye(task.dim), (len(radius), 1, 1)), np.zeros((len(radius), task.dim))
    return Walls(waypoint, matrix, task.waypoints[waypoint], still, radius, radius, 0, "waypoint")


def _planes(
    task: Task,
    waypoint: Sequence[int] | IntArray,
    normal: Sequence[FloatArray] | FloatArray,
    bound: FloatArray,
    width: FloatArray,
    order: int = 0,
) -> Walls:
    """Planes on the offset from a waypoint, or on a derivative there."""
    at, normals = np.asarray(waypoint, dtype=np.intp), np.asarray(normal).reshape(-1, task.dim)
    anchor = np.zeros(normals.shape) if order else task.waypoints[at]
    return Walls(at, np.zeros((len(at), 0, task.dim)), anchor, -normals, bound, width, order, "waypoint")

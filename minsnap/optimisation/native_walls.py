"""The walls of a task as arrays of the native core."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.constraint import Walls
from minsnap.native.corridor import WallArrays
from minsnap.optimisation.knot_walls import ends_of_pieces, walls_on_pieces
from minsnap.optimisation.task import Task


def native_walls(task: Task) -> WallArrays:
    """Walls of a task in the order of ``compile_walls``, then slanted planes of gates, in which waypoints must lie."""
    blocks = [_arrays(walls) for walls in walls_on_pieces(task)]
    return _joined([*blocks, *_gate_planes(task)] or [_nothing(task.dim)])


def _arrays(walls: Walls) -> WallArrays:
    matrix, when = (None if walls.flat else _square(walls.matrix)), np.full(len(walls.leg), -1)
    known = np.full(len(walls.leg), walls.order), -walls.slope, walls.anchor, walls.radius, walls.width
    return WallArrays(walls.leg, *known, when if walls.at is None else walls.at, matrix=matrix)


def _nothing(dim: int) -> WallArrays:
    none, vectors = np.zeros(0), np.zeros((0, dim))
    return WallArrays(none.astype(np.int64), none.astype(np.int64), vectors, vectors, none, none)


def _square(matrices: FloatArray) -> FloatArray:
    """Matrices (m, q, dim) with rows of zeros up to (m, dim, dim)."""
    squared = np.zeros((len(matrices), matrices.shape[2], matrices.shape[2]))
    squared[:, : matrices.shape[1]] = matrices
    return squared


def _gate_planes(task: Task) -> list[WallArrays]:
    planes = {k: region.plane for k, region in task.own_regions.items() if region.plane is not None}
    if not planes:
        return []
    waypoint, normal = np.array(list(planes), dtype=np.intp), np.array(list(planes.values()))
    (piece, end), still = ends_of_pieces(task, waypoint), np.zeros(len(planes))
    return [WallArrays(piece, 0 * piece, normal, task.waypoints[waypoint], still, still + task.length, end + 2)]


def _joined(blocks: Sequence[WallArrays]) -> WallArrays:
    """Return all walls of some blocks, in their order."""
    if len(blocks) == 1 and blocks[0].matrix is None:
        return blocks[0]
    names = ("piece", "order", "normal", "anchor", "bound", "width", "when")
    walls = WallArrays(*(np.concatenate([getattr(block, name) for block in blocks]) for name in names))
    if all(block.matrix is None for block in blocks):
        return walls
    matrix = np.concatenate([block.matrix for block in blocks if block.matrix is not None])
    ball = np.concatenate([np.full(len(block.piece), -1 if block.matrix is None else 0) for block in blocks])
    ball[ball == 0] = np.arange(len(matrix))
    return replace(walls, ball=ball, matrix=matrix)

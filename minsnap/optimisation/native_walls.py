"""The walls of a task as arrays of the native core."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.corridors.constraint import Walls
from minsnap.native.corridor import WallArrays
from minsnap.optimisation.knot_walls import ends_of_pieces, knot_walls
from minsnap.optimisation.task import Task


def native_walls(task: Task) -> WallArrays:
    """Walls of a task in the order of ``compile_walls``, then slanted planes of gates, in which waypoints must lie."""
    blocks = [_arrays(walls, *walls.on_pieces(task.pieces)) for walls in task.walls]
    blocks += [_arrays(walls, np.arange(len(walls.leg)), walls.leg) for walls in knot_walls(task)]
    return _joined([*blocks, *_gate_planes(task)] or [_nothing(task.dim)])


def _arrays(walls: Walls, row: IntArray, piece: IntArray) -> WallArrays:
    """Wall ``row[i]`` on piece ``piece[i]``."""
    matrix = None if walls.flat else _square(walls.matrix)[row]
    when = np.full(len(row), -1) if walls.at is None else walls.at
    known = np.full(len(row), walls.order), -walls.slope[row], walls.anchor[row], walls.radius[row], walls.width[row]
    return WallArrays(piece, *known, when, matrix=matrix)


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

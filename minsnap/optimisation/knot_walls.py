"""The walls of a task on its pieces, with those of waypoints: boxes, gates, balls, directions of crossing.

Both cores read these. Walls of waypoints hold at one end of a piece. The slanted planes of gates are equality rows,
which each core has in its own form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.corridors.constraint import Walls
from minsnap.optimisation.task import Task


def walls_on_pieces(task: Task) -> list[Walls]:
    """Return all walls with pieces in the place of legs, those of waypoints last."""
    return [*(_on_pieces(walls, task.pieces) for walls in task.walls), *_knot_walls(task)]


def _on_pieces(walls: Walls, pieces: int) -> Walls:
    if pieces == 1:
        return walls
    row, piece = walls.on_pieces(pieces)
    shape = walls.matrix[row], walls.anchor[row], walls.slope[row], walls.radius[row], walls.width[row]
    return Walls(piece, *shape, walls.order, walls.name, None if walls.at is None else walls.at[row])


def _knot_walls(task: Task) -> list[Walls]:
    """Return the walls at waypoints that may vary, each on a piece that begins or ends there."""
    if not task.held.any():
        return []
    at = task.own_regions
    sides = [k for k, region in at.items() for _ in region.bounds]
    normals = [normal for region in at.values() for normal in region.normals]
    bounds = np.array([bound for region in at.values() for bound in region.bounds])
    crossings = {k: -region.crossing for k, region in at.items() if region.crossing is not None}
    still = np.zeros(len(crossings))
    result = [
        _boxes(task),
        _planes(task, sides, normals, bounds, bounds),
        _balls(task, {k: region.radius for k, region in at.items() if np.isfinite(region.radius)}),
        _planes(task, list(crossings), list(crossings.values()), still, still + 1.0, order=1),
    ]
    return [_at_ends(task, walls) for walls in result if len(walls.leg)]


def _at_ends(task: Task, walls: Walls) -> Walls:
    """Return walls of waypoints as walls at an end of pieces."""
    piece, end = ends_of_pieces(task, walls.leg)
    return replace(walls, leg=piece, at=end)


def ends_of_pieces(task: Task, waypoint: IntArray) -> tuple[IntArray, IntArray]:
    """Piece that each waypoint belongs to, and whether it is its end (1) or its start (0): (m,) and (m,)."""
    knot = waypoint * task.pieces
    end = (knot == task.legs * task.pieces).astype(np.intp)
    return knot - end, end


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

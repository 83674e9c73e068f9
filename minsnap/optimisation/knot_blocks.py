"""Constraints that hold at a knot only, in the units of a problem: balls, gates, and walls that a waypoint lies on."""

from __future__ import annotations

import numpy as np

from minsnap.arrays import FloatArray, IntArray
from minsnap.optimisation.constraint_blocks import Block, KnotBalls, KnotBounds
from minsnap.optimisation.problem import Task
from minsnap.optimisation.reduced_qp import Problem
from minsnap.optimisation.touches import Side


def knot_places(task: Task, problem: Problem, waypoint: IntArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Piece and s at which waypoints lie, and their nominal position from the piece's start: (m,), (m,), (m, dim)."""
    knot = waypoint * task.pieces
    s = (knot == len(problem.durations)).astype(np.float64)
    piece = np.where(s > 0.0, knot - 1, knot)
    return piece, s, np.where(s[:, None] > 0.0, problem.steps[piece], 0.0)


def region_blocks(task: Task, problem: Problem) -> list[Block]:
    """Return the sides of gates, the balls and the directions of crossing that are present."""
    blocks = (_sides(task, problem), _balls(task, problem), _crossings(task, problem))
    return [block for block in blocks if block is not None]


def _sides(task: Task, problem: Problem) -> KnotBounds | None:
    chosen = [k for k, region in task.own_regions.items() if len(region.bounds)]
    if not chosen:
        return None
    regions = [task.regions[k] for k in chosen]
    waypoint = np.repeat(chosen, [len(region.bounds) for region in regions]).astype(np.intp)
    normal = np.concatenate([region.normals for region in regions])
    bound = np.concatenate([region.bounds for region in regions]) / task.length
    piece, s, start = knot_places(task, problem, waypoint)
    return KnotBounds(piece, s, normal, bound + (normal * start).sum(axis=1), bound)


def _balls(task: Task, problem: Problem) -> KnotBalls | None:
    chosen = np.array([k for k, region in task.own_regions.items() if np.isfinite(region.radius)], dtype=np.intp)
    if not len(chosen):
        return None
    radius = np.array([task.regions[int(k)].radius for k in chosen]) / task.length
    piece, s, start = knot_places(task, problem, chosen)
    matrix = np.broadcast_to(np.eye(task.dim), (len(chosen), task.dim, task.dim))
    return KnotBalls(0, piece, matrix, -start, radius, np.zeros_like(start), radius, s)


def _crossings(task: Task, problem: Problem) -> KnotBounds | None:
    """Velocities that must not point backwards: -direction . v <= 0."""
    chosen = np.array([k for k, region in task.own_regions.items() if region.crossing is not None], dtype=np.intp)
    if not len(chosen):
        return None
    directions: FloatArray = np.array([task.regions[int(k)].crossing for k in chosen])
    piece, s, _ = knot_places(task, problem, chosen)
    return KnotBounds(piece, s, -directions, np.zeros(len(chosen)), np.ones(len(chosen)), 1)


def touching_blocks(task: Task) -> list[KnotBounds]:
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


def _derivative_bounds(rows: list[tuple[int, int, FloatArray]], order: int) -> KnotBounds:
    piece, s, normal = (np.array(column) for column in zip(*rows, strict=True))
    return KnotBounds(piece, s.astype(np.float64), normal, np.zeros(len(rows)), np.ones(len(rows)), order)

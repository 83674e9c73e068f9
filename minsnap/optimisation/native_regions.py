"""Waypoints in balls and gates as walls of the native core, and walls of several kinds as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from minsnap.arrays import FloatArray, IntArray
from minsnap.native.corridor import WallArrays
from minsnap.optimisation.problem import Task


def region_walls(task: Task) -> list[WallArrays]:
    """Sides of gates, balls, directions of crossing, as ``knot_blocks.region_blocks``; then slanted planes of gates."""
    at = task.own_regions
    if not at:
        return []
    sides = [k for k, region in at.items() if len(region.bounds)]
    balls = [k for k, region in at.items() if np.isfinite(region.radius)]
    crossings = [k for k, region in at.items() if region.crossing is not None]
    planes = [k for k, region in at.items() if region.plane is not None]
    waypoint = np.repeat(sides, [len(at[k].bounds) for k in sides]).astype(np.intp)
    bound = np.concatenate([np.zeros(0), *(at[k].bounds for k in sides)])
    normal = np.concatenate([np.zeros((0, task.dim)), *(at[k].normals for k in sides)])
    ways = np.array([at[k].crossing for k in crossings]).reshape(-1, task.dim)
    slanted = np.array([at[k].plane for k in planes]).reshape(-1, task.dim)
    found = [
        knot_planes(task, waypoint, normal, bound, bound),
        _balls(task, balls),
        knot_planes(task, crossings, -ways, np.zeros(len(ways)), np.ones(len(ways)), order=1),
        knot_planes(task, planes, slanted, np.zeros(len(slanted)), np.full(len(slanted), task.length), equal=True),
    ]
    return [walls for walls in found if len(walls.piece)]


def knot_planes(
    task: Task,
    waypoint: Sequence[int] | IntArray,
    normal: FloatArray,
    bound: FloatArray,
    width: FloatArray,
    order: int = 0,
    equal: bool = False,
) -> WallArrays:
    """Planes at waypoints (m,), their bounds (m,) measured from the nominal positions, or of a derivative from zero."""
    knot = np.asarray(waypoint, dtype=np.intp) * task.pieces
    when = last = (knot == task.legs * task.pieces).astype(np.intp)
    if equal:
        when = last + 2  # the curve lies on the plane there
    anchor = task.positions[knot] if order == 0 else np.zeros(normal.shape)
    return WallArrays(knot - last, np.full(len(knot), order), normal, anchor, bound, width, when)


def joined(blocks: Sequence[WallArrays]) -> WallArrays:
    """Return all walls of some blocks, in their order."""
    if len(blocks) == 1 and blocks[0].matrix is None:
        return blocks[0]
    names = ("piece", "order", "normal", "anchor", "bound", "width")
    piece, order, *parts = (np.concatenate([getattr(block, name) for block in blocks]) for name in names)
    normal, anchor, bound, width = parts
    when = ball = matrix = None
    if any(block.when is not None for block in blocks):
        when = np.concatenate([_or_none(block.when, len(block.piece)) for block in blocks])
    round_ones = [block.matrix for block in blocks if block.matrix is not None]
    if round_ones:
        matrix = np.concatenate(round_ones)
        ball = np.concatenate([np.full(len(block.piece), 0 if block.matrix is not None else -1) for block in blocks])
        ball[ball == 0] = np.arange(len(matrix))
    return WallArrays(piece, order, normal, anchor, bound, width, when, ball, matrix)


def _or_none(values: IntArray | None, count: int) -> IntArray:
    return np.full(count, -1) if values is None else values


def _balls(task: Task, waypoint: Sequence[int]) -> WallArrays:
    radius = np.array([task.regions[k].radius for k in waypoint])
    shape = (len(waypoint), task.dim)
    planes = knot_planes(task, waypoint, np.zeros(shape), radius, radius)
    return replace(planes, matrix=np.tile(np.eye(task.dim), (len(waypoint), 1, 1)))

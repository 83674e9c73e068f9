"""Boxes of free cells along a chain of them, by greedy inflation."""

from __future__ import annotations

import numpy as np

from minsnap.grid_path import BoolArray
from minsnap.walls import IntArray

CellBox = tuple[IntArray, IntArray]
"""Lower corner and upper corner (excluded), in cells."""


def inflated(free: BoolArray, cells: IntArray, limit: IntArray) -> list[CellBox]:
    """Return boxes of free cells, each grown from where a chain of cells (n, dim) leaves the one before."""
    boxes, index = [], 0
    while index < len(cells):
        seed = cells[max(index - 1, 0) : index + 1]
        low, high = _inflate(free, seed.min(axis=0), seed.max(axis=0) + 1, limit)
        boxes.append((low, high))
        outside = np.flatnonzero(((cells[index:] < low) | (cells[index:] >= high)).any(axis=1))
        index = index + int(outside[0]) if len(outside) else len(cells)
    return boxes


def _inflate(free: BoolArray, low: IntArray, high: IntArray, limit: IntArray) -> CellBox:
    """Add layers of free cells, one a side in turn, until no side can grow."""
    sides = [(axis, up) for axis in range(free.ndim) for up in (False, True)]
    while sides:
        sides = [
            (axis, up)
            for axis, up in sides
            if high[axis] - low[axis] < limit[axis] and _grow(free, low, high, axis, up)
        ]
    return low, high


def _grow(free: BoolArray, low: IntArray, high: IntArray, axis: int, up: bool) -> bool:
    """Move one side by a cell if the layer that is added is free, in place."""
    layer = [slice(a, b) for a, b in zip(low, high, strict=True)]
    at = int(high[axis]) if up else int(low[axis]) - 1
    if not 0 <= at < free.shape[axis]:
        return False
    layer[axis] = slice(at, at + 1)
    if not free[tuple(layer)].all():
        return False
    (high if up else low)[axis] += 1 if up else -1
    return True


def pruned(boxes: list[CellBox]) -> list[CellBox]:
    """Leave out boxes between two that overlap."""
    kept, index = [boxes[0]], 0
    while index < len(boxes) - 1:
        index = next(
            other
            for other in range(len(boxes) - 1, index, -1)
            if (np.maximum(boxes[index][0], boxes[other][0]) < np.minimum(boxes[index][1], boxes[other][1])).all()
        )
        kept.append(boxes[index])
    return kept

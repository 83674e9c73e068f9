"""Boxes of free cells along a chain of cells, by greedy inflation."""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import BoolArray, IntArray

CellBox = tuple[IntArray, IntArray]
"""Lower corner and upper corner (excluded), in cells."""


def inflated(free: BoolArray, cells: IntArray, limit: IntArray) -> list[CellBox]:
    """Return boxes of free cells, each grown from where a chain of cells (n, dim) leaves the previous box."""
    boxes, index = [], 0
    while index < len(cells):
        seed = cells[max(index - 1, 0) : index + 1]
        low, high = _inflate(free, seed.min(axis=0), seed.max(axis=0) + 1, limit)
        boxes.append((low, high))
        outside = np.flatnonzero(((cells[index:] < low) | (cells[index:] >= high)).any(axis=1))
        index = index + int(outside[0]) if len(outside) else len(cells)
    return boxes


def _inflate(free: BoolArray, low: IntArray, high: IntArray, limit: IntArray) -> CellBox:
    """Add layers of free cells, one per side in turn, until no side can grow."""
    sides = [(axis, up) for axis in range(free.ndim) for up in (False, True)]
    while sides:
        sides = [
            (axis, up)
            for axis, up in sides
            if high[axis] - low[axis] < limit[axis] and _grow(free, low, high, axis, up)
        ]
    return low, high


def _grow(free: BoolArray, low: IntArray, high: IntArray, axis: int, up: bool) -> bool:
    """Move one side by one cell if the added layer is free, in place."""
    layer = [slice(a, b) for a, b in zip(low, high, strict=True)]
    at = int(high[axis]) if up else int(low[axis]) - 1
    if not 0 <= at < free.shape[axis]:
        return False
    layer[axis] = slice(at, at + 1)
    if not free[tuple(layer)].all():
        return False
    (high if up else low)[axis] += 1 if up else -1
    return True


def pruned(boxes: list[CellBox], start: IntArray, end: IntArray) -> list[CellBox]:
    """Leave out boxes between two that overlap, those before the last one with ``start`` and after one with ``end``."""
    index = max(number for number, box in enumerate(boxes) if _holds(box, start))
    kept = [boxes[index]]
    while not _holds(kept[-1], end):
        index = max(number for number, box in enumerate(boxes) if _overlap(kept[-1], box))
        kept.append(boxes[index])
    return kept


def _holds(box: CellBox, cell: IntArray) -> bool:
    return bool(((box[0] <= cell) & (cell < box[1])).all())


def _overlap(box: CellBox, other: CellBox) -> bool:
    return bool((np.maximum(box[0], other[0]) < np.minimum(box[1], other[1])).all())

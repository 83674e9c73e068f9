"""The cells of a grid that a polyline visits, connected through faces."""

from __future__ import annotations

from itertools import permutations

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.basics.checks import point_text
from minsnap.basics.tolerances import EXACT
from minsnap.errors import CorridorError


def visited(shape: IntArray, points: FloatArray, size: FloatArray, corner: FloatArray) -> IntArray:
    """Return the cells that a polyline visits, in order: (n, dim).

    Raises
    ------
    CorridorError
        If a point is outside the grid.
    """
    scaled = (points - corner) / size
    outside = ((scaled < 0.0) | (scaled > shape)).any(axis=1)
    if outside.any():
        index = int(np.argmax(outside))
        raise CorridorError(
            f"point {index} of the path, {point_text(points[index])} m, is outside the grid, which reaches from "
            f"{point_text(corner)} to {point_text(corner + size * shape)} m: cut the path"
        )
    parts = [np.floor(scaled[:1])]
    for start, end in zip(scaled[:-1], scaled[1:], strict=True):
        parts.append(np.floor(_middles(start, end)))
    cells = np.minimum(np.concatenate([*parts, np.floor(scaled[-1:])]), shape - 1).astype(np.intp)
    return np.asarray(cells[np.concatenate(([True], (np.diff(cells, axis=0) != 0).any(axis=1)))])


def _middles(start: FloatArray, end: FloatArray) -> FloatArray:
    """Midpoints of the parts into which cell borders cut a segment."""
    shares = [np.array([0.0, 1.0])]
    for low, high in zip(start, end, strict=True):
        first, last = sorted((low, high))
        if last > first:
            shares.append((np.arange(np.ceil(first), np.floor(last) + 1.0) - low) / (high - low))
    cuts = np.sort(np.concatenate(shares))
    long = np.diff(cuts) > EXACT
    middle = ((cuts[1:] + cuts[:-1]) / 2.0)[long]
    return np.asarray(start + middle[:, None] * (end - start))


def connected(free: BoolArray, cells: IntArray, size: FloatArray, corner: FloatArray, clearance: float) -> IntArray:
    """Return the same cells with steps through an edge or a corner replaced by steps through faces.

    ``clearance`` [m] is what occupied cells were grown by, for the message.

    Raises
    ------
    CorridorError
        If one of them is not free.
    """
    linked = [cells[0]]
    for cell in cells[1:]:
        linked.extend(_bridge(free, linked[-1], cell))
    joined = np.array(linked)
    blocked = ~free[tuple(joined.T)]
    if blocked.any():
        cell = joined[int(np.argmax(blocked))]
        place = f"{point_text(corner + size * (cell + 0.5))} m, cell {point_text(cell)},"
        if clearance == 0.0:
            raise CorridorError(f"the path meets an occupied cell at {place} of the grid: move the path around it")
        raise CorridorError(
            f"the path meets a cell at {place} that is nearer than {clearance:g} m to an occupied one: "
            f"leave {size.max():g} m, a cell, more than the clearance"
        )
    return joined


def _bridge(free: BoolArray, start: IntArray, end: IntArray) -> list[IntArray]:
    """Cells from the one after ``start`` to ``end``, one axis at a time, in a collision-free order if possible."""
    ways = []
    for order in permutations(np.flatnonzero(start != end)):
        way, cell = [], start
        for axis in order:
            cell = cell.copy()
            cell[axis] = end[axis]
            way.append(cell)
        ways.append(way)
    return next((way for way in ways if free[tuple(np.array(way).T)].all()), ways[0])

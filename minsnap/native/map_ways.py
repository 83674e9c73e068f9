"""Ways through maps by the native core: convex sets around a line of points, and lines of any angle through a grid.

And what a sensor sees of a map.
"""

from __future__ import annotations

import os
from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray, NDArray
from minsnap.native.library import Entry, NativeCoreError, describe
from minsnap.native.records import GridWayQuestion, SightQuestion, TangentQuestion
from minsnap.native.status import Status

_PLANES = Entry("minsnap_tangent_planes", TangentQuestion)
_WAY = Entry("minsnap_grid_way", GridWayQuestion)
_SIGHT = Entry("minsnap_sight", SightQuestion)

PLANES = 64
"""Planes of a set that there is room for at first."""


class TangentSets(NamedTuple):
    """Sets around segments: of each (A, b) with A x <= b, and the segment's distance to the nearest obstacle [m].

    ``nearest`` (segments,) is that obstacle; points count on behind the obstacles; -1 where none is in reach.
    """

    sets: list[tuple[FloatArray, FloatArray]]
    distance: FloatArray
    nearest: IntArray


def tangent_planes(
    path: FloatArray, obstacles: FloatArray, points: FloatArray, clearance: float, reach: float
) -> TangentSets:
    """Bound a convex set around each segment of a line by planes that touch the nearest obstacles.

    Parameters
    ----------
    path : ndarray, shape (segments + 1, dim)
        [m].
    obstacles : ndarray, shape (m, 13)
        ``Obstacle.numbers`` of each.
    points : ndarray, shape (k, dim)
        What else is to be kept away from [m].
    clearance : float
        Between the sets and all of these [m]. A segment that is nearer is not wholly in its set.
    reach : float
        How far a set extends beyond its segment, and to its sides [m].
    """
    dim, segments, capacity = path.shape[1], len(path) - 1, PLANES
    asked = {"dim": dim, "segments": segments, "obstacles": len(obstacles), "points": len(points)}
    asked |= {"path": _in_space(path), "point": _in_space(points), "obstacle": np.ascontiguousarray(obstacles)}
    counts, nearest, distance = np.empty(segments, np.int64), np.empty(segments, np.int64), np.empty(segments)
    known = {"clearance": clearance, "reach": reach, "counts": counts, "nearest": nearest, "distance": distance}
    while True:
        planes = np.empty((segments, capacity, 4))
        question = TangentQuestion(**asked, **known, capacity=capacity, planes=planes, threads=os.cpu_count() or 1)
        _require(_PLANES, question)
        if counts.max() <= capacity:
            break
        capacity = int(counts.max())
    rows = [part[:count] for part, count in zip(planes, counts.tolist(), strict=True)]
    return TangentSets([(row[:, :dim].copy(), row[:, 3].copy()) for row in rows], distance, nearest)


def grid_way(free: BoolArray, size: FloatArray, start: IntArray, goal: IntArray) -> IntArray | None:
    """Return the corners of a way through free cells whose lines have any angle: (m, dim); None if there is none.

    Parameters
    ----------
    free : ndarray of bool, 2 or 3 axes
        Cells that a line may touch; start and goal are among them.
    size : ndarray, shape (dim,)
        Sides of a cell [m].
    start, goal : ndarray, shape (dim,)
        Cells.
    """
    dim, capacity = free.ndim, 1024
    ends = {name: _cell(cell, 0) for name, cell in (("start", start), ("goal", goal))}
    asked = {"shape": _cell(np.array(free.shape), 1), "size": np.append(size, np.ones(3 - dim)), **ends}
    cells, found = np.ascontiguousarray(free), np.zeros(1, dtype=np.int64)
    while True:
        way = np.empty((capacity, 3), dtype=np.int64)
        _require(_WAY, GridWayQuestion(dim=dim, capacity=capacity, free=cells, way=way, found=found, **asked))
        if found[0] <= capacity:
            return way[: found[0], :dim] if found[0] else None
        capacity = int(found[0])


def mark_sight(
    place: FloatArray,
    points: FloatArray,
    ends: FloatArray,
    size: float,
    first: IntArray,
    states: NDArray[np.uint8],
    spans: NDArray[np.uint8],
) -> None:
    """Mark in a block of cells what a sensor sees: those that its lines pass as free, those of points as occupied.

    Parameters
    ----------
    place : ndarray, shape (dim,)
        Of the sensor [m].
    points : ndarray, shape (k, dim)
        On obstacles, at the ends of lines from the place [m].
    ends : ndarray, shape (m, dim)
        Of lines from the place on which nothing was seen [m].
    size : float
        Side of a cell [m].
    first : ndarray, shape (dim,)
        The first cell of the block, counted from the origin.
    states : ndarray of uint8, dim axes
        0 for unknown cells, 1 for free and 2 for occupied ones; what is marked stays, and a larger state replaces it.
    spans : ndarray of uint8, shape (..., 2, dim)
        Where in a cell the lowest and highest points were seen, in parts of 255 of its side.
    """
    block = {"first": first.astype(np.int64), "shape": np.array(states.shape, dtype=np.int64)}
    seen = {"place": np.ascontiguousarray(place), "point": np.ascontiguousarray(points)}
    asked = {
        "dim": len(place),
        "points": len(points),
        "rays": len(ends),
        "size": size,
        "end": np.ascontiguousarray(ends),
    }
    _require(_SIGHT, SightQuestion(**asked, **block, **seen, states=states, spans=spans))


def _cell(cell: IntArray, height: int) -> IntArray:
    return np.append(cell, [height] * (3 - len(cell))).astype(np.int64)


def _in_space(points: FloatArray) -> FloatArray:
    """Return points with a height of zero, where they have none."""
    return np.ascontiguousarray(np.pad(points, ((0, 0), (0, 3 - points.shape[1]))))


def _require(entry: Entry, question: TangentQuestion | GridWayQuestion | SightQuestion) -> None:
    """Call an entry point; raise NativeCoreError where the Python core is in use, or if it does not answer."""
    if entry.function() is None:
        raise NativeCoreError(f"ways through maps need the native core, and this is the {describe()}")
    status = Status(entry(question))
    if status:
        raise NativeCoreError(f"the native core does not take this map: {status.reason}")

"""Random maps of blocks, and boxes of free space along a way through them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.corridors.grid_gaps import grown
from minsnap.corridors.occupancy_grid import GridCorridor, boxes_along
from minsnap.errors import CorridorError

MOST_CELLS = 2_000_000
"""Cells of the largest map."""

ATTEMPTS = 20
"""Maps that are drawn until one has a way from one side to the other."""

LONGEST = 8
"""Longest side of a block, in cells."""


def boxes(shape: Mapping[str, float], dim: int, rng: np.random.Generator) -> GridCorridor:
    """Draw maps until one can be crossed along x, and return boxes along a shortest way.

    Parameters
    ----------
    shape : mapping
        ``extent`` along x and y, ``height`` along z, side of a ``cell``, ``clearance`` [m]; ``occupied``, the share of
        the map that blocks cover.
    dim : int
        2 or 3.

    Raises
    ------
    CorridorError
        If no map has a way through, or a map has too many cells.
    """
    cell = shape["cell"]
    size: FloatArray = np.array([cell] * dim, dtype=np.float64)
    sides = np.array([shape["extent"], shape["extent"], shape["height"]][:dim])
    cells = np.maximum(np.ceil(sides / cell), 2).astype(np.intp)
    if cells.prod() > MOST_CELLS:
        raise CorridorError(f"a map of {int(cells.prod())} cells is too large: take larger cells, or a smaller extent")
    for _ in range(ATTEMPTS):
        free = ~grown(blocks(cells, shape["occupied"], rng), shape["clearance"], size)
        way = shortest_way(free, rng)
        if len(way) > 1:
            return boxes_along(
                free, size, np.zeros(dim), np.asarray((way + 0.5) * cell, dtype=np.float64), shape["clearance"]
            )
    raise CorridorError(f"none of {ATTEMPTS} random maps has a way through it: lower occupied, or the clearance")


def blocks(cells: IntArray, share: float, rng: np.random.Generator) -> BoolArray:
    """Return a grid in which random blocks cover at least a share of the cells."""
    taken = np.zeros(tuple(cells), dtype=bool)
    while taken.mean() < share:
        low = rng.integers(0, cells)
        size = rng.integers(1, np.minimum(LONGEST, cells), endpoint=True)
        taken[tuple(slice(a, a + b) for a, b in zip(low, size, strict=True))] = True
    return taken


def shortest_way(free: BoolArray, rng: np.random.Generator) -> IntArray:
    """Return cells (m, dim) from a random free cell at the low end of x to the high end; none where there is no way.

    Breadth first, over faces of cells; of several shortest ways always the same one.
    """
    starts = np.argwhere(free[0])
    if not len(starts):
        return np.zeros((0, free.ndim), dtype=np.intp)
    start = np.concatenate(([0], starts[rng.integers(len(starts))]))
    steps = _distances(free, start)
    ends = np.argwhere(steps[-1] >= 0)
    if not len(ends):
        return np.zeros((0, free.ndim), dtype=np.intp)
    return _back(steps, np.concatenate(([free.shape[0] - 1], ends[rng.integers(len(ends))])))


def _distances(free: BoolArray, start: IntArray) -> IntArray:
    """Return steps from a cell to each; -1 where there is no way."""
    steps = np.full(free.shape, -1, dtype=np.intp)
    front = np.zeros(free.shape, dtype=bool)
    front[tuple(start)] = True
    count = 0
    while front.any():
        steps[front] = count
        count += 1
        front = _around(front) & free & (steps < 0)
    return steps


def _around(front: BoolArray) -> BoolArray:
    """Return the cells that share a face with one of these."""
    near = np.zeros_like(front)
    for axis in range(front.ndim):
        ahead, behind = _sides(front.ndim, axis)
        near[ahead] |= front[behind]
        near[behind] |= front[ahead]
    return near


def _sides(dim: int, axis: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    whole = [slice(None)] * dim
    return tuple(whole[:axis] + [slice(1, None)] + whole[axis + 1 :]), tuple(
        whole[:axis] + [slice(None, -1)] + whole[axis + 1 :]
    )


def _back(steps: IntArray, end: IntArray) -> IntArray:
    """Follow falling distances from a cell to where they are zero, and return the way in its own direction."""
    way = [end]
    moves = np.concatenate((np.eye(steps.ndim, dtype=np.intp), -np.eye(steps.ndim, dtype=np.intp)))
    while steps[tuple(way[-1])] > 0:
        wanted = steps[tuple(way[-1])] - 1
        near = way[-1] + moves
        inside = near[((near >= 0) & (near < steps.shape)).all(axis=1)]
        way.append(next(cell for cell in inside if steps[tuple(cell)] == wanted))
    return np.array(way[::-1])

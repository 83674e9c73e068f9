"""The shortest way through free cells of a grid, and the widest one, by graph search (scipy.sparse.csgraph)."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.corridors.grid_gaps import block

LARGE = 400_000
"""Cells above which a way is looked for in blocks of 2 cells a side first, all of whose cells are free."""

FURTHEST = 1e300
"""Steps from the start beyond which nothing is looked for."""


AVOIDED = 1000.0
"""Factor on the length of steps to and from cells that are avoided."""


def shortest_way(
    free: BoolArray, size: FloatArray, start: IntArray, goal: IntArray, avoided: BoolArray | None = None
) -> IntArray | None:
    """Return cells from start to goal: (m, dim), or None if there is no way.

    Steps go to any neighbour, through an edge or a corner only where all cells that meet there are free, and have their
    Euclidean length (Dijkstra's algorithm). On large grids the way is looked for in blocks of cells first, so that it
    is shortest among those of blocks, and then by steps through faces only.

    Parameters
    ----------
    free : ndarray of bool
        Cells that the way may have; start and goal are among them.
    size : ndarray, shape (dim,)
        Sides of a cell [m].
    start, goal : ndarray, shape (dim,)
        Cells.
    avoided : ndarray of bool, optional
        Cells that the way has only where there is no other.
    """
    if free.size > LARGE and avoided is None:
        coarse = _in_blocks(free, size, start, goal)
        if coarse is not None:
            return coarse
    graph = _graph(free, size, corners=free.size <= LARGE, avoided=avoided)
    ends = [int(np.ravel_multi_index(tuple(cell), free.shape)) for cell in (start, goal)]
    return _traced(graph, ends[0], ends[1], free.shape)


def _in_blocks(free: BoolArray, size: FloatArray, start: IntArray, goal: IntArray) -> IntArray | None:
    """Return a way through free blocks of 2 cells a side, with start and goal added; None if their blocks are not."""
    shape = tuple(length // 2 for length in free.shape)
    whole = free[tuple(slice(0, 2 * length) for length in shape)]
    blocks = whole.reshape([part for length in shape for part in (length, 2)])
    coarse = np.asarray(blocks.all(axis=tuple(range(1, 2 * free.ndim, 2))))
    ends = [np.minimum(cell // 2, np.array(shape) - 1) for cell in (start, goal)]
    if not all(coarse[tuple(end)] and (cell // 2 == end).all() for end, cell in zip(ends, (start, goal), strict=True)):
        return None
    way = shortest_way(coarse, 2.0 * size, ends[0], ends[1])
    return None if way is None else np.vstack((start, 2 * way, goal))


def _graph(free: BoolArray, size: FloatArray, corners: bool, avoided: BoolArray | None) -> Any:
    """Return the lengths of all steps between free cells, each once, as a sparse matrix.

    Without ``corners``, through faces only.
    """
    from scipy.sparse import csr_matrix

    index = np.arange(free.size, dtype=np.int32).reshape(free.shape)
    rows, columns, lengths = [], [], []
    for step in product((-1, 0, 1), repeat=free.ndim):
        if step <= (0,) * free.ndim or not (corners or np.count_nonzero(step) == 1):
            continue
        here, there = block(free.shape, step), block(free.shape, step, step)
        open_ = _all_open(free, step)
        rows.append(index[here][open_])
        columns.append(index[there][open_])
        lengths.append(np.full(len(rows[-1]), np.linalg.norm(size * step)))
        if avoided is not None:
            lengths[-1] *= np.where(avoided[here][open_] | avoided[there][open_], AVOIDED, 1.0)
    entries = np.concatenate(lengths), (np.concatenate(rows), np.concatenate(columns))
    return csr_matrix(entries, shape=(free.size, free.size))


def _all_open(free: BoolArray, step: tuple[int, ...]) -> BoolArray:
    """Return where all cells of the block that a step goes through are free."""
    open_cells = np.ones(free[block(free.shape, step)].shape, dtype=np.bool_)
    for part in product(*((0, change) if change else (0,) for change in step)):
        open_cells &= free[block(free.shape, step, part)]
    return open_cells


def _traced(graph: Any, start: int, goal: int, shape: tuple[int, ...]) -> IntArray | None:
    from scipy.sparse.csgraph import dijkstra

    distance, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
    if not distance[goal] < FURTHEST:
        return None
    way = [goal]
    while way[-1] != start:
        way.append(int(before[way[-1]]))
    return np.stack(np.unravel_index(way[::-1], shape), axis=-1)


def widest(gap: FloatArray, open_: BoolArray, start: IntArray, goal: IntArray) -> float | None:
    """Return the largest clearance with which there is a way from start to goal [m]; None if there is none at all.

    Parameters
    ----------
    gap : ndarray
        Distance of each cell to the nearest occupied one [m].
    open_ : ndarray of bool
        Cells that are not occupied.
    start, goal : ndarray, shape (dim,)
        Cells.
    """
    if not _linked(open_, start, goal):
        return None
    values = np.unique(gap[open_ & (gap <= min(gap[tuple(start)], gap[tuple(goal)]))])
    low, high = 0, len(values)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if _linked(gap >= values[middle], start, goal) else (low, middle)
    return float(values[low])


def _linked(open_: BoolArray, start: IntArray, goal: IntArray) -> bool:
    """Whether two cells are joined by steps through faces."""
    from scipy.ndimage import label

    part, _ = label(open_)
    return bool(part[tuple(start)] and part[tuple(start)] == part[tuple(goal)])

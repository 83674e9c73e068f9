"""What sensors have seen so far: cells known as free or occupied, in an array that grows with what is seen."""

from __future__ import annotations

from itertools import product

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.errors import CorridorError
from minsnap.native.map_ways import mark_sight
from minsnap.paths.routes.grid_map import LARGEST_MAP

UNKNOWN, FREE, OCCUPIED = 0, 1, 2
"""States of a cell; of two that are seen, the larger one stays."""

PARTS = 255
"""Parts of the side of a cell in which it is kept where points were seen."""

GROWTH = 16
"""Cells added beyond what is seen when the array grows."""


class KnownMap:
    """Cells that are unknown, free or occupied.

    Parameters
    ----------
    dim : int
        Axes.
    size : float
        Side of a cell [m].
    """

    def __init__(self, dim: int, size: float) -> None:
        self.size, self.first = size, np.zeros(dim, dtype=np.int64)
        self.states = np.zeros((0,) * dim, dtype=np.uint8)
        self.spans = np.zeros((0,) * dim + (2, dim), dtype=np.uint8)

    def cells(self, points: FloatArray) -> IntArray:
        """Return the cells that points (..., dim) are in, counted from the origin."""
        return np.floor(points / self.size).astype(np.int64)

    def body(self, position: FloatArray, radius: float) -> None:
        """Mark the cells that a vehicle of a radius [m] touches as free."""
        count, here = int(np.ceil(radius / self.size)), self.cells(position)
        steps = np.array(list(product(range(-count, count + 1), repeat=len(here))))
        apart = np.maximum(np.abs(steps) - 1, 0) * self.size
        self._mark(here + steps[np.linalg.norm(apart, axis=1) < radius], FREE)

    def see(self, position: FloatArray, points: FloatArray, ends: FloatArray) -> None:
        """Mark the cells of points as occupied, and those on the lines to them and to free ends as free."""
        cells = self.cells(np.vstack((position[None], points, ends)))
        self._reach(
            cells.min(axis=0) - 1, cells.max(axis=0) + 2
        )  # lines that run back along a side have the cell before it
        mark_sight(position, points, ends, self.size, self.first, self.states, self.spans)

    def boxes(self, low: FloatArray, high: FloatArray, unknown: bool) -> FloatArray:
        """Return boxes around what was seen of obstacles between two corners [m], and unknown cells there, (m, 13).

        Of an occupied cell the box holds the points that were seen in it.
        """
        first, behind = self.cells(low), self.cells(high) + 1
        states, dim = self.window(first, behind), len(first)
        taken = np.argwhere(states == OCCUPIED) + first
        inside = self.spans[tuple((taken - self.first).T)] / PARTS
        corners = [self.size * (taken + inside[:, end]) for end in (0, 1)]
        if unknown:
            other = np.argwhere(states == UNKNOWN) + first
            corners = [np.vstack((corners[end], self.size * (other + end))) for end in (0, 1)]
        result = np.zeros((len(corners[0]), 13))
        result[:, 6], result[:, 7:10], result[:, 10:] = -1.0, -np.inf, np.inf
        result[:, 7 : 7 + dim], result[:, 10 : 10 + dim] = corners
        return result

    def window(self, low: IntArray, behind: IntArray) -> IntArray:
        """Return the states of a block of cells; what was never seen is unknown."""
        result = np.zeros(tuple((behind - low).tolist()), dtype=np.uint8)
        begin = np.maximum(low, self.first)
        end = np.minimum(behind, self.first + self.states.shape)
        if (begin < end).all():
            result[_part(begin - low, end - low)] = self.states[_part(begin - self.first, end - self.first)]
        return result

    def _mark(self, cells: IntArray, state: int) -> None:
        self._reach(cells.min(axis=0), cells.max(axis=0) + 1)
        index = tuple((cells - self.first).T)
        self.states[index] = np.maximum(self.states[index], state)

    def _reach(self, low: IntArray, behind: IntArray) -> None:
        """Make the array hold a block of cells."""
        here, end = self.first, self.first + self.states.shape
        if self.states.size and (low >= here).all() and (behind <= end).all():
            return
        low, behind = low - GROWTH, behind + GROWTH
        if self.states.size:
            low, behind = np.minimum(low, here), np.maximum(behind, end)
        if np.prod((behind - low).astype(np.float64)) > LARGEST_MAP:
            raise CorridorError(
                f"what was observed spans more than {LARGEST_MAP} cells of {self.size:g} m: make the resolution coarser"
            )
        states, dim = self.window(low, behind), len(low)
        spans = np.empty((*states.shape, 2, dim), dtype=np.uint8)
        spans[..., 0, :], spans[..., 1, :] = PARTS, 0
        if self.states.size:
            spans[_part(here - low, end - low)] = self.spans
        self.first, self.states, self.spans = low, states.astype(np.uint8), spans


def edge(shape: tuple[int, ...]) -> BoolArray:
    """Return the cells of a block that are at its border."""
    cells = np.ones(shape, dtype=np.bool_)
    cells[tuple(slice(1, -1) for _ in shape)] = False
    return cells


def _part(low: IntArray, behind: IntArray) -> tuple[slice, ...]:
    return tuple(slice(int(a), int(b)) for a, b in zip(low, behind, strict=True))

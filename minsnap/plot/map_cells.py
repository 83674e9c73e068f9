"""The occupied cells of a map near a path, and the faces that bound them, to draw them in space."""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray
from minsnap.paths.routes import GridMap

MOST_FACES = 60_000
"""Faces of cells that are drawn; where more would be, cells are joined to larger ones."""

HEIGHT = 1.0
"""Of what is drawn of a plane map, whose path is drawn at half of it [m]."""

AROUND = 0.5
"""How far beyond the path a map is drawn, in extents of the path."""


def near_cells(grid: GridMap, places: FloatArray, clearance: float) -> tuple[BoolArray, FloatArray, FloatArray]:
    """Return the occupied cells near a path, their sides and their first corner, in space [m].

    What is higher than the path by more than the clearance is left out: a ceiling would hide the flight. Cells of a
    plane map, which reach to the sky, are drawn up to there.

    Parameters
    ----------
    grid : GridMap
    places : ndarray, shape (n, 2) or (n, 3)
        Of the path [m].
    clearance : float
        [m].
    """
    beyond = max(AROUND * float(np.ptp(places, axis=0).max()), 5.0)
    flat = places[:, : grid.dim]
    low, high = flat.min(axis=0) - beyond, flat.max(axis=0) + beyond
    if grid.dim == 3:
        low[2], high[2] = grid.lower[2], places[:, 2].max() + clearance
    shape = np.array(grid.occupied.shape)
    first = np.clip(np.floor((low - grid.lower) / grid.resolution), 0, shape).astype(int)
    last = np.clip(np.ceil((high - grid.lower) / grid.resolution), 0, shape).astype(int)
    taken = grid.occupied[tuple(slice(a, b) for a, b in zip(first, last, strict=True))]
    corner = grid.lower + first * grid.resolution
    if grid.dim == 3:
        return taken, grid.resolution, corner
    height = HEIGHT if places.shape[1] == 2 else max(HEIGHT, float(places[:, 2].max()) + clearance)
    return taken[:, :, None], np.append(grid.resolution, height), np.append(corner, 0.0)


def surface(taken: BoolArray, most: int = MOST_FACES) -> tuple[FloatArray, int]:
    """Return the faces between taken cells and others, shape (n, 4, 3) in cells, and how many cells a drawn one has.

    Faces in a row are one. Where there would be more than ``most``, a cube of cells is one cell, taken where one is.
    """
    size = 1
    while True:
        faces = np.concatenate([_faces(taken, axis, side) for axis in range(3) for side in (0, 1)])
        if len(faces) <= most:
            return size * faces, size
        taken, size = _halved(taken), 2 * size


def _halved(taken: BoolArray) -> BoolArray:
    """Return the same cells at twice their side; a map of one layer keeps it."""
    for axis in range(3):
        if taken.shape[axis] > 1:
            even = np.pad(taken, [(0, taken.shape[i] % 2 if i == axis else 0) for i in range(3)])
            pairs = np.moveaxis(even, axis, 0)
            taken = np.moveaxis(pairs[::2] | pairs[1::2], 0, axis)
    return taken


def _faces(taken: BoolArray, axis: int, side: int) -> FloatArray:
    """Return the free faces of cells on one side along an axis, joined in rows, shape (n, 4, 3) in cells."""
    padded = np.pad(taken, [(1, 1) if i == axis else (0, 0) for i in range(3)])
    beside = np.take(padded, range(2 * side, 2 * side + taken.shape[axis]), axis=axis)
    row = 1 if axis == 2 else 2
    order = [i for i in range(3) if i != row] + [row]
    ends = np.diff(np.pad(np.transpose(taken & ~beside, order), ((0, 0), (0, 0), (1, 1))).astype(np.int8), axis=2)
    low, high = np.empty((2, int((ends == 1).sum()), 3))
    low[:, order], high[:, order] = np.argwhere(ends == 1), np.argwhere(ends == -1) + [1, 1, 0]
    low[:, axis] = high[:, axis] = low[:, axis] + side
    across = 3 - axis - row
    corners = np.stack([low, low, high, high], axis=1)
    corners[:, 1, across], corners[:, 3, across] = high[:, across], low[:, across]
    return corners

"""Heights of the ground, from an ESRI ASCII grid or a GeoTIFF."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray
from minsnap.basics.checks import check_array, point_text
from minsnap.errors import ShapeError

MOST_HEIGHTS = 5_000_000
"""Heights of the largest grid that is read."""

LARGEST_GRID = 100_000_000
"""Bytes of the largest grid that is read."""


@dataclass(frozen=True, eq=False)
class Terrain:
    """Heights of the ground at the middles of square cells; the surface between them is bilinear.

    Parameters
    ----------
    heights : ndarray, shape (nx, ny)
        [m]; not a number where they are not known.
    middle : ndarray, shape (2,)
        Where the first one is [m].
    side : float
        Distance from one to the next [m].
    name : str
        What messages call it.
    """

    heights: FloatArray
    middle: FloatArray
    side: float
    name: str

    @property
    def reach(self) -> FloatArray:
        """From where to where heights are known, shape (2, 2) [m]."""
        return np.array([self.middle, self.middle + self.side * (np.array(self.heights.shape) - 1)])

    def at(self, places: ArrayLike) -> FloatArray:
        """Return the height of the ground, bilinear between those of the grid.

        Parameters
        ----------
        places : array_like, shape (..., 2)
            [m].

        Returns
        -------
        ndarray, shape (...)
            [m].

        Raises
        ------
        ShapeError
            If a place is none, beyond the grid, or where the height is not known.
        """
        shape = (*np.shape(places)[:-1], 2)
        given = check_array("places on the ground", places, (shape,), "x and y of each [m]", ShapeError)
        flat, (low, high) = given.reshape(-1, 2), self.reach
        beyond = ((flat < low) | (flat > high)).any(axis=1)
        if beyond.any():
            ends = ", ".join(f"{axis} from {a:.6g} to {b:.6g} m" for axis, a, b in zip("xy", low, high, strict=True))
            where = point_text(flat[beyond][0])
            raise ShapeError(f"{where} m is beyond the heights of {self.name}, which are known for {ends}")
        ground = self.known_at(flat)
        if np.isnan(ground).any():
            raise ShapeError(f"the ground of {self.name} is not known at {point_text(flat[np.isnan(ground)][0])} m")
        return np.asarray(ground.reshape(given.shape[:-1]))

    def known_at(self, places: FloatArray) -> FloatArray:
        """Return the height of the ground at places (..., 2) within the grid: (...) [m]; not a number where unknown."""
        cells = (places - self.middle) / self.side
        first = np.clip(np.floor(cells).astype(int), 0, np.array(self.heights.shape) - 2)
        (u, v), (i, j) = np.moveaxis(cells - first, -1, 0), np.moveaxis(first, -1, 0)
        west = (1.0 - v) * self.heights[i, j] + v * self.heights[i, j + 1]
        east = (1.0 - v) * self.heights[i + 1, j] + v * self.heights[i + 1, j + 1]
        return np.asarray((1.0 - u) * west + u * east)

"""Heights of the ground, from an ESRI ASCII grid or a GeoTIFF."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray

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

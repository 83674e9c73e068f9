"""Heights of the ground, from an ESRI ASCII grid or a GeoTIFF."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np

from minsnap.basics.arrays import SMALLEST, FloatArray
from minsnap.basics.checks import check_number
from minsnap.basics.storage.text import FileName, read_text, reading
from minsnap.errors import FileError

MOST_HEIGHTS = 5_000_000
"""Heights of the largest grid that is read."""

PICTURES = (".tif", ".tiff")
"""Endings of GeoTIFF files."""

LARGEST_GRID = 100_000_000
"""Bytes of the largest grid that is read."""

WORDS = ("ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize", "nodata_value")
"""Entries of the header of an ESRI ASCII grid, each a line of its own, in any case."""


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


def read_terrain(path: FileName) -> Terrain:
    """Read an ESRI ASCII grid (``.asc``), whose first row is the one with the largest y, or a GeoTIFF (``.tif``).

    Raises
    ------
    FileError
        If it cannot be read, or is no such grid.
    """
    if Path(path).suffix.lower() in PICTURES:
        from minsnap.paths.routes.geotiff import read_geotiff

        return read_geotiff(path)
    words = read_text(path, LARGEST_GRID).split()
    header: dict[str, float] = {}
    with reading(path, "an ESRI ASCII grid of heights"):
        while len(words) > 2 * len(header) + 1 and words[2 * len(header)].lower() in WORDS:
            at = 2 * len(header)
            name = words[at].lower()
            if name in header:
                raise FileError(f"{path} has two entries {name}: give one")
            header[name] = float(words[at + 1])
        missing = [name for name in ("ncols", "nrows", "cellsize") if name not in header]
        if missing:
            raise FileError(f"{path} is no ESRI ASCII grid: it has no {' and no '.join(missing)}")
        shape = int(header["nrows"]), int(header["ncols"])
        values = words[2 * len(header) :]
        if min(shape) < 2 or shape[0] * shape[1] > MOST_HEIGHTS or len(values) != shape[0] * shape[1]:
            raise FileError(
                f"{path} has {len(values)} heights where its header says {shape[0]} x {shape[1]}: give 2 x 2 or more, "
                f"and at most {MOST_HEIGHTS}"
            )
        give = "give the side of a cell [m]"
        side = float(check_number("cellsize", header["cellsize"], SMALLEST, inf, give, FileError))
        rows = np.array(values, dtype=np.float64).reshape(shape)
        middle = np.array([_first_middle(path, header, axis, side) for axis in "xy"])
    rows[(rows == header.get("nodata_value", -9999.0)) | ~np.isfinite(rows)] = np.nan
    return Terrain(np.ascontiguousarray(rows[::-1].T), middle, side, str(path))


def _first_middle(path: FileName, header: dict[str, float], axis: str, side: float) -> float:
    """Return where the middle of the first cell is along an axis [m]."""
    corner, center = header.get(f"{axis}llcorner"), header.get(f"{axis}llcenter")
    if corner is None and center is None:
        raise FileError(f"{path} does not say where it lies: give xllcorner and yllcorner")
    middle = center if corner is None else corner + 0.5 * side
    return float(check_number(f"{axis}llcorner", middle, -inf, inf, "give a finite number [m]", FileError))

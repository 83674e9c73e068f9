"""Heights of the ground from files: ESRI ASCII grids, and GeoTIFF by :mod:`minsnap.paths.routes.geotiff`."""

from __future__ import annotations

from math import inf
from pathlib import Path

import numpy as np

from minsnap.basics.arrays import SMALLEST
from minsnap.basics.checks import check_number
from minsnap.basics.storage.text import FileName, read_text, reading
from minsnap.errors import FileError
from minsnap.paths.routes.geotiff import read_geotiff
from minsnap.paths.routes.terrain import LARGEST_GRID, MOST_HEIGHTS, Terrain

WORDS = ("ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize", "nodata_value")
"""Entries of the header of an ESRI ASCII grid, each a line of its own, in any case."""

PICTURES = (".tif", ".tiff")
"""Endings of GeoTIFF files."""


def read_terrain(path: FileName) -> Terrain:
    """Read an ESRI ASCII grid (``.asc``), whose first row is the one with the largest y, or a GeoTIFF (``.tif``).

    Raises
    ------
    FileError
        If it cannot be read, or is no such grid.
    """
    if Path(path).suffix.lower() in PICTURES:
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

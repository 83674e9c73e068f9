"""Heights of the ground from a GeoTIFF (OGC 19-008r4, GeoTIFF Standard 1.1): north up, projected, in metres.

Pillow, which maps need too, reads the picture: strips or tiles, as they are or compressed (deflate, LZW, …).
"""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np

from minsnap.basics.arrays import SMALLEST, FloatArray
from minsnap.basics.checks import check_number
from minsnap.basics.storage.text import FileName, reading
from minsnap.errors import FileError
from minsnap.paths.routes.terrain import LARGEST_GRID, MOST_HEIGHTS, Terrain

SCALE, TIE, TURNED, KEYS, NODATA = 33550, 33922, 34264, 34735, 42113
"""Tags: ModelPixelScale, ModelTiepoint, ModelTransformation, GeoKeyDirectory, and GDAL's value of what is not known."""

MODEL, RASTER, UNIT, VERTICAL_UNIT = 1024, 1025, 3076, 4099
"""Keys: GTModelType, GTRasterType, ProjLinearUnits and VerticalUnits."""

PROJECTED, POINT, METRE, USER = 1, 2, 9001, 32767
"""Values of keys: projected coordinates; heights of points, not of cells; the metre; and defined elsewhere."""


def read_geotiff(path: FileName) -> Terrain:
    """Read the heights of a GeoTIFF.

    Raises
    ------
    FileError
        If it cannot be read, is no picture of single heights, or does not say where they are in square cells of metres.
    """
    from PIL import Image

    kind = "a GeoTIFF of heights"
    with reading(path, kind, LARGEST_GRID), Image.open(path, formats=("TIFF",)) as picture:
        if not 4 <= picture.width * picture.height <= MOST_HEIGHTS or min(picture.size) < 2:
            raise FileError(
                f"{path} has {picture.height} x {picture.width} heights: give 2 x 2 or more, and at most {MOST_HEIGHTS}"
            )
        if picture.mode in ("1", "P") or len(picture.getbands()) != 1:
            raise FileError(f"{path} is a picture in colours ({picture.mode}), no heights: give one band of numbers")
        tags: dict[int, Any] = dict(picture.tag_v2)  # type: ignore[attr-defined]
        rows = np.array(picture, dtype=np.float64)
        unknown = _unknown(tags)
        side, first = _place(path, tags)
    rows[(rows == unknown) | ~np.isfinite(rows)] = np.nan
    middle = first - [0.0, side * (len(rows) - 1)]
    return Terrain(np.ascontiguousarray(rows[::-1].T), middle, side, str(path))


def _unknown(tags: dict[int, Any]) -> float:
    """Return the height that stands for one that is not known; not a number without one."""
    return float(str(tags[NODATA]).strip("\0 ")) if NODATA in tags else np.nan


def _place(path: FileName, tags: dict[int, Any]) -> tuple[float, FloatArray]:
    """Return the side of a cell, and where the middle of the first one is, that of the upper left [m]."""
    keys = _keys(tags)
    if keys.get(MODEL, PROJECTED) != PROJECTED:
        raise FileError(
            f"{path} lies in degrees of latitude and longitude: project it, to metres (gdalwarp -t_srs EPSG:… does)"
        )
    for key, what in ((UNIT, "coordinates"), (VERTICAL_UNIT, "heights")):
        if keys.get(key, METRE) not in (METRE, USER):
            raise FileError(f"{path} has {what} in another unit than the metre (EPSG {keys[key]}): convert it")
    if TURNED in tags or SCALE not in tags or TIE not in tags or len(tags[TIE]) != 6:
        how = "is turned, or bound to several points" if TURNED in tags or TIE in tags else "does not say where it lies"
        raise FileError(f"{path} {how}: give one that is north up, with one tie point and the size of a pixel")
    wide, high = (float(size) for size in tags[SCALE][:2])
    give = "give the side of a cell [m]"
    side = float(check_number("the size of a pixel", wide, SMALLEST, inf, give, FileError))
    if abs(high - wide) > 1e-6 * side:
        raise FileError(f"{path} has cells of {wide:g} by {high:g} m: give square ones")
    column, row, _, x, y, _ = (float(value) for value in tags[TIE])
    half = 0.0 if keys.get(RASTER) == POINT else 0.5
    first = np.array([x + side * (half - column), y - side * (half - row)])
    if not np.isfinite(first).all():
        raise FileError(f"{path} lies at ({first[0]:g}, {first[1]:g}): give finite numbers [m]")
    return side, first


def _keys(tags: dict[int, Any]) -> dict[int, int]:
    """Return the keys whose values stand beside them."""
    listed = [int(value) for value in tags.get(KEYS, ())]
    entries = [listed[at : at + 4] for at in range(4, len(listed) - 3, 4)]
    return {key: value for key, place, _, value in entries if place == 0}

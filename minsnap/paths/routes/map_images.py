"""Maps of ROS's map_server: a YAML file that describes a picture in PGM or PNG.

The form is that of nav2_map_server and map_server: ``image``, ``resolution``, ``origin``, ``negate``,
``occupied_thresh``, ``free_thresh`` and ``mode``, where dark pixels are occupied and the first row is the one with the
largest y.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.checks import is_number
from minsnap.basics.messages import shown
from minsnap.basics.storage.reading import check_size, reading
from minsnap.basics.storage.text import load_yaml
from minsnap.errors import FileError
from minsnap.paths.routes.grid_map import LARGEST_MAP, GridMap
from minsnap.paths.routes.map_values import Reading

KEYS = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode")
NEEDED = ("image", "resolution", "origin")


def read_map_yaml(path: str | os.PathLike[str], how: Reading) -> GridMap:
    """Read a map_server YAML file and its picture.

    Probabilities are (255 - value) / 255, or value / 255 with ``negate``. In the modes trinary (the default) and scale,
    a cell is occupied above ``occupied_thresh``, free below ``free_thresh``, and unknown between; in raw, values are
    percentages and those above 100 unknown. A threshold of ``how`` takes precedence over both.

    Raises
    ------
    FileError
        If a file cannot be read, an entry is missing, unknown or malformed, or the origin is turned.
    """
    content = read_map_entries(path)
    low = content.get("free_thresh", 0.25)
    high = content.get("occupied_thresh", 0.65)
    if not (is_number(low) and is_number(high) and 0.0 <= low <= high <= 1.0):
        raise FileError(f"{path}: free_thresh is {low!r} and occupied_thresh {high!r}: two probabilities, in order")
    picture = read_picture(Path(path).parent / content["image"])
    chance = _probability(picture, content, (float(low), float(high)), how.threshold is None)
    kept = Reading(0.5 if how.threshold is None else how.threshold, how.unknown)
    cells = kept.by_probability(np.ascontiguousarray(chance[::-1].T))
    return GridMap(cells, np.full(2, float(content["resolution"])), np.array(content["origin"][:2]), Path(path).name)


def read_map_entries(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the entries of a map_server YAML file, checked.

    Raises
    ------
    FileError
        If one is missing, unknown or malformed.
    """
    content = load_yaml(path)
    if not isinstance(content, dict):
        raise FileError(f"{path}: a map is described by {', '.join(KEYS)}, not by {shown(content)}")
    _check_keys(path, content)
    return content


def read_picture(path: str | os.PathLike[str]) -> npt.NDArray[np.uint8]:
    """Return the grey values of a picture, rows from top to bottom: (rows, columns); -1 where it is transparent.

    Raises
    ------
    FileError
        If it cannot be read, or has too many pixels.
    """
    from PIL import Image

    check_size(path)
    with reading(path, "a picture in PGM or PNG"), Image.open(path, formats=("PPM", "PNG")) as picture:
        if picture.width * picture.height > LARGEST_MAP:
            raise FileError(f"{path} has {picture.width} x {picture.height} pixels: at most {LARGEST_MAP} are read")
        return np.array(picture.convert("L"), dtype=np.uint8)


def _probability(
    picture: npt.NDArray[np.uint8], content: Mapping[str, Any], bounds: tuple[float, float], banded: bool
) -> npt.NDArray[np.float32]:
    """Return probabilities, with -1 where a cell is unknown."""
    values = picture.astype(np.float32)
    if content.get("mode", "trinary") == "raw":
        return np.where(values <= 100, values / np.float32(100.0), np.float32(-1.0))
    chance = (values if content.get("negate", 0) else 255.0 - values) / np.float32(255.0)
    if not banded:
        return np.asarray(chance)
    between = np.where(chance > bounds[1], np.float32(1.0), np.float32(-1.0))
    return np.asarray(np.where(chance < bounds[0], np.float32(0.0), between))


def _check_keys(path: str | os.PathLike[str], content: Mapping[str, Any]) -> None:
    missing = [key for key in NEEDED if key not in content]
    unknown = [str(key) for key in content if key not in KEYS]
    if missing or unknown:
        what = f"{', '.join(missing)} missing" if missing else f"{shown(unknown[0])} is not known"
        raise FileError(f"{path}: {what}; a map is described by {', '.join(KEYS)}")
    image, side, origin = (content[key] for key in NEEDED)
    if not isinstance(image, str):
        raise FileError(f"{path}: image is {shown(image)}: give the name of a PGM or PNG file")
    if not is_number(side) or side <= 0.0:
        raise FileError(f"{path}: resolution is {shown(side)}: give the side of a pixel [m]")
    if not isinstance(origin, list) or len(origin) not in (2, 3) or not all(map(is_number, origin)):
        raise FileError(f"{path}: origin is {shown(origin)}: give x, y [m] and yaw of the lower left corner")
    if len(origin) == 3 and origin[2] != 0.0:
        raise FileError(f"{path}: the map is turned by {origin[2]:g} rad: turn the picture instead, with a yaw of 0")
    if content.get("mode", "trinary") not in ("trinary", "scale", "raw"):
        raise FileError(f"{path}: mode is {shown(content['mode'])}: it is trinary, scale or raw")

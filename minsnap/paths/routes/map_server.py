"""Maps of ROS's map_server and nav2_map_server: a YAML file and its picture.

Entries are ``image``, ``resolution``, ``origin``, ``negate``, ``occupied_thresh``, ``free_thresh`` and ``mode``; others
are read over, as map_server reads them over. Dark pixels are occupied and the first row is the one with the largest y.
"""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import NDArray
from minsnap.basics.schema import FLAG, NUMBER, TEXT, WHOLE, Key, either, from_to, mapping, several, word
from minsnap.basics.storage.text import LARGEST, FileName, load_yaml, reading
from minsnap.errors import FileError
from minsnap.paths.routes.cell_values import Reading
from minsnap.paths.routes.grid_map import LARGEST_MAP, GridMap

PROBABILITY = from_to(NUMBER, 0.0, 1.0)
KEYS = {
    "image": Key(TEXT, "name of a PGM or PNG file", needed=True),
    "resolution": Key(NUMBER, "side of a pixel [m]", needed=True),
    "origin": Key(several(NUMBER, "x, y [m] and yaw of the lower left corner", 2, 3), needed=True),
    "negate": Key(either(FLAG, WHOLE), "light pixels are occupied"),
    "occupied_thresh": Key(PROBABILITY),
    "free_thresh": Key(PROBABILITY),
    "mode": Key(word("trinary", "scale", "raw")),
}
MAP = mapping(KEYS, "a mapping with image, resolution and origin")
"""The description of a map."""

MISSPELT = 0.8
"""Likeness from which an entry is taken for a misspelt one, which would be missed: the ratio of difflib."""


def read_map_yaml(path: FileName, how: Reading) -> GridMap:
    """Read a map_server YAML file and its picture.

    Probabilities are (255 - value) / 255, or value / 255 with ``negate``. In the modes trinary (the default) and scale,
    a cell is occupied above ``occupied_thresh``, free below ``free_thresh``, and unknown between; in raw, values are
    percentages and those above 100 unknown. What is not opaque is unknown. A threshold of ``how`` takes precedence over
    both.

    Raises
    ------
    FileError
        If a file cannot be read, an entry is missing, misspelt or malformed, or the origin is turned.
    """
    content = read_map_entries(path)
    low, high = content.get("free_thresh", 0.25), content.get("occupied_thresh", 0.65)
    if low > high:
        raise FileError(f"{path}: free_thresh is {low!r} and occupied_thresh {high!r}: two probabilities, in order")
    picture = read_picture(Path(path).parent / content["image"])
    chance = _probability(picture, content, (low, high), how.threshold is None)
    kept = Reading(0.5 if how.threshold is None else how.threshold, how.unknown)
    values, corner = np.ascontiguousarray(chance[::-1].T), np.array(content["origin"][:2])
    cells, unknown = kept.by_probability(values), kept.counted_unknown(values)
    return GridMap(cells, np.full(2, content["resolution"]), corner, Path(path).name, unknown=unknown)


def read_map_entries(path: FileName) -> dict[str, Any]:
    """Return the entries of a map_server YAML file, checked; those that it does not know are read over.

    Raises
    ------
    FileError
        If one is missing, malformed, or looks like a misspelt one.
    """
    stored = load_yaml(path)
    if isinstance(stored, dict):
        stored = {name: value for name, value in stored.items() if _matters(str(name))}
    content: dict[str, Any] = MAP.read(f"{path}", stored)
    side, turn = content["resolution"], sum(content["origin"][2:])
    if side <= 0.0:
        raise FileError(f"{path}: resolution is {side:g}: give the side of a pixel [m], which is positive")
    if turn != 0.0:
        raise FileError(f"{path}: the map is turned by {turn:g} rad: turn the picture instead, with a yaw of 0")
    return content


def _matters(name: str) -> bool:
    """Whether an entry is known, or so like a known one that it is to be refused; others are of other programs."""
    return bool(get_close_matches(name, KEYS, n=1, cutoff=MISSPELT))


def files_of(path: FileName) -> tuple[Path, ...]:
    """Return the files that a map is read from: itself, and the picture that a map_server YAML file names.

    Raises
    ------
    FileError
        If such a YAML file cannot be read.
    """
    file = Path(path)
    described = file.suffix.lower() in (".yaml", ".yml")
    return (file, file.parent / read_map_entries(file)["image"]) if described else (file,)


def read_picture(path: FileName) -> NDArray[np.float32]:
    """Return the grey values of a picture, 0 to 255, rows from top to bottom: (rows, columns).

    Those of colours are the mean of red, green and blue, as map_server takes them; where the picture is not opaque,
    they are not a number.

    Raises
    ------
    FileError
        If it cannot be read, or has too many pixels.
    """
    from PIL import Image

    with reading(path, "a picture in PGM or PNG", LARGEST), Image.open(path, formats=("PPM", "PNG")) as picture:
        if picture.width * picture.height > LARGEST_MAP:
            raise FileError(f"{path} has {picture.width} x {picture.height} pixels: at most {LARGEST_MAP} are read")
        if picture.mode == "F":
            raise FileError(f"{path} holds floating-point numbers: a map has whole grey values")
        if picture.mode.startswith("I"):  # of 16 bits
            return np.asarray(picture, dtype=np.float32) * np.float32(255.0 / 65535.0)
        if picture.mode in ("1", "L") and "transparency" not in picture.info:
            return np.array(picture.convert("L"), dtype=np.float32)
        channels = np.asarray(picture.convert("RGBA"))
        grey = channels[..., :3].sum(axis=2, dtype=np.float32) / np.float32(3.0)
        return np.where(channels[..., 3] == 255, grey, np.float32(np.nan))


def _probability(
    values: NDArray[np.float32], content: Mapping[str, Any], bounds: tuple[float, float], banded: bool
) -> NDArray[np.float32]:
    """Return probabilities; those of unknown cells are below 0 or not a number."""
    if content.get("mode", "trinary") == "raw":
        percent = np.round(values)
        return np.where(percent <= 100, percent / np.float32(100.0), np.float32(-1.0))
    chance = (values if content.get("negate", 0) else 255.0 - values) / np.float32(255.0)
    if not banded:
        return np.asarray(chance)
    between = np.where(chance > bounds[1], np.float32(1.0), np.float32(-1.0))
    return np.asarray(np.where(chance < bounds[0], np.float32(0.0), between))

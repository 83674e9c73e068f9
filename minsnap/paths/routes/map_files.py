"""Maps from files and arrays: map_server YAML, NumPy arrays, point clouds.

The form is that of nav2_map_server and map_server: ``image``, ``resolution``, ``origin``, ``negate``,
``occupied_thresh``, ``free_thresh`` and ``mode``, where dark pixels are occupied and the first row is the one with the
largest y. Programs write cells as probabilities, percentages, or unknown. Point clouds are xyz text, PCD, and PLY (G.
Turk, "The PLY polygon file format").
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import SMALLEST, ArrayLike, BoolArray, FloatArray, NDArray
from minsnap.basics.checks import check_number, is_number
from minsnap.basics.messages import shown
from minsnap.basics.schema import ANY, FLAG, NUMBER, TEXT, WHOLE, Key, either, from_to, mapping, several, word
from minsnap.basics.storage.text import LARGEST, FileName, load_yaml, read_bytes, read_text, reading
from minsnap.errors import CorridorError, FileError
from minsnap.paths.routes.grid_map import LARGEST_MAP, GridMap

UNKNOWN = ("occupied", "free")
"""What unknown cells may count as."""

PROBABILITY = from_to(NUMBER, 0.0, 1.0)
MAP = mapping(
    {
        "image": Key(TEXT, "name of a PGM or PNG file", needed=True),
        "resolution": Key(NUMBER, "side of a pixel [m]", needed=True),
        "origin": Key(several(NUMBER, "x, y [m] and yaw of the lower left corner", 2, 3), needed=True),
        "negate": Key(either(FLAG, WHOLE), "light pixels are occupied"),
        "occupied_thresh": Key(PROBABILITY),
        "free_thresh": Key(PROBABILITY),
        "mode": Key(word("trinary", "scale", "raw")),
        "map_type": Key(ANY, "nav2's name for a grid, which is not needed"),
    },
    "a mapping with image, resolution and origin",
)
"""The description of a map."""


@dataclass(frozen=True)
class Reading:
    """How the values of cells are read.

    Parameters
    ----------
    threshold : float or None
        Probability from which a cell is occupied, in (0, 1]; 0.5, or what the map says, by default.
    unknown : {"occupied", "free"}
        What cells count as of which nothing is known.

    Raises
    ------
    CorridorError
        If the threshold is no probability above 0, or the choice is none of the two.
    """

    threshold: float | None = None
    unknown: str = "occupied"

    def __post_init__(self) -> None:
        if self.threshold is not None and not (is_number(self.threshold) and 0.0 < self.threshold <= 1.0):
            raise CorridorError(f"the threshold is {self.threshold!r}: it is a probability, above 0 and at most 1")
        if not isinstance(self.unknown, str) or self.unknown not in UNKNOWN:
            raise CorridorError(f"unknown cells count as 'occupied' or 'free', not as {shown(self.unknown)}")

    def occupied(self, values: NDArray[Any], name: str = "the map") -> BoolArray:
        """Return which cells are occupied.

        Parameters
        ----------
        values : ndarray of bool, integers or floats
            Booleans: True where occupied. Integers: 0 and 1; or percentages up to 100; with unknown cells below 0.
            One integer above 100 beside 0, such as 255, means occupied. Floats: probabilities up to 1, with unknown
            cells below 0 or not a number.
        name : str
            What messages call the map.

        Raises
        ------
        CorridorError
            If values are of another kind, or beyond their range.
        """
        if values.dtype.kind == "b":
            return np.asarray(values, dtype=np.bool_)
        if values.dtype.kind not in "iuf":
            raise CorridorError(f"{name} holds {values.dtype}: cells are booleans, integers or probabilities")
        whole = values.dtype.kind in "iu" or bool((values == np.round(values)).all())
        scale = _scale(values, whole, name)
        return self.by_probability(np.asarray(values, dtype=np.float32) / np.float32(scale))

    def by_probability(self, probability: NDArray[np.float32]) -> BoolArray:
        """Return which cells are occupied, from probabilities; below 0 and not a number are unknown."""
        with np.errstate(invalid="ignore"):
            known = probability >= 0.0
            taken = probability >= np.float32(0.5 if self.threshold is None else self.threshold)
        return np.asarray(np.where(known, taken, self.unknown == "occupied"))


def _scale(values: NDArray[Any], whole: bool, name: str) -> float:
    """Return the value that means certainly occupied."""
    largest = float(np.nanmax(values)) if np.isfinite(values).any() else 0.0
    if largest <= 1.0:
        return 1.0
    if whole and largest <= 100.0:
        return 100.0
    if whole and ((values == 0) | (values == largest) | (values < 0)).all() and np.isfinite(largest):
        return largest
    raise CorridorError(
        f"{name} has values up to {largest:g}: cells are 0 and 1, probabilities up to 1, or whole percentages up to 100"
    )


def read_map_yaml(path: FileName, how: Reading) -> GridMap:
    """Read a map_server YAML file and its picture.

    Probabilities are (255 - value) / 255, or value / 255 with ``negate``. In the modes trinary (the default) and scale,
    a cell is occupied above ``occupied_thresh``, free below ``free_thresh``, and unknown between; in raw, values are
    percentages and those above 100 unknown. What is not opaque is unknown. A threshold of ``how`` takes precedence over
    both.

    Raises
    ------
    FileError
        If a file cannot be read, an entry is missing, unknown or malformed, or the origin is turned.
    """
    content = read_map_entries(path)
    low, high = content.get("free_thresh", 0.25), content.get("occupied_thresh", 0.65)
    if low > high:
        raise FileError(f"{path}: free_thresh is {low!r} and occupied_thresh {high!r}: two probabilities, in order")
    picture = read_picture(Path(path).parent / content["image"])
    chance = _probability(picture, content, (low, high), how.threshold is None)
    kept = Reading(0.5 if how.threshold is None else how.threshold, how.unknown)
    cells = kept.by_probability(np.ascontiguousarray(chance[::-1].T))
    return GridMap(cells, np.full(2, content["resolution"]), np.array(content["origin"][:2]), Path(path).name)


def read_map_entries(path: FileName) -> dict[str, Any]:
    """Return the entries of a map_server YAML file, checked.

    Raises
    ------
    FileError
        If one is missing, unknown or malformed.
    """
    content: dict[str, Any] = MAP.read(f"{path}", load_yaml(path))
    side, turn = content["resolution"], sum(content["origin"][2:])
    if side <= 0.0:
        raise FileError(f"{path}: resolution is {side:g}: give the side of a pixel [m], which is positive")
    if turn != 0.0:
        raise FileError(f"{path}: the map is turned by {turn:g} rad: turn the picture instead, with a yaw of 0")
    return content


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


CLOUDS = (".pcd", ".ply", ".xyz")
"""Endings of point clouds."""

ENDINGS = (".yaml", ".yml", ".npy", *CLOUDS)
"""Endings of maps."""


def read_map(
    path: FileName,
    resolution: float | None = None,
    origin: ArrayLike | None = None,
    threshold: float | None = None,
    unknown: str = "occupied",
    ends: ArrayLike = (),
    clearance: float = 0.0,
) -> GridMap:
    """Read a map.

    Parameters
    ----------
    path : str or path
        map_server YAML with its picture; ``.npy`` with two or three axes, x, y and z; a point cloud in ``.pcd``,
        ``.ply`` or ``.xyz``.
    resolution : float, optional
        Side of a cell [m]; needed unless the map is YAML, which says it.
    origin : array_like, shape (dim,), optional
        Outer corner of cell (0, 0, 0) of an array [m]; by default zero.
    threshold : float, optional
        Probability from which a cell is occupied; 0.5, or what the YAML says.
    unknown : {"occupied", "free"}
        What unknown cells count as.
    ends : array_like, shape (m, 3), optional
        Points that the map of a point cloud must hold [m].
    clearance : float
        [m]; the map of a point cloud reaches so far past its points, and a metre.

    Returns
    -------
    GridMap

    Raises
    ------
    FileError
        If the file cannot be read or is malformed.
    CorridorError
        If an argument is malformed, missing, or does not go with the file.
    """
    ending, how = Path(path).suffix.lower(), Reading(threshold, unknown)
    if ending in (".yaml", ".yml"):
        if resolution is not None or origin is not None:
            raise CorridorError(f"{path} says its resolution and origin: leave them out")
        return read_map_yaml(path, how)
    if ending not in ENDINGS:
        raise FileError(f"{path} is no map: give one that ends in {', '.join(ENDINGS)}")
    if resolution is None:
        raise CorridorError(f"{path} does not say how large its cells are: give the resolution [m]")
    give = "give the side of a cell [m]"
    side = float(check_number("the resolution", resolution, SMALLEST, inf, give, CorridorError))
    if ending in CLOUDS:
        points = np.asarray(ends, dtype=np.float64)
        if origin is not None or threshold is not None:
            raise CorridorError(f"{path} is a point cloud: it has its own coordinates and no probabilities")
        if points.size and points.shape[-1] != 3:
            raise CorridorError(f"{path} is a map in space: give start and goal with three coordinates")
        return cloud_map(read_cloud(path), side, points.reshape(-1, 3), clearance, Path(path).name)
    return array_map(read_array(path), side, origin, how, Path(path).name)


def array_map(
    values: ArrayLike, resolution: ArrayLike, origin: ArrayLike | None, how: Reading, name: str = "the map"
) -> GridMap:
    """Return the map of an array of cells; :class:`minsnap.paths.routes.map_files.Reading` says what they mean."""
    cells = np.asarray(values)
    if cells.ndim not in (2, 3) or not cells.size or cells.size > LARGEST_MAP:
        raise CorridorError(
            f"{name} has shape {cells.shape}: a map has 2 or 3 axes, x, y and z, and at most {LARGEST_MAP} cells"
        )
    return GridMap(how.occupied(cells, name), resolution, origin, name)


def read_array(path: FileName) -> NDArray[Any]:
    """Return the array of an ``.npy`` file; objects are never loaded."""
    with reading(path, "an array of numbers", LARGEST):
        cells = np.load(path, allow_pickle=False, mmap_mode="r")
        if not isinstance(cells, np.ndarray):
            raise ValueError("an archive")
        return cells


MOST_POINTS = 100_000_000


def decompress(block: bytes, size: int) -> bytes:
    """Return the content of an LZF block.

    A control byte below 32 is followed by that many bytes and one more as they are; another one holds, in its upper 3
    bits, the length of a repetition less 2 (7: a byte to add follows) and, in its lower 5 and the next byte, its
    distance back less 1.

    Parameters
    ----------
    block : bytes
    size : int
        Bytes of the content.

    Raises
    ------
    ValueError
        If the block is damaged.
    """
    output, at = bytearray(), 0
    while at < len(block) and len(output) <= size:
        control = block[at]
        at += 1
        if control < 32:
            output += block[at : at + control + 1]
            at += control + 1
            continue
        length = control >> 5
        if length == 7:
            length += block[at]
            at += 1
        back = ((control & 31) << 8) + block[at] + 1
        at += 1
        _repeat(output, back, length + 2)
    if len(output) != size:
        raise ValueError("a block of another size than it should have")
    return bytes(output)


def _repeat(output: bytearray, back: int, length: int) -> None:
    """Append bytes from some way back; the repetition may run into itself."""
    start = len(output) - back
    if start < 0:
        raise ValueError("a reference to data before the block")
    piece = bytes(output[start : start + length])
    output += (piece * (length // len(piece) + 1))[:length]


def read_pcd(path: FileName) -> FloatArray:
    """Return the coordinates of a PCD file: (n, 3) [m].

    Raises
    ------
    FileError
        If it cannot be read, or is not such a file with fields x, y and z.
    """
    with reading(path, "a point cloud in PCD"):
        header, body = _split(path, read_bytes(path))
        layout = _layout(header)
        count = int(header["POINTS"][0])
        if not 0 <= count <= MOST_POINTS or not {"x", "y", "z"} <= set(layout.names or ()):
            raise FileError(f"{path} has no fields x, y and z, or too many points")
        rows = _rows(header["DATA"][0], body, layout, count)
        return np.stack([np.asarray(rows[axis], dtype=np.float64) for axis in "xyz"], axis=-1)


def _split(path: FileName, content: bytes) -> tuple[dict[str, list[str]], bytes]:
    """Return the entries of the header, and the rest of the file."""
    entries: dict[str, list[str]] = {}
    at = 0
    while "DATA" not in entries:
        end = content.find(b"\n", at)
        if end < 0 or at > 10_000:
            raise FileError(f"{path} has no line DATA: it is no point cloud in PCD")
        words = content[at:end].decode("ascii").split("#")[0].split()
        entries |= {words[0]: words[1:]} if words else {}
        at = end + 1
    return entries, content[at:]


def _layout(header: Mapping[str, list[str]]) -> np.dtype[Any]:
    """Return the type of a point; fields of several numbers are kept, those without a name get one."""
    names = [name if name != "_" else f"_{i}" for i, name in enumerate(header["FIELDS"])]
    counts = [int(count) for count in header.get("COUNT", ["1"] * len(names))]
    kinds = [f"<{kind.lower()}{int(size)}" for kind, size in zip(header["TYPE"], header["SIZE"], strict=True)]
    fields = zip(names, kinds, counts, strict=True)
    return np.dtype([(name, kind, (count,)) if count > 1 else (name, kind) for name, kind, count in fields])


def _rows(data: str, body: bytes, layout: np.dtype[Any], count: int) -> Mapping[str, Any]:
    names = layout.names or ()
    if data == "ascii":
        places = np.cumsum([0] + [int(np.prod(layout[name].shape)) for name in names])
        values = np.array(body.split(), dtype=np.float64).reshape(count, places[-1])
        return {name: values[:, place] for name, place in zip(names, places, strict=False)}
    if data == "binary":
        return np.frombuffer(body, dtype=layout, count=count)  # type: ignore[return-value]
    if data != "binary_compressed":
        raise FileError(f"DATA is {data[:20]!r}: it is ascii, binary or binary_compressed")
    packed, size = struct.unpack("<II", body[:8])
    if size != count * layout.itemsize:
        raise ValueError("a block of another size than its points need")
    block, ends = decompress(body[8 : 8 + packed], size), count * np.cumsum([layout[name].itemsize for name in names])
    starts = [0, *ends.tolist()]
    return {name: np.frombuffer(block, layout[name], count, at) for name, at in zip(names, starts, strict=False)}


TYPES = {"char": "int8", "uchar": "uint8", "int": "int32", "uint": "uint32", "float": "float32"}
"""Types of PLY whose names mean another type to NumPy, or none."""

ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
END = b"end_header"

BEYOND = 1.0
"""Margin of a map around the points, start, goal and clearance: room to pass around and above [m]."""


def read_ply(path: FileName) -> FloatArray:
    """Return the coordinates of the vertices of a PLY file: (n, 3) [m].

    Raises
    ------
    FileError
        If it cannot be read, or is not such a file whose first element are vertices with x, y and z.
    """
    with reading(path, "a point cloud in PLY"):
        content = read_bytes(path)
        end = content.find(END)
        if not content.startswith(b"ply") or end < 0:
            raise FileError(f"{path} is not a point cloud in PLY: it has no header")
        lines = [line.split() for line in content[:end].decode("ascii").splitlines()]
        body = content[content.index(b"\n", end) + 1 :]
        form = next(line[1] for line in lines if line[:1] == ["format"])
        count, names, types = _vertices(path, lines)
        if form == "ascii":
            rows = np.array([line.split() for line in body.splitlines()[:count]], dtype=np.float64)
            return rows.reshape(count, len(names))[:, [names.index(axis) for axis in "xyz"]]
        layout = np.dtype([(name, ORDERS[form] + kind) for name, kind in zip(names, types, strict=True)])
        vertices: Any = np.frombuffer(body, dtype=layout, count=count)
        return np.stack([np.asarray(vertices[axis], dtype=np.float64) for axis in "xyz"], axis=-1)


def _vertices(path: FileName, lines: list[list[str]]) -> tuple[int, list[str], list[str]]:
    """Return number, names and types of the properties of the vertices, which come first."""
    elements = [i for i, line in enumerate(lines) if line[:1] == ["element"]]
    if not elements or lines[elements[0]][1] != "vertex":
        raise FileError(f"{path}: the vertices must come first")
    last = elements[1] if len(elements) > 1 else len(lines)
    properties = [line for line in lines[elements[0] : last] if line[:1] == ["property"]]
    if any(line[1] == "list" for line in properties):
        raise FileError(f"{path}: a vertex has a list: only single numbers are read")
    kinds = [np.dtype(TYPES.get(line[1], line[1])).str[1:] for line in properties]
    return int(lines[elements[0]][2]), [line[2] for line in properties], kinds


def read_cloud(path: FileName) -> FloatArray:
    """Return the points of a ``.pcd``, ``.ply`` or ``.xyz`` file, those that are not finite left out: (n, 3) [m].

    Raises
    ------
    FileError
        If it cannot be read, is damaged, or holds no points in space.
    """
    ending = Path(path).suffix.lower()
    points = {".pcd": read_pcd, ".ply": read_ply, ".xyz": read_xyz}[ending](path)
    kept = points[np.isfinite(points).all(axis=1)]
    if not len(kept):
        raise FileError(f"{path} holds no points")
    return np.asarray(kept)


def read_xyz(path: FileName) -> FloatArray:
    """Return the points of a text file with x, y, z first in every row; further columns and # comments are left out."""
    lines = [line.split("#")[0].strip() for line in read_text(path).splitlines()]
    rows = [line.split("," if "," in line else None)[:3] for line in lines if line]  # a comma is no decimal point
    if any(len(row) < 3 for row in rows):
        raise FileError(f"{path}: a row has fewer than three numbers: every row is x y z")
    with reading(path, "a list of points, x y z in every row, with a point for decimals"):
        return np.array(rows, dtype=np.float64).reshape(-1, 3)


def cloud_map(
    points: FloatArray, resolution: float, ends: FloatArray, clearance: float, name: str = "the cloud"
) -> GridMap:
    """Return a map whose occupied cells hold points; all others are free.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        [m].
    resolution : float
        Side of a cell [m].
    ends : ndarray, shape (m, 3)
        Further points that the map must hold, such as start and goal [m].
    clearance : float
        [m]; the map reaches so far, and ``BEYOND``, past all points but below the lowest.
    name : str
        What messages call it.

    Raises
    ------
    CorridorError
        If the map has too many cells, or the points are so far from the origin that no cell can be told from the next.
    """
    around = np.full(3, clearance + BEYOND)
    everything = np.vstack((points, ends))
    low = everything.min(axis=0) - around * [1.0, 1.0, 0.0]
    shape = np.ceil((everything.max(axis=0) + around - low) / resolution)
    if not np.prod(shape) <= LARGEST_MAP:
        raise CorridorError(
            f"{name} with cells of {resolution:g} m would have {np.prod(shape):.3g} of them: at most {LARGEST_MAP} are "
            "searched; give a larger resolution, or cut it"
        )
    if not shape.all():
        raise CorridorError(
            f"{name} lies up to {np.abs(everything).max():.3g} m from the origin, where floating-point numbers are "
            f"farther apart than {clearance + BEYOND:g} m: check its coordinates and their unit"
        )
    occupied = np.zeros(shape.astype(np.intp), dtype=np.bool_)
    cells = np.minimum(np.floor((points - low) / resolution), shape - 1).astype(np.intp)
    occupied[tuple(cells.T)] = True
    return GridMap(occupied, np.full(3, resolution), low, name)

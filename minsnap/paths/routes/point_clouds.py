"""Point clouds: xyz text, PLY (G. Turk, "The PLY polygon file format"), and the choice of a reader by the ending."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.text import FileName, check_size, read_text, reading
from minsnap.errors import CorridorError, FileError
from minsnap.paths.routes.grid_map import LARGEST_MAP, GridMap

KINDS = {"F": "f", "I": "i", "U": "u"}
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
    check_size(path)
    with reading(path, "a point cloud in PCD"):
        header, body = _split(path, Path(path).read_bytes())
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
    kinds = [f"<{KINDS[kind]}{int(size)}" for kind, size in zip(header["TYPE"], header["SIZE"], strict=True)]
    fields = zip(names, kinds, counts, strict=True)
    return np.dtype([(name, kind, (count,)) if count > 1 else (name, kind) for name, kind, count in fields])


def _rows(data: str, body: bytes, layout: np.dtype[Any], count: int) -> Mapping[str, Any]:
    if data == "ascii":
        return _text_rows(body, layout, count)
    if data == "binary":
        return np.frombuffer(body, dtype=layout, count=count)  # type: ignore[return-value]
    if data != "binary_compressed":
        raise FileError(f"DATA is {data[:20]!r}: it is ascii, binary or binary_compressed")
    packed, size = struct.unpack("<II", body[:8])
    if size != count * layout.itemsize:
        raise ValueError("a block of another size than its points need")
    return _columns(decompress(body[8 : 8 + packed], size), layout, count)


def _text_rows(body: bytes, layout: np.dtype[Any], count: int) -> Mapping[str, Any]:
    width = sum(int(np.prod(layout[name].shape)) for name in layout.names or ())
    values = np.array(body.split(), dtype=np.float64).reshape(count, width)
    places = np.cumsum([0] + [int(np.prod(layout[name].shape)) for name in layout.names or ()])
    return {name: values[:, place] for name, place in zip(layout.names or (), places, strict=False)}


def _columns(block: bytes, layout: np.dtype[Any], count: int) -> Mapping[str, Any]:
    """Return the fields of a block that holds one field of all points after the other."""
    columns, at = {}, 0
    for name in layout.names or ():
        field = layout[name]
        columns[name] = np.frombuffer(block, dtype=field, count=count, offset=at)
        at += count * field.itemsize
    return columns


TYPES = {"char": "int8", "uchar": "uint8", "int": "int32", "uint": "uint32", "float": "float32"}
"""Types of PLY whose names mean another type to NumPy, or none."""

ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
END = b"end_header"

CLOUDS = (".pcd", ".ply", ".xyz")
"""Endings of point clouds."""

BEYOND = 1.0
"""Margin of a map around the points, start, goal and clearance: room to pass around and above [m]."""


def read_ply(path: FileName) -> FloatArray:
    """Return the coordinates of the vertices of a PLY file: (n, 3) [m].

    Raises
    ------
    FileError
        If it cannot be read, or is not such a file whose first element are vertices with x, y and z.
    """
    check_size(path)
    with reading(path, "a point cloud in PLY"):
        content = Path(path).read_bytes()
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
    lines = [line.split("#")[0].replace(",", " ").split() for line in read_text(path).splitlines()]
    rows = [line[:3] for line in lines if line]
    if any(len(row) < 3 for row in rows):
        raise FileError(f"{path}: a row has fewer than three numbers: every row is x y z")
    with reading(path, "a list of points, x y z in every row"):
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

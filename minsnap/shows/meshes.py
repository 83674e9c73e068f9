"""Surfaces of meshes, and points spread over them: Wavefront OBJ, STL and PLY, as text or binary, z up."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.text import FileName, read_bytes, reading
from minsnap.errors import FileError

KINDS = (".obj", ".stl", ".ply")

LARGEST = 1 << 28
"""Bytes of the largest mesh that is read."""

STL_HEAD, STL_FACE = 84, 50
"""Bytes before the faces of a binary STL, and of each: a normal, three corners, two bytes of attributes."""

PLY_KINDS = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"}
PLY_KINDS |= {"double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4"}
PLY_KINDS |= {"uint32": "u4", "float32": "f4", "float64": "f8"}
"""Names of numbers in PLY, and in NumPy."""

PLY_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def read_triangles(file: FileName) -> FloatArray:
    """Return the faces of a mesh as triangles, shape (n, 3, 3); larger faces are fans around a corner.

    A PLY of points alone has a triangle of no extent for each of them.

    Raises
    ------
    FileError
        If the ending is none of ``KINDS``, the file is no such mesh, or its faces have no extent.
    """
    kind = Path(file).suffix.lower()
    if kind not in KINDS:
        raise FileError(f"{file} is no mesh by its ending: give one of {', '.join(KINDS)}")
    with reading(file, f"a mesh in the format {kind[1:].upper()}"):
        content = read_bytes(file, LARGEST)
        made = {".obj": _obj, ".stl": _stl, ".ply": _ply}[kind](content)
        triangles = np.array(made, dtype=np.float64)
    if triangles.ndim != 3 or not len(triangles) or not np.isfinite(triangles).all():
        raise FileError(f"{file} holds no faces of finite vertices: give a mesh with faces")
    if not np.ptp(triangles.reshape(-1, 3), axis=0).any():
        raise FileError(f"all vertices of {file} are one point: give a mesh that has an extent")
    return triangles


def spread(triangles: FloatArray, count: int, drawn: int) -> FloatArray:
    """Return points spread over triangles, shape (count, 3), from ``drawn`` times as many; always the same.

    Each is the farthest from those before, beginning with the lowest one.
    """
    return _farthest(_drawn(triangles, drawn * count), count)


def _fans(corners: FloatArray, faces: Iterator[list[int]]) -> list[FloatArray]:
    return [corners[[face[0], *face[i : i + 2]]] for face in faces for i in range(1, len(face) - 1)]


def _obj(content: bytes) -> list[FloatArray]:
    corners: list[list[float]] = []
    faces: list[list[int]] = []
    for line in content.decode().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            corners.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            numbers = [int(word.split("/")[0]) for word in words[1:]]
            faces.append([number - 1 if number > 0 else len(corners) + number for number in numbers])
    return _fans(np.array(corners, dtype=np.float64).reshape(-1, 3), iter(faces))


def _stl(content: bytes) -> FloatArray:
    count = struct.unpack_from("<I", content, STL_HEAD - 4)[0] if len(content) >= STL_HEAD else -1
    if len(content) == STL_HEAD + STL_FACE * count:
        rows = np.frombuffer(content, np.dtype([("f", "<f4", (4, 3)), ("more", "<u2")]), count, STL_HEAD)
        return np.asarray(rows["f"][:, 1:], dtype=np.float64)
    if not content.lstrip().startswith(b"solid"):
        raise FileError(f"it has {len(content)} bytes, not as many as {count} faces take")
    lines = [line.split() for line in content.decode().splitlines()]
    if not any(line[:1] == ["endsolid"] for line in lines):
        raise FileError("it ends before its endsolid")
    return np.array([line[1:4] for line in lines if line[:1] == ["vertex"]], dtype=np.float64).reshape(-1, 3, 3)


def _ply(content: bytes) -> list[FloatArray] | FloatArray:
    head, _, body = content.partition(b"end_header")
    lines = [line.split() for line in head.decode().splitlines()]
    form = next(line[1] for line in lines if line[:1] == ["format"])
    cells = _Cells(body[body.index(b"\n") + 1 :], PLY_ORDERS[form])
    corners, faces = np.zeros((0, 3)), []
    for name, count, properties in _ply_elements(lines):
        rows = [{key: cells.entry(kinds) for key, kinds in properties.items()} for _ in range(count)]
        if name == "vertex":
            corners = np.array([[row[axis][0] for axis in "xyz"] for row in rows], dtype=np.float64).reshape(-1, 3)
        elif name == "face":
            key = next(key for key in properties if key.startswith("vertex_ind"))
            faces = [[int(corner) for corner in row[key]] for row in rows]
    return _fans(corners, iter(faces)) if faces else np.repeat(corners[:, None], 3, axis=1)


def _ply_elements(lines: list[list[str]]) -> list[tuple[str, int, dict[str, list[str]]]]:
    """Return name, number of rows and properties of each element; a list has the kinds of its length and entries."""
    elements: list[tuple[str, int, dict[str, list[str]]]] = []
    for line in lines:
        if line[:1] == ["element"]:
            elements.append((line[1], int(line[2]), {}))
        elif line[:1] == ["property"]:
            kinds = line[2:4] if line[1] == "list" else line[1:2]
            elements[-1][2][line[-1]] = [PLY_KINDS[kind] for kind in kinds]
    return elements


class _Cells:
    """The numbers of a PLY one after the other: words, or bytes in an order."""

    def __init__(self, body: bytes, order: str) -> None:
        self._words = iter(body.split()) if not order else None
        self._body, self._order, self._at = body, order, 0

    def entry(self, kinds: list[str]) -> list[float]:
        """Return a number, or the entries of a list."""
        return self._take(kinds[-1], 1 if len(kinds) == 1 else int(self._take(kinds[0], 1)[0]))

    def _take(self, kind: str, count: int) -> list[float]:
        if self._words is not None:
            return [float(next(self._words)) for _ in range(count)]
        values = np.frombuffer(self._body, self._order + kind, count, self._at)
        self._at += values.nbytes
        return [float(value) for value in values]


def _drawn(triangles: FloatArray, count: int) -> FloatArray:
    """Return points evenly distributed over the area, or over points alone, the same for the same mesh."""
    a, b, c = triangles.transpose(1, 0, 2)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    if not areas.any():
        return np.asarray(a)
    draw = np.random.default_rng(0)
    which = np.minimum(np.searchsorted(np.cumsum(areas), draw.uniform(0.0, areas.sum(), count)), len(areas) - 1)
    root, share = np.sqrt(draw.uniform(size=(count, 1))), draw.uniform(size=(count, 1))
    return np.asarray(a[which] * (1.0 - root) + b[which] * root * (1.0 - share) + c[which] * root * share)


def _farthest(points: FloatArray, count: int) -> FloatArray:
    """Return points each of which is the farthest from those before, beginning with the lowest."""
    kept = [int(points[:, 2].argmin())]
    distance = np.linalg.norm(points - points[kept[0]], axis=1)
    while len(kept) < count:
        kept.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(points - points[kept[-1]], axis=1))
    return np.asarray(points[kept])

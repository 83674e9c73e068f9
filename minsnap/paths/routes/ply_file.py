"""PLY files (G. Turk, "The PLY polygon file format"): the vertices, in ascii and both binary orders."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.reading import check_size, reading
from minsnap.errors import FileError

TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
END = b"end_header"


def read_ply(path: str | os.PathLike[str]) -> FloatArray:
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


def _vertices(path: str | os.PathLike[str], lines: list[list[str]]) -> tuple[int, list[str], list[str]]:
    """Return number, names and types of the properties of the vertices, which come first."""
    elements = [i for i, line in enumerate(lines) if line[:1] == ["element"]]
    if not elements or lines[elements[0]][1] != "vertex":
        raise FileError(f"{path}: the vertices must come first")
    last = elements[1] if len(elements) > 1 else len(lines)
    properties = [line for line in lines[elements[0] : last] if line[:1] == ["property"]]
    if any(line[1] == "list" for line in properties):
        raise FileError(f"{path}: a vertex has a list: only single numbers are read")
    return int(lines[elements[0]][2]), [line[2] for line in properties], [TYPES[line[1]] for line in properties]

"""Point clouds: PLY (G. Turk, "The PLY polygon file format"), text, tables and arrays; and the map of their cells."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, NDArray
from minsnap.basics.storage.table import LooseColumns, read_loose_table
from minsnap.basics.storage.text import FileName, check_size, read_bytes, read_text, reading
from minsnap.basics.warn import warn_caller
from minsnap.errors import CorridorError, FileError
from minsnap.paths.routes.grid_map import LARGEST_MAP, GridMap
from minsnap.paths.routes.pcd import read_pcd

CLOUDS = (".csv", ".pcd", ".ply", ".xyz")
"""Endings of files that are point clouds."""

LARGEST_TABLE = 64_000_000
"""Bytes of the largest cloud that is read as a table: about two million points."""

LENGTHS = ("m",)
TABLE = LooseColumns(
    known={axis: LENGTHS for axis in "xyz"},
    blank=(),
    headerless=(("x", "y"), ("x", "y", "z")),
    ambiguous=": the points of a cloud are x,y or x,y,z",
)
"""Columns of a cloud as a table."""

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
    """Return the points of a file that ends in one of ``CLOUDS``, those that are not finite left out: (n, dim) [m].

    Raises
    ------
    FileError
        If it cannot be read, is damaged, or holds no points.
    """
    readers = {".csv": read_points_table, ".pcd": read_pcd, ".ply": read_ply, ".xyz": read_xyz}
    return finite_points(path, readers[Path(path).suffix.lower()](path))


def is_cloud(values: NDArray[Any]) -> bool:
    """Whether an array is of points rather than cells: floating-point numbers in two or three columns."""
    return values.ndim == 2 and values.shape[1] in (2, 3) and values.dtype.kind == "f"


def finite_points(path: FileName, points: NDArray[Any]) -> FloatArray:
    """Return those of some points (n, dim) that are finite, and warn of the others, which sensors write for no echo.

    Raises
    ------
    FileError
        If there are none.
    """
    finite = np.isfinite(points).all(axis=1)
    kept = np.asarray(points[finite], dtype=np.float64)
    if not len(kept):
        raise FileError(f"{path} holds no points{' that are finite' if len(points) else ''}")
    if not finite.all():
        lost = f"{len(points) - len(kept)} of {len(points)} points"
        warn_caller(f"{path}: {lost} are not finite, the first is point {int(np.argmin(finite))}: they are left out")
    return kept


def read_points_table(path: FileName) -> FloatArray:
    """Return the points of a table with the columns x, y and z, or x and y, as read_waypoints reads one: (n, dim) [m].

    Raises
    ------
    FileError
        If it cannot be read, is malformed, or has other columns; says which line.
    """
    check_size(path, LARGEST_TABLE)
    table, _ = read_loose_table(path, TABLE)
    missing = [axis for axis in "xy" if axis not in table]
    if missing:
        raise FileError(f"{path}, line 1: no column {', '.join(missing)}; the columns are {','.join(table)}")
    return np.stack([table[axis] for axis in "xyz" if axis in table], axis=-1)


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
    points : ndarray, shape (n, dim)
        [m], in the plane or in space.
    resolution : float
        Side of a cell [m].
    ends : ndarray, shape (m, dim)
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
    dim = points.shape[1]
    around = np.full(dim, clearance + BEYOND)
    everything = np.vstack((points, ends))
    low = everything.min(axis=0) - around * np.array([1.0, 1.0, 0.0])[:dim]
    with np.errstate(over="ignore", invalid="ignore"):  # of coordinates that are no metres
        shape = np.ceil((everything.max(axis=0) + around - low) / resolution)
        count = np.prod(shape)
    if not count <= LARGEST_MAP:
        raise CorridorError(
            f"{name} with cells of {resolution:g} m would have {count:.3g} of them: at most {LARGEST_MAP} are "
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
    return GridMap(occupied, np.full(dim, resolution), low, name)

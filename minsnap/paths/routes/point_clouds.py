"""Point clouds in text: xyz files, and the choice of a reader by the ending of a file."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.reading import reading
from minsnap.basics.storage.text import read_text
from minsnap.errors import CorridorError, FileError
from minsnap.paths.routes.grid_map import LARGEST_MAP, GridMap
from minsnap.paths.routes.pcd_file import read_pcd
from minsnap.paths.routes.ply_file import read_ply

CLOUDS = (".pcd", ".ply", ".xyz")
"""Endings of point clouds."""

BEYOND = 1.0
"""Margin of a map around the points, start, goal and clearance: room to pass around and above [m]."""


def read_cloud(path: str | os.PathLike[str]) -> FloatArray:
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


def read_xyz(path: str | os.PathLike[str]) -> FloatArray:
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

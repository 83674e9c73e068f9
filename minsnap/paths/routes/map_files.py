"""Maps from files and arrays, each read by its ending."""

from __future__ import annotations

from math import inf
from pathlib import Path

import numpy as np

from minsnap.basics.arrays import SMALLEST, ArrayLike, FloatArray, numbers
from minsnap.basics.checks import check_number
from minsnap.basics.messages import shown
from minsnap.basics.storage.text import FileName
from minsnap.errors import CorridorError, FileError
from minsnap.paths.routes.cell_values import Reading, read_array
from minsnap.paths.routes.clouds import CLOUDS, cloud_map, finite_points, is_cloud, read_cloud
from minsnap.paths.routes.grid_map import LARGEST_MAP, GridMap
from minsnap.paths.routes.map_server import read_map_yaml
from minsnap.paths.routes.octomap import TREES, read_octomap

ENDINGS = (".yaml", ".yml", ".npy", *CLOUDS, *TREES)
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
        ``.ply``, ``.xyz``, ``.csv``, or ``.npy`` with floating-point numbers of shape (n, 2) or (n, 3); an octree of
        OctoMap in ``.bt`` or ``.ot``.
    resolution : float, optional
        Side of a cell [m]; needed unless the map is YAML or an octree, which say it.
    origin : array_like, shape (dim,), optional
        Outer corner of cell (0, 0, 0) of an array [m]; by default zero.
    threshold : float, optional
        Probability from which a cell is occupied; 0.5, or what the YAML says.
    unknown : {"occupied", "free"}
        What unknown cells count as.
    ends : array_like, shape (m, 2) or (m, 3), optional
        Points that the map of a point cloud or an octree must hold [m]; an octree of more than 5e7 cells is cut to a
        box around them.
    clearance : float
        [m]; the map of a point cloud reaches so far past its points, and a metre; so does that of an octree whose
        unknown cells are free.

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
    if ending in (".yaml", ".yml", *TREES):
        if resolution is not None or origin is not None:
            raise CorridorError(f"{path} says its resolution and origin: leave them out")
        tree = ending in TREES
        return read_octomap(path, how, _held(path, ends, 3), clearance) if tree else read_map_yaml(path, how)
    if ending not in ENDINGS:
        raise FileError(f"{path} is no map: give one that ends in {', '.join(ENDINGS)}")
    if resolution is None:
        raise CorridorError(f"{path} does not say how large its cells are: give the resolution [m]")
    give = "give the side of a cell [m]"
    side = float(check_number("the resolution", resolution, SMALLEST, inf, give, CorridorError))
    cells = read_array(path) if ending == ".npy" else None
    if cells is not None and not is_cloud(cells):
        return array_map(cells, side, origin, how, Path(path).name)
    if origin is not None or threshold is not None:
        raise CorridorError(f"{path} is a point cloud: it has its own coordinates and no probabilities")
    points = read_cloud(path) if cells is None else finite_points(path, cells)
    return cloud_map(points, side, _held(path, ends, points.shape[1]), clearance, Path(path).name)


def _held(path: FileName, ends: ArrayLike, dim: int) -> FloatArray:
    """Return the points that a map must hold, with as many coordinates as it has axes: (m, dim) [m]."""
    points = numbers(ends)
    if points is None or (points.size and (points.ndim != 2 or points.shape[1] not in (2, 3))):
        raise CorridorError(f"start and goal are {shown(ends)}: give both with two, or both with three coordinates [m]")
    if points.size and points.shape[1] < dim:
        raise CorridorError(f"{path} is a map in space: give start and goal with three coordinates")
    return np.asarray(points.reshape(len(points), -1)[:, :dim] if points.size else np.zeros((0, dim)))


def array_map(
    values: ArrayLike, resolution: ArrayLike, origin: ArrayLike | None, how: Reading, name: str = "the map"
) -> GridMap:
    """Return the map of an array of cells; :class:`minsnap.paths.routes.cell_values.Reading` says what they mean."""
    cells = np.asarray(values)
    if cells.ndim not in (2, 3) or not cells.size or cells.size > LARGEST_MAP:
        raise CorridorError(
            f"{name} has shape {cells.shape}: a map has 2 or 3 axes, x, y and z, and at most {LARGEST_MAP} cells"
        )
    return GridMap(how.occupied(cells, name), resolution, origin, name, unknown=how.counted_unknown(cells))

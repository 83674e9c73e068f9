"""Maps from files and arrays: map_server YAML, NumPy arrays, point clouds."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import is_number
from minsnap.basics.messages import shown
from minsnap.basics.storage.reading import check_size, reading
from minsnap.errors import CorridorError, FileError
from minsnap.paths.routes.grid_map import LARGEST_MAP, GridMap
from minsnap.paths.routes.map_images import Reading, read_map_yaml
from minsnap.paths.routes.point_clouds import CLOUDS, cloud_map, read_cloud

ENDINGS = (".yaml", ".yml", ".npy", *CLOUDS)
"""Endings of maps."""


def read_map(
    path: str | os.PathLike[str],
    resolution: float | None = None,
    origin: npt.ArrayLike | None = None,
    threshold: float | None = None,
    unknown: str = "occupied",
    ends: npt.ArrayLike = (),
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
    side = _needed(path, resolution)
    if ending in CLOUDS:
        if origin is not None or threshold is not None:
            raise CorridorError(f"{path} is a point cloud: it has its own coordinates and no probabilities")
        return cloud_map(read_cloud(path), side, _in_space(path, ends), clearance, Path(path).name)
    if ending != ".npy":
        raise FileError(f"{path} is no map: give one that ends in {', '.join(ENDINGS)}")
    return array_map(read_array(path), side, origin, how, Path(path).name)


def array_map(
    values: npt.ArrayLike, resolution: npt.ArrayLike, origin: npt.ArrayLike | None, how: Reading, name: str = "the map"
) -> GridMap:
    """Return the map of an array of cells; :class:`minsnap.paths.routes.map_images.Reading` says what they mean."""
    cells = np.asarray(values)
    if cells.ndim not in (2, 3) or not cells.size or cells.size > LARGEST_MAP:
        raise CorridorError(
            f"{name} has shape {cells.shape}: a map has 2 or 3 axes, x, y and z, and at most {LARGEST_MAP} cells"
        )
    return GridMap(how.occupied(cells, name), resolution, origin, name)  # type: ignore[arg-type]


def _needed(path: str | os.PathLike[str], resolution: Any) -> float:
    if resolution is None:
        raise CorridorError(f"{path} does not say how large its cells are: give the resolution [m]")
    if not is_number(resolution) or resolution <= 0.0:
        raise CorridorError(f"the resolution is {shown(resolution)}: give the side of a cell [m]")
    return float(resolution)


def _in_space(path: str | os.PathLike[str], ends: npt.ArrayLike) -> FloatArray:
    points = np.asarray(ends, dtype=np.float64)
    if points.size and points.shape[-1] != 3:
        raise CorridorError(f"{path} is a map in space: give start and goal with three coordinates")
    return points.reshape(-1, 3)


def read_array(path: str | os.PathLike[str]) -> npt.NDArray[Any]:
    """Return the array of an ``.npy`` file; objects are never loaded."""
    check_size(path)
    with reading(path, "an array of numbers"):
        cells = np.load(path, allow_pickle=False, mmap_mode="r")
        if not isinstance(cells, np.ndarray):
            raise ValueError("an archive")
        return cells

"""Boxes of free space along a path through an occupancy grid, by greedy inflation.

Each box starts from cells of the path and grows by one layer of cells per side in turn until obstacles block every side
(the inflation of F. Gao, W. Wu, Y. Lin and S. Shen, "Online safe trajectory generation for quadrotors using fast
marching method and Bernstein basis polynomial", ICRA 2018); the next one starts where the path leaves it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import BoolArray, FloatArray, numbers
from minsnap.basics.checks import check_array, check_distance, check_waypoints
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.boxes import Boxes
from minsnap.corridors.grid_boxes import inflated, pruned
from minsnap.corridors.grid_gaps import grown
from minsnap.corridors.grid_path import connected, visited
from minsnap.errors import CorridorError


@dataclass(frozen=True, eq=False)
class GridCorridor:
    """Boxes along a path, with the start and end of a curve through them.

    Parameters
    ----------
    boxes : Boxes
        One a leg, each overlapping the next by a cell at least.
    waypoints : ndarray, shape (boxes + 1, dim)
        The path's start, the center of each overlap, the path's end [m].
    """

    boxes: Boxes
    waypoints: FloatArray

    @property
    def start(self) -> dict[str, FloatArray]:
        """Start of the path, in the form that ``plan`` takes."""
        return {"position": self.waypoints[0]}

    @property
    def end(self) -> dict[str, FloatArray]:
        """End of the path, in the form that ``plan`` takes."""
        return {"position": self.waypoints[-1]}


def corridor_from_grid(
    occupancy: npt.ArrayLike,
    resolution: npt.ArrayLike,
    path: npt.ArrayLike,
    origin: npt.ArrayLike | None = None,
    clearance: float = 0.0,
    largest: float = np.inf,
) -> GridCorridor:
    """Inflate axis-aligned boxes of free cells along a path, with redundant boxes removed.

    Parameters
    ----------
    occupancy : array_like, shape (nx, ny) or (nx, ny, nz)
        0 where free, anything else (unknown, too) where not; the axes are x, y and z.
    resolution : float or array_like, shape (dim,)
        Side of a cell [m].
    path : array_like, shape (m, dim)
        Polyline through free cells [m], such as the cells' centers that a graph search gives.
    origin : array_like, shape (dim,), optional
        Outer corner of cell (0, 0, 0) [m]; by default zero.
    clearance : float
        How far the boxes keep from every occupied cell [m]: the vehicle's radius.
    largest : float
        Longest side that a box may have [m].

    Returns
    -------
    GridCorridor

    Raises
    ------
    CorridorError
        If an argument is malformed, or the path leaves the grid or meets a cell that is not free.
    """
    taken = _as_grid(occupancy)
    shapes, give = ((), (1,), (taken.ndim,)), f"one finite number, or {taken.ndim} [m]"
    size = check_array("the resolution", resolution, shapes, give, CorridorError) + np.zeros(taken.ndim)
    start = 0.0 if origin is None else origin
    corner = check_array("the origin", start, shapes, give, CorridorError) + np.zeros(taken.ndim)
    if not (size > 0.0).all():
        raise CorridorError(f"the resolution is {shown(resolution)}: a cell has a positive side [m]")
    points = check_waypoints(path)
    if points.shape[1] != taken.ndim:
        raise CorridorError(f"the path has {points.shape[1]} coordinates and the grid {taken.ndim} axes")
    margin = check_distance("the clearance", clearance, CorridorError)
    return boxes_along(~grown(taken, margin, size), size, corner, points, margin, largest)


def boxes_along(
    free: BoolArray,
    size: FloatArray,
    corner: FloatArray,
    points: FloatArray,
    clearance: float,
    largest: float = np.inf,
) -> GridCorridor:
    """Inflate boxes along a path through cells that are known to be far enough from all that is occupied.

    Parameters
    ----------
    free : ndarray of bool
        Cells that boxes may have.
    size, corner : ndarray, shape (dim,)
        Sides of a cell, outer corner of the first one [m].
    points : ndarray, shape (m, dim)
        The path [m].
    clearance : float
        What ``free`` is the result of, for messages [m].
    largest : float
        Longest side that a box may have [m].

    Returns
    -------
    GridCorridor

    Raises
    ------
    CorridorError
        If the path leaves the grid or meets a cell that is not free.
    """
    way = visited(np.array(free.shape), points, size, corner)
    cells = connected(free, way, size, corner, clearance)
    limit = np.maximum(np.floor(np.minimum(largest / size, np.array(free.shape)) + EXACT), 2).astype(np.intp)
    boxes = pruned(inflated(free, cells, limit), cells[0], cells[-1])
    lower, upper = (corner + size * np.array([box[side] for box in boxes]) for side in (0, 1))
    corridor = Boxes(lower, upper)
    waypoints = np.vstack([points[:1], corridor.passages()[0], points[-1:]])
    waypoints.flags.writeable = False
    return GridCorridor(corridor, waypoints)


def _as_grid(occupancy: npt.ArrayLike) -> BoolArray:
    if numbers(occupancy) is None:
        raise CorridorError("an occupancy grid has 2 or 3 axes of numbers, 0 where free, in rows of equal length")
    grid = np.asarray(occupancy)
    if grid.ndim not in (2, 3) or not grid.size or grid.dtype.kind not in "biuf":
        raise CorridorError(f"an occupancy grid has 2 or 3 axes of numbers, 0 where free, not shape {grid.shape}")
    return np.asarray(grid != 0)

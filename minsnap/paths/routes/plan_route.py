"""plan_through: from a map, a start and a goal to a trajectory and its distance to what is occupied."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_distance
from minsnap.corridors.boxes import Boxes
from minsnap.corridors.occupancy_grid import GridCorridor
from minsnap.errors import CorridorError, WaypointError
from minsnap.limits.limits import Limits
from minsnap.limits.ordinary import ordinary_limits
from minsnap.paths.routes.cell_distance import Approach, nearest_cell
from minsnap.paths.routes.grid_map import GridMap
from minsnap.paths.routes.map_files import Reading, array_map, read_map
from minsnap.paths.routes.passage import end_point, find_passage
from minsnap.planning.planner import plan
from minsnap.time_allocation.search_options import is_priced
from minsnap.trajectory.heading import Heading
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory

FREE_HEIGHT = 1.0
"""Room above and below start and goal for a plan in space through a plane map [m]."""


@dataclass(frozen=True, eq=False)
class Route(Path):
    """A plan through a map; a path like any other.

    Parameters
    ----------
    trajectory : Trajectory
        The plan.
    corridor : Boxes
        Free space along the way, one box per leg, at least the clearance away from what is occupied.
    way : ndarray, shape (legs + 1, dim)
        Start, centers of the overlaps of the boxes, goal [m].
    grid : GridMap
        The map.
    clearance : float
        The least clearance, as requested [m].
    approach : Approach
        The least distance to an occupied cell over all time, and where.
    limits : Limits or None
        Of the plan.
    """

    trajectory: Trajectory
    corridor: Boxes
    way: FloatArray
    grid: GridMap
    clearance: float
    approach: Approach
    limits: Limits | None = None

    @property
    def duration(self) -> float:
        """Length of the interval [s]."""
        return self.trajectory.duration

    @property
    def dim(self) -> int:
        """Number of coordinates."""
        return self.trajectory.dim

    @property
    def yaw(self) -> Heading:  # type: ignore[override]
        """Heading of the plan."""
        return self.trajectory.yaw

    @property
    def distance(self) -> float:
        """Least distance to an occupied cell over all time [m]."""
        return self.approach.distance

    def as_trajectory(self) -> Trajectory:
        """Return the plan."""
        return self.trajectory

    def _evaluate(self, t: FloatArray, order: int) -> FloatArray:
        return self.trajectory._evaluate(t, order)


def plan_through(
    grid: GridMap | str | os.PathLike[str] | npt.ArrayLike,
    start: npt.ArrayLike,
    goal: npt.ArrayLike,
    clearance: float = 0.3,
    *,
    resolution: float | None = None,
    origin: npt.ArrayLike | None = None,
    threshold: float | None = None,
    unknown: str = "occupied",
    altitudes: tuple[float, float] | None = None,
    **planning: Any,
) -> Route:
    """Plan from start to goal through the free cells of a map, at a distance from all that is occupied.

    A graph search takes the shortest way through cells that are far enough from occupied ones, boxes are inflated
    along it, and the curve passes from box to box as :func:`minsnap.plan` plans it. Its distance to the occupied cells
    is measured over all time.

    Parameters
    ----------
    grid : GridMap, path or array_like
        A map; a file as :func:`minsnap.routes.read_map` reads it; or an array of cells with two or three axes, x, y
        and z, 0 where free (see :meth:`minsnap.paths.routes.map_files.Reading.occupied`).
    start, goal : array_like, shape (2,) or (3,)
        Where to fly from and to, at rest [m]. Three coordinates above a plane map plan in space: cells then reach from
        the ground to the sky.
    clearance : float
        Least distance to every occupied cell [m]: the vehicle's radius and what its controller needs.
    resolution, origin, threshold, unknown
        As :func:`minsnap.routes.read_map` takes them, for files and arrays.
    altitudes : (float, float), optional
        Lowest and highest altitude of cells that may be flown through, in a map in space [m].
    **planning
        Further arguments of :func:`minsnap.plan`: ``limits``, ``total_time``, ``yaw``, ``pieces``, … Within 3 m/s and
        6 m/s^2 in the shortest time unless a time or limits are set.

    Returns
    -------
    Route
        A path; ``route.trajectory`` is the plan, ``route.distance`` the least distance to an occupied cell [m].

    Raises
    ------
    WaypointError
        If start or goal is malformed, outside the map, or too near to what is occupied.
    InfeasibleError
        If there is no way with that clearance; says where the widest one is too narrow, and by how much,
        or that occupied cells close all off.
    CorridorError
        If the map or an argument is malformed.
    FileError
        If a file cannot be read.

    Examples
    --------
    >>> import minsnap, numpy as np
    >>> cells = np.zeros((100, 80))
    >>> cells[50, :60] = 1
    >>> route = minsnap.routes.plan_through(cells, (1, 1), (9, 7), clearance=0.3, resolution=0.1)
    >>> bool(route.distance >= 0.3 - 1e-9)
    True
    """
    radius = check_distance("the clearance", clearance, CorridorError)
    reading = {"resolution": resolution, "origin": origin, "threshold": threshold, "unknown": unknown}
    read = _as_map(grid, reading, [start, goal], radius)
    if altitudes is not None:
        read = read.between(*altitudes)
    ends = [end_point(point, read.dim, name) for point, name in ((start, "start"), (goal, "goal"))]
    if ends[0].shape != ends[1].shape or (ends[0] == ends[1]).all():
        raise WaypointError("start and goal are one point, or have different numbers of coordinates: give two points")
    passage = find_passage(read, ends[0][: read.dim], ends[1][: read.dim], radius)
    corridor, way = _lifted(passage, *ends)
    timing = _timed(planning)
    curve = plan(None, corridor=corridor, start={"position": ends[0]}, end={"position": ends[1]}, **timing)
    return Route(curve, corridor, way, read, radius, nearest_cell(curve, read), timing.get("limits"))


def _as_map(
    grid: GridMap | str | os.PathLike[str] | npt.ArrayLike, reading: dict[str, Any], ends: list[Any], clearance: float
) -> GridMap:
    if isinstance(grid, GridMap):
        names = [name for name, value in reading.items() if value not in (None, "occupied")]
        if names:
            raise CorridorError(f"{names[0]} is for files and arrays: a GridMap has it already")
        return grid
    if isinstance(grid, (str, os.PathLike)):
        return read_map(FilePath(grid), **reading, ends=ends, clearance=clearance)
    if reading["resolution"] is None:
        raise CorridorError("the array does not say how large its cells are: give resolution [m]")
    how = Reading(reading["threshold"], reading["unknown"])
    return array_map(grid, reading["resolution"], reading["origin"], how)


def _lifted(corridor: GridCorridor, start: FloatArray, goal: FloatArray) -> tuple[Boxes, FloatArray]:
    """Return boxes and points with altitudes, where start and goal above a plane map have them."""
    boxes, points = corridor.boxes, corridor.waypoints
    if len(start) == points.shape[1]:
        return boxes, points
    low, high = min(start[2], goal[2]) - FREE_HEIGHT, max(start[2], goal[2]) + FREE_HEIGHT
    sides = [np.pad(side, ((0, 0), (0, 1)), constant_values=z) for side, z in ((boxes.lower, low), (boxes.upper, high))]
    lifted = np.column_stack((points, np.linspace(start[2], goal[2], len(points))))
    lifted.flags.writeable = False
    return Boxes(*sides), lifted


def _timed(planning: dict[str, Any]) -> dict[str, Any]:
    """Return arguments of a plan with limits, if neither times nor limits are among them."""
    names = {name for name, value in planning.items() if value is not None}
    if names & {"durations", "total_time", "limits"} or is_priced(planning):
        return planning
    return planning | {"limits": ordinary_limits()}

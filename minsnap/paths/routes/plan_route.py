r"""plan_through: from a map, a start and a goal to a trajectory and its distance to what is occupied.

The squared distance of a curve to a cell is the sum over the axes of :math:`\max(l - x, x - u, 0)^2`. Where every axis
is on one side of the cell, it is a polynomial, which its Bernstein coefficients bound from below; an axis that changes
sides contributes 0 to the bound, and at most the square of what it moves. Intervals are halved until the bound and the
distance at an end agree: both errors fall with the square of the length.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, IntArray, read_only
from minsnap.basics.checks import check_distance
from minsnap.basics.storage.text import FileName
from minsnap.corridors.boxes import Boxes
from minsnap.corridors.occupancy_grid import GridCorridor
from minsnap.errors import CorridorError, WaypointError
from minsnap.limits.limits import Limits
from minsnap.paths.routes.grid_map import GridMap
from minsnap.paths.routes.map_files import Reading, array_map, read_map
from minsnap.paths.routes.passage import end_point, find_passage
from minsnap.paths.shapes import timed
from minsnap.planning.planner import plan
from minsnap.polynomials.bernstein import multiply
from minsnap.polynomials.extrema import CurveParts
from minsnap.trajectory.heading import Heading
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory

AGREED = 1e-9
"""Difference of the bound and the distance that ends the search [m]."""

HALVINGS = 60
"""Times that an interval is halved at most."""


@dataclass(frozen=True)
class Approach:
    """Where a trajectory comes nearest to what is occupied.

    Parameters
    ----------
    distance : float
        Least distance to an occupied cell over all time [m], 0 where it touches one; at most 1e-9 m more than the
        exact one. Infinite if no cell is occupied.
    lower : float
        A bound that the exact distance is not below [m].
    instant : float or None
        When [s].
    cell : tuple of int or None
        The cell that it is near to.
    """

    distance: float
    lower: float
    instant: float | None = None
    cell: tuple[int, ...] | None = None


def nearest_cell(traj: Trajectory, grid: GridMap) -> Approach:
    """Return where a trajectory comes nearest to an occupied cell of a map, over all time.

    Parameters
    ----------
    traj : Trajectory
        Of as many coordinates as the map, or of three above a plane map, whose cells then reach from ground to sky.
    grid : GridMap

    Returns
    -------
    Approach
    """
    from scipy.ndimage import binary_erosion

    cells = np.argwhere(grid.occupied & ~binary_erosion(grid.occupied))  # with a free face, or on the border
    if not len(cells):
        return Approach(np.inf, np.inf)
    return _NearestPairs(_short_arcs(traj, grid), cells, grid).run()


def _short_arcs(traj: Trajectory, grid: GridMap) -> CurveParts:
    """Divide a trajectory until no part is longer than a cell; where they begin, and their widths, are seconds."""
    pieces = np.arange(len(traj.durations))
    short, left = [], CurveParts([traj.control_points[..., : grid.dim]], pieces, traj.breaks[:-1], traj.durations)
    for _ in range(HALVINGS):
        reach = np.linalg.norm(np.diff(left.curves[0], axis=1), axis=2).sum(axis=1)
        long = reach > float(grid.resolution.min())
        short.append(left.chosen(~long))
        if not long.any():
            break
        left = left.chosen(long).halved()
    return CurveParts.joined(short)


class _NearestPairs:
    """Pairs of an arc and a cell that may have the least distance."""

    def __init__(self, arcs: CurveParts, cells: IntArray, grid: GridMap) -> None:
        self.grid = grid
        which, near = self._pairs(arcs, cells)
        self.arcs, self.cells = arcs.chosen(which), cells[near]
        self.best, self.instant, self.cell = np.inf, 0.0, cells[0]
        self.unresolved = np.inf

    def run(self) -> Approach:
        """Halve the arcs of all pairs whose bound is below the least distance so far."""
        for _ in range(HALVINGS):
            bound = self._bounds()
            self._improve()
            open_ = np.sqrt(bound) < self.best - AGREED
            closed = bound[~open_]
            self.unresolved = min(self.unresolved, float(closed.min())) if len(closed) else self.unresolved
            if not open_.any():
                break
            self.arcs, self.cells = self.arcs.chosen(open_).halved(), np.tile(self.cells[open_], (2, 1))
        else:
            self.unresolved = min(self.unresolved, float(self._bounds().min()))
        lower = min(float(np.sqrt(self.unresolved)), self.best)
        return Approach(self.best, lower, self.instant, tuple(int(index) for index in self.cell))

    def _pairs(self, arcs: CurveParts, cells: IntArray) -> tuple[IntArray, IntArray]:
        """Return arcs and cells that may be nearest to each other, by a tree of the cells' centers."""
        from scipy.spatial import cKDTree

        tree = cKDTree(self.grid.center(cells))
        (points,) = arcs.curves
        middle = (points.min(axis=1) + points.max(axis=1)) / 2.0
        radius = np.linalg.norm(points - middle[:, None], axis=2).max(axis=1)
        half = float(np.linalg.norm(self.grid.resolution)) / 2.0
        near, _ = tree.query(middle)
        enough = float((near + radius).min())
        chosen = np.flatnonzero(near - radius - half <= enough)
        balls = tree.query_ball_point(middle[chosen], enough + radius[chosen] + half + AGREED)
        counts = [len(ball) for ball in balls]
        return np.repeat(chosen, counts), np.concatenate([np.asarray(ball, dtype=np.intp) for ball in balls])

    def _sides(self) -> tuple[FloatArray, FloatArray]:
        """Return how far control points are below and above their cell: two arrays (m, n + 1, dim)."""
        low = self.grid.lower + self.grid.resolution * self.cells
        high = self.grid.lower + self.grid.resolution * (self.cells + 1)
        return low[:, None] - self.arcs.curves[0], self.arcs.curves[0] - high[:, None]

    def _bounds(self) -> FloatArray:
        """Return lower bounds of the squared distances, (m,)."""
        below, above = self._sides()
        total = np.zeros((len(below), 2 * below.shape[1] - 1))
        for axis in range(self.grid.dim):
            for side in (below[..., axis], above[..., axis]):
                outside = (side >= 0.0).all(axis=1, keepdims=True)
                total += np.where(outside, multiply(side, side), 0.0)
        return np.asarray(np.maximum(total.min(axis=1), 0.0))

    def _improve(self) -> None:
        """Take the least distance at the ends of the arcs, if it is less than the best."""
        below, above = (side[:, [0, -1]] for side in self._sides())
        distance = np.linalg.norm(np.maximum(np.maximum(below, above), 0.0), axis=2)
        pair, end = np.unravel_index(int(distance.argmin()), distance.shape)
        if distance[pair, end] < self.best:
            self.best, self.cell = float(distance[pair, end]), self.cells[pair]
            self.instant = float(self.arcs.low[pair] + end * self.arcs.width[pair])


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
    grid: GridMap | FileName | ArrayLike,
    start: ArrayLike,
    goal: ArrayLike,
    clearance: float = 0.3,
    *,
    resolution: float | None = None,
    origin: ArrayLike | None = None,
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
        Lowest and highest altitude of cells that may be flown through, in a map in space [m]; the clearance holds to
        the cells above and below, too.
    **planning
        Further arguments of :func:`minsnap.plan`: ``limits``, ``total_time``, ``yaw``, ``pieces``, … Within 3 m/s,
        6 m/s^2 and 30 m/s^3 in the shortest time unless a time or limits are set.

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
        read = replace(read, altitudes=altitudes)  # type: ignore[arg-type]
    ends = [end_point(point, read.dim, name) for point, name in ((start, "start"), (goal, "goal"))]
    if ends[0].shape != ends[1].shape or (ends[0] == ends[1]).all():
        raise WaypointError("start and goal are one point, or have different numbers of coordinates: give two points")
    passage = find_passage(read, ends[0][: read.dim], ends[1][: read.dim], radius)
    corridor, way = _lifted(passage, *ends)
    timing = timed(planning)
    curve = plan(None, corridor=corridor, start={"position": ends[0]}, end={"position": ends[1]}, **timing)
    return Route(curve, corridor, way, read, radius, nearest_cell(curve, read), timing.get("limits"))


def _as_map(
    grid: GridMap | FileName | ArrayLike, reading: dict[str, Any], ends: list[Any], clearance: float
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
    return Boxes(*sides), read_only(lifted)

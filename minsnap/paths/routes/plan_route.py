"""plan_through: from a map, obstacles or points, a start and a goal to a trajectory and its distance to them."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path as FilePath
from typing import Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import ArrayLike, BoolArray, FloatArray, IntArray, numbers, read_only
from minsnap.basics.checks import check_distance, point_text
from minsnap.basics.storage.text import FileName
from minsnap.corridors.half_spaces import Polytopes
from minsnap.corridors.keep_out import Avoided, as_still, clearance_in
from minsnap.corridors.obstacle_margins import in_space
from minsnap.corridors.occupancy_grid import gaps
from minsnap.corridors.tangent_polytopes import polytopes_along, without_needless
from minsnap.corridors.way_around import FreeCells, Kept, cells_around, way_around
from minsnap.durations.search_options import is_priced
from minsnap.errors import CorridorError, MinsnapError, UnprovedError, WaypointError
from minsnap.limits.limits import Limits
from minsnap.native.half_space_sets import HalfSpaceRows
from minsnap.native.map_ways import tangent_planes
from minsnap.paths.routes.cell_values import Reading
from minsnap.paths.routes.grid_map import GridMap
from minsnap.paths.routes.map_files import array_map, read_map
from minsnap.paths.routes.nearness import Approach, nearest_cell, nearest_kept
from minsnap.paths.routes.passage import end_point, find_passage, narrowest, part_of, passage_within
from minsnap.paths.routes.surroundings import bars, flown_box, listed_obstacles, taken, with_obstacles
from minsnap.paths.shapes import timed
from minsnap.planning.other_ways import OTHER_WAYS, Search, least_by_length, other_ways
from minsnap.planning.planner import plan
from minsnap.trajectory.planned_path import PlannedPath
from minsnap.trajectory.trajectory import Trajectory

FREE_HEIGHT = 1.0
"""Room above and below start and goal for a plan in space through a plane map [m]."""


@dataclass(frozen=True, eq=False)
class Route(PlannedPath):
    """A plan through a map, or around obstacles or points; a path like any other.

    Parameters
    ----------
    trajectory : Trajectory
        The plan.
    corridor : Polytopes
        Free space along the way, one polytope a leg, at least the clearance away from all that is occupied.
    way : ndarray, shape (m, dim)
        The line of points from start to goal that the polytopes were laid around [m].
    around : GridMap or Kept
        The map; or obstacles (k, 13), points (n, dim) [m], and prisms.
    clearance : float
        The least clearance, as requested [m].
    approach : Approach
        The least distance to what is occupied over all time, and where.
    limits : Limits or None
        Of the plan.
    """

    trajectory: Trajectory
    corridor: Polytopes
    way: FloatArray
    around: GridMap | Kept
    clearance: float
    approach: Approach
    limits: Limits | None = None

    @property
    def grid(self) -> GridMap | None:
        """The map, where there is one."""
        return self.around if isinstance(self.around, GridMap) else None

    @property
    def distance(self) -> float:
        """Least distance to what is occupied over all time [m]."""
        return self.approach.distance


def plan_through(
    grid: GridMap | FileName | ArrayLike | Any,
    start: ArrayLike,
    goal: ArrayLike,
    clearance: float = 0.3,
    *,
    resolution: float | None = None,
    origin: ArrayLike | None = None,
    threshold: float | None = None,
    unknown: str = "occupied",
    altitudes: tuple[float, float] | None = None,
    avoid: Avoided | Sequence[Avoided] | None = None,
    **planning: Any,
) -> Route:
    """Plan from start to goal through the free cells of a map, or around obstacles or points, at a distance from them.

    A way whose lines have any angle is searched through a grid, polytopes are laid around it as
    :func:`minsnap.routes.corridor` does, and the curve passes from one to the next as :func:`minsnap.plan` plans it.
    Its distance to what is occupied is measured over all time.

    Parameters
    ----------
    grid : GridMap, path, array_like, or obstacles
        A map; a file as :func:`minsnap.routes.read_map` reads it; an array of cells with two or three axes, x, y
        and z, 0 where free (see :meth:`minsnap.paths.routes.cell_values.Reading.occupied`), which needs ``resolution``;
        points, shape (k, 2) or (k, 3) [m]; or ``Cylinder``, ``Ellipsoid``, ``Cuboid`` and ``Prism``.
    start, goal : array_like, shape (2,) or (3,)
        Where to fly from and to, at rest [m]. Three coordinates above a plane map plan in space: cells then reach from
        the ground to the sky.
    clearance : float
        Least distance to all that is occupied [m]: the vehicle's radius and what its controller needs.
    resolution, origin, threshold, unknown
        As :func:`minsnap.routes.read_map` takes them, for files and arrays of cells.
    altitudes : (float, float), optional
        Lowest and highest altitude of cells that may be flown through, in a map in space [m]; the clearance holds to
        the cells above and below, too.
    avoid : obstacle or sequence of obstacles, optional
        To keep out of, or inside of, besides: in a map, each cell that one of them reaches into counts as occupied.
    **planning
        Further arguments of :func:`minsnap.plan`: ``limits``, ``total_time``, ``yaw``, ``pieces``, … Within 3 m/s,
        6 m/s^2 and 30 m/s^3 in the shortest time unless a time or limits are set.

    Returns
    -------
    Route
        A path; ``route.trajectory`` is the plan, ``route.distance`` the least distance to what is occupied [m].

    Raises
    ------
    WaypointError
        If start or goal is malformed, outside the map, or too near to what is occupied.
    InfeasibleError
        If there is no way through a map with that clearance; says where the widest one is too narrow, and by how much,
        or that occupied cells close all off.
    UnprovedError
        If no way around obstacles or points was found.
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
    given = [name for name, value in reading.items() if value not in (None, "occupied")]
    if _without_cells(grid, resolution):
        if given or altitudes is not None:
            raise CorridorError(f"{(*given, 'altitudes')[0]} is for maps: leave it out with obstacles and points")
        return _around(grid, start, goal, radius, planning, as_still(avoid))
    read = with_obstacles(_as_map(grid, reading, given, [start, goal], radius), as_still(avoid))
    if altitudes is not None:
        read = replace(read, altitudes=altitudes)  # type: ignore[arg-type]
    ends = _ends(start, goal, read.dim)
    flat, edges = [end[: read.dim] for end in ends], bars(read)
    way, free = find_passage(read, flat[0], flat[1], radius)

    def fly(way: FloatArray) -> Flown:
        sets = polytopes_along(way, edges, np.zeros((0, read.dim)), radius, box=flown_box(read))
        if len(ends[0]) > read.dim:
            sets, way = _lifted(sets, way, *ends)
        return _planned(way, sets, ends, planning)

    cells = free, read.lower, read.resolution
    flown = _quickest(fly, way, cells, lambda free: passage_within(read, free, flat[0], flat[1]), planning)
    return Route(*flown[:2], read_only(flown.way), read, radius, nearest_cell(flown.curve, read), flown.limits)


def _without_cells(grid: Any, resolution: float | None) -> bool:
    """Whether obstacles or points are given, rather than cells."""
    if isinstance(grid, (GridMap, str, os.PathLike)):
        return False
    if isinstance(grid, list | tuple) and not len(grid):
        raise CorridorError("there is nothing around: give a map, obstacles or points, or plan without them")
    if listed_obstacles(grid):
        return True
    listed = numbers(grid)
    return resolution is None and listed is not None and listed.ndim == 2 and listed.shape[1] in (2, 3)


def _around(
    around: Any,
    start: ArrayLike,
    goal: ArrayLike,
    clearance: float,
    planning: dict[str, Any],
    avoid: Sequence[Avoided],
) -> Route:
    """Plan around obstacles or points."""
    listed = None if listed_obstacles(around) else numbers(around)
    dim = np.size(start) if listed is None else listed.shape[1]
    ends = _ends(start, goal, 3 if dim == 3 else 2)
    kept, more = taken(around, len(ends[0]), clearance)[0], Kept.of(avoid, len(ends[0]), clearance)
    kept = kept.with_more(more)
    for end, name in zip(ends, ("start", "goal"), strict=True):
        _check_end(end, name, kept)
    way = way_around(kept, ends[0], ends[1])
    if way is None:
        raise UnprovedError(
            f"no way from {point_text(ends[0])} m to {point_text(ends[1])} m with a clearance of {clearance:g} m was "
            f"found: {_widest_around(kept, ends)}"
        )

    def fly(way: FloatArray) -> Flown:
        sets = polytopes_along(way, kept.obstacles, kept.points, clearance, prisms=kept.prisms)
        return _planned(way, sets, ends, planning)

    grid = next(cells_around(kept, ends[0], ends[1]))
    cells = grid.free, grid.lower, np.full(grid.dim, grid.size)
    flown = _quickest(fly, way, cells, partial(grid.way_within, ends[0], ends[1]), planning)
    approach = nearest_kept(flown.curve, kept)
    return Route(*flown[:2], read_only(flown.way), kept, clearance, approach, flown.limits)


def _widest_around(kept: Kept, ends: list[FloatArray]) -> str:
    """Say about how wide the widest way around obstacles or points is, and where, as far as grids tell."""
    closed = "cells are too coarse beside start or goal"
    for cells in cells_around(kept._replace(clearance=0.0), ends[0], ends[1]):
        first, last = (cells.beside(end) for end in ends)
        if first is None or last is None:
            continue
        closed = f"in cells of {cells.size:.2g} m, ways end at {_end_of_ways(cells, first, ends[1])}"
        size = np.full(len(ends[0]), cells.size)
        gap = gaps(~cells.free, size)
        found = narrowest(gap, cells.free, size, first, last)
        if found is not None:
            place = cells.center(found[1])
            room = _room_at(place, kept, found[0] + 2.0 * cells.size)
            where = point_text(np.round(place, 2))
            return f"the widest one has about {room:.2g} m on each side, near {where} m"
    return f"none was found without any clearance either: {closed}"


def _end_of_ways(cells: FreeCells, first: IntArray, goal: FloatArray) -> str:
    """Return where ways from a cell come nearest to the goal, and how near."""
    reached = cells.center(np.argwhere(part_of(cells.free, first)))
    apart = np.linalg.norm(reached - goal, axis=1)
    end = int(apart.argmin())
    return f"{point_text(np.round(reached[end], 2))} m, {apart[end]:.3g} m from the goal"


def _room_at(place: FloatArray, kept: Kept, reach: float) -> float:
    """Return the distance of a place to what is kept away from, if it is less than the reach [m]."""
    near = tangent_planes(np.stack((place, place)), kept.obstacles, kept.points, 0.0, reach)
    prisms = [] if kept.prisms is None else kept.prisms.prisms
    return min([float(near.distance[0]), *(float(each.clearances(place)) for each in prisms)])


def _check_end(point: FloatArray, name: str, kept: Kept) -> None:
    """Raise WaypointError if a point is nearer to something than the clearance."""
    clearance, wanted = kept.clearance, f"and the clearance is {kept.clearance:g} m: move it"
    for fence in [] if kept.prisms is None else kept.prisms.prisms:
        inside = float(fence.clearances(point))
        if inside < (clearance if fence.inclusion else 0.0):
            where = "outside of" if fence.inclusion and inside < 0.0 else "inside"
            what = "the fence" if fence.inclusion else "a prism"
            raise WaypointError(f"the {name} {point_text(point)} m is {where} {what} by {abs(inside):.3g} m, {wanted}")
    near = tangent_planes(np.stack((point, point)), kept.obstacles, kept.points, clearance, max(clearance, 1e-3))
    distance, which = float(near.distance[0]), int(near.nearest[0])
    gaps = [] if kept.prisms is None else [float(kept.prisms.gaps(point, part)) for part in range(len(kept.prisms))]
    if gaps and min(gaps) < min(distance, clearance):
        raise WaypointError(f"the {name} {point_text(point)} m is {min(gaps):.3g} m from a prism, {wanted}")
    if distance < clearance or distance == 0.0:
        what = f"obstacle {which}" if which < len(kept.obstacles) else f"point {which - len(kept.obstacles)}"
        short = f"{distance:.3g} m from {what}"
        if distance == 0.0 and which < len(kept.obstacles):
            short = f"{-clearance_in(kept.obstacles[which], in_space(point)):.3g} m inside {what}"
        raise WaypointError(f"the {name} {point_text(point)} m is {short}, {wanted}")


class Flown(NamedTuple):
    """A plan along a way, and the polytopes that it is in."""

    curve: Trajectory
    corridor: Polytopes
    way: FloatArray
    limits: Limits | None


def _planned(way: FloatArray, sets: list[HalfSpaceRows], ends: list[FloatArray], planning: dict[str, Any]) -> Flown:
    """Plan from polytope to polytope, without those that others make needless."""
    corridor, timing = Polytopes([sets[index] for index in without_needless(sets)]), timed(planning)
    curve = plan(None, corridor=corridor, start={"position": ends[0]}, end={"position": ends[1]}, **timing)
    return Flown(curve, corridor, way, timing.get("limits"))


def _quickest(
    fly: Callable[[FloatArray], Flown],
    way: FloatArray,
    cells: tuple[BoolArray, FloatArray, FloatArray],
    search: Search,
    planning: dict[str, Any],
) -> Flown:
    """Plan along a way, and where its bends cost time along others; return the quickest flight."""
    best = fly(way)
    fixed = is_priced(planning) or any(planning.get(name) is not None for name in ("durations", "total_time", "search"))
    if fixed or not isinstance(best.limits, Limits) or len(way) < 3:
        return best
    least = least_by_length(way, best.limits)
    if best.curve.duration - least < OTHER_WAYS.gain * best.curve.duration:
        return best
    for other in other_ways(*cells, way, best.curve, search):
        if least_by_length(other, best.limits) >= best.curve.duration:
            continue
        try:
            found = fly(other)
        except MinsnapError:  # the first one flies
            continue
        best = found if found.curve.duration < best.curve.duration else best
    return best


def _ends(start: ArrayLike, goal: ArrayLike, dim: int) -> list[FloatArray]:
    ends = [end_point(point, dim, name) for point, name in ((start, "start"), (goal, "goal"))]
    if ends[0].shape != ends[1].shape or (ends[0] == ends[1]).all():
        raise WaypointError("start and goal are one point, or have different numbers of coordinates: give two points")
    return ends


def _as_map(
    grid: GridMap | FileName | ArrayLike, reading: dict[str, Any], given: list[str], ends: list[Any], clearance: float
) -> GridMap:
    if isinstance(grid, GridMap):
        if given:
            raise CorridorError(f"{given[0]} is for files and arrays: a GridMap has it already")
        return grid
    if isinstance(grid, (str, os.PathLike)):
        return read_map(FilePath(grid), **reading, ends=ends, clearance=clearance)
    if reading["resolution"] is None:
        raise CorridorError("the array does not say how large its cells are: give resolution [m]")
    how = Reading(reading["threshold"], reading["unknown"])
    return array_map(grid, reading["resolution"], reading["origin"], how)


def _lifted(
    sets: list[HalfSpaceRows], way: FloatArray, start: FloatArray, goal: FloatArray
) -> tuple[list[HalfSpaceRows], FloatArray]:
    """Return polytopes and points with altitudes, where start and goal above a plane map have them."""
    low, high = min(start[2], goal[2]) - FREE_HEIGHT, max(start[2], goal[2]) + FREE_HEIGHT
    up, ends = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]), np.array([high, -low])
    lifted = [(np.vstack((np.pad(A, ((0, 0), (0, 1))), up)), np.concatenate((b, ends))) for A, b in sets]
    return lifted, np.column_stack((way, np.linspace(start[2], goal[2], len(way))))

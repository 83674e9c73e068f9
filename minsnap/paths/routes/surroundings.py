"""What a flight keeps away from, as the generator of corridors takes it: obstacles, points, or the cells of a map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, numbers
from minsnap.basics.checks import check_distance, check_finite, check_positive, check_waypoints
from minsnap.basics.messages import shown
from minsnap.corridors.half_spaces import Polytopes
from minsnap.corridors.keep_out import Avoided, as_still, clearances_of
from minsnap.corridors.moving import Moving
from minsnap.corridors.obstacle_margins import in_space
from minsnap.corridors.occupancy_grid import dilated
from minsnap.corridors.prism import Prism
from minsnap.corridors.tangent_polytopes import NOTHING, TANGENT, polytopes_along
from minsnap.corridors.way_around import Kept
from minsnap.errors import CorridorError
from minsnap.paths.routes.grid_map import GridMap

Box = tuple[FloatArray, FloatArray]


def corridor(around: Any, path: ArrayLike, clearance: float = 0.0, *, reach: float = TANGENT.reach) -> Polytopes:
    """Return convex polytopes around the segments of a line, away from all that is occupied.

    Each polytope holds its segment. Its planes touch what is nearest, moved back by the clearance, so that every point
    of it has the clearance; it ends at the reach, and at the borders of a map (S. Liu and others, "Planning dynamically
    feasible trajectories for quadrotors using safe flight corridors in 3-D complex environments", IEEE RA-L 2017).

    Parameters
    ----------
    around : GridMap, obstacles, or array_like of shape (k, dim)
        A map, whose occupied cells are kept away from; ``Cylinder``, ``Ellipsoid``, ``Cuboid`` and ``Prism``; or points
        [m].
    path : array_like, shape (m + 1, dim)
        Corners of the line [m], with the clearance.
    clearance : float
        Least distance of the polytopes to all that is occupied [m].
    reach : float
        How far a polytope extends beyond its segment, and to its sides [m].

    Returns
    -------
    Polytopes
        One a segment.

    Raises
    ------
    CorridorError
        If a segment is nearer than the clearance, or an argument is malformed.
    WaypointError
        If the path is malformed.

    Examples
    --------
    >>> import minsnap
    >>> pillar = minsnap.Cylinder((2, 0), 0.5)
    >>> around = minsnap.routes.corridor([pillar], [(0, 0), (2, 1), (4, 0)], clearance=0.2)
    >>> curve = minsnap.plan(None, corridor=around, start={"position": (0, 0)}, end={"position": (4, 0)}, total_time=5)
    >>> minsnap.certify(curve, corridor=around).ok
    True
    """
    line = check_waypoints(path)
    margin = check_distance("the clearance", clearance, CorridorError)
    far = check_positive("the reach", reach, "m", CorridorError)
    kept, box = taken(around, line.shape[1], margin)
    return Polytopes(polytopes_along(line, kept.obstacles, kept.points, margin, far, box, kept.prisms))


def taken(around: Any, dim: int, clearance: float) -> tuple[Kept, Box | None]:
    """Return what is kept away from, and the corners of what is known, None where there is no border.

    Raises
    ------
    CorridorError
        If it is none of them, or has another number of coordinates.
    """
    nowhere = np.zeros((0, dim))
    if isinstance(around, GridMap):
        if around.dim != dim:
            raise CorridorError(f"the path has {dim} coordinates and {around.name} {around.dim} axes")
        return Kept(bars(around), nowhere, clearance), flown_box(around)
    listed = numbers(around)
    if listed is not None and listed.shape == (0, dim):
        return Kept(NOTHING, nowhere, clearance), None
    if listed is None or not listed.size:
        return Kept.of(as_still(around), dim, clearance), None
    if listed.ndim != 2 or listed.shape[1] != dim:
        raise CorridorError(
            f"what is around the path is {shown(around)}: give a GridMap, obstacles, or points of {dim} finite numbers"
        )
    check_finite("what is around the path", listed, CorridorError)
    return Kept(NOTHING, listed, clearance), None


def with_obstacles(grid: GridMap, avoid: Sequence[Avoided]) -> GridMap:
    """Return a map in which cells are occupied, too, that reach into obstacles, or out of fences."""
    if not avoid:
        return grid
    occupied, half = grid.occupied.copy(), 0.5 * float(np.linalg.norm(grid.resolution))
    for index, layer in enumerate(occupied):
        cells = np.indices((1, *layer.shape)).reshape(grid.dim, -1).T
        cells[:, 0] = index
        centers = grid.center(cells)
        for each in avoid:
            if not isinstance(each, Moving):
                places = centers if isinstance(each, Prism) else in_space(centers)
                layer |= (clearances_of(each, places) < half).reshape(layer.shape)
    return replace(grid, occupied=occupied)


def bars(grid: GridMap) -> FloatArray:
    """Return the occupied cells that have a free neighbour, joined along the last axis: boxes as (m, 13) numbers."""
    cells = grid.occupied & dilated(~grid.occupied)
    around = np.pad(cells, [(0, 0)] * (grid.dim - 1) + [(1, 1)])
    begin = np.argwhere(around[..., 1:] & ~around[..., :-1])
    behind = np.argwhere(around[..., :-1] & ~around[..., 1:])  # in the same order
    result = np.zeros((len(begin), 13))
    result[:, 6], result[:, 7:10], result[:, 10:] = -1.0, -np.inf, np.inf
    result[:, 7 : 7 + grid.dim] = grid.lower + grid.resolution * begin
    upper = begin + 1
    upper[:, -1] = behind[:, -1]
    result[:, 10 : 10 + grid.dim] = grid.lower + grid.resolution * upper
    return result


def flown_box(grid: GridMap) -> Box:
    """Return the corners of the part of a map that may be flown through."""
    lower, upper = grid.lower.copy(), grid.upper.copy()
    first, behind = grid.layers
    lower[-1], upper[-1] = (grid.lower[-1] + grid.resolution[-1] * layer for layer in (first, behind))
    return lower, upper


def listed_obstacles(around: Any) -> bool:
    """Whether what is around is obstacles, one or several."""
    listed = around if isinstance(around, Sequence) and len(around) else [around]
    return all(hasattr(each, "numbers") or isinstance(each, Moving | Prism) for each in listed)

"""A way through a map with a clearance, or the sentence that says why there is none, with a proof.

The proof names the border of the cells that can be reached from the start: each cell beside them, through a face, is
occupied or nearer than the clearance to an occupied one. Steps through edges and corners lead no further, since all
cells that meet there must be free.
"""

from __future__ import annotations

from bisect import bisect
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise, product
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, BoolArray, FloatArray, IntArray
from minsnap.basics.checks import check_array, point_text
from minsnap.corridors.occupancy_grid import block, dilated, gaps, grown, visited
from minsnap.errors import InfeasibleError, WaypointError
from minsnap.native.map_ways import grid_way
from minsnap.paths.routes.grid_map import GridMap

LARGE = 400_000
"""Cells above which a way is looked for in blocks of 2 cells a side first, all of whose cells are free."""

LET_FREE = 'unknown="free" (--unknown free) takes unknown cells as free'
"""What messages advise where cells are occupied only because nothing is known of them."""

AVOIDED = 1000.0
"""Factor on the length of steps to and from cells that are avoided."""


def shortest_way(free: BoolArray, size: FloatArray, start: IntArray, goal: IntArray) -> FloatArray | None:
    """Return the corners of a way from start to goal, (m, dim), in cells from the center of the first; or None.

    Its lines have any angle, and touch free cells alone; see :func:`minsnap.native.map_ways.grid_way`. On large grids
    the way is looked for in blocks of cells first, so that it is about the shortest among those of blocks, and its
    corners are the centers of blocks, which lie between cells.

    Parameters
    ----------
    free : ndarray of bool
        Cells that the way may have; start and goal are among them.
    size : ndarray, shape (dim,)
        Sides of a cell [m].
    start, goal : ndarray, shape (dim,)
        Cells.
    """
    coarse = _in_blocks(free, size, start, goal) if free.size > LARGE else None
    found = grid_way(free, size, start, goal) if coarse is None else coarse
    return None if found is None else np.asarray(found, dtype=np.float64)


def _in_blocks(free: BoolArray, size: FloatArray, start: IntArray, goal: IntArray) -> FloatArray | None:
    """Return a way through free blocks of 2 cells a side, with start and goal added; None if their blocks are not.

    It goes through the centers of blocks, whose lines are known to be free: those of their first cells touch others.
    """
    shape = tuple(length // 2 for length in free.shape)
    whole = free[tuple(slice(0, 2 * length) for length in shape)]
    blocks = whole.reshape([part for length in shape for part in (length, 2)])
    coarse = np.asarray(blocks.all(axis=tuple(range(1, 2 * free.ndim, 2))))
    ends = [np.minimum(cell // 2, np.array(shape) - 1) for cell in (start, goal)]
    if not all(coarse[tuple(end)] and (cell // 2 == end).all() for end, cell in zip(ends, (start, goal), strict=True)):
        return None
    if (ends[0] == ends[1]).all():
        return None
    way = shortest_way(coarse, 2.0 * size, ends[0], ends[1])
    if way is None:
        return None
    unit = np.ones(free.ndim)
    return _from_end_to_end(free, np.vstack((start, 2.0 * way + 0.5, goal)), unit, -0.5 * unit)


def _least_narrow_way(
    free: BoolArray, size: FloatArray, start: IntArray, goal: IntArray, narrow: BoolArray
) -> IntArray:
    """Return the cells of a way that has narrow ones only where there is no other: (m, dim), by Dijkstra's algorithm.

    Steps go to any neighbour, through an edge or a corner only where all cells that meet there are free; on large
    grids through faces only.
    """
    from scipy.sparse.csgraph import dijkstra

    graph = step_graph(free, size, free.size <= LARGE, narrow)
    ends = [int(np.ravel_multi_index(tuple(cell), free.shape)) for cell in (start, goal)]
    before = dijkstra(graph, directed=False, indices=ends[0], return_predecessors=True)[1]
    way = [ends[1]]
    while way[-1] != ends[0]:
        way.append(int(before[way[-1]]))
    return np.stack(np.unravel_index(way[::-1], free.shape), axis=-1)


def step_graph(free: BoolArray, size: FloatArray, corners: bool, narrow: BoolArray) -> Any:
    """Return the lengths of all steps between free cells, each once, as a sparse matrix.

    Without ``corners``, through faces only.
    """
    from scipy.sparse import csr_matrix

    index = np.arange(free.size, dtype=np.int32).reshape(free.shape)
    rows, columns, lengths = [], [], []
    for step in product((-1, 0, 1), repeat=free.ndim):
        if step <= (0,) * free.ndim or not (corners or np.count_nonzero(step) == 1):
            continue
        here, there = block(free.shape, step), block(free.shape, step, step)
        open_ = np.ones(free[here].shape, dtype=np.bool_)
        for part in product(*((0, change) if change else (0,) for change in step)):
            open_ &= free[block(free.shape, step, part)]
        rows.append(index[here][open_])
        columns.append(index[there][open_])
        length = float(np.linalg.norm(size * step))
        lengths.append(length * np.where(narrow[here][open_] | narrow[there][open_], AVOIDED, 1.0))
    entries = np.concatenate(lengths), (np.concatenate(rows), np.concatenate(columns))
    return csr_matrix(entries, shape=(free.size, free.size))


def widest(gap: FloatArray, open_: BoolArray, start: IntArray, goal: IntArray) -> float | None:
    """Return the largest clearance with which there is a way from start to goal [m]; None if there is none at all.

    Parameters
    ----------
    gap : ndarray
        Distance of each cell to the nearest occupied one [m].
    open_ : ndarray of bool
        Cells that are not occupied and may be flown through.
    start, goal : ndarray, shape (dim,)
        Cells.
    """
    if not _linked(open_, start, goal):
        return None
    values = np.unique(gap[open_ & (gap <= min(gap[tuple(start)], gap[tuple(goal)]))])
    passable = bisect(range(1, len(values)), 0, key=lambda i: not _linked(open_ & (gap >= values[i]), start, goal))
    return float(values[passable])


def narrowest(
    gap: FloatArray, open_: BoolArray, size: FloatArray, start: IntArray, goal: IntArray
) -> tuple[float, IntArray] | None:
    """Return the largest clearance with which there is a way [m], and the cell where it has no more; None without one.

    Parameters
    ----------
    gap, open_, start, goal
        As :func:`widest` takes them.
    size : ndarray, shape (dim,)
        Sides of a cell [m].
    """
    most = widest(gap, open_, start, goal)
    if most is None:
        return None
    way = _least_narrow_way(open_ & (gap >= most), size, start, goal, gap <= most)
    return most, way[int(gap[tuple(way.T)].argmin())]


def _linked(open_: BoolArray, start: IntArray, goal: IntArray) -> bool:
    """Whether two cells are joined by steps through faces."""
    return bool(part_of(open_, start)[tuple(goal)])


def part_of(open_: BoolArray, start: IntArray) -> BoolArray:
    """Return the open cells that steps through faces lead to from a cell."""
    from scipy.ndimage import label

    part, _ = label(open_)
    return np.asarray((part == part[tuple(start)]) & open_)


@dataclass(frozen=True, eq=False)
class Barrier:
    """The cells reached from the start, and what is in the way at their border.

    Parameters
    ----------
    grid : GridMap
    clearance : float
        [m].
    start, goal : ndarray of int, shape (dim,)
        Cells.
    reached : ndarray of bool
        Of the shape of the map.
    border, near : ndarray of int, shape (m, dim)
        Cells beside those reached, and an occupied cell near to each.
    """

    grid: GridMap
    clearance: float
    start: IntArray
    goal: IntArray
    reached: BoolArray
    border: IntArray
    near: IntArray

    def verify(self) -> bool:
        """Prove it on the integers of the cells, with distances in exact rational arithmetic."""
        border = np.zeros(self.reached.shape, dtype=np.bool_)
        border[tuple(self.border.T)] = True
        parted = self.reached[tuple(self.start)] and not self.reached[tuple(self.goal)]
        closed = bool((border | self.reached)[self.grid.flown(beside(self.reached))].all())
        blocked = bool(self.grid.occupied[tuple(self.near.T)].all())
        apart = np.unique(np.abs(self.border - self.near), axis=0)
        return bool(parted) and closed and blocked and all(map(self._too_near, apart.tolist()))

    def _too_near(self, steps: list[int]) -> bool:
        """Whether cells at these steps from each other are nearer than the clearance."""
        sides = [Fraction(side) for side in self.grid.resolution.tolist()]
        square = sum((max(count - 1, 0) * side) ** 2 for count, side in zip(steps, sides, strict=True))
        return square < Fraction(self.clearance) ** 2


def beside(cells: BoolArray) -> BoolArray:
    """Return the cells beside ``cells``: they share a face with one of them and are not among them."""
    return np.asarray(dilated(cells, corners=False) & ~cells)


def barrier(grid: GridMap, free: BoolArray, clearance: float, start: IntArray, goal: IntArray) -> Barrier:
    """Return the proof for a map whose free cells do not join start and goal."""
    reached = part_of(free, start)
    border = np.argwhere(grid.flown(beside(reached)))
    return Barrier(grid, clearance, start, goal, reached, border, _nearest_cells(grid, border))


def _nearest_cells(grid: GridMap, cells: IntArray) -> IntArray:
    """Return an occupied cell nearest to each of some cells, by their faces: (m, dim)."""
    from scipy.ndimage import distance_transform_edt

    index = distance_transform_edt(
        ~dilated(grid.occupied), grid.resolution, return_distances=False, return_indices=True
    )
    nearest = touched = np.stack([axis[tuple(cells.T)] for axis in index], axis=-1)
    for step in sorted(product((-1, 0, 1), repeat=grid.dim), key=np.count_nonzero, reverse=True):
        other = np.clip(touched + step, 0, np.array(grid.occupied.shape) - 1)
        nearest = np.where(grid.occupied[tuple(other.T)][:, None], other, nearest)
    return nearest


def find_passage(grid: GridMap, start: FloatArray, goal: FloatArray, clearance: float) -> tuple[FloatArray, BoolArray]:
    """Return a line from start to goal that is farther than the clearance from every occupied cell, and all such cells.

    The line has shape (m, dim) [m].

    Parameters
    ----------
    grid : GridMap
    start, goal : ndarray, shape (dim,)
        [m].
    clearance : float
        [m].

    Raises
    ------
    WaypointError
        If start or goal is outside the map, or too near to what is occupied.
    InfeasibleError
        If there is no way, with a proof; says where the widest one is too narrow, and by how much (``smallest_width``).
    """
    for point, name in ((start, "start"), (goal, "goal")):
        _check_inside(grid, point, name)
    free = grid.flown(~grown(grid.occupied, clearance, grid.resolution))
    for point, name in ((start, "start"), (goal, "goal")):
        if not free[tuple(grid.cell(point))]:
            raise _too_near(grid, point, name, clearance)
    way = passage_within(grid, free, start, goal)
    if way is None:
        raise _too_narrow(grid, free, start, goal, clearance)
    return way, free


def passage_within(grid: GridMap, free: BoolArray, start: FloatArray, goal: FloatArray) -> FloatArray | None:
    """Return a line from start to goal through cells that it may have, (m, dim) [m]; None if there is none."""
    below = np.array([0] * (grid.dim - 1) + [grid.layers[0]])
    ends = grid.cell(start) - below, grid.cell(goal) - below
    way = shortest_way(free[..., slice(*grid.layers)], grid.resolution, *ends)
    if way is None:
        return None
    points = np.vstack((start, grid.center(way + below), goal))
    return _from_end_to_end(free, points, grid.resolution, grid.lower)


def _from_end_to_end(free: BoolArray, points: FloatArray, size: FloatArray, corner: FloatArray) -> FloatArray:
    """Leave out the points beside both ends where the line through cells of a size, from a corner on, is as free."""
    for inner in (1, -2):
        without = np.delete(points, inner, axis=0)
        pair = without[:2] if inner == 1 else without[-2:]
        if len(without) > 1 and (pair[0] != pair[1]).any():
            cells = visited(np.array(free.shape), pair, size, corner)
            points = without if _all_free(free, cells) else points
    return np.asarray(points[np.append(True, (np.diff(points, axis=0) != 0.0).any(axis=1))])


def _all_free(free: BoolArray, cells: IntArray) -> bool:
    """Whether visited cells are free, and those that meet where the line goes through an edge or a corner."""
    if not free[tuple(cells.T)].all():
        return False
    corners = ((a, b) for a, b in pairwise(cells) if np.count_nonzero(a != b) > 1)
    return all(free[np.ix_(*(sorted({int(i), int(j)}) for i, j in zip(a, b, strict=True)))].all() for a, b in corners)


def end_point(value: ArrayLike, dim: int, name: str) -> FloatArray:
    """Return start or goal as an array of finite numbers: (dim,), or (3,) above a plane map [m]."""
    wanted = "two coordinates, or three" if dim == 2 else "three coordinates"
    give = f"{wanted} [m], as the map has {dim} axes"
    return check_array(f"the {name}", value, ((dim,), (3,)), give, WaypointError)


def _check_inside(grid: GridMap, point: FloatArray, name: str) -> None:
    if grid.holds(point):
        return
    hint = "move it, or give the origin of the map"
    turned = grid.lower + grid.resolution * np.array(grid.occupied.shape)[[1, 0, *range(2, grid.dim)]]
    if ((point >= grid.lower) & (point <= turned)).all():
        hint = "the first axis of the array is x; if its rows are y, transpose it"
    raise WaypointError(f"the {name} {point_text(point)} m is outside {grid.name} ({grid.extent_text()}): {hint}")


def _too_near(grid: GridMap, point: FloatArray, name: str, clearance: float) -> WaypointError:
    cell = tuple(grid.cell(point))
    place = f"the {name} {point_text(point)} m, cell {point_text(grid.cell(point))},"
    if grid.unknown is not None and grid.unknown[cell]:
        return WaypointError(f"{place} is in an unknown cell, which counts as occupied: move it; {LET_FREE}")
    if grid.occupied[cell]:
        return WaypointError(f"{place} is in an occupied cell: move it to a free one")
    if not grid.layers[0] <= cell[-1] < grid.layers[1]:
        return WaypointError(f"{place} is outside the altitudes to fly through: move it, or change them")
    distance, cell = _nearest(grid, point)
    near = f"{place} is {distance:.3g} m from the occupied cell at {grid.spot(cell)}"
    if distance < clearance:
        return WaypointError(
            f"{near}: the clearance is {clearance:g} m; move it by {clearance - distance:.2g} m and a cell, "
            "or lower the clearance"
        )
    return WaypointError(
        f"{near}: leave {grid.resolution.max():g} m, a cell, more than the clearance of {clearance:g} m"
    )


def _too_narrow(
    grid: GridMap, free: BoolArray, start: FloatArray, goal: FloatArray, clearance: float
) -> InfeasibleError:
    """Return the sentence on the widest way there is."""
    ends = grid.cell(start), grid.cell(goal)
    open_, gap = grid.flown(~grid.occupied), gaps(grid.occupied, grid.resolution)
    found = narrowest(gap, open_, grid.resolution, *ends)
    lead = f"no way leads from {point_text(start)} m to {point_text(goal)} m"
    if found is None:
        return InfeasibleError(
            f"{lead}, whatever the clearance: {_closed_off(grid, open_, *ends, goal)}",
            contradiction=barrier(grid, free, clearance, *ends),
        )
    most, narrow = found
    return InfeasibleError(
        f"{lead} with a clearance of {clearance:g} m: the widest one has {most:.3g} m on each side at "
        f"{grid.spot(narrow)}, {clearance - most:.2g} m too narrow; a clearance of {most:.3g} m passes",
        smallest_width=most,
        contradiction=barrier(grid, free, clearance, *ends),
    )


def _closed_off(grid: GridMap, open_: BoolArray, first: IntArray, last: IntArray, goal: FloatArray) -> str:
    """Say how near to the goal ways through open cells lead, and what would open more."""
    reached = grid.center(np.argwhere(part_of(open_, first)))
    apart = np.linalg.norm(reached - goal, axis=1)
    end = int(apart.argmin())
    said = (
        f"occupied cells close it off, and ways end at {point_text(reached[end])} m, {apart[end]:.3g} m from the goal"
    )
    if grid.unknown is not None and _linked(open_ | grid.flown(grid.unknown), first, last):
        return f"{said}; unknown cells are among them: {LET_FREE}"
    if grid.altitudes is not None and _linked(~grid.occupied, first, last):
        return f"{said}; other altitudes leave a way"
    return said


def _nearest(grid: GridMap, point: FloatArray) -> tuple[float, Any]:
    """Return the distance of a point to the nearest occupied cell, and that cell."""
    cells = np.argwhere(grid.occupied)
    low = grid.lower + grid.resolution * cells
    apart = np.maximum(np.maximum(low - point, point - low - grid.resolution), 0.0)
    distance = np.linalg.norm(apart, axis=1)
    return float(distance.min()), cells[int(distance.argmin())]

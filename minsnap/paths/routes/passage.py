"""A way through a map with a clearance, or the sentence that says why there is none, with a proof.

The proof names the border of the cells that can be reached from the start: each cell beside them, through a face, is
occupied or nearer than the clearance to an occupied one. Steps through edges and corners lead no further, since all
cells that meet there must be free.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.basics.checks import check_array, point_text
from minsnap.corridors.grid_gaps import gaps, grown
from minsnap.corridors.occupancy_grid import GridCorridor, boxes_along
from minsnap.errors import InfeasibleError, WaypointError
from minsnap.paths.routes.grid_map import GridMap
from minsnap.paths.routes.grid_search import shortest_way, widest


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
        closed = bool((border | self.reached)[beside(self.reached)].all())
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
    from scipy.ndimage import binary_dilation

    return np.asarray(binary_dilation(cells) & ~cells)


def barrier(grid: GridMap, free: BoolArray, clearance: float, start: IntArray, goal: IntArray) -> Barrier:
    """Return the proof for a map whose free cells do not join start and goal."""
    from scipy.ndimage import label

    part, _ = label(free)
    reached = part == part[tuple(start)]
    border = np.argwhere(beside(reached))
    return Barrier(grid, clearance, start, goal, reached, border, _nearest_cells(grid, border))


def _nearest_cells(grid: GridMap, cells: IntArray) -> IntArray:
    """Return an occupied cell nearest to each of some cells, by their faces: (m, dim)."""
    from scipy.ndimage import binary_dilation, distance_transform_edt

    touching = binary_dilation(grid.occupied, np.ones((3,) * grid.dim, dtype=np.bool_))
    index = distance_transform_edt(~touching, grid.resolution, return_distances=False, return_indices=True)
    nearest = touched = np.stack([axis[tuple(cells.T)] for axis in index], axis=-1)
    for step in sorted(product((-1, 0, 1), repeat=grid.dim), key=np.count_nonzero, reverse=True):
        other = np.clip(touched + step, 0, np.array(grid.occupied.shape) - 1)
        nearest = np.where(grid.occupied[tuple(other.T)][:, None], other, nearest)
    return nearest


def find_passage(grid: GridMap, start: FloatArray, goal: FloatArray, clearance: float) -> GridCorridor:
    """Return boxes that lead from start to goal, all farther than the clearance from every occupied cell.

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
    free = ~grown(grid.occupied, clearance, grid.resolution)
    for point, name in ((start, "start"), (goal, "goal")):
        if not free[tuple(grid.cell(point))]:
            raise _too_near(grid, point, name, clearance)
    way = shortest_way(free, grid.resolution, grid.cell(start), grid.cell(goal))
    if way is None:
        raise _too_narrow(grid, free, start, goal, clearance)
    points = np.vstack((start, grid.center(way), goal))
    return boxes_along(free, grid.resolution, grid.lower, points, clearance)


def end_point(value: npt.ArrayLike, dim: int, name: str) -> FloatArray:
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
    distance, cell = _nearest(grid, point)
    place = f"the {name} {point_text(point)} m, cell {point_text(grid.cell(point))},"
    if grid.occupied[tuple(grid.cell(point))]:
        return WaypointError(f"{place} is in an occupied cell: move it to a free one")
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
    open_, gap = ~grid.occupied, gaps(grid.occupied, grid.resolution)
    most = widest(gap, open_, *ends)
    lead = f"no way leads from {point_text(start)} m to {point_text(goal)} m"
    if most is None:
        return InfeasibleError(
            f"{lead}, whatever the clearance: occupied cells close it off; check the unknown cells",
            contradiction=barrier(grid, free, clearance, *ends),
        )
    way = shortest_way(open_ & (gap >= most), grid.resolution, *ends, avoided=gap <= most)
    assert way is not None
    narrow = way[int(gap[tuple(way.T)].argmin())]
    return InfeasibleError(
        f"{lead} with a clearance of {clearance:g} m: the widest one has {most:.3g} m on each side at "
        f"{grid.spot(narrow)}, {clearance - most:.2g} m too narrow; a clearance of {most:.3g} m passes",
        smallest_width=most,
        contradiction=barrier(grid, free, clearance, *ends),
    )


def _nearest(grid: GridMap, point: FloatArray) -> tuple[float, Any]:
    """Return the distance of a point to the nearest occupied cell, and that cell."""
    cells = np.argwhere(grid.occupied)
    low = grid.lower + grid.resolution * cells
    apart = np.maximum(np.maximum(low - point, point - low - grid.resolution), 0.0)
    distance = np.linalg.norm(apart, axis=1)
    return float(distance.min()), cells[int(distance.argmin())]

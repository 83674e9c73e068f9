"""Proof that no way through the free cells of a map leads from start to goal.

Each cell beside those that can be reached from the start, through a face, is occupied or nearer than the clearance
to an occupied one. Steps through edges and corners lead no further, since all cells that meet there must be free.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import product

import numpy as np

from minsnap.basics.arrays import BoolArray, IntArray
from minsnap.paths.routes.grid_map import GridMap


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
    return Barrier(grid, clearance, start, goal, reached, border, _nearest(grid, border))


def _nearest(grid: GridMap, cells: IntArray) -> IntArray:
    """Return an occupied cell nearest to each of some cells, by their faces: (m, dim)."""
    from scipy.ndimage import binary_dilation, distance_transform_edt

    touching = binary_dilation(grid.occupied, np.ones((3,) * grid.dim, dtype=np.bool_))
    index = distance_transform_edt(~touching, grid.resolution, return_distances=False, return_indices=True)
    nearest = touched = np.stack([axis[tuple(cells.T)] for axis in index], axis=-1)
    for step in sorted(product((-1, 0, 1), repeat=grid.dim), key=np.count_nonzero, reverse=True):
        other = np.clip(touched + step, 0, np.array(grid.occupied.shape) - 1)
        nearest = np.where(grid.occupied[tuple(other.T)][:, None], other, nearest)
    return nearest

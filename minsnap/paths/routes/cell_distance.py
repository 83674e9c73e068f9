r"""The least distance of a trajectory to the occupied cells of a map, over all time.

The squared distance of a curve to a cell is the sum over the axes of :math:`\max(l - x, x - u, 0)^2`. Where every axis
is on one side of the cell, it is a polynomial, which its Bernstein coefficients bound from below; an axis that changes
sides contributes 0 to the bound, and at most the square of what it moves. Intervals are halved until the bound and the
distance at an end agree: both errors fall with the square of the length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.paths.routes.grid_map import GridMap
from minsnap.polynomials.bernstein import multiply, subdivision
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
    cells = _surface(grid)
    if not len(cells):
        return Approach(np.inf, np.inf)
    arcs = _short_arcs(traj, grid)
    search = _NearestPairs(arcs, cells, grid)
    return search.run()


def _surface(grid: GridMap) -> IntArray:
    """Return the occupied cells that touch a free one through a face, or the border of the map: (n, dim)."""
    from scipy.ndimage import binary_erosion

    return np.argwhere(grid.occupied & ~binary_erosion(grid.occupied))


@dataclass(frozen=True, eq=False)
class _Arcs:
    """Parts of polynomials: control points (m, n + 1, dim), starts and lengths in seconds, (m,)."""

    points: FloatArray
    start: FloatArray
    length: FloatArray

    def take(self, which: npt.NDArray[np.intp] | npt.NDArray[np.bool_]) -> _Arcs:
        """Return the distances of a part of the cells."""
        return _Arcs(self.points[which], self.start[which], self.length[which])

    def halved(self) -> _Arcs:
        """Return both halves of each, one beside the other."""
        count, size, dim = self.points.shape
        halves = subdivision(size - 1, 2) @ self.points
        start = np.stack((self.start, self.start + self.length / 2.0), axis=1)
        return _Arcs(halves.reshape(2 * count, size, dim), start.reshape(-1), np.repeat(self.length / 2.0, 2))


def _short_arcs(traj: Trajectory, grid: GridMap) -> _Arcs:
    """Divide a trajectory until no part is longer than a cell."""
    short, left = [], _Arcs(traj.control_points[..., : grid.dim], traj.breaks[:-1], traj.durations)
    for _ in range(HALVINGS):
        reach = np.linalg.norm(np.diff(left.points, axis=1), axis=2).sum(axis=1)
        long = reach > float(grid.resolution.min())
        short.append(left.take(~long))
        if not long.any():
            break
        left = left.take(long).halved()
    return _Arcs(*(np.concatenate([getattr(arcs, name) for arcs in short]) for name in ("points", "start", "length")))


class _NearestPairs:
    """Pairs of an arc and a cell that may have the least distance."""

    def __init__(self, arcs: _Arcs, cells: IntArray, grid: GridMap) -> None:
        self.grid = grid
        which, near = self._pairs(arcs, cells)
        self.arcs, self.cells = arcs.take(which), cells[near]
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
            self.arcs, self.cells = self.arcs.take(open_).halved(), np.repeat(self.cells[open_], 2, axis=0)
        else:
            self.unresolved = min(self.unresolved, float(self._bounds().min()))
        lower = min(float(np.sqrt(self.unresolved)), self.best)
        return Approach(self.best, lower, self.instant, tuple(int(index) for index in self.cell))

    def _pairs(self, arcs: _Arcs, cells: IntArray) -> tuple[IntArray, IntArray]:
        """Return arcs and cells that may be nearest to each other, by a tree of the cells' centers."""
        from scipy.spatial import cKDTree

        tree = cKDTree(self.grid.center(cells))
        middle = (arcs.points.min(axis=1) + arcs.points.max(axis=1)) / 2.0
        radius = np.linalg.norm(arcs.points - middle[:, None], axis=2).max(axis=1)
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
        return low[:, None] - self.arcs.points, self.arcs.points - high[:, None]

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
            self.instant = float(self.arcs.start[pair] + end * self.arcs.length[pair])

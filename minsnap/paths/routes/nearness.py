r"""How near a trajectory comes to the occupied cells of a map, to obstacles, or to points, over all time.

The squared distance of a curve to a cell is the sum over the axes of :math:`\max(l - x, x - u, 0)^2`. Where every axis
is on one side of the cell, it is a polynomial, which its Bernstein coefficients bound from below; an axis that changes
sides contributes 0 to the bound, and at most the square of what it moves. Intervals are halved until the bound and the
distance at an end agree: both errors fall with the square of the length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.corridors.obstacle_margins import FINEST, in_space
from minsnap.corridors.occupancy_grid import dilated
from minsnap.corridors.prism import nearest_prism
from minsnap.corridors.way_around import Kept
from minsnap.native.fleet_border import ROUNDED, FleetArrays, clearances
from minsnap.paths.routes.grid_map import GridMap
from minsnap.paths.routes.known_map import edge
from minsnap.polynomials.bernstein import multiply
from minsnap.polynomials.extrema import CurveParts
from minsnap.trajectory.trajectory import Trajectory

AGREED = 1e-9
"""Difference of the bound and the distance that ends the search [m]; more where rounding is."""

SOME = 10_000
"""Points of a cloud that say first how near the nearest can be."""

HALVINGS = 60
"""Times that an interval is halved at most."""


@dataclass(frozen=True)
class Approach:
    """Where a trajectory comes nearest to what is occupied.

    Parameters
    ----------
    distance : float
        Least distance to an occupied cell, an obstacle or a point over all time [m], 0 where it touches one; at most
        1e-9 m more than the exact one. Infinite if there is none.
    lower : float
        A bound that the exact distance is not below [m].
    instant : float or None
        When [s].
    cell : tuple of int or None
        The cell that it is near to.
    which : int or None
        The obstacle or the point, where there is no map.
    """

    distance: float
    lower: float
    instant: float | None = None
    cell: tuple[int, ...] | None = None
    which: int | None = None


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
    outer = dilated(~grid.occupied, corners=False) | edge(grid.occupied.shape)
    cells = np.argwhere(grid.occupied & outer)  # with a free face, or on the border
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
        largest = max(float(np.abs(grid.lower).max()), float(np.abs(grid.upper).max()))
        self.agreed = max(AGREED, ROUNDED * float(np.finfo(np.float64).eps) * largest)
        self.unresolved = np.inf

    def run(self) -> Approach:
        """Halve the arcs of all pairs whose bound is below the least distance so far."""
        for _ in range(HALVINGS):
            bound = self._bounds()
            self._improve()
            open_ = np.sqrt(bound) < self.best - self.agreed
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


def nearest_kept(traj: Trajectory, kept: Kept) -> Approach:
    """Return where a trajectory comes nearest to obstacles, points and prisms, over all time.

    The distance to a part of an obstacle between two of its faces counts as the larger of those to both, which it is
    not below.
    """
    obstacles, points = kept.obstacles, kept.points
    prisms = () if kept.prisms is None else kept.prisms.prisms
    beside = min((nearest_prism(traj, each) for each in prisms), default=None)
    if beside is not None:
        others = nearest_kept(traj, kept._replace(prisms=None))
        own = Approach(beside.value, beside.value, beside.instant)
        return own if own.distance < others.distance else others
    near = _points_in_reach(traj, points)
    numbers = np.concatenate((obstacles, _as_balls(points[near])))
    if not len(numbers):
        return Approach(np.inf, np.inf)
    arrays = FleetArrays([in_space(traj.control_points)], [traj.breaks])
    least, instants, which = clearances(arrays, numbers, FINEST, 1)
    index = int(which[0])
    index = index if index < len(obstacles) else len(obstacles) + int(near[index - len(obstacles)])
    return Approach(float(least[0]), float(least[0]), float(instants[0]), which=index)


def _points_in_reach(traj: Trajectory, points: FloatArray) -> IntArray:
    """Return which points a trajectory may be nearest to: those near to samples of it."""
    if not len(points):
        return np.zeros(0, dtype=np.intp)
    from scipy.spatial import cKDTree

    instants = np.concatenate([np.linspace(a, b, 33)[:-1] for a, b in zip(traj.breaks, traj.breaks[1:], strict=False)])
    step = float((np.diff(instants, append=traj.duration) * traj.max_norm(1)[0]).max())
    apart = cKDTree(traj(instants))  # between two samples it is at most half a step from one of them
    some = points[:: max(1, len(points) // SOME)]
    enough = np.nextafter(float(apart.query(some)[0].min()) + step, np.inf)
    distance, _ = apart.query(points, distance_upper_bound=enough)
    return np.flatnonzero(distance <= distance.min() + step)


def _as_balls(points: FloatArray) -> FloatArray:
    """Return the numbers of balls without extent, (k, 13)."""
    balls = np.zeros((len(points), 13))
    balls[:, : points.shape[1]], balls[:, 3:6] = points, 1.0
    balls[:, 7:10], balls[:, 10:] = -np.inf, np.inf
    return balls

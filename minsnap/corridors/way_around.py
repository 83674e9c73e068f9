"""A line of points around obstacles: through the free cells of a grid laid over them, then as straight as it can be.

A cell is free where its center is so far from every obstacle that no point of the cell is nearer than the clearance.
Where the grid has no way, finer ones are tried.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from math import inf
from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.corridors.keep_out import Avoided
from minsnap.corridors.moving import Moving
from minsnap.corridors.occupancy_grid import grown
from minsnap.corridors.prism import PartTable, Prism
from minsnap.corridors.tangent_polytopes import numbers_of
from minsnap.native.map_ways import grid_way, tangent_planes

Inside = Callable[[FloatArray], BoolArray]
"""Whether points (..., dim) may be flown through."""


@dataclass(frozen=True)
class AroundSettings:
    """The grid that a way around obstacles is looked for in.

    Parameters
    ----------
    cells : tuple of int
        Cells along the longest side of what is between the ends, at least, in the plane and in space.
    across : float
        Cells across an obstacle of the median size, at least; where there are many, gaps are as small as they are.
    many : int
        Cells that this may lead to.
    each_second : float
        Cells that it may lead to for each second that there is, where time is limited.
    finer, most : int, int
        How often cells are halved where there is no way, and how many there are at most.
    coarser : float
        Factor by which sides of cells grow until there are no more than that.
    beside : float
        Room around ends and obstacles, in cells.
    tried : int
        Cells near an end from which a straight line to it is tried.
    straightened : int
        Corners of a way that a straight line leaves out at most.
    apart : float
        Least distance of a straight line to obstacles beyond the clearance, in sides of a cell.
    """

    cells: tuple[int, int] = (128, 40)
    across: float = 16.0
    many: int = 600_000
    each_second: float = 3e6
    finer: int = 3
    most: int = 3_000_000
    coarser: float = 1.1
    beside: float = 4.0
    tried: int = 200
    straightened: int = 12
    apart: float = 0.25


AROUND = AroundSettings()


class Kept(NamedTuple):
    """What a way keeps away from, by how far: obstacles (m, 13), points (k, dim) [m], a clearance [m], and prisms."""

    obstacles: FloatArray
    points: FloatArray
    clearance: float
    prisms: PartTable | None = None

    @classmethod
    def of(cls, avoid: Sequence[Avoided], dim: int, clearance: float = 0.0) -> Kept:
        """Return what stands of obstacles."""
        prisms = [each for each in avoid if isinstance(each, Prism)]
        simple = [each for each in avoid if not isinstance(each, Prism | Moving)]
        table = PartTable(prisms, dim) if prisms else None
        return cls(numbers_of(simple), np.zeros((0, dim)), clearance, table)

    def with_more(self, other: Kept) -> Kept:
        """Return what both keep away from."""
        tables = [each.prisms for each in (self, other) if each.prisms is not None]
        prisms = [prism for table in tables for prism in table.prisms]
        table = PartTable(prisms, tables[0].dim) if prisms else None
        obstacles = np.concatenate((self.obstacles, other.obstacles))
        return Kept(obstacles, np.concatenate((self.points, other.points)), self.clearance, table)


def way_around(
    kept: Kept, start: FloatArray, goal: FloatArray, inside: Inside | None = None, seconds: float = inf
) -> FloatArray | None:
    """Return the corners of a line from start to goal that keeps away from all obstacles: (m, dim); None without one.

    Parameters
    ----------
    kept : Kept
    start, goal : ndarray, shape (dim,)
        With the clearance [m].
    inside : callable, optional
        Where the way may be.
    seconds : float
        How much time there is [s]: the less, the fewer cells a way is looked for in first.
    """
    straight = np.stack((start, goal))
    if (start == goal).all():
        return straight
    if clear_lines(kept, straight[None], 0.0)[0] and (inside is None or inside(_along(straight)).all()):
        return straight
    ways = (cells.way(start, goal) for cells in cells_around(kept, start, goal, inside, seconds))
    return next((way for way in ways if way is not None), None)


def cells_around(
    kept: Kept, start: FloatArray, goal: FloatArray, inside: Inside | None = None, seconds: float = inf
) -> Iterator[FreeCells]:
    """Return the cells in which a way is looked for, finer ones after the first."""
    straight = np.stack((start, goal))
    return (FreeCells(kept, straight, size, inside) for size in _sizes(kept, straight, seconds))


class FreeCells:
    """Cells of one size around two ends, and which are free."""

    def __init__(self, kept: Kept, ends: FloatArray, size: float, inside: Inside | None) -> None:
        self.kept, self.size, self.dim = kept, size, ends.shape[1]
        self.inside = inside
        self.lower, sides = _sides_of_grid(kept, _extent_around(kept, ends), size)
        shape = sides.astype(np.intp)
        self.free = np.ones(shape, dtype=np.bool_)
        for numbers in kept.obstacles:
            self._block(numbers)
        if len(kept.points):
            self._block_points()
        if kept.prisms is not None:
            self._block_prisms(kept.prisms)
        fences = [] if kept.prisms is None else [each.contains for each in kept.prisms.prisms if each.inclusion]
        for within in (*fences, *([] if inside is None else [inside])):
            centers = self.center(np.indices(tuple(shape.tolist())).reshape(self.dim, -1).T)
            self.free &= within(centers).reshape(shape)

    def way_within(self, start: FloatArray, goal: FloatArray, free: BoolArray) -> FloatArray | None:
        """Return a way where other cells are free."""
        same = copy(self)
        same.free = free
        return same.way(start, goal)

    def cell(self, point: FloatArray) -> IntArray:
        """Return the cell that a point (dim,) is in."""
        return np.floor((point - self.lower) / self.size).astype(np.intp)

    def center(self, cells: IntArray) -> FloatArray:
        """Return centers of cells (..., dim) [m]."""
        return np.asarray(self.lower + self.size * (cells + 0.5))

    def way(self, start: FloatArray, goal: FloatArray) -> FloatArray | None:
        """Return the corners of a way between two points; None if there is none."""
        first, last = self.beside(start), self.beside(goal)
        if first is None or last is None:
            return None
        cells = grid_way(self.free, np.full(self.dim, self.size), first, last)
        if cells is None:
            return None
        points = np.vstack((start, self.center(cells), goal))
        return self._straightened(points[np.append(True, (np.diff(points, axis=0) != 0.0).any(axis=1))])

    def _block(self, numbers: FloatArray) -> None:
        """Take the cells near an obstacle out of the free ones."""
        center, scale, (radius,), low, high = np.split(numbers, (3, 6, 7, 10))
        # One formula for all kinds: a round part |scale (x - center)| <= radius within the box low <= x <= high. A
        # scale of 0 leaves an axis out, as along a cylinder; a radius below 0 is a cuboid, which has the box alone.
        reach = self.kept.clearance + 0.5 * self.size * self.dim**0.5  # of the cell's farthest corner from its middle
        round_ = (scale > 0.0) & (radius >= 0.0)
        spread = np.where(round_, radius / np.where(round_, scale, 1.0), np.inf)
        first = (np.maximum(low, center - spread) - reach)[: self.dim]
        behind = (np.minimum(high, center + spread) + reach)[: self.dim]
        shape = np.array(self.free.shape)
        begin = np.clip(np.floor((first - self.lower) / self.size), 0, shape).astype(np.intp)
        end = np.clip(np.ceil((behind - self.lower) / self.size), 0, shape).astype(np.intp)
        if (begin >= end).any():
            return
        part = tuple(slice(int(a), int(b)) for a, b in zip(begin, end, strict=True))
        axes = np.ix_(*(self.lower[d] + self.size * (np.arange(begin[d], end[d]) + 0.5) for d in range(self.dim)))
        square, flat = np.zeros(1), np.full(1, -np.inf)
        for d in range(3):
            at = axes[d] if d < self.dim else np.zeros(1)
            square = square + (scale[d] * (at - center[d])) ** 2
            flat = np.maximum(flat, np.maximum(at - high[d], low[d] - at))
        gap = flat if radius < 0.0 else np.maximum(flat, np.sqrt(square) - radius)
        self.free[part] &= np.broadcast_to(gap, end - begin) >= reach

    def _block_prisms(self, prisms: PartTable) -> None:
        """Take the cells near parts of prisms out of the free ones."""
        reach = self.kept.clearance + 0.5 * self.size * self.dim**0.5
        for index in range(len(prisms)):
            low, high = prisms.box(index)
            begin = np.clip(np.floor((low - reach - self.lower) / self.size), 0, self.free.shape).astype(np.intp)
            end = np.clip(np.ceil((high + reach - self.lower) / self.size), 0, self.free.shape).astype(np.intp)
            if (begin < end).all():
                cells = np.indices(tuple((end - begin).tolist())).reshape(self.dim, -1).T + begin
                near = prisms.gaps(self.center(cells), index) < reach
                self.free[tuple(cells[near].T)] = False
        for lowest, highest in prisms.ends():
            heights = self.lower[-1] + self.size * (np.arange(self.free.shape[-1]) + 0.5)
            self.free &= (heights >= lowest + reach) & (heights <= highest - reach)

    def _block_points(self) -> None:
        places = (self.kept.points - self.lower) / self.size
        within = ((places >= 0.0) & (places < self.free.shape)).all(axis=1)
        taken = np.zeros(self.free.shape, dtype=np.bool_)
        taken[tuple(np.floor(places[within]).astype(np.intp).T)] = True
        self.free &= ~grown(taken, self.kept.clearance, np.full(self.dim, self.size))

    def beside(self, point: FloatArray) -> IntArray | None:
        """Return the free cell nearest to a point from which a straight line leads to it."""
        cells = self._nearest_free(point)
        lines = np.stack((np.broadcast_to(point, cells.shape), self.center(cells)), axis=1)
        seen = cells[clear_lines(self.kept, lines, 0.0)] if len(lines) else cells
        return np.asarray(seen[0]) if len(seen) else None

    def _nearest_free(self, point: FloatArray) -> IntArray:
        """Return the free cells nearest to a point, those that are tried, in order."""
        axes = [self.lower[d] + self.size * (np.arange(count) + 0.5) for d, count in enumerate(self.free.shape)]
        squares = np.ix_(*((axis - point[d]) ** 2 for d, axis in enumerate(axes)))
        apart = np.asarray(sum(squares))[self.free]
        farthest = np.partition(apart, AROUND.tried)[AROUND.tried] if len(apart) > AROUND.tried else np.inf
        near = np.flatnonzero(apart <= farthest)
        nearest = near[np.argsort(apart[near], kind="stable")[: AROUND.tried]]
        return np.stack(np.unravel_index(np.flatnonzero(self.free)[nearest], self.free.shape), axis=1)

    def _straightened(self, points: FloatArray) -> FloatArray:
        """Leave out corners where a straight line is as clear."""
        kept = [0]
        while kept[-1] < len(points) - 1:
            here = kept[-1]
            further = np.arange(min(here + AROUND.straightened, len(points) - 1), here, -1)
            lines = np.stack((np.broadcast_to(points[here], (len(further), self.dim)), points[further]), axis=1)
            clear = clear_lines(self.kept, lines, AROUND.apart * self.size)
            if self.inside is not None:
                clear &= np.array([self.inside(_along(line)).all() for line in lines])
            clear[-1] = True
            kept.append(int(further[int(np.argmax(clear))]))
        return points[kept]


Extent = tuple[FloatArray, FloatArray]
"""Lower and upper corner of a box (dim,) [m]."""


def _extent_around(kept: Kept, ends: FloatArray) -> Extent:
    """Return a box around the ends and what is near to them of the obstacles."""
    dim, far = ends.shape[1], _apart(ends)
    lower, upper = ends.min(axis=0), ends.max(axis=0)
    low, high = lower - far, upper + far
    begin, behind, spread = _sides(kept.obstacles, dim)
    center, corners = kept.obstacles[:, :dim], np.zeros((0, dim))
    if kept.prisms is not None and len(kept.prisms):
        corners = np.concatenate([np.stack(kept.prisms.box(index)) for index in range(len(kept.prisms))])
    for side in (np.maximum(begin, center - spread), kept.points, corners):
        least = np.where(np.isfinite(side), side, np.inf).min(axis=0, initial=np.inf)
        lower = np.minimum(lower, np.maximum(least, low))
    for side in (np.minimum(behind, center + spread), kept.points, corners):
        most = np.where(np.isfinite(side), side, -np.inf).max(axis=0, initial=-np.inf)
        upper = np.maximum(upper, np.minimum(most, high))
    return lower, upper


def _sides_of_grid(kept: Kept, extent: Extent, size: float) -> tuple[FloatArray, FloatArray]:
    """Return where cells of a size around an extent begin [m], and how many there are along each axis: two (dim,)."""
    margin = AROUND.beside * size + kept.clearance
    lower = extent[0] - margin
    return lower, np.ceil((extent[1] + margin - lower) / size)


def _sizes(kept: Kept, ends: FloatArray, seconds: float = inf) -> Iterator[float]:
    """Return the sides of cells with which a way is looked for, one after the other, as fine as the most cells [m]."""
    extent, many = _extent_around(kept, ends), min(AROUND.many, AROUND.each_second * max(seconds, 0.0))
    wanted = _first_size(kept, ends, extent, many)
    before = inf
    for _ in range(1 + AROUND.finer):
        size = _fitting(kept, extent, wanted, AROUND.most)
        if size >= before:
            return
        yield size
        if size > wanted:  # the finest there may be
            return
        before, wanted = size, 0.5 * size


def _fitting(kept: Kept, extent: Extent, size: float, most: float) -> float:
    """Return a size of cells, larger where there would be more cells than the most [m]."""
    while np.prod(_sides_of_grid(kept, extent, size)[1]) > most:
        size *= AROUND.coarser
    return size


def _first_size(kept: Kept, ends: FloatArray, extent: Extent, many: float) -> float:
    """Return the side of cells with which a way is looked for first [m]."""
    dim, far = ends.shape[1], _apart(ends)
    low, high, spread = _sides(kept.obstacles, dim)
    across = np.minimum(high - low, 2.0 * spread).min(axis=1)
    if kept.prisms is not None:
        boxes = [kept.prisms.box(index) for index in range(len(kept.prisms)) if kept.prisms.solid(index)]
        across = np.append(across, [float((above - below).min()) for below, above in boxes])
    wanted = (float(np.median(across)) + 2.0 * kept.clearance) / AROUND.across if len(across) else far
    coarsest = far / AROUND.cells[dim - 2]
    return float(coarsest if wanted >= coarsest else min(coarsest, _fitting(kept, extent, wanted, max(many, 1e3))))


def _apart(ends: FloatArray) -> float:
    """Return how far two points are apart, by the longest of their coordinates [m]."""
    return float(np.abs(np.diff(ends, axis=0)).max())


def _sides(obstacles: FloatArray, dim: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the bounds of obstacles along the axes, and how far round parts spread: three arrays (m, dim) [m]."""
    scale, radius = obstacles[:, 3 : 3 + dim], obstacles[:, 6:7]
    round_ = (scale > 0.0) & (radius >= 0.0)
    spread = np.where(round_, radius / np.where(round_, scale, 1.0), np.inf)
    return obstacles[:, 7 : 7 + dim], obstacles[:, 10 : 10 + dim], spread


def clear_lines(kept: Kept, lines: FloatArray, beyond: float) -> BoolArray:
    """Whether segments (m, 2, dim) are away from all obstacles by the clearance and a distance beyond it [m]."""
    path = lines.reshape(-1, lines.shape[2])
    least = kept.clearance + beyond
    reach = max(least, 1e-3 * float(np.abs(np.diff(lines, axis=1)).max()), 1e-9)
    far = 2.0 * reach + kept.clearance
    near = ((kept.points >= path.min(axis=0) - far) & (kept.points <= path.max(axis=0) + far)).all(axis=1)
    distance = tangent_planes(path, kept.obstacles, kept.points[near], kept.clearance, reach).distance[::2]
    if kept.prisms is not None and len(kept.prisms):
        distance = np.minimum(distance, kept.prisms.from_lines(lines)[0].min(axis=1))
    for low, high in [] if kept.prisms is None else kept.prisms.ends():
        distance = np.minimum(distance, np.minimum(lines[..., 2] - low, high - lines[..., 2]).min(axis=1))
    return np.asarray(distance > least if least == 0.0 else distance >= least)


def _along(line: FloatArray, count: int = 33) -> FloatArray:
    """Return points along a segment (2, dim)."""
    share = np.linspace(0.0, 1.0, count)[:, None]
    return np.asarray((1.0 - share) * line[0] + share * line[1])

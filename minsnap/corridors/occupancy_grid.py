"""Boxes of free space along a path through an occupancy grid, by greedy inflation.

Each box starts from cells of the path and grows by one layer of cells per side in turn until obstacles block every side
(the inflation of F. Gao, W. Wu, Y. Lin and S. Shen, "Online safe trajectory generation for quadrotors using fast
marching method and Bernstein basis polynomial", ICRA 2018); the next one starts where the path leaves it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise, permutations, product

import numpy as np

from minsnap.basics.arrays import ArrayLike, BoolArray, FloatArray, IntArray, numbers, read_only
from minsnap.basics.checks import check_array, check_distance, check_positive, check_waypoints, point_text
from minsnap.basics.messages import explains_names, shown
from minsnap.basics.tolerances import EXACT, ROUNDING
from minsnap.corridors.boxes import Boxes
from minsnap.errors import CorridorError

FEW_SHIFTS = 500
"""Shifts of the grid up to which growing by shifts is quicker than a distance transform."""


def gaps(taken: BoolArray, size: FloatArray) -> FloatArray:
    r"""Return the least distance of any point of each cell to any point of an occupied cell.

    Between two cells that is the distance of their centers less one cell per axis, so the least distance of centers to
    a cell that is occupied or beside an occupied one: a Euclidean distance transform (C. Maurer, R. Qi and
    V. Raghavan, "A linear time algorithm for computing exact Euclidean distance transforms", PAMI 2003).

    Parameters
    ----------
    taken : ndarray of bool
        Occupied cells.
    size : ndarray, shape (dim,)
        Sides of a cell [m].

    Returns
    -------
    ndarray, of the shape of ``taken``
        [m]; 0 for occupied cells and those that touch one, infinite if there is none.
    """
    if not taken.any():
        return np.full(taken.shape, np.inf)
    from scipy.ndimage import distance_transform_edt

    return np.asarray(distance_transform_edt(~dilated(taken), sampling=size), dtype=np.float64)


def dilated(cells: BoolArray, corners: bool = True) -> BoolArray:
    """Return cells and those that touch one of them; without ``corners`` those alone that share a face with one."""
    result = cells.copy()
    for axis in range(cells.ndim):
        source = result.copy() if corners else cells
        ahead, behind = ((slice(None),) * axis + (part,) for part in (slice(1, None), slice(None, -1)))
        result[ahead] |= source[behind]
        result[behind] |= source[ahead]
    return result


def grown(taken: BoolArray, clearance: float, size: FloatArray) -> BoolArray:
    """Return the occupied cells and all cells nearer than the clearance to one of them.

    Parameters
    ----------
    taken : ndarray of bool
        Occupied cells.
    clearance : float
        [m].
    size : ndarray, shape (dim,)
        Sides of a cell [m].
    """
    count = np.minimum(np.ceil(clearance / size), np.array(taken.shape) - 1).astype(np.intp)
    if np.prod(2 * count[:-1] + 1) > FEW_SHIFTS:
        return np.asarray(taken | (gaps(taken, size) < clearance * (1.0 - ROUNDING)))
    return _grown_by_shifts(taken, clearance * (1.0 - ROUNDING), size, count)


def _grown_by_shifts(taken: BoolArray, clearance: float, size: FloatArray, count: IntArray) -> BoolArray:
    """Grow along the last axis by every number of cells, then shift these along the others and join them."""
    columns = [taken]
    for steps in range(1, int(count[-1]) + 1):
        columns.append(columns[-1].copy())
        for along in (steps, -steps):
            _join(columns[-1], taken, (*(0,) * (taken.ndim - 1), along))
    reach = np.maximum(np.arange(len(columns)) - 1, 0) * size[-1]
    grown = taken.copy()
    for step in product(*(range(-int(n), int(n) + 1) for n in count[:-1])):
        apart = np.maximum(np.abs(step) - 1, 0) * size[:-1]
        near = np.flatnonzero(np.sqrt(apart @ apart + reach**2) < clearance)
        if len(near):
            _join(grown, columns[int(near[-1])], (*step, 0))
    return grown


def _join(joined: BoolArray, taken: BoolArray, step: tuple[int, ...]) -> None:
    """Add occupied cells moved by a step, in place."""
    joined[block(taken.shape, step, step)] |= taken[block(taken.shape, step)]


def block(shape: tuple[int, ...], step: tuple[int, ...], part: tuple[int, ...] | None = None) -> tuple[slice, ...]:
    """Return the part of a grid from which a step stays inside, itself moved by a part of the step."""
    moved = (0,) * len(shape) if part is None else part
    sides = zip(shape, step, moved, strict=True)
    return tuple(slice(max(-whole, 0) + by, length - max(whole, 0) + by) for length, whole, by in sides)


CellBox = tuple[IntArray, IntArray]
"""Lower corner and upper corner (excluded), in cells."""


@dataclass(frozen=True, eq=False)
class GridCorridor:
    """Boxes along a path, with the start and end of a curve through them.

    Parameters
    ----------
    boxes : Boxes
        One a leg, each overlapping the next by a cell at least.
    waypoints : ndarray, shape (boxes + 1, dim)
        The path's start, the center of each overlap, the path's end [m].
    """

    boxes: Boxes
    waypoints: FloatArray

    @property
    def start(self) -> dict[str, FloatArray]:
        """Start of the path, in the form that ``plan`` takes."""
        return {"position": self.waypoints[0]}

    @property
    def end(self) -> dict[str, FloatArray]:
        """End of the path, in the form that ``plan`` takes."""
        return {"position": self.waypoints[-1]}


@explains_names({})
def corridor_from_grid(
    occupancy: ArrayLike,
    resolution: ArrayLike,
    path: ArrayLike,
    origin: ArrayLike | None = None,
    clearance: float = 0.0,
    largest: float = np.inf,
) -> GridCorridor:
    """Inflate axis-aligned boxes of free cells along a path, with redundant boxes removed.

    Parameters
    ----------
    occupancy : array_like, shape (nx, ny) or (nx, ny, nz)
        0 is free, any other value (unknown too) is not; the axes are x, y and z.
    resolution : float or array_like, shape (dim,)
        Side of a cell [m].
    path : array_like, shape (m, dim)
        Polyline through free cells [m], such as the cells' centers that a graph search gives.
    origin : array_like, shape (dim,), optional
        Outer corner of cell (0, 0, 0) [m]; by default zero.
    clearance : float
        Least distance of the boxes to occupied cells [m]: the vehicle's radius.
    largest : float
        Longest side that a box may have [m]; two cells are always allowed.

    Returns
    -------
    GridCorridor

    Raises
    ------
    CorridorError
        If an argument is malformed, or the path leaves the grid or meets a cell that is not free.
    """
    taken, size = _cells(occupancy, resolution)
    corner = _by_axis("the origin", 0.0 if origin is None else origin, taken.ndim)
    points = check_waypoints(path)
    if points.shape[1] != taken.ndim:
        raise CorridorError(f"the path has {points.shape[1]} coordinates and the grid {taken.ndim} axes")
    margin = check_distance("the clearance", clearance, CorridorError)
    endless = isinstance(largest, float) and largest == np.inf
    side = np.inf if endless else check_positive("the longest side", largest, "m", CorridorError)
    return boxes_along(~grown(taken, margin, size), size, corner, points, margin, side)


def free_cells(occupancy: ArrayLike, resolution: ArrayLike, clearance: float = 0.0) -> BoolArray:
    """Return which cells are free and everywhere at least a clearance from those that are not.

    Parameters
    ----------
    occupancy, resolution, clearance
        As :func:`corridor_from_grid` takes them.

    Raises
    ------
    CorridorError
        If an argument is malformed.
    """
    taken, size = _cells(occupancy, resolution)
    return ~grown(taken, check_distance("the clearance", clearance, CorridorError), size)


def _cells(occupancy: ArrayLike, resolution: ArrayLike) -> tuple[BoolArray, FloatArray]:
    """Return which cells are not free, and the sides of a cell, shape (dim,) [m]."""
    taken = _as_grid(occupancy)
    size = _by_axis("the resolution", resolution, taken.ndim)
    if not (size > 0.0).all():
        raise CorridorError(f"the resolution is {shown(resolution)}: a cell has a positive side [m]")
    return taken, size


def _by_axis(what: str, value: ArrayLike, dim: int) -> FloatArray:
    shapes, give = ((), (1,), (dim,)), f"one finite number, or {dim} [m]"
    return check_array(what, value, shapes, give, CorridorError) + np.zeros(dim)


def boxes_along(
    free: BoolArray, size: FloatArray, corner: FloatArray, points: FloatArray, clearance: float, largest: float = np.inf
) -> GridCorridor:
    """Inflate boxes along a path through cells that are known to be far enough from all that is occupied.

    Parameters
    ----------
    free : ndarray of bool
        Cells that boxes may have.
    size, corner : ndarray, shape (dim,)
        Sides of a cell, outer corner of the first one [m].
    points : ndarray, shape (m, dim)
        The path [m].
    clearance : float
        What ``free`` is the result of, for messages [m].
    largest : float
        Longest side that a box may have [m].

    Returns
    -------
    GridCorridor

    Raises
    ------
    CorridorError
        If the path leaves the grid or meets a cell that is not free.
    """
    way = visited(np.array(free.shape), points, size, corner)
    cells = connected(free, way, size, corner, clearance)
    limit = np.maximum(np.floor(np.minimum(largest / size, np.array(free.shape)) + EXACT), 2).astype(np.intp)
    boxes = pruned(inflated(free, cells, limit), cells[0], cells[-1])
    lower, upper = (corner + size * np.array([box[side] for box in boxes]) for side in (0, 1))
    corridor = Boxes(lower, upper)
    return GridCorridor(corridor, read_only(np.vstack([points[:1], corridor.passages()[0], points[-1:]])))


def _as_grid(occupancy: ArrayLike) -> BoolArray:
    if numbers(occupancy) is None:
        raise CorridorError("an occupancy grid has 2 or 3 axes of numbers, 0 where free, in rows of equal length")
    grid = np.asarray(occupancy)
    if grid.ndim not in (2, 3) or not grid.size or grid.dtype.kind not in "biuf":
        raise CorridorError(f"an occupancy grid has 2 or 3 axes of numbers, 0 where free, not shape {grid.shape}")
    return np.asarray(grid != 0)


def inflated(free: BoolArray, cells: IntArray, limit: IntArray) -> list[CellBox]:
    """Return boxes of free cells, each grown from where a chain of cells (n, dim) leaves the previous box."""
    boxes, index = [], 0
    while index < len(cells):
        seed = cells[max(index - 1, 0) : index + 1]
        low, high = _inflate(free, seed.min(axis=0), seed.max(axis=0) + 1, limit)
        boxes.append((low, high))
        outside = np.flatnonzero(((cells[index:] < low) | (cells[index:] >= high)).any(axis=1))
        index = index + int(outside[0]) if len(outside) else len(cells)
    return boxes


def _inflate(free: BoolArray, low: IntArray, high: IntArray, limit: IntArray) -> CellBox:
    """Add layers of free cells, one per side in turn, until no side can grow."""
    sides = [(axis, up) for axis in range(free.ndim) for up in (False, True)]
    while sides:
        sides = [
            (axis, up)
            for axis, up in sides
            if high[axis] - low[axis] < limit[axis] and _grow(free, low, high, axis, up)
        ]
    return low, high


def _grow(free: BoolArray, low: IntArray, high: IntArray, axis: int, up: bool) -> bool:
    """Move one side by one cell if the added layer is free, in place."""
    layer = [slice(a, b) for a, b in zip(low, high, strict=True)]
    at = int(high[axis]) if up else int(low[axis]) - 1
    if not 0 <= at < free.shape[axis]:
        return False
    layer[axis] = slice(at, at + 1)
    if not free[tuple(layer)].all():
        return False
    (high if up else low)[axis] += 1 if up else -1
    return True


def pruned(boxes: list[CellBox], start: IntArray, end: IntArray) -> list[CellBox]:
    """Leave out boxes between two that overlap, those before the last one with ``start`` and after one with ``end``."""
    index = max(number for number, box in enumerate(boxes) if _holds(box, start))
    kept = [boxes[index]]
    while not _holds(kept[-1], end):
        index = max(number for number, box in enumerate(boxes) if _overlap(kept[-1], box))
        kept.append(boxes[index])
    return kept


def _holds(box: CellBox, cell: IntArray) -> bool:
    return bool(((box[0] <= cell) & (cell < box[1])).all())


def _overlap(box: CellBox, other: CellBox) -> bool:
    return bool((np.maximum(box[0], other[0]) < np.minimum(box[1], other[1])).all())


def visited(shape: IntArray, points: FloatArray, size: FloatArray, corner: FloatArray) -> IntArray:
    """Return the cells that a polyline visits, in order: (n, dim).

    Raises
    ------
    CorridorError
        If a point is outside the grid.
    """
    scaled = (points - corner) / size
    outside = ((scaled < -EXACT) | (scaled > shape + EXACT)).any(axis=1)
    if outside.any():
        index = int(np.argmax(outside))
        raise CorridorError(
            f"point {index} of the path, {point_text(points[index])} m, is outside the grid, which reaches from "
            f"{point_text(corner)} to {point_text(corner + size * shape)} m: cut the path"
        )
    scaled = np.clip(scaled, 0.0, shape)
    way = [scaled[:1], *(_middles(start, end) for start, end in pairwise(scaled)), scaled[-1:]]
    cells = np.minimum(np.floor(np.concatenate(way)), shape - 1).astype(np.intp)
    return np.asarray(cells[np.concatenate(([True], (np.diff(cells, axis=0) != 0).any(axis=1)))])


def _middles(start: FloatArray, end: FloatArray) -> FloatArray:
    """Midpoints of the parts into which cell borders cut a segment."""
    shares = [np.array([0.0, 1.0])]
    for low, high in zip(start, end, strict=True):
        first, last = sorted((low, high))
        if last > first:
            shares.append((np.arange(np.ceil(first), np.floor(last) + 1.0) - low) / (high - low))
    cuts = np.sort(np.concatenate(shares))
    long = np.diff(cuts) > EXACT
    middle = ((cuts[1:] + cuts[:-1]) / 2.0)[long]
    return np.asarray(start + middle[:, None] * (end - start))


def connected(free: BoolArray, cells: IntArray, size: FloatArray, corner: FloatArray, clearance: float) -> IntArray:
    """Return the same cells with steps through an edge or a corner replaced by steps through faces.

    ``clearance`` [m] is what occupied cells were grown by, for the message.

    Raises
    ------
    CorridorError
        If one of them is not free.
    """
    linked = [cells[0]]
    for cell in cells[1:]:
        linked.extend(_bridge(free, linked[-1], cell))
    joined = np.array(linked)
    blocked = ~free[tuple(joined.T)]
    if blocked.any():
        cell = joined[int(np.argmax(blocked))]
        place = f"{point_text(corner + size * (cell + 0.5))} m, cell {point_text(cell)},"
        if clearance == 0.0:
            raise CorridorError(f"the path meets an occupied cell at {place} of the grid: move the path around it")
        raise CorridorError(
            f"the path meets a cell at {place} that is nearer than {clearance:g} m to an occupied one: "
            f"leave {size.max():g} m, a cell, more than the clearance"
        )
    return joined


def _bridge(free: BoolArray, start: IntArray, end: IntArray) -> list[IntArray]:
    """Cells from the one after ``start`` to ``end``, one axis at a time, in a collision-free order if possible."""
    ways = []
    for order in permutations(np.flatnonzero(start != end)):
        way, cell = [], start
        for axis in order:
            cell = cell.copy()
            cell[axis] = end[axis]
            way.append(cell)
        ways.append(way)
    return next((way for way in ways if free[tuple(np.array(way).T)].all()), ways[0])

"""The map of the cubes of an octree: its cells, or those of a box around start and goal where all are too many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, prod

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, NDArray
from minsnap.errors import CorridorError
from minsnap.paths.routes.cell_values import Reading, some
from minsnap.paths.routes.clouds import BEYOND
from minsnap.paths.routes.grid_map import LARGEST_MAP, GridMap
from minsnap.paths.routes.known_map import FREE, OCCUPIED, UNKNOWN

DEPTH = 16
"""Levels of an octree below the first: its cube has 2^16 cells a side, and its middle is the origin."""

SMALL_CUBE = 4
"""Cells a side up to which cubes are filled together, cell by cell; larger ones one by one."""


@dataclass(frozen=True, eq=False)
class Cubes:
    """Cubes of which something is known.

    Parameters
    ----------
    corner : ndarray of int32, shape (n, 3)
        First cell along each axis, from the lower corner of the tree.
    side : ndarray of int32, shape (n,)
        Cells a side.
    chance : ndarray of float32, shape (n,)
        Probability that it is occupied; not a number where it is not known.
    """

    corner: NDArray[np.int32]
    side: NDArray[np.int32]
    chance: NDArray[np.float32]

    @classmethod
    def of(cls, corner: NDArray[np.int32], side: int, chance: NDArray[np.float32] | BoolArray) -> Cubes:
        """Return cubes of one size."""
        return cls(corner, np.full(len(corner), side, dtype=np.int32), np.asarray(chance, dtype=np.float32))

    @classmethod
    def joined(cls, parts: Sequence[Cubes]) -> Cubes:
        """Return the cubes of all parts."""
        columns = [[getattr(part, name) for part in parts] for name in ("corner", "side", "chance")]
        return cls(*map(np.concatenate, columns))


@dataclass(frozen=True)
class CellBox:
    """Cells from a first one to before a last one, along each axis, from the lower corner of the tree."""

    first: tuple[int, ...]
    behind: tuple[int, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """Cells along each axis."""
        return tuple(last - first for first, last in zip(self.first, self.behind, strict=True))

    def grown(self, below: Sequence[int], above: Sequence[int]) -> CellBox:
        """Return the box with so many cells more on each side."""
        first = tuple(a - more for a, more in zip(self.first, below, strict=True))
        return CellBox(first, tuple(b + more for b, more in zip(self.behind, above, strict=True)))

    def within(self, other: CellBox) -> CellBox:
        """Return the part of the box that another one holds."""
        first = tuple(map(max, self.first, other.first))
        return CellBox(first, tuple(map(min, self.behind, other.behind)))


def cubes_map(cubes: Cubes, resolution: float, how: Reading, ends: FloatArray, clearance: float, name: str) -> GridMap:
    """Return the map of cubes.

    It holds all of them and the ends. Where unknown cells are free it reaches past them by the clearance and
    ``BEYOND``, but below the lowest; where they are occupied, by a cell. Where it would have more than ``LARGEST_MAP``
    cells it is cut to a box around the ends, as many cells on each side as fit, and the outermost cells where it was
    cut are occupied: what lies beyond them is not known.

    Parameters
    ----------
    cubes : Cubes
        One or more.
    resolution : float
        Side of a cell [m].
    how : Reading
    ends : ndarray, shape (m, 3)
        Points that the map must hold [m].
    clearance : float
        [m].
    name : str
        What messages call it.

    Raises
    ------
    CorridorError
        If it would have too many cells, and there are no ends around which it can be cut, or they are too far apart.
    """
    free = how.unknown == "free"
    margin = ceil(min((clearance + BEYOND) / resolution, 1 << DEPTH)) if free else 1
    held = _box_of(cubes, ends, resolution)
    whole = held.grown((margin, margin, 0 if free else margin), (margin,) * 3)
    box = whole if prod(whole.shape) <= LARGEST_MAP else _window(whole, ends, resolution, name)
    states = np.full(box.shape, UNKNOWN, dtype=np.uint8)
    _fill(states, cubes, how, box)
    unknown = None if free else some(states == UNKNOWN)
    occupied = np.asarray(states == OCCUPIED if free else states != FREE)
    for axis, shell in enumerate(np.moveaxis(occupied, axis, 0) for axis in range(3)):
        if box.first[axis] > whole.first[axis]:
            shell[0] = True
        if box.behind[axis] < whole.behind[axis]:
            shell[-1] = True
    corner = resolution * (np.array(box.first, dtype=np.float64) - (1 << DEPTH - 1))
    return GridMap(occupied, np.full(3, resolution), corner, name, unknown=unknown)


def _box_of(cubes: Cubes, ends: FloatArray, resolution: float) -> CellBox:
    """Return the smallest box that holds cubes and points."""
    points = _cells_of(ends, resolution)
    first = np.vstack((cubes.corner.min(axis=0), points)).min(axis=0)
    behind = np.vstack(((cubes.corner + cubes.side[:, None]).max(axis=0), points + 1)).max(axis=0)
    return CellBox(tuple(first.tolist()), tuple(behind.tolist()))


def _cells_of(points: FloatArray, resolution: float) -> NDArray[np.int64]:
    """Return the cells that points are in; those outside the tree are moved to its border."""
    with np.errstate(over="ignore"):  # of points that are no metres
        cells = np.floor(np.nan_to_num(points / resolution)) + (1 << DEPTH - 1)
    return np.asarray(np.clip(cells, 0, (1 << DEPTH) - 1).astype(np.int64))


def _window(whole: CellBox, ends: FloatArray, resolution: float, name: str) -> CellBox:
    """Return the largest box around the ends that has few enough cells."""
    count = prod(whole.shape)
    if not len(ends):
        raise CorridorError(
            f"{name} has {count} cells: at most {LARGEST_MAP} are searched; say which points it must hold (ends), "
            "around which it is cut"
        )
    points = _cells_of(ends, resolution)
    inner = CellBox(tuple(points.min(axis=0).tolist()), tuple((points.max(axis=0) + 1).tolist()))
    least, most = 0, 1 << DEPTH  # cells around it: fits, does not
    while most - least > 1:
        middle = (least + most) // 2
        fits = prod(inner.grown((middle,) * 3, (middle,) * 3).within(whole).shape) <= LARGEST_MAP
        least, most = (middle, most) if fits else (least, middle)
    box = inner.grown((least,) * 3, (least,) * 3).within(whole)
    if prod(box.shape) > LARGEST_MAP:
        raise CorridorError(
            f"start and goal are too far apart in {name}: the box around them has {prod(box.shape)} cells of "
            f"{resolution:g} m, and at most {LARGEST_MAP} are searched; go there in several parts, or make cells larger"
        )
    return box


def _fill(states: NDArray[np.uint8], cubes: Cubes, how: Reading, box: CellBox) -> None:
    """Set the cells of the cubes."""
    known = np.where(how.by_probability(cubes.chance), OCCUPIED, FREE).astype(np.uint8)
    known[~(cubes.chance >= 0.0)] = UNKNOWN
    first, shape = np.array(box.first), np.array(box.shape)
    low = cubes.corner - first
    high = low + cubes.side[:, None]
    kept = (low < shape).all(axis=1) & (high > 0).all(axis=1)
    for side in np.unique(cubes.side[kept]).tolist():
        rows = np.flatnonzero(kept & (cubes.side == side))
        if side <= SMALL_CUBE:
            for offset in np.ndindex(side, side, side):
                place = low[rows] + np.array(offset)
                inside = ((place >= 0) & (place < shape)).all(axis=1)
                states[tuple(place[inside].T)] = known[rows[inside]]
            continue
        corners = zip(np.maximum(low[rows], 0).tolist(), high[rows].tolist(), known[rows].tolist(), strict=True)
        for begin, end, state in corners:
            states[tuple(map(slice, begin, end))] = state

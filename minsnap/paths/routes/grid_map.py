"""A map: occupied cells in metres."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import ArrayLike, BoolArray, FloatArray, IntArray, ReadOnly, numbers, positive, set_fields
from minsnap.basics.checks import check_array
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.boxes import axis_name
from minsnap.errors import CorridorError

LARGEST_MAP = 50_000_000
"""Cells of the largest map."""


@dataclass(frozen=True, eq=False)
class GridMap(ReadOnly):
    """Occupied and free cells of a rectangle or a cuboid.

    Parameters
    ----------
    occupied : ndarray of bool, shape (nx, ny) or (nx, ny, nz)
        True where a vehicle must not be; the axes are x, y and z.
    resolution : float or array_like, shape (dim,)
        Sides of a cell [m].
    origin : array_like, shape (dim,), optional
        Outer corner of cell (0, 0, 0) [m]; by default zero.
    name : str
        What messages call it.

    Raises
    ------
    CorridorError
        If there are no cells, too many, or not 2 or 3 axes, or a side is not positive.
    """

    occupied: BoolArray
    resolution: FloatArray
    origin: FloatArray | None = None
    name: str = "the map"

    def __post_init__(self) -> None:
        cells = np.asarray(self.occupied)
        if cells.ndim not in (2, 3) or not cells.size or cells.dtype != np.bool_:
            raise CorridorError(f"{self.name} has shape {cells.shape}: a map has 2 or 3 axes, x, y and z, of booleans")
        if cells.size > LARGEST_MAP:
            raise CorridorError(
                f"{self.name} has {cells.size} cells: at most {LARGEST_MAP} are searched; cut it, or make cells larger"
            )
        sides = np.full(cells.ndim, 1.0) * _sides(self.name, self.resolution, cells.ndim)
        give = f"{cells.ndim} finite numbers [m]"
        start = np.zeros(cells.ndim) if self.origin is None else self.origin
        corner = check_array(f"the origin of {self.name}", start, ((cells.ndim,),), give, CorridorError)
        set_fields(self, occupied=cells.copy(), resolution=sides, origin=corner)

    @property
    def dim(self) -> int:
        """Number of axes."""
        return self.occupied.ndim

    @property
    def lower(self) -> FloatArray:
        """Outer corner of the first cell, (dim,) [m]."""
        assert self.origin is not None
        return self.origin

    @property
    def upper(self) -> FloatArray:
        """Outer corner of the last cell, (dim,) [m]."""
        return np.asarray(self.lower + self.resolution * self.occupied.shape)

    def holds(self, point: FloatArray) -> bool:
        """Whether a point (dim,) is inside the map."""
        slack = EXACT * self.resolution
        return bool(((point >= self.lower - slack) & (point <= self.upper + slack)).all())

    def cell(self, point: FloatArray) -> IntArray:
        """Return the cell that a point (dim,) inside the map is in."""
        index = np.floor((point - self.lower) / self.resolution).astype(np.intp)
        return np.asarray(np.clip(index, 0, np.array(self.occupied.shape) - 1))

    def center(self, cell: IntArray) -> FloatArray:
        """Return centers of cells: (…, dim) to (…, dim) [m]."""
        return np.asarray(self.lower + self.resolution * (np.asarray(cell) + 0.5))

    def spot(self, cell: IntArray) -> str:
        """Return where a cell is, in metres and in cells, for a message."""
        metres = ", ".join(f"{value:.4g}" for value in self.center(cell))
        return f"({metres}) m, cell ({', '.join(str(int(index)) for index in cell)})"

    def extent_text(self) -> str:
        """Return from where to where the map reaches, in metres and in cells, for a message."""
        pairs = zip(self.lower, self.upper, strict=True)
        sides = ", ".join(f"{axis_name(i)} from {low:.4g} to {high:.4g} m" for i, (low, high) in enumerate(pairs))
        return f"{sides}, {' x '.join(map(str, self.occupied.shape))} cells"

    def between(self, low: float, high: float) -> GridMap:
        """Return the layers of a map in space that reach from one altitude to another [m], those of both included.

        Raises
        ------
        CorridorError
            If the map is plane, or has no layer there.
        """
        if self.dim != 3:
            raise CorridorError(f"{self.name} is plane: altitudes are those of a map in space")
        side = float(self.resolution[2])
        first = max(int(np.floor((low - self.lower[2]) / side + EXACT)), 0)
        last = min(int(np.ceil((high - self.lower[2]) / side - EXACT)), self.occupied.shape[2])
        if not first < last:
            raise CorridorError(f"the altitudes {low:g} to {high:g} m are not in {self.name}: {self.extent_text()}")
        corner = self.lower + np.array([0.0, 0.0, first * side])
        return replace(self, occupied=self.occupied[:, :, first:last], origin=corner)


def _sides(name: str, resolution: ArrayLike, dim: int) -> FloatArray:
    sides = numbers(resolution)
    if sides is None or sides.shape not in ((), (dim,)) or not positive(sides).all():
        raise CorridorError(
            f"the resolution of {name} is {shown(resolution)}: give the side of a cell [m], or one per axis"
        )
    return sides

"""A map: occupied cells in metres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import SMALLEST, ArrayLike, BoolArray, FloatArray, IntArray, ReadOnly, numbers, set_fields
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
    altitudes : array_like, shape (2,), optional
        From which altitude to which a map in space may be flown through [m], the layers of both included; by default
        all of it. Cells above and below are kept away from like any others.
    unknown : ndarray of bool, of the shape of ``occupied``, optional
        Which cells count as occupied because nothing is known of them; for messages.

    Raises
    ------
    CorridorError
        If there are no cells, too many, or not 2 or 3 axes, or a side is not positive; or if altitudes are no two
        numbers in order, of a plane map, or of no layer.
    """

    occupied: BoolArray
    resolution: FloatArray
    origin: FloatArray
    name: str
    altitudes: FloatArray | None
    unknown: BoolArray | None

    def __init__(
        self,
        occupied: BoolArray,
        resolution: ArrayLike,
        origin: ArrayLike | None = None,
        name: str = "the map",
        altitudes: ArrayLike | None = None,
        unknown: BoolArray | None = None,
    ) -> None:
        try:
            cells = np.asarray(occupied)
        except (ValueError, RuntimeError):  # rows of unequal length, or a tensor with gradients
            raise CorridorError(f"{name} is {shown(occupied)}: give an array of booleans") from None
        if cells.ndim not in (2, 3) or not cells.size or cells.dtype != np.bool_:
            raise CorridorError(f"{name} has shape {cells.shape}: a map has 2 or 3 axes, x, y and z, of booleans")
        if cells.size > LARGEST_MAP:
            raise CorridorError(
                f"{name} has {cells.size} cells: at most {LARGEST_MAP} are searched; cut it, or make cells larger"
            )
        shapes, give = ((), (cells.ndim,)), "the side of a cell [m], or one per axis"
        what = f"the resolution of {name}"
        sides = check_array(what, resolution, shapes, give, CorridorError, SMALLEST) + np.zeros(cells.ndim)
        give = f"{cells.ndim} finite numbers [m]"
        start = np.zeros(cells.ndim) if origin is None else origin
        corner = check_array(f"the origin of {name}", start, ((cells.ndim,),), give, CorridorError)
        unseen = None if unknown is None else np.asarray(unknown)
        if unseen is not None and (unseen.shape != cells.shape or unseen.dtype != np.bool_):
            raise CorridorError(f"the unknown cells of {name} are {shown(unknown)}: give booleans, as many as cells")
        set_fields(self, occupied=cells.copy(), resolution=sides, origin=corner, name=name, altitudes=None)
        set_fields(self, unknown=None if unseen is None else unseen.copy())
        if altitudes is not None:
            self._check_altitudes(altitudes)

    @property
    def dim(self) -> int:
        """Number of axes."""
        return self.occupied.ndim

    @property
    def lower(self) -> FloatArray:
        """Outer corner of the first cell, (dim,) [m]."""
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

    @property
    def layers(self) -> tuple[int, int]:
        """First cell along the last axis that may be flown through, and the one behind the last."""
        low, high = (-np.inf, np.inf) if self.altitudes is None else self.altitudes
        count, side, bottom = self.occupied.shape[-1], self.resolution[-1], self.lower[-1]
        first = np.clip(np.floor((low - bottom) / side + EXACT), 0, count)
        return int(first), int(np.clip(np.ceil((high - bottom) / side - EXACT), 0, count))

    def flown(self, cells: BoolArray) -> BoolArray:
        """Return some cells of the map without those above and below the altitudes."""
        kept = np.zeros_like(cells)
        kept[..., slice(*self.layers)] = cells[..., slice(*self.layers)]
        return kept

    def _check_altitudes(self, altitudes: ArrayLike) -> None:
        if self.dim != 3:
            raise CorridorError(f"{self.name} is plane: altitudes are those of a map in space")
        pair = numbers(altitudes)
        if pair is None or pair.shape != (2,) or not pair[0] < pair[1]:
            raise CorridorError(f"the altitudes are {shown(altitudes)}: give two numbers, the lower one first [m]")
        set_fields(self, altitudes=pair)
        first, behind = self.layers
        if not first < behind:
            raise CorridorError(
                f"the altitudes {pair[0]:g} to {pair[1]:g} m are not in {self.name}: {self.extent_text()}"
            )

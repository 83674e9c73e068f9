"""Distance of each cell of a grid from the nearest occupied one."""

from __future__ import annotations

from itertools import product

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.basics.tolerances import ROUNDING

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
    from scipy.ndimage import binary_dilation, distance_transform_edt

    beside = binary_dilation(taken, np.ones((3,) * taken.ndim, dtype=np.bool_))
    return np.asarray(distance_transform_edt(~beside, sampling=size), dtype=np.float64)


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

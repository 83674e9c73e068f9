"""One polynomial from a moving state inside conditions at instants, found by the native core."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.native.library import Entry
from minsnap.native.records import PieceRecord

_SOLVE = Entry("minsnap_single_piece", PieceRecord)


@dataclass(frozen=True, eq=False)
class PieceConditions:
    """Second-order cones in which derivatives at instants lie, n of them; C-contiguous arrays.

    Parameters
    ----------
    order, soft, first : ndarray of int64, shape (n,), (n,) and (n + 1,)
        Which derivative, whether it may be exceeded where nothing else will do, and where the rows of each cone begin.
    s, ahead : ndarray, shape (n,)
        Where in [0, 1], and seconds by which the next derivative extrapolates it.
    matrix, bound : ndarray, shape (rows, dim) and (rows,)
        Of the matrix times the derivative plus the bound, the first component is at least the norm of the others.
    """

    order: IntArray
    soft: IntArray
    first: IntArray
    s: FloatArray
    ahead: FloatArray
    matrix: FloatArray
    bound: FloatArray


def piece_within(
    conditions: PieceConditions, duration: float, ends: FloatArray, free: Sequence[int], acceleration: float
) -> FloatArray | None:
    """Return control points (2k, dim) [m]; None where conditions cannot be kept, or the native core is not in use.

    Parameters
    ----------
    conditions : PieceConditions
    duration : float
        [s].
    ends : ndarray, shape (2k, dim)
        Derivatives at both ends on the unit interval [m]; the free ones are a guess.
    free : sequence of int
        Orders of the derivatives at the end that are unknown.
    acceleration : float
        One that counts as large here [m/s^2], positive.
    """
    points, (count, dim) = np.empty_like(ends), ends.shape
    sizes = {"half": count // 2, "dim": dim, "conditions": len(conditions.order), "free": sum(1 << q for q in free)}
    known = {"duration": duration, "acceleration": acceleration, "ends": ends, "points": points}
    return None if _SOLVE(PieceRecord(**sizes, **known, **vars(conditions))) else points

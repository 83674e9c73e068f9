"""What holds of polynomials and trajectories over all time, in the native core.

Every function but ``maximum`` returns None where the Python core has to answer: there is no native one, or the request
is outside what it takes.  Bounds are proved, with running error bounds; local maxima are exact to working precision.
"""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import c_double, c_int64, c_void_p
from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.native.library import Entry, address, optional_address, readable
from minsnap.native.records import ExcessRecord, WallsRecord
from minsnap.polynomials import extrema

_MAXIMA = Entry("minsnap_maxima", *[c_int64] * 3, *[c_void_p] * 4)
_NORMS = Entry("minsnap_largest_norms", *[c_int64] * 3, *[c_void_p] * 2, c_int64, *[c_void_p] * 3)
_EXCESS = Entry("minsnap_excess", WallsRecord, ExcessRecord)
_CONTINUITY = Entry("minsnap_continuity", *[c_int64] * 3, *[c_void_p] * 2, *[c_double] * 2, c_void_p)


class Extremum(NamedTuple):
    """A proved maximum: attained at least, never exceeded, by which row and where on [0, 1]."""

    attained: float
    bound: float
    row: int
    where: float


def maxima(
    points: FloatArray, errors: FloatArray | None = None, groups: int = 1
) -> tuple[FloatArray, FloatArray, IntArray, FloatArray] | None:
    """Proved maxima of polynomials on [0, 1], of each group of equally many that stand together.

    Parameters
    ----------
    points : ndarray, shape (m, n + 1)
        Bernstein control points.
    errors : ndarray, shape (m, n + 1), optional
        How far each may be off; by default zero.
    groups : int
        Number of groups, a divisor of m; m for the maximum of each polynomial.

    Returns
    -------
    values, bounds : ndarray, shape (groups,)
        What is attained and what is never exceeded.
    rows : ndarray of int, shape (groups,)
        Which polynomial attains it.
    where : ndarray, shape (groups,)
        Where on [0, 1].
    """
    points, known = _floats(points), optional_address(None if errors is None else _floats(errors))
    values, rows = np.empty((groups, 3)), np.empty(groups, dtype=np.int64)
    count = len(points) // groups
    if _MAXIMA(groups, count, points.shape[1] - 1, address(points), known, address(values), address(rows)):
        return None
    return values[:, 0], values[:, 1], rows, values[:, 2]


def maximum(points: FloatArray, errors: FloatArray | None = None) -> tuple[float, int, float]:
    """Largest value over all the polynomials, as ``polynomials.extrema.maximum``, which answers without a core."""
    largest = maxima(points, errors)
    if largest is None:
        return extrema.maximum(points, errors)
    _, bounds, rows, where = largest
    return float(bounds[0]), int(rows[0]), float(where[0])


def largest_norms(points: FloatArray, durations: FloatArray, orders: Sequence[int]) -> list[Extremum] | None:
    """Proved maxima of the squared Euclidean norms of derivatives, their row being the piece.

    Parameters
    ----------
    points : ndarray, shape (pieces, n + 1, dim)
        Control points [m].
    durations : ndarray, shape (pieces,)
        [s].
    orders : sequence of int
        Ascending.
    """
    count, wanted = len(orders), np.array(orders, dtype=np.int64)
    values, piece = np.empty((count, 3)), np.empty(count, dtype=np.int64)
    arrays = readable(_floats(points)), readable(_floats(durations))
    if _NORMS(*_shape(points), *arrays, count, readable(wanted), address(values), address(piece)):
        return None
    return [Extremum(a, b, i, s) for (a, b, s), i in zip(values.tolist(), piece.tolist(), strict=True)]


def greatest_excess(walls: WallsRecord, points: FloatArray, durations: FloatArray, pieces: int) -> Extremum | None:
    """Proved greatest excess of a curve over planes or balls, each on the pieces of its leg; cones are left to Python.

    Parameters
    ----------
    points, durations
        See ``largest_norms``.
    pieces : int
        Polynomials per leg.

    Returns
    -------
    Extremum
        The row counts pieces within walls: wall times ``pieces`` plus piece of the leg.
    """
    count, degree, dim = _shape(points)
    curve = {"points": _floats(points), "durations": _floats(durations), "per_leg": pieces}
    found = ExcessRecord(pieces=count, degree=degree, dim=dim, **curve)
    if _EXCESS(walls, found):
        return None
    return Extremum(found.attained, found.bound, found.row, found.where)


def continuity(points: FloatArray, durations: FloatArray, exact: float, rounding: float) -> int | None:
    """Highest order up to which both sides of every knot agree; see ``minsnap.certificate``."""
    order = np.zeros(1, dtype=np.int64)
    shape = _shape(points)
    points, durations = _floats(points), _floats(durations)
    if _CONTINUITY(*shape, address(points), address(durations), exact, rounding, address(order)):
        return None
    return int(order[0])


def _shape(points: FloatArray) -> tuple[int, int, int]:
    """Return pieces, degree and dim."""
    return points.shape[0], points.shape[1] - 1, points.shape[2]


def _floats(array: FloatArray) -> FloatArray:
    return np.ascontiguousarray(array, dtype=np.float64)

"""Greatest norms, extents and lengths of piecewise polynomials and their derivatives; norms and extents are proved."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.native.proved_extrema import largest_norms, maximum
from minsnap.polynomials.bernstein import basis, split
from minsnap.polynomials.enclosures import TINY, UNIT, Enclosure, derivative
from minsnap.trajectory.instants import SHORTEST_PIECE

FAINT = 1e-100
"""Norm below which its square, or it itself, may be lost to underflow: it is then scaled, and what is lost added."""


def norm_maxima(
    points: FloatArray, durations: FloatArray, breaks: FloatArray, orders: Sequence[int]
) -> list[tuple[float, float]]:
    """Return the maxima of the norms of several derivatives, and the instants where they are attained [s].

    Parameters
    ----------
    points : ndarray, shape (pieces, degree + 1, dim)
        Control points.
    durations, breaks : ndarray, shape (pieces,), (pieces + 1,)
        [s].
    orders : sequence of int
        Ascending, at most degree + 1.
    """
    largest = largest_norms(points, durations, orders)
    faint = largest is not None and min(one.bound for one in largest) < FAINT**2
    if largest is None or (faint and _faint(points, durations, min(max(orders), points.shape[1] - 1))):
        return [_largest_norm(points, durations, breaks, order) for order in orders]
    return [(_norm_of(one.bound), _instant(durations, breaks, one.row, one.where)) for one in largest]


def extent_along(points: FloatArray, durations: FloatArray, along: FloatArray, order: int) -> tuple[float, float]:
    """Return the least and the greatest value of a derivative along a direction (dim,), proved."""
    curve = derivative(points, durations, order)
    values = curve.along(np.broadcast_to(along, (len(durations), points.shape[2])))
    return -maximum(-values.points, values.errors)[0], maximum(values.points, values.errors)[0]


def _largest_norm(points: FloatArray, durations: FloatArray, breaks: FloatArray, order: int) -> tuple[float, float]:
    curve = derivative(points, durations, order)
    size = 2.0 ** np.frexp(np.abs(curve.points).max())[1]
    lost = points.shape[2] * TINY / min(durations.min() ** order, 1.0) if _faint(points, durations, order) else 0.0
    square = Enclosure(curve.points / size, curve.errors / size).squared_norm()
    bound, piece, s = maximum(square.points, square.errors)
    return float(size * _norm_of(bound) + lost), _instant(durations, breaks, piece, s)


def _faint(points: FloatArray, durations: FloatArray, order: int) -> bool:
    """Whether a derivative that is not zero may be so small that it is lost to underflow."""
    extent = float(np.ptp(points, axis=1).max())
    return order < points.shape[1] and 0.0 < extent < FAINT * max(float(durations.max()), 1.0) ** order


def _instant(durations: FloatArray, breaks: FloatArray, piece: int, s: float) -> float:
    return float(breaks[piece] + s * durations[piece]) if s < 1.0 else float(breaks[piece + 1])


def _norm_of(square: float) -> float:
    """Square root, not below the exact one."""
    return float(np.sqrt(max(square, 0.0))) * (1.0 + 4.0 * UNIT)


def arc_length(points: FloatArray, widths: FloatArray, tolerance: float) -> float:
    """Integrate the norm of a velocity, to that relative tolerance.

    Parameters
    ----------
    points : ndarray, shape (pieces, n + 1, dim)
        Control points of its polynomials [m/s].
    widths : ndarray, shape (pieces,)
        Durations [s].

    Returns
    -------
    float
        [m]
    """
    from scipy.integrate import quad_vec

    def speeds(s: float) -> FloatArray:
        weights = basis(points.shape[1] - 1, np.array([s]))[0]
        return np.asarray(np.linalg.norm(np.einsum("j,mjd->md", weights, points), axis=1) * widths)

    lengths, _ = quad_vec(speeds, 0.0, 1.0, epsabs=0.0, epsrel=tolerance)
    return float(lengths.sum())


def cut(
    points: FloatArray, durations: FloatArray, breaks: FloatArray, start: float, end: float
) -> tuple[FloatArray, FloatArray]:
    """Return control points and durations between two instants of a curve [s], start < end."""
    first, last = _pieces_within(breaks, start, end)
    low = max((start - breaks[first]) / durations[first], 0.0)
    high = min((end - breaks[last]) / durations[last], 1.0)
    points, shares = points[first : last + 1].copy(), np.ones(last + 1 - first)
    shares[-1] = high
    shares[0] -= low
    if high < 1.0:
        points[-1] = split(points[-1], high)[0]
    points[0] = split(points[0], low / high if first == last else low)[1]
    return points, durations[first : last + 1] * shares


def elevated_points(points: FloatArray, degree: int) -> FloatArray:
    """Return the control points (pieces, degree + 1, dim) of the same curve in a degree that is not lower."""
    for n in range(points.shape[1] - 1, degree):
        share = np.arange(n + 2)[:, None] / (n + 1)
        padded = np.pad(points, ((0, 0), (1, 1), (0, 0)))
        points = share * padded[:, :-1] + (1.0 - share) * padded[:, 1:]
    return points


def _pieces_within(breaks: FloatArray, start: float, end: float) -> tuple[int, int]:
    """First and last piece of an interval, without pieces of which only rounding is left, if there are others."""
    first = int(np.searchsorted(breaks, start, side="right")) - 1
    last = int(np.searchsorted(breaks, end, side="left")) - 1
    least = np.maximum(SHORTEST_PIECE, 8.0 * UNIT * breaks[1:])
    if first < last and breaks[first + 1] - start <= least[first]:
        first += 1
    if first < last and end - breaks[last] <= least[last]:
        last -= 1
    return first, last

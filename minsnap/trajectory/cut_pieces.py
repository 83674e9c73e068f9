"""Pieces of a curve between two instants, and the same pieces in a higher degree."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.polynomials.bernstein import restriction
from minsnap.polynomials.enclosures import UNIT

SHORTEST_PIECE, LONGEST_PIECE = 1e-18, 1e18
"""Least and greatest duration of a piece [s]: a cut may leave far less of a leg than is planned."""


def cut(
    points: FloatArray, durations: FloatArray, breaks: FloatArray, start: float, end: float
) -> tuple[FloatArray, FloatArray]:
    """Return control points and durations between two instants of a curve [s], start < end."""
    first, last = _pieces_within(breaks, start, end)
    low = max((start - breaks[first]) / durations[first], 0.0)
    high = min((end - breaks[last]) / durations[last], 1.0)
    points, durations = points[first : last + 1].copy(), durations[first : last + 1].copy()
    if first == last:
        points[0] = _restricted(points[0], low, high)
        durations[0] *= high - low
    else:
        points[0], points[-1] = _restricted(points[0], low, 1.0), _restricted(points[-1], 0.0, high)
        durations[0] *= 1.0 - low
        durations[-1] *= high
    return points, durations


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


def _restricted(points: FloatArray, low: float, high: float) -> FloatArray:
    matrix: Any = restriction(len(points) - 1, low, high)
    return np.asarray(np.array(matrix, dtype=np.float64) @ points)

"""Local maxima of many polynomials, found quickly: a grid, then Newton steps."""

from __future__ import annotations

from functools import cache

import numpy as np

from minsnap.polynomial import basis
from minsnap.problem import IntArray
from minsnap.samples import FloatArray

NEAR = 0.05
"""How far below zero, as a share of its range, a polynomial's maximum on the grid may be and still be refined.

Between grid points 1/(4n) apart a polynomial of degree n rises by less than 0.04 of its range."""

STEPS = 2
"""Newton steps after that."""


@cache
def _grid(degree: int) -> tuple[FloatArray, FloatArray]:
    s = np.linspace(0.0, 1.0, 4 * degree + 1)
    return s, np.ascontiguousarray(basis(degree, s).T)


def peaks(points: FloatArray, above: float) -> tuple[IntArray, FloatArray, FloatArray]:
    """Local maxima higher than ``above``, for polynomials with control points of shape (m, n + 1).

    Returns
    -------
    row : ndarray of int, shape (p,)
        Which polynomial.
    s : ndarray, shape (p,)
        Where on [0, 1].
    value : ndarray, shape (p,)
        How high.
    """
    may = np.flatnonzero(points.max(axis=1) > above)
    if not len(may):
        return may, np.zeros(0), np.zeros(0)
    if points.shape[1] == 1:
        return may, np.zeros(len(may)), points[may, 0]
    grid, values_of = _grid(points.shape[1] - 1)
    values = points[may] @ values_of
    row, column = _summits(values, above - NEAR * np.ptp(points[may], axis=1, keepdims=True))
    s, value = _refine(points[may[row]], grid, values, row, column)
    kept = value > above
    return may[row[kept]], s[kept], value[kept]


def _summits(values: FloatArray, floor: FloatArray) -> tuple[IntArray, IntArray]:
    high = values > floor
    rising = values[:, 1:] >= values[:, :-1]
    high[:, 1:] &= rising
    high[:, :-1] &= ~rising
    row, column = np.nonzero(high)
    return row, column


def _refine(
    points: FloatArray, grid: FloatArray, values: FloatArray, row: IntArray, column: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Go to the top of a parabola, then take Newton steps on the derivative; never to a lower value."""
    s, value, last = grid[column], values[row, column], len(grid) - 1
    if points.shape[1] < 3 or not len(s):
        return s, value
    before, after = values[row, np.maximum(column - 1, 0)], values[row, np.minimum(column + 1, last)]
    bend = before - 2.0 * value + after
    move = np.where(bend < 0.0, 0.5 * (before - after) / np.where(bend < 0.0, bend, -1.0), 0.0)
    at = s + grid[1] * np.minimum(np.maximum(move, -1.0), 1.0) * ((column > 0) & (column < last))
    low, high = np.maximum(s - grid[1], 0.0), np.minimum(s + grid[1], 1.0)
    for _ in range(STEPS):
        _, slope, curve = _local(points, at)
        at = np.minimum(np.maximum(at - slope / np.where(curve < 0.0, curve, -np.inf), low), high)
    refined = _local(points, at)[0]
    better = refined > value
    return np.where(better, at, s), np.where(better, refined, value)


def _local(points: FloatArray, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Value, slope and second derivative of row i at s[i], by two last steps of de Casteljau's scheme."""
    degree = points.shape[1] - 1
    weights = basis(degree - 2, s)
    a = np.einsum("rj,rj->r", weights, points[:, :-2])
    b = np.einsum("rj,rj->r", weights, points[:, 1:-1])
    c = np.einsum("rj,rj->r", weights, points[:, 2:])
    ab, bc = a + s * (b - a), b + s * (c - b)
    return ab + s * (bc - ab), degree * (bc - ab), degree * (degree - 1) * (c - 2.0 * b + a)

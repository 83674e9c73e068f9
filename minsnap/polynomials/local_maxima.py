"""Local maxima of many polynomials, quickly: a grid, then Newton steps in expansions around its points."""

from __future__ import annotations

from functools import cache
from math import factorial

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.polynomials.bernstein import basis, derivative_basis_map, rising_powers

REFINED_BELOW = 0.05
"""How far below zero, as a share of its range, a polynomial's maximum on the grid may be and still be refined.

Between grid points 1/(4n) apart a polynomial of degree n rises by less than 0.04 of its range."""

STEPS = 2
"""Newton steps after the one from the grid point."""


@cache
def _grid(degree: int) -> tuple[FloatArray, FloatArray]:
    s = np.linspace(0.0, 1.0, 4 * degree + 1)
    return s, np.ascontiguousarray(basis(degree, s).T)


@cache
def _reach(degree: int) -> tuple[FloatArray, FloatArray]:
    """Return the steps down and up to the next grid points."""
    s, _ = _grid(degree)
    return -np.diff(s, prepend=0.0), np.diff(s, append=1.0)


@cache
def _expansions(degree: int) -> FloatArray:
    """Taylor coefficients of value, slope and second derivative around every grid point, from control points.

    Shape (grid, 3 (degree + 1), degree + 1): three rows of coefficients one after the other, ended by zeros.
    """
    s, _ = _grid(degree)
    matrices = np.zeros((len(s), 3, degree + 1, degree + 1))
    for order in range(3):
        for k in range(degree + 1 - order):
            values = basis(degree - order - k, s) @ derivative_basis_map(degree, order + k)
            matrices[:, order, k] = values / factorial(k)
    return matrices.reshape(len(s), 3 * (degree + 1), degree + 1)


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
    highest = points.max(axis=1)
    may = np.flatnonzero(highest > above)
    if not len(may):
        return may, np.zeros(0), np.zeros(0)
    if points.shape[1] == 1:
        return may, np.zeros(len(may)), points[may, 0]
    grid, values_of = _grid(points.shape[1] - 1)
    points = points[may]
    values = points @ values_of
    row, column = _summits(values, above - REFINED_BELOW * (highest[may] - points.min(axis=1))[:, None])
    s, value = _refine(points[row], grid, values, row, column)
    kept = value > above
    return may[row[kept]], s[kept], value[kept]


def _summits(values: FloatArray, floor: FloatArray) -> tuple[IntArray, IntArray]:
    high = values > floor
    rising = values[:, 1:] >= values[:, :-1]
    # Not below the left neighbour and above the right one: a plateau counts once, at its right end.
    high[:, 1:] &= rising
    high[:, :-1] &= ~rising
    row, column = np.nonzero(high)
    return row, column


def _refine(
    points: FloatArray, grid: FloatArray, values: FloatArray, row: IntArray, column: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Take Newton steps on the derivative, no further than the next grid points; never to a lower value."""
    s, value, degree = grid[column], values[row, column], points.shape[1] - 1
    if degree < 2 or not len(s):
        return s, value
    taylor = np.matmul(_expansions(degree)[column], points[:, :, None]).reshape(len(s), 3, degree + 1)
    low, high = (side[column] for side in _reach(degree))
    step = _within(_newton(taylor[:, 1, 0], taylor[:, 2, 0]), low, high)
    for _ in range(STEPS):
        local = _at(taylor[:, 1:], step)
        step = _within(step + _newton(local[:, 0], local[:, 1]), low, high)
    refined = _at(taylor[:, :1], step)[:, 0]
    better = refined > value
    return np.where(better, s + step, s), np.where(better, refined, value)


def _at(taylor: FloatArray, step: FloatArray) -> FloatArray:
    """Values of polynomials (p, q, n + 1) a step (p,) away: (p, q)."""
    return np.asarray(np.matmul(taylor, rising_powers(step, 0, taylor.shape[2])[:, :, None])[:, :, 0])


def _newton(slope: FloatArray, curve: FloatArray) -> FloatArray:
    """Step to a maximum; none where the curve is not concave."""
    return np.asarray(slope / np.where(curve < 0.0, -curve, np.inf))


def _within(step: FloatArray, low: FloatArray | float, high: FloatArray | float) -> FloatArray:
    return np.minimum(np.maximum(step, low), high)

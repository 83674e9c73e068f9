"""Exact maxima of quotients of polynomials on [0, 1], by Dinkelbach's method.

The largest p/q is the root t of max(p - t q) = 0; each step sets t to p/q where p - t q is largest and converges
superlinearly (W. Dinkelbach, "On nonlinear fractional programming", Management Science 13, 1967).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.polynomials import extrema
from minsnap.polynomials.bernstein import basis

Maximum = Callable[[FloatArray], tuple[float, int, float]]
"""Gives the largest value of polynomials, which of them has it, and where on [0, 1]."""


def largest_ratio(top: FloatArray, bottom: FloatArray, maximum: Maximum = extrema.maximum) -> tuple[float, int, float]:
    """Largest p/q over many pairs of polynomials on [0, 1], q not negative.

    Parameters
    ----------
    top, bottom : ndarray, shape (m, n + 1)
        Control points of p and q, of the same degree.
    maximum : callable, optional
        By default the Python one.

    Returns
    -------
    value : float
        Infinite where q vanishes and p does not.
    row : int
        Which pair.
    where : float
        Instant in [0, 1].
    """
    with np.errstate(over="ignore"):
        first = top[:, 0] / np.maximum(bottom[:, 0], np.finfo(np.float64).tiny)
    row, where = int(np.argmax(first)), 0.0
    trial = float(first[row])
    while np.isfinite(trial):
        _, row, where = maximum(top - trial * bottom)
        ratio = _ratio(top[row], bottom[row], where)
        if not ratio > trial + 4.0 * np.finfo(np.float64).eps * abs(trial):
            return max(ratio, trial), row, where
        trial = ratio
    return trial, row, where


def _ratio(top: FloatArray, bottom: FloatArray, where: float) -> float:
    weights = basis(len(top) - 1, np.array([where]))[0]
    p, q = float(weights @ top), float(weights @ bottom)
    return p / q if q > 0.0 else np.inf

"""The point of least distance within rows, by non-negative least squares: accurate where rows are nearly dependent.

C. L. Lawson and R. J. Hanson, "Solving Least Squares Problems", 1974, chapter 23.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.basics.tolerances import ROUNDING

KEPT = 1e-14
"""Violation of a normalised row, beside the solution, that is rounding."""

Spend = Callable[[str, int, int, int], bool]
"""Counts a call of a solver with so many rows, unknowns and iterations; whether more may follow."""

RESCALINGS = 6
"""How often a least-distance problem is scaled again so that its solution is of order one."""


def least_distance(
    G: FloatArray,
    h: FloatArray,
    A: FloatArray | None,
    b: FloatArray | None,
    q: FloatArray,
    active: BoolArray | None,
    spend: Spend | None = None,
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    r"""Minimise :math:`|x|^2 / 2 + q^\top x` over :math:`Gx \le h`, :math:`Ax = b`.

    Parameters
    ----------
    active : ndarray of bool, shape (a,), optional
        Which of the first a rows of G were active in a similar problem.  The time grows fast with the rows, so it
        begins with those and the ones that follow, and takes in others as they are broken.
    spend : callable, optional
        Counts the calls of non-negative least squares, and ends them.

    Returns
    -------
    x, multipliers, equality_multipliers : ndarray
        None if the rows contradict each other, or ``spend`` ended it.
    """
    rows, bounds = (G, h) if A is None or b is None else (np.vstack((G, A, -A)), np.concatenate((h, b, -b)))
    bounds = bounds + rows @ q
    used = np.ones(len(rows), dtype=bool)
    if active is not None and (active.any() or len(active) < len(h)):
        used[: len(active)] = active
    multipliers = np.zeros(len(rows))
    while True:
        found = _least_norm(rows[used], bounds[used], spend)
        if found is None:
            return None
        x, multipliers[used] = found
        broken = ~used & (rows @ x - bounds > KEPT * max(1.0, float(np.abs(x).max())))
        if not broken.any():
            break
        used |= broken
    inequalities = len(h)
    equalities = (len(rows) - inequalities) // 2
    both = multipliers[inequalities:]
    return x - q, multipliers[:inequalities], both[:equalities] - both[equalities:]


def _least_norm(rows: FloatArray, bounds: FloatArray, spend: Spend | None) -> tuple[FloatArray, FloatArray] | None:
    """Point of least norm within rows, and their multipliers; None where there is none."""
    from scipy.optimize import nnls

    size = 1.0
    for _ in range(RESCALINGS):
        dual = np.vstack((-rows.T, -bounds / size))
        try:
            weights, _ = nnls(dual, np.eye(len(dual))[-1], maxiter=50 * dual.shape[1])
        except RuntimeError:
            return None
        if spend is not None and not spend("nnls", len(rows), rows.shape[1], 1 + int(np.count_nonzero(weights))):
            return None
        residual = dual @ weights
        residual[-1] -= 1.0
        if not residual[-1] < -np.finfo(np.float64).eps or size * ROUNDING > 1.0:
            return None
        length = float(np.linalg.norm(residual[:-1])) / -residual[-1]
        if 0.1 < length < 10.0:
            break
        size *= max(length, 1e-3)
    x, multipliers = -size * residual[:-1] / residual[-1], -size * weights / residual[-1]
    return _sharpened(rows, bounds, np.flatnonzero(weights > 0.0), x, multipliers)


def _sharpened(
    rows: FloatArray, bounds: FloatArray, active: IntArray, x: FloatArray, multipliers: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Solve for the point of least norm on the active rows, to working precision, where they are independent."""
    from scipy.linalg import solve_triangular

    if not 0 < len(active) <= rows.shape[1]:
        return x, multipliers
    Q, R = np.linalg.qr(rows[active].T)
    diagonal = np.abs(np.diag(R))
    if diagonal.min() <= ROUNDING * diagonal.max():
        return x, multipliers
    y = solve_triangular(R, bounds[active], trans="T")
    sharpened = np.zeros(len(rows))
    sharpened[active] = np.maximum(-solve_triangular(R, y), 0.0)
    return Q @ y, sharpened

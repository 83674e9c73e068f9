"""Least squares on records of a flight, with standard errors that allow for residuals that depend on each other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray

MEMORY = 1.0
"""For how long residuals are taken to depend on each other [s]."""


@dataclass(frozen=True)
class FittedNumber:
    """A number from a fit.

    Parameters
    ----------
    value : float
    error : float
        Standard error.
    """

    value: float
    error: float

    def __str__(self) -> str:
        return f"{self.value:.4g} ± {self.error:.2g}"


def fitted(
    residuals: Callable[[FloatArray], FloatArray], first: FloatArray, rate: float
) -> tuple[list[FittedNumber], FloatArray]:
    """Minimise a sum of squares.

    The covariance is :math:`(J^T J)^{-1} S (J^T J)^{-1}`, S the sum of the products of the rows' gradients over lags
    up to a second with Bartlett's weights, so that slow residuals do not pass for many independent ones (W. K. Newey
    and K. D. West, Econometrica 55, 1987).

    Parameters
    ----------
    residuals : callable
        From parameters (p,) to residuals (m, axes), rows at equal steps of time.
    first : ndarray, shape (p,)
        Where to begin.
    rate : float
        Rows a second [Hz].

    Returns
    -------
    estimates : list of FittedNumber
    residuals : ndarray, shape (m, axes)
        At the minimum.
    """
    from scipy.optimize import least_squares

    solution = least_squares(lambda values: residuals(values).reshape(-1), first, method="lm", x_scale=1.0)
    left = residuals(solution.x)
    slopes = solution.jac.reshape(*left.shape, len(first))
    inverse = np.linalg.pinv(solution.jac.T @ solution.jac)
    spread = inverse @ _long_run(np.einsum("mi,mip->mp", left, slopes), round(MEMORY * rate)) @ inverse
    errors = np.sqrt(np.maximum(np.diag(spread), 0.0))
    return [FittedNumber(*pair) for pair in zip(solution.x.tolist(), errors.tolist(), strict=True)], left


def _long_run(rows: FloatArray, lags: int) -> FloatArray:
    """Sum the products of rows (m, p) up to ``lags`` apart, with weights that fall linearly."""
    total = rows.T @ rows
    for lag in range(1, min(lags, len(rows) - 1) + 1):
        product = rows[lag:].T @ rows[:-lag]
        total += (1.0 - lag / (lags + 1)) * (product + product.T)
    return total

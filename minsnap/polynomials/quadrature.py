"""Arc length of a piecewise polynomial by adaptive quadrature."""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.polynomials.bernstein import basis


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

"""Arc length of a piecewise polynomial by adaptive Gauss-Legendre quadrature."""

from __future__ import annotations

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.polynomials.bernstein import basis, subdivide

NODES = 16
DEPTH = 30


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
    pieces = len(widths)
    coarse = _integrals(points, widths)
    total, target = 0.0, tolerance * float(coarse.sum())
    for _ in range(DEPTH):
        halves, half_widths = _halved(points), np.repeat(widths / 2.0, 2)
        fine = _integrals(halves, half_widths)
        pairs = fine.reshape(-1, 2).sum(axis=1)
        rough = np.abs(pairs - coarse) > target / pieces / 8.0
        total += float(pairs[~rough].sum())
        if not rough.any():
            return total
        again = np.repeat(rough, 2)
        points, widths, coarse = halves[again], half_widths[again], fine[again]
    return total + float(coarse.sum())


def _integrals(points: FloatArray, widths: FloatArray) -> FloatArray:
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    values = np.einsum("qj,mjd->mqd", basis(points.shape[1] - 1, (nodes + 1.0) / 2.0), points)
    return np.asarray(np.linalg.norm(values, axis=2) @ weights * widths / 2.0)


def _halved(points: FloatArray) -> FloatArray:
    pieces, size, dim = points.shape
    flat = points.transpose(0, 2, 1).reshape(-1, size)
    parts = subdivide(flat, 2).reshape(pieces, dim, 2, size)
    return parts.transpose(0, 2, 3, 1).reshape(2 * pieces, size, dim)

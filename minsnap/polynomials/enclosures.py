"""Control points with running error bounds: each number of a certificate is computed with a bound on its rounding.

Standard model of rounding (N. J. Higham, "Accuracy and Stability of Numerical Algorithms", 2nd ed., SIAM 2002, sections
2.2, 3.1 and 3.3): one operation is off by at most u times its result, and a sum of k products, in any order, by at most
k u / (1 - k u) times the sum of their sizes.  Errors are sums of numbers >= 0 and themselves wrong by less than a share
of 2^-30, which ``above`` allows for once.  Stored control points, durations and walls are taken as exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import perm

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.polynomials.bernstein import squared_norm

UNIT = float(np.finfo(np.float64).eps) / 2.0
"""u, the largest relative error of one operation."""

TINY = 2.0**-1000
"""More than all underflow in the work on one polynomial, which the model leaves out."""


@dataclass(frozen=True, eq=False)
class Enclosure:
    """Control points, and how far each may be off.

    Parameters
    ----------
    points : ndarray, shape (..., n + 1) or (..., n + 1, dim)
    errors : ndarray, same shape
        Not negative.
    """

    points: FloatArray
    errors: FloatArray

    def minus(self, point: FloatArray) -> Enclosure:
        """Take a point away, of a shape that broadcasts; the rounding of each difference is known exactly.

        Source: D. E. Knuth, "The Art of Computer Programming", vol. 2, theorem 4.2.2B.
        """
        difference = self.points - point
        back = self.points - difference
        off = np.abs((self.points - (difference + back)) - (point - back))
        return Enclosure(difference, self.errors + off)

    def less(self, other: Enclosure) -> Enclosure:
        """Take other polynomials away, of a shape that broadcasts."""
        difference = self.points - other.points
        return Enclosure(difference, self.errors + other.errors + UNIT * np.abs(difference))

    def component(self, axis: int) -> Enclosure:
        """Return one coordinate of curves (m, n + 1, dim): (m, n + 1)."""
        return Enclosure(self.points[..., axis], self.errors[..., axis])

    def along(self, normal: FloatArray) -> Enclosure:
        """Components of curves (r, n + 1, dim) along normals (r, dim): (r, n + 1).

        Multiplying by 0, 1 or -1 is exact, so a normal along one axis adds no error.
        """
        size = np.abs(normal)
        plain = (size.sum(axis=1) == size.max(axis=1)) & (size.max(axis=1) == 1.0)
        share = np.where(plain, 0.0, (normal.shape[1] + 1) * UNIT)[:, None]
        points = np.matmul(self.points, normal[:, :, None])[:, :, 0]
        errors = np.matmul(self.errors + share[:, :, None] * np.abs(self.points), size[:, :, None])[:, :, 0]
        return Enclosure(points, errors)

    def mapped(self, matrix: FloatArray) -> Enclosure:
        """Images of curves (r, n + 1, dim) under matrices (r, q, dim): (r, n + 1, q)."""
        parts = [self.along(matrix[:, row]) for row in range(matrix.shape[1])]
        return Enclosure(np.stack([p.points for p in parts], -1), np.stack([p.errors for p in parts], -1))

    def squared_norm(self) -> Enclosure:
        """Squared norms of curves (m, n + 1, dim): (m, 2n + 1).

        With factors off by e and f, a b is off by at most ``|a| f + e |b| + e f``. The inner sums have dim terms, the
        outer ones n + 1 that are not zero; with products and weights these are at most dim + n + 7 roundings.
        """
        count, dim = self.points.shape[1:]
        size = np.abs(self.points)
        outer = size + self.errors
        sizes, outers = (squared_norm(np.ascontiguousarray(part)) for part in (size, outer))
        share = (dim + count + 6) * UNIT
        return Enclosure(squared_norm(self.points), np.maximum(outers - sizes, 0.0) + 4.0 * share * outers)


def above(points: FloatArray, errors: FloatArray) -> FloatArray:
    """Return values not below points + errors, whatever the rounding of the sum; the points where they are exact."""
    total = points + errors * (1.0 + 2.0**-29)
    return np.asarray(np.where(errors == 0.0, points, total + (2.0 * UNIT * np.abs(total) + TINY)))


def below(points: FloatArray, errors: FloatArray) -> FloatArray:
    """Return values not above points - errors."""
    return -above(-points, errors)


def derivative(points: FloatArray, durations: FloatArray, order: int) -> Enclosure:
    """Return derivatives of pieces.

    Parameters
    ----------
    points : ndarray, shape (m, n + 1, dim)
    durations : ndarray, shape (m,)
    order : int
        p; past the degree everything is zero.

    Returns
    -------
    Enclosure, shape (m, n + 1 - p, dim)
        n! / (n - p)! times the differences of order p, over T^p.
    """
    degree = points.shape[1] - 1
    if order > degree:
        return Enclosure(np.zeros_like(points[:, :1]), np.zeros_like(points[:, :1]))
    errors = np.zeros_like(points)
    for _ in range(order):
        points = points[:, 1:] - points[:, :-1]
        errors = errors[:, 1:] + errors[:, :-1] + UNIT * np.abs(points)
    if order:
        power = np.prod(np.repeat(durations[:, None], order, axis=1), axis=1)[:, None, None]
        factor = float(perm(degree, order))
        points, errors = factor * points / power, factor * errors / power
        errors += (order + 2) * UNIT * np.abs(points)
    return Enclosure(points, errors)

"""Arithmetic on ranges: what sums, products and roots of quantities can be when each is known between two bounds.

R. E. Moore, "Interval Analysis", 1966. To rounding: bounds are not rounded outwards.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Interval:
    """Ranges of many numbers.

    Parameters
    ----------
    low, high : ndarray, shape (m,)
        Bounds, low <= high.
    """

    low: FloatArray
    high: FloatArray

    def __add__(self, other: Interval) -> Interval:
        return Interval(self.low + other.low, self.high + other.high)

    def __neg__(self) -> Interval:
        return Interval(-self.high, -self.low)

    def __sub__(self, other: Interval) -> Interval:
        return Interval(self.low - other.high, self.high - other.low)

    def __mul__(self, other: Interval) -> Interval:
        corners = (self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high)
        return Interval(np.minimum.reduce(corners), np.maximum.reduce(corners))

    def __truediv__(self, other: Interval) -> Interval:
        """Quotient; without bounds where the divisor is not positive throughout."""
        positive = other.low > 0.0
        divisor = np.where(positive, other.low, 1.0), np.where(positive, other.high, 1.0)
        bounded = self * Interval(1.0 / divisor[1], 1.0 / divisor[0])
        return Interval(np.where(positive, bounded.low, -np.inf), np.where(positive, bounded.high, np.inf))

    def scaled(self, factor: float) -> Interval:
        """Multiply by a number."""
        ends = self.low * factor, self.high * factor
        return Interval(np.minimum(*ends), np.maximum(*ends))

    def shifted(self, number: float) -> Interval:
        """Add a number."""
        return Interval(self.low + number, self.high + number)

    def squared(self) -> Interval:
        """Square, which is never negative."""
        ends = self.low**2, self.high**2
        across = (self.low <= 0.0) & (self.high >= 0.0)
        return Interval(np.where(across, 0.0, np.minimum(*ends)), np.maximum(*ends))

    def root(self) -> Interval:
        """Square root of what is not negative."""
        return Interval(np.sqrt(np.maximum(self.low, 0.0)), np.sqrt(np.maximum(self.high, 0.0)))

    def within(self, low: float, high: float) -> Interval:
        """Use that the quantity is known to lie between two numbers."""
        return Interval(np.clip(self.low, low, high), np.clip(self.high, low, high))


Vector = tuple[Interval, Interval, Interval]
"""Ranges of three components."""


def dot(left: Vector, right: Vector) -> Interval:
    """Range of a scalar product."""
    return left[0] * right[0] + left[1] * right[1] + left[2] * right[2]


def cross(left: Vector, right: Vector) -> Vector:
    """Ranges of a vector product."""
    (x, y, z), (u, v, w) = left, right
    return y * w - z * v, z * u - x * w, x * v - y * u


def length(vector: Vector) -> Interval:
    """Range of a norm."""
    return (vector[0].squared() + vector[1].squared() + vector[2].squared()).root()


def along(vector: Vector) -> Vector:
    """Ranges of the direction of a vector."""
    size = length(vector)
    return (
        (vector[0] / size).within(-1.0, 1.0),
        (vector[1] / size).within(-1.0, 1.0),
        (vector[2] / size).within(-1.0, 1.0),
    )


def times(vector: Vector, factor: Interval) -> Vector:
    """Ranges of a vector times a number."""
    return vector[0] * factor, vector[1] * factor, vector[2] * factor


def plus(*vectors: Vector) -> Vector:
    """Ranges of a sum of vectors."""
    total = vectors[0]
    for vector in vectors[1:]:
        total = (total[0] + vector[0], total[1] + vector[1], total[2] + vector[2])
    return total

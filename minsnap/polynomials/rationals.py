"""Polynomials in exact rational arithmetic: exact but slow.

Every double is a rational, so whatever follows from control points by sums, products and halving can be computed
without any rounding.  Control points are lists of Fraction; a curve is a list of them, one per coordinate.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import comb, lcm, perm

import numpy as np

from minsnap.basics.arrays import FloatArray

Scalar = list[Fraction]
Curve = list[Scalar]

DEPTH = 400
"""Halvings after which a polynomial that only touches zero, somewhere else than at a dyadic number, stays undecided."""


def exact(values: FloatArray) -> Curve:
    """Return control points (n + 1, dim) as they are stored, coordinate by coordinate."""
    return [[Fraction(value) for value in axis] for axis in np.asarray(values).T.tolist()]


def derivative(curve: Curve, duration: Fraction, order: int) -> Curve:
    """Return the derivative of a piece in time: n! / (n - p)! times the differences of order p, over T^p."""
    degree = len(curve[0]) - 1
    if order > degree:
        return [[Fraction(0)] for _ in curve]
    for _ in range(order):
        curve = [[b - a for a, b in zip(axis, axis[1:], strict=False)] for axis in curve]
    factor = perm(degree, order) / duration**order
    return [[factor * value for value in axis] for axis in curve]


def relative(curve: Curve, point: FloatArray) -> Curve:
    """Take a point (dim,) away."""
    return [[value - Fraction(float(a)) for value in axis] for axis, a in zip(curve, point, strict=True)]


def along(curve: Curve, normal: FloatArray) -> Scalar:
    """Component along a normal (dim,)."""
    factors = [Fraction(float(value)) for value in normal]
    return [
        sum((f * v for f, v in zip(factors, values, strict=True) if f), Fraction(0))
        for values in zip(*curve, strict=True)
    ]


def squared_norm(curve: Curve) -> Scalar:
    """Squared Euclidean norm, of twice the degree."""
    degree = len(curve[0]) - 1
    square = [Fraction(0)] * (2 * degree + 1)
    for axis in curve:
        weighted = [comb(degree, j) * value for j, value in enumerate(axis)]
        for i, a in enumerate(weighted):
            for j, b in enumerate(weighted):
                square[i + j] += a * b
    return [value / comb(2 * degree, k) for k, value in enumerate(square)]


def is_never_negative(points: Sequence[Fraction]) -> bool:
    """Whether a polynomial is proved not to be negative anywhere on [0, 1]; by halving, in integers."""
    return is_one_never_negative([points])


def is_one_never_negative(polynomials: Sequence[Sequence[Fraction]]) -> bool:
    """Whether at every place of [0, 1] one of several polynomials is proved not to be negative, not always the same."""
    parts = [([_whole(points) for points in polynomials], 0)]
    while parts:
        part, depth = parts.pop()
        if any(min(points) >= 0 for points in part):
            continue
        if depth == DEPTH or not all(any(points[end] >= 0 for points in part) for end in (0, -1)):
            return False
        halves = [_halves(points) for points in part]
        parts += [([both[side] for both in halves], depth + 1) for side in (0, 1)]
    return True


def _whole(points: Sequence[Fraction]) -> list[int]:
    """Return a polynomial in integers, times a number that changes no sign."""
    factor = lcm(*(value.denominator for value in points))
    return [int(value * factor) for value in points]


def _halves(part: list[int]) -> tuple[list[int], list[int]]:
    """Control points of both halves, times 2^degree: de Casteljau's sums are not divided but counted.

    Those of the right half are backwards, which has no part in their sign.
    """
    degree = len(part) - 1
    left, right = [part[0] << degree], [part[-1] << degree]
    for level in range(1, degree + 1):
        part = [a + b for a, b in zip(part, part[1:], strict=False)]
        left.append(part[0] << degree - level)
        right.append(part[-1] << degree - level)
    return left, right

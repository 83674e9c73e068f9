"""Rational arithmetic of a proof: vectors as lists, roots and tangents with a bound on the side that is asked for."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from math import factorial, inf, isqrt, nextafter
from typing import Any

Numbers = list[Fraction]

DIGITS = 80
"""Bits to which a root is bounded, beyond those of the number."""

TERMS = 20
"""Of the series of a sine and a cosine."""


def exact(values: Any) -> Any:
    """Return an array as lists of rationals."""
    listed = values.tolist() if hasattr(values, "tolist") else values
    return [exact(one) for one in listed] if isinstance(listed, list) else Fraction(listed)


def dot(one: Iterable[Fraction], other: Iterable[Fraction]) -> Fraction:
    """Return the product of two vectors."""
    return sum((a * b for a, b in zip(one, other, strict=True)), Fraction(0))


def minus(one: Sequence[Fraction], other: Sequence[Fraction]) -> Numbers:
    """Return the difference of two vectors."""
    return [a - b for a, b in zip(one, other, strict=True)]


def root_below(square: Fraction | int) -> Fraction:
    """Return a rational that is not more than a root."""
    number = Fraction(square)
    shift = max(DIGITS + (number.denominator.bit_length() - number.numerator.bit_length()) // 2, 0)
    return Fraction(isqrt((number.numerator << 2 * shift) // number.denominator), 1 << shift)


def root_above(square: Fraction | int) -> Fraction:
    """Return a rational that is not less than a root."""
    number = Fraction(square)
    if not number:
        return number
    shift = max(DIGITS + (number.denominator.bit_length() - number.numerator.bit_length()) // 2, 0)
    return Fraction(isqrt(-(-(number.numerator << 2 * shift) // number.denominator)) + 1, 1 << shift)


def tangent_above(angle: Fraction) -> Fraction:
    """Return a rational that is not less than the tangent of an angle in [0, 1.3], by alternating series."""
    x = Fraction(-(-(angle.numerator << DIGITS) // angle.denominator), 1 << DIGITS)
    terms = [(-1) ** (n // 2) * x**n / factorial(n) for n in range(TERMS + 3)]
    return sum(terms[1 : TERMS + 2 : 2], Fraction(0)) / sum(terms[0 : TERMS + 3 : 2], Fraction(0))


def float_above(value: Fraction) -> float:
    """Return a floating-point number that is not less than a rational."""
    return nextafter(float(value), inf)

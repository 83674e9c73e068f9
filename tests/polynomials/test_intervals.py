"""Arithmetic on ranges: whatever the numbers are, results are inside."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from minsnap.polynomials.intervals import Interval, along, cross, dot, length

NUMBERS = st.integers(-50_000_000, 50_000_000).map(lambda millionths: 1e-6 * millionths)


@st.composite
def ranges(draw):
    """A range, and a number inside it."""
    low, high = sorted((draw(NUMBERS), draw(NUMBERS)))
    return Interval(np.array([low]), np.array([high])), low + draw(st.floats(0.0, 1.0)) * (high - low)


def check(found, value):
    slack = 1e-9 * (1.0 + abs(value))
    assert found.low[0] - slack <= value <= found.high[0] + slack


@given(ranges(), ranges())
def test_sums_differences_products_and_quotients(left, right):
    (x, a), (y, b) = left, right
    check(x + y, a + b)
    check(x - y, a - b)
    check(x * y, a * b)
    check(-x, -a)
    if b != 0.0:
        check(x / y, a / b)


@given(ranges(), NUMBERS)
def test_functions_of_one_number(given, factor):
    x, a = given
    check(x.scaled(factor), a * factor)
    check(x.shifted(factor), a + factor)
    check(x.squared(), a * a)
    check(x.squared().root(), abs(a))
    check(x.within(-100.0, 100.0), a)


@given(st.tuples(ranges(), ranges(), ranges()), st.tuples(ranges(), ranges(), ranges()))
def test_vectors(left, right):
    x, a = zip(*left, strict=True)
    y, b = zip(*right, strict=True)
    check(dot(x, y), np.dot(a, b))
    check(length(x), np.linalg.norm(a))
    for found, value in zip(cross(x, y), np.cross(a, b), strict=True):
        check(found, value)
    if np.linalg.norm(a) > 1e-6:
        for found, value in zip(along(x), np.array(a) / np.linalg.norm(a), strict=True):
            check(found, value)


def test_ranges_of_nothing_are_exact():
    three, minus_two = (Interval(np.array([v]), np.array([v])) for v in (3.0, -2.0))
    assert (three * minus_two).low == (three * minus_two).high == -6.0
    assert minus_two.squared().low == 4.0 and (minus_two / three).low == pytest.approx(-2.0 / 3.0)


def test_a_divisor_that_may_vanish_bounds_nothing():
    quotient = Interval(np.ones(1), np.ones(1)) / Interval(np.zeros(1), np.ones(1))
    assert (quotient.low, quotient.high) == (-np.inf, np.inf)


def test_components_of_a_direction_are_within_one():
    wide = Interval(np.array([-3.0]), np.array([3.0]))
    short = Interval(np.array([1.0]), np.array([2.0]))
    for vector in ((wide, short, wide), (short, wide, wide), (wide, wide, short)):
        assert all(-1.0 <= part.low[0] <= part.high[0] <= 1.0 for part in along(vector))


def test_ranges_beyond_what_is_known_end_there():
    found = Interval(np.array([2.0, -3.0, -2.0]), np.array([3.0, -2.0, 0.5])).within(-1.0, 1.0)
    assert found.low.tolist() == [1.0, -1.0, -1.0] and found.high.tolist() == [1.0, -1.0, 0.5]

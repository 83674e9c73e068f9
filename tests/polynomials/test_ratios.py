"""Largest quotients of polynomials, against the roots of their derivative."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from numpy.polynomial.polynomial import polyfromroots
from scipy.interpolate import BPoly

from minsnap.polynomials.extrema import largest_ratio

GRID = np.linspace(0.0, 1.0, 20001)


def evaluated(points, at):
    return BPoly(np.asarray(points)[:, None], [0.0, 1.0])(at)


def monomial(points):
    """Power basis of control points, by solving for values at Chebyshev points."""
    n = len(points)
    at = 0.5 - 0.5 * np.cos((np.arange(n) + 0.5) * np.pi / n)
    return Polynomial(np.linalg.solve(np.vander(at, increasing=True), evaluated(points, at)))


def by_roots(top, bottom):
    """Candidates are the ends and the real roots of p' q - p q'."""
    p, q = monomial(top), monomial(bottom)
    roots = (p.deriv() * q - p * q.deriv()).roots()
    inner = roots.real[(np.abs(roots.imag) < 1e-6) & (roots.real > 0.0) & (roots.real < 1.0)]
    at = np.concatenate(([0.0, 1.0], inner))
    values = evaluated(top, at) / evaluated(bottom, at)
    return values.max()


@pytest.mark.parametrize("seed", range(20))
def test_random_quotients(seed):
    random = np.random.default_rng(seed)
    rows, size = int(random.integers(1, 5)), int(random.integers(2, 9))
    top, bottom = random.normal(size=(rows, size)), random.uniform(0.05, 1.0, (rows, size))
    value, row, where = largest_ratio(top, bottom)
    best = [by_roots(top[i], bottom[i]) for i in range(rows)]
    assert value == pytest.approx(max(best), rel=1e-8, abs=1e-10)
    assert row == int(np.argmax(best))
    assert evaluated(top[row], where) / evaluated(bottom[row], where) == pytest.approx(value, rel=1e-9)


def test_a_narrow_peak_between_samples_is_found():
    """1 / ((s - 1/pi)^2 + 1e-10): as high as 1e10, as narrow as 1e-5."""
    at = 1.0 / np.pi
    square = polyfromroots([at, at]) + [1e-10, 0.0, 0.0]
    points = np.array([[square[0], square[0] + square[1] / 2.0, square.sum()]])
    value, _, where = largest_ratio(np.ones((1, 3)), points)
    assert where == pytest.approx(at, abs=1e-7)
    assert value == pytest.approx(1e10, rel=1e-3)


def test_a_denominator_that_vanishes_gives_infinity():
    value, row, where = largest_ratio(np.ones((2, 3)), np.array([[1.0, 1.0, 1.0], [1.0, -1.0, 1.0]]))
    assert value == np.inf and row == 1 and where == pytest.approx(0.5)


def test_a_numerator_that_vanishes_gives_zero():
    assert largest_ratio(np.zeros((2, 4)), np.ones((2, 4)))[0] == 0.0


def test_a_denominator_that_vanishes_at_the_start_gives_infinity_there():
    assert largest_ratio(np.full((2, 2), 9.0), np.array([[1.0, 1.0], [0.0, 1.0]])) == (np.inf, 1, 0.0)

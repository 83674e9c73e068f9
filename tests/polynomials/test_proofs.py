"""Proved bounds against exact rationals: on the safe side of the truth always, and close to it."""

from fractions import Fraction

import numpy as np
import pytest

from minsnap.native import proved_extrema as native
from minsnap.native.library import using
from minsnap.polynomials.enclosures import derivative
from minsnap.polynomials.extrema import maxima
from minsnap.polynomials.rationals import is_never_negative


def greatest(points, errors=None):
    """Attained values and bounds from the Python core."""
    found = maxima(points, errors)
    return found.values, found.bounds


def greatest_native(points, errors=None):
    """The same from the native core."""
    with using("native"):
        found = native.maxima(points, errors, len(points))
    return found[:2]


CORES = pytest.mark.parametrize("found", (greatest, greatest_native))


def random_polynomials(random, count, degree):
    """Walls of hard curves: sizes from 1e-6 to 1e6 m, half of them moved so that their tops almost touch zero."""
    points = random.normal(size=(count, degree + 1)) * 10.0 ** random.uniform(-6.0, 6.0, size=(count, 1))
    points[::3] *= 10.0 ** random.uniform(-8.0, 0.0, size=points[::3].shape)
    tops = maxima(points).values
    touching = random.random(count) < 0.5
    return points - np.where(touching, tops, 0.0)[:, None]


def exceeds(points, bound):
    """Whether a polynomial is anywhere above a bound, in exact rationals."""
    return not is_never_negative([Fraction(bound) - Fraction(value) for value in points.tolist()])


@pytest.mark.slow
@CORES
@pytest.mark.parametrize("degree", (1, 2, 3, 5, 7, 9, 11, 14, 20))
def test_no_polynomial_exceeds_its_bound_and_none_stays_far_below(found, degree):
    points = random_polynomials(np.random.default_rng(degree), 120, degree)
    attained, bounds = found(points)
    size = np.abs(points).max(axis=1)
    for row, value, bound, scale in zip(points, attained, bounds, size, strict=True):
        assert not exceeds(row, bound)
        assert degree == 0 or exceeds(row, np.nextafter(value, -np.inf)), (
            "what is attained is reached in exact rationals"
        )
        assert bound - value <= 2e-14 * degree * scale


@pytest.mark.slow
@CORES
def test_ten_thousand_polynomials(found):
    random, wrong = np.random.default_rng(7), 0
    for _ in range(5):
        points = random_polynomials(random, 2000, int(random.choice([3, 5, 7, 7, 7, 9, 11])))
        _, bounds = found(points)
        wrong += sum(exceeds(row, bound) for row, bound in zip(points, bounds, strict=True))
    assert wrong == 0


@CORES
def test_errors_of_control_points_widen_the_bound(found):
    random = np.random.default_rng(1)
    points = random.normal(size=(50, 8))
    errors = 10.0 ** random.uniform(-12.0, -6.0, size=points.shape)
    attained, bounds = found(points, errors)
    for row, off, value, bound in zip(points, errors, attained, bounds, strict=True):
        raised = [Fraction(p) + Fraction(e) for p, e in zip(row.tolist(), off.tolist(), strict=True)]
        lowered = [Fraction(p) - Fraction(e) for p, e in zip(row.tolist(), off.tolist(), strict=True)]
        assert is_never_negative([Fraction(bound) - v for v in raised])
        assert not is_never_negative([Fraction(np.nextafter(value, -np.inf)) - v for v in lowered])


@CORES
def test_control_points_that_touch_zero_exactly_give_zero(found):
    points = np.array([[0.0, 0.0, 0.0, 0.0, -1.0, -0.3, -0.7, -2.0], [-1.0, -3.0, 1.0, 0.5, -0.25, 0.0, 0.0, 0.0]])
    _, bounds = found(np.stack((points[0], points[1, ::-1])))
    assert bounds[0] == 0.0
    _, bounds = found(np.array([[0.0, -1.0, -1.0, 2.0, -3.0, -1.0, -1.0, 0.0]]) * 3.7)
    assert bounds[0] == 0.0, "an end that is zero stays zero through every halving"


@CORES
def test_a_flat_top_and_a_narrow_spike(found):
    flat = np.array([[1.0, 1.0, 1.0, 1.0 + 1e-15, 1.0, 1.0, 1.0, 1.0]])
    spike = np.array([[0.0, 0.0, 0.0, 1e9, -1e9, 0.0, 0.0, 0.0]])
    for points in (flat, spike):
        attained, bounds = found(points)
        assert not exceeds(points[0], bounds[0]) and exceeds(points[0], np.nextafter(attained[0], -np.inf))


@pytest.mark.parametrize("order", (0, 1, 2, 3, 4, 9))
def test_derivatives_are_within_their_errors(order):
    random = np.random.default_rng(order)
    points = random.normal(size=(20, 8, 2)) + 10.0 ** random.uniform(0.0, 6.6, size=(20, 1, 2))
    durations = 10.0 ** random.uniform(-2.0, 2.0, 20)
    found = derivative(points, durations, order)
    for piece, duration, values, errors in zip(points, durations, found.points, found.errors, strict=True):
        for axis in range(2):
            exact = [Fraction(value) for value in piece[:, axis].tolist()]
            for step in range(min(order, 8)):
                exact = [(7 - step) * (b - a) / Fraction(duration) for a, b in zip(exact, exact[1:], strict=False)]
            exact = exact or [Fraction(0)]
            for one, value, error in zip(exact, values[:, axis].tolist(), errors[:, axis].tolist(), strict=True):
                assert abs(one - Fraction(value)) <= Fraction(error) * (1 + Fraction(1, 2**29))

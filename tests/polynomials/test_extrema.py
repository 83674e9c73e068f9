"""Maxima by subdivision against roots of derivatives and dense grids."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

from minsnap.native.proved_extrema import maxima as native_maxima
from minsnap.polynomials.bernstein import basis, points_to_powers, powers_to_points
from minsnap.polynomials.extrema import maxima, maximum, peaks


def by_roots(points):
    """The largest value of one polynomial on [0, 1], from the roots of its derivative."""
    polynomial = Polynomial(points_to_powers(len(points) - 1) @ points)
    roots = polynomial.deriv().roots()
    places = [0.0, 1.0, *(r.real for r in roots if abs(r.imag) < 1e-6 and 0.0 < r.real < 1.0)]
    return max(float(basis(len(points) - 1, np.array([s]))[0] @ points) for s in places)


@given(st.integers(1, 14), st.integers(0, 2**32 - 1))
def test_the_maximum_is_the_one_at_a_root_of_the_derivative(degree, seed):
    points = np.random.default_rng(seed).normal(size=(5, degree + 1))
    found = maxima(points)
    scale = np.abs(points).max()
    for row in range(5):
        assert found.values[row] == pytest.approx(by_roots(points[row]), abs=1e-11 * scale)
    assert found.rows.tolist() == list(range(5)) and found.rows.dtype == np.intp


@given(st.integers(1, 14), st.integers(0, 2**32 - 1))
@example(10, 1742)
def test_the_maximum_is_attained_where_it_is_said_to_be(degree, seed):
    """But for the rounding that the bound allows for, which grows with the square of the degree."""
    points = np.random.default_rng(seed).normal(size=(4, degree + 1))
    value, row, s = maximum(points)
    allowed = 2e-14 * degree**2 * np.abs(points).max()
    assert basis(degree, np.array([s]))[0] @ points[row] == pytest.approx(value, abs=allowed)
    grid = points @ basis(degree, np.linspace(0.0, 1.0, 2001)).T
    assert grid.max() <= value + 1e-14 * np.abs(points).max()


def from_roots(roots, scale=-1.0):
    powers = (scale * Polynomial.fromroots(roots)).coef
    return (powers_to_points(len(powers) - 1) @ powers)[None]


def test_a_maximum_of_high_order_is_found():
    value, _, s = maximum(from_roots([0.3] * 6))
    assert abs(value) <= 1e-13
    assert s == pytest.approx(0.3, abs=2e-2)


@pytest.mark.parametrize("place", (0.0, 1e-9, 1.0 / 3.0, 0.5, 1.0 - 1e-9, 1.0))
def test_a_maximum_anywhere_is_found(place):
    value, _, s = maximum(from_roots([place, place]))
    assert abs(value) <= 1e-14
    assert s == pytest.approx(place, abs=1e-6)


def test_two_equal_maxima_are_both_acceptable():
    points = from_roots([0.2, 0.2, 0.7, 0.7])
    value, _, s = maximum(points)
    assert abs(value) <= 1e-13
    assert min(abs(s - 0.2), abs(s - 0.7)) <= 1e-5


def test_a_narrow_spike_between_grid_points_is_found():
    # a peak 2e-9 above zero and some 1e-4 wide: any coarse grid misses it
    points = from_roots([0.3712 - 5e-5, 0.3712 + 5e-5])
    value, _, s = maximum(points)
    assert value == pytest.approx(2.5e-9, rel=1e-5)
    assert s == pytest.approx(0.3712, abs=1e-6)


def test_constants_lines_and_zeros():
    assert maximum(np.zeros((3, 8)))[0] == 0.0
    assert maximum(np.full((1, 8), -2.0))[0] == -2.0
    assert maximum(np.linspace(0.0, 1.0, 8)[None]) == (1.0, 0, 1.0)
    assert maximum(np.linspace(1.0, 0.0, 8)[None]) == (1.0, 0, 0.0)
    assert maximum(np.array([[4.0]]))[0] == 4.0


@given(st.integers(0, 2**32 - 1), st.floats(-300, 300))
def test_maxima_scale_with_their_polynomials(seed, power):
    points = np.random.default_rng(seed).normal(size=(3, 8))
    scaled = maxima(points * 2.0 ** round(power)).values
    assert (scaled == maxima(points).values * 2.0 ** round(power)).all()


def test_many_polynomials_at_once_are_each_as_if_alone():
    points = np.random.default_rng(3).normal(size=(200, 8))
    together = maxima(points).bounds
    assert together == pytest.approx([maxima(row[None]).bounds[0] for row in points], abs=1e-13)


@given(st.integers(2, 14), st.integers(0, 2**32 - 1))
def test_peaks_find_every_local_maximum_above_a_level(degree, seed):
    points = np.random.default_rng(seed).normal(size=(4, degree + 1))
    row, s, value = peaks(points, 0.0)
    assert (value > 0.0).all()
    assert np.einsum("pj,pj->p", basis(degree, s), points[row]) == pytest.approx(value, abs=1e-12)
    for polynomial in range(4):
        highest = by_roots(points[polynomial])
        if highest > 1e-3:
            assert value[row == polynomial].max() == pytest.approx(highest, rel=1e-4)


def test_peaks_are_refined_by_newton_steps():
    # the maximum of -(s - p)^2 + 1 lies off every grid; without refinement it is missed by the square of a step
    for place in np.linspace(0.11, 0.89, 13):
        points = from_roots([place - 1.0, place + 1.0])
        row, s, value = peaks(points, 0.5)
        assert value[0] == pytest.approx(1.0, abs=1e-12)
        assert s[0] == pytest.approx(place, abs=1e-9)


def test_peaks_below_the_level_are_not_reported():
    row, s, value = peaks(np.array([[-1.0, -0.5, -1.0], [0.0, 4.0, 0.0]]), 1.0)
    assert list(row) == [1]
    assert value == pytest.approx([2.0])


@pytest.mark.slow
@pytest.mark.parametrize("degree", (7, 14, 22))
def test_cuts_alone_are_as_exact_as_the_newton_steps_of_the_native_core(degree):
    random = np.random.default_rng(degree)
    points = random.normal(size=(3000, degree + 1)) * 10.0 ** random.uniform(-5.0, 0.0, size=(3000, degree + 1))
    cut, (values, bounds, *_) = maxima(points), native_maxima(points, None, len(points))
    assert (bounds >= cut.values).all() and (cut.bounds >= values).all()
    assert ((cut.bounds - values) / np.abs(points).max(axis=1)).max() <= 1e-13 * degree


@pytest.mark.parametrize("core", ("native", "python"))
def test_the_bound_of_one_polynomial_does_not_depend_on_another(core):
    """The hull of the second, with its errors, is above zero, and its maximum below."""
    points = np.array([[-1e-12, -1e-12, -1e-12], [-3e-7, 1e-8, -3e-7]])
    errors = np.array([[0.0] * 3, [1e-8] * 3])
    found = native_maxima(points, errors)[1][0] if core == "native" else maximum(points, errors)[0]
    assert found == -1e-12


def test_peaks_of_straight_lines_are_at_their_ends():
    row, s, value = peaks(np.array([[0.0, 1.0], [2.0, 0.0]]), 0.5)
    assert [row.tolist(), s.tolist(), value.tolist()] == [[0, 1], [1.0, 0.0], [1.0, 2.0]]


@pytest.mark.parametrize("degree", (4, 8))
def test_bounds_hold_for_all_polynomials_within_the_errors(degree):
    """Those with flat tops, of which parts are concave but for the errors."""
    random = np.random.default_rng(degree)
    places, size = random.uniform(0.2, 0.8, 200), 10.0 ** random.uniform(-9.0, -1.0, 200)
    powers = np.array([(1.0 - Polynomial([-place, 1.0]) ** degree).coef for place in places])
    points = powers @ powers_to_points(degree).T
    errors = np.repeat(size[:, None], degree + 1, axis=1)
    found = maxima(points, errors)
    highest = (points @ basis(degree, np.linspace(0.0, 1.0, 1001)).T).max(axis=1)
    assert (found.bounds >= highest + size).all() and (found.bounds >= found.values).all()
    assert (found.bounds <= 1.0 + 100.0 * size).all()

"""Constants against exact rationals, and the Bernstein form against plain powers."""

from fractions import Fraction
from math import comb

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from oracles import exact
from scipy.interpolate import BPoly

from minsnap.polynomials import bernstein as polynomial

DEGREES = (3, 5, 7, 9, 11)
EVERY = (*range(1, 12), 14)


def rounded(matrix):
    return np.array([[float(value) for value in row] for row in matrix])


def control_points(degree, rows=3, seed=0):
    return np.random.default_rng(seed).normal(size=(rows, degree + 1))


@pytest.mark.parametrize("degree", DEGREES)
def test_ends_to_points_is_the_exact_matrix_rounded_once(degree):
    assert (polynomial.ends_to_points(degree) == rounded(exact.ends_to_points(degree))).all()


@pytest.mark.parametrize("degree", DEGREES)
def test_ends_gram_is_the_exact_matrix_rounded_once(degree):
    assert (polynomial.ends_gram(degree) == rounded(exact.ends_gram(degree))).all()


def test_snap_gram_of_the_textbook():
    # rest-to-rest over one metre in one second: snap's integral is 100 800
    assert polynomial.ends_gram(7)[0, 0] == 100_800.0
    assert polynomial.ends_gram(5)[0, 0] == 720.0
    assert polynomial.ends_gram(3)[0, 0] == 12.0


@pytest.mark.parametrize("degree", EVERY)
def test_powers_and_points_are_exact_inverses(degree):
    to_points = [[Fraction(comb(j, i), comb(degree, i)) for i in range(degree + 1)] for j in range(degree + 1)]
    assert (polynomial.powers_to_points(degree) == rounded(to_points)).all()
    identity = [[int(i == j) for j in range(degree + 1)] for i in range(degree + 1)]
    assert (polynomial.points_to_powers(degree) == rounded(exact.solve(to_points, identity))).all()


@pytest.mark.parametrize("order", range(6))
@pytest.mark.parametrize("degree", DEGREES)
def test_gram_is_the_exact_integral(degree, order):
    if order > degree:
        return
    inverse = [[int(i == j) for j in range(degree + 1)] for i in range(degree + 1)]
    to_points = [[Fraction(comb(j, i), comb(degree, i)) for i in range(degree + 1)] for j in range(degree + 1)]
    C, Q, size = exact.solve(to_points, inverse), exact.power_gram(degree, order), degree + 1
    half = [[sum(Q[i][j] * C[j][b] for j in range(size)) for b in range(size)] for i in range(size)]
    expected = [[sum(C[i][a] * half[i][b] for i in range(size)) for b in range(size)] for a in range(size)]
    assert (polynomial.gram(degree, order) == rounded(expected)).all()


@pytest.mark.parametrize("degree", EVERY)
def test_basis_is_that_of_scipy_and_a_partition_of_one(degree):
    s = np.linspace(0.0, 1.0, 57)
    values = polynomial.basis(degree, s)
    expected = [BPoly(np.eye(degree + 1)[j][:, None], [0.0, 1.0])(s) for j in range(degree + 1)]
    assert values == pytest.approx(np.array(expected).T, abs=1e-15)
    assert values.sum(axis=1) == pytest.approx(np.ones(len(s)), abs=4e-15)
    assert values.min() >= 0.0


@pytest.mark.parametrize("order", range(5))
@pytest.mark.parametrize("degree", EVERY)
def test_differentiate_is_that_of_scipy(degree, order):
    points = control_points(degree)
    found = polynomial.differentiate(points[:, :, None], order)[:, :, 0]
    if order > degree:
        assert not found.any()
        return
    expected = BPoly(points.T, np.arange(4.0)).derivative(order).c.T if order else points
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-9)
    assert points @ polynomial.derivative_basis_map(degree, order).T == pytest.approx(expected, rel=1e-12, abs=1e-9)


@pytest.mark.parametrize("degree", DEGREES)
def test_squared_norm_is_the_sum_of_squares(degree):
    points = np.random.default_rng(1).normal(size=(4, degree + 1, 3))
    s = np.linspace(0.0, 1.0, 41)
    curve = np.einsum("sj,mjd->msd", polynomial.basis(degree, s), points)
    squares = polynomial.basis(2 * degree, s) @ polynomial.squared_norm(points).T
    assert squares.T == pytest.approx((curve**2).sum(axis=2), rel=1e-12)


@pytest.mark.parametrize("parts", (2, 8))
@pytest.mark.parametrize("degree", (1, 7, 14))
def test_subdivision_agrees_with_the_whole_on_every_part(degree, parts):
    points = control_points(degree)
    s = np.linspace(0.0, 1.0, 9)
    pieces = polynomial.subdivide(points, parts)
    for part in range(parts):
        whole = polynomial.basis(degree, (part + s) / parts) @ points.T
        assert polynomial.basis(degree, s) @ pieces[:, part].T == pytest.approx(whole, abs=1e-12)


@pytest.mark.parametrize("degree", DEGREES)
def test_ends_come_back_from_points(degree):
    half = (degree + 1) // 2
    ends = np.random.default_rng(2).normal(size=2 * half)
    powers = Polynomial(polynomial.points_to_powers(degree) @ polynomial.ends_to_points(degree) @ ends)
    for order in range(half):
        derivative = powers.deriv(order) if order else powers
        assert derivative(0.0) == pytest.approx(ends[order], rel=1e-9, abs=1e-9)
        assert derivative(1.0) == pytest.approx(ends[half + order], rel=1e-6, abs=1e-6)


def test_constants_cannot_be_written_to():
    for constant in (polynomial.gram(7, 4), polynomial.ends_gram(7), polynomial.ends_to_points(7)):
        with pytest.raises(ValueError, match="read-only"):
            constant[0, 0] = 1.0


@pytest.mark.parametrize("degree", [1, 7, 11])
def test_parts_of_a_curve_are_the_curve(degree):
    points = np.random.default_rng(degree).normal(size=(3, degree + 1, 2))
    shares = np.array([(0.2, 0.5, 0.3), (0.25, 0.25, 0.5), (0.6, 0.1, 0.3)])
    parts, s = polynomial.from_whole(*polynomial.parted(points, shares)), np.linspace(0.0, 1.0, 9)
    begins = np.cumsum(shares, axis=1) - shares
    for curve, part in np.ndindex(3, 3):
        inside = polynomial.basis(degree, begins[curve, part] + s * shares[curve, part]) @ points[curve]
        assert polynomial.basis(degree, s) @ parts[curve, part] == pytest.approx(inside, abs=1e-13)


def test_parts_of_a_curve_begin_where_those_of_rationals_do():
    """To many digits, although the shares left of the duration are not exact in a double."""
    points = np.array([[[0.3], [-7.0], [11.0], [0.7]]])
    shares = np.array([[0.1, 0.23, 0.37, 0.3]])
    found, unit = polynomial.parted(points, shares)
    exact_points = np.array([[Fraction(value)] for value in points[0, :, 0].tolist()])
    times = list(map(Fraction, shares[0].tolist()))
    ends = [sum(times[:k], Fraction(0)) / sum(times) for k in range(5)]
    for part, low, high in zip(found[0], ends[:-1], ends[1:], strict=True):
        exact_part = polynomial.split(polynomial.split(exact_points, high)[0], low / high)[1]
        for value, exact_value in zip(part[:, 0], exact_part[:, 0], strict=True):
            assert abs(value * Fraction(unit) - exact_value) <= 1e-50


def test_polynomials_are_divided_into_parts_of_their_own_number():
    points, counts = np.random.default_rng(4).normal(size=(3, 8, 2)), np.array([2, 1, 3])
    durations, parts = polynomial.divided_pieces(np.array([1.0, 0.3, 2.0]), points, counts)
    assert durations == pytest.approx([0.5, 0.5, 0.3, 2 / 3, 2 / 3, 2 / 3], rel=1e-15)
    s, places = np.linspace(0.0, 1.0, 9), [(0, 0), (0, 1), (1, 0), (2, 0), (2, 1), (2, 2)]
    for part, (curve, number) in zip(parts, places, strict=True):
        inside = polynomial.basis(7, (number + s) / counts[curve]) @ points[curve]
        assert polynomial.basis(7, s) @ part == pytest.approx(inside, abs=1e-14)


def test_small_differences_of_large_numbers_are_rounded_once():
    random = np.random.default_rng(0)
    points = 1e6 + random.normal(size=(50, 8, 2)) * 10.0 ** np.arange(-7, 1)[:, None]
    points[25:] = random.normal(size=(25, 8, 2)) * 10.0 ** random.uniform(-6.0, 6.0, (25, 8, 2))
    for order in range(1, 6):
        found = polynomial.careful_differences(points, order)
        for curve, values in zip(points, found, strict=True):
            exact = [[Fraction(value) for value in row] for row in curve.tolist()]
            for _ in range(order):
                exact = [[b - a for a, b in zip(*pair, strict=True)] for pair in zip(exact, exact[1:], strict=False)]
            assert values == pytest.approx(np.array([[float(v) for v in row] for row in exact]), rel=1e-15, abs=1e-25)

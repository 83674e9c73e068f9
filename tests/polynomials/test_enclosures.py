"""Running error bounds against exact rationals: never too small, and of the size that theory allows."""

from fractions import Fraction

import numpy as np
import pytest

from minsnap.polynomials.enclosures import UNIT, Enclosure, above, below, derivative
from minsnap.polynomials.extrema import _as_good


def drawn(seed, shape):
    """Control points of every size."""
    random = np.random.default_rng(seed)
    return random.normal(size=shape) * 10.0 ** random.uniform(-3.0, 3.0, shape)


def off(exact, computed):
    return float(abs(exact - Fraction(computed)))


def entries(*arrays):
    """Corresponding entries, as Python floats."""
    return zip(*(array.ravel().tolist() for array in arrays), strict=True)


def test_a_difference_of_polynomials_encloses_the_exact_one():
    left, right = (Enclosure(drawn(seed, (300, 4)), np.full((300, 4), 1e-9 * seed)) for seed in (1, 2))
    found = left.less(right)
    rounding = found.errors - 3e-9
    assert (rounding <= 2.0 * UNIT * np.abs(found.points) + 1e-24).all()
    for a, b, d, allowed in zip(
        *(v.ravel().tolist() for v in (left.points, right.points, found.points, rounding)), strict=True
    ):
        assert off(Fraction(a) - Fraction(b), d) <= allowed + 1e-24


def test_a_point_is_taken_away_exactly():
    curve = Enclosure(drawn(3, (200, 4, 2)), np.full((200, 4, 2), 1e-30))
    point = drawn(4, 2)
    found = curve.minus(point)
    for p, a, d, error in entries(curve.points, np.broadcast_to(point, (200, 4, 2)), found.points, found.errors):
        assert off(Fraction(p) - Fraction(a), d) <= error <= 1.1 * UNIT * abs(d) + 2e-30


def test_a_component_along_a_normal_encloses_the_exact_one():
    curve, normal = Enclosure(drawn(5, (400, 3, 3)), np.zeros((400, 3, 3))), drawn(6, (400, 3))
    found = curve.along(normal)
    size = (np.abs(curve.points) * np.abs(normal)[:, None, :]).sum(axis=2)
    assert (found.errors <= 5.0 * UNIT * size).all()
    for points, n, values, errors in zip(
        curve.points.tolist(), normal.tolist(), found.points.tolist(), found.errors.tolist(), strict=True
    ):
        for point, value, error in zip(points, values, errors, strict=True):
            assert off(sum(Fraction(p) * Fraction(c) for p, c in zip(point, n, strict=True)), value) <= error


@pytest.mark.parametrize("normal", [(0.0, 1.0, 0.0), (0.0, 0.0, -1.0)])
def test_a_component_along_an_axis_is_exact(normal):
    curve = Enclosure(drawn(7, (5, 3, 3)), np.zeros((5, 3, 3)))
    assert not curve.along(np.tile(normal, (5, 1))).errors.any()
    assert curve.along(np.tile(np.array(normal) / 3.0, (5, 1))).errors.all()
    assert curve.along(np.tile(np.array(normal) + [1.0, 0.0, 0.0], (5, 1))).errors.all(), "a sum of two is rounded"


def test_errors_of_a_curve_are_carried_along():
    curve = Enclosure(np.zeros((1, 2, 2)), np.array([[[1.0, 2.0], [4.0, 8.0]]]))
    assert curve.along(np.array([[-3.0, 0.5]])).errors.tolist() == [[4.0, 16.0]]
    images = curve.mapped(np.array([[[-3.0, 0.5], [0.0, 1.0]]]))
    assert images.errors.tolist() == [[[4.0, 2.0], [16.0, 8.0]]] and images.points.shape == (1, 2, 2)


def test_a_squared_norm_encloses_all_that_its_curve_can_be():
    random = np.random.default_rng(8)
    points, errors = random.normal(size=(40, 4, 3)), 10.0 ** random.uniform(-12.0, -3.0, (40, 4, 3))
    found = Enclosure(points, errors).squared_norm()
    for _ in range(20):
        moved = points + errors * random.choice([-1.0, 1.0], errors.shape)
        square = Enclosure(moved, np.zeros_like(moved)).squared_norm()
        assert (np.abs(square.points - found.points) <= found.errors + square.errors).all()
    single = Enclosure(points[:, :, :1], np.zeros((40, 4, 1))).squared_norm()
    assert (single.errors <= 60.0 * UNIT * np.abs(points[:, :, 0]).max(axis=1, keepdims=True) ** 2).all()


def test_a_component_has_its_errors():
    part = Enclosure(drawn(9, (4, 3, 2)), np.abs(drawn(10, (4, 3, 2))))
    assert np.array_equal(part.component(1).points, part.points[..., 1])
    assert np.array_equal(part.component(1).errors, part.errors[..., 1])


def test_sums_are_rounded_outwards_and_exact_ones_left_alone():
    points, errors = drawn(11, 500), np.abs(drawn(12, 500)) * 1e-16
    for p, e, high, low in zip(
        *(v.tolist() for v in (points, errors, above(points, errors), below(points, errors))), strict=True
    ):
        assert Fraction(low) <= Fraction(p) - Fraction(e) * (1 + Fraction(2) ** -30)
        assert Fraction(p) + Fraction(e) * (1 + Fraction(2) ** -30) <= Fraction(high)
        assert high - low <= 2.1 * e + 8.0 * UNIT * abs(p)
    assert np.array_equal(above(points, np.zeros(500)), points) and np.array_equal(below(points, np.zeros(500)), points)
    assert above(np.zeros(1), np.full(1, 5e-324))[0] > 5e-324, "underflow is allowed for"


@pytest.mark.parametrize(("units", "good"), ((16.0, True), (20.0, False)))
def test_a_bound_is_as_good_as_a_value_to_sixteen_roundings(units, good):
    for value in (1.0, -1.0):
        assert bool(_as_good(np.array([value]), np.array([value + units * UNIT]))[0]) is good


def test_a_first_derivative_is_off_by_four_roundings():
    found = derivative(drawn(14, (50, 6, 2)), np.linspace(0.3, 3.0, 50), 1)
    assert (found.errors <= 6.0 * UNIT * np.abs(found.points)).all()


def test_second_derivatives_enclose_the_exact_ones_where_differences_cancel():
    """The first differences are 0 and twice about 1, the last two of them rounded."""
    a, b, c = np.random.default_rng(6).uniform(0.0, 1e-3, (3, 400))
    points = np.stack((-1.0 - a, -1.0 - a, b, 1.0 + c), axis=1)
    found = derivative(points[:, :, None], np.ones(400), 2)
    for row, values, errors in zip(
        points.tolist(), found.points[..., 0].tolist(), found.errors[..., 0].tolist(), strict=True
    ):
        p = [Fraction(value) for value in row]
        exact = [6 * (p[i + 2] - 2 * p[i + 1] + p[i]) for i in range(2)]
        assert all(off(x, value) <= error for x, value, error in zip(exact, values, errors, strict=True))

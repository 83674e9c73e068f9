"""Entry points of extrema and certificates: every status, and arguments of any kind."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from native_questions import local_maxima

from minsnap.corridors.constraint import Walls
from minsnap.native import proved_extrema as native
from minsnap.native.library import core, using
from minsnap.polynomials.bernstein import basis
from minsnap.polynomials.extrema import maximum, peaks

pytestmark = pytest.mark.skipif(core().library is None, reason="the native core is not in use")


def excess(points, durations, pieces, leg, *numbers, order=0):
    """Greatest excess over one wall, from its matrix, anchor, slope and radius."""
    walls = Walls(np.array([leg]), *(np.array([one], dtype=float) for one in numbers), np.ones(1), order)
    return native.greatest_excess(walls.record, points, durations, pieces)


def curve(count=3, degree=7, dim=3, seed=0):
    random = np.random.default_rng(seed)
    return random.normal(size=(count, degree + 1, dim)), random.uniform(0.5, 2.0, count)


@given(st.integers(0, 14), st.integers(0, 2**32 - 1))
def test_local_maxima_are_all_found(degree, seed):
    points = np.random.default_rng(seed).normal(size=(4, degree + 1))
    row, s, value = local_maxima(points, 0.0)
    assert (value > 0.0).all() and (np.diff(row) >= 0).all()
    assert np.einsum("pj,pj->p", basis(degree, s), points[row]) == pytest.approx(value, abs=1e-12)
    grid = np.linspace(0.0, 1.0, 4001)
    values = points @ basis(degree, grid).T
    for polynomial in range(4):
        height = values[polynomial]
        inner = (height[1:-1] > height[:-2]) & (height[1:-1] > height[2:]) & (height[1:-1] > 1e-6)
        own = s[row == polynomial]
        for place in grid[1:-1][inner]:
            assert np.abs(own - place).min() <= 1e-3
        assert len(own) <= inner.sum() + 2 + (degree == 0)


def test_local_maxima_agree_with_the_python_core():
    points = np.random.default_rng(0).normal(size=(200, 8)) - 0.3
    found, expected = local_maxima(points, 0.0), peaks(points, 0.0)
    for row in np.unique(expected[0]):
        assert found[2][found[0] == row].max() == pytest.approx(expected[2][expected[0] == row].max(), rel=1e-9)


@pytest.mark.parametrize("degree", [0, 7, 24, 150])
def test_a_maximum_is_that_of_the_python_core(degree):
    points = np.random.default_rng(degree).normal(size=(5, degree + 1))
    assert native.maximum(points) == pytest.approx(maximum(points), rel=1e-12)


def test_what_the_core_does_not_take_is_left_to_python():
    points, durations = curve()
    assert native.largest_norms(points, durations, (1, 9)) is None
    assert native.largest_norms(points, -durations, (1,)) is None
    assert native.largest_norms(points * np.nan, durations, (1,)) is None
    assert native.largest_norms(points * 1e200, durations, (1,)) is None
    assert native.largest_norms(*curve(dim=9), (1,)) is None
    assert native.largest_norms(*curve(degree=65), (1,)) is None
    assert native.maxima(np.zeros((1, 200))) is None
    assert native.maxima(np.full((1, 3), np.inf)) is None
    assert local_maxima(np.full((1, 3), np.nan)) is None
    plane = np.zeros((0, 3)), np.zeros(3), np.eye(3)[0], 1.0
    assert excess(points, durations, 1, 3, *plane) is None, "there is no leg 3"
    assert excess(points, durations, 2, 0, *plane) is None, "3 pieces are no legs of 2"
    assert excess(points, durations, 1, 0, *plane, order=9) is None
    assert excess(points, durations, 1, 0, np.eye(3), np.zeros(3), np.zeros(3), np.inf) is None
    assert excess(points, durations, 1, 0, np.eye(3), np.zeros(3), np.eye(3)[0], 1.0) is None, "a cone"
    with using("python"):
        assert native.maxima(np.zeros((1, 3))) is None and local_maxima(np.zeros((1, 3))) is None
        assert native.continuity(points, durations, 1e-9, 1e-15) is None


def test_planes_that_face_each_other_are_measured_as_each_of_them():
    points, durations = curve(count=4)
    both = Walls.planes([0, 1], np.eye(3)[:2], np.zeros((2, 3)), [-0.7, -0.2], [0.9, 0.4], np.ones(2))
    alone = [both.chosen(np.array([wall])) for wall in range(4)]
    one, *others = (native.greatest_excess(walls.record, points, durations, 2) for walls in (both, *alone))
    assert one[:2] == max(others)[:2]
    assert divmod(one.row, 2)[0] == others.index(max(others)) % 2


@given(
    st.integers(0, 70),
    st.integers(1, 9),
    st.integers(1, 5),
    st.integers(0, 2**32 - 1),
    st.sampled_from((np.nan, np.inf, 1e308, 5e-324, 0.0)),
)
def test_no_argument_breaks_the_core(degree, dim, count, seed, bad):
    points, durations = curve(count, degree, dim, seed)
    points.reshape(-1)[seed % points.size] = bad
    if seed % 2:
        durations[seed % count] = bad
    zero, leg = np.zeros(dim), seed % (count + 1)
    for found in (
        native.largest_norms(points, durations, (0, 1, 2)),
        excess(points, durations, 1, leg, np.zeros((0, dim)), zero, np.ones(dim), 1.0, order=seed % 4),
        excess(points, durations, 1, leg, np.ones((2, dim)), zero, zero, 1.0),
        native.continuity(points, durations, 1e-9, 1e-15),
        native.maxima(points[:, :, 0]),
        local_maxima(points[:, :, 0]),
    ):
        assert found is None or found is not False
    greatest = native.maxima(points[:, :, 0])
    assert greatest is None or (greatest[1] >= greatest[0]).all()

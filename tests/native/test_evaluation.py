"""Evaluation by the native core against the Python core."""

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import minsnap
from minsnap.errors import IntervalError
from minsnap.native import library

pytestmark = pytest.mark.skipif(library.core().library is None, reason="the native core is not in use")


def random_curve(seed, pieces, degree, dim):
    rng = np.random.default_rng(seed)
    return minsnap.Trajectory(10.0 * rng.normal(size=(pieces, degree + 1, dim)), 10.0 ** rng.uniform(-2, 2, pieces))


@settings(max_examples=100)
@given(st.integers(0, 2**32 - 1), st.integers(1, 9), st.integers(0, 25), st.integers(1, 8), st.integers(0, 27))
def test_every_derivative_is_that_of_the_python_core(seed, pieces, degree, dim, order):
    traj = random_curve(seed, pieces, degree, dim)
    rng = np.random.default_rng(seed)
    sorted_ones = np.linspace(0.0, traj.duration, 97)
    for t in (sorted_ones, rng.permutation(sorted_ones), traj.breaks, sorted_ones[::2].reshape(7, 7).T):
        found = traj(t, order)
        with library.using("python"):
            expected = traj(t, order)
        size = np.abs(traj.derivative(order).control_points).max() if order <= degree else 0.0
        assert found.shape == expected.shape
        assert np.abs(found - expected).max() <= 1e-12 * size


def test_one_instant_is_the_same_as_many():
    traj = random_curve(1, 5, 7, 3)
    for t in np.linspace(0.0, traj.duration, 41):
        for order in range(9):
            one, many = traj(float(t), order), traj([t], order)[0]
            assert one.shape == (3,) and (one == many).all()


@pytest.mark.parametrize("orders", [1, 4, 9])
@pytest.mark.parametrize("t", [0.4, [0.0, 0.4, 0.8], np.linspace(0.0, 0.8, 60).reshape(3, 4, 5), np.zeros((0, 2))])
def test_states_are_the_derivatives_one_by_one(t, orders):
    traj = minsnap.Trajectory(random_curve(9, 4, 7, 3).control_points, np.full(4, 0.2))
    expected = np.stack([traj(t, order) for order in range(orders)], axis=-2)
    assert traj.states(t, orders).shape == (*np.shape(t), orders, 3)
    assert (traj.states(t, orders) == expected).all()
    with pytest.raises(IntervalError, match="outside the path's interval"):
        traj.states([0.1, 0.9], orders)


@pytest.mark.parametrize("orders", [0, -1, 1.5, "a", None, True])
def test_a_number_of_states_that_is_none_is_refused(orders):
    with pytest.raises(IntervalError, match="order of a derivative"):
        random_curve(9, 4, 7, 3).states(0.0, orders)


def test_wide_registers_give_the_same_bits_as_one_instant():
    traj = random_curve(2, 3, 7, 3)
    t = np.linspace(0.0, traj.duration, 1001)
    assert (traj(t, 1) == np.array([traj(float(s), 1) for s in t])).all()


def test_knots_are_met_exactly_and_pieces_are_half_open():
    traj = random_curve(3, 4, 5, 2)
    assert (traj(traj.breaks)[:-1] == traj.control_points[:, 0]).all()
    assert (traj(traj.duration) == traj.control_points[-1, -1]).all()


@pytest.mark.parametrize("t", [-1.0, np.nan, np.inf, [0.0, -1.0], [0.0] * 40 + [np.nan], [0.0] * 40 + [1e9]])
def test_instants_outside_raise(t):
    traj = random_curve(4, 3, 3, 2)
    with pytest.raises(IntervalError, match="outside the path's interval"):
        traj(t)


def test_instants_outside_by_rounding_count_as_the_ends():
    traj = random_curve(5, 3, 3, 2)
    assert (traj(traj.duration * (1.0 + 5e-13)) == traj(traj.duration)).all()
    assert (traj(-5e-13 * traj.duration) == traj(0.0)).all()


@pytest.mark.parametrize("shape", [(), (0,), (1,), (3, 0, 2), (2, 3, 4)])
def test_the_shape_of_the_instants_is_kept(shape):
    traj = random_curve(6, 3, 3, 2)
    assert traj(np.zeros(shape)).shape == (*shape, 2)
    assert (traj(np.zeros(shape)) == traj(0)).all()


def test_a_copy_evaluates_on_its_own():
    traj = random_curve(7, 3, 7, 3)
    traj(0.0)
    for twin in (copy.copy(traj), copy.deepcopy(traj), pickle.loads(pickle.dumps(traj))):
        assert (twin(traj.breaks) == traj(traj.breaks)).all()
    twin = pickle.loads(pickle.dumps(traj))
    del traj
    assert np.isfinite(twin(0.1)).all()


def test_arrays_in_another_order_are_evaluated_too():
    points = np.asfortranarray(np.random.default_rng(8).normal(size=(4, 8, 3)))
    points.flags.writeable = False
    traj = minsnap.Trajectory(points, np.ones(4))
    with library.using("python"):
        expected = traj([0.5, 3.5])
    assert np.allclose(traj([0.5, 3.5]), expected, rtol=1e-12)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(1, 11), st.integers(1, 6), st.integers(1, 11), st.booleans())
def test_costs_are_those_of_the_python_core_even_far_from_the_origin(seed, degree, dim, order, far):
    traj = random_curve(seed, 5, degree, dim)
    traj = minsnap.Trajectory(traj.control_points + 1e6 * far, traj.durations)
    found = traj.piece_costs(order)
    with library.using("python"):
        expected = traj.piece_costs(order)
    assert found == pytest.approx(expected, rel=1e-12)


def test_the_cost_of_a_usual_curve_is_that_of_any_other():
    """Degree 7, order 4 in space is compiled apart: one coordinate more, of zeros, goes the general way."""
    traj = random_curve(3, 50, 7, 3)
    wider = minsnap.Trajectory(np.pad(traj.control_points, ((0, 0), (0, 0), (0, 1))), traj.durations)
    assert (traj.piece_costs(4) == wider.piece_costs(4)).all()

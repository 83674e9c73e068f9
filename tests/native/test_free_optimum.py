"""Plans without walls by the native core, against the Python core, exact rationals and the conditions of an optimum."""

import ctypes

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.exact import Spline

import minsnap
from minsnap.native import library
from minsnap.native.free_optimum import pinned_optimum, resting_optimum
from minsnap.native.library import Entry, address
from minsnap.native.records import ChainRecord
from minsnap.native.status import Status

pytestmark = pytest.mark.skipif(library.core().library is None, reason="the native core is not in use")
NAMES = ("position", "velocity", "acceleration", "jerk", "snap", "crackle")


def in_python(points, durations, half, pins=None, closed=False):
    """Control points by the Python core."""
    pins = pins or {}
    named = {knot: {NAMES[order]: value for order, value in state.items()} for knot, state in pins.items()}
    ends = {} if closed else {"start": named.pop(0, None), "end": named.pop(len(durations), None)}
    with library.using("python"):
        return minsnap.plan(
            points, durations=durations, degree=2 * half - 1, pins=named, closed=closed, **ends
        ).control_points


def random_pins(rng, knots, half, dim, share):
    chosen = [knot for knot in knots if rng.random() < share]
    return {knot: {a: rng.normal(size=dim) for a in range(1, half) if rng.random() < 0.6} for knot in chosen}


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(2, 6), st.integers(1, 12), st.integers(1, 7))
def test_plans_at_rest_are_those_of_the_python_core(seed, half, legs, dim):
    rng = np.random.default_rng(seed)
    legs = max(legs, dim) if dim > 3 else legs
    points, durations = 3.0 * rng.normal(size=(legs + 1, dim)), rng.uniform(0.7, 1.5, legs)
    found = resting_optimum(points, durations, half)
    expected = in_python(points, durations, half)
    assert np.abs(found - expected).max() <= 1e-9 * np.abs(expected).max()
    assert (found[:, 0] == points[:-1]).all() and (found[:, -1] == points[1:]).all()


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(2, 6), st.integers(1, 12), st.integers(1, 5))
def test_pinned_plans_are_those_of_the_python_core(seed, half, legs, dim):
    rng = np.random.default_rng(seed)
    legs = max(legs, dim) if dim > 3 else legs
    points, durations = 3.0 * rng.normal(size=(legs + 1, dim)), rng.uniform(0.7, 1.5, legs)
    pins = random_pins(rng, range(legs + 1), half, dim, 0.5)
    found, states = pinned_optimum(points, durations, half, pins, False)
    expected = in_python(points, durations, half, pins)
    assert np.abs(found - expected).max() <= 1e-9 * np.abs(expected).max()
    curve = minsnap.Trajectory(found, durations)
    for order in range(1, half):
        assert np.allclose(states[:, order - 1], curve(curve.breaks, order), rtol=1e-9, atol=1e-9 * np.abs(found).max())
    for knot, state in pins.items():
        for order, value in state.items():
            assert np.allclose(curve(curve.breaks[knot], order), value, rtol=1e-9, atol=1e-9 * np.abs(found).max())


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(2, 6), st.integers(1, 12), st.integers(1, 5))
def test_closed_laps_are_those_of_the_python_core(seed, half, legs, dim):
    rng = np.random.default_rng(seed)
    legs = max(legs, dim) if dim > 3 else legs
    points, durations = 3.0 * rng.normal(size=(legs + 1, dim)), rng.uniform(0.7, 1.4, legs)
    points[-1] = points[0]
    pins = random_pins(rng, range(1, legs), half, dim, 0.3)
    found, states = pinned_optimum(points, durations, half, pins, True)
    expected = in_python(points, durations, half, pins, True)
    assert np.abs(found - expected).max() <= 1e-8 * np.abs(expected).max()
    assert np.allclose(states[0], states[-1], rtol=1e-9, atol=1e-9 * np.abs(states).max())


@pytest.mark.slow
@pytest.mark.parametrize("half", [2, 3, 4, 5, 6])
@pytest.mark.parametrize("decades", [0.5, 1.0, 2.0, 4.0])
def test_durations_decades_apart_are_solved_as_exact_rationals_do(half, decades):
    rng = np.random.default_rng(round(10 * decades) + half)
    for legs in (2, 3, 4, 7):
        points = rng.normal(size=(legs + 1, 1))
        durations = 10.0 ** rng.uniform(-decades / 2.0, decades / 2.0, legs)
        found = resting_optimum(points, durations, half)
        if found is Status.UNSUPPORTED:  # left to the decimals of the Python core
            assert half >= 5 and durations.max() > 100.0 * durations.min()
            continue
        expected = Spline(points, durations, 2 * half - 1).points()
        error = np.abs(found - expected).max(axis=(1, 2)) / np.abs(expected).max(axis=(1, 2))
        assert error.max() <= 1e-8
        assert (found[:, 0] == points[:-1]).all() and (found[:, -1] == points[1:]).all()


@pytest.mark.parametrize(("half", "ratio"), [(3, 1e6), (4, 1e4), (5, 50.0), (6, 9.0)])
def test_durations_that_change_slowly_are_solved_in_doubles_as_the_python_core_does(half, ratio):
    """Legs that are far from each other do not share what a knot leaves open, however far apart their durations are."""
    rng, legs = np.random.default_rng(half), 48
    points, durations = rng.normal(size=(legs + 1, 3)), ratio ** np.abs(np.linspace(-1.0, 1.0, legs))
    found, expected = resting_optimum(points, durations, half), in_python(points, durations, half)
    error = np.abs(found - expected).max(axis=(1, 2)) / np.abs(expected).max(axis=(1, 2))
    assert error.max() <= 1e-9


def test_four_decades_alternating_are_exact_at_waypoints():
    points = np.cumsum(np.random.default_rng(1).normal(size=(12, 3)), axis=0)
    durations = np.where(np.arange(11) % 2, 100.0, 0.01)
    traj = minsnap.plan(points, durations=durations)
    assert traj.report.core == "native"
    assert (traj(traj.breaks) == points).all()
    exact = Spline(points, durations).points()
    assert np.abs(traj.control_points - exact).max() <= 1e-9 * np.abs(exact).max()


@pytest.mark.parametrize("legs", [1, 2, 3, 4, 5, 1000, 100_001])
def test_long_chains_are_smooth_to_order_2k_minus_2(legs):
    rng = np.random.default_rng(legs)
    points, durations = rng.normal(size=(legs + 1, 3)), rng.uniform(0.8, 1.25, legs)
    traj = minsnap.plan(points, durations=durations)
    for order in range(7):  # the optimum is the spline whose derivatives to 2k - 2 are continuous
        left = traj.derivative(order).control_points
        jump = np.abs(left[1:, 0] - left[:-1, -1]).max(initial=0.0)
        assert jump <= 1e-9 * np.abs(left).max(), order


# What comes in may be anything: the entry points answer with a status and write only what they own.

RESTING = Entry(
    "minsnap_unconstrained",
    *(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int32, ctypes.c_int32, ctypes.c_void_p),
)
ODD = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True),
    st.sampled_from([0.0, -0.0, -1.0, 5e-324, 1e308, 1e-308, np.nan, np.inf, 1.0]),
)


@settings(max_examples=300)
@given(st.integers(1, 7), st.integers(1, 7), st.integers(2, 6), st.data())
def test_any_numbers_end_in_a_status(legs, dim, half, data):
    points = np.array(data.draw(st.lists(ODD, min_size=(legs + 1) * dim, max_size=(legs + 1) * dim)))
    durations = np.array(data.draw(st.lists(ODD, min_size=legs, max_size=legs)))
    found = resting_optimum(points.reshape(legs + 1, dim), durations, half)
    if isinstance(found, np.ndarray):
        assert np.isfinite(found).all() and np.isfinite(points).all() and (durations > 0.0).all()
    else:
        assert found in (Status.BAD_NUMBER, Status.UNSUPPORTED, Status.SINGULAR)
    if not np.isfinite(points).all() or not (durations > 0.0).all() or not np.isfinite(durations).all():
        assert found is Status.BAD_NUMBER


@given(
    st.sampled_from([0, -1, -(2**62), 2**33, 2**62]),
    st.integers(-3, 3) | st.sampled_from([65, 2**31 - 1]),
    st.integers(-1, 9),
)
def test_impossible_sizes_are_refused_before_anything_is_read(legs, dim, half):
    guard = np.full(8, 7.0)
    status = RESTING.function()(None, None, legs, dim, half, address(guard))
    assert Status(status) is Status.BAD_SIZE and (guard == 7.0).all()


@pytest.mark.parametrize("knots", [[0, 1], [2, 1], [1, 1], [1, 3], [1, 2**40], [-1, 1]])
def test_pins_out_of_order_or_place_are_refused(knots):
    chain = ChainRecord(
        **{"half": 4, "legs": 3, "dim": 2, "pins": 2, "points": np.zeros((4, 2)), "durations": np.ones(3)},
        **{"knots": np.array(knots), "masks": np.full(2, 0xFFFFFFFF, np.uint32), "values": np.zeros((2, 3, 2))},
    )
    solve = Entry("minsnap_unconstrained_pinned", ChainRecord, ctypes.c_void_p, ctypes.c_void_p).function()
    assert Status(solve(chain, address(np.empty((3, 8, 2))), None)) is Status.BAD_NUMBER


def test_a_pin_that_is_not_a_number_is_refused():
    pins = {1: {1: np.array([np.nan, 0.0])}}
    assert pinned_optimum(np.zeros((4, 2)), np.ones(3), 4, pins, False) is Status.BAD_NUMBER


def test_what_the_core_does_not_do_is_left_to_the_python_core():
    points, wide = np.zeros((3, 2)), np.array([1.0, 1e9])
    assert resting_optimum(points, wide, 4) is Status.UNSUPPORTED
    assert minsnap.plan([[0.0], [1.0], [3.0]], durations=wide).report.core == "python"
    closed = np.array([[0.0], [1.0], [0.0]])
    assert pinned_optimum(closed, np.array([1.0, 1e9]), 4, {}, True) is Status.UNSUPPORTED


@pytest.mark.parametrize(("half", "ratio"), [(3, 1e7), (4, 1e3), (4, 1e6), (5, 50.0), (5, 4e3), (6, 5.0), (6, 80.0)])
def test_laps_of_durations_far_apart_are_splines(half, ratio):
    """The optimum has 2k - 2 continuous derivatives; the Python core solves for the state of the seam in doubles."""
    rng = np.random.default_rng(half)
    points, durations = rng.normal(size=(6, 3)), np.array([1.0, ratio, 3.0, 0.5 * ratio, 1.5])
    points[-1] = points[0]
    found, states = pinned_optimum(points, durations, half, {}, True)
    lap = minsnap.Trajectory(found, durations)
    assert minsnap.certify(lap).continuity >= 2 * half - 2 and (states[0] == states[-1]).all()
    with library.using("python"):
        other = minsnap.plan(points, durations=durations, degree=2 * half - 1, closed=True)
    assert lap.cost() <= other.cost() * (1.0 + 1e-8)


def test_coordinates_out_of_range_are_bad_numbers():
    points = np.array([[0.0], [1e308], [-1e308], [1e308]])
    assert resting_optimum(points, np.ones(3), 4) is Status.BAD_NUMBER


def test_the_python_core_answers_where_it_is_chosen():
    points, durations = np.zeros((3, 2)), np.ones(2)
    with library.using("python"):
        assert resting_optimum(points, durations, 4) is Status.UNSUPPORTED
        assert pinned_optimum(points, durations, 4, {}, False) is Status.UNSUPPORTED
        assert minsnap.plan(points, durations=durations).report.core == "python"


def test_plans_name_the_core_and_why_it_was_left():
    points, durations = [(0, 0), (1, 2), (3, 1), (0, 0)], [1.0, 1.0, 2.0]
    pinned = minsnap.plan(points, durations, start={"velocity": (1, 0)}, pins={1: {"acceleration": (0, 1)}})
    lap, turning = minsnap.plan(points, durations, closed=True), minsnap.plan(points, durations, yaw=1.0)
    halves = minsnap.plan(points, durations, pieces=2)
    for traj in (pinned, lap, turning, halves):
        assert (traj.report.core, traj.report.handed_over, traj.report.solver) == ("native", "", "banded")
    assert np.allclose(lap(0.0, 3), lap(4.0, 3), rtol=1e-9)
    loose, cubic = (minsnap.plan(points, durations, continuity=2, closed=closed) for closed in (False, True))
    assert loose.report.core == cubic.report.core == "native"
    assert minsnap.certify(loose).continuity == 2 and cubic.report.cost < 1e-20
    wide = minsnap.plan(points, [1.0, 1e9, 1.0])
    assert wide.report.core == "python" and "does not solve this kind" in wide.report.handed_over

"""Trajectory against scipy's piecewise polynomials, quadrature and roots."""

import pickle
from math import comb

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles.curves import quadrature_cost
from scipy.integrate import quad
from scipy.interpolate import BPoly, PPoly

import minsnap
from minsnap.errors import InputError, IntervalError, TimingError, WaypointError
from minsnap.files.convert import read_any
from minsnap.trajectory.report import Report
from minsnap.trajectory.trajectory import Trajectory, concatenate, report_maker


def random_trajectory(seed=0, pieces=4, degree=7, dim=3):
    random = np.random.default_rng(seed)
    return Trajectory(random.normal(size=(pieces, degree + 1, dim)), random.uniform(0.3, 2.0, pieces))


@pytest.fixture
def lap():
    points = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
    return minsnap.plan(points, [4, 2, 4, 2], corridor=0.3)


@pytest.mark.parametrize("shape", ((), (1,), (5,), (2, 3), (0,), (2, 0, 3)))
def test_any_shape_of_instants_gives_that_shape_and_a_coordinate_axis(lap, shape):
    assert lap(np.full(shape, 1.5)).shape == (*shape, 3)
    assert lap(np.full(shape, 1.5), order=2).shape == (*shape, 3)


def test_scalars_lists_and_integers_are_instants(lap):
    assert (lap(1) == lap(1.0)).all()
    assert (lap([0, 1, 2]) == lap(np.array([0.0, 1.0, 2.0]))).all()


@given(st.integers(0, 1000), st.integers(0, 9), st.sampled_from((3, 7, 11)))
def test_values_and_derivatives_are_those_of_scipy(seed, order, degree):
    traj = random_trajectory(seed, degree=degree)
    t = np.linspace(0.0, traj.duration, 101)
    bpoly = BPoly(traj.control_points.transpose(1, 0, 2), traj.breaks)
    expected = bpoly.derivative(order)(t) if 0 < order <= degree else bpoly(t) if order == 0 else 0.0 * bpoly(t)
    scale = max(float(np.abs(expected).max()), 1.0)
    assert np.abs(traj(t, order) - expected).max() <= 1e-11 * scale


def test_pieces_are_half_open_and_the_last_is_closed():
    traj = Trajectory([[[0.0], [1.0]], [[5.0], [7.0]]], [1.0, 1.0])
    assert traj(1.0) == 5.0
    assert traj(np.nextafter(1.0, 0.0)) == pytest.approx(1.0)
    assert traj(2.0) == 7.0


def test_ends_and_knots_are_exact(lap):
    assert (lap(lap.breaks) == [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]).all()


@pytest.mark.parametrize("t", (-1e-9, 12.0000001, np.nan, np.inf, -np.inf))
def test_outside_the_interval_it_raises(lap, t):
    with pytest.raises(IntervalError, match=r"outside the path's interval \[0, 12\.0\] s") as caught:
        lap([1.0, t])
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize("order", (-1, 1.5, "2", True, None))
def test_an_order_that_is_not_a_whole_number_is_refused(lap, order):
    asks = [lambda: lap(1.0, order), lambda: lap.derivative(order)]
    for ask in asks if order is None else [*asks, lambda: lap.cost(order)]:  # cost(None) is the plan's own cost
        with pytest.raises(IntervalError, match="order"):
            ask()


def test_the_derivative_is_a_trajectory_whose_values_are_derivatives(lap):
    t = np.linspace(0.0, lap.duration, 77)
    for order in range(8):
        derivative = lap.derivative(order)
        assert isinstance(derivative, Trajectory)
        assert derivative.degree == lap.degree - order
        assert derivative(t) == pytest.approx(lap(t, order), rel=1e-12, abs=1e-9)
        assert derivative(t, 1) == pytest.approx(lap(t, order + 1), rel=1e-12, abs=1e-9)
    assert not lap.derivative(9)(t).any()


@given(st.integers(0, 1000), st.integers(0, 8))
def test_the_cost_is_the_integral_by_quadrature(seed, order):
    traj = random_trajectory(seed)
    assert traj.cost(order) == pytest.approx(quadrature_cost(traj, order), rel=1e-11, abs=1e-300)


@pytest.mark.parametrize("degree", [12, 18, 25])
def test_the_cost_of_a_high_degree_is_that_of_legendre(degree):
    """Legendre's polynomial of each degree, whose square integrates to 1 / (2n + 1), has control points that cancel."""
    points = [(-1.0) ** (degree + j) * comb(degree, j) for j in range(degree + 1)]
    waves = Trajectory(np.array(points)[None, :, None], [1.0])
    assert waves.cost(0) == pytest.approx(1.0 / (2 * degree + 1), rel=1e-8)


def test_elevation_to_a_high_degree_keeps_the_cost(lap):
    assert [lap.elevated(60).cost(order) for order in (0, 4)] == pytest.approx([lap.cost(0), lap.cost(4)], rel=1e-9)


def test_costs_of_pieces_add_up(lap):
    assert lap.piece_costs().sum() == lap.cost()
    assert lap.between(0.0, 4.0).cost() == pytest.approx(lap.piece_costs()[0], rel=1e-9)


def test_arc_length_is_that_of_an_adaptive_quadrature():
    traj = random_trajectory(5)
    speed = traj.derivative()
    pieces = [
        quad(lambda t: np.linalg.norm(speed(t)), a, b, epsabs=1e-11, epsrel=1e-11)[0]
        for a, b in zip(traj.breaks[:-1], traj.breaks[1:], strict=True)
    ]
    assert traj.arc_length() == pytest.approx(sum(pieces), rel=1e-9)


def test_arc_length_of_a_straight_line_there_and_back_has_a_kink():
    traj = minsnap.plan([(0, 0), (3, 4), (0, 0)], [2.0, 2.0])
    assert traj.arc_length() == pytest.approx(10.0, rel=1e-9)


@given(st.integers(0, 1000), st.integers(0, 4))
def test_the_largest_norm_is_never_below_a_dense_grid_and_is_attained(seed, order):
    traj = random_trajectory(seed)
    value, instant = traj.max_norm(order)
    dense = np.linalg.norm(traj(np.linspace(0.0, traj.duration, 4001), order), axis=1)
    assert dense.max() <= value * (1.0 + 1e-12)
    s = [traj.derivative(order).control_points[piece, -1] for piece in range(4)]
    left = max(np.linalg.norm(end) for end in s)
    assert np.linalg.norm(traj(instant, order)) == pytest.approx(value, rel=1e-9) or left == pytest.approx(value)


@given(st.integers(0, 1000), st.integers(0, 3))
def test_the_extent_along_a_direction_is_that_of_the_roots(seed, order):
    traj = random_trajectory(seed)
    direction = np.random.default_rng(seed).normal(size=3)
    low, high = traj.extent(direction, order)
    ppoly = traj.to_ppoly()
    along = PPoly(ppoly.c @ direction, ppoly.x).derivative(order) if order else PPoly(ppoly.c @ direction, ppoly.x)
    inner = along.derivative().roots(extrapolate=False)
    ends = traj.derivative(order).control_points[:, [0, -1]].reshape(-1, 3) @ direction
    values = np.concatenate((along(inner[np.isfinite(inner)]), ends))
    scale = np.abs(values).max()
    assert (low, high) == pytest.approx((values.min(), values.max()), abs=1e-7 * scale)


@pytest.mark.parametrize("direction", ((1, 0), (1, 0, np.nan), (1, 0, 0, 0), 3.0))
def test_a_direction_of_another_shape_is_refused(lap, direction):
    with pytest.raises(InputError, match="a direction has 3 finite components"):
        lap.extent(direction)


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_slice_is_the_same_curve_from_time_zero(low, high):
    traj = random_trajectory(2)
    start, end = sorted((low * traj.duration, high * traj.duration))
    if not start < end:
        return
    part = traj.between(start, end)
    t = np.linspace(0.0, 1.0, 33) * min(part.duration, end - start)
    assert part.duration == pytest.approx(end - start, rel=1e-9, abs=1e-15)
    inside = np.minimum(start + t, traj.duration)
    away = np.abs(inside[:, None] - traj.breaks).min(axis=1) > 1e-9
    assert np.abs(part(t) - traj(inside))[away].max(initial=0.0) <= 1e-7


@pytest.mark.parametrize(("start", "end"), ((-0.1, 1.0), (1.0, 1.0), (2.0, 1.0), (0.0, 12.1), (np.nan, 1.0)))
def test_a_slice_outside_the_interval_is_refused(lap, start, end):
    with pytest.raises(IntervalError, match="is not an interval within"):
        lap.between(start, end)


def test_slices_joined_again_are_the_whole(lap):
    joined = concatenate([lap.between(0.0, 1.7), lap.between(1.7, 6.0), lap.between(6.0, 12.0)])
    t = np.linspace(0.0, 12.0, 101)
    assert joined.duration == pytest.approx(12.0)
    assert joined(np.minimum(t, joined.duration)) == pytest.approx(lap(t), abs=1e-10)
    assert joined.cost() == pytest.approx(lap.cost(), rel=1e-8)


def test_curves_of_different_degree_join(lap):
    line = minsnap.plan([(0, 0, 1), (1, 1, 1)], [2.0], degree=5)
    joined = lap.then(line)
    assert joined.degree == 7
    assert joined(12.7) == pytest.approx(line(0.7), abs=1e-12)


def test_what_does_not_meet_cannot_be_joined(lap):
    with pytest.raises(WaypointError, match=r"begins .* m away from where the first one ends"):
        lap.then(minsnap.plan([(0.0, 0.0, 1.1), (1, 1, 1)], [2.0]))
    with pytest.raises(WaypointError, match="3 and 2 coordinates cannot be joined"):
        lap.then(minsnap.plan([(0, 0), (1, 1)], [2.0]))
    with pytest.raises(WaypointError, match="no trajectory to join"):
        concatenate([])


@pytest.mark.parametrize("far", (0.0, 4.5e6))
def test_a_joint_is_judged_by_a_billionth_of_the_extent_wherever_the_course_lies(far):
    """Of 10 m; at 4.5e6 m the rounding of coordinates, 4.5e-6 m, is allowed besides."""
    first = minsnap.plan([(far, 0, 1), (far + 4, 0, 1)], [2.0])
    for gap, met in ((0.9e-8, True), (1.1e-8 + 1.1e-12 * far, False)):
        second = minsnap.plan([(far + 4, gap, 1), (far + 10, gap, 1)], [2.0])
        if met:
            assert first.then(second).duration == 4.0
            continue
        with pytest.raises(WaypointError, match="away from where the first one ends"):
            first.then(second)


@pytest.mark.parametrize("factor", (0.25, 1.0, 3.0))
def test_stretching_divides_derivatives_by_powers_of_the_factor(lap, factor):
    slow = lap.stretched(factor)
    t = np.linspace(0.0, 12.0, 41)
    for order in range(5):
        expected = lap(t, order) / factor**order
        assert slow(np.minimum(factor * t, slow.duration), order) == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert slow.cost() == pytest.approx(lap.cost() / factor**7, rel=1e-12)


@pytest.mark.parametrize("factor", (0.0, -1.0, np.nan, np.inf))
def test_stretching_by_what_is_not_positive_is_refused(lap, factor):
    with pytest.raises(TimingError, match="positive factor"):
        lap.stretched(factor)


def test_reversed_flies_backwards(lap):
    t = np.linspace(0.0, 12.0, 41)
    assert lap.reversed()(t) == pytest.approx(lap(12.0 - t), abs=1e-12)
    assert lap.reversed()(t, 1) == pytest.approx(-lap(12.0 - t, 1), abs=1e-11)


def test_elevated_is_the_same_curve(lap):
    t = np.linspace(0.0, 12.0, 41)
    assert lap.elevated(11).degree == 11
    assert lap.elevated(11)(t) == pytest.approx(lap(t), abs=1e-13)
    assert lap.elevated(11).cost(4) == pytest.approx(lap.cost(4), rel=1e-9)


def test_the_report_of_an_elevated_plan_is_that_of_the_plan():
    plan = minsnap.plan([(0, 0, 0), (1, 0, 0), (2, 1, 0)], durations=[1, 1])
    assert plan.elevated(9).report.cost == pytest.approx(plan.report.cost)


def test_scipy_s_forms_and_back(lap):
    t = np.linspace(0.0, 12.0, 101)
    assert isinstance(lap.to_ppoly(), PPoly)
    assert isinstance(lap.to_bpoly(), BPoly)
    for form, back in ((lap.to_ppoly(), Trajectory.from_ppoly), (lap.to_bpoly(), Trajectory.from_bpoly)):
        assert form(t) == pytest.approx(lap(t), abs=1e-11)
        again = back(form)
        assert again(t) == pytest.approx(lap(t), abs=1e-11)
        assert again.breaks == pytest.approx(lap.breaks)


def test_a_scalar_ppoly_that_begins_late_becomes_one_coordinate_from_zero():
    ppoly = PPoly([[2.0, 1.0], [0.0, 4.0]], [3.0, 5.0, 6.0])
    traj = Trajectory.from_ppoly(ppoly)
    assert (traj.dim, traj.duration) == (1, 3.0)
    assert traj([0.0, 1.0, 2.5])[:, 0] == pytest.approx(ppoly([3.0, 4.0, 5.5]))


def test_a_ppoly_of_matrices_is_refused():
    with pytest.raises(WaypointError, match="one trailing dimension, not 2"):
        Trajectory.from_ppoly(PPoly(np.zeros((4, 2, 3, 3)), [0.0, 1.0, 2.0]))


def test_nothing_of_it_can_be_changed():
    points, durations = np.zeros((2, 4, 2)), np.ones(2)
    traj = Trajectory(points, durations)
    points[:], durations[:] = 7.0, 9.0
    assert not traj.control_points.any()
    assert (traj.durations == 1.0).all()
    for array in (traj.control_points, traj.durations, traj.breaks):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    for name in ("pieces", "breaks", "report", "duration", "remark"):
        with pytest.raises(AttributeError):
            setattr(traj, name, 2)


def test_it_says_what_it_is(lap):
    assert repr(lap) == "Trajectory(legs=4, duration=12 s, dim=3, degree=7)"


@pytest.mark.parametrize(
    ("points", "durations", "error", "words"),
    (
        (np.zeros((2, 8)), [1, 1], WaypointError, "control points must be finite, of shape"),
        (np.full((1, 8, 2), np.nan), [1], WaypointError, "finite"),
        (np.zeros((2, 8, 2)), [1], TimingError, "one for each of 2 pieces"),
        (np.zeros((2, 8, 2)), [1, 0], TimingError, "positive and finite"),
        (np.zeros((2, 8, 2)), [1, np.inf], TimingError, "positive and finite"),
    ),
)
def test_what_is_not_a_curve_is_refused(points, durations, error, words):
    with pytest.raises(error, match=words):
        Trajectory(points, durations)


def test_samples_end_with_the_end_state(lap):
    samples = lap.sample(20.0)
    assert len(samples) == 241
    assert samples.t == pytest.approx(np.arange(241) / 20.0)
    assert (samples.position[-1] == lap(12.0)).all()
    uneven = lap.sample(7.3)
    assert uneven.t[-1] >= 12.0
    assert np.diff(uneven.t) == pytest.approx(np.full(len(uneven) - 1, 1 / 7.3))
    assert (uneven.position[-1] == lap(12.0)).all()


@pytest.mark.parametrize("rate", (0, -5, np.nan, np.inf, "20", None))
def test_a_rate_that_is_not_positive_is_refused(lap, rate):
    with pytest.raises(TimingError, match="the rate is"):
        lap.sample(rate)


def test_what_is_no_path_cannot_be_joined():
    path = minsnap.plan([(0, 0, 1), (1, 0, 1)], [1.0])
    with pytest.raises(minsnap.MinsnapError, match="a Samples cannot be flown after a trajectory"):
        path.then(path.sample())


def test_the_report_of_a_plan_is_made_when_it_is_asked_for_and_goes_with_copies():
    boxes = minsnap.Boxes([(-1, -1, -1), (3, -1, -1)], [(5, 1, 1), (9, 1, 1)])
    traj = minsnap.plan([(0, 0, 0), (4, 0, 0), (8, 0, 0)], durations=[2, 2], corridor=boxes)
    assert not isinstance(report_maker(traj), Report)
    twin = pickle.loads(pickle.dumps(traj))
    assert traj.report is traj.report
    assert (twin.report.cost, twin.report.corridor_margin) == (traj.report.cost, traj.report.corridor_margin)
    assert report_maker(twin) is twin.report


def test_what_users_look_for_is_at_the_path(tmp_path):
    traj = minsnap.rectangle(4, 2, total_time=10.0)
    t = np.linspace(0.0, traj.duration, 7)
    for order, asked in enumerate((traj.position, traj.velocity, traj.acceleration)):
        assert (asked(t) == traj(t, order)).all()
    assert np.allclose(traj.waypoints, traj(traj.leg_breaks), atol=1e-12)
    traj.to_csv(tmp_path / "a.csv", rate=50.0)
    minsnap.write_csv(traj, tmp_path / "b.csv", 50.0)
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    traj.save(tmp_path / "a.json")
    assert (read_any(tmp_path / "a.json")(t) == traj(t)).all()
    assert len(traj.plot(limits=minsnap.Limits(speed=9.0)).axes) > 1


def test_a_plan_has_a_report_and_what_is_made_of_it_has_none():
    traj = minsnap.plan([(0, 0, 1), (4, 0, 1)], total_time=4.0)
    assert isinstance(traj, minsnap.Plan) and traj.report.cost > 0.0
    assert isinstance(pickle.loads(pickle.dumps(traj)), minsnap.Plan)
    for curve in (
        traj.derivative(),
        traj.with_yaw(traj.yaw),
        traj.stretched(2.0),
        traj.reversed(),
        traj.then(traj.reversed()),
    ):
        assert not isinstance(curve, minsnap.Plan) and curve.report is None
    assert isinstance(traj.elevated(9), minsnap.Plan)

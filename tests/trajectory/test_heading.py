"""Headings: planned with least angular acceleration, along the velocity, moved in time, joined."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import minsnap
from minsnap.errors import IntervalError, YawError
from minsnap.trajectory.heading import ConstantHeading, JoinedHeading, RemappedHeading, shortest_turns, wrap
from minsnap.trajectory.planned_heading import PlannedHeading, _spline
from minsnap.trajectory.velocity_heading import VelocityHeading

SQUARE = [(0, 0, 1), (4, 0, 1), (4, 4, 1), (0, 4, 1), (0, 0, 1)]
TIMES = [2.0, 3.0, 1.0, 2.5]


def by_differences(heading, t, order, step=1e-5):
    return (heading(t + step, order - 1) - heading(t - step, order - 1)) / (2.0 * step)


def test_without_yaw_it_is_zero():
    traj = minsnap.plan(SQUARE, TIMES)
    assert not traj.yaw(np.linspace(0.0, traj.duration, 9)).any()


def test_a_constant_yaw_stays():
    traj = minsnap.plan(SQUARE, TIMES, yaw=-2.5)
    t = np.linspace(0.0, traj.duration, 9)
    assert (traj.yaw(t) == -2.5).all()
    assert not traj.yaw(t, 1).any()


def test_one_a_waypoint_is_the_cubic_spline_at_rest_at_both_ends():
    angles = [0.1, 0.9, 0.4, 1.2, -0.3]
    traj = minsnap.plan(SQUARE, TIMES, yaw=angles)
    spline = CubicSpline(traj.breaks, angles, bc_type="clamped")
    t = np.linspace(0.0, traj.duration, 101)
    for order in range(3):
        assert traj.yaw(t, order) == pytest.approx(spline(t, order), abs=1e-9)


def test_turns_go_the_shortest_way_round_and_are_not_wrapped():
    traj = minsnap.plan(SQUARE, TIMES, yaw=np.radians([170, -170, -100, 100, 10]))
    assert np.degrees(traj.yaw(traj.breaks)) == pytest.approx([170, 190, 260, 100, 10], abs=1e-9)
    assert np.abs(np.diff(traj.yaw(np.linspace(0.0, traj.duration, 2001)))).max() < 0.05


def test_shortest_turns_never_exceed_half_a_turn():
    angles = np.random.default_rng(0).uniform(-50.0, 50.0, 200)
    turned = shortest_turns(angles)
    assert np.abs(np.diff(turned)).max() <= np.pi + 1e-9
    assert np.cos(turned) == pytest.approx(np.cos(angles), abs=1e-9)
    assert np.sin(turned) == pytest.approx(np.sin(angles), abs=1e-9)


def test_wrap_brings_angles_into_one_turn():
    angles = np.linspace(-20.0, 20.0, 4001)
    wrapped = wrap(angles)
    assert wrapped.min() >= -np.pi
    assert wrapped.max() < np.pi
    assert np.exp(1j * wrapped) == pytest.approx(np.exp(1j * angles), abs=1e-12)
    assert wrap(np.pi) == -np.pi


def test_a_closed_lap_turns_smoothly_at_its_seam():
    traj = minsnap.plan(SQUARE, TIMES, closed=True, yaw=[0.0, 0.5, 1.0, 0.5, 0.0])
    for order in (1, 2):
        assert traj.yaw(0.0, order) == pytest.approx(traj.yaw(traj.duration, order), abs=1e-9)


def test_a_closed_lap_that_turns_all_the_way_round_is_smooth_too():
    angles = np.radians([0, 90, 180, 270, 360])
    traj = minsnap.plan(SQUARE, [2.0] * 4, closed=True, yaw=angles)
    t = np.linspace(0.0, 8.0, 41)
    assert traj.yaw(t) == pytest.approx(2.0 * np.pi * t / 8.0, abs=1e-9)


def test_along_the_velocity_is_its_angle_unwrapped():
    traj = minsnap.plan(SQUARE, TIMES, yaw=minsnap.Velocity(hold_below=0.01))
    t = np.linspace(0.4, traj.duration - 0.4, 501)
    velocity = traj(t, 1)
    assert wrap(traj.yaw(t) - np.arctan2(velocity[:, 1], velocity[:, 0])) == pytest.approx(np.zeros(501), abs=1e-9)
    assert np.abs(np.diff(traj.yaw(t))).max() < 0.2
    for order in (1, 2):
        expected = by_differences(traj.yaw, t, order)
        assert traj.yaw(t, order) == pytest.approx(expected, rel=1e-4, abs=1e-4 * np.abs(expected).max())


def test_two_laps_along_the_velocity_turn_twice():
    points = [*SQUARE, *SQUARE[1:]]
    traj = minsnap.plan(points, [2.0] * 8, yaw="velocity", corridor=0.5)
    middles = traj.yaw(traj.breaks[:-1] + 1.0)
    assert middles == pytest.approx(np.arange(8) * np.pi / 2.0, abs=0.3)


def test_at_rest_the_heading_is_held():
    stop = {name: (0, 0) for name in ("velocity", "acceleration", "jerk")}
    traj = minsnap.plan([(0, 0), (3, 0), (3, 2)], [2.0, 2.0], pins={1: stop}, yaw="velocity")
    assert traj.yaw(0.0) == pytest.approx(0.0, abs=1e-9)
    assert traj.yaw(4.0) == pytest.approx(np.pi / 2.0, abs=1e-9)
    assert 0.0 <= traj.yaw(2.0) <= np.pi / 2.0 + 1e-9
    assert np.abs(traj.yaw(np.linspace(0.0, 4.0, 4001), 1)).max() <= 2.0


def test_a_path_that_only_climbs_has_no_heading():
    with pytest.raises(YawError, match="needs a horizontal velocity"):
        minsnap.plan([(0, 0, 0), (0, 0, 3)], [2.0], yaw="velocity")


def test_a_path_of_one_coordinate_has_no_heading():
    with pytest.raises(YawError, match="at least two coordinates"):
        minsnap.plan([[0.0], [3.0]], [2.0], yaw="velocity")


def test_derivatives_past_the_second_are_refused_along_the_velocity():
    traj = minsnap.plan(SQUARE, TIMES, yaw="velocity")
    with pytest.raises(YawError, match="up to order 2, not 3"):
        traj.yaw(1.0, 3)


@pytest.mark.parametrize("shape", ((), (3,), (2, 2)))
def test_the_shape_of_instants_is_kept(shape):
    for yaw in (0.3, [0.0, 1.0, 2.0, 1.0, 0.0], "velocity"):
        traj = minsnap.plan(SQUARE, TIMES, yaw=yaw)
        for order in range(3):
            assert np.shape(traj.yaw(np.full(shape, 1.3), order)) == shape
        with pytest.raises(IntervalError, match="the instants are 'a': give numbers of seconds"):
            traj.yaw("a")


def test_slices_stretches_and_reverses_take_their_yaw_along():
    traj = minsnap.plan(SQUARE, TIMES, yaw=[0.0, 0.5, 1.0, 0.5, 0.2])
    t = np.linspace(0.0, 1.0, 21)
    assert traj.between(1.5, 6.0).yaw(4.5 * t) == pytest.approx(traj.yaw(1.5 + 4.5 * t))
    assert traj.stretched(2.0).yaw(17.0 * t, 1) == pytest.approx(traj.yaw(8.5 * t, 1) / 2.0)
    assert traj.reversed().yaw(8.5 * t, 1) == pytest.approx(-traj.yaw(8.5 * (1.0 - t), 1))


def test_a_remapped_heading_obeys_the_chain_rule():
    traj = minsnap.plan(SQUARE, TIMES, yaw=[0.0, 0.5, 1.0, 0.5, 0.2])
    heading = RemappedHeading(traj.yaw, 1.0, 0.5)
    t = np.linspace(0.5, 5.0, 11)
    assert heading(t) == pytest.approx(traj.yaw(1.0 + 0.5 * t))
    assert heading(t, 1) == pytest.approx(by_differences(heading, t, 1), rel=1e-6, abs=1e-8)


def test_joined_headings_meet_by_whole_turns():
    heading = JoinedHeading(ConstantHeading(7.0), ConstantHeading(7.0 - 2.0 * np.pi), 2.0)
    assert heading([0.0, 1.9, 2.0, 5.0]) == pytest.approx([7.0] * 4)
    assert not heading(3.0, 1)


def test_a_yaw_that_jumps_where_curves_are_joined_has_no_largest_rate():
    """A step of two radians was certified as a rate of zero, exactly."""
    first = minsnap.plan([(0, 0, 1), (4, 0, 1)], durations=[4], yaw=0.0)
    for angle, rate in ((2.0, np.inf), (2.0 * np.pi, 0.0)):
        curve = first.then(minsnap.plan([(4, 0, 1), (8, 0, 1)], durations=[4], yaw=angle))
        [used] = minsnap.certify(curve, limits=minsnap.Limits(yaw_rate=1.0)).utilisation
        assert used.value == rate and used.instant == pytest.approx(4.0)


def test_a_circle_s_heading_turns_at_its_angular_rate():
    path = minsnap.circle(3.0, period=6.0, ramp=0.0)
    heading = VelocityHeading(path)
    t = np.linspace(0.0, 6.0, 61)
    assert heading(t) == pytest.approx(np.pi / 2.0 + 2.0 * np.pi * t / 6.0, abs=1e-9)
    assert heading(t, 1) == pytest.approx(np.full(61, 2.0 * np.pi / 6.0), abs=1e-9)
    assert heading(t, 2) == pytest.approx(np.zeros(61), abs=1e-9)


@pytest.mark.parametrize(
    ("yaw", "words"),
    (
        ("north", "yaw is 'north'"),
        ([0.0, 1.0], "one for each of 5 waypoints"),
        ([[0.0] * 5], "one for each of 5 waypoints"),
        (np.nan, "finite"),
        ([0, 1, np.inf, 0, 0], "finite"),
        ([0, 1, "x", 0, 0], "yaw is"),
        (object(), "yaw is"),
    ),
)
def test_a_malformed_yaw_is_refused(yaw, words):
    with pytest.raises(YawError, match=words):
        minsnap.plan(SQUARE, TIMES, yaw=yaw)


def test_a_closed_lap_ends_at_the_yaw_it_began_with_but_for_whole_turns():
    turned = minsnap.plan(SQUARE, TIMES, closed=True, yaw=np.linspace(0.2, 0.2 + 2.0 * np.pi, 5))
    assert turned.yaw(turned.duration) - turned.yaw(0.0) == pytest.approx(2.0 * np.pi)
    with pytest.raises(YawError, match="begins at a yaw of 0 rad and ends at 1 rad"):
        minsnap.plan(SQUARE, TIMES, closed=True, yaw=[0.0, 0.5, 1.0, 1.0, 1.0])


@pytest.mark.parametrize("closed", [False, True])
def test_the_spline_through_angles_is_the_same_without_the_native_core(closed):
    rng = np.random.default_rng(8)
    for legs in (1, 2, 3, 7):
        angles, durations = rng.uniform(-3.0, 3.0, legs + 1), 10.0 ** rng.uniform(-1.0, 1.0, legs)
        rate = 0.0 if closed else 0.7
        if closed:
            angles[-1] = angles[0] - 2.0 * np.pi
        native = PlannedHeading.through(angles, durations, closed, rate).polynomial.control_points
        assert _spline(angles, durations, closed, rate) == pytest.approx(native, rel=0.0, abs=1e-12)


@pytest.mark.parametrize("yaw", ["velocity", "tilt", minsnap.LookAt((2.0, 9.0)), [0.0, 1.0]])
@pytest.mark.parametrize("t", [-0.1, 3.1, [1.0, 9.0]])
def test_a_heading_that_follows_a_path_ends_with_it(yaw, t):
    """Those by a rule went on with the angle at the nearer end, where the path itself raises."""
    path = minsnap.plan([(0, 0, 1), (4, 2, 1)], durations=[3.0], yaw=yaw)
    with pytest.raises(IntervalError, match=r"outside the path's interval \[0, 3.0\] s"):
        path.yaw(t)


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (np.sin, "order of the derivative"),
        (lambda t: 0.1 * t, "order of the derivative"),
        (lambda t, order: None, "for each instant"),
        (lambda t, order: [0.1, 0.2], "for each instant"),
        (lambda t, order: np.nan * t, "for each instant"),
    ],
)
def test_a_function_that_gives_no_yaw_is_refused_where_it_is_given(function, words):
    with pytest.raises(YawError, match=words):
        minsnap.plan(SQUARE, TIMES).with_yaw(function)


def test_a_function_may_give_one_number_for_all_instants_and_gets_an_array():
    def turned(t, order):
        return 0.3 if order == 0 else 0 * t

    traj = minsnap.plan(SQUARE, TIMES).with_yaw(turned)
    assert traj.yaw([0.0, 1.0]).tolist() == traj.reversed().yaw([0.0, 1.0]).tolist() == [0.3, 0.3]
    assert traj.sample(10.0).yaw.shape == traj.sample(10.0).yaw_rate.shape == (86,)

"""Shapes against differentiation by finite differences, plain geometry and each other."""

from __future__ import annotations

import math

import numpy as np
import pytest

import minsnap
from minsnap.errors import ShapeError, TimingError, YawError

CURVES = {
    "circle": lambda **given: minsnap.circle(2.0, **given),
    "helix": lambda **given: minsnap.helix(1.5, -0.4, laps=2.0, start_angle=0.7, **given),
    "lemniscate": lambda **given: minsnap.lemniscate(5.0, 2.0, **given),
}


@pytest.fixture(params=[(name, ramp) for name in CURVES for ramp in (0.0, 1.2)], ids=str)
def curve(request):
    name, ramp = request.param
    return CURVES[name](ramp=ramp, period=5.0)


def test_each_derivative_is_that_of_the_one_before(curve):
    step = 1e-4
    t = np.linspace(2 * step, curve.duration - 2 * step, 301)
    for order in range(1, 8):
        differences = (curve(t + step, order - 1) - curve(t - step, order - 1)) / (2 * step)
        exact = curve(t, order)
        assert np.abs(differences - exact).max() <= 1e-6 * np.abs(exact).max(), order


def test_literal_circle_is_the_textbook_one_at_120_steps_of_20_hz():
    path = minsnap.circle(3.0, ramp=0.0)
    samples = path.sample(20.0)
    angle = np.linspace(0.0, 2.0 * np.pi, 121)
    assert len(samples) == 121
    assert samples.position[:, :2] == pytest.approx(3.0 * np.column_stack([np.cos(angle), np.sin(angle)]), abs=1e-13)
    for order in range(7):
        turned = 3.0 * (2.0 * np.pi / 6.0) ** order * np.exp(1j * (angle + order * np.pi / 2.0))
        found = path(samples.t, order)
        assert found[:, 0] + 1j * found[:, 1] == pytest.approx(turned, abs=1e-12)
    assert np.linalg.norm(path(0.0, 1)) == pytest.approx(math.pi)


@pytest.mark.parametrize("name", CURVES)
def test_ramp_starts_and_ends_at_rest_and_keeps_the_geometry(name):
    smooth, literal = CURVES[name](period=5.0), CURVES[name](period=5.0, ramp=0.0)
    for order in range(1, 5):
        assert np.abs(smooth([0.0, smooth.duration], order)).max() <= 1e-10, order
    assert smooth([0.0, smooth.duration]) == pytest.approx(literal([0.0, literal.duration]), abs=1e-12)
    assert smooth.duration == pytest.approx(literal.duration + 5.0 / 2.0)
    cruising = smooth.duration / 2.0
    assert smooth(cruising, 1) == pytest.approx(literal(literal.duration / 2.0, 1), abs=1e-12)


@pytest.mark.parametrize("name", CURVES)
def test_derivatives_to_the_fourth_are_continuous_where_the_spinning_ends(name):
    path = CURVES[name](period=5.0)
    for seam in (path.law.spin_time, path.duration - path.law.spin_time, path.duration / 2.0):
        for order in range(5):
            left, right = path([seam - 1e-9, seam + 1e-9], order)
            assert left == pytest.approx(right, rel=1e-6, abs=1e-6), order


@pytest.mark.parametrize("name", CURVES)
def test_speed_asked_for_is_the_greatest(name):
    path = CURVES[name](speed=2.5)
    speeds = np.linalg.norm(path(np.linspace(0.0, path.duration, 20001), 1), axis=1)
    assert speeds.max() == pytest.approx(2.5, rel=1e-6)


def test_helix_climbs_its_pitch_a_lap_at_its_radius():
    path = minsnap.helix(1.5, 0.4, laps=2.5, center=(1.0, -2.0), altitude=3.0)
    position = path.sample(50.0).position
    assert np.hypot(position[:, 0] - 1.0, position[:, 1] + 2.0) == pytest.approx(1.5)
    assert position[-1, 2] - position[0, 2] == pytest.approx(1.0)
    assert position[0, 2] == 3.0


def test_lemniscate_fills_its_box_and_satisfies_gerono():
    path = minsnap.lemniscate(6.0, 3.0)
    x, y = path.sample(200.0).position[:, :2].T
    assert (x.max(), y.max()) == pytest.approx((3.0, 1.5), abs=1e-3)
    assert x**4 == pytest.approx(9.0 * (x**2 - y**2), abs=1e-11)


@pytest.mark.parametrize("make", [minsnap.circle, minsnap.helix, minsnap.lemniscate])
def test_clockwise_is_the_mirror_image(make):
    left, right = make(), make(clockwise=True)
    t = np.linspace(0.0, left.duration, 50)
    assert right(t) == pytest.approx(left(t) * [1.0, -1.0, 1.0], abs=1e-12)


def test_circle_turns_counter_clockwise_from_its_start_angle():
    path = minsnap.circle(2.0, start_angle=math.pi / 2, ramp=0.0, center=(1.0, 1.0))
    assert path(0.0) == pytest.approx([1.0, 3.0, 1.5])
    assert path(0.0, 1)[0] < 0.0
    assert minsnap.circle(2.0, start_angle=math.pi / 2, clockwise=True, ramp=0.0)(0.0) == pytest.approx([0.0, 2.0, 1.5])


def test_lemniscate_turns_counter_clockwise_first():
    path = minsnap.lemniscate(ramp=0.0)
    x, y = path(path.duration / 8.0)[:2]
    assert x > 0.0 > y
    assert minsnap.lemniscate(ramp=0.0, clockwise=True)(path.duration / 8.0)[1] > 0.0


def test_yaw_along_the_velocity_turns_with_the_circle_without_a_jump():
    path = minsnap.circle(2.0, laps=3.0, yaw="velocity")
    t = np.linspace(0.0, path.duration, 500)
    phase = np.unwrap(np.arctan2(path(t)[:, 1], path(t)[:, 0]))
    fast = np.linalg.norm(path(t, 1), axis=1) > 0.5
    assert path.yaw(t)[fast] == pytest.approx(phase[fast] + math.pi / 2.0, abs=1e-6)
    assert np.abs(path.yaw(t, 1)).max() <= 2.0 + 1e-9, "held and turned where it is slow"
    assert path.yaw(path.duration / 2.0, 1) == pytest.approx(2.0 * math.pi / 6.0)


def test_constant_yaw_is_kept():
    path = minsnap.circle(yaw=0.3)
    assert path.yaw([0.0, 1.0]) == pytest.approx([0.3, 0.3])
    assert path.yaw(1.0, 1) == 0.0


def test_line_from_rest_to_rest_is_the_septic_of_least_snap():
    path = minsnap.line((0.0, 1.0, 2.0), (4.0, -2.0, 2.0), total_time=3.0)
    t = np.linspace(0.0, 3.0, 101)
    s = t / 3.0
    share = 35 * s**4 - 84 * s**5 + 70 * s**6 - 20 * s**7
    assert path(t) == pytest.approx([0.0, 1.0, 2.0] + share[:, None] * [4.0, -3.0, 0.0], abs=1e-12)


def test_a_line_alone_is_flown_within_ordinary_limits():
    """A mean of 1 m/s was that of the legs of plans, too."""
    path = minsnap.line()
    certificate = minsnap.certify(path, limits=minsnap.Limits(speed=3.0, acceleration=6.0, jerk=30.0))
    assert certificate.ok and 7.0 / 3.0 < path.duration < 3.1


@pytest.mark.parametrize("corner", range(4))
@pytest.mark.parametrize("clockwise", [False, True])
def test_rectangle_visits_its_corners_in_order_and_stays_inside(corner, clockwise):
    path = minsnap.rectangle(
        5.0,
        3.0,
        altitude=2.0,
        center=(1.0, -1.0),
        laps=2,
        start_corner=corner,
        clockwise=clockwise,
        corridor=0.2,
        total_time=32.0,
        search=minsnap.Search(split="distance"),
    )
    found = path(path.leg_breaks)
    assert found[[0, 4, 8]] == pytest.approx(np.array([found[0]] * 3), abs=1e-9)
    middle = found[:4] - [1.0, -1.0, 2.0]
    assert np.abs(middle) == pytest.approx(np.array([[2.5, 1.5, 0.0]] * 4), abs=1e-9)
    assert middle[0, :2] == pytest.approx([(-2.5, -1.5), (2.5, -1.5), (2.5, 1.5), (-2.5, 1.5)][corner])
    turn = np.cross(middle[1] - middle[0], middle[2] - middle[1])[2]
    assert (turn < 0.0) == clockwise
    assert minsnap.certify(path, corridor=0.2).ok
    assert path.durations == pytest.approx(np.linalg.norm(np.diff(found, axis=0), axis=1))


def test_a_rectangle_alone_is_flown_within_3_metres_a_second_and_6_a_second_squared():
    limits = minsnap.Limits(speed=3.0, acceleration=6.0, jerk=30.0)
    certificate = minsnap.certify(minsnap.rectangle(), corridor=0.3, limits=limits)
    assert certificate.ok and max(used.fraction for used in certificate.utilisation) >= 0.999
    assert minsnap.rectangle(limits=minsnap.Limits(speed=1.0), pieces=1).max_norm(2)[0] < 6.0


def test_rectangle_passes_on_times_limits_and_options():
    assert minsnap.rectangle(total_time=12.0).duration == pytest.approx(12.0)
    assert minsnap.rectangle(durations=[4, 3, 2, 1]).durations == pytest.approx([4, 3, 2, 1])
    assert minsnap.rectangle(degree=9, corridor=None).degree == 9
    lap = minsnap.rectangle(closed=True, yaw="velocity")
    assert lap(0.0, 1) == pytest.approx(lap(lap.duration, 1), abs=1e-9)
    assert lap.yaw(lap.duration) - lap.yaw(0.0) == pytest.approx(2.0 * math.pi, abs=1e-3)


def test_constant_speed_line_is_120_equal_steps():
    path = minsnap.line(constant_speed=True)
    samples = path.sample(20.0)
    assert samples.position == pytest.approx(np.linspace((0.0, 1.0, 1.5), (7.0, 1.0, 1.5), 120), abs=1e-12)
    assert samples.velocity == pytest.approx(np.tile([7.0 / 5.95, 0.0, 0.0], (120, 1)))
    assert not samples.acceleration.any()


@pytest.mark.parametrize("yaw", ["velocity", minsnap.LookAt((6.0, 8.0)), [math.pi / 4.0] * 2])
def test_the_nose_turns_on_a_line_at_constant_speed_as_on_others(yaw):
    line = minsnap.line((0.0, 0.0, 1.0), (3.0, 3.0, 1.0), total_time=4.0, constant_speed=True, yaw=yaw)
    toward = math.atan2(8.0, 6.0) if isinstance(yaw, minsnap.LookAt) else math.pi / 4.0
    assert float(line.yaw(0.0)) == pytest.approx(toward)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: minsnap.circle(-1.0), "radius"),
        (lambda: minsnap.circle(float("nan")), "radius"),
        (lambda: minsnap.circle("3"), "radius"),
        (lambda: minsnap.circle(period=0.0), "period"),
        (lambda: minsnap.circle(speed=-2.0), "speed"),
        (lambda: minsnap.circle(period=6.0, speed=1.0), "exclude each other"),
        (lambda: minsnap.circle(laps=0), "laps"),
        (lambda: minsnap.circle(ramp=4.0), "ramp is 4.0 rad: .*180 degrees"),
        (lambda: minsnap.circle(ramp=-0.1), "ramp"),
        (lambda: minsnap.circle(center=(0.0, 0.0, 1.0)), "center"),
        (lambda: minsnap.circle(altitude=float("inf")), "altitude"),
        (lambda: minsnap.circle(start_angle=float("nan")), "start angle"),
        (lambda: minsnap.helix(pitch=float("nan")), "pitch"),
        (lambda: minsnap.lemniscate(length=0.0), "length"),
        (lambda: minsnap.lemniscate(width=-1.0), "width"),
        (lambda: minsnap.line((0, 0, 1), (0, 0, 1)), "starts and ends"),
        (lambda: minsnap.line((0, 0), (1, 0, 1)), "start"),
        (lambda: minsnap.rectangle(0.0), "width"),
        (lambda: minsnap.rectangle(length=-1.0), "length"),
        (lambda: minsnap.rectangle(laps=0), "laps"),
        (lambda: minsnap.rectangle(laps=1.5), "laps"),
        (lambda: minsnap.rectangle(start_corner=4), "corner"),
        (lambda: minsnap.rectangle(altitude=None), "altitude"),
    ],
)
def test_bad_measures_are_named(make, said):
    with pytest.raises(ShapeError, match=said):
        make()


def test_constant_speed_has_nothing_to_plan():
    with pytest.raises(TimingError, match="degree"):
        minsnap.line(constant_speed=True, degree=9)


def test_unknown_yaw_is_refused():
    with pytest.raises(YawError, match="velocity"):
        minsnap.circle(yaw="sideways")

"""Headings towards a point and by a function of time: angles, derivatives, the exact rate, and other clocks."""

import numpy as np
import pytest

import minsnap
from minsnap import Limits, LookAt
from minsnap.errors import YawError
from minsnap.native.library import core

POINTS = [(0, 0, 1), (4, 0, 1), (4, 3, 2), (0, 3, 1), (0, 0.5, 1)]
TIMES = (2.0, 1.5, 2.0, 1.5)
TARGET = (2.0, 1.4)


@pytest.fixture(scope="module")
def path():
    return minsnap.plan(POINTS, durations=TIMES, yaw=LookAt(TARGET))


def test_the_nose_points_at_the_target_all_the_way_round_without_a_jump(path):
    t = np.linspace(0.0, path.duration, 4001)
    yaw, away = path.yaw(t), np.array(TARGET) - path(t)[:, :2]
    nose = np.stack((np.cos(yaw), np.sin(yaw)), axis=-1)
    assert (nose * away).sum(axis=1) == pytest.approx(np.linalg.norm(away, axis=1))
    assert np.abs(np.diff(yaw)).max() < 0.05 and np.ptp(yaw) > np.pi


@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivatives_are_those_of_the_angle(path, order):
    t, h = np.linspace(0.1, path.duration - 0.1, 61), 1e-4
    t = t[np.abs(t[:, None] - path.breaks).min(axis=1) > 2 * h]
    quotient = (path.yaw(t + h, order - 1) - path.yaw(t - h, order - 1)) / (2.0 * h)
    assert path.yaw(t, order) == pytest.approx(quotient, rel=1e-5, abs=1e-4)
    assert path.yaw(t.reshape(-1, 1), order).shape == (len(t), 1)


def test_the_rate_in_a_certificate_is_exact(path):
    used = minsnap.certify(path, limits=Limits(yaw_rate=3.0)).utilisation[0]
    t = np.linspace(0.0, path.duration, 400_001)
    assert used.method == "exact" and used.value >= np.abs(path.yaw(t, 1)).max() - 1e-12
    assert used.value == pytest.approx(np.abs(path.yaw(t, 1)).max(), rel=1e-6)
    assert abs(path.yaw(used.instant, 1)) == pytest.approx(used.value, rel=1e-6)


@pytest.mark.skipif(core().name != "native", reason="plans within limits need the native core")
def test_a_limit_of_the_yaw_rate_is_kept_by_the_plan():
    found = minsnap.plan(POINTS, limits=Limits(speed=4.0, acceleration=6.0, yaw_rate=1.0), yaw=LookAt(TARGET))
    free = minsnap.plan(POINTS, limits=Limits(speed=4.0, acceleration=6.0), yaw=LookAt(TARGET))
    assert found.duration > free.duration
    assert np.abs(found.yaw(np.linspace(0, found.duration, 20_001), 1)).max() <= 1.0 + 1e-6


def test_the_point_stays_in_view_on_other_clocks_and_parts(path):
    for curve in (path.stretched(1.5), path.reversed(), path.between(1.0, 5.0), path.then(path.reversed())):
        t = np.linspace(0.0, curve.duration, 301)
        yaw, away = curve.yaw(t), np.array(TARGET) - curve(t)[:, :2]
        assert np.cos(yaw) * away[:, 0] + np.sin(yaw) * away[:, 1] == pytest.approx(np.linalg.norm(away, axis=1))
        assert minsnap.certify(curve, limits=Limits(yaw_rate=9.0)).utilisation[0].method == "exact"


@pytest.mark.skipif(core().name != "native", reason="plans within limits need the native core")
def test_parts_and_replans_go_on_without_a_jump_of_whole_turns():
    """The rest of a flight around the point began whole turns below the flown yaw, and a replan jumped at its joint."""
    angles = np.linspace(0.0, 4.4 * np.pi, 20)
    ring, limits = np.column_stack((5 * np.cos(angles), 5 * np.sin(angles), np.full(20, 1.5))), Limits(speed=3.0)
    flown = minsnap.plan(ring, limits=limits, yaw=LookAt((0, 0)))
    start = float(flown.leg_breaks[12])
    part, back = flown.between(start, flown.duration), flown.reversed()
    assert part.yaw(0.0) == pytest.approx(flown.yaw(start)) and back.yaw(0.0) == pytest.approx(
        flown.yaw(flown.duration)
    )
    change = minsnap.replan(flown, start - 0.2, ring[13:], 0.2, limits=limits, clock=lambda: 0.0)
    t = np.linspace(0.0, change.trajectory.duration, 4001)
    assert change.trajectory.yaw(0.0) == pytest.approx(flown.yaw(change.splice))
    assert np.abs(np.diff(change.trajectory.yaw(t))).max() < 0.05


def test_shapes_look_at_points_too():
    circle = minsnap.circle(radius=2.0, center=(1.0, 1.0), yaw=LookAt((1.0, 1.0)))
    t = np.linspace(0.1, circle.duration - 0.1, 200)
    inwards = np.array((1.0, 1.0)) - circle(t)[:, :2]
    assert np.stack((np.cos(circle.yaw(t)), np.sin(circle.yaw(t))), -1) == pytest.approx(inwards / 2.0, abs=1e-9)
    curve = minsnap.as_polynomials(circle)
    used = minsnap.certify(curve, limits=Limits(yaw_rate=3.0)).utilisation[0]
    assert used.value == pytest.approx(2.0 * np.pi / 6.0, rel=1e-3)


def test_a_helix_is_flown_along_its_tangent():
    helix = minsnap.helix(radius=1.0, pitch=0.5, laps=2, yaw="velocity")
    t = np.linspace(2.0, helix.duration - 2.0, 100)
    velocity = helix(t, 1)[:, :2]
    assert np.cos(helix.yaw(t)) * velocity[:, 0] + np.sin(helix.yaw(t)) * velocity[:, 1] == pytest.approx(
        np.linalg.norm(velocity, axis=1)
    )


@pytest.mark.parametrize("scalar", [False, True])
def test_a_function_of_time_gives_the_yaw(scalar):
    import math

    function = (lambda t: 0.5 * math.sin(t)) if scalar else (lambda t: 0.5 * np.sin(t))
    path = minsnap.plan(POINTS, durations=TIMES, yaw=function)
    t = np.linspace(0.0, path.duration, 999)
    assert path.yaw(t) == pytest.approx(0.5 * np.sin(t), abs=1e-6)
    assert path.yaw(t, 1) == pytest.approx(0.5 * np.cos(t), abs=1e-4)
    used = minsnap.certify(path, limits=Limits(yaw_rate=1.0)).utilisation[0]
    assert used.method == "exact" and used.value == pytest.approx(0.5, abs=1e-4)


@pytest.mark.parametrize(
    ("yaw", "message"),
    [
        (lambda t: "north", "must give a finite angle"),
        (lambda t: np.nan * t, "must give a finite angle"),
        (lambda t: 1.0 * (np.asarray(t) > 1.0), "jumps, or turns too fast, near t = "),
    ],
)
def test_a_function_that_gives_no_heading_is_refused(yaw, message):
    with pytest.raises(YawError, match=message):
        minsnap.plan(POINTS, durations=TIMES, yaw=yaw)


def test_points_that_cannot_be_looked_at_are_refused():
    with pytest.raises(YawError, match=r"give \(x, y\)"):
        LookAt((1.0,))
    with pytest.raises(YawError, match="passes within .* m of the point to look at"):
        minsnap.plan([(0, 0, 1), (4, 0, 1)], durations=[3.0], yaw=LookAt((2.0, 0.0)))

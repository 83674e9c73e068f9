"""Headings over a splice: equal in angle and rate there, and their own rule soon after."""

import numpy as np
import pytest

import minsnap
from minsnap.files.convert import read_any, write_any
from minsnap.replanning.splice import SplicedHeading, splice_of, spliced
from minsnap.trajectory.heading import ConstantHeading, wrap
from minsnap.trajectory.planned_heading import chosen_heading

POINTS = np.array([(0, 0, 1), (2, 2, 1), (4, 0, 1.2), (6, 2, 1)], dtype=float)
TIMES = [1.0, 1.2, 1.4]


def flown_and_next(yaw):
    flown = minsnap.plan(POINTS, durations=TIMES, yaw=yaw)
    rest = splice_of(flown, 0.5, 0.1, 4).rest
    return flown, rest.with_yaw(ConstantHeading())


@pytest.mark.parametrize("flown_yaw", [0.7, [0.0, 1.0, 2.0, 3.5], "velocity", "tilt"])
@pytest.mark.parametrize("next_yaw", [None, 3.0, "velocity"])
def test_angle_and_rate_are_those_of_the_flown_plan(flown_yaw, next_yaw):
    flown, curve = flown_and_next(flown_yaw)
    chosen = None if next_yaw is None else chosen_heading(next_yaw, 1, False)
    heading = spliced(flown, 0.6, chosen, None, curve)
    assert wrap(float(heading(0.0)) - float(flown.yaw(0.6))) == pytest.approx(0.0, abs=1e-6)
    assert float(heading(0.0, 1)) == pytest.approx(float(flown.yaw(0.6, 1)), abs=1e-6)


def test_the_difference_is_gone_after_its_span():
    flown, curve = flown_and_next(0.7)
    heading = spliced(flown, 0.6, chosen_heading(1.2, 1, False), None, curve)
    after = np.linspace(1.875 * 0.5, curve.duration, 9)
    assert wrap(heading(after) - 1.2) == pytest.approx(np.zeros(9), abs=1e-12)
    assert heading(after, 1) == pytest.approx(np.zeros(9), abs=1e-12)


@pytest.mark.parametrize("order", [1, 2])
def test_derivatives_are_those_of_the_angle(order):
    heading = SplicedHeading(ConstantHeading(0.4), 1.1, -0.7, 0.8)
    t, step = np.linspace(0.01, 1.2, 41), 1e-6
    slope = (heading(t + step, order - 1) - heading(t - step, order - 1)) / (2.0 * step)
    assert heading(t, order) == pytest.approx(slope, abs=1e-4)


def test_a_yaw_rate_limit_bounds_the_turn():
    flown, curve = flown_and_next(0.0)
    heading = spliced(flown, 0.6, chosen_heading(1.0, 1, False), 0.9, curve)
    used = minsnap.Limits(yaw_rate=0.9).utilisation(curve.with_yaw(heading))[0]
    assert used.method == "exact" and used.fraction <= 1.0
    rates = np.abs(heading(np.linspace(0.0, curve.duration, 4001), 1)).max()
    assert rates <= used.value <= rates * (1.0 + 1e-5)


@pytest.mark.parametrize("duration", (0.2, 0.5, 3.0))
def test_a_constant_heading_is_reached_as_the_quintic_reaches_it_also_where_the_curve_ends_before(duration):
    flown, curve = flown_and_next([0.0, 1.0, 2.0, 3.5])
    part = minsnap.plan(POINTS[:2], durations=[duration])
    heading = spliced(flown, 0.6, chosen_heading(0.2, 1, False), None, part)
    gap, rate = float(flown.yaw(0.6)) - 0.2, float(flown.yaw(0.6, 1))
    quintic = SplicedHeading(ConstantHeading(0.2), gap, rate, max(0.5, 1.875 * abs(gap)))
    t = np.linspace(0.0, duration, 57)
    for order in range(3):
        assert heading(t, order) == pytest.approx(quintic(t, order), abs=1e-9)


def test_a_turn_ends_with_its_curve_whatever_sums_round_to():
    """One of 40 replans with a constant yaw ended in an IntervalError, by a last bit of the duration."""
    flown, _ = flown_and_next([0.0, 1.0, 2.0, 3.5])
    for duration in np.random.default_rng(2).uniform(4.0, 9.0, 200):
        curve = minsnap.line((0, 0, 1), (3, 0, 1), total_time=duration).as_trajectory()
        heading = spliced(flown, 0.6, chosen_heading(duration - 6.0, 1, False), None, curve)
        assert heading.polynomial.duration == pytest.approx(curve.duration, rel=1e-15)


def test_a_heading_from_the_tilt_goes_on_as_it_is_turned():
    flown, curve = flown_and_next("tilt")
    heading = spliced(flown, 0.6, None, None, curve)
    assert wrap(heading(0.5) - flown.yaw(1.1)) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("yaw", ["velocity", "tilt"])
def test_a_heading_goes_on_after_two_laps_without_a_jump_of_whole_turns(yaw, tmp_path):
    """The heading of a replan began 4 pi below the flown one."""
    angles, limits = np.linspace(0.0, 4.0 * np.pi, 13), minsnap.Limits(speed=3.0, acceleration=6.0)
    points = np.stack((3.0 * np.cos(angles), 3.0 * np.sin(angles), np.ones(13)), axis=1)
    flown = minsnap.plan(points, limits=limits, yaw=yaw, pieces=1)
    late = points[int((flown.leg_breaks[1:] <= 9.2).sum()) + 1 :] + [0.1, 0.0, 0.05]
    change = minsnap.Replanner(limits=limits, yaw=yaw, clock=lambda: 0.0).replan(flown, 9.0, late, 0.2)
    begun = float(change.trajectory.yaw(0.0))
    assert begun == pytest.approx(float(flown.yaw(change.splice)), abs=1e-9)
    assert change.certified
    write_any(change.trajectory, tmp_path / "a.json")
    away = read_any(tmp_path / "a.json").yaw(0.5) - change.trajectory.yaw(0.5)
    assert wrap(away) == pytest.approx(0.0, abs=1e-9)

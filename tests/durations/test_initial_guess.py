"""Durations with which a search begins."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.polynomial import Polynomial

import minsnap
from minsnap.durations.initial_guess import PEAKS, norm_limits, stop_and_go_times
from minsnap.limits.compliance import most_used
from minsnap.limits.limits import Limits

CORE = Path(minsnap.__file__).parent / "native" / "src"
LIMITS = Limits(speed=3.0, acceleration=6.0)


@pytest.mark.parametrize(
    "limits",
    [LIMITS, Limits(jerk=5.0), Limits(snap=30.0), Limits(speed=0.1, acceleration=9.0, jerk=3.0, snap=70.0)],
)
def test_first_guess_is_the_least_at_which_each_leg_alone_keeps_the_limits(limits):
    for length in (0.2, 3.0, 40.0):
        (duration,) = stop_and_go_times(np.array([length]), limits)
        fractions = [
            most_used(limits, minsnap.plan([(0, 0, 0), (length, 0, 0)], [duration * factor])).fraction
            for factor in (1.0, 0.999)
        ]
        assert fractions[0] <= 1.0 + 2e-5 < fractions[1]


def test_limits_on_parts_bound_what_any_direction_may_do():
    limits = Limits(speed=3.0, climb_speed=1.0, tilt=0.5, max_thrust=1.2, body_rate=2.0)
    speed, acceleration, jerk, snap = norm_limits(limits)
    assert speed == 1.0 and acceleration == pytest.approx(0.2 * limits.gravity) and np.isinf(snap)
    assert jerk == pytest.approx(limits.gravity)


def test_a_price_begins_at_times_that_walls_on_the_velocity_allow():
    """Two legs in 2 s, where the proportions are priced, break the wall."""
    points, wall = [(0, 0, 0), (5, 0, 0), (5, 4, 0)], minsnap.HalfSpaces((1, 0, 0), 0.9, order=1)
    best = minsnap.plan(points, corridor=wall, search=minsnap.Search(time_weight=2000.0))
    other = minsnap.plan(points, [9.0, 2.0], corridor=wall)
    assert best.cost(4) + 2000.0 * best.duration < other.cost(4) + 2000.0 * other.duration


def test_peaks_are_the_largest_derivatives_of_the_profile():
    profile, s = Polynomial([0, 0, 0, 0, 35, -84, 70, -20]), np.linspace(0.0, 1.0, 10_001)
    largest = [np.abs(profile.deriv(order)(s)).max() for order in range(1, 5)]
    assert PEAKS == pytest.approx(largest, rel=1e-5)


@pytest.mark.parametrize("name", ["shortest_time/shortest_time.hpp", "planner/shortest_plan.cpp"])
def test_the_core_begins_with_the_same_peaks(name):
    """Questions of C, and the guess of a search, begin where those of Python do, to the bit."""
    (listed,) = re.findall(r"double peaks\[4\] = \{(.*?)\};", (CORE / name).read_text())
    assert tuple(map(float, listed.split(","))) == PEAKS

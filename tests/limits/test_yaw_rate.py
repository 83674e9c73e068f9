"""Largest yaw rates between two instants against dense samples, of every heading, cut, joined and on other clocks."""

import numpy as np
import pytest

import minsnap
from minsnap.limits.utilisation import largest_yaw_rate
from minsnap.trajectory.heading import ConstantHeading, JoinedHeading, RemappedHeading
from minsnap.trajectory.look_at import LookAtHeading
from minsnap.trajectory.velocity_heading import VelocityHeading

POINTS, DURATIONS = [(0, 0, 1), (3, 1, 1), (4, 4, 1), (1, 5, 1)], [1.0, 0.8, 1.2]
PATH = minsnap.plan(POINTS, DURATIONS, start={"velocity": (1, 0.3, 0)}, end={"velocity": (-1, 0.5, 0)})
PLANNED = minsnap.plan(POINTS, DURATIONS, yaw=[0.0, 2.5, 2.0, 3.0]).yaw
AHEAD, AT = VelocityHeading(PATH), LookAtHeading(PATH, minsnap.LookAt((2.0, 2.5, 0.0)))
JOINED = JoinedHeading(PLANNED, RemappedHeading(PLANNED, 1.5, -1.0), 1.5)  # a yaw that jumps has no largest rate
HEADINGS = {
    "planned": PLANNED,
    "along the velocity": AHEAD,
    "at a point": AT,
    "joined": JOINED,
    "joined again": JoinedHeading(JOINED, RemappedHeading(JOINED, 0.8), 0.8),
    "on another clock": RemappedHeading(PLANNED, 0.2, 0.7),
    "backwards": RemappedHeading(PLANNED, 3.0, -1.0),
    "constant": ConstantHeading(0.3),
}


@pytest.mark.parametrize("name", HEADINGS)
@pytest.mark.parametrize("span", ((0.0, 3.0), (0.9, 3.0), (0.2, 0.9), (1.2, 1.7), (0.7, 1.6), (1.6, 2.5), (2.7, 3.0)))
def test_the_largest_rate_between_two_instants_is_that_of_samples(name, span):
    heading = HEADINGS[name]
    value, instant = heading.largest_rate(*span)
    rates = np.abs(heading(np.linspace(*span, 30_001)[:-1], 1))
    assert rates.max() * (1.0 - 1e-9) <= value <= rates.max() * (1.0 + 1e-4)
    assert span[0] <= instant <= span[1]
    assert abs(heading(min(instant, np.nextafter(span[1], 0.0)), 1)) == pytest.approx(value, rel=1e-6)


def test_the_largest_rate_at_one_instant_is_the_rate():
    assert PLANNED.largest_rate(0.7, 0.7) == (pytest.approx(abs(PLANNED(0.7, 1)), rel=1e-12), 0.7)
    assert PLANNED.largest_rate(3.2, 3.5) == (pytest.approx(abs(PLANNED(3.0, 1)), abs=1e-12), 3.0)


def by_rate(rate):
    """A yaw whose rate is a formula; its angle is not looked at."""
    return PATH.with_yaw(lambda t, order=0: rate(np.asarray(t)))


def test_a_yaw_of_any_formula_is_sampled():
    """Greatest on the second leg, and at the end; a part of no known rate hides the whole."""
    value, instant, method = largest_yaw_rate(by_rate(lambda t: -np.exp(-((25.0 * (t - 1.3)) ** 2))))
    assert (value, instant) == (pytest.approx(1.0, abs=5e-3), pytest.approx(1.3, abs=0.01)) and method == "sampled"
    growing = by_rate(lambda t: 2.0 * t)
    assert largest_yaw_rate(growing) == (pytest.approx(6.0), pytest.approx(3.0), "sampled")
    after, before = by_rate(lambda t: 2.5 + t).yaw, by_rate(lambda t: t - 1.0).yaw
    for first, second in ((PLANNED, after), (before, PLANNED)):
        assert JoinedHeading(first, second, 1.0).largest_rate(0.0, 3.0) is None

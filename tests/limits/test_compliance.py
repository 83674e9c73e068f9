"""From which instant on limits are kept: against dense samples, and in the figures of the whole trajectory."""

import numpy as np
import pytest

import minsnap
from minsnap import Limits, Trajectory
from minsnap.limits.compliance import keeps, kept_from, largest_use, turns_within, use_from
from minsnap.limits.utilisation import largest_yaw_rate
from minsnap.polynomials.bernstein import powers_to_points

# x = 4 t - t^2 on [0, 1.5]: the speed falls from 4 to 1 and is 3 at 0.5 s
POWERS = np.array([[0.0, 0.0], [6.0, 0.0], [-2.25, 0.0]])
SLOWING = Trajectory((powers_to_points(2) @ POWERS)[None], np.array([1.5]))


@pytest.mark.parametrize("stretch", (1.0, 0.01))
def test_the_instant_is_that_from_which_samples_keep_the_limit(stretch):
    path, speed = SLOWING.stretched(stretch), 3.0 / stretch
    start = kept_from(Limits(speed=speed), path)
    assert start == pytest.approx(0.5 * stretch, abs=1e-8 * stretch)
    assert start <= (0.5 + 1.5e-9) * stretch, "by bisection, to a billionth of the duration, 1.5 s"
    after = np.linspace(start, path.duration, 1001)
    assert np.linalg.norm(path(after, 1), axis=1).max() <= speed * (1.0 + 1e-9)


def test_kept_always_or_never():
    assert kept_from(Limits(speed=4.0), SLOWING) == 0.0
    assert kept_from(Limits(acceleration=1.0), SLOWING) == pytest.approx(1.5)


@pytest.mark.parametrize(("share", "kept"), ((1.0 + 0.9e-9, True), (1.0 + 1.1e-9, False)))
def test_a_limit_is_kept_to_a_billionth(share, kept):
    """At a constant speed of 1 m/s."""
    line = Trajectory([[[0.0, 0.0], [2.0, 0.0]]], [2.0])
    for limits in (Limits(speed=1.0 / share), Limits(speed=1.0 / share, norm="axis")):
        assert keeps(limits, line) is kept
        assert kept_from(limits, line) == (0.0 if kept else pytest.approx(2.0))


def test_turns_are_within_a_limit_on_the_yaw_rate_to_a_billionth():
    path = minsnap.plan([(0, 0), (2, 1), (4, 0)], [1.0, 1.0], yaw=[0.0, 1.0, 0.5])
    most = largest_yaw_rate(path)[0]
    assert turns_within(None, path) and turns_within(Limits(speed=1e-3), path)
    assert turns_within(Limits(yaw_rate=most / (1.0 + 0.9e-9)), path)
    assert not turns_within(Limits(yaw_rate=most / (1.0 + 1.1e-9)), path)


def test_use_is_told_in_legs_and_instants_of_the_whole():
    whole = SLOWING.then(SLOWING.reversed().reversed().stretched(1.0).reversed())
    used = use_from(Limits(speed=3.0), whole, 2.0)[0]
    assert (used.leg, used.instant) == (1, pytest.approx(3.0))
    assert used.value == pytest.approx(4.0)


@pytest.mark.parametrize("orders", [("speed",), ("jerk", "speed"), ("acceleration", "snap", "speed")])
def test_the_largest_use_of_norms_is_that_of_the_exact_utilisation(orders):
    points = np.array([(0, 0, 1), (2, 0.5, 1), (4, 0, 1.2)], dtype=float)
    path = minsnap.plan(points, durations=[1.0, 1.3])
    limits = Limits(**{name: 2.0 + k for k, name in enumerate(orders)})
    assert largest_use(limits, path) == pytest.approx(max(u.fraction for u in limits.utilisation(path)), rel=1e-12)
    by_axis = Limits(**{name: 2.0 for name in orders}, norm="axis")
    assert largest_use(by_axis, path) == max(u.fraction for u in by_axis.utilisation(path))

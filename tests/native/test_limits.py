"""Limits of derivatives with durations given, in the native core: plans equal to those of the Python core."""

import numpy as np
import pytest
from helpers.tasks import many_legs, random_legs

import minsnap
from minsnap import Limits
from minsnap.limits.compliance import keeps
from minsnap.native import library
from minsnap.native.library import using

pytestmark = pytest.mark.skipif(library.core().library is None, reason="there is no native core")

ORDERS = {"speed": 1, "acceleration": 2, "jerk": 3}


def peak(curve, order):
    """The largest norm of a derivative at many instants."""
    return np.linalg.norm(curve(np.linspace(0.0, curve.duration, 2001), order), axis=1).max()


def both_plans(points, limits, **asked):
    """The plans of the native and of the Python core, both within the limits, at the same cost."""
    with using("python"):
        slow = minsnap.plan(points, limits=limits, **asked)
    fast = minsnap.plan(points, limits=limits, **asked)
    assert fast.report.core == "native", fast.report.handed_over
    assert fast.cost() == pytest.approx(slow.cost(), rel=1.5e-6)
    assert minsnap.certify(fast, points, asked.get("corridor"), limits=limits).ok and keeps(limits, fast)
    return fast, slow


@pytest.mark.parametrize("name", ORDERS)
@pytest.mark.parametrize("corridor", [None, 0.4])
@pytest.mark.parametrize("seed", range(3))
def test_a_limit_that_binds(name, corridor, seed):
    points, durations = random_legs(seed, legs=4)
    asked = {"durations": durations, "corridor": corridor}
    free = minsnap.plan(points, **asked)
    limits = Limits(**{name: 0.93 * peak(free, ORDERS[name])})
    fast, _ = both_plans(points, limits, **asked)
    assert fast.cost() > (1.0 + 1e-4) * free.cost()
    assert peak(fast, ORDERS[name]) == pytest.approx(getattr(limits, name), rel=1e-3)


@pytest.mark.parametrize("degree", [5, 7, 9])
def test_several_limits_at_once_in_two_pieces_a_leg(degree):
    points, durations = random_legs(7, legs=4)
    free = minsnap.plan(points, durations=durations, degree=degree)
    limits = Limits(speed=0.95 * peak(free, 1), acceleration=0.9 * peak(free, 2))
    both_plans(points, limits, durations=durations, degree=degree, pieces=2)


def test_limits_of_each_axis_are_flat_walls():
    points, durations = random_legs(2, legs=4)
    free = minsnap.plan(points, durations=durations)
    instants = np.linspace(0.0, free.duration, 2001)
    limits = Limits(speed=0.95 * np.abs(free(instants, 1)).max(), norm="axis")
    fast, _ = both_plans(points, limits, durations=durations)
    assert np.abs(fast(instants, 1)).max() <= limits.speed < peak(fast, 1)


def test_a_closed_lap_within_limits():
    points, durations = random_legs(11, legs=5)
    points[-1] = points[0]
    free = minsnap.plan(points, durations=durations, closed=True)
    both_plans(points, Limits(acceleration=0.95 * peak(free, 2)), durations=durations, closed=True)


def test_a_moving_start_within_limits():
    points, durations = random_legs(5, legs=4)
    start = {"velocity": (0.2, -0.1, 0.1)}
    free = minsnap.plan(points, durations=durations, start=start)
    limits = Limits(speed=0.95 * peak(free, 1))
    fast, _ = both_plans(points, limits, durations=durations, start=start)
    assert fast(0.0, 1) == pytest.approx(start["velocity"], abs=1e-9)


@pytest.mark.parametrize("closed", [False, True])
def test_many_legs_within_limits_are_solved_in_windows(closed):
    points, durations, widths = many_legs(80, seed=3)
    if closed:
        points -= np.linspace(0.0, 1.0, len(points))[:, None] * points[-1]
        points[-1] = points[0]
    asked = {"durations": durations, "corridor": widths, "closed": closed}
    limits = Limits(speed=0.97 * peak(minsnap.plan(points, **asked), 1))
    both_plans(points, limits, **asked)


def test_limits_that_no_curve_keeps_are_refused():
    points, durations = random_legs(0, legs=3)
    fastest = np.linalg.norm(np.diff(points, axis=0), axis=1) / durations
    with pytest.raises(minsnap.InfeasibleError):
        minsnap.plan(points, durations=durations, limits=Limits(speed=0.9 * fastest.max()))

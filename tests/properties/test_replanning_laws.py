"""Laws of replanning: any plan, any instant, any budget: no jump, nothing worse, and a stop inside."""

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

import minsnap
from minsnap import Limits, Replanner
from minsnap.replanning.splice import splice_of

LIMITS = Limits(speed=2.5, acceleration=5.0, jerk=60.0)
WIDTH = 0.5
QUICK = (Phase.explicit, Phase.reuse, Phase.generate)
"""Without shrinking: every example is a search."""


def still():
    return 0.0


@st.composite
def courses(draw):
    """Courses of 2 to 4 legs of 1.5 to 4 m that turn by up to a right angle."""
    legs, heading, points = draw(st.integers(2, 4)), draw(st.floats(0.0, 6.3)), [np.zeros(3)]
    for _ in range(legs):
        heading += draw(st.floats(-1.5, 1.5))
        length, climb = draw(st.floats(1.5, 4.0)), draw(st.floats(-0.5, 0.5))
        points.append(points[-1] + [length * np.cos(heading), length * np.sin(heading), climb])
    return np.array(points)


instants = st.floats(0.0, 0.97)
budgets = st.floats(0.02, 0.4)


def asked(flown, share, budget):
    """Return an instant such that the splice is within the plan, and the waypoints after it."""
    now = min(share * flown.duration, flown.duration - budget - 1e-3)
    splice = splice_of(flown, now, budget, 4)
    return now, splice


def check_no_jump(change, flown):
    at = min(change.splice, flown.duration)
    for curve in (change.trajectory, change.stop):
        if curve is None:
            continue
        shortest = float(min(curve.durations[0], flown.durations.min()))
        for order in range(4):
            before = flown(at, order)
            rounding = 1e-14 * 1e3 * (1.0 + np.abs(flown.control_points).max()) / shortest**order
            assert np.abs(curve(0.0, order) - before).max() <= 1e-9 * max(1.0, np.abs(before).max()) + rounding


def check_stop(change, limits, along):
    """A stop ends at rest, keeps the limits, and stays within the tubes of the legs that it passes."""
    stop = change.stop
    assert stop is not None, change.no_stop
    t = np.linspace(0.0, stop.duration, 801)
    for order in (1, 2, 3):
        assert np.abs(stop(stop.duration, order)).max() <= 1e-6
    if limits is not None:
        assert np.linalg.norm(stop(t, 1), axis=1).max() <= limits.speed * (1.0 + 1e-6)
        assert np.linalg.norm(stop(t, 2), axis=1).max() <= limits.acceleration * (1.0 + 1e-6)
    for leg in range(stop.legs):
        own = (t >= stop.leg_breaks[leg]) & (t <= stop.leg_breaks[leg + 1])
        u = along[leg + 1] - along[leg]
        u = u / np.linalg.norm(u)
        offset = stop(t[own]) - along[leg]
        across = offset - (offset @ u)[:, None] * u
        assert np.abs(across).max() <= WIDTH * (1.0 + 1e-6)


@settings(max_examples=25, deadline=None)
@given(courses(), instants, budgets, st.floats(0.8, 2.0))
def test_with_given_durations_the_rest_is_the_best_and_comes_back(points, share, budget, pace):
    times = pace * np.linalg.norm(np.diff(points, axis=0), axis=1)
    flown = minsnap.plan(points, durations=times, corridor=WIDTH)
    now, splice = asked(flown, share, budget)
    ahead, rest = points[splice.passed + 1 :], splice.rest
    durations = np.diff(rest.leg_breaks)
    change = minsnap.replan(flown, now, ahead, budget, durations=durations, corridor=WIDTH, clock=still)
    check_no_jump(change, flown)
    check_stop(change, None, np.concatenate((splice.leg_start[None], ahead)))
    assert change.trajectory.cost() <= rest.cost() * (1.0 + 1e-9)
    t = np.linspace(0.0, rest.duration, 100)
    assert change.trajectory(np.minimum(t, change.trajectory.duration)) == pytest.approx(rest(t), abs=1e-6)


@settings(max_examples=10, deadline=None, phases=QUICK)
@given(courses(), instants, budgets)
def test_within_limits_with_nothing_changed_the_rest_comes_back(points, share, budget):
    flown = minsnap.plan(points, limits=LIMITS, corridor=WIDTH)
    now, splice = asked(flown, share, budget)
    replanner = Replanner(LIMITS, WIDTH, clock=still)
    change = replanner.replan(flown, now, points[splice.passed + 1 :], budget)
    check_no_jump(change, flown)
    check_stop(change, LIMITS, np.concatenate((splice.leg_start[None], points[splice.passed + 1 :])))
    assert change.kept and change.certified
    t = np.linspace(0.0, splice.rest.duration, 100)
    assert change.trajectory(t) == pytest.approx(flown(np.minimum(splice.instant + t, flown.duration)), abs=1e-6)


@settings(max_examples=5, deadline=None, phases=QUICK)
@given(courses(), instants, budgets, st.floats(1.0, 1.4))
def test_within_larger_limits_no_plan_is_longer_than_the_rest(points, share, budget, factor):
    flown = minsnap.plan(points, limits=LIMITS, corridor=WIDTH)
    limits = Limits(speed=2.5 * factor, acceleration=5.0 * factor, jerk=60.0 * factor)
    now, splice = asked(flown, share, budget)
    ahead = points[splice.passed + 1 :]
    change = Replanner(limits, WIDTH, clock=still).replan(flown, now, ahead, budget)
    check_no_jump(change, flown)
    check_stop(change, limits, np.concatenate((splice.leg_start[None], ahead)))
    assert change.certified
    assert change.trajectory.duration <= splice.rest.duration * (1.0 + 1e-9)
    assert minsnap.certify(change.trajectory, limits=limits).ok

"""Replans shortly before a waypoint: the leg is flown on, no derivative jumps, and the rest stays certified."""

import numpy as np
import pytest

import minsnap
from minsnap import Limits, Replanner
from minsnap.replanning.horizon import Aim, leg_end_of, rest_within, within
from minsnap.replanning.splice import splice_of

POINTS = np.array([(0, 0, 1), (2, 0.5, 1), (4, 0, 1.2), (6, 1, 1)], dtype=float) + 60.0
TIMES = np.array([1.2, 1.1, 1.2])
LIMITS = Limits(speed=4.0, acceleration=9.0)
AMPLE = {"began": 160.0}


def still():
    return 100.0


@pytest.fixture(scope="module")
def flown():
    return minsnap.plan(POINTS, durations=TIMES, yaw=[0.0, 0.5, 0.2, -0.3])


def check_no_jump(curve, flown, at):
    for order in range(4):
        size = 1e-12 * flown.max_norm(order)[0]
        assert curve(0.0, order) == pytest.approx(flown(at, order), abs=size), order
    assert float(curve.yaw(0.0)) == pytest.approx(float(flown.yaw(at)), abs=1e-9)


@pytest.mark.parametrize("left", [0.05, 1e-3, 1e-6])
@pytest.mark.parametrize("horizon", [None, 1])
def test_a_new_plan_begins_at_the_waypoint_where_little_is_left_of_the_leg(flown, left, horizon):
    at = TIMES[0] - left
    replanner = Replanner(LIMITS, 0.5, yaw="velocity", horizon=horizon, clock=still)
    change = replanner.replan(flown, at - 0.2, POINTS[1:], 0.2, **AMPLE)
    curve = change.trajectory
    assert not change.kept, change.reason
    check_no_jump(curve, flown, at)
    assert curve.leg_breaks[1] == pytest.approx(left, abs=1e-12)
    for knot, point in zip(curve.leg_breaks[1:], POINTS[1:], strict=False):
        assert curve(knot) == pytest.approx(point, abs=1e-9)
    for order in range(4):
        before, after = curve(left * (1.0 - 1e-9), order), curve(left * (1.0 + 1e-9), order)
        assert before == pytest.approx(after, abs=1e-6 * flown.max_norm(order)[0])
    assert minsnap.certify(curve, limits=LIMITS).max_speed <= LIMITS.speed * (1.0 + 1e-9)
    again = replanner.replan(curve, 0.0, POINTS[2:], left + 0.05)
    check_no_jump(again.trajectory, curve, left + 0.05)


def test_the_rest_of_a_plan_on_its_limits_is_within_them_an_instant_before_a_waypoint():
    full = minsnap.plan(POINTS, limits=Limits(acceleration=3.0), pieces=1)
    limits = Limits(acceleration=full.max_norm(2)[0])
    splices = [splice_of(full, full.leg_breaks[1] - 0.1 - left, 0.1, 4) for left in np.geomspace(1e-7, 1e-6, 30)]
    assert not all(within(splice.rest, limits) for splice in splices)
    assert all(rest_within(splice, limits) for splice in splices)


def test_waypoints_that_have_moved_and_times_that_differ_are_planned_from_the_splice(flown):
    moved = POINTS[1:] + [0.0, 0.0, 0.2]
    change = Replanner(LIMITS, clock=still).replan(flown, 0.95, moved, 0.2, **AMPLE)
    assert change.trajectory.leg_breaks[1] != pytest.approx(0.05)
    assert change.trajectory(change.trajectory.leg_breaks[1]) == pytest.approx(moved[0])
    assert leg_end_of(splice_of(flown, 0.5, 0.1, 4)) is None


def test_of_a_leg_that_is_short_itself_all_that_is_left_is_flown_on_and_judged():
    """Plans from 0.01 s before a waypoint jumped by 3e-8 of the largest jerk: one begins with a leg that is short."""
    start = {"velocity": (2.0, 0.0, 0.0)}
    flown = minsnap.plan([(0, 0, 50), (0.15, 0, 50), (2, 0, 50), (4, 0, 50)], durations=[0.1, 1.5, 1.5], start=start)
    end = leg_end_of(splice_of(flown, 0.02, 0.01, 4))
    assert end is not None and end.left.duration == pytest.approx(0.07)
    begin, last = (np.linalg.norm(flown(t, 1)) for t in (0.03, 0.09))
    assert begin > last
    assert end.within(Limits(speed=1.01 * begin))
    assert not end.within(Limits(speed=0.5 * (begin + last)))
    assert leg_end_of(splice_of(flown, 0.5, 0.1, 4)) is None


def test_a_plan_whose_last_leg_ends_goes_on_to_waypoints_beyond_its_end():
    flown = minsnap.plan(POINTS[:2], durations=[2.0])
    change = Replanner(LIMITS, clock=still).replan(flown, 1.9, POINTS[1:], 0.05, **AMPLE)
    assert not change.kept, change.reason
    assert change.trajectory.legs == 3
    check_no_jump(change.trajectory, flown, 1.95)


def test_times_that_are_given_are_those_of_the_legs_after_the_one_flown_on():
    assert Aim(durations=np.array([0.05, 1.0, 2.0])).after(0.05).durations.tolist() == [1.0, 2.0]
    assert Aim(durations=np.array([0.06, 1.0, 2.0])).after(0.05) is None
    assert Aim(total_time=2.0).after(0.5).total_time == 1.5
    assert Aim(total_time=2.0).after(3.0) is None


@pytest.mark.parametrize("yaw", ([0.0, 0.5, 0.2, -0.3], "velocity"))
def test_an_instant_before_a_waypoint_the_yaw_rate_of_the_rest_is_judged_too(yaw):
    full = minsnap.plan(POINTS, limits=Limits(acceleration=3.0), yaw=yaw, pieces=1)
    begin = float(full.leg_breaks[1])
    rate = Limits(yaw_rate=1.0).utilisation(full.between(begin, full.duration))[0].value
    splices = [splice_of(full, begin - 0.1 - left, 0.1, 4) for left in np.geomspace(1e-7, 1e-6, 30)]
    for share, kept in ((0.9, False), (1.1, True)):
        limits = Limits(acceleration=full.max_norm(2)[0], yaw_rate=share * rate)
        assert all(rest_within(splice, limits) is kept for splice in splices)

"""One heading per waypoint ahead: met there, without a jump at the splice, and within the limit on the yaw rate."""

import dataclasses

import numpy as np
import pytest

import minsnap
from minsnap import Limits, Replanner
from minsnap.durations import watched_search
from minsnap.errors import YawError
from minsnap.replanning.splice import splice_of
from minsnap.trajectory.heading import wrap
from minsnap.vehicle import Quadrotor, flatness_of

POINTS = np.array([(0, 0, 1), (2, 0.5, 1), (4, 0, 1.2), (6, 1, 1), (8, 1, 1)], dtype=float)
LIMITS = Limits(speed=3.0, acceleration=6.0, yaw_rate=2.0)
AMPLE = {"began": 160.0}


def still():
    return 100.0


@pytest.fixture(scope="module")
def flown():
    return minsnap.plan(POINTS, limits=LIMITS, corridor=0.5, yaw=[0.0, 0.5, 0.2, -0.3, 0.4], pieces=1)


def check_heading(change, flown, angles):
    """Value and rate at the splice, angles at the waypoints, and the rate in between."""
    yaw, at = change.trajectory.yaw, min(change.splice, flown.duration)
    for order in range(2):
        assert float(yaw(0.0, order)) == pytest.approx(float(flown.yaw(at, order)), abs=1e-9)
        assert float(change.stop.yaw(0.0, order)) == pytest.approx(float(flown.yaw(at, order)), abs=1e-9)
    ends = yaw(change.trajectory.leg_breaks[1:])
    assert np.abs(wrap(ends - np.asarray(angles)[: len(ends)])).max() <= 1e-9
    t = np.linspace(0.0, change.trajectory.duration, 2001)
    assert np.abs(yaw(t, 1)).max() <= LIMITS.yaw_rate * (1.0 + 1e-9)
    assert minsnap.certify(change.trajectory, limits=LIMITS).ok
    steps = np.abs(np.diff(yaw(t))) / np.diff(t)
    assert steps.max() <= LIMITS.yaw_rate * (1.0 + 1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("horizon", [None, 2])
@pytest.mark.parametrize("now", [0.1, 0.7, 1.5])
def test_new_plans_turn_through_the_angles_from_the_flown_heading_and_its_rate(flown, now, horizon):
    passed = splice_of(flown, now, 0.1, 4).passed
    angles = np.array([0.6, 0.3, -0.1, 0.2])[passed:] + 2.0 * np.pi
    points = POINTS[passed + 1 :] + [0.0, 0.0, 0.1]
    change = Replanner(LIMITS, 0.5, horizon=horizon, clock=still).replan(flown, now, points, 0.1, yaw=angles, **AMPLE)
    assert not change.kept, change.reason
    check_heading(change, flown, angles)


def test_headings_too_fast_beyond_the_horizon_are_not_flown(flown):
    angles = [0.5, 0.2, -0.3, -3.0]
    change = Replanner(LIMITS, 0.5, horizon=2, clock=still).replan(flown, 0.1, POINTS[1:], 0.1, yaw=angles, **AMPLE)
    assert change.certified and minsnap.certify(change.trajectory, limits=LIMITS).ok
    assert change.kept and change.reason == "what is flown beyond the horizon exceeds the limits with the new headings"


def test_where_only_the_headings_change_the_same_curve_is_flown_with_them(flown):
    replanner, angles = Replanner(LIMITS, 0.5, clock=still), [0.9, 0.6, 0.3, 0.0]
    change = replanner.replan(flown, 0.2, POINTS[1:], 0.1, yaw=angles)
    assert not change.kept and change.certified
    rest = splice_of(flown, 0.2, 0.1, 4).rest
    t = np.linspace(0.0, rest.duration, 50)
    assert change.trajectory(t) == pytest.approx(rest(t), abs=1e-12)
    check_heading(change, flown, angles)
    again = replanner.replan(change.trajectory, 0.1, POINTS[1:], 0.1, yaw=angles)
    assert again.kept and again.reason == "nothing has changed"
    check_heading(again, change.trajectory, angles)


def test_headings_too_fast_for_the_rest_make_the_plan_slower(flown):
    angles = [1.4, 0.4, -0.6, -1.2]
    change = Replanner(LIMITS, 0.5, clock=still).replan(flown, 0.2, POINTS[1:], 0.1, yaw=angles, **AMPLE)
    assert not change.kept, change.reason
    assert change.trajectory.duration > flown.duration - change.splice
    check_heading(change, flown, angles)


def test_shortly_before_a_waypoint_the_flown_heading_is_met_there_or_the_plan_begins_at_the_splice(flown):
    now = float(flown.leg_breaks[1]) - 0.12
    moved = POINTS[1:] + np.array([[0.0], [0.2], [0.2], [0.2]])
    for angles in ([0.5, 0.3, 0.1, 0.2], [0.49, 0.3, 0.1, 0.2]):
        change = Replanner(LIMITS, 0.5, clock=still).replan(flown, now, moved, 0.1, yaw=angles, **AMPLE)
        assert not change.kept, change.reason
        check_heading(change, flown, angles)


def test_angles_with_boxes_go_to_the_ends_of_their_legs(flown):
    lower, upper = np.minimum(POINTS[:-1], POINTS[1:]) - 0.5, np.maximum(POINTS[:-1], POINTS[1:]) + 0.5
    angles, boxes = [0.2, 0.4, 0.6, 0.8], minsnap.Boxes(lower, upper)
    change = minsnap.replan(
        flown, 0.2, budget=0.1, boxes=boxes, goal=POINTS[-1], limits=LIMITS, yaw=angles, clock=still, **AMPLE
    )
    check_heading(change, flown, angles)


def test_headings_to_and_fro_are_followed_by_a_slower_plan(flown):
    angles = [3.0, 0.0, 3.0, 0.0]
    change = Replanner(LIMITS, 0.5, clock=still).replan(flown, 0.2, POINTS[1:], 0.1, yaw=angles, **AMPLE)
    assert not change.kept and change.trajectory.duration > 1.5 * flown.duration
    check_heading(change, flown, angles)


def test_headings_that_no_plan_found_can_follow_leave_the_flown_ones(flown, monkeypatch):
    search = watched_search.search_shortest
    monkeypatch.setattr(
        watched_search, "search_shortest", lambda *asked: dataclasses.replace(search(*asked), kept=False, inside=None)
    )
    change = Replanner(LIMITS, 0.5, clock=still).replan(flown, 0.2, POINTS[1:], 0.1, yaw=[3.0, 0.0, 3.0, 0.0], **AMPLE)
    assert change.kept and change.certified and change.reason
    assert change.trajectory.yaw(0.5) == pytest.approx(flown.yaw(0.8), abs=1e-12)


@pytest.mark.parametrize("yaw", [[0.0, 1.0], ["east", 0.0, 0.0, 0.0], [np.nan, 0.0, 0.0, 0.0], "velocity"])
def test_malformed_angles_are_refused(flown, yaw):
    with pytest.raises(YawError, match="give one finite angle .* for each of the 4 waypoints ahead"):
        Replanner(LIMITS, 0.5, clock=still).replan(flown, 0.2, POINTS[1:], 0.1, yaw=yaw)


def test_a_stop_ends_a_turn_so_gently_that_the_rotors_can():
    """Stops were judged level in yaw and turned back within 0.5 s: rotors had to give up to 45 % more than they can."""
    vehicle = Quadrotor.px4_sih()
    limits, points = Limits.of(vehicle, speed=4.0, acceleration=7.0), np.array([(0, 0, 1), (3, 1, 1.5), (6, -1, 1)])
    flown = minsnap.plan(points, limits=limits, yaw=[0.0, 1.5, -0.5], corridor=1.0, pieces=1)
    for now in (0.2, 0.5, 0.8):
        change = Replanner(limits, 1.0, clock=lambda: 0.0).replan(flown, now, points[1:], 0.2)
        stop, instants = change.stop, np.linspace(0.0, change.stop.duration, 500)
        assert stop.yaw(0.0, 1) == pytest.approx(flown.yaw(change.splice, 1)) and abs(stop.yaw(0.0, 1)) > 0.5
        assert np.abs(stop.yaw(instants, 1)).max() <= abs(stop.yaw(0.0, 1)) * (1.0 + 1e-9)
        thrusts = vehicle.thrusts(flatness_of(vehicle, stop, instants).rotor_speed)
        low, high = vehicle.rotor_thrust_limits
        assert low <= thrusts.min() and thrusts.max() <= high and minsnap.certify(stop, limits=limits).ok

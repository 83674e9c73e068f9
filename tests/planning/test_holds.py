"""A waypoint twice, with a duration, is a hold: at rest from one to the other, exactly."""

import numpy as np
import pytest

import minsnap
from minsnap.errors import WaypointError

POINTS = np.array([(0, 0, 1), (2, 0, 1), (2, 0, 1), (4, 2, 1)], dtype=float)
TIMES = [3.0, 4.0, 3.0]
WITHIN = np.linspace(3.0, 7.0, 4001)


def assert_still(path, orders=(1, 2, 3)):
    assert np.abs(path(WITHIN) - POINTS[1]).max() <= 1e-12
    for order in orders:
        assert np.abs(path(WITHIN[1:-1], order)).max() <= 1e-9


@pytest.mark.parametrize(
    "asked",
    [
        {},
        {"corridor": 0.3},
        {"corridor": minsnap.RoundTube(0.3)},
        {"corridor": 0.3, "pieces": 3},
        {"degree": 9},
        {"degree": 5},
        {"yaw": (0.0, 0.5, 1.0, 1.5)},
    ],
    ids=str,
)
def test_a_waypoint_twice_with_a_duration_is_a_hold(asked):
    """The pause of four seconds left its waypoint by 1.09 m, at up to 1.54 m/s; in a corridor it was refused."""
    path = minsnap.plan(POINTS, TIMES, **asked)
    assert_still(path)
    assert path(path.leg_breaks) == pytest.approx(POINTS, abs=1e-12)
    assert minsnap.certify(path, POINTS, corridor=asked.get("corridor")).ok


def test_a_hold_within_limits_is_at_rest_too():
    limits = minsnap.Limits(speed=3.0, acceleration=6.0)
    path = minsnap.plan(POINTS, TIMES, limits=limits)
    assert_still(path)
    assert minsnap.certify(path, POINTS, limits=limits).ok


def test_a_hold_costs_as_much_as_the_flights_beside_it():
    halves = minsnap.plan(POINTS[:2], TIMES[:1]), minsnap.plan(POINTS[2:], TIMES[2:])
    assert minsnap.plan(POINTS, TIMES).cost() == pytest.approx(sum(half.cost() for half in halves), rel=1e-12)


@pytest.mark.parametrize("corridor", [None, 0.3], ids=["free", "tube"])
def test_many_plans_hold_as_one_does(corridor):
    moving = POINTS + np.array([[0], [0], [0.1], [0]])
    many = minsnap.plan_many(np.stack([POINTS, moving]), np.array([TIMES, TIMES]), corridor=corridor, gradients=True)
    assert_still(many[0])
    assert np.abs(many[1](WITHIN) - POINTS[1]).max() > 0.1
    later = [TIMES[0] + 1e-5, *TIMES[1:]]
    slope = (minsnap.plan(POINTS, later, corridor=corridor).cost() - many[0].cost()) / 1e-5
    assert many.gradients.durations[0] == pytest.approx(slope, rel=1e-3)


def test_a_leg_back_to_its_waypoint_that_begins_in_motion_is_no_hold():
    path = minsnap.plan(POINTS[1:], TIMES[1:], start={"velocity": (1.0, 0.0, 0.0)})
    assert np.abs(path(np.linspace(0.0, 4.0, 101)) - POINTS[1]).max() > 0.1
    pinned = minsnap.plan(POINTS, TIMES, pins={2: {"velocity": (0.0, 1.0, 0.0)}})
    assert pinned(7.0, 1) == pytest.approx([0.0, 1.0, 0.0])


def test_a_lap_may_have_a_hold_also_where_it_is_closed():
    lap = np.vstack((POINTS, POINTS[:1]))
    path = minsnap.plan(lap, [*TIMES, 4.0], closed=True)
    assert_still(path)
    assert np.linalg.norm(path(0.0, 1)) > 0.1 and path(0.0, 1) == pytest.approx(path(path.duration, 1), abs=1e-9)
    for points, times, still in (
        (np.vstack((POINTS[:1], lap)), [1.0, *TIMES, 4.0], (0.0, 1.0)),
        (np.vstack((lap, POINTS[:1])), [*TIMES, 4.0, 1.0], (14.0, 15.0)),
    ):
        path = minsnap.plan(points, times, closed=True)
        assert np.abs(path(np.linspace(*still, 101)) - POINTS[0]).max() <= 1e-12
        for order in (1, 2, 3):
            assert path([0.0, path.duration], order) == pytest.approx(np.zeros((2, 3)), abs=1e-9)


def test_without_a_duration_the_hold_is_named():
    for asked in ({"total_time": 9.0}, {"limits": minsnap.Limits(speed=2.0)}, {"total_time": 9.0, "corridor": 0.3}):
        with pytest.raises(
            WaypointError, match="waypoints 1 and 2 are both .*, or give every leg a duration, which makes it a hold"
        ):
            minsnap.plan(POINTS, **asked)

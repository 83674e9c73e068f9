"""Durations and totals of the legs ahead with a horizon and on the way back, and plans of other degrees flown on."""

import numpy as np
import pytest

import minsnap
from minsnap import Boxes, Limits, replan

POINTS = np.array([(0, 0, 1), (4, 1, 1), (8, 0, 1), (12, 1, 1), (15, 0, 1)], dtype=float)
MOVED = POINTS[1:] + np.array([(0, 0.3, 0), (0, 0, 0), (0, 0, 0), (0, 0, 0)])
LIMITS = Limits(speed=2.0, acceleration=4.0)
NOW, BUDGET = 0.5, 0.2


@pytest.fixture(scope="module")
def flown():
    return minsnap.plan(POINTS, limits=LIMITS, pieces=1)


def change_of(flown, points, now=NOW, **options):
    options = {"limits": LIMITS, "clock": lambda: 0.0} | options
    return replan(flown, now, points, BUDGET, **options)


def left(flown):
    """Durations of the flown legs from the splice on."""
    return np.diff(np.append(NOW + BUDGET, flown.leg_breaks[1:]))


@pytest.mark.parametrize("longer", [0.1, 0.3])
def test_with_a_horizon_the_first_legs_have_their_durations(flown, longer):
    """NumPy's ValueError came out of replan: all durations were asked of the first legs."""
    wanted = left(flown) + np.array([longer, longer, 0.0, 0.0])
    change = change_of(flown, POINTS[1:], horizon=2, durations=wanted)
    assert change.certified and not change.kept
    assert np.diff(change.trajectory.leg_breaks) == pytest.approx(wanted)
    rests = change_of(flown, MOVED, horizon=2, durations=wanted + 2.0)  # what follows has other durations
    assert np.diff(rests.trajectory.leg_breaks) == pytest.approx(wanted[:2] + 2.0)


@pytest.mark.parametrize("total", [9.0, 11.0])
def test_with_a_horizon_the_first_legs_have_what_the_others_leave_of_a_total(flown, total):
    """All of the time went to the first legs."""
    change = change_of(flown, POINTS[1:], horizon=2, total_time=total)
    assert not change.kept and change.trajectory.duration == pytest.approx(total)
    assert np.diff(change.trajectory.leg_breaks)[2:] == pytest.approx(left(flown)[2:])
    rests = change_of(flown, MOVED, horizon=2, total_time=1.3 * total)
    assert rests.trajectory.legs == 2
    assert 0.4 < rests.trajectory.duration / (1.3 * total) < 0.6


@pytest.mark.parametrize("times", [{"total_time": 12.0}, {"durations": [3.0] * 4}])
def test_the_way_back_is_part_of_the_time_that_there_is(flown, times):
    """The way back came on top: 12.3 s were flown for 12."""
    boxes = Boxes(
        [(-1, -1, 1.1), (3, -1, 0.5), (7, -1, 0.5), (11, -1, 0.5)], [(5, 2, 2), (9, 2, 2), (13, 2, 2), (16, 2, 2)]
    )
    above = POINTS[1:] + np.array([(0, 0, 0.3), (0, 0, 0), (0, 0, 0), (0, 0, 0)])
    change = change_of(flown, above, corridor=boxes, recover=0.2, **times)
    assert change.inside_from > 0.0 and change.certified and not change.kept
    assert change.trajectory.duration == pytest.approx(12.0)
    short = change_of(flown, above, corridor=boxes, recover=0.2, total_time=0.5 * change.inside_from)
    assert short.kept and "the way back into the corridor of leg 0 takes" in short.reason


@pytest.mark.parametrize(("degree", "other"), [(5, 7), (7, 9), (3, 7)])
def test_a_plan_of_a_lower_degree_is_flown_on_as_smoothly_as_it_is(degree, other):
    """Its end of a leg and its legs beyond a horizon were refused, as having too few continuous derivatives."""
    flown = minsnap.plan(POINTS, limits=LIMITS, degree=degree, pieces=1)
    late = 0.93 * flown.leg_breaks[1] - BUDGET
    later = POINTS[1:] + np.array([(0, 0, 0), (0, 0.3, 0), (0, 0.3, 0), (0, 0.3, 0)])
    faster = Limits(speed=3.0, acceleration=6.0)
    for change, joint in (
        (change_of(flown, later, late, degree=other), 1),
        (change_of(flown, POINTS[1:], degree=other, limits=faster, horizon=1), 1),
    ):
        assert change.certified and not change.kept
        curve, at = change.trajectory, change.trajectory.leg_breaks[joint]
        for order in range((degree + 1) // 2):
            assert curve(at - 1e-9, order) == pytest.approx(curve(at + 1e-9, order), abs=1e-5)


def test_why_requested_durations_are_not_kept_is_told_where_angles_make_the_rest_another_plan(flown):
    """No reason was given for 8.8 s where 4 s were asked for."""
    change = change_of(flown, POINTS[1:], durations=[1.0] * 4, yaw=[0.3, 0.2, 0.4, 0.5])
    assert not change.kept and change.reason == change_of(flown, POINTS[1:], durations=[1.0] * 4).reason != ""
    assert change_of(flown, POINTS[1:], yaw=[0.3, 0.2, 0.4, 0.5]).reason == ""


@pytest.mark.parametrize(
    ("points", "options", "sentence"),
    [
        ([[1, 2, 3], [1]], {}, r"are \[\[1, 2, 3\], \[1\]\]: give those still to be passed"),
        ("ab", {}, "are 'ab': give"),
        (POINTS[1:], {"goal": (1, 1, 1)}, "leave out the goal or the waypoints"),
    ],
)
def test_what_is_no_course_ahead_is_refused_by_what_it_is(flown, points, options, sentence):
    with pytest.raises(minsnap.errors.WaypointError, match=sentence):
        change_of(flown, points, **options)


def test_the_corridor_of_a_replanner_is_its_own():
    """Widths changed later by the caller were those of the next replan."""
    flown, widths = minsnap.plan(POINTS, limits=LIMITS, corridor=0.4, pieces=1), np.full(4, 0.4)
    replanner = minsnap.Replanner(LIMITS, widths, clock=lambda: 0.0)
    widths[:] = 1e-3
    assert replanner.replan(flown, NOW, POINTS[1:], BUDGET).certified

"""Stop plans, judged by dense samples: from the state to rest, inside the boxes of two legs or the tube, and limits."""

from itertools import count

import numpy as np
import pytest

import minsnap
from minsnap import Boxes, Limits, RoundTube, Tube
from minsnap.basics.deadline import Deadline, LateError
from minsnap.durations.stopping import Stopping
from minsnap.replanning.course_ahead import course_ahead
from minsnap.replanning.splice import splice_of

POINTS = np.array([(0, 0, 1), (2, 0.5, 1), (4, 0, 1.2), (6, 1, 1), (8, 1, 1)], dtype=float)
LOWER, UPPER = np.minimum(POINTS[:-1], POINTS[1:]) - 0.5, np.maximum(POINTS[:-1], POINTS[1:]) + 0.5
LIMITS = Limits(speed=3.0, acceleration=6.0)
START = {"velocity": (1.5, 0.2, 0), "acceleration": (0.5, 0, 0)}


@pytest.fixture(scope="module")
def flown():
    return minsnap.plan(POINTS, limits=LIMITS, corridor=Boxes(LOWER, UPPER), start=START, pieces=1)


def stopping(flown, now, corridor):
    splice = splice_of(flown, now, 0.02, 4)
    boxes = corridor or Boxes(LOWER[splice.passed :], UPPER[splice.passed :])
    course = course_ahead(splice, POINTS[splice.passed + 1 :], None, splice.leg_start, [boxes], 1)
    return splice, Stopping(course.task, LIMITS)


def check_limits_and_ends(stop, splice):
    t = np.linspace(0.0, stop.duration, 2001)
    assert np.linalg.norm(stop(t, 1), axis=1).max() <= 3.0 * (1.0 + 1e-8)
    assert np.linalg.norm(stop(t, 2), axis=1).max() <= 6.0 * (1.0 + 1e-8)
    for order in range(4):
        assert stop(0.0, order) == pytest.approx(
            splice.state[order], abs=1e-8 * max(1, np.abs(splice.state[order]).max())
        )
        assert order == 0 or np.abs(stop(stop.duration, order)).max() < 1e-7
    return stop(t)


@pytest.mark.parametrize("share", [0.0, 0.13, 0.27, 0.41, 0.48, 0.6, 0.75, 0.9])
def test_braking_stays_in_the_boxes_of_two_legs(flown, share):
    splice, found = stopping(flown, share * flown.duration, None)
    stop = found.braking()
    x = check_limits_and_ends(stop, splice)
    t = np.linspace(0.0, stop.duration, 2001)
    for leg in range(stop.legs):
        own = (t >= stop.leg_breaks[leg]) & (t <= stop.leg_breaks[leg + 1])
        assert (x[own] >= LOWER[splice.passed + leg] - 1e-12).all()
        assert (x[own] <= UPPER[splice.passed + leg] + 1e-12).all()


@pytest.mark.parametrize("tube", [Tube(0.6), RoundTube(0.6)])
def test_braking_in_a_tube_ends_no_further_than_its_width_beyond_the_waypoint(flown, tube):
    splice, found = stopping(flown, 0.55, tube)
    stop = found.braking()
    x = check_limits_and_ends(stop, splice)
    begin, end = (POINTS[splice.passed], POINTS[splice.passed + 1]) if stop.legs == 1 else (POINTS[1], POINTS[2])
    u = (end - begin) / np.linalg.norm(end - begin)
    assert ((x[-1] - end) @ u) <= 0.6 + 1e-9


def test_the_place_of_the_end_is_chosen_where_the_family_is_not_inside():
    """A box that is open to the side alone, flown at on a slant."""
    points = np.array([(0.0, 0.0, 1.0), (0.5, 3.0, 1.0)])
    box = Boxes([(-0.3, -0.4, 0.5)], [(0.62, 4.0, 1.5)])
    flown = minsnap.Trajectory(
        np.array([[(0.0, 0.0, 1.0), (1.0, 0.5, 1.0)]]), np.ones(1)
    )  # a straight line at constant velocity
    splice = splice_of(flown, 0.0, 1e-9, 4)
    course = course_ahead(splice, points[1:], None, points[0], [box], 1)
    found = Stopping(course.task, Limits(speed=3.0, acceleration=4.0))
    stop = found.aside()
    x = stop(np.linspace(0.0, stop.duration, 1001))
    assert (x >= box.lower[0] - 1e-12).all() and (x <= box.upper[0] + 1e-12).all()
    assert np.abs(stop(stop.duration, 1)).max() < 1e-8


def test_none_before_a_wall():
    points = np.array([(0.0, 0.0, 1.0), (0.2, 0.0, 1.0)])
    box = Boxes([(-0.3, -0.4, 0.5)], [(0.3, 0.4, 1.5)])
    flown = minsnap.Trajectory(np.array([[(0.0, 0.0, 1.0), (3.0, 0.0, 1.0)]]), np.ones(1))
    splice = splice_of(flown, 0.0, 1e-9, 4)
    found = Stopping(
        course_ahead(splice, points[1:], None, points[0], [box], 1).task, Limits(speed=3.0, acceleration=4.0)
    )
    assert found.braking() is None
    assert found.aside() is None


@pytest.mark.parametrize("speed", (0.0, 0.02))
def test_a_vehicle_nearly_at_rest_stays_with_a_jerk_that_is_no_rounding(speed):
    place, motion = np.array([30.0, 1.0, 1.0]), np.array([speed, 0.0, 0.0])
    flown = minsnap.Trajectory((place + np.linspace(0.0, 1.0, 8)[:, None] * motion)[None], np.ones(1))
    splice = splice_of(flown, 0.0, 1e-9, 4)
    course = course_ahead(splice, [place + (5.0, 0.0, 0.0)], None, place, [Tube(0.5)], 1)
    stop = Stopping(course.task, LIMITS).braking()
    assert stop(stop.duration) == pytest.approx(place, abs=0.01) and stop.duration >= 0.05
    for order in (1, 2, 3):
        assert stop(0.0, order) == pytest.approx(motion * (order == 1), abs=1e-8)
        assert stop(stop.duration, order) == pytest.approx(np.zeros(3), abs=1e-8)


def straight_on(speed, acceleration=0.0):
    """Return a motion along x from the origin, 1 s long."""
    return minsnap.Trajectory(np.array([[(0, 0, 1), (speed / 2, 0, 1), (speed + acceleration / 2, 0, 1)]]), np.ones(1))


@pytest.mark.parametrize("share", (1.0, 1.0 + 1e-9))
def test_a_start_on_its_limit_or_above_it_by_rounding_brakes(share):
    splice = splice_of(straight_on(3.0 * share), 0.0, 1e-9, 4)
    course = course_ahead(splice, [(5.0, 0.0, 1.0)], None, np.array([0.0, 0.0, 1.0]), [Tube(0.5)], 1)
    stop = Stopping(course.task, LIMITS).braking()
    assert stop is not None and np.abs(stop(stop.duration, 1)).max() < 1e-7


def test_a_curve_that_leaves_the_box_between_the_instants_looked_at_is_no_stop():
    """Up to a summit and down again: the walls are 0 to 0.2 mm below the summit of the shortest stop."""
    flown = minsnap.Trajectory(np.array([[(0.0, 0.0, 1.0), (1.0, 0.3, 1.0), (2.0, -0.3, 1.0)]]), np.ones(1))
    splice, summit = splice_of(flown, 0.0, 1e-9, 4), None
    for wall in (0.1, *np.linspace(0.09311, 0.09331, 5)):
        box = Boxes([(-0.5, -0.35, 0.5)], [(6.0, wall, 1.5)])
        course = course_ahead(splice, [(5.0, -0.3, 1.0)], None, np.array([0.0, 0.0, 1.0]), [box], 1)
        stop = Stopping(course.task, Limits(speed=4.0, acceleration=6.0)).braking()
        if summit is None:
            summit = stop(np.linspace(0.0, stop.duration, 2001))[:, 1].max()
            assert summit == pytest.approx(0.09331, abs=1e-6)
        assert stop is None or stop.extent((0.0, 1.0, 0.0))[1] <= wall


def test_no_stop_is_looked_for_once_the_time_is_over(flown):
    """On a clock that stands still until it jumps at a reading; every later jump lets more be done."""
    _, found = stopping(flown, 0.41 * flown.duration, None)
    whole, ended = found.braking(), []
    for after in range(40):
        readings = count()
        deadline = Deadline(1.0, lambda readings=readings, after=after: 2.0 * (next(readings) > after))
        try:
            stop = Stopping(found.task, LIMITS, deadline).braking()
            assert stop.duration == whole.duration
            ended.append(True)
        except LateError:
            ended.append(False)
    assert not ended[0] and ended[-1] and ended == sorted(ended)
    with pytest.raises(LateError):
        Stopping(found.task, LIMITS, Deadline(-1.0, lambda: 0.0)).aside()


def test_a_cubic_that_cannot_stop_is_refused_in_a_sentence():
    """A state of a cubic pins no acceleration: it ended in an IndexError."""
    asked = {"degree": 3, "start": {"velocity": (1.0, 0.0, 0.0)}, "corridor": 0.01}
    with pytest.raises(minsnap.MinsnapError):
        minsnap.plan([(0, 0, 1), (0.2, 0.1, 1)], limits=minsnap.Limits(speed=4.0, acceleration=1.0), **asked)

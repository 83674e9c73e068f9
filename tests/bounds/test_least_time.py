"""Least times of all curves: known optima, courses in equivalent forms, what is left out, and what bounds nothing."""

from dataclasses import replace
from math import inf, sqrt

import numpy as np
import pytest

import minsnap
from minsnap import Ball, Boxes, Gate, Limits, least_time
from minsnap.native.library import using

RECTANGLE = np.array([(0, 0, 0), (8, 0, 0), (8, 4, 0), (0, 4, 0), (0, 0, 0)], dtype=float)
SLALOM = [(0, 0, 0), (4, 4, 0), (-4, 8, 0), (4, 12, 0), (-4, 16, 0), (4, 20, 0), (0, 26, 4)]
SLALOM += [(-4, 20, 0), (4, 16, 0), (-4, 12, 0), (4, 8, 0), (-4, 4, 0), (0, 0, 0)]
QUICK = Limits(speed=3.0, acceleration=6.0)


def line(*places):
    return [(place, 0.0, 0.0) for place in places]


def seconds(*course, **more):
    bound = least_time(*course, **more)
    assert bound.verify(), bound
    return bound.seconds


@pytest.mark.parametrize(
    ("course", "limits", "optimum"),
    [
        (line(0, 8), Limits(acceleration=6), 2.0 * sqrt(8.0 / 6.0)),
        (line(0, 3, 8), Limits(acceleration=6), 2.0 * sqrt(8.0 / 6.0)),
        (line(0, 4, 0), Limits(acceleration=6), 4.0 * sqrt(4.0 / 6.0)),
        (line(0, 8), QUICK, 3.0 / 6.0 + 8.0 / 3.0),
        (line(0, 3, 8), QUICK, 3.0 / 6.0 + 8.0 / 3.0),
        (RECTANGLE, Limits(speed=3), 8.0),
        (line(0, 100), Limits(speed=1, acceleration=2), 100.5),
        ([(0, 0, 0), (4, 3, 0)], Limits(acceleration=5, norm="axis"), 2.0 * sqrt(4.0 / 5.0)),
        ([(0, 0, 0), (0, 0, 4)], Limits(max_thrust=2.0, gravity=10.0), sqrt(60.0) * (1 / 10.0 + 1 / 30.0)),
        ([(0, 0, 0), (0, 0, 4)], Limits(vertical_acceleration=5.0, acceleration=20.0), 2.0 * sqrt(4.0 / 5.0)),
        ([(0, 0, 4), (0, 0, 0)], Limits(climb_speed=9.0, descent_speed=2.0), 2.0),
        ([(0.0,), (8.0,)], Limits(acceleration=6), 2.0 * sqrt(8.0 / 6.0)),
    ],
)
def test_known_optima_come_back(course, limits, optimum):
    found = seconds(course, limits)
    assert optimum * (1.0 - 3e-4) <= found <= optimum


def test_a_horizontal_flight_that_may_tilt_by_an_angle():
    """At 45 degrees, and hardly any climb, thrust gives as much acceleration as gravity."""
    limits = Limits(tilt=np.pi / 4.0, vertical_acceleration=1e-3, acceleration=100.0, gravity=10.0)
    found = seconds(line(0, 10), limits)
    assert 2.0 * (1.0 - 3e-4) <= found <= 2.0


def test_a_moving_start_and_end_are_known():
    """From 2 m/s to 1 m/s over 4 m, with bang-bang acceleration of 3 m/s²: the speed between them has a closed form."""
    most = sqrt(3.0 * 4.0 + 0.5 * (2.0**2 + 1.0**2))
    optimum = (2.0 * most - 3.0) / 3.0
    found = seconds(line(0, 4), Limits(acceleration=3), start={"velocity": (2, 0, 0)}, end={"velocity": (1, 0, 0)})
    assert optimum * (1.0 - 1e-4) <= found <= optimum


@pytest.mark.slow
def test_the_slalom_of_a_point_mass():
    """Published: 11.186 s; flown by this library in 10.6192 s with six polynomials a leg."""
    assert 10.61 <= seconds(SLALOM, Limits(max_thrust=34.32 / 9.80665)) <= 10.6192


@pytest.mark.slow
def test_a_course_in_other_forms_takes_as_long():
    known = seconds(RECTANGLE, QUICK)
    assert seconds(RECTANGLE[::-1], QUICK) == pytest.approx(known, rel=3e-4)
    assert seconds(RECTANGLE * (1, -1, 1) + (5, 7, 100), QUICK) == pytest.approx(known, rel=1e-4)
    turned = RECTANGLE @ np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0].T
    assert seconds(turned, QUICK) == pytest.approx(known, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(("length", "time"), [(1e3, 1.0), (1e-3, 1.0), (1.0, 1e3), (3.7, 0.01), (1e6, 1e-4)])
def test_units_of_length_and_time_do_not_matter(length, time):
    limits = Limits(speed=3.0 * length / time, acceleration=6.0 * length / time**2)
    assert seconds(RECTANGLE * length, limits) / time == pytest.approx(seconds(RECTANGLE, QUICK), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.01, 0.3, 30.0, 1e4])
@pytest.mark.parametrize("acceleration", [0.01, 1e3])
def test_limits_far_apart_bound_all_the_same(speed, acceleration):
    """On a line a trapezoid of speed is the optimum."""
    top = min(speed, sqrt(8.0 * acceleration))
    optimum = top / acceleration + 8.0 / top
    found = seconds(line(0, 8), Limits(speed=speed, acceleration=acceleration))
    assert optimum * (1.0 - 3e-3) <= found <= optimum


def test_legs_of_very_different_lengths_bound():
    course = line(0, 0.01, 50, 50.02, 50.03)
    whole = seconds(line(0, 50.03), QUICK)
    assert whole * (1.0 - 2e-3) <= seconds(course, QUICK) <= 3.0 / 6.0 + 50.03 / 3.0


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [Ball(0.3), 0.3])
@pytest.mark.parametrize("limits", [QUICK, Limits(acceleration=6)])
def test_room_around_waypoints_makes_it_shorter(tolerance, limits):
    exact, free = seconds(RECTANGLE, limits), seconds(RECTANGLE, limits, waypoint_tolerance=tolerance)
    flown = minsnap.plan(RECTANGLE, limits=limits, waypoint_tolerance=tolerance, pieces=3).duration
    assert 0.95 * flown < free < min(exact, flown)


def test_a_ball_on_a_line_takes_nothing_away():
    """Where it lies along the way does not matter, and beside it is farther."""
    optimum = 2.0 * sqrt(8.0 / 6.0)
    found = seconds(line(0, 4, 8), Limits(acceleration=6), waypoint_tolerance=Ball(0.2))
    assert optimum * (1.0 - 2e-3) <= found <= optimum


def test_gates_count_as_openings():
    gates = [(0, 0, 1), Gate((4, 1, 1), (1, 0.2, 0), 1.0), Gate.circle((7, 5, 1), (0, 1, 0), 0.4), (0, 6, 1)]
    points = [(0, 0, 1), (4, 1, 1), (7, 5, 1), (0, 6, 1)]
    limits = Limits(speed=4.0, acceleration=5.0)
    flown = minsnap.plan(gates, limits=limits, pieces=3).duration
    assert 0.97 * flown < seconds(gates, limits) < min(flown, seconds(points, limits))


def test_sets_without_waypoints_bound_by_their_overlaps():
    boxes = Boxes([(-1, -1, 0), (4, -1, 0), (4, -1, 0)], [(6, 1, 2), (6, 8, 2), (12, 1, 2)])
    boxes = Boxes([(-1, -1, 0), (4, -1, 0), (4, 6, 0)], [(6, 1, 2), (6, 8, 2), (12, 8, 2)])
    ends = {"start": {"position": (0, 0, 1)}, "end": {"position": (11, 7, 1)}}
    flown = minsnap.plan(None, limits=QUICK, corridor=boxes, pieces=3, **ends).duration
    bound = least_time(None, QUICK, corridor=boxes, **ends)
    assert bound.verify()
    assert 0.8 * flown < bound.seconds < flown
    assert bound.left_out == ("the box",)


def test_regions_that_overlap_count_once():
    """Three waypoints within each other's balls add nothing to the way."""
    course = line(0, 4, 4.1, 4.2, 8)
    found = seconds(course, QUICK, waypoint_tolerance=Ball(0.3))
    assert 0.99 * seconds(line(0, 8), QUICK) < found <= seconds(line(0, 8), QUICK) * (1.0 + 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("limits", [QUICK, Limits(acceleration=6), Limits(max_thrust=2.0, tilt=0.8)])
def test_a_lap_begins_in_motion(limits):
    lap = seconds(RECTANGLE, limits, closed=True)
    flown = minsnap.plan(RECTANGLE, limits=limits, closed=True, pieces=3).duration
    assert 0.97 * flown < lap < flown
    assert lap < seconds(RECTANGLE, limits)
    assert seconds(np.roll(RECTANGLE[:-1], 1, axis=0)[[0, 1, 2, 3, 0]], limits, closed=True) == pytest.approx(
        lap, rel=1e-3
    )


def test_what_is_left_out_is_named():
    vehicle = minsnap.vehicle.Quadrotor.dji_f330()
    bound = least_time(RECTANGLE, Limits.of(vehicle, jerk=30.0, body_rate=5.0), corridor=0.3)
    assert {"jerk", "body rate", "single rotors", "the corridor"} <= set(bound.left_out)
    assert least_time(RECTANGLE, QUICK).left_out == ()


@pytest.mark.parametrize("limits", [Limits(jerk=5), Limits(tilt=0.5), Limits(climb_speed=2), Limits(yaw_rate=1)])
def test_nothing_that_bounds_is_a_reason(limits):
    bound = least_time(RECTANGLE, limits)
    assert bound.seconds is None
    assert "is bounded" in bound.reason
    assert not bound.verify()


@pytest.mark.parametrize(
    ("limits", "last"),
    [
        (Limits(horizontal_speed=2.0), (0.0, 0.0, 0.5)),
        (Limits(horizontal_speed=2.0), (1.0, 1.0, 1.0)),
        (Limits(descent_speed=1.7, vertical_acceleration=1.9), (1.0, 1.0, 2.0)),
    ],
    ids=["climbs", "a climb", "across"],
)
def test_limits_that_bound_no_speed_along_a_leg_are_a_reason(limits, last):
    """A division by zero came out, of plans for a total too."""
    points = [(0.0, 0.0, 0.0), (0.0, 0.0, 1.0), last]
    bound = minsnap.least_time(points, limits)
    assert bound.seconds is None and "along every leg" in bound.reason
    with pytest.raises(minsnap.InfeasibleError):
        minsnap.plan(points, total_time=1e-3, limits=replace(limits, snap=10.0))


def test_a_course_that_needs_no_motion_has_no_bound():
    bound = least_time(line(0, 0.1), QUICK, waypoint_tolerance=Ball([0.2, 0.2]))
    assert bound.seconds is None
    assert "without moving" in bound.reason


def test_more_than_three_coordinates_have_no_bound():
    assert "three coordinates" in least_time(np.eye(5)[:, :4], QUICK).reason


def test_without_the_native_core_there_is_a_reason():
    with using("python"):
        assert "native core" in least_time(RECTANGLE, QUICK).reason


def test_malformed_questions_are_refused():
    with pytest.raises(minsnap.InputError, match="limits"):
        least_time(RECTANGLE, {"speed": 3})
    with pytest.raises(minsnap.InputError, match="empty"):
        least_time(RECTANGLE, Limits())
    with pytest.raises(minsnap.InputError):
        least_time(line(0, 0, 1), QUICK)
    with pytest.raises(minsnap.InputError):
        least_time(line(0, inf), QUICK)

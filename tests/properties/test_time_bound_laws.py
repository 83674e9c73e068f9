"""Laws of the least time: no flight is quicker, however it was planned, and more freedom is never slower."""

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

import minsnap
from minsnap import Ball, Limits, least_time

QUICK = (Phase.explicit, Phase.reuse, Phase.generate)
KINDS = ("speed and acceleration", "axes", "thrust", "thrust and tilt", "all")


@st.composite
def courses(draw):
    """Waypoints, limits, radius of balls and velocity at the start."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    points = np.cumsum(random.normal(size=(draw(st.integers(2, 7)), 3)) * (3, 3, 1), axis=0)
    speed, acceleration, thrust, tilt = random.uniform((2, 3, 1.5, 0.4), (8, 12, 3.5, 1.1))
    kind = draw(st.sampled_from(KINDS))
    limits = {
        "speed and acceleration": Limits(speed=speed, acceleration=acceleration),
        "axes": Limits(speed=speed, acceleration=acceleration, norm="axis"),
        "thrust": Limits(max_thrust=thrust),
        "thrust and tilt": Limits(max_thrust=thrust, tilt=tilt),
        "all": Limits(speed=speed, max_thrust=thrust, tilt=tilt, jerk=60.0),
    }[kind]
    start = random.normal(size=3) * 0.5 if draw(st.booleans()) else np.zeros(3)
    return points, limits, draw(st.sampled_from([0.0, 0.2, 0.6])), start


@pytest.mark.slow
@settings(max_examples=25, phases=QUICK, deadline=None)
@given(courses(), st.sampled_from([1, 3, "auto"]))
def test_no_flight_is_quicker(course, pieces):
    points, limits, radius, start = course
    asked = {"limits": limits, "start": {"velocity": start}}
    if radius and len(points) > 2:
        asked["waypoint_tolerance"] = Ball(radius)
    bound = least_time(points, **asked)
    assert bound.verify()
    flown = minsnap.plan(points, pieces=pieces, **asked).duration
    assert bound.seconds <= flown * (1.0 + 1e-9)
    if pieces == "auto" and not radius and limits.jerk is None:
        assert flown <= 1.03 * bound.seconds


@settings(max_examples=10, phases=QUICK, deadline=None)
@given(courses())
def test_fewer_waypoints_are_not_slower(course):
    points, limits, _, start = course
    asked = {"limits": limits, "start": {"velocity": start}}
    whole, part = least_time(points, **asked).seconds, least_time(points[[0, -1]], **asked).seconds
    assert part <= whole * (1.0 + 2e-3)

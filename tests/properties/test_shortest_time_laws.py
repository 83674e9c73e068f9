"""Laws of the shortest time: units, freedom, the first guess, and time run backwards."""

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

import minsnap
from minsnap.corridors.gates import Ball
from minsnap.limits.limits import Limits

QUICK = (Phase.explicit, Phase.reuse, Phase.generate)
"""Without shrinking: every example is several searches, and a failure tells its arguments."""

SLOWER = 1.0 + 1e-4
"""How much slower a search may end with more freedom: it stops where steps gain less."""


@st.composite
def problems(draw):
    """Waypoints, half-width of a tube, speed and acceleration."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    steps = random.normal(size=(draw(st.integers(2, 4)), 3))
    points = np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
    return points, random.uniform(0.05, 0.6), random.uniform(1.0, 4.0), random.uniform(2.0, 8.0)


def duration(points, width, speed, acceleration, **options):
    limits = Limits(speed=speed, acceleration=acceleration)
    return minsnap.plan(points, limits=limits, corridor=width, **{"pieces": 1} | options).duration


@settings(max_examples=4, phases=QUICK)
@given(problems(), st.sampled_from([(1e3, 1.0), (1e-3, 1.0), (1.0, 1e3), (3.7, 0.01)]))
def test_units_of_length_and_time_do_not_matter(problem, units):
    points, width, speed, acceleration = problem
    length, time = units
    scaled = duration(points * length, width * length, speed * length / time, acceleration * length / time**2)
    assert scaled / time == pytest.approx(duration(*problem), rel=1e-6)


@settings(max_examples=4, phases=QUICK)
@given(problems(), st.floats(1.0, 2.0))
def test_more_freedom_is_never_slower(problem, factor):
    points, width, speed, acceleration = problem
    shortest = duration(*problem)
    assert duration(points, factor * width, speed, acceleration) <= SLOWER * shortest
    assert duration(points, width, factor * speed, factor * acceleration) <= SLOWER * shortest
    assert duration(*problem, waypoint_tolerance=Ball(0.3 * width)) <= SLOWER * shortest
    assert duration(*problem, waypoint_tolerance=0.3 * width) <= SLOWER * shortest


@settings(max_examples=3, phases=QUICK)
@given(problems())
def test_more_pieces_are_never_slower(problem):
    times = [duration(*problem, pieces=pieces) for pieces in (1, 2, 3)]
    assert times[2] <= SLOWER * times[1] and times[1] <= SLOWER * times[0]
    assert duration(*problem, pieces="auto") <= SLOWER * times[2]


@settings(max_examples=4, phases=QUICK)
@given(problems())
def test_a_path_flown_backwards_takes_as_long(problem):
    points, *rest = problem
    assert duration(points[::-1], *rest) == pytest.approx(duration(*problem), rel=1e-3)

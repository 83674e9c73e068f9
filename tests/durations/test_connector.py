"""The way back from a start outside of its limits: it starts there, ends with room, and none is much shorter."""

import numpy as np
import pytest

from minsnap import Boxes, Limits
from minsnap.durations.connector import connect_start
from minsnap.limits.compliance import kept_from

POINTS = np.array([(0.0, 0.0, 1.0), (2.0, 0.5, 1.0)])
BOX = Boxes([(-0.5, -0.5, 0.5)], [(2.5, 1.0, 1.5)])
SETS = {
    "speed, acceleration": Limits(speed=3.0, acceleration=6.0),
    "jerk": Limits(speed=3.0, acceleration=6.0, jerk=30.0),
    "thrust": Limits(speed=3.0, max_thrust=1.5, tilt=0.5, climb_speed=1.0),
}


def state(speed, acceleration):
    return np.array([POINTS[0], (speed, 0, 0), (acceleration, 0, 0), (0, 0, 0)], dtype=float)


@pytest.mark.slow
@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize(("speed", "acceleration"), [(3, 0), (3, 3), (3.1, 0), (4, 3), (2, 7), (4, -8)])
def test_it_leads_from_the_state_inside_the_limits(name, speed, acceleration):
    limits, given = SETS[name], state(speed, acceleration)
    way = connect_start(given, BOX.walls(POINTS), limits)
    for order in range(4):
        size = max(1.0, np.abs(way(way.duration, order)).max())
        assert way(0.0, order) == pytest.approx(given[order], abs=1e-8 * size)
    assert kept_from(limits, way) < way.duration
    x = way(np.linspace(0.0, way.duration, 301))
    assert (x >= BOX.lower[0]).all() and (x <= BOX.upper[0]).all()
    assert np.linalg.norm(way(way.duration, 1)) <= 0.985 * limits.speed


def test_it_takes_no_longer_than_braking_fully_does():
    """From 4 m/s to 3 m/s at 6 m/s^2, without a bound on jerk: a sixth of a second at least."""
    way = connect_start(state(4.0, 0.0), BOX.walls(POINTS), SETS["speed, acceleration"])
    limits_from = kept_from(SETS["speed, acceleration"], way)
    assert 1.0 / 6.0 < limits_from < 1.5 / 6.0


def test_limits_that_the_start_keeps_hold_on_the_way():
    way = connect_start(state(4.0, 0.0), BOX.walls(POINTS), SETS["speed, acceleration"])
    assert way.max_norm(2)[0] <= 6.0 * (1.0 + 1e-6)


def test_none_where_the_box_is_too_short():
    short = Boxes([(-0.5, -0.5, 0.5)], [(0.1, 0.5, 1.5)])
    assert connect_start(state(4.0, 0.0), short.walls(POINTS), SETS["speed, acceleration"]) is None

"""Starts and ends on or outside of their limits, beside every other option: each question has a plan."""

import numpy as np
import pytest

import minsnap
from minsnap import Ball, Gate, Limits, Search

POINTS = np.array([(0, 0, 1), (5, 0, 1), (5, 4, 1), (1, 6, 1.5)], dtype=float)
LIMITS = Limits(speed=3, acceleration=6)
STATES = {
    "a start outside": {"start": {"velocity": (3.3, 0, 0)}},
    "a start on its limit": {"start": {"velocity": (3.0, 0, 0)}},
    "an end on its limit": {"end": {"velocity": (0, 3.0, 0)}},
}
OPTIONS = {
    "free in a box": {"waypoint_tolerance": np.full(POINTS.shape, 0.2)},
    "free in a ball": {"waypoint_tolerance": Ball([0.2] * 4)},
    "a total and a box": {"waypoint_tolerance": np.full(POINTS.shape, 0.2), "total_time": 12.0},
    "a price of time": {"search": Search(time_weight=100.0)},
    "degree 9": {"degree": 9},
    "degree 11 in three pieces": {"degree": 11, "pieces": 3},
    "a body rate": {"limits": Limits(speed=3, acceleration=6, body_rate=4)},
    "a body rate and a total": {"limits": Limits(speed=3, acceleration=6, body_rate=4), "total_time": 14.0},
}


@pytest.mark.slow
@pytest.mark.parametrize("option", OPTIONS)
@pytest.mark.parametrize("state", STATES)
def test_a_state_on_or_outside_its_limits_is_planned_with_every_option(state, option):
    """All but one of these were refused, most with a number of one inner try."""
    asked = {"limits": LIMITS, "pieces": 1, **STATES[state], **OPTIONS[option]}
    path = minsnap.plan(POINTS, **asked)
    tolerance = asked.get("waypoint_tolerance", 0.0)
    held = minsnap.certify(
        path, POINTS, tolerance=tolerance, limits=asked["limits"], limits_from=path.report.limits_from
    )
    assert held.ok and path.report.limits_from < 0.5
    for name, instant in (("start", 0.0), ("end", path.duration)):
        assert path(instant, 1) == pytest.approx(asked.get(name, {}).get("velocity", (0, 0, 0)), abs=1e-9)


@pytest.mark.parametrize("ball", [False, True])
@pytest.mark.parametrize("last", [0.05, 0.2])
def test_a_lap_begins_where_both_of_its_ends_allow(ball, last):
    """Only the tolerance of the first waypoint was looked at, and one that allowed more than the last had no plan."""
    corners: list = [(0, 0, 1), Gate((4, 0, 1), (1, 0.5, 0), 0.8, crossing=1), (4, 3, 1), (0, 3, 1), (0, 0, 1)]
    widths = [0.1, 0.0, 0.1, 0.1, last]
    tolerance = Ball(widths) if ball else np.repeat(np.array(widths)[:, None], 3, axis=1)
    path = minsnap.plan(corners, durations=[2.0] * 4, closed=True, waypoint_tolerance=tolerance)
    assert minsnap.certify(path, corners, tolerance=tolerance).ok
    reach = np.linalg.norm(path(0.0) - corners[0]) if ball else np.abs(path(0.0) - corners[0]).max()
    assert reach <= min(0.1, last) + 1e-9
    assert path(0.0) == pytest.approx(path(path.duration), abs=1e-9)

"""The last look at a fleet: everything that was asked is switched off inside, one after another, and must be missed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import minsnap
from minsnap import Boxes, Cylinder, Limits
from minsnap.errors import UnprovedError
from minsnap.fleet import first_guess, fleet_planner
from minsnap.fleet.time_search import TimeSearch, flown

LIMITS, FAST = Limits(speed=1.5, acceleration=3.0), Limits(speed=2.5, acceleration=9.0)
BENT = [
    [(-2.0, 0.0, 1.0), (0.0, 0.5, 1.0), (1.0, 0.5, 1.0), (2.0, -0.5, 1.0)],
    [(2.0, -2.0, 1.0), (-2.0, -2.0, 1.0)],
]
CROSSING = [[(-2.0, 0.0, 1.0), (2.0, 0.0, 1.0)], [(0.0, -2.0, 1.0), (0.0, 2.0, 1.0)]]
BOXES = Boxes([(-9, -9, 0), (-9, -9, 0), (-9, -9, 0)], [(9, 9, 9), (9, 0.501, 9), (9, 9, 9)])
PILLAR = Cylinder((-1.0, 0.25), 0.2)
MOVED = (np.array(BENT[0]) + [(0, 0, 0), (0, 0.01, 0), (0, 0, 0), (0, 0, 0)], np.array(BENT[1]))

OFF = {
    "separation": (CROSSING, {"separation": 0.4}, {"separation": None}, r"vehicles \(0, 1\) come as near as"),
    "room": (BENT, {"room": ((-3.0, -3.0, 0.0), (3.0, 0.501, 2.0))}, {"room": None}, "vehicle 0 leaves the room by"),
    "avoid": (BENT, {"avoid": [PILLAR]}, {"avoid": ()}, "vehicle 0 is .* m inside an obstacle"),
    "limits": (BENT, {}, {"limits": (FAST, FAST)}, "vehicle [01]: speed reaches .* where 1.5 is allowed"),
    "corridors": (BENT, {"corridors": [BOXES, None]}, {"corridors": ()}, "vehicle 0: it leaves the box of leg 1"),
    "holds": (BENT, {"holds": [[0.3, 0, 0, 0], None]}, {"holds": ()}, "vehicle 0: it does not rest at waypoint 0"),
    "start": (BENT, {"start": [{"velocity": (0.3, 0, 0)}, None]}, {"states": ({}, {})}, "vehicle 0: derivative 1 at"),
    "waypoints": (BENT, {}, {"waypoints": MOVED}, "vehicle 0: it does not pass all of its waypoints"),
}


@pytest.mark.slow
@pytest.mark.parametrize("off", OFF)
def test_what_the_search_does_not_know_is_seen(monkeypatch, off):
    """The search has the question without one of its parts, and what it finds must not leave."""
    waypoints, further, changed, sentence = OFF[off]
    asked = {"waypoints": waypoints, "limits": LIMITS} | further
    minsnap.plan_fleet(**asked)

    def without(task, *rest):
        return TimeSearch(replace(task, **changed) if len(task) == 2 else task, *rest)

    monkeypatch.setattr(fleet_planner, "TimeSearch", without)
    with pytest.raises(UnprovedError, match=f"refused at the last look: {sentence}"):
        minsnap.plan_fleet(**asked)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("place", "sentence"),
    [
        ((0, 0, 0), "vehicle 0: it passes a waypoint"),
        ((-1, -1, 0), "vehicle 0: it passes a waypoint"),
        ((0, 2, 0), "vehicle 0: derivative 2 at waypoint 0"),
        ((-1, -4, 0), "vehicle 0: derivative 3 at waypoint 1"),
        ((1, 3, 0), "vehicle 0: its derivatives are continuous up to order 2"),
    ],
)
def test_every_control_point_counts(monkeypatch, place, sentence):
    def damaged(curves, time, shares):
        found = flown(curves, time, shares)
        points = found[0].control_points.copy()
        points[place] += 1e-6
        return [minsnap.Trajectory(points, found[0].durations, found[0].yaw, found[0].pieces), *found[1:]]

    monkeypatch.setattr(fleet_planner, "flown", damaged)
    with pytest.raises(UnprovedError, match=sentence):
        minsnap.plan_fleet(CROSSING, LIMITS, 0.4)


def test_lines_that_are_not_apart_are_left_to_the_search(monkeypatch):
    monkeypatch.setattr(first_guess, "line_distance", lambda *asked: SimpleNamespace(apart=True))
    fleet = minsnap.plan_fleet(CROSSING, LIMITS, 0.4)
    assert fleet.report.method == "joint"
    assert minsnap.certify_fleet(fleet, 0.4, LIMITS).ok


def test_a_heading_that_turns_too_fast_is_seen():
    limits = Limits(speed=1.5, acceleration=3.0, yaw_rate=0.5)
    assert minsnap.plan_fleet(CROSSING, limits, 0.4, yaw=lambda t: 0.3 * np.sin(t)).report.method == "joint"
    with pytest.raises(UnprovedError, match="vehicle 0: yaw_rate reaches .* where 0.5 is allowed; give more time"):
        minsnap.plan_fleet(CROSSING, limits, 0.4, yaw=lambda t: 3.0 * np.sin(t))

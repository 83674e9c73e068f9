"""The last look at replans: walls, limits, waypoints and joints are switched off inside, and nothing of it is flown."""

from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap import Boxes, Limits, Replanner
from minsnap.errors import CorridorError
from minsnap.replanning import horizon
from minsnap.replanning import replanner as replanner_module
from minsnap.replanning.horizon import LegEnd

POINTS = np.array([(0, 0, 1), (2, 0.5, 1), (4, 0, 1.2), (6, 1, 1), (8, 1, 1)], dtype=float)
LOWER, UPPER = np.minimum(POINTS[:-1], POINTS[1:]) - 0.01, np.maximum(POINTS[:-1], POINTS[1:]) + 0.01
LIMITS, FASTER = Limits(speed=3.0, acceleration=6.0), Limits(speed=4.0, acceleration=9.0)
AMPLE = {"began": 160.0}
NOW, BUDGET = 0.1, 0.2


def still():
    return 100.0


@pytest.fixture(scope="module")
def flown():
    return minsnap.plan(POINTS, limits=LIMITS, corridor=Boxes(LOWER, UPPER), pieces=1)


def replanned(flown, now=NOW, points=POINTS[1:], limits=FASTER, boxes=(LOWER, UPPER), **options):
    replanner = Replanner(limits, Boxes(*boxes), clock=still, **options)
    return replanner.replan(flown, now, points, BUDGET, **AMPLE)


def without_walls(task):
    return replace(task, walls=())


def with_a_waypoint_moved(task):
    points = task.waypoints.copy()
    points[1] += [0.0, 1e-6, 0.0]
    return replace(task, waypoints=points)


def with_another_start(task):
    first = {order: value + (1e-3 if order == 2 else 0.0) for order, value in task.pins[0].items()}
    return replace(task, pins={**task.pins, 0: first})


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (without_walls, "it leaves the box of leg"),
        (with_a_waypoint_moved, "it passes a waypoint"),
        (with_another_start, "derivative 2 at waypoint 0"),
    ],
)
def test_what_the_search_does_not_know_is_seen(flown, monkeypatch, change, sentence):
    assert not replanned(flown).kept
    solve = horizon.shortest_from
    monkeypatch.setattr(horizon, "shortest_from", lambda task, *rest, **how: solve(change(task), *rest, **how))
    kept = replanned(flown)
    assert kept.kept and kept.certified and f"refused at the last look: {sentence}" in kept.reason, kept.reason


def test_a_limit_that_the_search_does_not_know_is_seen(flown, monkeypatch):
    solve, loose = horizon.shortest_from, Limits(speed=9.0, acceleration=30.0)
    monkeypatch.setattr(
        horizon,
        "shortest_from",
        lambda task, timing, *rest, **how: solve(task, replace(timing, limits=loose), *rest, **how),
    )
    kept = replanned(flown)
    assert kept.kept and "last look: " in kept.reason and "is allowed" in kept.reason, kept.reason


@pytest.mark.parametrize(("order", "sentence"), [(1, "up to order 0"), (2, "up to order 1")])
def test_a_leg_that_is_flown_on_joins_what_follows(flown, monkeypatch, order, sentence):
    now = flown.leg_breaks[1] - BUDGET - 0.02
    assert not replanned(flown, now).kept
    before = LegEnd.before

    def apart(end, curve):
        points = curve.control_points.copy()
        points[0, order] += 1e-3
        return before(end, minsnap.Trajectory(points, curve.durations, curve.yaw, curve.pieces))

    monkeypatch.setattr(LegEnd, "before", apart)
    kept = replanned(flown, now)
    assert kept.kept and "refused at the last look" in kept.reason and sentence in kept.reason, kept.reason


def test_the_flown_legs_beyond_the_horizon_join_the_new_ones(flown, monkeypatch):
    assert not replanned(flown, horizon=2).kept
    join = replanner_module.horizon.joined_with

    def apart(curve, tail, finish):
        points = tail.control_points.copy()
        points[0, 3] += 1e-3
        return join(curve, minsnap.Trajectory(points, tail.durations, tail.yaw, tail.pieces), finish)

    monkeypatch.setattr(replanner_module.horizon, "joined_with", apart)
    kept = replanned(flown, horizon=2)
    assert kept.kept and "continuous up to order 2, and 3 was asked for" in kept.reason, kept.reason


@pytest.mark.parametrize("leg", range(4))
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", ["lower", "upper"])
def test_a_rest_that_is_kept_is_looked_at_with_every_wall_of_now(flown, monkeypatch, leg, axis, side):
    """Nothing is searched anew: the rest is certified only where it is inside of the walls of this call."""
    monkeypatch.setattr(Replanner, "_searched", lambda *call: (None, True, "off"))
    along = flown(np.linspace(max(NOW + BUDGET, flown.leg_breaks[leg]), flown.leg_breaks[leg + 1], 2001))[:, axis]
    reach, outwards = (along.min(), -1e-4) if side == "lower" else (along.max(), 1e-4)
    assert replanned(flown, boxes=moved(leg, axis, side, reach + outwards)).certified
    try:
        assert not replanned(flown, boxes=moved(leg, axis, side, reach - outwards)).certified
    except CorridorError as refused:
        assert "waypoint" in str(refused) or "start" in str(refused)


def moved(leg, axis, side, place):
    """Return the corners of all boxes with one side of one box elsewhere."""
    boxes = {"lower": LOWER.copy(), "upper": UPPER.copy()}
    boxes[side][leg, axis] = place
    return tuple(boxes.values())


@pytest.mark.parametrize("limits", [{"speed": 2.9}, {"acceleration": 5.0}, {"jerk": 10.0}, {"tilt": 0.3}], ids=str)
def test_a_rest_that_is_kept_is_looked_at_with_the_limits_of_now(flown, monkeypatch, limits):
    monkeypatch.setattr(Replanner, "_searched", lambda *call: (None, True, "off"))
    change = replanned(flown, limits=Limits(**limits))
    assert change.kept and not change.certified

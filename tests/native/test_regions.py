"""Waypoints in balls and gates in the native core: plans equal to those of the Python core, and planes that are met."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.questions import tube_question
from helpers.tasks import REFERENCE, random_legs

import minsnap
from minsnap import Ball, Gate
from minsnap.corridors.constraint import Walls
from minsnap.native import library
from minsnap.native.corridor import solve_corridor
from minsnap.native.library import using
from minsnap.native.status import Status

pytestmark = pytest.mark.skipif(library.core().library is None, reason="there is no native core")


def assert_same_plan(waypoints, tolerance=0.0, **asked):
    """Both cores plan for the same cost, and the native one's curve is certified."""
    others = {"waypoint_tolerance": tolerance} if tolerance != 0.0 else {}
    with using("python"):
        slow = minsnap.plan(waypoints, **asked, **others)
    fast = minsnap.plan(waypoints, **asked, **others)
    assert fast.report.core == "native", fast.report.handed_over
    assert fast.cost() == pytest.approx(slow.cost(), rel=1.5e-6)
    assert minsnap.certify(fast, waypoints, asked.get("corridor"), tolerance=tolerance).ok
    return fast


def drawn(seed):
    """Legs, and arguments of a plan: in a tube or a round one, or without walls, sometimes closed or in two pieces."""
    random = np.random.default_rng(seed)
    points, durations = random_legs(seed, legs=int(random.integers(2, 7)))
    asked = {"durations": durations, "pieces": int(random.choice([1, 1, 2]))}
    corridor = random.choice([None, 0.4, minsnap.RoundTube(0.4)])
    if corridor is not None:
        asked["corridor"] = corridor
    if len(durations) > 2 and random.random() < 0.3:
        points[-1] = points[0]
        asked["closed"] = True
    return random, points, asked


@pytest.mark.parametrize("seed", range(15))
def test_random_waypoints_in_balls(seed):
    random, points, asked = drawn(seed)
    assert_same_plan(points, Ball(random.uniform(0.02, 0.3)), **asked)


@pytest.mark.parametrize("seed", range(15))
def test_random_gates(seed):
    random, points, asked = drawn(seed)
    gates = [
        Gate(point, random.normal(size=3) if random.random() < 0.7 else np.eye(3)[1], *random.uniform(0.1, 0.3, 2))
        for point in points[1:-1]
    ]
    assert_same_plan([points[0], *gates, points[-1]], **asked)


@pytest.mark.parametrize("crossing", [1, -1])
def test_a_gate_is_crossed_in_its_direction(crossing):
    normal = np.array([0.2, -1.0, 0.1])
    gate = Gate(REFERENCE[1], normal, 0.5, crossing=crossing)
    fast = assert_same_plan([REFERENCE[0], gate, *REFERENCE[2:]], durations=[4.0, 2.0, 4.0, 2.0])
    assert crossing * (fast(4.0, 1) @ normal) >= 0.0


def test_the_knot_lies_in_the_plane_of_its_gate():
    gate = Gate(REFERENCE[1], (1.0, 2.0, 0.5), 1.0)
    fast = assert_same_plan([REFERENCE[0], gate, *REFERENCE[2:]], durations=[4.0, 2.0, 4.0, 2.0])
    assert abs((fast(4.0) - gate.center) @ gate.normal) <= 1e-10
    assert np.linalg.norm(fast(4.0) - gate.center) > 0.1


def test_the_best_split_through_gates():
    waypoints = [REFERENCE[0], Gate(REFERENCE[1], (1.0, 2.0, 0.5), 1.0), *REFERENCE[2:]]
    with using("python"):
        slow = minsnap.plan(waypoints, total_time=12.0)
    fast = minsnap.plan(waypoints, total_time=12.0)
    assert fast.report.core == "native"
    assert fast.cost() == pytest.approx(slow.cost(), rel=1e-4)


def test_a_fixed_knot_beside_the_plane_on_which_it_is_to_lie_is_not_an_answer():
    question = tube_question(REFERENCE, [4.0, 2.0, 4.0, 2.0], 100.0)
    numbers = REFERENCE[1:2] + 0.1, np.eye(3)[:1], np.zeros(1), np.ones(1)
    plane = Walls(np.ones(1, dtype=np.int64), np.zeros((1, 0, 3)), *numbers, at=np.zeros(1, dtype=np.int64), equal=True)
    assert solve_corridor(replace(question, walls=[plane.record])).status is not Status.DONE
    met = replace(plane, anchor=REFERENCE[1:2].copy())
    assert solve_corridor(replace(question, walls=[met.record])).status is Status.DONE


def test_waypoints_of_which_none_is_fixed_may_move_together():
    """The curve keeps the tolerances and its cost does not depend on where it lies."""
    asked = {"durations": [4.0, 2.0, 4.0, 2.0], "waypoint_tolerance": Ball(np.full(5, 0.1))}
    traj, away = minsnap.plan(REFERENCE, **asked), minsnap.plan(REFERENCE + 7.0, **asked)
    assert traj.report.core == "native"
    assert away.cost() == pytest.approx(traj.cost(), rel=1e-6)
    assert np.linalg.norm(traj(traj.leg_breaks) - REFERENCE, axis=1).max() <= 0.1

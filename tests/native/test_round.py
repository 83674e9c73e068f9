"""Round walls in the native core: plans equal to those of the Python core, their proof, and malformed requests."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.tasks import REFERENCE, many_legs, random_legs, task_of
from native_questions import walls_kept

import minsnap
from minsnap import RoundTube
from minsnap.corridors.constraint import Walls
from minsnap.corridors.margins import margin_holds
from minsnap.native import library
from minsnap.native.corridor import solve_corridor
from minsnap.native.library import using
from minsnap.native.status import Status
from minsnap.optimisation.native_solve import corridor_question

DURATIONS = np.array([4.0, 2.0, 4.0, 2.0])

pytestmark = pytest.mark.skipif(library.core().library is None, reason="there is no native core")


def both_plans(points, **asked):
    """The plans of the native and of the Python core."""
    with using("python"):
        slow = minsnap.plan(points, **asked)
    fast = minsnap.plan(points, **asked)
    assert fast.report.core == "native", fast.report.handed_over
    return fast, slow


def assert_same_cost(fast, slow):
    assert fast.cost() == pytest.approx(slow.cost(), rel=1.5e-6)


@pytest.mark.parametrize("radius", [1.0, 0.3, 0.01, 1e-4])
def test_the_rectangle_in_round_tubes(radius):
    fast, slow = both_plans(REFERENCE, durations=DURATIONS, corridor=RoundTube(radius))
    assert_same_cost(fast, slow)
    assert minsnap.certify(fast, REFERENCE, RoundTube(radius)).ok


@pytest.mark.parametrize("seed", range(30))
def test_random_legs_in_round_tubes(seed):
    random = np.random.default_rng(seed)
    points, durations = random_legs(seed, legs=int(random.integers(1, 9)), dim=int(random.integers(2, 4)))
    tube = RoundTube(10.0 ** random.uniform(-2.0, 0.0, len(durations)))
    asked = {"degree": int(random.choice([5, 7])), "pieces": int(random.choice([1, 1, 2]))}
    if len(durations) > 2 and random.random() < 0.3:
        points[-1] = points[0]
        asked["closed"] = True
    fast, slow = both_plans(points, durations=durations, corridor=tube, **asked)
    assert_same_cost(fast, slow)
    assert minsnap.certify(fast, points, tube).ok


def test_many_legs_in_round_tubes_are_solved_in_windows():
    points, durations, radii = many_legs(60)
    fast, slow = both_plans(points, durations=durations, corridor=RoundTube(radii))
    assert_same_cost(fast, slow)
    assert minsnap.certify(fast, points, RoundTube(radii)).ok


def test_round_and_flat_walls_together():
    room = minsnap.Room((-0.5, -0.2, 0.5), (8.2, 4.5, 1.5))
    fast, slow = both_plans(REFERENCE, durations=DURATIONS, corridor=[RoundTube(0.3), room])
    assert_same_cost(fast, slow)
    assert minsnap.certify(fast, REFERENCE, [RoundTube(0.3), room]).ok


def test_the_bound_is_within_the_gap_and_below_the_cost_of_every_curve_inside():
    answers = []
    for radius in (0.2999, 0.3):
        task = task_of(REFERENCE, RoundTube(radius))
        answers.append(solve_corridor(corridor_question(task, DURATIONS, task.units(DURATIONS))))
    tight, wide = answers
    assert wide.bound < tight.bound < tight.cost
    assert 0.0 <= wide.cost - wide.bound <= 1e-6 * wide.cost


def test_the_best_split_in_a_round_tube():
    fast, slow = both_plans(REFERENCE, total_time=12.0, corridor=RoundTube(0.3))
    assert fast.cost() == pytest.approx(slow.cost(), rel=1e-4)
    assert np.diff(fast.leg_breaks) == pytest.approx(np.diff(slow.leg_breaks), rel=1e-2)


@pytest.mark.parametrize("seed", range(5))
def test_the_proof_of_a_ball_is_true_in_exact_numbers(seed):
    points, durations = random_legs(seed, legs=3)
    curve = minsnap.plan(points, durations=durations)
    wall = RoundTube(1.0).walls(points)[0]
    offset = curve(np.linspace(curve.breaks[0], curve.breaks[1], 100_001)) - points[0]
    reach = np.linalg.norm(offset @ wall.matrix[0].T, axis=1).max()
    for share, inside in ((1.0 - 1e-6, False), (1.0 + 1e-6, True)):
        walls = Walls.balls([0], wall.matrix[:1], points[:1], [reach * share])
        assert walls_kept(curve.control_points, curve.durations, walls).tolist() == [inside]
        exact = RoundTube(np.array([reach * share, 100.0, 100.0])).walls(points)[0]
        assert margin_holds(curve, exact, 0.0) is inside


def test_malformed_balls_have_a_status():
    task = task_of(REFERENCE, RoundTube(0.3))
    question = corridor_question(task, DURATIONS, task.units(DURATIONS))
    (walls,) = task.walls
    for wrong, status in (
        (walls.record.changed(rows=4), Status.BAD_SIZE),
        (replace(walls, radius=-walls.radius).record, Status.BAD_NUMBER),
        (replace(walls, matrix=walls.matrix * np.nan).record, Status.BAD_NUMBER),
    ):
        assert solve_corridor(replace(question, walls=[wrong])).status is status

"""Walls in the native core, of the tilt and of a corridor: plans equal to those of the Python core, and their proof."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.tasks import REFERENCE, many_legs, random_legs
from native_questions import walls_kept

import minsnap
from minsnap import Limits
from minsnap.basics.arrays import GRAVITY
from minsnap.corridors.constraint import Walls
from minsnap.corridors.margins import margin_holds
from minsnap.native import library
from minsnap.native.library import using

pytestmark = pytest.mark.skipif(library.core().library is None, reason="there is no native core")


class Funnels:
    """Round corridors along the legs that widen, or narrow where ``growth`` is negative, in flight direction."""

    def __init__(self, radius, growth):
        self.radius, self.growth = radius, growth

    def walls(self, waypoints):
        steps = np.diff(waypoints, axis=0)
        along = steps / np.linalg.norm(steps, axis=1)[:, None]
        across = np.eye(waypoints.shape[1]) - along[:, :, None] * along[:, None, :]
        middle, legs = (waypoints[1:] + waypoints[:-1]) / 2.0, len(steps)
        return [Walls.balls(np.arange(legs), across, middle, np.full(legs, self.radius), slope=self.growth * along)]


def both_plans(points, **asked):
    """The plans of the native and of the Python core, both proved to keep what was asked, at the same cost."""
    with using("python"):
        slow = minsnap.plan(points, **asked)
    fast = minsnap.plan(points, **asked)
    assert fast.report.core == "native", fast.report.handed_over
    assert fast.cost() == pytest.approx(slow.cost(), rel=1.5e-6)
    assert minsnap.certify(fast, points, asked.get("corridor"), limits=asked.get("limits")).ok
    return fast


def tilt(curve):
    """The largest angle of the thrust to the vertical at many instants."""
    thrust = curve(np.linspace(0.0, curve.duration, 2001), 2) + (0.0, 0.0, GRAVITY)
    return np.arctan2(np.linalg.norm(thrust[:, :2], axis=1), thrust[:, 2]).max()


@pytest.mark.parametrize("seed", range(30))
def test_a_limit_of_the_tilt_that_binds(seed):
    random = np.random.default_rng(seed)
    points, durations = random_legs(seed, legs=int(random.integers(2, 8)))
    asked = {
        "durations": durations,
        "degree": int(random.choice([5, 7, 9, 11])),
        "pieces": int(random.choice([1, 1, 2])),
    }
    if random.random() < 0.5:
        asked["corridor"] = 10.0 ** random.uniform(-1.0, 0.0)
    if len(points) > 3 and random.random() < 0.3:
        points[-1], asked["closed"] = points[0], True
    limit = 0.98 * min(tilt(minsnap.plan(points, **asked)), 1.4)
    fast = both_plans(points, limits=Limits(tilt=limit), **asked)
    assert tilt(fast) == pytest.approx(limit, rel=1e-3)


@pytest.mark.parametrize("growth", [0.02, -0.05, 0.1])
@pytest.mark.parametrize("seed", range(8))
def test_corridors_that_widen_or_narrow(seed, growth):
    points, durations = random_legs(seed, dim=2 + seed % 2)
    both_plans(points, durations=durations, corridor=Funnels(0.3, growth))


def test_the_best_split_in_corridors_that_widen():
    fast = minsnap.plan(REFERENCE, total_time=12.0, corridor=Funnels(0.3, 0.04))
    with using("python"):
        slow = minsnap.plan(REFERENCE, total_time=12.0, corridor=Funnels(0.3, 0.04))
    assert fast.report.core == "native"
    assert fast.cost() == pytest.approx(slow.cost(), rel=1e-4)
    assert np.diff(fast.leg_breaks) == pytest.approx(np.diff(slow.leg_breaks), rel=1e-2)


def test_many_legs_within_a_tilt_are_solved_in_windows():
    points, durations, widths = many_legs(60, seed=3)
    asked = {"durations": durations, "corridor": widths}
    both_plans(points, limits=Limits(tilt=0.9 * tilt(minsnap.plan(points, **asked))), **asked)


def test_walls_around_cones_and_planes_together():
    walls = [Funnels(0.3, 0.02), minsnap.Room((-0.5, -0.2, 0.5), (8.2, 4.5, 1.5))]
    asked = {"durations": (4.0, 2.0, 4.0, 2.0), "corridor": walls}
    both_plans(REFERENCE, limits=Limits(tilt=0.95 * tilt(minsnap.plan(REFERENCE, **asked))), **asked)


@pytest.mark.parametrize("seed", range(5))
def test_the_proof_of_a_cone_is_true_in_exact_numbers(seed):
    points, durations = random_legs(seed, legs=3)
    curve = minsnap.plan(points, durations=durations)
    cone = Funnels(1.0, 0.1).walls(points)[0]
    offset = curve(np.linspace(curve.breaks[0], curve.breaks[1], 100_001)) - cone.anchor[0]
    reach = (np.linalg.norm(offset @ cone.matrix[0].T, axis=1) - offset @ cone.slope[0]).max()
    for share, inside in ((1.0 - 1e-6, False), (1.0 + 1e-6, True)):
        radius = np.array([reach * share])
        assert kept(curve, cone, radius) is inside
        exact = Walls.balls([0], cone.matrix[:1], cone.anchor[:1], radius, slope=cone.slope[:1])
        assert margin_holds(curve, exact, 0.0) is inside


def test_a_curve_in_the_opposite_half_of_a_cone_is_outside():
    line = minsnap.plan([(-3.0, 0.0), (-2.0, 0.0)], durations=[1.0])
    cone = Walls.balls([0], [[[0.0, 1.0]]], [[0.0, 0.0]], [1.0], slope=[[1.0, 0.0]])
    assert not kept(line, cone, np.array([1.0]))
    assert kept(line, cone, np.array([3.1]))


def kept(curve, cone, radius):
    """Whether the native core proves that a curve's first piece is in the first of some cones, of another radius."""
    first = replace(cone.chosen(np.array([0])), leg=np.zeros(1, dtype=np.int64), radius=radius)
    return bool(walls_kept(curve.control_points, curve.durations, first)[0])

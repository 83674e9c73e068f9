"""Waypoints and pins outside what their legs must stay in are found before any solve."""

from contextlib import contextmanager
from unittest import mock

import numpy as np
import pytest

import minsnap
from minsnap import Boxes, HalfSpaces, Polytopes, RoundTube
from minsnap.corridors.constraint import Walls
from minsnap.corridors.precheck import _box_to_ball, _distance, _planes_at
from minsnap.errors import CorridorError, WaypointError

UNIT = Boxes([(0, 0)] * 2, [(1, 1)] * 2)
DIAMOND = Polytopes([(np.array([[1, 1], [1, -1], [-1, 1], [-1, -1.0]]), np.ones(4))] * 2)


class SpeedBox:
    def __init__(self, size):
        self.size = size

    def walls(self, waypoints):
        leg, axes = np.arange(len(waypoints) - 1), waypoints.shape[1]
        normal, leg = np.tile(np.eye(axes), (len(leg), 1)), np.repeat(leg, axes)
        bound = np.broadcast_to(self.size, len(waypoints) - 1)[leg]
        return [Walls.planes(leg, normal, 0 * normal, -bound, bound, bound, order=1, name="speed limit")]


class Ball:
    def walls(self, waypoints):
        legs, dim = len(waypoints) - 1, waypoints.shape[1]
        identity = np.broadcast_to(np.eye(dim), (legs, dim, dim))
        return [Walls.balls(np.arange(legs), identity, np.zeros((legs, dim)), np.ones(legs), name="ball")]


@contextmanager
def refused(error, match):
    """Expect a refusal, and no solve before it."""
    solved = AssertionError("solved before it was refused")
    with (
        mock.patch("minsnap.durations.allocate.plan_timed", side_effect=solved),
        pytest.raises(error, match=match) as caught,
    ):
        yield caught


def test_refusals_are_told_from_plans_that_would_be_solved():
    with pytest.raises(AssertionError, match="solved before"), refused(CorridorError, "outside"):
        minsnap.plan([(0.5, 0.5), (0.2, 0.2), (1, 0.5)], [1, 1], corridor=UNIT)


def test_pinned_waypoint_outside_its_box_is_refused_with_leg_and_distance():
    with refused(CorridorError, r"waypoint 2 at \(1, 2.5\) is 1.5 m outside the box of leg 1") as caught:
        minsnap.plan([(0.5, 0.5), (0.2, 0.2), (1, 2.5)], [1, 1], corridor=UNIT)
    assert caught.value.waypoint == 2 and caught.value.leg == 1


def test_waypoint_on_a_wall_that_rounding_puts_outside_is_refused_in_words():
    with refused(CorridorError, r"waypoint 1 at \(4.5, 0\) lies on the half-space of leg 0, and rounding"):
        minsnap.plan([(0, 0), (4.5, 0)], [1], corridor=HalfSpaces((1, 3), 4.5))


def test_waypoint_box_that_does_not_meet_the_corridor_is_refused():
    with refused(CorridorError, "box around waypoint 1 at .* is 1.3 m outside the box of leg"):
        minsnap.plan([(0.5, 0.5), (1, 2.5), (0, 0)], [1, 1], corridor=UNIT, waypoint_tolerance=0.2)


def test_waypoint_box_that_meets_the_corridor_serves():
    points = [(0.5, 0.5), (1, 1.1), (0.1, 0.1)]
    traj = minsnap.plan(points, [1, 1], corridor=UNIT, waypoint_tolerance=0.2)
    assert minsnap.certify(traj, points, UNIT, tolerance=0.2).ok


def test_waypoint_box_that_meets_each_plane_but_not_all_together_is_refused():
    wedge = Polytopes([(np.array([[1.0, 3], [-1, 3], [0, -1]]), np.array([0.0, 0.0, 3.0]))] * 2)
    points = [(0, -1), (0, 0.15), (0, -1)]
    with refused(CorridorError, "waypoint 1 at .* has no point inside the polytope of its legs"):
        minsnap.plan(points, [1, 1], corridor=wedge, waypoint_tolerance=0.12)
    assert minsnap.plan(points, [1, 1], corridor=wedge, waypoint_tolerance=0.2).report.corridor_margin >= 0.0


def test_waypoint_box_beside_the_corner_of_a_diamond():
    with refused(CorridorError, "waypoint 1 at .* outside the polytope"):
        minsnap.plan([(0, 0), (0.8, 0.8), (0, 0)], [1, 1], corridor=DIAMOND, waypoint_tolerance=0.25)
    traj = minsnap.plan([(0, 0), (0.8, 0.8), (0, 0)], [1, 1], corridor=DIAMOND, waypoint_tolerance=0.35)
    assert traj.report.corridor_margin >= 0.0


def test_waypoint_box_outside_a_ball_is_refused_by_its_nearest_corner():
    far = np.sqrt(2 * 0.8**2) - 1.0
    with refused(CorridorError, f"is {far:.3g} m outside the ball"):
        minsnap.plan([(0, 0), (1, 1), (0, 0.1)], [1, 1], corridor=Ball(), waypoint_tolerance=0.2)


def test_waypoint_box_that_meets_a_ball_serves():
    traj = minsnap.plan([(0, 0), (1, 1), (0, 0.1)], [1, 1], corridor=Ball(), waypoint_tolerance=0.31)
    assert np.linalg.norm(traj(1.0)) <= 1.0


def test_round_tubes_hold_their_own_waypoints():
    points = [(0, 0, 0), (1, 1e3, 0), (1e-3, 0, 5)]
    assert minsnap.plan(points, [9, 9], corridor=RoundTube(1e-2)).report.corridor_margin >= 0.0


def test_velocity_pinned_beyond_a_limit_is_refused():
    points = [(0, 0), (1, 1), (2, 0)]
    with refused(WaypointError, "the velocity pinned at waypoint 1 is 0.5 outside the speed limit of leg 0"):
        minsnap.plan(points, [1, 1], corridor=SpeedBox(1.0), pins={1: {"velocity": (1.5, 0.0)}})


def test_rest_outside_a_wall_on_the_velocity_is_refused():
    with refused(WaypointError, "the velocity of rest at waypoint 0 is 0.5 outside the half-space of leg 0"):
        minsnap.plan([(0, 0), (1, 1)], total_time=1.0, corridor=HalfSpaces((1.0, 0.0), -0.5, order=1))


def test_velocity_pinned_within_a_limit_serves():
    points = [(0, 0), (1, 1), (2, 0)]
    traj = minsnap.plan(points, [3, 3], corridor=SpeedBox(1.0), pins={1: {"velocity": (0.5, 0.0)}})
    assert traj(3.0, 1) == pytest.approx([0.5, 0.0]) and traj.max_norm(1)[0] <= np.sqrt(2.0)


def test_a_velocity_is_judged_by_the_legs_beside_its_waypoint():
    points = [(0, 0), (1, 1), (4, 1), (6, 1)]
    traj = minsnap.plan(points, [3, 3, 3], corridor=SpeedBox([0.6, 2.0, 2.0]), pins={2: {"velocity": (1.0, 0.0)}})
    assert traj(6.0, 1) == pytest.approx([1.0, 0.0])


def test_pins_of_other_derivatives_are_passed_over():
    pins = {1: {"acceleration": (0.1, 0.0)}, 2: {"velocity": (1.5, 0.0)}}
    with refused(WaypointError, "the velocity pinned at waypoint 2"):
        minsnap.plan([(0, 0), (1, 1), (2, 0), (3, 0)], [1, 1, 1], corridor=SpeedBox(1.0), pins=pins)


class Cone:
    """|x| at most (1 + y) / 2."""

    def walls(self, waypoints):
        legs = len(waypoints) - 1
        matrix, slope = np.tile([[1.0, 0.0]], (legs, 1, 1)), np.tile((0.0, 0.5), (legs, 1))
        return [Walls.balls(np.arange(legs), matrix, np.zeros((legs, 2)), np.full(legs, 0.5), slope=slope)]


@pytest.mark.parametrize(
    ("wall", "points"),
    ((HalfSpaces((1, 0), -1.0), [(-2, 0), (-0.9, 0), (-2, 1)]), (Cone(), [(0, 1), (1.1, 1), (0, 2)])),
)
def test_a_box_that_reaches_into_a_half_space_or_a_cone_serves(wall, points):
    assert minsnap.plan(points, [1, 1], corridor=wall, waypoint_tolerance=0.2).report.corridor_margin >= 0.0


@pytest.mark.parametrize("seed", range(5))
def test_the_nearest_point_of_a_box_to_a_ball_is_its_middle_clipped(seed):
    random = np.random.default_rng(seed)
    middle, low, size = random.normal(size=(3, 3)) * [[3.0], [1.0], [1.0]]
    high = low + np.abs(size) * (random.random(3) > 0.3)
    ball = Walls.balls([0], np.eye(3)[None], middle[None], [0.5])
    expected = np.linalg.norm(np.clip(middle, low, high) - middle) - 0.5
    assert _box_to_ball(ball, 0, low, high) == pytest.approx(expected, abs=1e-9)


def test_a_box_flat_in_one_coordinate_is_near_a_slanted_ellipse():
    matrix, middle = np.array([[1.0, 0.7], [0.0, 2.0]]), np.array([0.4, -0.3])
    ellipse = Walls.balls([0], matrix[None], middle[None], [0.5])
    line = np.stack((np.full(100_001, 1.5), np.linspace(-2.0, 2.0, 100_001)), axis=1)
    expected = np.linalg.norm((line - middle) @ matrix.T, axis=1).min() - 0.5
    assert _box_to_ball(ellipse, 0, line[0], line[-1]) == pytest.approx(expected, abs=1e-8)


def test_planes_of_a_leg_hold_where_their_slack_is_positive():
    random = np.random.default_rng(0)
    normal, anchor, points = random.normal(size=(3, 2)), random.normal(size=(3, 2)), random.normal(size=(50, 2)) * 3.0
    walls = Walls.planes([0, 1, 1], normal, anchor, [-1.0, -0.5, -2.0], [1.0, 0.7, np.inf], np.ones(3))
    for leg in (0, 1):
        normals, bounds = _planes_at([walls], (leg,), 2)
        slack = walls.slack(points[None])[walls.leg == leg]
        assert bounds[:, None] - normals @ points.T == pytest.approx(slack, abs=1e-12)


def test_ends_and_overlaps_outside_the_room_are_refused_by_name():
    pair = Boxes([(0, 0), (2, 0)], [(3, 1), (5, 1)])
    ends = {"start": {"position": (0.5, 0.5)}, "end": {"position": (4.5, 0.5)}}
    with refused(CorridorError, r"the position of end, \(4.5, 0.5\), is 1.5 m outside the room of leg 1"):
        minsnap.plan(None, [1, 1], corridor=[pair, minsnap.Room((0, 0), (3, 1))], **ends)
    with refused(CorridorError, r"the overlap that leg 1 starts in, around .* outside the half-space"):
        minsnap.plan(None, [1, 1], corridor=[pair, HalfSpaces((1, 0), 1.5, legs=(0,))], **ends)


@pytest.mark.parametrize(("excess", "words"), ((1.8e-12, "lies on .* rounding"), (2.2e-12, "is 2.2e-12 m outside")))
def test_rounding_is_a_trillionth_of_a_metre_and_of_the_coordinate(excess, words):
    with refused(CorridorError, words):
        minsnap.plan([(0, 0), (1, 0)], [1], corridor=HalfSpaces((1, 0), 1.0 - excess))


@pytest.mark.parametrize(("metres", "found"), ((0.9e6, 0.9e6), (1.1e6, np.inf)))
def test_a_set_more_than_a_thousand_kilometres_away_counts_as_empty(metres, found):
    assert _distance(np.array([[-1.0, 0.0]]), np.array([-metres])) == pytest.approx(found, rel=1e-3)


@pytest.mark.parametrize("seed", range(3))
def test_the_distance_to_a_half_space_is_that_along_its_normal(seed):
    normal = np.random.default_rng(seed).normal(size=3)
    assert _distance(normal[None], np.array([-2.0])) == pytest.approx(2.0 / np.linalg.norm(normal), rel=1e-9)
    assert _distance(np.zeros((0, 3)), np.zeros(0)) == 0.0


class BallOfLeg:
    """Leg so-and-so inside a ball of 1 m around the origin."""

    def __init__(self, leg):
        self.leg = leg

    def walls(self, waypoints):
        return [Walls.balls([self.leg], np.eye(2)[None], np.zeros((1, 2)), np.ones(1), name="ball")]


@pytest.mark.parametrize("leg", (0, 1))
@pytest.mark.parametrize(("tolerance", "excess"), (((0.5, 0.0), 0.5), ((0.0, 0.5), 1.0), ((0.75, 0.75), 0.25)))
def test_a_waypoint_box_outside_the_ball_before_or_after_it_is_refused(leg, tolerance, excess):
    points, widths = [(0, 0), (2, 0), (0, 0), (0, 0.5)], np.zeros((4, 2))
    widths[1] = tolerance
    with refused(CorridorError, f"box around waypoint 1 at .* is {excess:g} m outside the ball of leg {leg}"):
        minsnap.plan(points, [1, 1, 1], corridor=BallOfLeg(leg), waypoint_tolerance=widths)
    minsnap.plan(points, [1, 1, 1], corridor=BallOfLeg(2), waypoint_tolerance=widths)


@pytest.mark.parametrize("closed", (False, True))
def test_a_gate_first_and_last_is_crossed_into_the_corridor(closed):
    """The corridor of the first leg lies at x > 0, that of the last one at x < 0."""
    boxes = Boxes([(0, -1), (0, -1), (-4, -1), (-4, -1)], [(4, 4), (4, 4), (4, 4), (0, 4)])
    inner = [(2, 0), (2, 3), (-2, 3)]
    for crossing in (1, -1):
        gate = minsnap.Gate((0, 0), (1, 0), 1.0, crossing=crossing)
        if crossing == 1:
            minsnap.plan([gate, *inner, gate], [2] * 4, corridor=boxes, closed=closed)
            continue
        with refused(CorridorError, "leg 0's corridor lies behind it"):
            minsnap.plan([gate, *inner, gate], [2] * 4, corridor=boxes, closed=closed)


@pytest.mark.parametrize("closed", (False, True))
def test_a_gate_first_and_last_is_crossed_out_of_the_corridor(closed):
    """Both corridors lie at x > 0."""
    boxes = Boxes([(0, -1), (0, -1), (0, -1)], [(4, 4), (4, 4), (4, 4)])
    gate = minsnap.Gate((0, 0), (1, 0), 1.0, crossing=1)
    with refused(CorridorError, "leg 2's corridor lies beyond it"):
        minsnap.plan([gate, (2, 0), (2, 3), gate], [2] * 3, corridor=boxes, closed=closed)

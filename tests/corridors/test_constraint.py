"""Walls as polynomials of a trajectory, against plain evaluation; and a constraint of a user's own."""

from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap.cli.app import exit_status
from minsnap.corridors.constraint import Walls, leg_scales
from minsnap.errors import CorridorError, InfeasibleError
from minsnap.trajectory.trajectory import Trajectory

RANDOM = np.random.default_rng(0)


def random_trajectory(pieces=1):
    return Trajectory(RANDOM.normal(size=(3 * pieces, 8, 3)), RANDOM.uniform(0.5, 2.0, 3 * pieces), pieces=pieces)


def on_piece(traj, piece, order, s):
    t = traj.breaks[piece] + s * traj.durations[piece]
    return traj(np.clip(t, traj.breaks[piece], np.nextafter(traj.breaks[piece + 1], 0.0)), order)


@pytest.mark.parametrize("pieces", (1, 2))
@pytest.mark.parametrize("order", (0, 1, 2))
def test_faces_are_distances_to_planes(order, pieces):
    traj = random_trajectory(pieces)
    leg = np.array([0, 2, 2])
    normal, anchor = RANDOM.normal(size=(2, 3, 3))
    lower, upper = np.array([-1.0, -np.inf, 0.5]), np.array([np.inf, 2.0, 3.0])
    faces = Walls.planes(leg, normal, anchor, lower, upper, np.ones(3), order)
    planes = faces
    outside, row, piece = planes.excess(traj)
    sides = [(1, upper[1], 1.0), (2, upper[2], 1.0), (0, lower[0], -1.0), (2, lower[2], -1.0)]
    assert len(row) == 4 * pieces and (outside.errors <= 1e-12 * np.abs(outside.points).max()).all()
    s = np.linspace(0.01, 0.99, 7)
    found = Trajectory(outside.points[:, :, None], np.ones(len(row)))
    for number, (r, p) in enumerate(zip(row, piece, strict=True)):
        wall, bound, sign = sides[r]
        assert p // pieces == leg[wall] == planes.leg[r]
        value = on_piece(traj, p, order, s)
        beyond = sign * ((value - anchor[wall]) @ normal[wall] - bound)
        assert found(number + s)[:, 0] == pytest.approx(beyond, abs=1e-9 * (1.0 + np.abs(beyond).max()))
        assert planes.slack(value[None])[r] == pytest.approx(-beyond, abs=1e-12 * (1.0 + np.abs(beyond).max()))


@pytest.mark.parametrize("slope", (None, [(0.0, 0.0, 0.5), (0.1, -0.2, 0.0)]))
@pytest.mark.parametrize("order", (0, 1))
def test_balls_and_cones_are_differences_of_squares(order, slope):
    traj = random_trajectory()
    matrix, anchor = RANDOM.normal(size=(2, 2, 3)), RANDOM.normal(size=(2, 3))
    balls = Walls.balls([0, 1], matrix, anchor, [0.5, 2.0], order, slope=slope)
    excess, row, piece = balls.excess(traj)
    s = np.linspace(0.01, 0.99, 7)
    found = Trajectory(excess.points[:, :, None], np.ones(len(row)))
    for number, (r, p) in enumerate(zip(row, piece, strict=True)):
        offset = on_piece(traj, p, order, s) - anchor[r]
        reach = balls.radius[r] + (offset @ np.array(slope[r]) if slope else 0.0)
        expected = ((offset @ matrix[r].T) ** 2).sum(axis=1) - reach**2
        assert found(number + s)[:, 0] == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


ONE_WALL = {
    "leg": [0],
    "normal": [[0.0, 0.0, 1.0]],
    "anchor": [[0.0, 0.0, 0.0]],
    "lower": [0.0],
    "upper": [2.0],
    "width": [1.0],
}


class OwnConstraint:
    """Return what a mapping of arguments makes of ``Walls.planes``, or anything else."""

    def __init__(self, walls):
        self.walls = lambda waypoints: [Walls.planes(**walls)] if isinstance(walls, dict) else walls


@pytest.mark.parametrize(
    ("walls", "sentence"),
    (
        (ONE_WALL | {"leg": [2]}, "walls on leg 2: the legs are 0 to 1"),
        (ONE_WALL | {"leg": [-1]}, "walls on leg -1: the legs are 0 to 1"),
        (ONE_WALL | {"leg": [0.5]}, "the leg of a wall of the corridor is not a whole number"),
        (ONE_WALL | {"normal": [[0.0, 1.0]], "anchor": [[0.0, 0.0]]}, "walls of 2 dimensions, the waypoints have 3"),
        (ONE_WALL | {"anchor": [[0.0, 0.0]]}, "the anchor of the walls of the corridor has a shape that does not fit"),
        (ONE_WALL | {"normal": [0.0, 0.0, 1.0]}, "the normal of the walls .* has a shape that does not fit"),
        (ONE_WALL | {"leg": [0, 1]}, "the normal of the walls .* has a shape that does not fit"),
        (ONE_WALL | {"upper": 2.0}, "the upper of the walls .* has a shape that does not fit"),
        (ONE_WALL | {"width": [0.0]}, "the width of a wall of the corridor is not positive"),
        (ONE_WALL | {"order": -1}, "the order of the walls of the corridor must be a whole number from 0 to 11"),
        (ONE_WALL | {"order": 1.5}, "the order of the walls of the corridor must be a whole number"),
        ([replace(Walls.planes(**ONE_WALL), width=np.zeros(2))], "the width of a wall of the corridor is not positive"),
        (None, r"OwnConstraint.walls\(\) must return a list of .*Walls"),
        ([np.zeros(3)], r"OwnConstraint.walls\(\) must return a list of .*Walls"),
    ),
)
@pytest.mark.parametrize("timed", ({"durations": [3.0, 3.0]}, {"limits": minsnap.Limits(speed=3.0)}))
def test_walls_of_a_users_own_that_do_not_fit_are_refused(walls, sentence, timed):
    with pytest.raises(CorridorError, match=sentence):
        minsnap.plan([(0, 0, 1), (4, 0, 1), (4, 4, 1)], corridor=OwnConstraint(walls), **timed)


def test_what_is_not_a_number_is_refused():
    with pytest.raises(CorridorError, match="the lower of a wall of the fence is not a number"):
        Walls.planes([0], [[1.0, 0.0]], [[0.0, 0.0]], [np.nan], [1.0], [1.0], name="fence")
    with pytest.raises(CorridorError, match="the radius of a wall of the corridor is not a number"):
        Walls.balls([0], np.eye(2)[None], [[0.0, 0.0]], [np.nan])


def test_walls_cannot_be_changed():
    upper = np.array([1.0])
    faces = Walls.planes([0], [[1.0, 0.0]], [[0.0, 0.0]], [-1.0], upper, [1.0])
    upper[0] = 5.0
    assert faces.radius[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        faces.radius[0] = 5.0


class SlowCorner:
    """No coordinate of the velocity exceeds a bound on any leg: a constraint of a user's own."""

    def __init__(self, speed):
        self.speed = speed

    def walls(self, waypoints):
        legs, dim = len(waypoints) - 1, waypoints.shape[1]
        leg, normal = np.repeat(np.arange(legs), dim), np.tile(np.eye(dim), (legs, 1))
        bound = np.full(legs * dim, self.speed)
        return [Walls.planes(leg, normal, np.zeros(normal.shape), -bound, bound, bound, order=1, name="speed")]


def test_a_bound_on_a_derivative_holds_at_every_instant():
    points, durations = [(0, 0), (4, 0), (4, 3)], [3.0, 3.0]
    free = minsnap.plan(points, durations)
    slow = minsnap.plan(points, durations, corridor=SlowCorner(2.0))
    assert np.abs(free.derivative().control_points).max() > 2.0
    assert max(max(map(abs, slow.extent(axis, 1))) for axis in np.eye(2)) <= 2.0
    assert minsnap.certify(slow, points, SlowCorner(2.0)).ok
    assert not minsnap.certify(free, points, SlowCorner(2.0)).ok
    assert slow.cost() > free.cost()


def test_constraints_of_several_kinds_hold_together():
    points, durations = [(0, 0), (4, 0), (4, 3)], [3.0, 3.0]
    asked = [minsnap.Tube(0.2), SlowCorner(2.2)]
    traj = minsnap.plan(points, durations, corridor=asked)
    for one in (asked, *asked):
        assert minsnap.certify(traj, points, one).ok
    assert traj.cost() >= max(minsnap.plan(points, durations, corridor=one).cost() for one in asked) * (1 - 2e-6)


def test_bounds_on_a_derivative_that_cannot_hold_are_refused_in_a_sentence():
    with pytest.raises(minsnap.MinsnapError) as caught:
        minsnap.plan([(0, 0), (4, 0)], [1.0], corridor=SlowCorner(3.9))
    assert exit_status(caught.value) == 1


def test_the_scale_of_a_leg_without_length_is_that_of_the_others():
    assert leg_scales(np.array([(0.0, 0.0), (3.0, 4.0), (3.0, 4.0), (3.0, 8.0)])).tolist() == [5.0, 3.0, 4.0]
    assert leg_scales(np.zeros((2, 2))).tolist() == [1.0]
    assert leg_scales(np.array([0.0, 2.0, 2.0 + 1e-15])[:, None]) == pytest.approx([2.0, 1.0])


@pytest.mark.parametrize("order", (0, 1))
def test_walls_in_their_widths_have_the_same_slack_from_any_origin(order):
    """A derivative is not measured from an origin."""
    random = np.random.default_rng(1)
    matrix, anchor, slope = random.normal(size=(2, 2, 3)), random.normal(size=(2, 3)), random.normal(size=(2, 3)) / 4.0
    origin, row = random.normal(size=3), np.array([1, 0])
    values = random.normal(size=(10, 3))
    faces = Walls.planes([0, 1], anchor, 2.0 * slope, [-np.inf, -np.inf], [1.5, 2.0], [0.5, 3.0], order)
    for walls in (Walls.balls([0, 1], matrix, anchor, [0.5, 2.0], order, slope=slope), faces):
        seen = walls.chosen(row).from_origin(origin)
        excess = seen.excess_at(values - (origin if order == 0 else 0.0))
        assert -excess.T == pytest.approx(walls.slack(values[None])[row] / walls.width[row, None], abs=1e-12)


def test_walls_of_a_constraint_are_no_equations():
    class Level:
        def walls(self, waypoints):
            plane = Walls.planes([0], [(0.0, 0.0, 0.0)], [(0.0, 0.0, 1.0)], [-1.0], [1.0], [1.0], 1)
            return [replace(plane, equal=True)]

    with pytest.raises(CorridorError, match="no equations"):
        minsnap.plan([(0, 0, 1), (2, 1, 1), (4, 0, 2)], durations=[2, 2], corridor=Level())


def test_a_wall_on_a_derivative_above_the_degree_is_refused_with_a_proof():
    """It is zero, and has to be one at least; the proof raised a TypeError."""
    wall = ONE_WALL | {"lower": [1.0], "order": 4}
    with pytest.raises(InfeasibleError) as refused:
        minsnap.plan([(0, 0, 1), (4, 0, 1), (4, 4, 1)], degree=3, durations=[3.0, 3.0], corridor=OwnConstraint(wall))
    assert refused.value.verify()

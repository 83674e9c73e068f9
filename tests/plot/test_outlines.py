"""Bodies drawn for corridors that are no tubes."""

import numpy as np
import pytest

from minsnap import Boxes, HalfSpaces, Polytopes, Room, RoundTube, Tube
from minsnap.corridors.constraint import Walls
from minsnap.plot.geometry import leg_bodies

LINE = np.array([(0.0, 0, 1), (4, 0, 1)])


def extent(bodies):
    corners = np.concatenate(bodies)
    return np.concatenate((corners.min(axis=0), corners.max(axis=0)))


def test_boxes_are_drawn_whole():
    boxes = Boxes([[-1, -2, 0], [3, -1, 0]], [[5, 2, 3], [9, 1, 2]])
    bodies = leg_bodies(boxes, np.vstack([LINE, (8, 0, 1)]))
    assert extent(bodies[:1]) == pytest.approx([-1, -2, 0, 5, 2, 3])
    assert extent(bodies[1:]) == pytest.approx([3, -1, 0, 9, 1, 2])


def test_room_cuts_a_tube_that_still_ends_at_its_waypoints():
    bodies = leg_bodies([Tube(0.3), Room((-9, -0.1, 0), (9, 9, 1.2))], LINE)
    assert extent(bodies) == pytest.approx([0, -0.1, 0.7, 4, 0.3, 1.2])


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0.6, 0.8)])
def test_half_space_along_a_leg_is_closed_a_little_beyond_the_waypoints(normal):
    low_high = extent(leg_bodies(HalfSpaces(normal, 2.0), LINE))
    assert (low_high[:3] <= [-1, -1, 0]).all() and (low_high[:3] >= -6).all()
    assert (low_high[3:] >= [5, 1, 1]).all() and (low_high[3:] <= 10).all()


def test_unbounded_polytope_is_drawn():
    corner = Polytopes([(-np.eye(3), np.array([1.0, 1.0, 0.0]))])
    assert extent(leg_bodies(corner, LINE))[:3] == pytest.approx([-1, -1, 0])


class Funnel:
    """Within a cone around the vertical through the origin: 0.2 m wide there, 0.5 m wider per metre of height."""

    def walls(self, waypoints):
        legs = len(waypoints) - 1
        across, slope = np.broadcast_to(np.eye(2, 3), (legs, 2, 3)), np.tile((0.0, 0.0, 0.5), (legs, 1))
        return [Walls.balls(np.arange(legs), across, np.zeros((legs, 3)), np.full(legs, 0.2), slope=slope)]


def test_a_cone_is_drawn_wider_where_it_is_farther_from_its_tip():
    room = Room((-9, -9, 0), (9, 9, 4))
    (body,) = leg_bodies([Funnel(), room], np.array([(0.0, 0, 0.1), (0.0, 0, 3.9)]))
    reach = np.linalg.norm(body[:, :2], axis=1)
    assert extent([body]) == pytest.approx([-2.2, -2.2, 0, 2.2, 2.2, 4], abs=1e-9)
    assert reach == pytest.approx(0.2 + 0.5 * body[:, 2], rel=1e-6)


def test_a_round_tube_ends_at_its_waypoints_and_is_cut_by_a_room():
    assert extent(leg_bodies(RoundTube(0.5), LINE)) == pytest.approx([0, -0.5, 0.5, 4, 0.5, 1.5], abs=1e-9)
    cut = leg_bodies([RoundTube(0.5), Room((-9, -9, 0), (9, 9, 1.2))], LINE)
    assert extent(cut) == pytest.approx([0, -0.5, 0.5, 4, 0.5, 1.2], abs=1e-9)


class Ball:
    def walls(self, waypoints):
        legs = len(waypoints) - 1
        return [Walls.balls(np.arange(legs), np.tile(np.eye(3), (legs, 1, 1)), np.tile((2.0, 0, 1), (legs, 1)), [3.0])]


def test_a_ball_is_drawn_around_its_center():
    (body,) = leg_bodies(Ball(), LINE)
    reach = np.linalg.norm(body - (2.0, 0.0, 1.0), axis=1)
    assert reach.min() >= 2.9 and reach.max() <= 3.2
    assert extent([body]) == pytest.approx([-1, -3, -2, 5, 3, 4], abs=0.2)

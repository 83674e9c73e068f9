"""Bodies drawn for corridors that are no tubes."""

import numpy as np
import pytest

from minsnap import Boxes, HalfSpaces, Polytopes, Room, Tube
from minsnap.plot.regions import leg_bodies

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

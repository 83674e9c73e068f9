"""Waypoints on walls: on the floor, under the ceiling, on faces of boxes."""

import numpy as np
import pytest

import minsnap
from minsnap.optimisation.touches import Side, touched_walls

FLOORS = (0.0, -1e-15, -1e-13, -1e-12, -1e-10, -1e-8)


def question(seed):
    """A course between heights 0, 1 and 6, and a room or boxes that it touches."""
    random = np.random.default_rng(seed)
    count, dim = int(random.integers(3, 9)), int(random.integers(1, 4))
    points = random.uniform(-5.0, 5.0, (count, dim))
    points[:, -1] = random.choice([0.0, 0.0, 1.0, 6.0], count)
    durations = random.uniform(0.3, 3.0, count - 1) * 10.0 ** random.uniform(-0.5, 0.5, count - 1)
    options = ({}, {"degree": int(random.choice([5, 9]))}, {"pieces": 2}, {"closed": True}, {})[seed % 5]
    if seed % 5 == 3:
        points[-1] = points[0]
    margin = np.append(np.ones(dim - 1), 0.0)
    floor = FLOORS[int(random.integers(6))]
    if seed % 5 == 4:
        lower, upper = np.minimum(points[1:], points[:-1]) - margin, np.maximum(points[1:], points[:-1]) + margin
        return points, durations, minsnap.Boxes(lower, upper + np.append(np.zeros(dim - 1), 0.5)), options
    return points, durations, minsnap.Room((*-20.0 * margin[:-1], floor), (*20.0 * margin[:-1], 6.0)), options


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 6, 26, 44, 71, 83, 91, 93, 117, 207, 249, 274, 292, 311, 324, 350, 596])
def test_a_course_that_touches_its_walls_is_planned(seed):
    points, durations, walls, options = question(seed)
    traj = minsnap.plan(points, durations, corridor=walls, **options)
    assert minsnap.certify(traj, points, walls).ok


def test_touching_costs_as_much_as_nearly_touching():
    """The cost grows as the square root of the room below the waypoints vanishes."""
    points, durations = [(0, 0, 1), (3, 1, 0), (5, -2, 0), (8, 0, 1)], [1.0, 1.5, 1.2]
    costs = [
        minsnap.plan(points, durations, corridor=minsnap.Room((-9, -9, -low), (9, 9, 6))).report.cost
        for low in (0.0, 1e-8, 1e-6)
    ]
    assert 0.0 <= costs[0] / costs[1] - 1.0 < 3e-3
    assert (costs[0] - costs[2]) / (costs[0] - costs[1]) == pytest.approx(10.0, rel=0.2)


def test_the_velocity_is_zero_across_a_wall_that_both_legs_have():
    room = minsnap.Room((-9.0, -9.0, 0.0), (9.0, 9.0, 6.0))
    traj = minsnap.plan([(0, 0, 1), (3, 1, 0), (5, -2, 1)], [1.0, 1.5], corridor=room)
    velocity, acceleration = traj(1.0, 1), traj(1.0, 2)
    assert velocity[2] == 0.0 and acceleration[2] > 0.0 and np.abs(velocity[:2]).min() > 0.1


def test_a_wall_of_one_leg_leaves_the_velocity_free():
    boxes = minsnap.Boxes([(-1, -1, 0), (2, -1, -3)], [(3, 1, 2), (5, 1, 1)])
    points = np.array([(0.0, 0.0, 1.0), (2.5, 0.0, 0.0), (4.0, 0.0, -1.0)])
    touched = touched_walls(points, np.ones(points.shape, dtype=bool), boxes.walls(points), False)
    assert touched[Side.BEFORE, 1, 1, 2] and not touched[Side.AFTER].any() and touched.sum() == 1
    traj = minsnap.plan(points, [1.0, 1.0], corridor=boxes)
    assert traj(1.0, 1)[2] < -0.1 and minsnap.certify(traj, points, boxes).ok


def test_waypoints_that_are_free_touch_nothing():
    room = minsnap.Room((0.0, 0.0), (1.0, 1.0))
    points = np.array([(0.0, 0.5), (1.0, 0.5)])
    pinned = np.array([(False, True), (True, True)])
    touched = touched_walls(points, pinned, room.walls(points), False)
    assert touched[Side.BEFORE, 0, 1, 0] and touched.sum() == 1


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(0, 20, 2))
def test_a_slanted_wall_that_waypoints_lie_on_is_planned_or_named(seed):
    random = np.random.default_rng(seed)
    points, normal = random.uniform(-3.0, 3.0, (4, 3)), random.normal(size=3)
    normal /= np.linalg.norm(normal)
    offset = normal @ points[1]
    beyond = np.maximum(points @ normal - offset, 0.0)
    points -= 2.0 * beyond[:, None] * normal
    wall = minsnap.HalfSpaces(normal, offset)
    try:
        assert minsnap.certify(minsnap.plan(points, [1.0, 1.5, 1.2], corridor=wall), points, wall).ok
    except minsnap.errors.CorridorError as error:
        assert "lies on" in str(error)

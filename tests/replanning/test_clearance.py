"""Walls moved inwards: by the clearance, less where a waypoint is nearer, and plans inside walls that shift."""

import numpy as np
import pytest

import minsnap
from minsnap import Boxes, Limits, Replanner, RoundTube
from minsnap.errors import InputError
from minsnap.replanning.course_ahead import course_ahead
from minsnap.replanning.horizon import Aim, moved_inwards, near
from minsnap.replanning.splice import splice_of

POINTS = np.array([(0.0, 0.0, 1.0), (3.0, 0.05, 1.0), (6.0, 0.0, 1.0)])
BOXES = Boxes([(-1, -0.1, 0), (2, -1, 0)], [(4, 1, 2), (7, 1, 2)])


def test_faces_move_by_the_clearance_or_by_the_room_of_a_waypoint():
    (inner,) = moved_inwards(BOXES.walls(POINTS), POINTS, 0.3)
    upper, lower = inner.radius.reshape(2, 2, 3)
    assert -lower[0] == pytest.approx([-0.7, -0.0, 0.3], abs=1e-5)
    assert upper == pytest.approx(np.array([(3.7, 0.7, 1.7), (6.7, 0.7, 1.7)]), abs=1e-5)


def test_round_tubes_shrink():
    (inner,) = moved_inwards(RoundTube([0.5, 0.2]).walls(POINTS), POINTS, 0.3)
    assert inner.radius == pytest.approx([0.2, 0.02], abs=1e-5)


def test_limits_do_not_move():
    walls = Limits(speed=2.0).walls(POINTS)
    assert moved_inwards(walls, POINTS, 0.3) == list(walls)


def test_new_plans_stay_inside_boxes_that_shift_by_the_clearance():
    wide = Boxes([(-1, -1, 0), (2, -1, 0)], [(4, 1, 2), (7, 1, 2)])
    flown = minsnap.plan(POINTS, limits=Limits(speed=1.5, acceleration=3.0), corridor=wide, pieces=1)
    faster = Limits(speed=3.0, acceleration=6.0)
    change = Replanner(faster, wide, clearance=0.4, clock=lambda: 0.0).replan(flown, 0.2, POINTS[1:], 0.5, began=60.0)
    assert not change.kept
    shifted = Boxes(wide.lower + [0.0, 0.39, 0.39], wide.upper - [0.0, 0.39, 0.39])
    whole = np.concatenate((change.trajectory(0.0)[None], POINTS[1:]))
    assert minsnap.certify(change.trajectory, whole, shifted, faster).ok


def test_a_negative_clearance_is_refused():
    with pytest.raises(InputError, match="clearance is -0.1: give a distance of 0 or more"):
        Replanner(clearance=-0.1)


@pytest.mark.parametrize(("speed", "legs", "joins"), [(3.003, 1, True), (3.0, 3, False), (2.9, 1, False)])
def test_a_plan_joins_the_flown_one_where_that_has_room_in_its_limits(speed, legs, joins):
    """Two legs at 3 m/s, and one to rest."""
    along = np.array([*np.linspace([0.0, 3.0], [3.0, 6.0], 8).T, [6.0 + p / 7.0 for p in (0, 3, 6, 9, *[10.5] * 4)]])
    flown = minsnap.Trajectory(along[:, :, None] * [1.0, 0.0, 0.0], np.ones(3))
    splice = splice_of(flown, 0.0, 1e-9, 4)
    task = course_ahead(splice, flown.control_points[:, -1], None, splice.leg_start, [minsnap.Tube(0.5)], 1).task
    part = near(task, Aim(minsnap.Limits(speed=speed, acceleration=9.0)), 1, flown, flown)
    assert (part.task.legs, part.tail is not None) == (legs, joins)

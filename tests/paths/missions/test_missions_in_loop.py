"""Missions that leave room for the control loop of their vehicle."""

import numpy as np
import pytest

import minsnap
from minsnap.errors import UnprovedError, VehicleError
from minsnap.paths.missions.narrower_course import narrower_course

LIMITS = minsnap.Limits(speed=2.0, acceleration=3.0, jerk=15.0)
LOOP = minsnap.Loop.px4()


def course(**others):
    gate = minsnap.Gate((6.0, 0.0, 2.0), (1.0, 0.0, 0.0), width=3.0, height=3.0)
    stops = (minsnap.Stop((0.0, 0.0, 2.0)), minsnap.Stop(gate), minsnap.Stop((8.0, 4.0, 2.0)))
    return minsnap.Course(stops, limits=LIMITS, tube=1.5, takeoff=True, **others)


@pytest.mark.slow
def test_the_vehicle_keeps_the_tube_and_the_gates_of_the_course():
    asked = course()
    plain, room = minsnap.plan_mission(asked), minsnap.plan_mission(asked, tracking=LOOP, wind=1.0)
    assert not plain.in_loop(LOOP, 1.0).ok
    tube = room.in_loop(LOOP, 1.0)
    assert tube.ok and tube.strongest >= 1.0 and {"gate 2"} <= set(tube.rooms)
    assert room.course.tube == 1.5 and room.course.stops[1].place is asked.stops[1].place, "as it was asked"
    assert room.limits == LIMITS
    assert any("keeps all of it in a wind that changes by 1 m/s" in note for note in room.notes)
    assert minsnap.certify(room.trajectory, corridor=room.corridor, limits=LIMITS, tracking=LOOP, wind=1.0).ok
    assert room.trajectory.duration >= plain.trajectory.duration - 1e-6


def test_a_narrower_course_leaves_the_distance_everywhere():
    walls = minsnap.Cylinder((3.0, 3.0), 0.5)
    less = narrower_course(course(avoid=[walls]), 0.4)
    assert less.tube == pytest.approx(1.1)
    assert less.obstacles[0].numbers()[6] == pytest.approx(walls.numbers()[6] + 0.4)
    edges = [each.stops[1].gate.edges()[1] for each in (course(), less)]
    assert np.allclose(edges[0] - edges[1], 0.4)


def test_what_leaves_no_room_is_refused():
    narrow = course().changed(tube=0.3)
    with pytest.raises(UnprovedError, match="no plan was found that the vehicle keeps in a wind that changes by 3 m/s"):
        minsnap.plan_mission(narrow, tracking=LOOP, wind=3.0)
    with pytest.raises(VehicleError, match="wind is of a vehicle in its loop"):
        minsnap.plan_mission(course(), wind=1.0)

"""A constant heading that the plan chooses: never worse than the one at yaw 0, and what it is, is said."""

from math import pi, radians

import numpy as np
import pytest

import minsnap
from minsnap import Limits
from minsnap.errors import InfeasibleError, YawError
from minsnap.planning.free_heading import SETTINGS, choose_heading, heading_across, headings_for
from minsnap.vehicle.quadrotor import named_vehicle

POINTS = np.array([(0, 0, 1), (4, 1, 1), (2, 5, 2), (-1, 2, 1)], dtype=float)
ROTORS = Limits.of(named_vehicle("crazyflie"), reserve=0.1)


def test_the_first_heading_is_across_the_main_direction_of_motion():
    """The least eigenvector of the sum of d d^T / |d|, by another method."""
    random = np.random.default_rng(3)
    for count in (2, 3, 8):
        points = random.normal(size=(count, 3))
        steps = np.diff(points[:, :2], axis=0)
        least = np.linalg.eigh(sum(np.outer(d, d) / np.linalg.norm(d) for d in steps))[1][:, 0]
        heading = heading_across(points)
        assert abs(np.cross([*least, 0], [np.cos(heading), np.sin(heading), 0])[2]) < 1e-9
    assert heading_across(np.array([(0, 0, 0), (3, 0, 1)])) == pytest.approx(pi / 2)
    assert heading_across(np.array([(0, 0, 0), (0, 0, 1)])) == heading_across(np.zeros((2, 2)))


def test_headings_lie_within_half_a_turn_and_yaw_zero_is_among_them():
    angles = headings_for(ROTORS, POINTS)
    assert len(angles) == len(set(angles)) == 4 and 0.0 in angles
    assert all(-pi / 2 < angle <= pi / 2 for angle in angles)
    apart = [(angle - angles[0] + pi / 2) % pi - pi / 2 for angle in angles[2:]]
    assert apart == pytest.approx([SETTINGS.beside, -SETTINGS.beside])
    assert headings_for(Limits(speed=3), POINTS) == headings_for(None, POINTS) == [0.0]


def test_a_flight_within_rotors_is_no_longer_than_at_yaw_zero_and_says_what_it_gains():
    free, fixed = (minsnap.plan(POINTS, limits=ROTORS, pieces=1, yaw=yaw) for yaw in ("free", 0.0))
    angle = free.yaw.constant
    assert free.duration < fixed.duration and angle in headings_for(ROTORS, POINTS)
    assert minsnap.certify(free, POINTS, limits=ROTORS).ok
    gain = 100 * (1 - free.duration / fixed.duration)
    said = f"the heading is {np.degrees(angle):.0f} degrees, the best of 4 tried: {gain:.2g} % less flight time"
    assert free.report.notes[0].startswith(said)
    assert free.duration == minsnap.plan(POINTS, limits=ROTORS, pieces=1, yaw=angle).duration


@pytest.mark.parametrize("asked", [{"limits": Limits(speed=3, acceleration=6)}, {"total_time": 9.0}])
def test_where_no_limit_depends_on_the_heading_it_is_zero(asked):
    free, fixed = (minsnap.plan(POINTS, **asked, pieces=1, yaw=yaw) for yaw in ("free", None))
    assert free.duration == fixed.duration and free.yaw.constant == 0.0
    assert free.report.notes[0] == "no limit depends on the heading, so it is 0 degrees"


def test_a_total_within_rotors_costs_no_more_than_at_yaw_zero():
    free, fixed = (minsnap.plan(POINTS, limits=ROTORS, total_time=3.2, yaw=yaw) for yaw in ("free", 0.0))
    assert free.cost() <= fixed.cost() * (1 + 1e-6)
    assert minsnap.certify(free, POINTS, limits=ROTORS).ok and free.duration == pytest.approx(3.2)


def test_a_course_has_one_heading_for_all_its_parts(tmp_path):
    file = tmp_path / "course.yaml"
    file.write_text(
        "waypoints: [[0, 0, 1], [4, 1, 1], {x: 2, y: 5, z: 2, hold: 1}, [-1, 2, 1]]\n"
        "yaw: free\nvehicle: crazyflie\ntakeoff: true\npieces: 1\n"
    )
    course = minsnap.read_course(file)
    mission = minsnap.plan_mission(course)
    assert mission.trajectory.yaw.constant is not None
    assert mission.notes[0].startswith("the heading is ")
    assert mission.trajectory.duration <= minsnap.plan_mission(course.changed(yaw=0.0)).trajectory.duration


def test_a_heading_without_a_plan_is_left_out_and_a_proof_ends_all():
    def plan(angle):
        if angle == 0.0:
            raise minsnap.SolverError("no plan")
        return angle

    headed = choose_heading([1.0, 0.0, 2.0], plan, lambda one: (one, 0.0), "time", lambda one: False)
    assert headed.angle == 1.0 and headed.note.endswith("at 0 degrees no plan was found")
    ended = choose_heading([1.0, 0.0], plan, lambda one: (one, 0.0), "time", lambda one: True)
    assert "the best of 1 tried" in ended.note
    with pytest.raises(minsnap.SolverError, match="no plan"):
        choose_heading([0.0], plan, lambda one: (one, 0.0), "time", lambda one: False)
    tight = Limits.of(named_vehicle("crazyflie"), reserve=0.1, speed=1.0)
    with pytest.raises(InfeasibleError, match="too short"):
        minsnap.plan(POINTS, total_time=1.0, limits=tight, yaw="free")


def test_only_plans_have_a_free_heading():
    for call in (lambda: minsnap.circle(1.0, yaw="free"), lambda: minsnap.plan(POINTS, total_time=9, yaw="fre")):
        with pytest.raises(YawError):
            call()
    assert radians(15) == SETTINGS.beside

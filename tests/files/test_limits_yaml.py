"""Limits in files: one mapping means the same wherever it stands."""

from pathlib import Path

import pytest

import minsnap
from minsnap.errors import FileError
from minsnap.files.limits_yaml import describe_limits, limits_of, read_limits
from minsnap.files.request_yaml import read_request
from minsnap.paths.missions import read_course

SAID = ["{speed: 2}", "{jerk: null, tilt: 0.4}", "{max_thrust: 2}", "{speed: [1, 2]}", "{acceleration: 4, norm: axis}"]


@pytest.mark.parametrize("said", [*SAID, "{rotors: {vehicle: crazyflie}, speed: 1}"])
def test_a_request_and_a_course_read_limits_alike(tmp_path, said):
    plan, course = tmp_path / "plan.yaml", tmp_path / "course.yaml"
    text = f"waypoints: [[0, 0, 1], [4, 0, 1], [4, 3, 1]]\nlimits: {said}\n"
    plan.write_text(text)
    course.write_text(text + "laps: 1\n")
    assert read_request(plan).bounds == read_course(course).limits


@pytest.mark.parametrize("said", [*SAID, "{rotors: {vehicle: crazyflie, reserve: 0.2}, speed: 1}"])
def test_beside_a_time_and_in_a_file_of_limits_exactly_those_hold_that_are_named(tmp_path, said):
    plan, alone = tmp_path / "plan.yaml", tmp_path / "limits.yaml"
    plan.write_text(f"waypoints: [[0, 0, 1], [4, 0, 1], [4, 3, 1]]\ntotal_time: 9\nlimits: {said}\n")
    alone.write_text(f"limits: {said}\n")
    limits = read_limits(alone)
    assert read_request(plan).bounds == limits
    assert limits_of("again", describe_limits(limits), tmp_path) == limits


def test_a_vehicle_beside_limits_of_rotors_is_refused():
    with pytest.raises(FileError, match="leave out one of them"):
        limits_of("limits", {"rotors": {"vehicle": "crazyflie"}}, Path(), vehicle="dji_f330")


def test_a_vehicle_beside_limits_keeps_no_ordinary_ones():
    limits = limits_of("limits", {"speed": 2.0}, Path(), timed=False, vehicle="crazyflie")
    assert limits == minsnap.Limits.of("crazyflie", reserve=0.0, speed=2.0)

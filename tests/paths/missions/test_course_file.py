"""Courses in YAML."""

from math import pi
from pathlib import Path

import numpy as np
import pytest

import minsnap
from minsnap.errors import FileError
from minsnap.paths.missions.course import is_course
from minsnap.vehicle import Quadrotor
from minsnap.vehicle.quadrotor import description_of

TEXT = """
name: yard
waypoints:
  - [0, 0, 1.5]
  - {center: [5, 0, 1.5], heading_deg: 0, width: 1.0, height: 0.8, straight: 0.5}
  - {x: 8, y: 3, z: 2, ball: 0.4}
  - {center: [4, 5, 2], heading: 3.141592653589793, width: 1.2}
  - [0, 0, 1.5]
closed: true
laps: 2
takeoff: true
land: [1, 1, 0]
limits: {speed: 4, acceleration: 6}
"""


@pytest.fixture
def write(tmp_path):
    def _write(text, name="course.yaml"):
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return _write


def test_everything_that_is_said_is_read(write):
    course = minsnap.read_course(write(TEXT))
    assert course.name == "yard" and course.closed and course.laps == 2 and len(course.stops) == 4
    assert course.takeoff is True and course.land == (1.0, 1.0, 0.0) and course.limits.speed == 4.0
    gate, ball, back = course.stops[1].place, course.stops[2], course.stops[3].place
    assert gate.normal == pytest.approx([1, 0, 0]) and gate.crossing == 1 and course.stops[1].straight == 0.5
    assert np.ptp(gate.corners, axis=0) == pytest.approx([0.0, 1.0, 0.8])
    assert ball.ball == 0.4 and ball.place == pytest.approx([8, 3, 2]) and course.stops[0].ball == 0.0
    assert back.normal == pytest.approx([np.cos(pi), np.sin(pi), 0.0], abs=1e-12)


def test_waypoint_files_are_no_courses(write):
    assert not is_course(write("[[0, 0, 1], [1, 1, 1]]\n", "a.yaml"))
    assert not is_course(write("waypoints: [{x: 0, y: 0, yaw: 1}, {x: 1, y: 1, yaw: 0}]\ndurations: [2]\n", "b.yaml"))
    limited = write("waypoints: [[0, 0, 1], [1, 1, 1]]\nlimits: {rotors: {vehicle: f330}}\n", "d.yaml")
    assert is_course(limited) and not is_course(limited, wanted=False)
    assert not is_course(write("waypoints: [[0, 0, 1], [1, 1, 1]]\nboxes: [[[0, 0, 0], [2, 2, 2]]]\n", "e.yaml"))
    assert not is_course(write("x,y\n", "f.csv"))
    assert is_course(write("- {x: 0, y: 0, hold: 1}\n- [1, 1]\n", "c.yaml")) and is_course(write(TEXT))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("laps: 2\ntotal_time: 10\n", "'laps' is for a course, and 'total_time' for a plan through waypoints"),
        ("- {x: 2, y: 0, z: 1, hold: 1}\ncorridor: 0.4\n", "'hold' is for a course, and 'corridor' for a plan"),
    ],
)
def test_a_file_that_is_half_a_course_is_refused_by_its_keys(write, text, message):
    """It was said to need a list of waypoints, which it had."""
    with pytest.raises(FileError, match=message):
        is_course(write(f"waypoints:\n- [0, 0, 1]\n- [1, 1, 1]\n{text}"))


@pytest.mark.parametrize("file", sorted((Path(__file__).parents[3] / "benchmarks" / "courses").glob("*.yaml")), ids=str)
def test_courses_of_the_benchmarks_are_read(file):
    course = minsnap.read_course(file)
    assert course.limits is not None and (len(course.stops) >= 2) != (course.boxes is not None)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("laps: 2", "speed: 2"), "'speed' is not known: .*the keys are name, waypoints"),
        (("laps: 2", "laps: 0"), "laps is 0"),
        (("ball: 0.4", "size: 0.4"), "waypoints 2: 'size' is not known: the keys are x, y, z, ball"),
        (("heading_deg: 0", "heading_deg: north"), "waypoints 1: heading_deg is 'north': give a finite number"),
        (("heading_deg: 0, ", ""), "waypoints 1: a gate has a center, a width or a radius, and one of"),
        (("land: [1, 1, 0]", "land: yes"), "land is 'yes': give true or false, or where on the ground"),
        (("[0, 0, 1.5]\\n  - {center", "[0]\\n  - {center"), "waypoints 0 is .*give two or three numbers"),
        (("{speed: 4, acceleration: 6}", "4"), "limits is 4: give a mapping of limits by name"),
        (
            ("{speed: 4, acceleration: 6}", "{velocity: 4}"),
            "limits: 'velocity' is not known: .*the keys are speed, acceleration",
        ),
        (("laps: 2", "vehicle: none.yaml"), "none.yaml cannot be read"),
        (("laps: 2", "vehicle: 3"), "vehicle is 3: give its fields by name, or a YAML file"),
        (("laps: 2", "vehicle: {mass: 1}"), "the vehicle has no inertia and no arm_length"),
        (("laps: 2", "vehicle: {mass: 1, arm: 2}"), "'arm' is not known: .*the keys are mass"),
        (
            ("laps: 2", "boxes: [[0, 0, 1], [1, 1, 2]]"),
            r"boxes is \[\[0, 0, 1\], .*give their corners as lower and upper",
        ),
        (("x: 8", "x: .nan"), "waypoints 2: x"),
        (("heading_deg: 0", "heading_deg: 0, ball: 0.3"), "waypoints 1: 'ball' is not known: the keys are center"),
        (("width: 1.0", "radius: 0.5"), "waypoints 1: a gate with a radius is round: leave out its height and up"),
    ],
)
def test_a_file_that_is_wrong_is_refused_with_its_place(write, change, message):
    file = write(TEXT.replace(change[0].replace("\\n", "\n"), change[1].replace("\\n", "\n"), 1))
    with pytest.raises(FileError, match=message):
        minsnap.read_course(file)


def test_a_vehicle_is_a_file_beside_the_course_or_a_preset(write, tmp_path):
    vehicle = Quadrotor.dji_f330()
    vehicle.to_yaml(tmp_path / "racer.yaml")
    for named in ("racer.yaml", "dji_f330"):
        limits = minsnap.read_course(write(TEXT.replace("laps: 2", f"vehicle: {named}"))).limits
        assert description_of(limits.vehicle) == description_of(vehicle)
        assert limits.reserve == 0.0 and limits.speed == 4.0


def test_degree_pieces_and_obstacles_are_those_of_a_plan_file(write):
    shared = "degree: 9\npieces: auto\navoid: [{cylinder: [2, 0.1, 0.5]}, {cylinder: [4, -1, 0.3]}]\n"
    course = minsnap.read_course(write(TEXT + shared))
    assert (course.degree, course.pieces) == (9, "auto")
    assert course.avoid == (("cylinder", (2.0, 0.1, 0.5)), ("cylinder", (4.0, -1.0, 0.3)))
    points = "waypoints: [[0, 0, 1], [1, 1, 1]]\nlimits: {speed: 2}\n"
    assert not is_course(write(points + shared)) and is_course(write(points + shared + "laps: 2\n"))
    assert is_course(write(points.replace("[1, 1, 1]", "{x: 1, y: 1, z: 1, hold: 2}") + shared))
    with pytest.raises(FileError, match=r"avoid 0: 'cilinder' is not known: did you mean cylinder"):
        minsnap.read_course(write(TEXT + shared.replace("cylinder", "cilinder", 1)))
    with pytest.raises(FileError, match="degree is 8: it must be odd"):
        minsnap.read_course(write(TEXT + "degree: 8\n"))

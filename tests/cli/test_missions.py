"""Courses on the command line."""

import json

import numpy as np
import pytest

import minsnap


@pytest.fixture
def write(tmp_path):
    def _write(text, name="course.yaml"):
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return _write


def test_the_command_flies_a_course(call, write):
    stops = "[0, 0, 1], {centre: [3, 0, 1], heading: 0, width: 1}, {x: 5, y: 2, z: 1, hold: 1}"
    write(f"waypoints: [{stops}]\ntakeoff: true\n")
    done = call("plan", "course.yaml", "--land", "--max-speed", "2", "-o", "a.csv", "--plot", "a.png", "--json")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert [part["name"] for part in said["parts"]] == ["take-off", "course", "hold", "landing"]
    assert said["max_speed"] <= 2.0 + 1e-6
    read = minsnap.read_csv("a.csv")
    assert read.position[[0, -1], 2] == pytest.approx([0, 0], abs=1e-9) and read.position[:, 2].max() > 0.99
    assert call("check", "a.csv").returncode == 0


def test_waypoints_are_flown_with_take_off_and_laps(call, write):
    write("x,y,z\n0,0,1\n3,0,1\n1,2,1\n", "w.csv")
    done = call("plan", "w.csv", "--closed", "--laps", "2", "--takeoff", "--land", "-o", "a.csv")
    assert done.returncode == 0 and "lap 2" in done.stdout and "take-off" in done.stdout
    read = minsnap.read_csv("a.csv")
    passes = np.linalg.norm(read.position - [3, 0, 1], axis=1) < 0.3
    assert np.count_nonzero(np.diff(passes.astype(int)) == 1) == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["w.csv", "--laps", "2", "--time", "20"], "--time is for a plan through waypoints"),
        (["timed.csv", "--takeoff"], "timed.csv has durations"),
        (["w.csv", "--laps", "0"], "laps is 0"),
    ],
)
def test_what_does_not_go_with_a_course_is_refused(call, write, arguments, message):
    write("x,y,z\n0,0,1\n3,0,1\n", "w.csv")
    write("t,x,y,z\n0,0,0,1\n2,3,0,1\n", "timed.csv")
    done = call("plan", *arguments)
    assert done.returncode == 2 and message in done.stderr and done.stderr.count("\n") == 1

"""The text for Python and for a shell gives the same plan, number by number."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap import Search
from minsnap.studio.documents import example_scene
from minsnap.studio.edits import insert_waypoint, move_waypoint, set_width, with_boxes, with_room, with_time
from minsnap.studio.file_panel import as_command, as_python

EXAMPLE = example_scene()
TENTH = move_waypoint(set_width(EXAMPLE, 1, 0.1 + 0.2), 1, (8.0, 1.0 / 3.0, 1.0))
SCENES = {
    "example": EXAMPLE,
    "odd numbers": replace(TENTH, yaw=(0.0, 0.1, 0.2, 0.3, 1.0 / 7.0)),
    "walls": with_room(with_boxes(replace(TENTH, yaw="velocity"), True), True),
    "boxes alone": replace(with_boxes(TENTH, True), corridor=None, degree=9, pieces=2),
    "durations": replace(insert_waypoint(with_time(EXAMPLE, "durations", (4, 2, 4, 2), {}), 2), frame="ned"),
    "limits": with_time(EXAMPLE, "limits", (), {"speed": 3.0, "acceleration": 6.0}),
    "searched": replace(EXAMPLE, search=Search(split="distance"), waypoint_tolerance=0.1, solver="clarabel"),
    "closed": replace(EXAMPLE, closed=True, degree=9, yaw=0.5),
}


@pytest.mark.parametrize("name", SCENES)
def test_python_gives_the_same_control_points(name):
    names = {}
    exec(compile(as_python(SCENES[name]), name, "exec"), names)
    same = minsnap.plan(**SCENES[name].request().arguments())
    assert np.array_equal(names["trajectory"].control_points, same.control_points)
    assert np.array_equal(names["trajectory"].durations, same.durations)
    t = np.linspace(0.0, same.duration, 50)
    assert np.array_equal(names["trajectory"].yaw(t), same.yaw(t))


def test_python_names_the_rotors_of_the_vehicle():
    scene = replace(SCENES["limits"], rotors=0.1, vehicle="crazyflie")
    text = as_python(scene)
    assert "from minsnap.vehicle import Quadrotor" in text
    names = {"limits": None}
    line = next(line for line in text.splitlines() if line.strip().startswith("limits="))
    exec(f"import minsnap\nfrom minsnap.vehicle import Quadrotor\n{line.strip().rstrip(',')}", names)
    assert names["limits"].given() == scene.bounds.given()
    assert names["limits"].vehicle.name == scene.bounds.vehicle.name


@pytest.mark.slow
@pytest.mark.parametrize("name", ["walls", "durations"])
def test_the_shell_writes_the_same_setpoints(tmp_path, name):
    scene = SCENES[name]
    program = tmp_path / "minsnap"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m minsnap "$@"\n')
    program.chmod(0o755)
    text = f'PATH="{tmp_path}:$PATH"\n' + as_command(scene)
    subprocess.run(["sh", "-e", "-c", text], cwd=tmp_path, check=True, capture_output=True)
    minsnap.write_csv(minsnap.plan(**scene.request().arguments()), tmp_path / "same.csv", 20.0, scene.frame)
    assert (tmp_path / "setpoints.csv").read_bytes() == (tmp_path / "same.csv").read_bytes()

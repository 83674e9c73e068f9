"""plan, check and plot: commands that read files."""

from __future__ import annotations

import json
import os
import re
import subprocess
from dataclasses import replace

import numpy as np
import pytest

import minsnap

from .conftest import COMMAND

SQUARE = "x,y,z\n0,0,1\n4,0,1\n4,4,1\n0,4,1\n0,0,1\n"


@pytest.fixture
def square(tmp_path):
    file = tmp_path / "square.csv"
    file.write_text(SQUARE)
    return file


@pytest.fixture
def flown(tmp_path):
    file = tmp_path / "flown.csv"
    minsnap.write_csv(minsnap.circle(2.0), file)
    return file


def test_plan_flies_through_the_waypoints_within_ordinary_limits(call, square):
    said = json.loads(call("plan", square, "--corridor", "0.3", "--json", "-o", "a.csv").stdout)
    assert said["legs"] == 4 and said["corridor_margin"] >= 0.0
    assert {used["name"]: used["limit"] for used in said["limits"]} == {"speed": 3, "acceleration": 6, "jerk": 30}
    assert 16.0 / 3.0 < said["duration"] < 9.0 and max(used["fraction"] for used in said["limits"]) <= 1.0 + 1e-9
    position = minsnap.read_csv("a.csv").position
    for corner in ((4, 0, 1), (4, 4, 1), (0, 4, 1), (0, 0, 1)):
        assert np.linalg.norm(position - corner, axis=1).min() <= 0.5 * 3.0 / 20.0


def test_uneven_legs_are_flown_no_faster_than_even_ones(call, tmp_path):
    """A mean of 1 m/s split by length left 18 waypoints within 2 m by 17.9 m, at 118.9 m/s and 1,481 m/s^2."""
    steps = np.random.default_rng(0).normal(size=(12, 3))
    steps *= 10.0 ** np.random.default_rng(1).uniform(-1.0, 0.3, (12, 1)) / np.linalg.norm(steps, axis=1)[:, None]
    points = np.vstack((np.zeros(3), steps)).cumsum(axis=0) + [0.0, 0.0, 9.0]
    np.savetxt(tmp_path / "walk.csv", points, delimiter=",", header="x,y,z", comments="")
    said = json.loads(call("plan", "walk.csv", "--json", "-o", "a.csv").stdout)
    assert (
        said["max_speed"] <= 3.0 + 1e-8 and said["max_acceleration"] <= 6.0 + 1e-8 and said["max_jerk"] <= 30.0 + 1e-6
    )
    flown = minsnap.read_csv("a.csv").position
    assert np.ptp(flown, axis=0).max() <= 1.2 * np.ptp(points, axis=0).max()


def test_plan_takes_durations_and_yaw_of_the_file(call, tmp_path):
    (tmp_path / "w.csv").write_text("x,y,z,yaw,duration\n0,0,1,0,3\n4,0,1,1,2\n4,4,1,2,\n")
    assert json.loads(call("plan", "w.csv", "--json", "-o", "a.csv").stdout)["duration"] == pytest.approx(5.0)
    samples = minsnap.read_csv("a.csv")
    assert samples.yaw[[0, 60, 100]] == pytest.approx([0.0, 1.0, 2.0], abs=1e-9)
    assert samples.position[60] == pytest.approx([4.0, 0.0, 1.0], abs=1e-9)


def test_options_go_before_what_the_file_says(call, tmp_path):
    (tmp_path / "w.csv").write_text("x,y,z,yaw,duration\n0,0,1,0,3\n4,0,1,1,2\n4,4,1,2,\n")
    run = call("plan", "w.csv", "--time", "8", "--split", "distance", "--yaw", "90", "--json", "-o", "a.csv")
    assert json.loads(run.stdout)["duration"] == pytest.approx(8.0)
    assert minsnap.read_csv("a.csv").yaw == pytest.approx(np.pi / 2)


def test_plan_reads_yaml_and_closes_laps(call, tmp_path):
    (tmp_path / "w.yaml").write_text("[[0, 0, 1], [4, 0, 1], [4, 4, 1], [0, 0, 1]]\n")
    assert call("plan", "w.yaml", "--closed", "-o", "a.csv").returncode == 0
    samples = minsnap.read_csv("a.csv")
    assert np.linalg.norm(samples.velocity[0]) > 0.1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "empty"),
        ("x,y,z\n0,0,1\n", "2"),
        ("x,y,z\n0,0,1\n0,0,1\n1,1,1\n", "waypoints 0 and 1"),
        ("x,y,z\n0,0,1\n4,nan,1\n", "line 3"),
        ("x,y,z\n0,0,1\n4,0\n", "line 3"),
        ("x,y,duration\n0,0,-1\n4,0,\n", "duration"),
    ],
)
def test_bad_waypoints_are_2_and_write_nothing(call, tmp_path, text, said):
    (tmp_path / "w.csv").write_text(text)
    run = call("plan", "w.csv", "--corridor", "0.3", "-o", "a.csv")
    assert run.returncode == 2
    assert said in run.stderr and run.stderr.count("\n") == 1
    assert not (tmp_path / "a.csv").exists()


def test_check_finds_a_good_file_good(call, flown):
    run = call("check", flown)
    assert (run.returncode, run.stderr) == (0, "")
    assert run.stdout.endswith("consistent\n")
    said = json.loads(call("check", flown, "--json").stdout)
    assert said["ok"] and said["problems"] == [] and said["rate"] == pytest.approx(20.0)
    assert {axis["name"]: axis["highest"] for axis in said["axes"]}["x"] == pytest.approx(2.0)


def test_check_notes_a_yaw_in_degrees(call, flown):
    """The note stands above the verdict, and in the JSON; it changes no status."""
    samples = minsnap.read_csv(flown)
    minsnap.write_csv(replace(samples, yaw=samples.t * 57.3, yaw_rate=np.full_like(samples.t, 57.3)), "degrees.csv")
    run = call("check", "degrees.csv")
    assert run.returncode == 0 and "note: yaw goes to" in run.stdout and run.stdout.endswith("consistent\n")
    assert "degrees" in json.loads(call("check", "degrees.csv", "--json").stdout)["notes"][0]


@pytest.mark.slow
def test_check_takes_what_every_planning_command_writes(call):
    for shape in ("rect", "circle", "line", "helix", "eight"):
        assert call(shape, "-o", "a.csv", "--frame", "ned").returncode == 0
        assert call("check", "a.csv", "--from-frame", "ned").returncode == 0, shape


@pytest.mark.slow
def test_check_proves_a_plan_in_exact_arithmetic(call, tmp_path):
    call("rect", "--corridor", "0.3", "--time", "12", "-o", "rect.json")
    run = call("check", "rect.json", "--exact")
    assert run.returncode == 0 and re.search(r"exact proof +holds, corridor margin \S+ m, at every instant", run.stdout)
    said = json.loads(call("check", "rect.json", "--exact", "--json").stdout)["exact"]
    assert said["holds"] and said["corridor_margin"] >= 0.0
    narrower = json.loads((tmp_path / "rect.json").read_text())
    narrower["corridor"] = 0.2
    (tmp_path / "narrow.json").write_text(json.dumps(narrower))
    run = call("check", "narrow.json", "--exact")
    assert run.returncode == 1 and "the plan leaves its corridor: its exact margin is -0." in run.stdout
    call("rect", "--time", "12", "-o", "rect.csv")
    run = call("check", "rect.csv", "--exact")
    assert run.returncode == 2 and "rect.csv holds no plan to prove: --exact takes .json or .yaml" in run.stderr


def test_check_holds_a_plan_to_its_limits_and_its_waypoints(call, tmp_path):
    (tmp_path / "w.csv").write_text("x,y,z\n0,0,1\n4,0,1\n4,4,1\n")
    call("plan", "w.csv", "--max-speed", "3", "-o", "plan.json")
    run = call("check", "plan.json", "--exact")
    assert run.returncode == 0 and "waypoint error" not in run.stdout
    plan = json.loads((tmp_path / "plan.json").read_text())
    plan["limits"]["speed"] = 2.0
    plan["waypoints"][1][2] += 0.5
    (tmp_path / "slower.json").write_text(json.dumps(plan))
    run = call("check", "slower.json", "--exact")
    assert run.returncode == 1 and re.search(r"exceeds its limit speed: (2\.9999\d*|3) of 2 on leg \d at", run.stdout)
    assert re.search(r"waypoint error +0.5 m at most", run.stdout)
    told = "the plan exceeds its limit speed"
    assert told in call("plan", "slower.json", "-o", "s.csv").stdout
    assert told not in call("plan", "plan.json", "-o", "s.csv").stdout


def test_check_is_1_for_a_file_that_contradicts_itself(call, flown, tmp_path):
    rows = np.loadtxt(flown, delimiter=",", skiprows=1)
    rows[:, 4] *= -1.0
    header = flown.read_text().splitlines()[0]
    np.savetxt(tmp_path / "bad.csv", rows, delimiter=",", header=header, comments="")
    run = call("check", "bad.csv")
    assert run.returncode == 1
    assert "problem: " in run.stdout and "vx" in run.stdout
    assert not json.loads(call("check", "bad.csv", "--json").stdout)["ok"]


def test_check_measures_the_corridor(call, square):
    assert call("plan", square, "--corridor", "0.3", "-o", "a.csv").returncode == 0
    said = json.loads(call("check", "a.csv", "--waypoints", square, "--corridor", "0.3", "--json").stdout)
    assert -1e-9 <= said["corridor"]["margin"] < 0.3
    run = call("check", "a.csv", "--waypoints", square, "--corridor", "0.1")
    assert run.returncode == 1 and "leaves the corridor of leg" in run.stdout


@pytest.mark.slow
def test_check_refuses_bad_files_and_half_a_corridor_with_2(call, flown, tmp_path):
    (tmp_path / "bad.csv").write_text("t,x,y,z\n0,1,2,3\n0.1,1,2\n")
    assert "line 3" in call("check", "bad.csv").stderr
    run = call("check", flown, "--corridor", "0.3")
    assert run.returncode == 2 and "--waypoints" in run.stderr
    assert call("check", "none.csv").returncode == 2


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a.png", "a.svg", "a.pdf"])
def test_plot_draws_a_file(call, flown, square, tmp_path, name):
    assert call("plot", flown, "-o", name, "--waypoints", square, "--corridor", "0.2").returncode == 0
    assert (tmp_path / name).stat().st_size > 5000


def test_plot_needs_a_figure_it_can_write(call, flown, tmp_path):
    assert call("plot", flown).returncode == 2
    assert "a.txt" in call("plot", flown, "-o", "a.txt").stderr
    assert "give them with --waypoints" in call("plot", flown, "-o", "a.png", "--corridor", "0.2").stderr
    (tmp_path / "a.png").write_text("precious")
    assert call("plot", flown, "-o", "a.png", "--no-clobber").returncode == 2
    assert (tmp_path / "a.png").read_text() == "precious"
    assert call("plot", flown, "-o", "b.png", "--view", "top").returncode == 2
    assert not (tmp_path / "b.png").exists()


@pytest.mark.slow
def test_waypoints_are_read_from_the_standard_input(tmp_path):
    command = [*COMMAND, "plan", "-", "-o", "path.csv"]
    text = "x,y,z\n0,0,1\n4,0,1\n"
    run = subprocess.run(command, input=text, cwd=tmp_path, capture_output=True, text=True)
    assert (run.returncode, run.stderr) == (0, "") and os.listdir(tmp_path) == ["path.csv"]
    run = subprocess.run(command, input="x,y,z\n0,0,a\n", cwd=tmp_path, capture_output=True, text=True)
    assert (run.returncode, run.stdout) == (2, "") and "-, line 2: z is 'a'" in run.stderr


def test_repeated_instants_are_found_by_a_check_and_refused_by_all_that_fly(call, flown):
    lines = flown.read_text().splitlines(keepends=True)
    flown.write_text("".join(lines[:10] + lines[9:]))
    done = call("check", flown)
    assert (
        done.returncode == 1 and "problem: time goes from 0.4 s to 0.4 s at sample 9: it must increase" in done.stdout
    )
    found = json.loads(call("check", flown, "--json").stdout)
    assert not found["ok"] and len(found["problems"]) == 1 and found["rows"] == len(lines)
    for command in (("convert", flown, "a.npz"), ("plot", flown, "-o", "a.png")):
        done = call(*command)
        assert done.returncode == 2 and "line 11: t is 0.4, not after the 0.4 of the line before" in done.stderr

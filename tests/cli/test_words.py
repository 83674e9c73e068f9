"""Messages of commands name their options, not arguments of Python functions."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import minsnap
from minsnap.cli.app import ARGUMENTS, in_options
from minsnap.trajectory.samples import Samples

SENTENCES = [
    (
        "closed=True leaves it free: give neither start= nor end=",
        "--closed leaves it free: give neither start= nor end=",
    ),
    ("yaw_rate=2.0 is not: give yaw='velocity' with it", "--yaw-rate 2.0 is not: give --yaw velocity with it"),
    ("split='distance' does not go with time_weight, which", "--split distance does not go with --time-weight, which"),
    ("needs limits: give limits=, or leave it", "needs limits: give a limit such as --max-speed, or leave it"),
    ("total_time is -1.0 s", "--time is -1.0 s"),
    ("my_total_time.csv, line 3: corridor of leg 2", "my_total_time.csv, line 3: corridor of leg 2"),
]


@pytest.mark.parametrize(("sentence", "said"), SENTENCES)
def test_arguments_become_options(sentence, said):
    assert in_options(sentence) == said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("plan w.csv -o o.yaml", "--time is -1.0 s"),
        ("plan w.csv --vehicle v.yaml -o o.csv", "--time is -1.0 s"),
        ("plan w.csv --vehicle=v.yaml", "--time is -1.0 s"),
        ("plan PLAN.YAML", "total_time is -1.0 s"),
        ("plan PLAN.YAML --time -1", "--time is -1.0 s"),
    ],
)
def test_keys_are_named_where_the_input_is_a_plan_file_and_no_option_says_it(words, said):
    assert in_options("total_time is -1.0 s", words.split()) == said


CALLS = [
    ["plan", "w.csv", "--yaw-rate", "2"],
    ["plan", "w.csv", "--hold-below", "2", "--yaw", "1"],
    ["plan", "w.csv", "--split", "distance"],
    ["plan", "w.csv", "--split", "trapezoid"],
    ["plan", "w.csv", "--time-weight", "-1"],
    ["line", "--time", "-1"],
]


@pytest.mark.parametrize("arguments", CALLS, ids=" ".join)
def test_messages_name_options(call, arguments):
    Path("w.csv").write_text("x,y,z\n0,0,1\n4,0,1\n4,4,1\n")
    run = call(*arguments)
    assert run.returncode == 2 and run.stderr.count("\n") == 1
    assert "--" in run.stderr
    assert not re.search(rf"\b({'|'.join(ARGUMENTS)})=|[a-z]_[a-z]", run.stderr), run.stderr


KEYS = [
    ("time_limit: -2", "time_limit is -2.0: it must be a positive number [s]"),
    ("total_time: 6\ntime_limit: 4", "time_limit goes with durations or limits"),
    ("split: distance\ntime_weight: 3", "split: distance does not go with time_weight, which determines the split"),
    ("corridor: [0.3, 0.3, 0.2]", "w.yaml: corridor has 3 numbers for 2 legs: give one, or one per leg"),
    ("corridor: [0.3, 0.3, 0.3, 0.3]\nclosed: true", "corridor"),
    ("boxes: [[[0, 0, 0], [4, 4, 4]]]", "the corridor has 1 boxes for 2 legs: give one per leg"),
]


@pytest.mark.parametrize(("lines", "said"), KEYS)
def test_what_a_plan_file_says_is_named_by_its_keys(call, lines, said):
    Path("w.yaml").write_text(f"waypoints: [[0,0,1],[4,0,1],[4,4,1]]\n{lines}\n")
    run = call("plan", "w.yaml")
    assert run.returncode == 2 and said in run.stderr


def test_options_beside_a_plan_file_are_named_as_options(call):
    Path("w.yaml").write_text("waypoints: [[0,0,1],[4,0,1]]\ntime_limit: 2\n")
    assert "--time-limit is -2.0" in call("plan", "w.yaml", "--time-limit=-2").stderr


def test_files_are_spoken_of_in_their_own_words(call):
    Path("pose.csv").write_text("t,x,y,z,qw\n0,0,0,1,1\n")
    run = call("check", "pose.csv")
    assert run.returncode == 2 and "the columns are t,x,y,z,vx,vy,vz,ax,ay,az,yaw,yaw_rate,ffx" in run.stderr


REFUSED = [
    (("plan", "twice.csv", "-o", "o.csv"), "waypoints 0 and 1 are both (0, 0, 1): remove one, or give every leg a dur"),
    (("plan", "w.csv", "-o", "w.csv"), "w.csv is the file that is read: choose another name"),
    (("plan", "w.csv", "-o", "./link.csv"), "link.csv is the file that is read: choose another name"),
    (("simulate", "s.csv", "-o", "s.csv"), "s.csv is the file that is read: choose another name"),
    (("simulate", "s.csv", "--log", "s.ulg"), "s.ulg is the file that is read: choose another name"),
    (("plot", "s.csv", "-o", "s.png"), "s.png is the file that is read: choose another name"),
    (("plot", "s.csv", "--waypoints", "w.csv", "-o", "w.svg"), "w.svg is the file that is read: choose another name"),
    (("convert", "s.csv", "s.csv", "--frame", "ned"), "s.csv is the file that is read: choose another name"),
    (("convert", "s.csv", "again.json"), "again.json is the file that is read: choose another name"),
    (("tune", "s.csv", "late.csv", "-o", "late.csv"), "late.csv is the file that is read: choose another name"),
    (("fit", "late.csv", "-o", "late.csv"), "late.csv is the file that is read: choose another name"),
    (("plan", "w.csv", "--yaw", "north"), "--yaw is 'north': it takes degrees, velocity, tilt or free"),
    (("plan", "w.csv", "--max-tilt", "120"), "--max-tilt is 120 degrees: it must be below 90"),
    (("plan", "w.csv", "-o", "w.traj", "--frame", "ned"), "crazyflie-compressed is written in enu, not in ned: leave"),
    (("convert", "s.csv", "s.json", "--to-frame", "frd"), "polynomials is written in enu, not in frd: leave the frame"),
    (("compare", "s.csv", "late.csv"), "have no time in common: compare them with --align"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("arguments", "said"), REFUSED)
def test_what_is_careless_is_refused(call, arguments, said):
    Path("w.csv").write_text("x,y,z\n0,0,1\n4,0,1\n4,4,1\n")
    Path("twice.csv").write_text("x,y,z\n0,0,1\n0,0,1\n4,4,1\n")
    for name, source in (("link.csv", "w.csv"), ("w.svg", "w.csv"), ("s.png", "s.csv"), ("s.ulg", "s.csv")):
        Path(name).symlink_to(source)
    Path("again.json").symlink_to("s.csv")
    samples = minsnap.line(total_time=8.0).sample(20.0)
    minsnap.write_csv(samples, "s.csv")
    minsnap.write_csv(Samples(samples.t + 1e9, samples.position), "late.csv")
    before = [Path(name).read_bytes() for name in ("w.csv", "s.csv", "late.csv")]
    run = call(*arguments)
    assert run.returncode == 2 and said in run.stderr and run.stderr.count("\n") == 1
    assert [Path(name).read_bytes() for name in ("w.csv", "s.csv", "late.csv")] == before and not Path("o.csv").exists()


def test_closed_appends_the_first_waypoint(call):
    Path("w.csv").write_text("x,y,z\n0,0,1\n4,0,1\n4,4,1\n")
    Path("round.csv").write_text("x,y,z\n0,0,1\n4,0,1\n4,4,1\n0,0,1\n")
    for name in ("w", "round"):
        assert call("plan", f"{name}.csv", "--closed", "--corridor", "0.3", "-o", f"{name}_out.csv").returncode == 0
    one, other = minsnap.read_csv("w_out.csv"), minsnap.read_csv("round_out.csv")
    assert np.array_equal(one.position, other.position)
    assert one.velocity[-1] == pytest.approx(one.velocity[0], abs=1e-9) and np.linalg.norm(one.velocity[0]) > 0.1


def test_a_lap_with_durations_needs_that_of_its_last_leg(call):
    Path("w.csv").write_text("x,y,z,duration\n0,0,1,3\n4,0,1,3\n4,4,1,\n")
    run = call("plan", "w.csv", "--closed")
    assert run.returncode == 2 and "append the first waypoint" in run.stderr
    assert call("plan", "w.csv", "--closed", "--time", "12").returncode == 0


def test_a_word_stays_where_the_command_has_no_such_option(call):
    """The fields of stream were listed as position, ..., --yaw-rate."""
    minsnap.write_csv(minsnap.line(), "line.csv")
    done = call("stream", "line.csv", "--connect", "udpin:0", "--fields", "speed")
    assert done.returncode == 2 and "velocity, acceleration, yaw, yaw_rate [" in done.stderr


@pytest.mark.parametrize("words", [("fleet", "a.yaml", "-o", ""), ("rect", "--plot", ""), ("compare", "a.csv", "")])
def test_an_empty_name_is_no_name_of_the_current_folder(call, tmp_path, words):
    run = call(*words)
    assert run.returncode == 2 and "it is empty: give a name (see minsnap " in run.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("widths", ["[0.3, 0.4]", "[0.3, 0.4, 0.4]", "0.4"])
def test_a_lap_of_a_plan_file_goes_on_to_its_first_waypoint(call, widths):
    Path("w.yaml").write_text(f"waypoints: [[0,0,1],[4,0,1],[4,4,1]]\ncorridor: {widths}\nclosed: true\n")
    run = call("plan", "w.yaml", "--json")
    assert run.returncode == 0 and json.loads(run.stdout)["legs"] == 3


def test_numbers_after_an_option_are_hinted_at_with_this_option(call):
    run = call("rect", "--corridor", "-330", "-460", "0")
    assert run.returncode == 2 and "--corridor=0.3,0.5" in run.stderr

"""Options that choose durations: their limits, refusals and what the summary says of them."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import minsnap


def figures(run):
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)


OPTIONS = {
    "--max-speed": ("speed", 1.5, 1.5),
    "--max-acceleration": ("acceleration", 2.0, 2.0),
    "--max-jerk": ("jerk", 9.0, 9.0),
    "--max-snap": ("snap", 30.0, 30.0),
    "--max-thrust": ("max_thrust", 1.2, 1.2),
    "--max-tilt": ("tilt", 20.0, math.radians(20.0)),
    "--max-body-rate": ("body_rate", 1.0, 1.0),
}


@pytest.mark.slow
@pytest.mark.parametrize("option", OPTIONS)
def test_each_limit_alone_binds_and_says_where(call, option):
    name, value, limit = OPTIONS[option]
    others = ",".join({"speed", "acceleration", "tilt", "jerk", "altitude"} - {name})
    found = figures(call("line", option, value, "--no-limit", others, "--json"))
    (used,) = found["limits"]
    assert used["name"] == name and used["limit"] == pytest.approx(limit)
    assert found["binding"] == [name] and 0.999 <= used["fraction"] <= 1.0 + 1e-9
    assert used["leg"] == 0 and 0.0 <= used["instant"] <= found["duration"]


def limits_of(run):
    return {used["name"]: used["limit"] for used in figures(run)["limits"]}


@pytest.mark.slow
@pytest.mark.parametrize("command", [("rect",), ("circle",), ("plan", "points.csv"), ("line",)])
def test_one_limit_named_leaves_the_others_at_ordinary_flight(call, tmp_path, command):
    (tmp_path / "points.csv").write_text("x,y,z\n0,0,1\n4,0,1\n4,3,1.5\n")
    found = figures(call(*command, "--max-speed", 8, "--json"))
    assert {used["name"]: used["limit"] for used in found["limits"]} == {"speed": 8, "acceleration": 6, "jerk": 30}
    assert found["max_acceleration"] <= 6.0 + 1e-8
    slower = {"speed": 3.0, "acceleration": 4.0, "jerk": 20.0}  # built up in as long as the ordinary one
    assert limits_of(call(*command, "--max-acceleration", 4, "--json")) == pytest.approx(slower)


@pytest.mark.slow
@pytest.mark.parametrize("limits", ["{max_thrust: 2}", "{max_thrust: 2, speed: 1}"])
def test_a_thrust_stands_for_all_that_a_vehicle_can_do_in_files_and_options(call, tmp_path, limits):
    """In a file it replaced what holds unasked, and as an option it did not."""
    (tmp_path / "points.csv").write_text("x,y,z\n0,0,1\n4,0,1\n4,3,1.5\n")
    (tmp_path / "said.yaml").write_text(f"waypoints: [[0,0,1],[4,0,1],[4,3,1.5]]\nlimits: {limits}\n")
    named = ("--max-thrust", 2, *(("--max-speed", 1) if "speed" in limits else ()))
    in_file = limits_of(call("plan", "said.yaml", "--json"))
    assert limits_of(call("plan", "points.csv", *named, "--json")) == in_file
    assert in_file == {"max_thrust": 2.0} | ({"speed": 1.0} if "speed" in limits else {})


def test_a_small_tilt_alone_does_not_climb(call, tmp_path):
    (tmp_path / "points.csv").write_text("x,y,z\n0,0,1.5\n4,0,1.5\n4,3,1.5\n0,3,2\n")
    tilted = ("plan", "points.csv", "--max-tilt", 0.6)
    assert call(*tilted, "-o", "ordinary.csv").returncode == 0
    heights = minsnap.read_csv(tmp_path / "ordinary.csv").position[:, 2]
    assert -0.5 <= heights.min() and heights.max() <= 4.0
    free = figures(call(*tilted, "--no-limit", "altitude,speed,acceleration", "-o", "free.csv", "--json", "--force"))
    assert minsnap.read_csv(tmp_path / "free.csv").position[:, 2].max() > 10.0
    assert "the speed is not limited and reaches" in free["note"] and "the path goes over" in free["note"]


def test_what_holds_unasked_is_taken_off_by_name(call):
    assert limits_of(call("rect", "--max-speed", 2, "--no-limit", "acceleration", "--json")) == {
        "speed": 2.0,
        "tilt": math.pi / 4,
        "jerk": 30.0,
    }
    found = figures(call("rect", "--max-speed", 8, "--no-limit", "acceleration,tilt,jerk", "--json"))
    assert len(found["limits"]) == 1 and "the acceleration is not limited and reaches" in found["note"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--no-limit", "snap"), "--no-limit is 'snap': it takes speed, acceleration, tilt, jerk, altitude"),
        (("--no-limit", "speed", "--max-speed", 3), "the speed is limited and its limit taken off"),
        (("--no-limit", "speed,acceleration,tilt,jerk"), "--no-limit leaves no limit"),
        (("--no-limit", "speed", "--time", 9), "leave out --no-limit"),
        (("--no-limit", "tilt"), "--no-limit tilt takes off a limit that does not hold here: leave it out"),
        (("--no-limit", "altitude,tilt", "--max-jerk", 9), "takes off a limit that does not hold here"),
    ],
)
def test_limits_taken_off_without_sense_are_status_2(call, options, said):
    run = call("rect", *options)
    assert run.returncode == 2 and said in run.stderr


@pytest.mark.parametrize(
    "command",
    ["circle", "line", *(f"plan {of}" for of in ("points.csv", "plane.csv", "own.yaml", "points.csv --laps 1"))],
)
@pytest.mark.parametrize("name", ["altitude", "tilt"])
def test_a_limit_is_taken_off_where_it_holds(call, tmp_path, command, name):
    (tmp_path / "points.csv").write_text("x,y,z\n0,0,1\n4,0,1\n4,3,1.5\n")
    (tmp_path / "plane.csv").write_text("x,y\n0,0\n4,0\n4,3\n")
    (tmp_path / "own.yaml").write_text("waypoints: [[0, 0, 1], [4, 0, 1]]\nlimits: {speed: 2, tilt: 0.3}\n")
    held = command in (("line", "plan points.csv") if name == "altitude" else ("plan points.csv --laps 1",))
    held |= command == "plan own.yaml"
    run = call(*command.split(), "--no-limit", name, "--max-speed", 2)
    assert run.returncode == (0 if held else 2) and ("does not hold here" in run.stderr) != held


def test_a_rectangle_without_times_is_flown_within_careful_limits(call):
    for command in ("rect", "line"):
        found = figures(call(command, "--json"))
        limits = {used["name"]: used["limit"] for used in found["limits"]}
        assert limits == {"speed": 3.0, "acceleration": 6.0, "jerk": 30.0} and found["binding"]
        assert found["max_speed"] <= 3.0 + 1e-8 and found["max_acceleration"] <= 6.0 + 1e-8


def test_text_says_which_limits_bind(call):
    run = call("line", "--max-speed", 1.5, "--max-acceleration", 50, "--pieces", 1)
    lines = dict((line[:20].strip(), line[20:]) for line in run.stdout.splitlines())
    assert lines["limits that bind"] == "speed"
    assert lines["limit speed"].startswith("100.00 %, 1.5 of 1.5 m/s, on leg 0 at ")
    assert "m/s²" in lines["limit acceleration"]


def test_weight_of_time_instead_of_a_time(call):
    cheap, dear = (figures(call("rect", "--time-weight", weight, "--json")) for weight in (1, 100))
    assert cheap["duration"] > dear["duration"] and cheap["cost"] < dear["cost"]
    assert cheap["limits"] == []
    assert figures(call("line", "--time-weight", 10, "--json"))["limits"] == []


def test_time_and_its_weight_exclude_each_other(call):
    for command in ("rect", "line"):
        run = call(command, "--time", 12, "--time-weight", 3)
        assert run.returncode == 2 and "--time and --time-weight" in run.stderr and run.stdout == ""


def test_pieces_and_split_are_passed_on(call):
    one, three = (figures(call("line", "--max-acceleration", 2, "--pieces", n, "--json")) for n in (1, 3))
    assert three["duration"] < one["duration"]
    assert (
        figures(call("rect", "--time", 12, "--split", "distance", "--json"))["cost"]
        > figures(call("rect", "--time", 12, "--json"))["cost"]
    )


def test_a_time_too_short_for_the_limits_is_status_1_and_says_the_shortest(call):
    run = call("line", "--time", 1, "--max-speed", 2)
    assert run.returncode == 1 and "the shortest found is 7.6" in run.stderr


@pytest.mark.parametrize(
    ("option", "value"), [("--max-speed", 0), ("--max-thrust", 0.9), ("--max-tilt", 95), ("--max-yaw-rate", "nan")]
)
def test_limits_that_are_none_are_status_2(call, option, value):
    run = call("rect", option, value)
    assert run.returncode == 2 and len(run.stderr.splitlines()) == 1


def test_no_line_of_a_search_where_nobody_looks(process):
    run = process("rect", "--time", 12)
    assert run.returncode == 0 and run.stderr == ""


def test_a_yaw_rate_alone_is_kept_within_ordinary_limits(call, tmp_path):
    (tmp_path / "back.csv").write_text("x,y,z\n0,0,1\n4,0,1\n4,3,1\n")
    run = call("plan", "back.csv", "--yaw", "velocity", "--max-yaw-rate", 2, "-o", "out.csv", "--json")
    kept = {"speed": 3.0, "acceleration": 6.0, "jerk": 30.0, "yaw_rate": 2.0}
    assert limits_of(run) == kept and max(used["fraction"] for used in figures(run)["limits"]) <= 1.0 + 1e-9
    assert call("check", "out.csv").returncode == 0


def test_pieces_are_a_number_or_left_to_the_search(call):
    one, more, chosen = (figures(call("rect", "--pieces", n, "--json"))["duration"] for n in (1, 2, "auto"))
    assert chosen < more < 0.9 * one
    run = call("rect", "--pieces", "many")
    assert run.returncode == 2 and "--pieces is 'many'" in run.stderr
    run = call("rect", "--pieces", "0")
    assert run.returncode == 2 and "at least 1" in run.stderr


@pytest.mark.slow
def test_pieces_are_chosen_where_limits_choose_the_time(call, tmp_path):
    (tmp_path / "points.csv").write_text("x,y,z\n0,0,1\n4,0,1\n4,3,1.5\n")
    np.save(tmp_path / "map.npy", np.zeros((40, 30), dtype=bool))
    way = ("route", "map.npy", "--resolution", 0.2, "--start", 1, 1, "--goal", 7, 5)
    for command in (("rect",), ("line", "--max-speed", 3), ("plan", "points.csv"), way):
        plain, one, chosen = (figures(call(*command, *more, "--json")) for more in ((), *PIECES))
        assert plain["duration"] == chosen["duration"] < 0.97 * one["duration"]
    assert (
        figures(call("rect", "--time", 12, "--json"))["cost"]
        == figures(call("rect", "--time", 12, "--pieces", 1, "--json"))["cost"]
    )


PIECES = ("--pieces", 1), ("--pieces", "auto")


def test_a_search_ends_in_time_with_a_plan_that_keeps_its_limits(call):
    found = figures(call("rect", "--pieces", 3, "--time-limit", 1e-6, "--json"))
    assert found["binding"] and max(used["fraction"] for used in found["limits"]) <= 1.0 + 1e-9
    run = call("rect", "--time-limit", -1)
    assert run.returncode == 2 and "--time-limit" in run.stderr


def test_the_limits_of_a_file_hold_for_another_time(process, tmp_path):
    file = tmp_path / "course.yaml"
    file.write_text("waypoints: [[0, 0, 1], [4, 0, 1], [4, 3, 1], [0, 3, 1]]\ntotal_time: 6\nlimits: {speed: 4}\n")
    assert "limit speed" in process("plan", file, "--time", "4.4").stdout
    refused = process("plan", file, "--time", "2")
    assert refused.returncode == 1 and "2 s are too short for the limits" in refused.stderr

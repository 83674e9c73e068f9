"""The shapes from the command line: their defaults, files, figures and summaries."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import minsnap


def summary(run):
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)


def test_rect_alone_is_six_by_four_around_the_origin_corner_by_corner(call):
    assert call("rect", "-o", "a.csv").returncode == 0
    samples = minsnap.read_csv("a.csv")
    assert samples.position[[0, -1]] == pytest.approx(np.array([[-3.0, -2.0, 1.5]] * 2), abs=1e-9)
    assert not samples.velocity[[0, -1]].round(9).any()
    for corner in ((3.0, -2.0), (3.0, 2.0), (-3.0, 2.0)):
        assert np.linalg.norm(samples.position[:, :2] - corner, axis=1).min() < 0.1
    assert np.abs(samples.position[:, 0]).max() <= 3.3 + 1e-9 and np.abs(samples.position[:, 1]).max() <= 2.3 + 1e-9


def test_rect_says_what_the_library_says(call):
    said = summary(call("rect", "--width", "8", "--length", "4", "--time", "12", "--split", "distance", "--json"))
    path = minsnap.rectangle(8.0, 4.0, durations=[4, 2, 4, 2], corridor=0.3)
    certificate = minsnap.certify(path, corridor=0.3)
    assert said["cost"] == pytest.approx(path.cost(), rel=1e-6)
    assert (said["duration"], said["legs"]) == (pytest.approx(12.0), 4)
    for name in ("max_speed", "max_acceleration", "max_jerk"):
        assert said[name] == pytest.approx(getattr(certificate, name), rel=1e-6), name
    assert 0.0 <= said["corridor_margin"] < 1e-3
    assert said["rounds"] >= 1 and said["milliseconds"] > 0 and said["solver"] == path.report.solver


def test_text_and_json_tell_the_same(call):
    said, text = summary(call("line", "--json")), call("line").stdout
    for figure in (f"{said['duration']:.6g} s", f"{said['max_speed']:.4g} m/s", f"{said['cost']:.6g} m²/s⁷"):
        assert figure in text
    assert "None" not in text and "corridor" not in text


@pytest.mark.parametrize("option", [["--no-corridor"], ["--corridor", "0.5,0.2,0.5,0.2"]])
def test_rect_takes_other_corridors(call, option):
    margin = summary(call("rect", *option, "--json"))["corridor_margin"]
    assert margin is None if option == ["--no-corridor"] else margin >= 0.0


def test_laps_corner_and_direction(call):
    assert summary(call("rect", "--laps", "2", "--no-corridor", "--time", "40", "--json", "-o", "a.csv"))["legs"] == 8
    call("rect", "--start-corner", "2", "--clockwise", "--center", "1", "1", "--time", "20", "-o", "b.csv")
    samples = minsnap.read_csv("b.csv")
    assert samples.position[0] == pytest.approx([4.0, 3.0, 1.5])
    y = samples.position[len(samples) // 8, 1]
    assert y < 3.0 and samples.position[len(samples) // 8, 0] == pytest.approx(4.0, abs=0.31)


def test_line_alone_is_seven_metres_at_y_1(call):
    call("line", "-o", "a.csv")
    samples = minsnap.read_csv("a.csv")
    assert samples.position[[0, -1], :2] == pytest.approx(np.array([[0.0, 1.0], [7.0, 1.0]]))
    call("line", "--constant-speed", "-o", "b.csv")
    assert len(minsnap.read_csv("b.csv")) == 120


def test_circle_alone_is_three_metres_and_six_seconds_a_lap(call):
    said = summary(call("circle", "--ramp", "0", "--json", "-o", "a.csv"))
    assert said["duration"] == pytest.approx(6.0) and said["max_speed"] == pytest.approx(math.pi)
    assert said["cost"] is None and said["solver"] is None and said["output"] == "a.csv"
    position = minsnap.read_csv("a.csv").position
    assert len(position) == 121
    assert np.hypot(*position[:, :2].T) == pytest.approx(3.0)
    assert summary(call("circle", "--json"))["duration"] == pytest.approx(9.0)


def test_helix_and_eight(call):
    assert summary(call("helix", "--pitch", "-0.2", "--laps", "2", "-o", "a.csv", "--json"))["duration"] > 12.0
    assert minsnap.read_csv("a.csv").position[-1, 2] == pytest.approx(0.6)
    assert summary(call("eight", "--speed", "2", "--json"))["max_speed"] == pytest.approx(2.0, rel=1e-6)


def test_rect_without_a_time_is_flown_within_careful_limits_and_uses_one_in_full(call):
    said = summary(call("rect", "--json"))
    assert said["max_speed"] <= 3.0 * (1 + 1e-9) and said["max_acceleration"] <= 6.0 * (1 + 1e-9)
    assert max(used["fraction"] for used in said["limits"]) >= 0.999
    assert said["duration"] == pytest.approx(minsnap.rectangle().duration, rel=1e-9)


def test_contradicting_options_are_refused(call):
    run = call("rect", "--no-corridor", "--corridor", "0.3", "-o", "a.csv")
    assert (run.returncode, run.stdout) == (2, "")
    assert run.stderr == "minsnap: --no-corridor and --corridor 0.3 exclude each other: leave out one [input]\n"


def test_limits_asked_for_are_kept_and_told(call):
    run = call("line", "--max-speed", "2", "--max-tilt", "0.2", "--max-thrust", "1.5", "--max-jerk", "30")
    assert run.returncode == 0
    for name in ("speed", "tilt", "max thrust", "jerk"):
        share = next(line for line in run.stdout.splitlines() if line.startswith(f"limit {name} "))
        assert float(share[20:].partition(" %")[0]) <= 100.0, name


def test_a_time_too_short_for_the_limits_is_1_and_names_the_shortest(call, tmp_path):
    run = call("line", "--time", "2", "--max-speed", "1", "-o", "a.csv")
    assert run.returncode == 1 and list(tmp_path.iterdir()) == []
    assert "shortest" in run.stderr and run.stderr.count("\n") == 1


def test_more_pieces_and_other_splits_reach_the_plan(call):
    given = ["--time", "20", "--json"]
    one = summary(call("rect", "--split", "distance", *given))
    assert summary(call("rect", "--split", "distance", "--pieces", "2", *given))["cost"] < one["cost"]
    assert summary(call("rect", *given))["cost"] < one["cost"]


@pytest.mark.parametrize("yaw", ["velocity", "tilt"])
@pytest.mark.parametrize("frame", ["enu", "ned"])
def test_frame_rate_and_yaw_reach_the_file(call, frame, yaw):
    call("circle", "--yaw", yaw, "--frame", frame, "--rate", "50", "-o", "a.csv")
    read = minsnap.read_csv("a.csv", frame=frame)
    wanted = minsnap.circle(yaw=yaw).sample(50.0)
    assert np.array_equal(read.position, wanted.position)
    assert read.yaw == pytest.approx(wanted.yaw, abs=1e-12)


def test_a_heading_from_the_tilt_reaches_the_plan(call):
    call("rect", "--yaw", "tilt", "--time", "8", "-o", "a.csv")
    wanted = minsnap.rectangle(6.0, 4.0, altitude=1.5, total_time=8.0, corridor=0.3, yaw="tilt").sample(20.0)
    assert minsnap.read_csv("a.csv").yaw == pytest.approx(wanted.yaw, abs=1e-9)
    assert np.ptp(wanted.yaw) > 1e-3


def test_standard_output_carries_the_setpoints_and_nothing_else(process, tmp_path):
    run = process("circle", "-o", "-", "--json")
    file = tmp_path / "read.csv"
    file.write_text(run.stdout)
    assert np.array_equal(minsnap.read_csv(file).position, minsnap.circle().sample(20.0).position)
    assert json.loads(run.stderr)["output"] == "-"


@pytest.mark.slow
def test_figure_and_file_together(call, tmp_path):
    assert call("rect", "-o", "a.csv", "--plot", "a.svg").returncode == 0
    assert (tmp_path / "a.svg").read_text().startswith("<?xml")
    assert (tmp_path / "a.csv").exists()


@pytest.mark.slow
@pytest.mark.parametrize("target", ["-o", "--plot"])
def test_no_clobber_keeps_what_is_there(call, tmp_path, target):
    name = "a.csv" if target == "-o" else "a.png"
    file = tmp_path / name
    file.write_text("precious")
    run = call("circle", target, name, "--no-clobber")
    assert run.returncode == 2 and "there already" in run.stderr
    assert file.read_text() == "precious"
    assert call("circle", target, name).returncode == 0
    assert not file.read_bytes().startswith(b"precious")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["circle", "--frame", "north", "-o", "a.csv"], "enu"),
        (["circle", "--rate", "0", "-o", "a.csv"], "rate"),
        (["circle", "--rate", "nan", "-o", "a.csv"], "rate"),
        (["circle", "--plot", "a.jpg"], ".png"),
        (["circle", "--yaw", "sideways"], "--yaw"),
        (["circle", "--period", "3", "--speed", "1"], "exclude each other"),
        (["circle", "--radius", "nan"], "radius"),
        (["rect", "--corridor", "wide"], "--corridor"),
        (["rect", "--corridor", "-0.1"], "corridor"),
        (["rect", "--corridor", "0.3,0.3"], "corridor"),
        (["rect", "--degree", "8"], "degree"),
        (["rect", "--solver", "abacus"], "abacus"),
        (["rect", "--pieces", "0"], "pieces"),
        (["rect", "--max-speed", "0"], "speed"),
        (["rect", "--max-thrust", "0.9"], "thrust"),
        (["rect", "--split", "evenly", "--time", "9"], "evenly"),
        (["rect", "--start-corner", "4"], "corner"),
        (["line", "--goal", "0", "1", "1.5"], "starts and ends"),
        (["line", "--time", "-1"], "time"),
        (["line", "--constant-speed", "--time", "0"], "time"),
    ],
)
def test_bad_requests_are_2_in_one_sentence_and_write_nothing(call, tmp_path, arguments, said):
    run = call(*arguments)
    assert run.returncode == 2
    assert said in run.stderr and run.stderr.count("\n") == 1 and run.stdout == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("shape", ["circle", "helix", "eight"])
def test_shapes_are_flown_as_fast_as_limits_allow(call, shape):
    said = summary(call(shape, "--max-speed", "1.5", "--max-acceleration", "4", "--json", "-o", "a.csv"))
    assert max(used["fraction"] for used in said["limits"]) == pytest.approx(1.0, abs=1e-6) and said["binding"]
    assert said["max_speed"] <= 1.5 * (1 + 1e-9)
    assert "no period" in call(shape, "--max-speed", "1.5", "--period", "4").stderr


def test_the_nose_points_at_a_point(call, tmp_path):
    call("circle", "--center", "1", "2", "--look-at", "1", "2", "--radius", "2", "-o", "a.csv")
    read = minsnap.read_csv("a.csv")
    inwards = np.array([1.0, 2.0]) - read.position[:, :2]
    nose = np.stack((np.cos(read.yaw), np.sin(read.yaw)), axis=-1)
    assert (nose * inwards).sum(axis=1) == pytest.approx(np.full(len(nose), 2.0))
    (tmp_path / "w.csv").write_text("0,0,1\n3,0,1\n3,2,1\n")
    call("plan", "w.csv", "--look-at", "1", "4", "-o", "b.csv")
    read = minsnap.read_csv("b.csv")
    assert np.tan(read.yaw) == pytest.approx((4.0 - read.position[:, 1]) / (1.0 - read.position[:, 0]), rel=1e-6)
    assert "give one of them" in call("circle", "--yaw", "3", "--look-at", "1", "2").stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--split", "distance"), "leave out --split"),
        (("--time-weight", 9), "leave out --time-weight"),
        (("--time-limit", 9, "--pieces", 2), "leave out --pieces, --time-limit"),
        (("--max-speed", 2), "leave out a limit such as --max-speed"),
    ],
)
def test_options_of_planning_beside_a_constant_speed_are_named(call, words, said):
    run = call("line", "--constant-speed", *words)
    assert run.returncode == 2 and f"has nothing to plan: {said} [timing]" in run.stderr

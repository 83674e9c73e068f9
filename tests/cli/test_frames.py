"""Axes on the command line: every file says its own, waypoints take them, and summaries print them."""

from __future__ import annotations

import json

import numpy as np
import pytest

import minsnap
from minsnap.files.convert import read_any, write_any
from minsnap.flight.mavlink.offboard import prepare
from minsnap.flight.mavlink.stream_options import StreamOptions

POINTS = "x,y,z,yaw\n0,0,-1,0\n4,0,-1,0.5\n4,3,-2,1\n"


def test_a_moved_file_is_checked_in_its_own_axes(call, tmp_path):
    run = call("rect", "--frame", "ned", "-o", "a.csv")
    assert run.returncode == 0
    told = {line[:20].strip(): line[20:] for line in run.stdout.splitlines()}
    assert (told["written"], told["beside it"], told["frame"]) == ("a.csv", "a.csv.meta", "ned")
    (tmp_path / "moved").mkdir()
    (tmp_path / "a.csv").rename(tmp_path / "moved" / "a.csv")
    checked = call("check", "moved/a.csv")
    assert checked.returncode == 0 and checked.stdout.split()[:2] == ["frame", "ned"]
    refused = call("check", "moved/a.csv", "--from-frame", "enu")
    assert refused.returncode == 2 and "is in ned, as its header says" in refused.stderr


@pytest.mark.parametrize("frame", ["ned", "frd", "optitrack"])
def test_figures_and_faults_are_of_the_columns_of_the_file(call, tmp_path, frame):
    """They were in ENU below the name of the file's frame, so that a fault was said of another column."""
    assert call("rect", "--pieces", 1, "--frame", frame, "-o", "a.csv").returncode == 0
    names, *rows = [line.split(",") for line in (tmp_path / "a.csv").read_text().splitlines()]
    told = json.loads(call("check", "a.csv", "--json").stdout)
    columns = dict(zip(names, np.array(rows, dtype=float).T, strict=True))
    for axis in told["axes"]:
        assert (axis["lowest"], axis["highest"]) == (columns[axis["name"]].min(), columns[axis["name"]].max())
    rows[40][names.index("vy")] = "9"
    (tmp_path / "b.csv").write_text("\n".join(map(",".join, [names, *rows])) + "\n")
    problems = json.loads(call("check", "b.csv", "--json").stdout)["problems"]
    assert problems and all("vy" in problem for problem in problems)
    assert any("vy there goes from" in problem and "to 9" in problem or "vy is 9" in problem for problem in problems)


def test_a_file_without_a_frame_below_ground_is_asked_for_it(call, tmp_path):
    (tmp_path / "a.csv").write_text("t,x,y,z\n0,0,0,-1\n0.1,0,0,-1\n0.2,0,0,-1\n")
    run = call("check", "a.csv")
    assert run.returncode == 2 and "a.csv lies below ground throughout (z from -1 to -1 m)" in run.stderr
    assert call("check", "a.csv", "--from-frame", "ned").returncode == 0


def test_files_in_axes_of_their_own_say_those(call):
    run = call("rect", "-o", "a.json", "--json")
    assert json.loads(run.stdout)["frame"] == "enu" and json.loads(run.stdout)["beside"] is None
    assert json.loads(call("rect", "--json").stdout)["frame"] is None


def test_waypoints_may_be_in_other_axes(call, tmp_path):
    (tmp_path / "points.csv").write_text(POINTS)
    run = call("plan", "points.csv", "--time", 9)
    assert run.returncode == 2 and "give --from-frame ned, or enu" in run.stderr
    assert call("plan", "points.csv", "--time", 9, "--from-frame", "ned", "-o", "a.csv").returncode == 0
    found = minsnap.read_csv(tmp_path / "a.csv")
    assert np.allclose(found.position[[0, -1]], [[0, 0, 1], [3, 4, 2]])
    assert np.allclose(found.yaw[[0, -1]], [np.pi / 2, np.pi / 2 - 1.0])
    assert call("plan", "points.csv", "--time", 9, "--from-frame", "enu", "-o", "b.csv").returncode == 0
    assert np.allclose(minsnap.read_csv(tmp_path / "b.csv").position[-1], [4, 3, -2])


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.csv", "x,y\n0,0\n4,0\n", "waypoints of 2 coordinates are in ENU"),
        ("a.yaml", "waypoints: [[0,0,1],[4,0,1]]\nroom: [[-1,-1,0],[5,5,3]]\n", "are in ENU"),
        ("a.yaml", "waypoints: [[0,0,1],[4,0,1]]\nlaps: 2\n", "is flown as a course, which is in ENU"),
        ("a.csv", "x,y,z\n0,0,1\n4,0,1\n", "no frame is called 'esu'"),
    ],
)
def test_axes_that_cannot_be_taken_are_status_2(call, tmp_path, name, text, said):
    (tmp_path / name).write_text(text)
    run = call("plan", name, "--from-frame", "esu" if "esu" in said else "ned")
    assert run.returncode == 2 and said in run.stderr and len(run.stderr.splitlines()) == 1


@pytest.mark.parametrize(("header", "mark"), [("lat,lon,alt", ","), ("Latitude;Longitude;Altitude", ";")])
def test_latitudes_are_planned_in_metres(call, tmp_path, header, mark):
    rows = [mark.join(row) for row in (("47.1", "8.1", "10"), ("47.101", "8.1", "10"))]
    (tmp_path / "a.csv").write_text("\n".join([header, *rows]) + "\n")
    run = call("plan", "a.csv", "-o", "plan.json")
    assert run.returncode == 0, run.stderr
    curve = read_any(tmp_path / "plan.json")
    assert np.linalg.norm(curve(curve.duration) - curve(0.0)) == pytest.approx(111.18, abs=0.1)


def test_latitudes_without_altitudes_are_refused_by_the_column(call, tmp_path):
    (tmp_path / "a.csv").write_text("name,lat,lng\n47.1,8.1,10\n47.2,8.1,10\n")
    run = call("plan", "a.csv")
    assert run.returncode == 2 and "no column is known as alt" in run.stderr


def test_a_frame_beside_two_files_is_of_the_one_that_has_none(call, tmp_path):
    minsnap.write_csv(minsnap.line(), tmp_path / "flown.csv", frame="ned")
    write_any(minsnap.line(), tmp_path / "plan.json")
    done = call("compare", "plan.json", "flown.csv", "--frame", "ned", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["flown.csv"]["rmse_3d"] < 1e-6
    assert prepare(tmp_path / "plan.json", StreamOptions(frame="flu")).frame == "frd"
    done = call("check", "plan.json", "--frame", "ned")
    assert done.returncode == 2 and "plan.json holds polynomials, which have their own axes" in done.stderr

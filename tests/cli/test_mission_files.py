"""Missions by latitude and longitude on the command line: in and out."""

import json
import re

import numpy as np
import pytest

import minsnap
from minsnap.files.geodetic_missions import read_mission

ORIGIN = ("--origin", "47.3977", "8.5456", "488")
POINTS = "x,y,z\n0,0,10\n40,0,12\n40,30,15\n"


def test_a_mission_is_written_and_planned_again(call, tmp_path):
    (tmp_path / "points.csv").write_text(POINTS)
    for name in ("m.plan", "m.kmz"):
        done = call("plan", "points.csv", "--max-speed", 6, "-o", name, *ORIGIN)
        assert done.returncode == 0 and "waypoints, whose lines are within 0." in done.stdout, done.stderr
        again = call("plan", name, "--max-speed", 6, "-o", "again.csv", "--json")
        assert again.returncode == 0, again.stderr
        assert json.loads(again.stdout)["beside"] == "again.csv.meta"  # which says the origin
    first = minsnap.read_csv(tmp_path / "again.csv").position[0]
    assert first == pytest.approx([0.0, 0.0, 10.0], abs=1e-3)
    (tmp_path / "path.json").unlink(missing_ok=True)
    assert call("plan", "points.csv", "--max-speed", 6, "-o", "path.json").returncode == 0
    fine = call("convert", "path.json", "fine.waypoints", *ORIGIN, "--within", 0.05)
    assert fine.returncode == 0 and fine.stdout.startswith("fine.waypoints: ardupilot")
    home = tuple(map(float, ORIGIN[1:]))
    assert len(read_mission(tmp_path / "fine.waypoints").points) > len(read_mission(tmp_path / "m.kmz", home).points)
    laps = call("plan", "fine.waypoints", "--takeoff", "--land", "-o", "course.waypoints")
    assert laps.returncode == 0 and "waypoints, whose lines" in laps.stdout, laps.stderr
    assert np.allclose(read_mission(tmp_path / "course.waypoints").home, home, atol=1e-6)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("plan", "points.csv", "-o", "m.plan"), "give the origin, latitude and longitude [degrees]"),
        (("rect", "-o", "m.plan"), "(--origin LAT LON ALT), which plan and convert have"),
        (("plan", "points.csv", "-o", "m.csv", "--within", "1"), "--within is of a mission that is written"),
        (("plan", "points.csv", "-o", "m.plan", *ORIGIN, "--within", "-1"), "--within is -1: give a positive distance"),
        (("plan", "points.csv", "-o", "m.plan", "--origin", "97", "8", "4"), "the origin has the coordinates"),
        (("plan", "bad.waypoints"), "its first line is not QGC WPL 110"),
        (("plan", "bad.kml", "-o", "m.csv"), "is not KML"),
        (("convert", "points.csv", "m.kmz"), "give the origin"),
    ],
)
def test_what_is_wrong_is_one_sentence_and_nothing_is_written(call, tmp_path, words, said):
    (tmp_path / "points.csv").write_text(POINTS)
    (tmp_path / "bad.waypoints").write_text("1 2 3\n")
    (tmp_path / "bad.kml").write_text("<kml")
    done = call(*words)
    assert done.returncode == 2 and said in done.stderr and done.stderr.count("\n") == 1, done.stderr
    assert not list(tmp_path.glob("m.*"))


SPEEDS = """QGC WPL 110
0 1 0 16 0 0 0 0 47.3977 8.5456 488 1
1 0 3 22 0 0 0 0 47.3977 8.5456 10 1
2 0 3 16 0 0 0 0 47.3979 8.5456 10 1
3 0 3 178 1 1.5 -1 0 0 0 0 1
4 0 3 16 0 0 0 0 47.3981 8.5456 10 1
5 0 3 178 1 5 -1 0 0 0 0 1
6 0 3 16 0 0 0 0 47.3981 8.5461 10 1
"""


def test_changes_of_speed_bound_their_legs(call, tmp_path):
    (tmp_path / "m.waypoints").write_text(SPEEDS)
    assert minsnap.read_waypoints(tmp_path / "m.waypoints").speeds == pytest.approx([3.0, 1.5, 5.0])
    done = call("plan", "m.waypoints", "-o", "a.json")
    assert done.returncode == 0, done.stderr
    path = minsnap.files.convert.read_any(tmp_path / "a.json")
    ends = path.leg_breaks
    greatest = [
        np.linalg.norm(path(np.linspace(*pair, 201), 1), axis=1).max() for pair in zip(ends[:-1], ends[1:], strict=True)
    ]
    assert (np.array(greatest) <= np.array([3.0, 1.5, 5.0]) + 1e-6).all() and greatest[2] > 3.0
    course = call("plan", "m.waypoints", "--land")
    assert "a course has one speed: those of the legs are left out" in course.stdout


@pytest.mark.parametrize("speeds", [True, False])
def test_how_far_a_mission_leaves_its_lines_is_told_where_nothing_holds_it_there(call, tmp_path, speeds):
    rows = [row for row in SPEEDS.splitlines() if speeds or " 178 " not in row]
    (tmp_path / "m.waypoints").write_text("\n".join(rows) + "\n")
    done = call("plan", "m.waypoints", "-o", "free.json")
    told = float(re.search(r"leaves the lines between waypoints by up to ([\d.]+) m", done.stdout)[1])
    path, points = (
        minsnap.files.convert.read_any(tmp_path / "free.json"),
        minsnap.read_waypoints(tmp_path / "m.waypoints"),
    )
    places = np.array(points.points)
    ends = path.leg_breaks
    apart = []
    for leg, (here, there) in enumerate(zip(places[:-1], places[1:], strict=True)):
        along = path(np.linspace(ends[leg], ends[leg + 1], 2001)) - here
        share = np.clip(along @ (there - here) / ((there - here) @ (there - here)), 0.0, 1.0)
        apart.append(np.linalg.norm(along - share[:, None] * (there - here), axis=1).max())
    assert told == pytest.approx(max(apart), abs=0.006) and told > 0.1
    assert "leaves the lines" not in call("plan", "m.waypoints", "--corridor", 0.5).stdout

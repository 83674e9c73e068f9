"""Missions that are written: few lines near the path, read back where they were, in every format."""

import json
import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest

import minsnap
from minsnap.errors import FileError
from minsnap.files.convert import file_formats, write_any
from minsnap.files.formats.missions import MAKERS, write_mission
from minsnap.files.geodesy import local_positions
from minsnap.files.geodetic_missions import read_mission
from minsnap.files.mission_points import few_points

ORIGIN = (47.3977, 8.5456, 488.0)
POINTS = [(0, 0, 10), (60, 0, 12), (60, 40, 15), (0, 40, 10), (-20, 20, 20)]
PATH = minsnap.plan(POINTS, limits=minsnap.Limits(speed=8, acceleration=4), pieces=3)


def apart(points, path):
    """Greatest distance of any sample from the nearest of all lines between points."""
    samples = path(np.linspace(0.0, path.duration, 4001))
    least = np.full(len(samples), np.inf)
    for a, b in zip(points[:-1], points[1:], strict=True):
        share = np.clip((samples - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        least = np.minimum(least, np.linalg.norm(samples - a - share[:, None] * (b - a), axis=1))
    return least.max()


@pytest.mark.parametrize("tolerance", [0.05, 0.5, 5.0])
def test_lines_between_few_points_stay_near_the_path(tolerance):
    few = few_points(PATH, tolerance)
    assert apart(few.points, PATH) <= few.distance <= tolerance
    assert len(few.points) < {0.05: 40, 0.5: 14, 5.0: 7}[tolerance]
    assert few.points[0] == pytest.approx(POINTS[0]) and few.points[-1] == pytest.approx(POINTS[-1])
    assert few.speeds.max() <= 8.0 + 1e-9 and (few.holds == 0.0).all()


def test_no_fewer_points_serve_than_the_least_number_of_a_circle():
    """A chord of sagitta s spans 2 arccos(1 - s / r): a whole circle needs its number of chords, and gets one more."""
    circle = minsnap.as_polynomials(minsnap.circle(radius=10.0, period=20.0), 1e-6)
    for sagitta in (0.02, 0.2, 2.0):
        least = int(np.ceil(np.pi / np.arccos(1.0 - sagitta / 10.0)))
        assert least <= len(few_points(circle, sagitta).points) - 1 <= least + 1


def test_a_straight_path_has_two_points_and_a_hold_its_time():
    line = minsnap.plan([(0, 0, 5), (30, 0, 5)], limits=minsnap.Limits(speed=5, acceleration=3))
    assert len(few_points(line, 0.01).points) == 2
    course = minsnap.Course(
        tuple(minsnap.Stop(place, hold=hold) for place, hold in (((0, 0, 5), 0), ((9, 0, 5), 2.5), ((9, 9, 5), 0))),
        limits=minsnap.Limits(speed=5, acceleration=3),
    )
    few = few_points(minsnap.plan_mission(course).trajectory, 0.1)
    assert few.points[:, :2] == pytest.approx(np.array([(0, 0), (9, 0), (9, 9)]), abs=1e-4)
    assert few.holds == pytest.approx([0.0, 2.5, 0.0], abs=0.3)


@pytest.mark.parametrize("name", MAKERS)
def test_what_is_written_is_read_back_where_it_was(tmp_path, name):
    file = tmp_path / f"a{MAKERS[name][0] or '.csv'}"
    said = write_mission(PATH, file, name, ORIGIN, 0.5)
    mission = read_mission(file, ORIGIN)
    expected = few_points(PATH, 0.5)
    assert mission.points == pytest.approx(expected.points, abs=2e-3)
    assert f"{len(mission.points)} waypoints, whose lines are within 0." in said
    if name != "kml":
        assert mission.speeds == pytest.approx(expected.speeds, rel=0.02)
    assert apart(mission.points, PATH) <= 0.505
    assert file_formats()[name].geodetic


def test_the_first_item_takes_off_and_a_path_to_the_ground_lands(tmp_path):
    course = minsnap.Course(
        (minsnap.Stop((0, 0, 6)), minsnap.Stop((20, 0, 6))), land=True, takeoff=True, limits=minsnap.Limits(speed=4)
    )
    path = minsnap.plan_mission(course).trajectory
    write_mission(path, tmp_path / "a.plan", "qgroundcontrol", ORIGIN)
    items = json.loads((tmp_path / "a.plan").read_text())["mission"]["items"]
    flown = [item for item in items if item["command"] != 178]
    assert [item["command"] for item in flown] == [22, 16, 21]
    assert flown[0]["params"][6] == pytest.approx(6.0, abs=1e-3) and flown[2]["params"][6] == 0.0
    assert [item["doJumpId"] for item in items] == list(range(1, len(items) + 1))
    assert all(item["params"][3] is None for item in flown)


def test_headings_are_clockwise_from_north(tmp_path):
    path = minsnap.plan(POINTS, total_time=40.0, yaw=np.pi / 2)
    write_mission(path, tmp_path / "a.plan", "qgroundcontrol", ORIGIN)
    items = json.loads((tmp_path / "a.plan").read_text())["mission"]["items"]
    assert {item["params"][3] for item in items if item["command"] == 16} == {0.0}


def test_it_agrees_with_the_reader_of_mavlink(tmp_path):
    mavwp = pytest.importorskip("pymavlink.mavwp")
    write_mission(PATH, tmp_path / "a.waypoints", "ardupilot", ORIGIN, 0.5)
    loader = mavwp.MAVWPLoader()
    loader.load(str(tmp_path / "a.waypoints"))
    items = [loader.wp(i) for i in range(loader.count())]
    assert (items[0].x, items[0].y, items[0].z) == pytest.approx(ORIGIN)
    places = [(item.x, item.y, item.z + ORIGIN[2]) for item in items if item.command in (16, 22)][1:]
    assert local_positions(places, ORIGIN) == pytest.approx(few_points(PATH, 0.5).points, abs=2e-3)
    assert [item.param2 for item in items if item.command == 178] == pytest.approx([8.0])


def test_dji_s_archive_holds_both_files_in_its_names(tmp_path):
    write_mission(PATH, tmp_path / "a.kmz", "dji", ORIGIN, 0.5)
    with zipfile.ZipFile(tmp_path / "a.kmz") as archive:
        assert sorted(archive.namelist()) == ["wpmz/template.kml", "wpmz/waylines.wpml"]
        root = ElementTree.fromstring(archive.read("wpmz/waylines.wpml"))
    space = {"k": "http://www.opengis.net/kml/2.2", "w": "http://www.dji.com/wpmz/1.0.2"}
    marks = root.findall(".//k:Placemark", space)
    assert [int(mark.find("w:index", space).text) for mark in marks] == list(range(len(few_points(PATH, 0.5).points)))
    assert root.find(".//w:executeHeightMode", space).text == "relativeToStartPoint"


def test_what_a_mission_cannot_be_is_refused(tmp_path):
    flat = minsnap.plan([(0, 0), (3, 3)], total_time=3.0)
    with pytest.raises(FileError, match="a mission has 3 coordinates, and the path has 2"):
        write_any(flat, tmp_path / "a.plan", origin=ORIGIN)
    with pytest.raises(FileError, match=r"holds latitudes and longitudes: give the origin.*\(--origin LAT LON ALT\)"):
        write_any(PATH, tmp_path / "a.plan")
    with pytest.raises(FileError, match="the origin has the coordinates"):
        write_any(PATH, tmp_path / "a.plan", origin=(97.0, 8.0, 1.0))
    with pytest.raises(FileError, match="the distance within which a mission stays"):
        write_any(PATH, tmp_path / "a.plan", origin=ORIGIN, within=0.0)
    with pytest.raises(FileError, match="need more points: .* m would do"):
        write_any(PATH, tmp_path / "a.plan", origin=ORIGIN, within=1e-9)
    assert not (tmp_path / "a.plan").exists()
    note = write_any(minsnap.circle(radius=5.0), tmp_path / "c.kml", origin=ORIGIN, within=0.2)[1]
    assert "waypoints, whose lines are within" in note

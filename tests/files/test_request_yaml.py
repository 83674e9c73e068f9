"""Requests in YAML: everything reads back exactly, and what is malformed is refused with its place."""

from dataclasses import replace
from math import pi

import pytest

import minsnap
from minsnap.durations.search_options import Search
from minsnap.errors import FileError
from minsnap.files.file_request import FileRequest
from minsnap.files.request_yaml import read_request, write_request
from minsnap.paths.missions.course import read_course

POINTS = ((0.0, 0.0, 1.0), (4.0, 0.1, 1.0), (4.0, 3.0, 1.0 / 3.0))
BOXES = (((-1.0, -1.0, 0.0), (5.0, 1.0, 2.0)), ((3.0, -1.0, 0.0), (5.0, 4.0, 2.0)))

REQUESTS = [
    FileRequest(POINTS),
    FileRequest(POINTS, durations=(4.1, 3.0), yaw=(0.0, 0.1, 0.2), corridor=(0.3, 0.1)),
    FileRequest(POINTS, total_time=7.3, yaw="velocity", room=((-9.0, -9.0, 0.0), (9.0, 9.0, 3.0)), degree=9),
    FileRequest(POINTS, limits=(("speed", 3.0), ("tilt", 0.5)), rotors=0.2, vehicle="crazyflie", pieces="auto"),
    FileRequest(POINTS, total_time=8.0, boxes=BOXES, yaw=0.25, degree=9, continuity=4, pieces=2, frame="ned"),
    FileRequest((*POINTS, POINTS[0]), total_time=9.0, closed=True),
    FileRequest(POINTS, limits=(("speed", 8.0),)),
    FileRequest(POINTS, limits=(("speed", 8.0), ("acceleration", 20.0))),
    FileRequest(POINTS, total_time=9.0, limits=(("speed", 8.0),)),
    FileRequest(POINTS, total_time=9.0, waypoint_tolerance=0.2, solver="clarabel", search=Search(split="distance")),
    FileRequest(POINTS, search=Search(time_weight=1.0 / 3.0, time_limit=4.0)),
    FileRequest(POINTS, limits=(("speed", 3.0),), tracking=minsnap.Loop.px4({"MPC_XY_P": 1.1}, drag=1 / 3), wind=0.7),
]


@pytest.mark.parametrize("request_", REQUESTS)
def test_a_request_reads_back_equal(tmp_path, request_):
    write_request(request_, tmp_path / "scene.yaml")
    assert read_request(tmp_path / "scene.yaml") == request_


def test_waypoint_files_are_requests_too(tmp_path):
    (tmp_path / "a.csv").write_text("x,y,z,duration\n0,0,1,\n4,0,1,2.5\n")
    (tmp_path / "b.yaml").write_text("- [0, 0, 1]\n- [4, 0, 1]\n")
    assert read_request(tmp_path / "a.csv") == FileRequest(((0.0, 0.0, 1.0), (4.0, 0.0, 1.0)), (2.5,))
    assert read_request(tmp_path / "b.yaml").waypoints == ((0.0, 0.0, 1.0), (4.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("said", "kept"),
    [
        ("{}", {"speed": 3.0, "acceleration": 6.0, "jerk": 30.0}),
        ("{speed: 8}", {"speed": 8.0, "acceleration": 6.0, "jerk": 30.0}),
        ("{acceleration: 20}", {"speed": 3.0, "acceleration": 20.0, "jerk": 100.0}),
        ("{speed: 8, jerk: null}", {"speed": 8.0, "acceleration": 6.0}),
        ("{jerk: 40}", {"jerk": 40.0, "speed": 3.0, "acceleration": 6.0}),
        ("{speed: 8, acceleration: null}", {"speed": 8.0, "tilt": pi / 4, "jerk": 30.0}),
        ("{speed: 8, acceleration: null, tilt: null, jerk: null}", {"speed": 8.0}),
        ("{max_thrust: 2.5}", {"max_thrust": 2.5}),
    ],
)
def test_limits_that_choose_the_time_are_completed(tmp_path, said, kept):
    file = tmp_path / "scene.yaml"
    file.write_text(f"waypoints: [[0,0,1],[4,0,1]]\nlimits: {said}\n")
    assert dict(read_request(file).limits) == pytest.approx(kept)
    file.write_text(f"waypoints: [[0,0,1],[4,0,1]]\nlaps: 1\nlimits: {said}\n")
    assert read_course(file).bounds.given() == pytest.approx(kept)


def test_one_half_width_is_for_every_leg(tmp_path):
    (tmp_path / "a.yaml").write_text("waypoints: [[0,0,1],[4,0,1],[4,2,1]]\ncorridor: 0.3\n")
    assert read_request(tmp_path / "a.yaml").corridor == (0.3, 0.3)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("total_time: soon", "total_time"),
        ("limits: {speed: fast}", "speed"),
        ("limits: {pace: 3}", "pace"),
        ("limits: {rotors: {vehicle: zeppelin}}", "zeppelin"),
        ("corridor: [0.3, true]", "corridor 1"),
        ("boxes: [[[0, 0, 0]]]", "boxes 0 is .*: give two corners"),
        ("room: 5", "room"),
        ("degree: 7.5", "degree"),
        ("pieces: many", "pieces"),
        ("closed: 1", "closed"),
        ("view: {frame: esu}", "esu"),
        ("speed: 3", "waypoints"),
    ],
)
def test_what_is_malformed_is_refused(tmp_path, line, said):
    (tmp_path / "a.yaml").write_text(f"waypoints: [[0,0,1],[4,0,1]]\n{line}\n")
    with pytest.raises(FileError, match=said):
        read_request(tmp_path / "a.yaml")


def test_arguments_give_the_plan_that_python_gives():
    found = minsnap.plan(**REQUESTS[4].request().arguments())
    boxes = minsnap.Boxes([box[0] for box in BOXES], [box[1] for box in BOXES])
    how = {"degree": 9, "continuity": 4, "pieces": 2, "yaw": 0.25}
    same = minsnap.plan(POINTS, total_time=8.0, corridor=boxes, **how)
    assert (found.control_points == same.control_points).all()
    walls = replace(REQUESTS[4], room=((-9.0, -9.0, 0.0), (9.0, 9.0, 3.0))).walls
    assert minsnap.certify(found, corridor=walls).ok

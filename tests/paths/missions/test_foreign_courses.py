"""Courses of other planners, as they write them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import minsnap
from minsnap.errors import FileError
from minsnap.paths.missions.course import is_course

RPG = "gates: [[1, 2, 3], [4, 5, 6]]\ninitial: {position: [0, 0, 1], attitude: [1, 0, 0, 0], velocity: [0, 0, 0]}\n"
RPG += "end: {position: [9, 9, 2]}\n"
PMM = "start: {position: [0, 0, 1], velocity: [1, 0, 0]}\nend: {position: [9, 9, 2], velocity: [0, 0, 0]}\n"
PMM += "waypoints: [[1, 2, 3], [4, 5, 6]]\n"
GATE = "{type: RectanglePrisma, position: [1, 2, 3], rpy: [0, -90, 30], width: 2.4, height: 2.4, "
GATE += "marginW: 0.8, marginH: 0.8}"
TOGT = "initState: {pos: [0, 0, 1], vel: [0, 0, 0]}\nendState: {pos: [9, 9, 2], vel: [0, 0, 0]}\n"
TOGT += "orders: [Gate1, Ball]\n"
TOGT += f"Gate1: {GATE}\nBall: {{type: SingleBall, position: [4, 5, 6], radius: 0.5, margin: 0.1}}\n"
NAVIGATOR = "coordinate_type: {0}\nreference_speed: 0.5\nreference_acceleration: 1.0\nheading_mode: {1}\n"
NAVIGATOR += "easting: [{2}]\nnorthing: [{3}]\nheight: [1, 1, 2]\nheading: [30, 80, 10]\n"
ENU = NAVIGATOR.format("enu", "manual", "0, 3, 3", "-3, -3, 0")


@pytest.fixture
def read(tmp_path):
    def _read(text):
        (tmp_path / "course.yaml").write_text(text)
        assert is_course(tmp_path / "course.yaml")
        return minsnap.read_course(tmp_path / "course.yaml")

    return _read


def centers(course):
    return [tuple(np.round(stop.center, 6)) for stop in course.stops]


@pytest.mark.parametrize("text", [RPG, PMM, TOGT])
def test_start_and_end_stand_beside_the_gates(read, text):
    course = read(text)
    assert centers(course) == [(0, 0, 1), (1, 2, 3), (4, 5, 6), (9, 9, 2)]
    moving = course.start is not None and np.any(course.start.get("velocity", 0.0))
    assert moving == (text == PMM)


def test_a_gate_by_its_angles_and_a_ball(read):
    stops = read(TOGT).stops
    gate = stops[1].place
    assert abs(gate.normal @ (np.cos(np.pi / 6), np.sin(np.pi / 6), 0.0)) == pytest.approx(1.0)
    edges = gate.edges()[1]
    assert edges == pytest.approx([0.8] * 4) and stops[2].ball == pytest.approx(0.45)  # margins are of the whole size


def shrunk(kind, **size):
    """Return the corners of TOGT-Planner's sources (src/shape/*.cpp), from rotations of its own."""
    half = {key: 0.5 * (size[key] - size.get("margin" + key[0].upper(), size.get("margin", 0.0))) for key in size}
    if kind == "Rectangle":
        w, h = half["width"], half["height"]
        return [(-h, w), (-h, -w), (h, -w), (h, w)]
    if kind == "Triangle":
        return [(-half["height"], half["width"]), (half["height"], 0.0), (-half["height"], -half["width"])]
    count, radius, first = {"Pentagon": (5, "radius", 0.0), "Hexagon": (6, "side", 0.5)}[kind]
    angles = np.pi * (first + 2.0 * np.arange(count) / count)
    return (size[radius] - size["margin"]) * np.stack((np.cos(angles), np.sin(angles)), axis=1)


@pytest.mark.parametrize(
    ("kind", "size"),
    [
        ("Triangle", {"width": 2.4, "height": 1.8, "margin": 0.3}),
        ("Rectangle", {"width": 2.4, "height": 1.8, "marginW": 0.2, "marginH": 0.6}),
        ("Pentagon", {"radius": 2.0, "margin": 0.2}),
        ("Hexagon", {"side": 1.5, "margin": 0.2}),
    ],
)
def test_a_gate_is_the_polygon_that_the_planner_keeps(read, kind, size):
    """A triangle was refused, and `length` left out without a word."""
    rpy, center = (20.0, -70.0, 35.0), np.array([1.0, 2.0, 3.0])
    made = {"type": f"{kind}Prisma", "position": center.tolist(), "rpy": list(rpy), "length": 3.0, **size}
    stop = read(TOGT.replace(f"Gate1: {GATE}", f"Gate1: {made}")).stops[1]
    x, y, z = Rotation.from_euler("xyz", rpy, degrees=True).as_matrix().T
    gate, (sides, offsets) = stop.gate, stop.gate.edges()
    kept = np.array(shrunk(kind, **size)) @ np.stack((x, y)) + center - gate.center
    touched = kept @ sides.T - offsets
    assert touched.max() < 1e-9 and (np.abs(touched) < 1e-9).sum(axis=1).tolist() == [2] * len(kept)
    assert stop.straight == 1.5 and gate.crossing * gate.normal == pytest.approx(-z)


def test_a_prism_is_flown_through_from_its_beginning_to_its_end(read):
    text = TOGT.replace("marginH: 0.8}", "marginH: 0.8, length: 4.0}").replace("[Gate1, Ball]", "[Gate1]")
    course = read(text).changed(limits=minsnap.Limits(speed=5, acceleration=8, jerk=60))
    gate, mission = course.stops[1].gate, minsnap.plan_mission(course)
    begins, ends = mission.trajectory.leg_breaks[[1, 3]]
    offsets = mission.trajectory(np.linspace(begins, ends, 2_001)) - gate.center
    along = offsets @ gate.normal * gate.crossing
    sides, rooms = gate.edges()
    assert along[[0, -1]] == pytest.approx([-2.0, 2.0]) and (np.diff(along) > 0.0).all()
    assert (offsets @ sides.T - rooms).max() <= 1e-6


def test_one_opening_of_several_laps_is_passed_once_a_lap():
    """Each passage was said of every gate at that place: nine lines for three."""
    gates = {k: minsnap.Gate((x, 0, 1), (1, 0, 0), 1.0) for k, x in enumerate([2, 6, 2, 6], start=1)}
    way = [(0, 0, 1), gates[1], gates[2], (8, 3, 1), (0, 3, 1), gates[3], gates[4], (8, 0, 1)]
    curve = minsnap.plan(way, limits=minsnap.Limits(speed=4, acceleration=8, jerk=60))
    assert [passed.gate for passed in minsnap.corridors.gate_passages(curve, gates)] == [1, 2, 3, 4]


def test_places_of_waypoint_navigator(read):
    course = read(ENU)
    assert centers(course) == [(0, -3, 1), (3, -3, 1), (3, 0, 2)]
    assert (course.limits.speed, course.limits.acceleration) == (0.5, 1.0)
    assert np.degrees(course.yaw) == pytest.approx([30, 80, 10])
    places = read(NAVIGATOR.format("gps", "auto", "8.68, 8.681, 8.681", "47.45, 47.45, 47.451"))
    assert places.stops[0].center == pytest.approx([0.0, 0.0, 1.0], abs=1e-6) and places.yaw == "velocity"
    assert 70.0 < places.stops[1].center[0] < 80.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (RPG.replace("[9, 9, 2]", "[9, 9]"), "end: position is"),
        (RPG.replace("end: {position: [9, 9, 2]}", ""), "has no position of its end"),
        (
            TOGT.replace("RectanglePrisma", "Cone"),
            "Gate1: type is 'Cone': TrianglePrisma, RectanglePrisma, .* are read",
        ),
        (TOGT.replace("marginH", "margin"), "Gate1: margin is not known of a RectanglePrisma: give width, height, mar"),
        (TOGT.replace("marginH", "stationary: false, marginH"), "stationary is False: gates that stand still are read"),
        (TOGT.replace("radius: 0.5", "radius: 0.5, length: 2"), "Ball: length is 2: a ball has none"),
        (TOGT.replace("height: 2.4", "height: -2.4"), "height is -2.4: give a number, not negative"),
        (TOGT.replace("height: 2.4", "heigth: 2.4"), "heigth is not known of a RectanglePrisma: give width, height"),
        (TOGT.replace("height: 2.4, ", ""), "Gate1: height is None: give one above the marginH of 0.8 m"),
        (TOGT.replace("orders: [Gate1, Ball]", "orders: [Gate7]"), "Gate7 is None: give its type"),
        (ENU.replace("easting: [0, 3, 3]", "easting: [0, 3]"), "give as many of each"),
        (ENU + "waiting_time: [0, 5]\n", "waiting_time is .*: give a time for each of 3 places"),
        (ENU + "waiting_time: [0, -5, 0]\n", "waiting_time is .*: give a time for each of 3 places"),
    ],
)
def test_what_is_malformed_is_one_sentence(tmp_path, text, said):
    (tmp_path / "course.yaml").write_text(text)
    with pytest.raises(FileError, match=said):
        minsnap.read_course(tmp_path / "course.yaml")


def test_such_a_course_is_flown(read):
    mission = minsnap.plan_mission(read(RPG).changed(limits=minsnap.Limits(speed=5, acceleration=8, jerk=60)))
    assert minsnap.certify(mission.trajectory, limits=mission.limits).ok


def test_a_table_with_holds_is_a_course(tmp_path):
    (tmp_path / "held.csv").write_text("x,y,z,hold\n0,0,1,\n4,0,1,2.5\n4,3,1,0\n")
    course = minsnap.read_course(tmp_path / "held.csv")
    assert [stop.hold for stop in course.stops] == [0.0, 2.5, 0.0]
    with pytest.raises(FileError, match="has a column hold: it is a course"):
        minsnap.read_waypoints(tmp_path / "held.csv")
    mission = minsnap.plan_mission(course)
    assert [part.name for part in mission.parts] == ["course", "hold", "course"]
    (tmp_path / "both.csv").write_text("x,y,hold,yaw\n0,0,,1\n4,0,2,1\n")
    with pytest.raises(FileError, match="has a column yaw beside hold"):
        minsnap.read_course(tmp_path / "both.csv")


def test_take_off_and_landing_have_speeds_of_their_own():
    stops = (minsnap.Stop((0, 0, 12)), minsnap.Stop((9, 0, 12)))
    slow = minsnap.plan_mission(minsnap.Course(stops, takeoff=True, land=True))
    quick = minsnap.plan_mission(minsnap.Course(stops, takeoff=True, land=True, takeoff_speed=2.5, land_speed=2.0))
    lengths = [[part.duration for part in mission.parts] for mission in (slow, quick)]
    assert lengths[1][0] < 0.6 * lengths[0][0] and lengths[1][2] < 0.4 * lengths[0][2]
    with pytest.raises(minsnap.errors.WaypointError, match="and land is not planned: give both"):
        minsnap.Course(stops, land_speed=1.0)


def test_waiting_times_are_holds(read):
    """They were left out without a word."""
    waits = read(ENU + "waiting_time: [0, 5, 0]\n")
    assert [stop.hold for stop in waits.stops] == [0.0, 5.0, 0.0]
    assert [stop.hold for stop in read(ENU + "waiting_time: 2.5\n").stops] == [0.0, 2.5, 0.0]

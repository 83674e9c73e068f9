"""Plans as JSON and YAML: the same curve, heading, corridor, limits and certificate."""

import json
from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap import Boxes, HalfSpaces, Limits, Polytopes, Room, RoundTube, Tube
from minsnap.errors import FileError
from minsnap.files.convert import read_any, write_any
from minsnap.files.formats.polynomials import read_polynomials, write_polynomials
from minsnap.vehicle import Quadrotor

CORNERS = [(0, 0, 1), (3, 0, 1), (3, 2, 1.5)]
LIMITS = Limits(speed=2.0, tilt=0.4, norm="axis")
BOX = Boxes([(-1, -1, 0), (2, -1, 0)], [(4, 1, 2), (4, 3, 3)])
SQUARE = np.vstack([np.eye(3), -np.eye(3)])


@pytest.fixture(scope="module")
def path():
    return minsnap.plan(CORNERS, [2.5, 2.0], corridor=0.3, yaw=[0.0, 0.7, 0.1], pieces=2)


def same(one, other):
    assert (one.control_points == other.control_points).all() and (one.durations == other.durations).all()
    assert one.pieces == other.pieces
    t = np.linspace(0.0, one.duration, 33)
    assert (one.yaw(t) == other.yaw(t)).all()


@pytest.mark.parametrize("name", ["plan.json", "plan.yaml", "plan.yml"])
def test_everything_reads_back_exactly(tmp_path, path, name):
    file = tmp_path / name
    write_polynomials(path, file, waypoints=CORNERS, corridor=0.3, limits=LIMITS, command=("minsnap", "plan"))
    found = read_polynomials(file)
    same(found.trajectory, path)
    same(read_any(file), path)
    assert (found.waypoints == np.array(CORNERS)).all() and found.corridor == 0.3
    assert found.limits == LIMITS and found.command == ("minsnap", "plan")
    certificate = minsnap.certify(path, CORNERS, 0.3, LIMITS)
    assert found.certificate["ok"] == certificate.ok
    assert found.certificate["corridor_margin"] == certificate.corridor_margin
    assert minsnap.certify(found.trajectory, found.waypoints, found.corridor).ok


CORRIDORS = {
    "widths": [0.3, 0.4],
    "tube": Tube(0.3),
    "round": RoundTube([0.3, 0.4]),
    "boxes": BOX,
    "room": Room((-9, -9, 0), (9, 9, np.inf)),
    "half-spaces": HalfSpaces([(0, 0, 1), (1, 0, 0)], [3.0, 9.0], legs=(0,)),
    "polytopes": Polytopes([(SQUARE, np.full(6, 9.0))] * 2),
    "two": [Tube(0.3), Room((-9, -9, 0), (9, 9, 9))],
}


@pytest.mark.parametrize("name", CORRIDORS)
def test_corridors_give_the_same_walls_again(tmp_path, path, name):
    write_polynomials(path, tmp_path / "plan.json", corridor=CORRIDORS[name])
    again = read_polynomials(tmp_path / "plan.json").corridor
    first, second = (minsnap.certify(path, CORNERS, walls).corridor_margin for walls in (CORRIDORS[name], again))
    assert first == pytest.approx(second, rel=1e-12)


class Mine:
    def walls(self, waypoints):
        return []


def test_what_has_no_description_is_refused(tmp_path, path):
    with pytest.raises(FileError, match="constraint of kind Mine has no description"):
        write_polynomials(path, tmp_path / "plan.json", corridor=Mine())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("others", [{}, {"speed": 3.0, "norm": "axis", "max_thrust": 1.4}])
def test_limits_of_the_rotors_of_a_preset_are_kept(tmp_path, path, others):
    limits = Limits.of(Quadrotor.px4_sih(), reserve=0.3, **others)
    write_polynomials(path, tmp_path / "plan.json", limits=limits)
    found = read_polynomials(tmp_path / "plan.json").limits
    assert found.given() == limits.given() and (found.norm, found.gravity) == (limits.norm, limits.gravity)
    assert (found.reserve, found.vehicle.name) == (0.3, limits.vehicle.name)
    said = json.loads((tmp_path / "plan.json").read_text())
    for rotors in ("px4_sih", {"reserve": 0.1}, {"vehicle": "px4_sih", "reserve": "much"}):
        (tmp_path / "plan.json").write_text(json.dumps(said | {"limits": {"rotors": rotors}}))
        with pytest.raises(FileError):
            read_polynomials(tmp_path / "plan.json")


def test_limits_of_ones_own_vehicle_are_kept_with_its_drag(tmp_path, path):
    mine = replace(Quadrotor.px4_sih(), mass=1.1, drag=Quadrotor.dji_f330().drag, name="mine")
    for vehicle in (mine, replace(Quadrotor.px4_sih(), drag=mine.drag)):
        limits = Limits.of(vehicle, reserve=0.2, speed=5.0)
        for name in ("plan.json", "plan.yaml"):
            write_polynomials(path, tmp_path / name, limits=limits)
            found = read_polynomials(tmp_path / name).limits
            assert found.given() == limits.given() and found.utilisation(path) == limits.utilisation(path)


BAD = {
    "another file": ({"format": "paper"}, "holds no polynomials"),
    "a list": ([1, 2], "holds no polynomials"),
    "newer": ({"version": 2}, "of version 2"),
    "another frame": ({"frame": "ned"}, "frame 'ned'"),
    "no durations": ({"durations": None}, "plan.json"),
    "negative": ({"durations": [-1.0, 1.0, 1.0, 1.0]}, "durations must be positive"),
    "ragged": ({"control_points": [[[0.0]], [[0.0, 1.0]]]}, "plan.json"),
    "pieces": ({"pieces_per_leg": 3}, "no whole number of legs"),
    "constraint": ({"corridor": {"kind": "Sphere"}}, "no constraint is of kind 'Sphere'"),
    "limit": ({"limits": {"speed": -1.0}}, "speed is -1.0"),
    "unknown limit": ({"limits": {"noise": 1.0}}, "plan.json"),
    "yaw": ({"yaw": {"angle": "north"}}, "plan.json"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_refused_in_a_sentence(tmp_path, path, name):
    file = tmp_path / "plan.json"
    write_polynomials(path, file)
    change, says = BAD[name]
    content = json.loads(file.read_text())
    file.write_text(json.dumps(change if isinstance(change, list) else content | change))
    with pytest.raises(FileError, match=says):
        read_polynomials(file)


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, "nul", "\0"])
def test_what_is_no_json_is_refused(tmp_path, text):
    (tmp_path / "plan.json").write_text(text)
    with pytest.raises(FileError, match="is not JSON"):
        read_polynomials(tmp_path / "plan.json")


@pytest.mark.parametrize("yaw", ["velocity", "tilt", minsnap.LookAt((1.0, 4.0))], ids=["velocity", "tilt", "look"])
@pytest.mark.parametrize("name", ["plan.json", "plan.yaml", "plan.npz"])
def test_a_heading_that_follows_from_the_curve_is_kept_exactly(tmp_path, yaw, name):
    path = minsnap.plan([(0, 0, 1), (3, 0, 1), (0, 0, 1), (0, 2, 1)], [2.0, 2.0, 1.5], yaw=yaw)
    write_any(path, tmp_path / name)
    found = read_any(tmp_path / name)
    t = np.linspace(0.0, path.duration, 101)
    assert (found.control_points == path.control_points).all()
    assert (found.yaw(t) == path.yaw(t)).all() and (found.yaw(t, 1) == path.yaw(t, 1)).all()


def test_a_heading_by_an_unknown_rule_is_refused(tmp_path, path):
    write_polynomials(path, tmp_path / "plan.json")
    said = json.loads((tmp_path / "plan.json").read_text())
    for yaw in (
        {"rule": "sideways"},
        {"rule": "velocity", "yaw_rate": "fast", "hold_below": None},
        {"rule": "look at"},
    ):
        (tmp_path / "plan.json").write_text(json.dumps(said | {"yaw": yaw}))
        with pytest.raises(FileError):
            read_polynomials(tmp_path / "plan.json")

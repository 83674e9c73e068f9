"""Tracks of lsy_drone_racing in TOML, and the frames of gates as obstacles."""

import sys

import numpy as np
import pytest

import minsnap
from minsnap.corridors.keep_out import called, name_of, named_obstacle
from minsnap.errors import CorridorError, FileError, WaypointError

TRACK = """
[env.track]
[[env.track.gates]]
pos = [1.0, 0.0, 1.0]
rpy = [0.0, 0.0, 0.5]
[[env.track.gates]]
pos = [2.5, 0.6, 1.4]
rpy = [0.0, 0.0, 0.0]
[[env.track.obstacles]]
pos = [1.8, 0.2, 1.55]
[[env.track.drones]]
pos = [-0.5, 0.0, 0.01]
rpy = [0.0, 0.0, 0.0]
[env.track.safety_limits]
pos_limit_low = [-2.5, -1.5, -0.001]
pos_limit_high = [3.5, 1.5, 2.0]
"""
needs_toml = pytest.mark.skipif(sys.version_info < (3, 11), reason="TOML is read by Python 3.11")


@needs_toml
@pytest.mark.slow
def test_a_track_is_flown_clear_of_frames_posts_and_poles(tmp_path):
    (tmp_path / "level.toml").write_text(TRACK)
    course = minsnap.read_course(tmp_path / "level.toml")
    assert [stop.gate is not None for stop in course.stops] == [False, True, True, False]
    assert len(course.obstacles) == 2 * 4 + 2 + 1 + 1  # bars, posts, a pole and the fence
    assert np.allclose(course.stops[-1].center, (3.0, 0.6, 1.4))
    mission = minsnap.plan_mission(course)
    found = minsnap.certify(mission.trajectory, limits=course.bounds, avoid=course.obstacles)
    assert found.ok and found.obstacle_margin > 0.0
    places = mission.trajectory(np.linspace(0.0, mission.duration, 4001))
    for gate in (stop.gate for stop in course.stops if stop.gate):
        local = (places - gate.center) @ np.stack(
            [gate.normal, np.cross((0.0, 0.0, 1.0), gate.normal), (0.0, 0.0, 1.0)]
        ).T
        flat = np.abs(local[np.abs(local[:, 0]) <= 0.02][:, 1:]).max(axis=1)
        assert ((flat < 0.2 - 0.08) | (flat > 0.36 + 0.08)).all()


@needs_toml
@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("pos = [1.0, 0.0, 1.0]", "pos = [1.0, 0.0]", "gates 0: pos is"),
        ("rpy = [0.0, 0.0, 0.5]", "rpy = [0.2, 0.0, 0.5]", "roll or pitch"),
        ("env.track", "env.course", r"has no \[\[env.track.gates\]\]"),
        ("[env.track]", "[env.track", "level.toml"),
    ],
)
def test_a_track_that_is_malformed_is_refused(tmp_path, old, new, says):
    (tmp_path / "level.toml").write_text(TRACK.replace(old, new))
    with pytest.raises(FileError, match=says):
        minsnap.read_course(tmp_path / "level.toml")


@pytest.mark.parametrize("normal", [(1.0, 0.0, 0.0), (0.6, 0.8, 0.0), (0.0, 0.0, 1.0)])
def test_a_frame_is_all_that_is_around_the_opening(normal):
    """A point is inside of a bar exactly where its coordinates in the frame of the gate say so."""
    gate = minsnap.Gate((1.0, 2.0, 3.0), normal, 0.8, 0.6)
    bars = gate.frame(0.2, 0.1, clearance=0.05)
    sides = np.roll(gate.corners, -1, axis=0) - gate.corners
    axes = np.stack([sides[0] / 0.8, sides[1] / 0.6, gate.normal])
    local = np.random.default_rng(0).uniform(-1.0, 1.0, (4000, 3)) * (0.9, 0.8, 0.2)
    across, up, along = np.abs(local).T
    inside = (along < 0.1) & (across < 0.65) & (up < 0.55) & ((across > 0.35) | (up > 0.25))
    points = gate.center + local @ axes
    found = np.min([bar.clearances(points) for bar in bars], axis=0)
    assert ((found < 0.0) == inside).all()


@pytest.mark.parametrize(
    ("gate", "size", "says"),
    [
        (minsnap.Gate((0, 0, 1), (1, 0, 0.5), 1.0), 0.1, "upright or lie level"),
        (minsnap.Gate.circle((0, 0, 1), (1, 0, 0), 1.0), 0.1, "rectangular"),
        (minsnap.Gate((0, 0), (1, 0), 1.0), 0.1, "rectangular"),
        (minsnap.Gate((0, 0, 1), (1, 0, 0), 1.0), -0.1, "the bar of a frame"),
    ],
)
def test_frames_that_are_not_known_are_refused(gate, size, says):
    with pytest.raises(WaypointError, match=says):
        gate.frame(size)


def test_gates_of_a_file_have_frames(tmp_path):
    text = """
waypoints:
  - [0, 0, 1]
  - {center: [2, 0, 1], heading_deg: 0, width: 1.0, frame: 0.3}
  - {center: [4, 0, 1], heading_deg: 0, width: 1.0, margin: 0.2}
  - [6, 0, 1]
frame: 0.1
margin: 0.1
"""
    (tmp_path / "framed.yaml").write_text(text)
    course = minsnap.read_course(tmp_path / "framed.yaml")
    bars = [bar.polygon for bar in course.obstacles]
    assert len(bars) == 8
    widths = [np.ptp(corners[:, 1]) for corners in (bars[0], bars[4])]
    assert np.allclose(widths, [0.3 + 2 * 0.1, 0.1 + 2 * 0.2])


FRAMED = """
waypoints:
  - [0, 0, 1]
  - {center: [2, 0, 1], heading_deg: 0, width: 1.0, frame: 0.3}
  - [6, 1, 1]
avoid:
  - cylinder: [9, 9, 0.2]
"""


def test_frames_are_called_by_their_gates(tmp_path):
    """The note said "obstacle 15", which nobody gave, and asked for a margin that was there."""
    (tmp_path / "framed.yaml").write_text(FRAMED)
    bare = minsnap.plan_mission(minsnap.read_course(tmp_path / "framed.yaml"))
    near = next(note for note in bare.notes if "frame" in note)
    assert near.startswith("the path passes the frame of gate 1 0.") and near.endswith(": give the gate a margin")
    (tmp_path / "framed.yaml").write_text(FRAMED + "margin: 0.2\n")
    course = minsnap.read_course(tmp_path / "framed.yaml")
    mission = minsnap.plan_mission(course)
    assert not any("frame" in note or "obstacle" in note for note in mission.notes)
    beside = minsnap.certify(mission.trajectory, avoid=course.obstacles).nearest_obstacle
    assert beside.obstacle > 0 and beside.name == "the frame of gate 1 and its margin of 0.2 m"
    again = [named_obstacle(*name_of(bar)) for bar in course.obstacles]
    assert [called(again, which) for which in range(5)] == ["obstacle 0", *[beside.name] * 4]
    (tmp_path / "inside.yaml").write_text(FRAMED.replace("[6, 1, 1]", "[2, 0.6, 1]"))
    with pytest.raises(CorridorError, match=r"waypoint 2, .*, is 0.1 m inside the frame of gate 1: move it"):
        minsnap.plan_mission(minsnap.read_course(tmp_path / "inside.yaml"))


def test_bars_without_a_gate_and_fences_have_numbers():
    bars = minsnap.Gate((0, 0, 1), (1, 0, 0), 1.0).frame(0.1, clearance=0.2)
    fence = minsnap.Prism([(-9, -9), (9, -9), (9, 9), (-9, 9)], inclusion=True)
    again = [named_obstacle(*name_of(each)) for each in (*bars, fence)]
    assert called(again, 3) == "obstacle 3 and its margin of 0.2 m" and called(again, 4) == "fence 4"
    leaving = minsnap.certify(minsnap.plan([(0, 0, 1), (9.5, 0, 1)], durations=[9.0]), avoid=fence)
    assert leaving.nearest_obstacle.inside.startswith("0.5 m outside fence 0 at")

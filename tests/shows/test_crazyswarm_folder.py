"""``fly.py`` of a crazyswarm2 folder, flown by the firmware's planner on a clock of its own: ways, places, a watch."""

import math
import runpy
import struct
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from crazyflie_planner import DEFINE, GO_TO, LAND, START, TAKE_OFF, Planner, least_distance

import minsnap
from minsnap.cli.app import main
from minsnap.errors import FleetError
from minsnap.fleet.approach import approach_of
from minsnap.fleet.standing_places import find_standing_places
from minsnap.flight.memory_parts import upload_of
from minsnap.shows.fleet_files import read_fleet, write_fleet

SEPARATION = minsnap.Separation(0.3, downwash=2.0)
LIMITS = minsnap.Limits(speed=1.0, acceleration=2.0)


class Robot:
    """crazyflie_py's view of a vehicle, which flies what it is told."""

    def __init__(self, now, place, curve):
        self.now, self.initialPosition = now, np.array(place, dtype=float)
        self.planner, self.calls, self.quiet_from = Planner(place), [], math.inf
        held = upload_of(curve)
        self.planner.memory = held.content
        self.planner.take(struct.pack("<BBBBIB", DEFINE, 1, 1, held.kind, 0, held.pieces), 0.0)

    def told(self, name, body):
        self.calls.append((name, self.now()))
        assert self.planner.take(body, self.now()) == 0, name

    def uploadTrajectory(self, number, offset, trajectory):  # noqa: N802 - crazyswarm2's names
        assert (number, offset) == (0, 0)

    def takeoff(self, targetHeight, duration):  # noqa: N803
        self.told("takeoff", struct.pack("<BBff?f", TAKE_OFF, 0, targetHeight, 0.0, True, duration))

    def goTo(self, goal, yaw, duration):  # noqa: N802
        self.told("goTo", struct.pack("<BBBBfffff", GO_TO, 0, 0, 0, *goal, yaw, duration))

    def land(self, targetHeight, duration):  # noqa: N803
        self.told("land", struct.pack("<BBff?f", LAND, 0, targetHeight, 0.0, True, duration))

    def start(self):
        self.told("start", struct.pack("<BBBBBBf", START, 1, 0, 0, 0, 1, 1.0))

    def get_status(self):
        at = min(self.now(), self.quiet_from)
        return {"timestamp_sec": int(at), "timestamp_nsec": int(1e9 * (at % 1)), "supervisor": 0, "pm_state": 0,
                "battery": 4.0}  # fmt: skip


def flown_by_script(folder, monkeypatch, quiet=None):
    """Fly ``fly.py`` of a folder from the places in its file; return the robots."""
    clock, fleet = [0.0], read_fleet(folder)
    described = yaml.safe_load((folder / "crazyflies.yaml").read_text())["robots"]
    rows = zip(described.items(), fleet, strict=True)
    robots = {name: Robot(lambda: clock[0], row["initial_position"], curve) for (name, row), curve in rows}
    if quiet is not None:
        robots[quiet].quiet_from = 10.0

    def sleep(seconds):
        clock[0] += seconds

    everyone = SimpleNamespace(
        crazyfliesByName=robots,
        startTrajectory=lambda number, relative: [robot.start() for robot in robots.values()],
        land=lambda **how: [robot.land(**how) for robot in robots.values()],
    )
    swarm = SimpleNamespace(timeHelper=SimpleNamespace(sleep=sleep, time=lambda: clock[0]), allcfs=everyone)
    modules = {
        "crazyflie_py": SimpleNamespace(Crazyswarm=lambda: swarm),
        "crazyflie_py.uav_trajectory": SimpleNamespace(Trajectory=lambda: SimpleNamespace(loadcsv=str)),
    }
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    try:
        runpy.run_path(str(folder / "fly.py"), run_name="__main__")
    except SystemExit as left:
        return list(robots.values()), str(left)
    return list(robots.values()), ""


def names(robot):
    return [name for name, _ in robot.calls]


def stacked():
    """Starts above each other, and ends."""
    ways = np.array([[(0, 0, 0.8), (1, 1, 1.8)], [(0, 0, 1.8), (1, 1, 0.8)], [(1, 0, 1), (0, 0, 1.3)]])
    return minsnap.plan_fleet(ways, LIMITS, SEPARATION)


def places_in(folder, change):
    file = folder / "crazyflies.yaml"
    described = yaml.safe_load(file.read_text())
    for robot in described["robots"].values():
        robot["initial_position"] = list(change(robot["initial_position"]))
    file.write_text(yaml.safe_dump(described, sort_keys=False))


@pytest.mark.slow
def test_starts_above_each_other_have_places_of_their_own_and_are_apart_all_the_time(tmp_path, monkeypatch):
    """Both had the place (0, 0, 0): take-off, way and landing were 0.000 m apart, without a word."""
    written = write_fleet(stacked(), tmp_path, "crazyswarm2")
    assert written.notes[0] == "others stand below the starts of cf2: stand all where crazyflies.yaml says"
    robots, said = flown_by_script(tmp_path, monkeypatch)
    assert said == "" and least_distance([robot.planner for robot in robots], 2.0) > 0.3 - 1e-6
    for robot in robots:
        assert robot.planner(math.inf)[:2] == pytest.approx(robot.initialPosition[:2], abs=1e-5), "it returned"
        assert names(robot).count("land") == 1


@pytest.mark.slow
def test_places_that_were_changed_are_refused_until_their_ways_are_proved(tmp_path, monkeypatch, capsys):
    """The script went to its place and the height: 0.40 m of step at the start, and nothing was proved."""
    starts = np.array([(0, 0, 1.0), (1, 0, 1.2)])
    fleet = minsnap.Fleet([minsnap.plan([at, at + (0, 1, 0)], [3.0]) for at in starts], None, SEPARATION)
    write_fleet(fleet, tmp_path, "crazyswarm2")
    places_in(tmp_path, lambda place: (place[0] + 0.4, *place[1:]))
    robots, said = flown_by_script(tmp_path, monkeypatch)
    assert "cf1 stands 0.40 m from where its way was proved from" in said and "--prove" in said
    assert not any(robot.calls for robot in robots)
    with pytest.raises(SystemExit) as left:
        main(["upload", str(tmp_path), "--prove"])
    assert left.value.code in (0, None) and "ways: 2 stages" in capsys.readouterr().out
    robots, said = flown_by_script(tmp_path, monkeypatch)
    assert said == "" and least_distance([robot.planner for robot in robots], 2.0) > 0.3
    for robot, curve in zip(robots, fleet, strict=True):
        started = next(t for name, t in robot.calls if name == "start")
        assert robot.planner(started - 1e-6) == pytest.approx(curve(0.0), abs=1e-5)


def test_a_robot_that_says_nothing_any_more_makes_all_land_once(tmp_path, monkeypatch):
    """Nothing looked at the vehicles between start and end."""
    fleet = minsnap.Fleet([minsnap.plan([(i, 0, 1), (i, 5, 1)], [30.0]) for i in range(2)], None, SEPARATION)
    write_fleet(fleet, tmp_path, "crazyswarm2")
    robots, said = flown_by_script(tmp_path, monkeypatch, quiet="cf2")
    assert said == "cf2 has been silent for 3 s: all were told to land in place"
    for robot in robots:
        assert [name for name, _ in robot.calls] == ["takeoff", "goTo", "start", "land"]
        assert 13.0 <= robot.calls[-1][1] <= 13.5
        assert robot.planner(math.inf)[2] == pytest.approx(0.04, abs=1e-5)


def test_the_script_lets_those_on_the_ground_take_off_by_their_curves(tmp_path, monkeypatch):
    """All climbed to half a metre; those that begin on the ground were then sent to z = 0, and all to yaw 0."""
    up, ground = minsnap.plan([(0, 0, 0), (0, 0, 1)], [2.0]), minsnap.plan([(1, 0, 1), (1, 0, 0)], [2.0], yaw=0.7)
    write_fleet(minsnap.Fleet((ground, up)), tmp_path, "crazyswarm2")
    robots, _ = flown_by_script(tmp_path, monkeypatch)
    assert [names(robot) for robot in robots] == [["takeoff", "goTo", "start", "land"], ["start", "land"]]
    moves = yaml.safe_load((tmp_path / "ways.yaml").read_text())["there"][1]["moves"]
    assert moves == [{"vehicle": "cf1", "call": "goTo", "goal": [1.0, 0.0, 1.0], "yaw": 0.7}]


@pytest.mark.slow
@pytest.mark.parametrize("rows", [1, 3])
def test_places_on_the_ground_are_apart_below_any_formation(rows):
    """An upright wall and a cube: where a place is taken, the next free one beside it."""
    grid = np.stack(np.meshgrid(np.arange(3) * 0.5, np.arange(rows) * 0.5, 0.5 + np.arange(3) * 0.7), -1).reshape(-1, 3)
    fleet = minsnap.Fleet([minsnap.plan([at, at + (0, 0, 0.1)], [2.0]) for at in grid], None, SEPARATION)
    places = find_standing_places(fleet)
    gaps = np.linalg.norm(places[:, None] - places, axis=2)[np.triu_indices(len(places), 1)]
    assert gaps.min() >= 0.3 and not places[:, 2].any()
    low = np.flatnonzero(grid[:, 2] == 0.5)
    assert places[low, :2] == pytest.approx(grid[low, :2]), "the lowest stand below their starts"
    approach = approach_of(fleet, places)
    assert approach.nearest.apart and approach.home and not approach.upright.apart


def test_a_folder_that_cannot_be_flown_apart_is_not_written(tmp_path):
    near = minsnap.Fleet([minsnap.plan([(i, 0, 1), (i, 1, 1)], [2.0]) for i in (0.0, 0.2)], None, SEPARATION)
    with pytest.raises(FleetError, match=r"vehicles 0 and 1 would come as near as 0\.\d+ m, and 0\.3 m are asked"):
        write_fleet(near, tmp_path / "folder", "crazyswarm2")
    assert not (tmp_path / "folder").exists()

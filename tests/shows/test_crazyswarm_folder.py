"""``fly.py`` of a crazyswarm2 folder, flown by the firmware's planner on a clock of its own: ways, places, a watch."""

import math
import re
import runpy
import struct
import sys
from functools import reduce
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from crazyflie_planner import DEFINE, GO_TO, LAND, START, TAKE_OFF, Planner, least_distance

import minsnap
from minsnap.cli.app import main
from minsnap.errors import FileError, FleetError
from minsnap.fleet.approach import approach_of
from minsnap.fleet.standing_places import find_standing_places
from minsnap.shows.fleet_files import read_fleet, write_fleet
from minsnap.shows.memory_parts import parts_of
from minsnap.shows.skyc import ShowSheet

SEPARATION = minsnap.Separation(0.3, downwash=2.0)
LIMITS = minsnap.Limits(speed=1.0, acceleration=2.0)
WRITING = 0.05
"""Time that a memory takes to be written [s]."""


class Robot:
    """crazyflie_py's view of a vehicle, which flies what it is told."""

    def __init__(self, now, place, pass_time=lambda seconds: None):
        self.now, self.initialPosition, self.pass_time = now, np.array(place, dtype=float), pass_time
        self.planner, self.calls, self.quiet_from = Planner(place), [], math.inf
        self.planner.memory, self.flies, self.written = bytearray(4096), None, []

    def told(self, name, body):
        self.calls.append((name, self.now()))
        assert self.planner.take(body, self.now()) == 0, name

    def uploadTrajectory(self, number, offset, trajectory):  # noqa: N802 - crazyswarm2's names
        """Write pieces where crazyswarm2's server in C++ does, never over those that are flown."""
        content = np.roll(trajectory.rows.astype("<f4"), -1, axis=1).tobytes()
        begins, ends = 132 * offset, 132 * offset + len(content)
        assert ends <= 4096 and number != self.flies
        _, _, flown, count = self.planner.defined.get(self.flies, (0, 0, 0, 0))
        assert ends <= flown or flown + 132 * count <= begins, "it lies where none is flown"
        self.planner.memory[begins:ends] = content
        self.planner.take(struct.pack("<BBBBIB", DEFINE, number, 1, 0, begins, len(trajectory.rows)), self.now())
        self.written.append((number, self.now()))
        self.pass_time(WRITING)

    def takeoff(self, targetHeight, duration):  # noqa: N803
        self.told("takeoff", struct.pack("<BBff?f", TAKE_OFF, 0, targetHeight, 0.0, True, duration))

    def goTo(self, goal, yaw, duration):  # noqa: N802
        self.told("goTo", struct.pack("<BBBBfffff", GO_TO, 0, 0, 0, *goal, yaw, duration))

    def land(self, targetHeight, duration):  # noqa: N803
        self.told("land", struct.pack("<BBff?f", LAND, 0, targetHeight, 0.0, True, duration))

    def start(self, number):
        self.flies = number
        self.told("start", struct.pack("<BBBBBBf", START, 1, 0, 0, 0, number, 1.0))

    def get_status(self):
        at = min(self.now(), self.quiet_from)
        return {"timestamp_sec": int(at), "timestamp_nsec": int(1e9 * (at % 1)), "supervisor": 0, "pm_state": 0,
                "battery": 4.0}  # fmt: skip


class File:
    """crazyflie_py's trajectory: the rows of a file."""

    def loadcsv(self, name):
        self.rows = np.loadtxt(name, delimiter=",", skiprows=1, usecols=range(33), ndmin=2)


def flown_by_script(folder, monkeypatch, quiet=None, service="Arm"):
    """Fly ``fly.py`` of a folder from the places in its file; return the robots."""
    clock = [0.0]

    def sleep(seconds):
        clock[0] += seconds

    described = yaml.safe_load((folder / "crazyflies.yaml").read_text())["robots"]
    robots = {name: Robot(lambda: clock[0], row["initial_position"], sleep) for name, row in described.items()}
    if quiet is not None:
        robots[quiet].quiet_from = 10.0

    everyone = SimpleNamespace(
        crazyfliesByName=robots,
        get_service_names_and_types=lambda: [("/cf1/x", [f"crazyflie_interfaces/srv/{service}"])],
        startTrajectory=lambda number, relative: [robot.start(number) for robot in robots.values()],
        land=lambda **how: [robot.land(**how) for robot in robots.values()],
    )
    swarm = SimpleNamespace(timeHelper=SimpleNamespace(sleep=sleep, time=lambda: clock[0]), allcfs=everyone)
    modules = {
        "crazyflie_py": SimpleNamespace(Crazyswarm=lambda: swarm),
        "crazyflie_py.uav_trajectory": SimpleNamespace(Trajectory=File),
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


def of_acts(acts, hold=0.5, pieces=7):
    """Three vehicles that rest together between flights of so many pieces."""

    def whole(vehicle):
        flights = []
        for act in range(acts):
            ends = [(vehicle, 1.5 * ((act + i) % 2), 1.0 + 0.2 * (act + i)) for i in range(2)]
            flights += [minsnap.plan(ends, [4.0], pieces=pieces), minsnap.plan([ends[1]] * 2, [hold])]
        return reduce(lambda one, two: one.then(two), flights[:-1])

    return minsnap.Fleet(tuple(whole(i) for i in range(3)), None, SEPARATION)


@pytest.mark.slow
def test_a_show_that_no_memory_holds_is_flown_in_parts(tmp_path, monkeypatch, capsys):
    """It was refused: 51 of 31 pieces."""
    fleet = of_acts(8)
    write_fleet(fleet, tmp_path, "crazyswarm2")
    parts = yaml.safe_load((tmp_path / "ways.yaml").read_text())["parts"]
    assert len(parts) >= 3 and all(0 <= first < 31 for part in parts for first in part["first_pieces"])
    robots, said = flown_by_script(tmp_path, monkeypatch)
    assert said == "" and "late" not in capsys.readouterr().out
    assert least_distance([robot.planner for robot in robots], 2.0) > 0.3
    for robot, curve in zip(robots, fleet, strict=True):
        starts = [t for name, t in robot.calls if name == "start"]
        assert len(starts) == len(parts) == len(robot.written)
        assert np.diff(starts) == pytest.approx(np.diff([part["begins"] for part in parts]), abs=1e-6)
        for t in np.linspace(0.0, curve.duration, 211):
            assert robot.planner(starts[0] + t) == pytest.approx(curve(t), abs=2e-4)
        assert [at for _, at in robot.written[2:]] == pytest.approx(starts[1:-1], abs=0.2), "while another is flown"
    t = np.linspace(0.0, fleet.duration, 99)
    assert read_fleet(tmp_path)(t) == pytest.approx(fleet(t), abs=1e-9), "those of parts are no vehicles"
    write_fleet(of_acts(1), tmp_path, "crazyswarm2")
    assert not list((tmp_path / "parts").iterdir()), "those of the former fleet are gone"


def test_a_server_that_writes_all_at_the_beginning_flies_no_parts(tmp_path, monkeypatch):
    """It says no word of pieces that do not lie where they are to; its vehicles would fly what lies there."""
    write_fleet(of_acts(8), tmp_path / "long", "crazyswarm2")
    robots, said = flown_by_script(tmp_path / "long", monkeypatch, service="AddLogging")
    assert "nothing moved. Start crazyswarm2 with backend:=cpp" in said
    assert not any(robot.calls or robot.written for robot in robots)
    write_fleet(of_acts(1), tmp_path / "short", "crazyswarm2")
    robots, said = flown_by_script(tmp_path / "short", monkeypatch, service="AddLogging")
    assert said == "" and all("start" in names(robot) for robot in robots)


def test_a_part_that_is_written_late_begins_late_and_says_so(tmp_path, monkeypatch, capsys):
    fleet = of_acts(8)
    write_fleet(fleet, tmp_path, "crazyswarm2")
    monkeypatch.setattr(f"{__name__}.WRITING", 4.0)
    robots, said = flown_by_script(tmp_path, monkeypatch)
    assert said == "" and re.search(r"part 3 begins \d+\.\d s late", capsys.readouterr().out)
    for robot, curve in zip(robots, fleet, strict=True):
        assert robot.planner(robot.calls[-1][1] - 1e-3) == pytest.approx(curve(curve.duration), abs=1e-4)


def test_flights_that_do_not_fit_a_memory_together_are_refused_by_name(tmp_path):
    fleet = of_acts(2, pieces=17)
    sheet = ShowSheet(cues=((4.0, "up"), (8.5, "down")))
    with pytest.raises(FileError, match="the flight to 'up' .* two flights one after the other share 4096: divide"):
        write_fleet(fleet, tmp_path / "new", "crazyswarm2", sheet=sheet)
    assert not (tmp_path / "new").exists()
    assert len(parts_of(fleet)) == 1, "in the compressed form all of it does"


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

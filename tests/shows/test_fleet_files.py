"""Fleets in files: read back, certified as they are in the file, and refused where they are not what they say."""

import base64
import hashlib
import json
import math
import struct
import zipfile
from dataclasses import replace

import numpy as np
import pytest
import yaml

import minsnap
from minsnap.basics.storage.atomic import write_file
from minsnap.cli.app import main
from minsnap.errors import FileError
from minsnap.files.convert import write_any
from minsnap.files.formats.skybrush import Lights, read_skybrush
from minsnap.shows.fleet_files import EXACT_KINDS, KINDS, read_fleet, write_fleet
from minsnap.shows.skyc import ShowSheet, read_skyc


def crossing():
    """Two vehicles that pass each other, the second ending later."""
    there = minsnap.plan([(0, 0, 1), (4, 0, 1.5), (4, 3, 1)], [2.0, 1.7])
    across = minsnap.plan([(2, -2, 1), (2, 2, 2)], [4.6])
    return minsnap.Fleet((there, across), ("one", "two"), minsnap.Separation(0.5, downwash=2.0))


@pytest.mark.parametrize("to", KINDS)
def test_what_is_read_is_what_was_written(tmp_path, to):
    fleet = crossing()
    path = tmp_path / ("show.skyc" if to == "skyc" else "folder")
    written = write_fleet(fleet, path, to)
    again = read_fleet(path)
    assert again.names == fleet.names and all(file.exists() for file in written.files)
    assert (written.distance > 0.0) == (to not in EXACT_KINDS)
    for i, curve in enumerate(fleet):
        t = np.linspace(0.0, curve.duration, 4001)
        off = np.linalg.norm(again[i](t) - curve(t), axis=1).max()
        assert off <= written.distance + 1e-9, i
        assert again[i].duration == pytest.approx(curve.duration, abs=1.1e-3)


def test_the_distance_counts_how_much_later_knots_are_written(tmp_path):
    """Lines at 30 m/s are held exactly and were said to be, though what is read was 90 nm late."""
    corners = np.array([[0.0, 0, 1], [30, 0, 1], [0, 0, 1], [30, 0, 1]])
    curve = minsnap.Trajectory(np.stack((corners[:-1], corners[1:]), axis=1), np.ones(3))
    said = write_fleet(minsnap.Fleet((curve,)), tmp_path / "a.skyc").distance
    t = np.linspace(0.0, 3.0, 3001)
    off = np.linalg.norm(read_fleet(tmp_path / "a.skyc")[0](t) - curve(t), axis=1).max()
    assert 8e-8 < off <= said <= 2e-7
    alone = write_fleet(minsnap.Fleet((curve,)), tmp_path / "folder", "skyb").distance
    assert np.linalg.norm(read_fleet(tmp_path / "folder")[0](t) - curve(t), axis=1).max() <= alone < 1e-11


def test_the_certificate_is_of_what_is_in_the_file(tmp_path):
    fleet = crossing()
    written = write_fleet(fleet, tmp_path / "show.skyc")
    planned = minsnap.certify_fleet(fleet, 0.5).least_distance
    held = minsnap.certify_fleet(read_fleet(tmp_path / "show.skyc"), 0.5).least_distance
    assert held != planned and abs(held - planned) <= 2.0 * written.distance


def converted(path, rounds):
    """What Skybrush's server makes of a vehicle: its unit [mm], milliseconds and whole control points.

    It chooses the unit by the farthest coordinate, cuts coordinates off at whole units and durations at milliseconds,
    which its newer versions round to milliseconds before.
    """
    with zipfile.ZipFile(path) as archive:
        points = json.loads(archive.read("drones/drone_1/trajectory.json"))["points"]
    places = [place for _, end, between in points for place in (end, *between)]
    scale = math.ceil((math.ceil(max(abs(x) for place in places for x in place) * 1000) + 1) / 32768)
    factor, milliseconds, segments = 1000 / scale, [], []
    for (begin, start, _), (end, goal, between) in zip(points, points[1:], strict=False):
        lasts = round(end - begin, 3) if rounds else end - begin
        milliseconds.append(math.floor(lasts * 1000))
        segments.append([[int(x * factor) for x in place] for place in (start, *between, goal)])
    return scale, milliseconds, segments


def decoded(content):
    """The same of a binary show, by its format."""
    scale, *place = struct.unpack_from("<B3h", content, 13)
    length, offset = struct.unpack_from("<H", content, 11)[0], 13 + 9
    milliseconds, segments = [], []
    while offset < 13 + length:
        kinds, lasts = struct.unpack_from("<BH", content, offset)
        offset += 3
        axes, most = [], max((0, 1, 3)[kinds >> 2 * axis & 3] for axis in range(3)) or 1
        for axis in range(3):
            count = (0, 1, 3)[kinds >> 2 * axis & 3]
            row = [place[axis], *struct.unpack_from(f"<{count}h", content, offset)]
            axes.append(row if count else row * (most + 1))
            offset, place[axis] = offset + 2 * count, row[-1]
        milliseconds.append(lasts)
        segments.append([list(point) for point in zip(*axes, strict=True)])
    return scale, milliseconds, segments


def polyline(far):
    """Corners at odd milliseconds, and a bend, so far out."""
    corners = np.random.default_rng(3).uniform(-3, 3, (60, 3)) + (far, -far, 2.0)
    durations = np.round(np.random.default_rng(4).uniform(0.9, 4.5, 59), 3) + 1e-3
    lines = minsnap.Trajectory(np.linspace(corners[:-1], corners[1:], 8, axis=1), durations)
    return lines.then(minsnap.plan(corners[[-1, 3, 5]], [2.5, 3.25], start={"velocity": lines(lines.duration, 1)}))


@pytest.mark.parametrize("rounds", [True, False])
@pytest.mark.parametrize("far", [0.0, 40.0, 150.0, 32.7655, 98.3015, 98.2985])
def test_what_a_server_that_cuts_off_makes_of_a_show_is_what_is_certified(tmp_path, far, rounds):
    """107 of 14,631 coordinates lost a unit, 7 mm at a unit of 5, and its files had other bytes than ours.

    The last three reach to where the unit changes.
    """
    path = minsnap.line((0, 0, 2), (far, 0, 2), total_time=41.0) if far % 1.0 else polyline(far)
    fleet = minsnap.Fleet((path,))
    write_fleet(fleet, tmp_path / "show.skyc")
    write_fleet(fleet, tmp_path / "folder", "skyb")
    ours = decoded((tmp_path / "folder" / "traj0.skyb").read_bytes())
    theirs = converted(tmp_path / "show.skyc", rounds)
    assert theirs[:2] == ours[:2] and min(ours[1]) >= 100
    for mine, other in zip(ours[2], theirs[2], strict=True):
        assert (np.array(other) == np.array(mine)).all() if len(mine) == len(other) else mine[:1] == other[:1]


def test_a_show_that_the_server_could_not_convert_is_refused(tmp_path):
    """A curve of 5,000 s was written without a word, and the server raises ValueError."""
    corners = np.random.default_rng(3).uniform(-3, 3, (900, 3))
    long = minsnap.plan(corners, np.full(899, 2.4))
    with pytest.raises(FileError, match=r"^two: \d+ segments take \d+ bytes, \d+ more than a block holds: the first"):
        write_fleet(minsnap.Fleet((crossing()[0], long), ("one", "two")), tmp_path / "new" / "show.skyc")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("yaw", [0.7, -3.0, [0.0, 2.0, -4.0], "velocity"])
@pytest.mark.parametrize("to", ["skyb", "skyc"])
def test_the_heading_is_in_the_files_of_shows(tmp_path, to, yaw):
    """It was dropped without a word: a vehicle that was to turn by 180 degrees stood at 0."""
    path = minsnap.plan([(0, 0, 1), (4, 0, 1.5), (4, 3, 1)], [2.0, 1.7], yaw=yaw)
    place = tmp_path / ("show.skyc" if to == "skyc" else "folder")
    write_fleet(minsnap.Fleet((path,)), place, to)
    held, t = read_fleet(place)[0], np.linspace(0.0, path.duration, 2001)
    off = held.yaw(t) - path.yaw(t)
    assert np.abs(off - np.round(off.mean() / (2.0 * np.pi)) * 2.0 * np.pi).max() <= np.radians(0.65)
    if to == "skyc":
        with zipfile.ZipFile(place) as archive:
            said = json.loads(archive.read("show.json"))["swarm"]["drones"][0]["settings"]["yawControl"]
        assert said["version"] == 1 and not said["autoYaw"] and said["setpoints"][0][0] == 0.0
        angle = np.degrees(path.yaw(np.zeros(1))[0])
        assert (said["setpoints"][0][1] + angle + 180.0) % 360.0 == pytest.approx(180.0, abs=0.06), "clockwise"
    else:
        content = (place / "traj0.skyb").read_bytes()
        block = content[content.index(b"\x02\x01\x00\x00") + 4 :]
        assert block[0] == 5 and block[3] == 0 and len(block) == 3 + struct.unpack_from("<H", block, 1)[0]


def test_a_plan_without_a_heading_says_none(tmp_path):
    write_fleet(crossing(), tmp_path / "show.skyc")
    with zipfile.ZipFile(tmp_path / "show.skyc") as archive:
        assert "yawControl" not in archive.read("show.json").decode()


def test_a_sheet_says_what_a_show_is_checked_by(tmp_path):
    """Every show was indoors, of one segment, called minsnap, and checked by its separation alone."""
    limits = minsnap.Limits(speed=6, vertical_speed=2, acceleration=3, horizontal_acceleration=2.5, yaw_rate=np.pi)
    sheet = ShowSheet("Night", "indoor", limits, 80.0, ((1.0, "a"), (2.5, "b")), {"takeoff": (0, 1), "show": (1, 4.6)})
    write_fleet(crossing(), tmp_path / "show.skyc", sheet=sheet)
    with zipfile.ZipFile(tmp_path / "show.skyc") as archive:
        show, cues = json.loads(archive.read("show.json")), json.loads(archive.read("cues.json"))
    assert show["environment"] == {"type": "indoor"} and show["meta"]["title"] == "Night"
    assert show["meta"]["segments"] == {"takeoff": [0, 1], "show": [1, 4.6]}
    assert [item["name"] for item in cues["items"]] == ["a", "b"] and cues["items"][1]["time"] == 2.5
    assert show["settings"]["validation"] == pytest.approx(
        {
            **{"maxAltitude": 80, "maxVelocityXY": 6, "maxVelocityZ": 2, "maxVelocityZUp": 2, "maxAccelerationXY": 2.5},
            **{"maxAccelerationZ": 3, "maxYawRate": 180, "minDistance": 0.5},
        }
    )


def test_the_same_show_gives_the_same_bytes_and_keeps_its_lights(tmp_path):
    fleet = crossing()
    lights = [Lights([0.0, 2.0], [(255, 0, 0), (0, 0, 255)], [False, True]), None]
    for name in ("a.skyc", "b.skyc"):
        write_fleet(fleet, tmp_path / name, lights=lights)
    assert (tmp_path / "a.skyc").read_bytes() == (tmp_path / "b.skyc").read_bytes()
    again = read_skyc(tmp_path / "a.skyc").lights
    assert again[1] is None and again[0](1.0) == pytest.approx([127.5, 0.0, 127.5])
    write_fleet(fleet, tmp_path / "folder", "skyb", lights)
    alone = read_skybrush(tmp_path / "folder" / "traj0.skyb").lights
    assert alone(1.0) == pytest.approx([127.5, 0.0, 127.5], abs=1.0)
    with zipfile.ZipFile(tmp_path / "a.skyc") as archive:
        show = json.loads(archive.read("show.json"))
    assert show["settings"]["validation"] == {"minDistance": 0.5}
    assert show["swarm"]["drones"][1]["settings"]["landAt"] == [2.0, 2.0, 2.0]


def test_waits_quadratics_and_entries_in_place_are_read(tmp_path):
    trajectory = {"version": 1, "points": [[0, [0, 0, 0], []], [2, [2, 0, 0], [[1, 2, 0]]]], "takeoffTime": 3}
    show = {"version": 1, "swarm": {"drones": [{"type": "generic", "settings": {"trajectory": trajectory}}]}}
    with zipfile.ZipFile(tmp_path / "a.skyc", "w") as archive:
        archive.writestr("show.json", json.dumps(show))
    path = read_fleet(tmp_path / "a.skyc")[0]
    assert path(2.0) == pytest.approx([0, 0, 0]) and path(4.0) == pytest.approx([1.0, 1.0, 0.0])


@pytest.mark.parametrize(
    ("first", "takeoff", "starts"), [(1, 3, 4.0), (1, None, 1.0), (-1, 3, 2.0), (0, -3, None), (0, float("nan"), None)]
)
def test_a_show_begins_when_its_points_say(tmp_path, first, takeoff, starts):
    """The instant of the first point was left out, and a negative one of the take-off: another motion was proved."""
    trajectory = {"version": 1, "points": [[first, [0, 0, 0], []], [5, [2, 0, 0], []]], "takeoffTime": takeoff}
    lights = {"version": 1, "data": base64.b64encode(bytes([17, 0])).decode()}
    drones = [{"type": "generic", "settings": {"trajectory": trajectory, "lights": lights}}]
    with zipfile.ZipFile(tmp_path / "a.skyc", "w") as archive:
        archive.writestr("show.json", json.dumps({"version": 1, "swarm": {"drones": drones}}))
    if starts is None:
        with pytest.raises(FileError, match="has its first point at"):
            read_fleet(tmp_path / "a.skyc")
        return
    path = read_fleet(tmp_path / "a.skyc")[0]
    assert path(starts - 1e-6) == pytest.approx([0, 0, 0]) and path(starts + 0.1)[0] > 0.0
    with pytest.raises(FileError, match="command 17"):
        _ = read_skyc(tmp_path / "a.skyc").lights


@pytest.mark.parametrize("kind", ["crazyswarm2", "skyb", "traj"])
def test_no_part_of_a_fleet_passes_for_one(tmp_path, kind, monkeypatch):
    """Files of the vehicles before one that did not fit stayed, without a manifest, and were uploaded."""
    far = minsnap.plan([(0, 9, 1), *((i, 9, 1 + i % 2) for i in range(1, 5000, 125))], np.full(40, 200.0))
    with pytest.raises(FileError):
        write_fleet(minsnap.Fleet((*crossing(), far)), tmp_path / "folder", kind)
    assert not (tmp_path / "folder").exists()
    written = []

    def killed(path, content, **how):
        if len(written) == 2:
            raise KeyboardInterrupt
        written.append(path)
        write_file(path, content, **how)

    monkeypatch.setattr("minsnap.shows.fleet_files.write_file", killed)
    with pytest.raises(KeyboardInterrupt):
        write_fleet(crossing(), tmp_path / "folder", kind)
    with pytest.raises(FileError, match=r"traj1\.\w+ is missing"):
        read_fleet(tmp_path / "folder")


def test_a_crazyswarm_folder_names_its_robots(tmp_path):
    write_fleet(crossing(), tmp_path / "folder", "crazyswarm2")
    said = yaml.safe_load((tmp_path / "folder" / "crazyflies.yaml").read_text())
    assert said["fileversion"] == 3 and list(said["robots"]) == ["cf1", "cf2"]
    assert said["robots"]["cf2"]["initial_position"] == [2.0, -2.0, 0.0]
    assert said["robots"]["cf2"]["uri"].endswith("E7E7E7E702")
    rows = np.loadtxt(tmp_path / "folder" / "traj1.csv", delimiter=",", skiprows=1, usecols=range(33))
    assert rows.shape == (2, 33) and rows[:, 0].sum() == pytest.approx(4.6)
    script = (tmp_path / "folder" / "fly.py").read_text()
    compile(script, "fly.py", "exec")
    ways = yaml.safe_load((tmp_path / "folder" / "ways.yaml").read_text())
    assert ways["vehicles"] == ["cf1", "cf2"] and ways["duration"] == 4.6
    assert ways["places"] == [[0.0, 0.0, 0.0], [2.0, -2.0, 0.0]]


def test_files_of_a_former_fleet_go_unless_they_were_changed(tmp_path):
    """A second trajectory and a script for two stayed beside that of another fleet."""
    write_fleet(crossing(), tmp_path, "crazyswarm2")
    (tmp_path / "crazyflies.yaml").write_text("of my own")
    write_fleet(minsnap.Fleet((crossing()[0],)), tmp_path)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["crazyflies.yaml", "manifest.json", "traj0.csv"]
    write_fleet(read_fleet(tmp_path), tmp_path, "skyb")
    assert (tmp_path / "traj0.csv").exists(), "what loses nothing stays beside what does"
    with pytest.raises(FileError, match="is there already"):
        write_fleet(crossing(), tmp_path, "traj", clobber=False)
    assert not (tmp_path / "traj0.traj").exists()


@pytest.mark.parametrize(
    "manifest",
    [
        {"vehicles": [{"file": "mine.csv"}]},
        {"format": "minsnap fleet", "vehicles": [{"file": "sub/mine.csv"}]},
        {"format": "minsnap fleet", "vehicles": [{"file": "m" * 5000 + ".csv"}]},
        {"format": "minsnap fleet", "vehicles": 3},
        [],
    ],
)
def test_a_manifest_that_is_not_of_a_fleet_takes_nothing_away(tmp_path, manifest):
    (tmp_path / "mine.csv").write_text("mine")
    for row in manifest["vehicles"] if isinstance(manifest, dict) and isinstance(manifest["vehicles"], list) else ():
        row["sha256"] = hashlib.sha256(b"mine").hexdigest()
    (tmp_path / "manifest.json").write_text(json.dumps(manifest))
    write_fleet(crossing(), tmp_path)
    assert (tmp_path / "mine.csv").read_text() == "mine" and len(read_fleet(tmp_path)) == 2


def test_vehicles_without_a_manifest_are_counted_by_their_numbers(tmp_path):
    """The third robot of crazyflies.yaml was given the trajectory of the eleventh."""
    lines = [minsnap.plan([(0, i, 1), (1, i, 1)], [2.0]) for i in range(12)]
    write_fleet(minsnap.Fleet(tuple(lines)), tmp_path, "crazyswarm2")
    (tmp_path / "manifest.json").unlink()
    fleet = read_fleet(tmp_path)
    assert fleet(0.0)[:, 1].tolist() == list(range(12)) and fleet.names[2] == "traj2"


def test_a_file_of_one_vehicle_is_a_fleet(tmp_path):
    """It had to lie in a folder of its own to be uploaded."""
    write_any(crossing()[0], tmp_path / "alone.csv", to="crazyflie")
    fleet = read_fleet(tmp_path / "alone.csv")
    assert len(fleet) == 1 and fleet.names == ("alone",) and fleet.duration == pytest.approx(3.7)


def test_a_folder_of_one_show_is_that_show(tmp_path):
    """``minsnap fleet -o out --to skyc`` writes one, and ``check out`` found no trajectories."""
    write_fleet(crossing(), tmp_path / "show.skyc")
    assert len(read_fleet(tmp_path)) == len(crossing())
    write_fleet(crossing(), tmp_path / "other.skyc")
    with pytest.raises(FileError, match=r"holds no trajectories: one \.skyc, or"):
        read_fleet(tmp_path)


@pytest.mark.parametrize("kept", [("velocity", "acceleration"), ("velocity",), ()])
def test_a_folder_of_setpoints_is_certified_as_the_curves_through_them(tmp_path, kept):
    """Each vehicle on the clock of its instants: the second one waits a second for its first row."""
    fleet = crossing()
    for i, curve in enumerate(fleet):
        samples = curve.sample(100.0)
        samples = replace(samples, t=samples.t + 7.0 + i, **dict.fromkeys({"velocity", "acceleration"} - set(kept)))
        minsnap.write_csv(samples, tmp_path / f"v{i}.csv")
    read = read_fleet(tmp_path, between=True)
    assert read.duration == pytest.approx(max(curve.duration + i for i, curve in enumerate(fleet)))
    at = np.linspace(0.0, fleet[0].duration, 50)
    near = 1e-9 if len(kept) == 2 else 2e-3
    for i, curve in enumerate(fleet):
        assert read[i](at * curve.duration / fleet[0].duration + i) == pytest.approx(
            curve(at * curve.duration / fleet[0].duration), abs=near
        )
        assert read[i](0.0) == pytest.approx(curve(0.0))
    assert minsnap.certify_fleet(read, 0.1).least_distance > 0.0


def test_what_was_changed_or_holds_samples_is_refused(tmp_path):
    write_fleet(crossing(), tmp_path / "folder")
    (tmp_path / "folder" / "traj1.csv").write_text("duration\n1\n")
    with pytest.raises(FileError, match=r"traj1\.csv is missing or was changed since its manifest"):
        read_fleet(tmp_path / "folder")
    (tmp_path / "other").mkdir()
    with pytest.raises(FileError, match="holds no trajectories"):
        read_fleet(tmp_path / "other")
    minsnap.write_csv(crossing()[0], tmp_path / "other" / "a.csv")
    with pytest.raises(FileError, match="holds samples, and nothing is certain between them"):
        read_fleet(tmp_path / "other")
    (tmp_path / "other" / "b.csv").write_text("t,x,y,z\n0,1,2,3\n")
    with pytest.raises(FileError, match=r"b\.csv holds one sample"):
        read_fleet(tmp_path / "other", between=True)
    (tmp_path / "a.skyc").write_bytes(b"no zip")
    with pytest.raises(FileError, match=r"a\.skyc is not a Skybrush show"):
        read_fleet(tmp_path / "a.skyc")
    with pytest.raises(FileError, match="choose one of csv, crazyswarm2, skyb, traj, skyc"):
        write_fleet(crossing(), tmp_path / "x", "skyx")


DAMAGE = {
    "a dropped row": lambda rows: rows[:1] + rows[2:],
    "a shifted clock": lambda rows: [rows[0], "1.5" + rows[1][rows[1].index(",") :], *rows[2:]],
    "rounded": lambda rows: [rows[0], *(",".join(f"{float(x):.2f}" for x in row.split(",")) for row in rows[1:])],
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damage_is_refused_by_the_manifest_and_seen_by_the_certificate_without_one(tmp_path, damage):
    corners = np.array([[0.0, 0, 1], [1, 0.3, 1], [2, 0, 1.2], [3, 0.3, 1]])
    fleet = minsnap.Fleet(tuple(minsnap.plan(corners + [0, y, 0], [1.0, 1.1, 0.9]) for y in (0.0, 1.0)))
    write_fleet(fleet, tmp_path)
    file = tmp_path / "traj0.csv"
    file.write_text("\n".join(DAMAGE[damage](file.read_text().splitlines())) + "\n")
    with pytest.raises(FileError, match=r"traj0\.csv is missing or was changed"):
        read_fleet(tmp_path)
    (tmp_path / "manifest.json").unlink()
    before, after = (minsnap.certify_fleet(each, 0.999) for each in (fleet, read_fleet(tmp_path)))
    assert before.ok and not after.ok and after.least_distance < before.least_distance


def checked(capsys, *words):
    """Exit status and output of the check."""
    with pytest.raises(SystemExit) as left:
        main(["check", *map(str, words)])
    out = capsys.readouterr()
    return left.value.code or 0, out.out + out.err


def test_check_proves_a_fleet_apart_or_names_the_pair(tmp_path, capsys):
    write_fleet(crossing(), tmp_path / "folder")
    true = minsnap.certify_fleet(crossing(), 0.3)
    status, text = checked(capsys, tmp_path / "folder", "--separation", "0.3")
    assert status == 0 and f"one and two come within {true.least_distance:.4f} m at {true.instant:.2f} s" in text
    status, text = checked(capsys, tmp_path / "folder", "--separation", "2")
    assert status == 1 and "problem: one and two come within" in text
    status, text = checked(capsys, tmp_path / "folder", "--separation", "0.3", "--json")
    said = json.loads(text)
    assert said["least_distance"] == pytest.approx(true.least_distance) and status == 0
    said = json.loads(checked(capsys, tmp_path / "folder", "--separation", "2", "--json")[1])
    halfway = crossing()(said["instant"]).mean(axis=0)
    assert said["nearest"][0]["between"] == pytest.approx(halfway, abs=1e-9)


def test_check_asks_for_the_separation_where_files_do_not_say_it(tmp_path, capsys):
    bare = minsnap.Fleet(crossing().trajectories)
    write_fleet(bare, tmp_path / "a.skyc")
    assert checked(capsys, tmp_path / "a.skyc")[1].count("give --separation M") == 1
    minsnap.write_csv(crossing()[0], tmp_path / "a.csv")
    assert "is one vehicle" in checked(capsys, tmp_path / "a.csv", "--separation", "1")[1]


def test_shows_near_a_valid_one_are_read_or_refused(tmp_path):
    """Every number and every key of a small show, each replaced by what does not belong there."""
    plain = {"version": 1, "points": [[0, [0, 0, 0], []], [2, [2, 0, 0], [[1, 2, 0]]]], "takeoffTime": 3}
    wrongs = [
        {**plain, "points": []},
        {**plain, "points": [[0, [0, 0, 0], []], [0, [2, 0, 0], []]]},
        {**plain, "points": [[0, [0, 0, 0], []], [1, [2, 0], []]]},
        {**plain, "points": [[0, [0, 0, 0], []], [1, [2, 0, 0], [[0, 0, 0]] * 7]]},
        {**plain, "points": [[0, [0, 0, 0], []], [1, ["a", 0, 0], []]]},
        {**plain, "points": [[0, [0, 0, 0], []], [1, [float("nan"), 0, 0], []]]},
        {"$ref": "./nowhere.json#"},
        None,
    ]
    for number, wrong in enumerate(wrongs):
        show = {"version": 1, "swarm": {"drones": [{"settings": {"trajectory": wrong}}]}}
        with zipfile.ZipFile(tmp_path / "a.skyc", "w") as archive:
            archive.writestr("show.json", json.dumps(show))
        with pytest.raises(FileError) as refused:
            read_fleet(tmp_path / "a.skyc")
        assert len(str(refused.value)) < 300, number


def test_a_downwash_alone_is_checked_with_the_separation_of_the_files(tmp_path, capsys):
    below, above = minsnap.line((0, 0, 1), (4, 0, 1)), minsnap.line((0, 0, 3), (4, 0, 3))
    fleet = minsnap.Fleet((below, above), separation=minsnap.Separation(0.9, 2.0))
    write_fleet(fleet, tmp_path / "folder")
    for asked, status in (((), 0), (("--downwash", "4"), 1), (("--separation", "1.1"), 0), (("--downwash", "1"), 0)):
        assert checked(capsys, tmp_path / "folder", *asked)[0] == status
    assert "downwash is 0" in checked(capsys, tmp_path / "folder", "--downwash", "0")[1]


@pytest.mark.parametrize("to", KINDS)
def test_a_fleet_that_is_refused_leaves_no_folder(tmp_path, to):
    place = tmp_path / "new" / ("show.skyc" if to == "skyc" else "folder")
    many = minsnap.plan([(k % 2, 0.01 * k, 1.0) for k in range(400)], total_time=400.0)
    far = minsnap.line((0, 0, 1), (40_000, 0, 1))
    fleet, lights = minsnap.Fleet((many if to == "crazyswarm2" else far,)), [None] * (2 if to == "csv" else 1)
    with pytest.raises(FileError, match="pieces do not fit|from the origin|lights for 2 vehicles"):
        write_fleet(fleet, place, to, lights)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("to", KINDS)
def test_a_folder_that_cannot_be_made_is_refused_in_a_sentence(tmp_path, to):
    (tmp_path / "file").write_text("")
    for place in ("file/folder/show.skyc", "file/show.skyc"):
        with pytest.raises(FileError, match="is no folder that can be written to: "):
            write_fleet(crossing(), tmp_path / place, to)

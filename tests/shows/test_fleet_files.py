"""Fleets in files: read back, certified as they are in the file, and refused where they are not what they say."""

import base64
import hashlib
import json
import runpy
import sys
import zipfile
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

import minsnap
from minsnap.basics.storage.atomic import write_file
from minsnap.cli.app import main
from minsnap.errors import FileError
from minsnap.files.convert import write_any
from minsnap.files.formats.skybrush import Lights, cubic_segments, read_skybrush
from minsnap.shows.fleet_files import EXACT_KINDS, KINDS, read_fleet, read_skyc, write_fleet


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


def test_a_server_that_cuts_milliseconds_off_loses_none(tmp_path):
    corners = np.random.default_rng(3).uniform(-3, 3, (400, 3))
    long = minsnap.plan(corners, np.random.default_rng(4).uniform(1.5, 4.5, 399))
    write_fleet(minsnap.Fleet((long,)), tmp_path / "show.skyc")
    with zipfile.ZipFile(tmp_path / "show.skyc") as archive:
        points = json.loads(archive.read("drones/drone_1/trajectory.json"))["points"]
    seconds = [point[0] for point in points]
    cut = [int((b - a) * 1000) for a, b in zip(seconds, seconds[1:], strict=False)]
    whole = cubic_segments(long).breaks
    plain = [int((b / 1000 - a / 1000) * 1000) for a, b in zip(whole.tolist(), whole.tolist()[1:], strict=False)]
    assert cut == np.diff(whole).tolist() != plain


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
    assert "HEIGHTS, YAWS = [1.0, 1.0], [0.0, 0.0]" in script and "DURATION = 4.6" in script


def flown_by_script(folder, monkeypatch):
    """What ``fly.py`` of a folder asks of its vehicles, in order."""
    asked = []

    class Vehicle:
        initialPosition = (1.0, 2.0, 0.0)  # noqa: N815 - crazyswarm2's name

        def __getattr__(self, name):
            return lambda *values, **named: asked.append((name, *values, *named.values()))

    class Everyone(Vehicle):
        crazyfliesByName = {f"cf{i}": Vehicle() for i in range(1, 9)}  # noqa: N815, RUF012 - crazyswarm2's name

    swarm = SimpleNamespace(timeHelper=SimpleNamespace(sleep=lambda seconds: None), allcfs=Everyone())
    modules = {
        "crazyflie_py": SimpleNamespace(Crazyswarm=lambda: swarm),
        "crazyflie_py.uav_trajectory": SimpleNamespace(Trajectory=Vehicle),
    }
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    runpy.run_path(str(folder / "fly.py"), run_name="__main__")
    return asked


def test_the_script_climbs_to_starts_in_the_air_and_lets_others_take_off_by_their_curves(tmp_path, monkeypatch):
    """All climbed to half a metre; those that begin on the ground were then sent to z = 0, and all to yaw 0."""
    up, ground = minsnap.plan([(0, 0, 0), (0, 0, 1)], [2.0]), minsnap.plan([(0, 0, 1), (0, 0, 0)], [2.0], yaw=0.7)
    write_fleet(minsnap.Fleet((ground, up)), tmp_path / "mixed", "crazyswarm2")
    asked = [
        each for each in flown_by_script(tmp_path / "mixed", monkeypatch) if each[0] in ("takeoff", "goTo", "land")
    ]
    assert asked[0] == ("takeoff", 0.5, 2.5) and asked[1][2:] == (0.7, 2.5) and len(asked) == 3
    assert asked[1][1] == pytest.approx((1.0, 2.0, 1.0))
    write_fleet(minsnap.Fleet((up,)), tmp_path / "low", "crazyswarm2")
    assert [each[0] for each in flown_by_script(tmp_path / "low", monkeypatch)][-2:] == ["startTrajectory", "land"]
    assert "takeoff" not in [each[0] for each in flown_by_script(tmp_path / "low", monkeypatch)]


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

"""Formations, shows from YAML, flights that are kept, the command line and its report."""

import re

import numpy as np
import pytest
from PIL import Image

import minsnap
from minsnap.cli.app import main
from minsnap.errors import FileError, FleetError
from minsnap.plot import plot_fleet, plot_separation
from minsnap.plot.fleet_figures import least_distances
from minsnap.shows.acts import Act, Show
from minsnap.shows.fleet_files import read_fleet
from minsnap.shows.formations import circle, grid
from minsnap.shows.moves import Move, moved
from minsnap.shows.show import fly
from minsnap.shows.show_yaml import read_show
from minsnap.shows.skyc import read_skyc

SHOW = """
vehicles: 6
separation: 0.8
downwash: 2
limits: {speed: 3, acceleration: 3}
room: [[-6, -6, 0], [6, 6, 12]]
home: {grid: {spacing: 1.5}}
acts:
  - {name: ring, formation: {circle: {radius: 3, height: 5}}, hold: 1.5, colour: [255, 0, 0]}
  - {name: wheel, formation: {circle: {radius: 3, height: 3, upright: true}}, turn: 90, colour: [0, 0, 255], fade: true}
"""


@pytest.fixture
def show_file(tmp_path):
    (tmp_path / "show.yaml").write_text(SHOW)
    return tmp_path / "show.yaml"


def run(*words):
    """Exit status of the command line."""
    with pytest.raises(SystemExit) as left:
        main([str(word) for word in words])
    return left.value.code or 0


def test_a_show_is_apart_within_its_limits_and_ends_where_it_began(show_file):
    show = read_show(show_file)
    flown = fly(show)
    certificate = minsnap.certify_fleet(flown.fleet, limits=show.limits, room=show.room)
    assert certificate.ok and certificate.least_distance >= 0.8
    assert flown.fleet(0.0) == pytest.approx(show.home) and flown.fleet(flown.fleet.duration) == pytest.approx(
        show.home
    )
    ring = flown.stages[1]
    assert ring.name == "ring" and ring.end - ring.arrival == pytest.approx(1.5)
    for t in (ring.arrival, ring.end):
        there = flown.fleet(t)
        assert sorted(map(tuple, there.round(6))) == sorted(map(tuple, show.acts[0].points.round(6)))
    for order in (1, 2, 3):
        assert np.abs(flown.fleet(ring.arrival, order)).max() < 1e-6, order


def test_lights_follow_the_acts(show_file):
    flown = fly(read_show(show_file))
    ring, wheel = flown.stages[1:3]
    lamp = flown.lights[0]
    assert lamp(0.5 * ring.start) == pytest.approx([255, 255, 255])
    assert lamp(ring.arrival + 0.1) == pytest.approx([255, 0, 0])
    assert lamp((wheel.start + wheel.arrival) / 2) == pytest.approx([127.5, 0, 127.5])
    assert lamp(flown.fleet.duration + 1.0) == pytest.approx([0, 0, 0])


def test_flights_that_were_found_are_kept(show_file, tmp_path):
    show, told = read_show(show_file), []

    def killed(line):
        told.append(line)
        if len(told) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fly(show, tmp_path / "kept", killed)
    resumed = fly(show, tmp_path / "kept")
    assert [stage.method == "kept" for stage in resumed.stages] == [True, True, False, False, False]
    whole = fly(show)
    for one, two in zip(resumed.fleet, whole.fleet, strict=True):
        assert (one.control_points == two.control_points).all() and (one.durations == two.durations).all()


def test_acts_that_stand_too_close_or_are_unknown_are_refused(show_file):
    """Of a show without limits on speed and acceleration it was said that it needs a --time, which is no option."""
    show_file.write_text(SHOW.replace("radius: 3, height: 5", "radius: 0.7, height: 5"))
    with pytest.raises(FleetError, match=r"act 'ring' are 0\.700 m apart, 0\.100 m less than the separation"):
        fly(read_show(show_file))
    for old, new, words in (
        ("hold: 1.5", "holds: 1.5", "'holds' is not known: did you mean hold"),
        ("circle: {radius: 3, height: 5}", "cube: {}", "'cube' is not known"),
        ("radius: 3, height: 5", "radios: 3", "did you mean radius"),
        ("[255, 0, 0]", "[256, 0, 0]", "from 0 to 255"),
        ("separation: 0.8", "", "has no separation"),
    ):
        show_file.write_text(SHOW.replace(old, new))
        with pytest.raises(FileError, match=words):
            read_show(show_file)
    for held in ("", "jerk: 5", "horizontal_speed: 3"):
        show_file.write_text(SHOW.replace("speed: 3, acceleration: 3", held))
        with pytest.raises(
            FleetError, match="how fast vehicles climb: give limits such as {speed: 4, acceleration: 3}"
        ):
            fly(read_show(show_file))
    show_file.write_text(SHOW.replace("circle: {radius: 3, height: 5}", f"points: {[[i, 0, 3] for i in range(7)]}"))
    with pytest.raises(FleetError, match="has 7 points, and home has 6: give as many or fewer"):
        fly(read_show(show_file))


@pytest.mark.slow
@pytest.mark.parametrize("to", ["csv", "skyc"])
def test_the_command_certifies_what_it_wrote(show_file, tmp_path, capsys, to):
    out, page = tmp_path / "out", tmp_path / "report.html"
    assert run("fleet", show_file, "-o", out, "--to", to, "--report", page) == 0
    speeds = re.search(r"<td>horizontal speed \[m/s\]</td><td>([\d.]+)</td><td>8, kept</td>", page.read_text())
    place = out / "show.skyc" if to == "skyc" else out
    held = read_fleet(place)
    level = np.linalg.norm(held(np.linspace(0.0, held.duration, 5001), 1)[..., :2], axis=2).max()
    assert float(speeds[1]) == pytest.approx(level, rel=1e-3)
    printed = capsys.readouterr().out
    held = minsnap.certify_fleet(held, minsnap.Separation(0.8, 2.0))
    assert held.ok and f"{held.least_distance:.4f} m" in printed and "apart at every instant" in printed
    html = page.read_text()
    assert f"{held.least_distance:.4f} m at {held.instant:.2f} s" in html
    assert html.count("<svg") == (3 if to == "skyc" else 1), "lights and acts are drawn where files hold them"
    assert "Apart at every instant" in html and len(re.findall(r"[0-9a-f]{64}", html)) >= 1
    assert "-0.00" not in re.sub(r"<svg.*</svg>", "", html, flags=re.DOTALL)
    if to == "skyc":
        assert "the files reach" not in printed and "the files reach" not in html, "slowed until they do not"
        assert read_skyc(place).lights[0](20.0) is not None


@pytest.mark.slow
def test_fleets_are_drawn_by_the_command_line(show_file, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("minsnap.plot.animation.LONGEST", 2.0)
    film = tmp_path / "show.gif"
    assert run("fleet", show_file, "-o", tmp_path / "out", "--animate", film) == 0
    with Image.open(film) as pictures:
        assert pictures.n_frames in (30, 31, 32)
    assert run("plot", tmp_path / "out", "-o", tmp_path / "show.svg", "--view", "xz") == 0
    assert "z [m]" in (tmp_path / "show.svg").read_text()
    assert run("fleet", show_file, "-o", tmp_path / "more", "--animate", "show.avi") == 2
    assert "show.avi does not end in .gif" in capsys.readouterr().err and not (tmp_path / "more").exists()


def test_flights_too_long_for_the_vehicles_are_refused_before_what_follows_is_planned(show_file, tmp_path, capsys):
    """All was planned first, and the advice named no option of the command."""
    way = ", ".join(f"[{i % 2}, {0.5 * (i % 3)}, 0]" for i in range(1, 24))
    moves = f"moves: [{{along: [[0, 0, 0], {way}]}}, {{along: [[0, 0, 0], {way}]}}]"
    show_file.write_text(SHOW.replace("hold: 1.5", f"hold: 1.5, {moves}"))
    assert run("fleet", show_file, "-o", tmp_path / "out", "--to", "crazyswarm2") == 2
    told = capsys.readouterr().err.splitlines()
    said = r"the flight to 'ring moves' and 'ring moves' takes \d+ pieces, and a Crazyflie's memory holds 31 at once: "
    assert re.search(f"{said}write it --to csv, which minsnap upload flies", told[-1]), told[-1]
    assert not any(line.startswith(("minsnap: wheel", "minsnap: landing")) for line in told)


def test_figures_show_every_vehicle_and_what_was_proved(show_file):
    fleet = fly(read_show(show_file)).fleet
    axes = plot_fleet(fleet, "xz")
    assert len(axes.collections[0].get_segments()) == 6 * 400 and axes.get_ylabel() == "z [m]"
    certificate = minsnap.certify_fleet(fleet)
    axes = plot_separation(certificate)
    assert axes.lines[2].get_ydata()[0] == certificate.least_distance
    assert least_distances(fleet, fleet.separation, np.array([certificate.instant]))[0] == pytest.approx(
        certificate.least_distance, rel=1e-6
    )
    with pytest.raises(FleetError, match="view"):
        plot_fleet(fleet, "zx")


def test_the_folder_of_a_show_is_no_file(show_file, tmp_path, capsys):
    for name, said in ((show_file, "is a file: give the name of a folder"), (tmp_path / "o.skyc", "give another name")):
        with pytest.raises(SystemExit, match="2"):
            main(["fleet", str(show_file), "-o", str(name), "--to", "skyc"])
        assert said in capsys.readouterr().err and not (tmp_path / "o.skyc").exists()


def test_a_report_replaces_neither_the_show_nor_its_files(show_file, tmp_path, capsys):
    """The page took the place of the show, or of the files that it had proved."""
    show = tmp_path / "show.html"
    show.write_text(SHOW.partition("  - {name: wheel")[0])
    for page, said in (
        (show, "is the file that is read"),
        (tmp_path / "out" / "traj1.csv", "does not end in .html or .pdf"),
        (tmp_path / "out" / "manifest.json", "does not end in .html or .pdf"),
    ):
        assert run("fleet", show, "-o", tmp_path / "out", "--report", page) == 2
        assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists() and len(read_show(show).acts) == 1


def test_a_flight_that_is_refused_is_named(show_file):
    show_file.write_text(SHOW.replace("room: [[-6, -6, 0], [6, 6, 12]]", "room: [[-6, -6, 0], [6, 6, 4.5]]"))
    with pytest.raises(FleetError, match=r"^point 0 of act 'ring' is 0\.5 m outside of the room: move it"):
        fly(read_show(show_file))
    show_file.write_text(SHOW.replace("home: {grid", "take_off: 13\nhome: {grid"))
    with pytest.raises(FleetError, match=r"^point 0 of the end of take_off is 1 m outside of the room: move it"):
        fly(read_show(show_file))


def test_nobody_goes_around_another_underground():
    """Vehicles that return crosswise at 0.4 m dived to -0.3 m."""
    home, low = grid(9, 1.0), grid(9, 1.0, 0.4)
    act = Act("low", low, moves=(Move(np.pi),))
    show = Show(home, (act,), minsnap.Separation(0.8), minsnap.Limits(speed=2, acceleration=3), take_off=0.4)
    flown = fly(show)
    assert flown.stages[-2].method == "joint"
    assert minsnap.certify_fleet(flown.fleet, room=((-9, -9, 0), (9, 9, 9))).ok


def test_a_formation_turns_grows_and_goes_along_within_limits():
    ring, limits = circle(8, 4.0, 8.0), minsnap.Limits(speed=3, acceleration=2)
    curves = moved(Move(np.pi, 1.5, np.array([[0.0, 0, 0], [3, 0, 1], [3, 3, 0]])), ring, limits)
    assert minsnap.certify_fleet(curves, limits=limits).ok
    assert minsnap.certify(curves[0]).continuity >= 3
    half = [curve(curve.duration) for curve in curves]
    assert half == pytest.approx(-1.5 * (ring - [0, 0, 8]) + [3.0, 3.0, 8.0])
    t = np.linspace(0.0, curves[0].duration, 500)
    spread = [np.linalg.norm(a(t) - b(t), axis=1) / np.linalg.norm(a(t) - c(t), axis=1) for a, b, c in [curves[:3]]]
    assert np.ptp(spread) < 1e-8  # it keeps its shape
    slow = moved(Move(2.0 * np.pi, seconds=60.0), ring, limits)
    assert slow[0].duration == pytest.approx(60.0) and slow[3](60.0) == pytest.approx(ring[3])


def show_of(*acts, **how):
    """Four vehicles on the ground, and acts."""
    return Show(grid(4, 2.0), acts, minsnap.Separation(1.0), minsnap.Limits(speed=4, acceleration=3), **how)


def test_what_does_not_move_takes_no_time():
    """An act in the same places, a climb of no height and a turn of nothing were errors about limits and durations."""
    ring = circle(4, 4.0, 8.0)
    flown = fly(show_of(Act("red", ring, 2.0, moves=(Move(),)), Act("blue", ring, 1.0), take_off=0.0))
    stages = {stage.name: stage for stage in flown.stages}
    assert stages["take-off"].end == 0.0 and stages["blue"].end - stages["red"].end == pytest.approx(1.0)
    assert flown.fleet.duration == pytest.approx(stages["landing"].end)
    assert flown.fleet(stages["blue"].end) == pytest.approx(flown.fleet(stages["red"].arrival))
    with pytest.raises(FleetError, match="nothing moves in this show"):
        fly(show_of(take_off=0.0))


@pytest.mark.parametrize(
    ("act", "how", "sentence"),
    [
        ({}, {"take_off": -1.0}, "take_off is -1.0: give a number from 0"),
        ({"hold": -2.0}, {}, "hold of act 'a' is -2.0"),
        ({"hold": np.nan}, {}, "hold of act 'a' is nan"),
        ({"points": np.full((4, 3), np.nan)}, {}, "act 'a' has a point that is not finite"),
        ({"points": circle(4, 4.0, -1.0)}, {}, "act 'a' is 1 m below the lowest home"),
        ({"moves": (Move(1.0, seconds=np.nan),)}, {}, "a move takes nan s"),
        (
            {"moves": (Move(2.0 * np.pi, seconds=0.1),)},
            {},
            r"a move in 0\.1 s does not keep the limits \(speed [0-9.]+ of 4\)",
        ),
    ],
)
def test_numbers_that_no_show_can_have_are_refused_before_anything_is_written(act, how, sentence):
    """Vehicles climbed below the ground, holds went backwards, and a move at 137 m/s replaced the files of a show."""
    with pytest.raises(FleetError, match=sentence):
        fly(show_of(Act(**{"name": "a", "points": circle(4, 4.0, 8.0)} | act), **how))


def test_seconds_of_a_move_count_where_a_tilt_is_limited_and_home_is_as_it_is():
    """The share of a tilt used in one second was taken for the least time."""
    gentle = moved(Move(scale=1.05, seconds=0.5), circle(4, 1.0, 8.0), minsnap.Limits(speed=10, tilt=0.5))
    assert gentle[0].duration == pytest.approx(0.5)
    with pytest.raises(FleetError, match=r"does not keep the limits \(tilt"):
        moved(Move(3.0, seconds=16.0), circle(4, 100.0, 8.0), minsnap.Limits(speed=500, tilt=0.1))
    low = Act("low", circle(4, 4.0, -1e-16))
    assert fly(show_of(low, take_off=0.0)).fleet.duration > 0.0
    with pytest.raises(FleetError, match=r"home has the shape \(4, 2\)"):
        fly(Show(np.zeros((4, 2)), (low,), minsnap.Separation(1.0), minsnap.Limits(speed=4, acceleration=3)))


LARGER = """
vehicles: 4
separation: 0.8
limits: {speed: 3, acceleration: 3}
home: {grid: {spacing: 1.0}}
layers: 2
land: any
acts:
  - formation: {circle: {radius: 3, height: 6}}
    hold: 1
    colour: [[255, 0, 0], [0, 255, 0], [0, 0, 255], [9, 9, 9]]
    moves: [{turn: 180}, {scale: 0.5, seconds: 5}]
"""


def test_shows_climb_in_layers_move_and_land_anywhere(tmp_path):
    (tmp_path / "show.yaml").write_text(LARGER)
    show = read_show(tmp_path / "show.yaml")
    flown = fly(show)
    assert minsnap.certify_fleet(flown.fleet, limits=show.limits).ok
    names = [stage.name for stage in flown.stages]
    assert names == ["take-off", "act 1", "act 1 moves", "act 1 moves", "return", "landing"]
    climbed = flown.fleet(flown.stages[0].arrival)[:, 2]
    assert climbed == pytest.approx([2.0, 2.8, 2.0, 2.8])
    assert flown.stages[3].arrival - flown.stages[3].start == pytest.approx(5.0)
    end = flown.fleet(flown.fleet.duration)
    assert sorted(map(tuple, end.round(6))) == sorted(map(tuple, show.home))
    there = flown.fleet(flown.stages[1].arrival)
    for place, lights in zip(there, flown.lights, strict=True):
        point = np.linalg.norm(show.acts[0].points - place, axis=1).argmin()
        assert lights(flown.stages[1].arrival + 0.1) == pytest.approx(show.acts[0].colour[point])


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ("scale: 0.1", "vehicles . and . come within .* shrink it less"),
        ("along: [[0, 0, 0], [90, 0, 0]]", "leaves the room by"),
        ("along: [[0, 0, 0], [0, 0, -7]]", "goes 1 m below the lowest home"),
        ("along: [[1, 0, 0], [2, 0, 0]]", r"begins at \(1, 0, 0\): it is counted from the center"),
        ("scale: -1", "positive"),
        ("spin: 1", "spin"),
        ("turn: 1e9", "turns by 1e.09 degrees: give 36000 at most"),
    ],
)
def test_moves_that_cannot_be_are_said_in_a_sentence(tmp_path, change, sentence):
    text = LARGER.replace("turn: 180", change) + "room: [[-9, -9, 0], [9, 9, 9]]\n"
    (tmp_path / "show.yaml").write_text(text)
    with pytest.raises(minsnap.InputError, match=sentence):
        fly(read_show(tmp_path / "show.yaml"))


def test_homes_at_one_place_are_told_to_be_moved():
    show = Show(np.zeros((2, 3)), (), minsnap.Separation(1.0), minsnap.Limits(speed=3, acceleration=2))
    with pytest.raises(FleetError, match="points 0 and 1 of home are 0.000 m apart.*: move one of them"):
        fly(show)

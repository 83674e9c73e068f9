"""Animations in shows: frames in tables, curves near them, what is too dense or fast, lights and headings in time."""

import re
import zipfile

import numpy as np
import pytest

import minsnap
from minsnap.errors import FileError, FleetError
from minsnap.shows.act_lights import Gradient, LightChange
from minsnap.shows.acts import Act, Show
from minsnap.shows.csv_show import HEADER, read_frames
from minsnap.shows.formations import circle, grid
from minsnap.shows.frame_animation import Animation
from minsnap.shows.show import fly
from minsnap.shows.show_yaml import read_show

APART, LIMITS = minsnap.Separation(1.0, 1.5), minsnap.Limits(speed=4.0, acceleration=3.0, yaw_rate=4.0)
COUNT = 6
SHOW = """
vehicles: 6
separation: 1.0
downwash: 1.5
limits: {speed: 4, acceleration: 3, yaw_rate: 4}
home: {grid: {spacing: 2}}
take_off: 3
acts:
"""


def dance(t, radius=4.0, rate=0.4, begins=0.0):
    """A ring that turns and waves, shape (m, COUNT, 3): it moves in its first and last frame."""
    angle = 2.0 * np.pi * np.arange(COUNT) / COUNT + rate * t[:, None] + begins
    rise = 8.0 + 0.8 * np.sin(1.1 * t[:, None] + angle)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), rise], axis=2)


def tables(place, t, frames, colours=None, header=HEADER, name="Drone {}.csv"):
    """Write the frames into a zip, or into a folder."""
    texts, header = {}, ",".join(header.split(",")[: 4 if colours is None else 7]) if header else None
    for i in range(frames.shape[1]):
        rows = [f"{1e3 * now:.0f},{x:.3f},{y:.3f},{z:.3f}" for now, (x, y, z) in zip(t, frames[:, i], strict=True)]
        if colours is not None:
            rows = [f"{row},{int(r)},{int(g)},{int(b)}" for row, (r, g, b) in zip(rows, colours[:, i], strict=True)]
        texts[name.format(i + 1)] = "\n".join([*([header] if header else []), *rows]) + "\n"
    if place.suffix != ".zip":
        place.mkdir()
        for file, text in texts.items():
            (place / file).write_text(text)
        return
    with zipfile.ZipFile(place, "w") as archive:
        for file, text in reversed(texts.items()):
            archive.writestr(file, text)


T = np.arange(0.0, 8.001, 1.0 / 24.0)
COLOURS = np.stack([np.clip(255.0 * T / 4.0, 0, 255), np.full(len(T), 9.0), 40.0 * np.ones(len(T))], axis=1)
COLOURS = np.repeat(COLOURS[:, None].round(), COUNT, axis=1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("frames")
    tables(place / "dance.zip", T, dance(T), COLOURS)
    return place


@pytest.mark.parametrize(
    ("name", "header"),
    [
        ("a.zip", HEADER),
        ("folder", "Time [msec],x [m],y [m],z [m],Red,Green,Blue"),
        ("b.zip", None),
        ("plain", "t:ms,x,y,z,r,g,b"),
    ],
)
def test_tables_are_read_by_their_numbers_whatever_holds_them(tmp_path, name, header):
    frames = np.repeat(dance(T[:5]), 2, axis=1)
    header = None if header is None else header.replace("t:ms", "t_ms")
    tables(tmp_path / name, T[:5], frames, np.repeat(COLOURS[:5], 2, axis=1), header)
    read = read_frames(tmp_path / name)
    assert read.names[1] == "Drone 2" and read.names[9] == "Drone 10" and len(read) == 12
    assert np.stack(read.positions, axis=1) == pytest.approx(frames, abs=6e-4)
    assert read.instants[3] == pytest.approx(T[:5], abs=6e-4)
    assert read.colours is not None and read.colours[0] == pytest.approx(COLOURS[:5, 0])


@pytest.mark.parametrize(
    ("texts", "sentence"),
    [
        ({}, "holds no CSV: give one for each vehicle"),
        ({"a.csv": f"{HEADER}\n0,1,2,3,0,0,0\n"}, "a has 1 frames: give two or more"),
        ({"a.csv": f"{HEADER}\n0,1,2,3,0,0,0\n0,1,2,3,0,0,0\n"}, "at instants that ascend"),
        ({"a.csv": f"{HEADER}\n0,1,2,3,0,0,0\n40,1,2,x,0,0,0\n"}, r"\.zip: a\.csv, line 3: .*x"),
        ({"a.csv": f"{HEADER}\n0,1,2,3,0,0,0\n40,1,2,3,0,999,0\n"}, "has a colour that is none"),
        ({"a.csv": "0,1,2\n40,1,2\n"}, "has 3 columns and no header"),
        ({"a.csv": "0,1,2,3\n40,1,2\n"}, "different lengths|line 2"),
        ({"a.csv": "0,1,2,3\n40,1,2,3\n", "b.csv": "0,5,2,3\n90,5,2,3\n900,5,2,3\n9000,5,2,3\n"}, "give frames of all"),
    ],
)
def test_tables_that_are_none_are_refused(tmp_path, texts, sentence):
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        for name, text in texts.items():
            archive.writestr(name, text)
    with pytest.raises(FileError, match=sentence):
        read_frames(tmp_path / "a.zip")
    (tmp_path / "b.zip").write_text("no zip")
    with pytest.raises(FileError, match="is not a zip of CSV files"):
        read_frames(tmp_path / "b.zip")


def test_an_animation_is_flown_within_its_tolerance_and_begins_and_ends_at_rest(folder):
    """Its frames move at both ends: time runs up and down, along the same way."""
    animation = Animation(read_frames(folder / "dance.zip"), tolerance=0.03)
    assert animation.eased == (True, True)
    at = animation.flown_at(T)
    assert (np.diff(at) > 0).all() and at[-1] == pytest.approx(T[-1] + 2.0, abs=1e-3), "a second more at each end"
    for i, curve in enumerate(animation.curves):
        assert np.linalg.norm(curve(np.minimum(at, curve.duration)) - dance(T)[:, i], axis=1).max() <= 0.0305
        for order in (1, 2, 3):
            assert np.abs(curve([0.0, curve.duration], order)).max() < 1e-6
    middle = slice(40, -40)
    assert np.diff(at[middle]) == pytest.approx(np.diff(T[middle]), abs=1e-4), "its own pace between"
    still = Animation(read_frames(folder / "dance.zip"), size=16.0, height=5.0, slower=2.0)
    points = np.concatenate(still.places)
    assert np.ptp(points, axis=0).max() == pytest.approx(16.0) and points[:, 2].min() == pytest.approx(5.0)
    assert still.duration == pytest.approx(2.0 * T[-1] + 2.0, abs=1e-3)


@pytest.mark.parametrize("to", ["csv", "skyc"])
def test_an_animation_in_a_show_is_certified_with_its_flights_and_lights(folder, to):
    (folder / "show.yaml").write_text(SHOW + "  - {name: dance, animation: {file: dance.zip, slower: 1.2}}\n")
    show = read_show(folder / "show.yaml")
    flown = fly(show, to=to)
    names = [stage.name for stage in flown.stages]
    assert names == ["take-off", "dance", "dance moves", "return", "landing"]
    assert minsnap.certify_fleet(flown.fleet, APART, LIMITS).ok
    plays = flown.stages[2]
    animation = show.acts[0].moves[0]
    pace = (plays.arrival - plays.start) / animation.duration
    at = np.minimum(plays.start + pace * animation.flown_at(T), plays.arrival)
    places = flown.fleet(at)
    there = np.array([np.abs(places[:, 0] - point).sum(axis=1).argmin() for point in dance(T)[0]])
    assert sorted(there) == list(range(COUNT)) and np.abs(places[there].transpose(1, 0, 2) - dance(T)).max() < 0.03
    lamp = flown.lights[0]
    assert lamp(at[48]) == pytest.approx(COLOURS[48, 0], abs=2.0) and lamp(at[-2]) == pytest.approx([255, 9, 40], abs=2)
    assert len(lamp.instants) < 40, "frames between which colours are straight are left out"


def test_what_is_too_dense_or_too_fast_is_answered_with_what_goes_before_anything_is_planned(folder, monkeypatch):
    tables(folder / "small.zip", T, dance(T, radius=0.8, rate=3.0))
    monkeypatch.setattr("minsnap.shows.show_course.plan_fleet", None)
    (folder / "show.yaml").write_text(SHOW + "  - {name: dance, animation: {file: small.zip}}\n")
    with pytest.raises(
        FleetError, match=r"come within 0\.\d+ m of 1 m at .* give it size: .*; .* give it slower:"
    ) as said:
        fly(read_show(folder / "show.yaml"))
    size, slower = re.findall(r"give it \w+: ([\d.]+)", str(said.value))
    changed = f"{{file: small.zip, size: {size}, height: 6, slower: {slower}}}"
    (folder / "show.yaml").write_text(SHOW + f"  - {{name: dance, animation: {changed}}}\n")
    show = read_show(folder / "show.yaml")
    curves = show.acts[0].moves[0].curves
    assert minsnap.certify_fleet(list(curves), APART, LIMITS).ok
    assert float(size) < 1.2 * minsnap.certify_fleet(list(curves), APART).least_distance * 1.6 / 0.8


def test_those_that_wait_are_apart_from_an_animation(folder):
    """A ring of six flies around above the homes of eight, of whom two wait there."""
    low = SHOW.replace("vehicles: 6", "vehicles: 8").replace("take_off: 3", "take_off: 7.5")
    (folder / "show.yaml").write_text(
        low + "  - {animation: {file: around.zip, slower: 1.2}}\n  - {formation: {grid: {spacing: 3, height: 12}}}\n"
    )
    tables(folder / "around.zip", T, dance(T, radius=2.5, rate=0.8))
    with pytest.raises(FleetError, match="of which one waits, come within .* raise the act"):
        fly(read_show(folder / "show.yaml"))


@pytest.mark.parametrize(
    ("act", "sentence"),
    [
        ("{animation: {file: none.zip}}", "cannot be read|No such file"),
        ("{animation: {file: dance.zip}, formation: {circle: {radius: 3, height: 5}}}", "a formation or an animation"),
        ("{name: a}", "a formation or an animation"),
        ("{animation: {file: dance.zip, slower: 0}}", "slower of an animation is 0"),
        ("{animation: {file: dance.zip}, yaw: [1, 2]}", "has 2 headings: give one, or one for each point"),
        ("{formation: {circle: {radius: 4, height: 5}}, colour: {from: red, to: blue, period: 0}}", "the period 0"),
    ],
)
def test_acts_that_cannot_be_are_said_in_a_sentence(folder, act, sentence):
    (folder / "show.yaml").write_text(SHOW + f"  - {act}\n")
    with pytest.raises((FileError, FleetError), match=sentence):
        read_show(folder / "show.yaml").check()


def test_lights_change_in_time_and_gradients_run(folder):
    act = "{name: ring, formation: {circle: {radius: 4, height: 6}}, hold: 6, colour: red, lights: [{after: 2, colour: "
    act += "blue}, {after: 2, colour: {from: lime, to: black, along: x, period: 4}, fade: false}]}"
    (folder / "show.yaml").write_text(SHOW + f"  - {act}\n")
    show = read_show(folder / "show.yaml")
    flown = fly(show)
    ring = flown.stages[1]
    for vehicle, lamp in enumerate(flown.lights):
        assert lamp(ring.arrival + 1.0) == pytest.approx([127.5, 0.0, 127.5], abs=0.6), "a fade from red to blue"
        where = (flown.fleet(ring.arrival)[vehicle, 0] + 4.0) / 8.0
        for t in np.linspace(0.01, 3.9, 40):
            phase = 0.5 * where - t / 4.0
            green = 255.0 * (1.0 - 2.0 * abs(phase - round(phase)))
            assert lamp(ring.arrival + 2.0 + t) == pytest.approx([0.0, green, 0.0], abs=0.6)
    standing = Gradient(np.array([0.0, 0.25, 1.0]), np.array([[0, 0, 0], [200, 100, 0]]))
    assert [standing.at(i, np.zeros(1))[0].tolist() for i in range(3)] == [[0, 0, 0], [50, 25, 0], [200, 100, 0]]
    assert not len(standing.turns(1, 9.0))


@pytest.mark.parametrize("to", ["csv", "skyc"])
def test_vehicles_turn_on_their_way_to_an_act(tmp_path, to):
    out = np.arctan2(*circle(COUNT, 4.0)[:, 1::-1].T)
    acts = (
        Act("ring", circle(COUNT, 4.0, 7.0), 1.0, yaw=out),
        Act("high", circle(COUNT, 5.0, 9.0), 1.0, yaw=np.pi / 2),
    )
    show = Show(grid(COUNT, 2.0), acts, APART, LIMITS)
    flown = fly(show, to=to)
    for curve in flown.fleet:
        place = curve(flown.stages[1].end - 0.1)
        assert np.angle(np.exp(1j * (curve.yaw(flown.stages[1].end - 0.1) - np.arctan2(place[1], place[0])))) == (
            pytest.approx(0.0, abs=1e-6)
        )
        assert curve.yaw(0.0) == 0.0 and curve.yaw(curve.duration) % (2 * np.pi) == pytest.approx(np.pi / 2)
    assert minsnap.certify_fleet(flown.fleet, APART, LIMITS).ok
    place = tmp_path / "show.skyc" if to == "skyc" else tmp_path / "out"
    minsnap.shows.write_fleet(flown.fleet, place)
    held = minsnap.shows.read_fleet(place)
    t = np.linspace(0.0, held.duration, 200)
    for one, two in zip(flown.fleet, held, strict=True):
        apart = one.yaw(np.minimum(t, one.duration)) - two.yaw(np.minimum(t, two.duration))
        assert np.abs(np.angle(np.exp(1j * apart))).max() < np.radians(0.6)


def test_a_turn_that_is_too_fast_says_how_long_it_takes():
    act = Act("ring", circle(COUNT, 4.0, 7.0), 1.0, yaw=np.pi)
    slow = minsnap.Limits(speed=4.0, acceleration=3.0, yaw_rate=0.2)
    with pytest.raises(FleetError, match=r"turn by 180 degrees on the flight to 'ring'.* in .* give it more seconds"):
        fly(Show(grid(COUNT, 2.0), (act,), APART, slow))


def test_changes_of_lights_are_in_order():
    act = Act("a", circle(COUNT, 4.0, 7.0), lights=(LightChange(1.0, (1, 2, 3)), LightChange(0.5, (1, 2, 3))))
    with pytest.raises(FleetError, match="not in the order of their times"):
        Show(grid(COUNT, 2.0), (act,), APART, LIMITS).check()

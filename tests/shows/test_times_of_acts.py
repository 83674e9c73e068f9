"""Acts at instants, flights of given seconds, departures one after the other: in the plan and in files."""

import json
import zipfile

import numpy as np
import pytest

import minsnap
from minsnap.cli.app import main
from minsnap.errors import FleetError, UnprovedError
from minsnap.shows.acts import Act, Show
from minsnap.shows.fleet_files import read_fleet
from minsnap.shows.formations import circle, grid
from minsnap.shows.least_times import least_seconds
from minsnap.shows.show import fly

RING, HIGH = circle(6, 4.0, 8.0), circle(6, 5.0, 12.0)
LIMITS = minsnap.Limits(speed=3, acceleration=2)


def show_of(*acts, **how):
    return Show(grid(6, 2.0), acts, minsnap.Separation(1.0), LIMITS, **how)


@pytest.mark.parametrize("to", ["csv", "skyc"])
def test_acts_are_reached_when_they_are_to_be(to):
    show = show_of(
        Act("ring", RING, 2.0, at=20.0), Act("high", HIGH, 1.0, seconds=7.0), Act("low", RING, at=45.0, seconds=6.0)
    )
    flown = fly(show, to=to)
    stages = {stage.name: stage for stage in flown.stages}
    assert stages["ring"].arrival == pytest.approx(20.0, abs=1e-9)
    assert stages["high"].start == pytest.approx(22.0) and stages["high"].arrival == pytest.approx(29.0)
    assert (stages["low"].start, stages["low"].arrival) == pytest.approx((39.0, 45.0))
    assert stages["high"].end == pytest.approx(39.0), "they wait until the next flight must begin"
    for name, points in (("ring", RING), ("high", HIGH), ("low", RING)):
        there = flown.fleet(stages[name].arrival)
        assert np.abs(np.sort(there, axis=0) - np.sort(points, axis=0)).max() < 1e-6
        assert np.abs(flown.fleet(stages[name].arrival, 1)).max() < 1e-6
    assert minsnap.certify_fleet(flown.fleet, show.separation, LIMITS).ok


def test_a_longer_flight_has_less_snap():
    """Of the flight of 10 s, and of the shortest one stretched to 10 s."""
    own, quick = (fly(show_of(Act("ring", RING, seconds=seconds), take_off=3.0)) for seconds in (10.0, None))
    costs, lasts = [], []
    for flown in (own, quick):
        stage = flown.stages[1]
        t = np.linspace(stage.start, stage.arrival, 20_001)
        costs.append((flown.fleet(t, 4) ** 2).sum(axis=(0, 2)).mean() * (stage.arrival - stage.start))
        lasts.append(stage.arrival - stage.start)
    assert lasts[0] == pytest.approx(10.0)
    assert costs[0] < 0.7 * costs[1] * (lasts[1] / lasts[0]) ** 7


@pytest.mark.parametrize("to", ["csv", "skyc"])
def test_a_time_that_is_too_short_is_refused_with_one_that_goes(to):
    with pytest.raises(UnprovedError, match=r"the flight to ring: it is to last 3.8 s, .* seconds: [0-9.]+") as short:
        fly(show_of(Act("ring", RING, seconds=3.8)), to=to)
    seconds = float(str(short.value).split("seconds: ")[1].split()[0])
    assert fly(show_of(Act("ring", RING, seconds=seconds)), to=to).fleet.duration > seconds
    with pytest.raises(UnprovedError, match=r"at 6 s, .* s are left for it, .* at: ([0-9.]+) or later") as late:
        fly(show_of(Act("ring", RING, at=6.0)), to=to)
    at = float(str(late.value).split("at: ")[1].split()[0])
    assert fly(show_of(Act("ring", RING, at=at)), to=to).stages[1].arrival == pytest.approx(at)


@pytest.mark.parametrize(
    ("acts", "sentence"),
    [
        ([Act("a", RING, at=1.0)], "act 'a' is at 1 s, and within the limits nobody is there before"),
        ([Act("a", RING, at=20.0), Act("b", HIGH, at=21.0)], "act 'b' is at 21 s, and act 'a' lasts until 23 s"),
        ([Act("a", RING, seconds=0.0)], "the flight to act 'a' lasts 0 s"),
        ([Act("a", RING, at=-1.0)], "at of act 'a' is -1.0"),
        ([Act("a", RING, seconds=np.nan)], "seconds of act 'a' is nan"),
        ([Act("a", RING, at=9.0, seconds=8.9)], "act 'a' is at 9 s, and within the limits nobody is there before"),
        ([Act("a", RING, delays=np.zeros(5))], "act 'a' has 5 delays for 6 vehicles"),
        ([Act("a", RING, delays=-np.ones(6))], "a delay of act 'a' is -1.0"),
    ],
)
def test_times_that_cannot_be_are_refused(acts, sentence):
    with pytest.raises(FleetError, match=sentence):
        fly(show_of(*acts))


@pytest.mark.parametrize("seconds", [None, 12.0])
def test_vehicles_leave_one_after_the_other(seconds):
    delays = np.arange(6) * 0.5
    flown = fly(show_of(Act("ring", RING, delays=delays, seconds=seconds)))
    stage = flown.stages[1]
    points = flown.fleet(stage.arrival)
    t = np.linspace(stage.start, stage.arrival, 40_001)
    speeds = np.linalg.norm(flown.fleet(t, 1), axis=2)
    for place, speed in zip(points, speeds, strict=True):
        own = delays[np.linalg.norm(RING - place, axis=1).argmin()]
        moving = t[speed > 1e-6]
        assert moving[0] - stage.start == pytest.approx(own, abs=0.05)
    if seconds is not None:
        assert stage.arrival - stage.start == pytest.approx(seconds)
    assert minsnap.certify_fleet(flown.fleet, minsnap.Separation(1.0), LIMITS).ok
    with pytest.raises(UnprovedError, match="it is to last 3.8 s"):
        fly(show_of(Act("ring", RING, delays=delays, seconds=3.8)))


def test_delays_for_which_straight_lines_do_not_do_are_searched_for():
    """The one that leaves last stands in the way of the other."""
    starts = np.array([[0.0, 0, 0], [3, 0, 0]])
    act = Act("line", np.array([[6.0, 0, 2], [4.0, 0.2, 2]]), delays=np.array([4.0, 0.0]))
    flown = fly(Show(starts, (act,), minsnap.Separation(1.0), LIMITS))
    assert flown.stages[1].method == "joint"
    assert minsnap.certify_fleet(flown.fleet, minsnap.Separation(1.0), LIMITS).ok
    t = flown.stages[1].start + np.linspace(0.0, 3.9, 99)
    waits = flown.fleet[1]
    assert np.abs(waits(t, 1)).max() < 1e-6


@pytest.mark.slow
def test_the_command_takes_times_and_writes_cues(tmp_path, capsys):
    text = "vehicles: 4\nseparation: 1\nlimits: {speed: 3, acceleration: 2}\nhome: {grid: {spacing: 2}}\ntake_off: 3\n"
    text += "acts:\n  - {name: one, formation: {circle: {radius: 3, height: 6}}, at: 15, delay: 0.2}\n"
    text += "  - {name: two, formation: {circle: {radius: 4, height: 8}}, seconds: 6, delay: [0, 1, 0, 1]}\n"
    (tmp_path / "show.yaml").write_text(text)
    with pytest.raises(SystemExit) as left:
        main(["fleet", str(tmp_path / "show.yaml"), "-o", str(tmp_path / "out"), "--to", "skyc"])
    assert not left.value.code, capsys.readouterr()
    with zipfile.ZipFile(tmp_path / "out" / "show.skyc") as archive:
        cues = {item["name"]: item["time"] for item in json.loads(archive.read("cues.json"))["items"]}
    assert cues == pytest.approx({"one": 15.0, "two": 24.0})
    held = read_fleet(tmp_path / "out" / "show.skyc")
    assert np.linalg.norm(held(15.0)[:, :2], axis=1) == pytest.approx(3.0, abs=0.01)
    (tmp_path / "show.yaml").write_text(text.replace("seconds: 6", "seconds: 2.3"))
    with pytest.raises(SystemExit) as left:
        main(["fleet", str(tmp_path / "show.yaml"), "-o", str(tmp_path / "more"), "--to", "skyc"])
    assert left.value.code == 1 and "give 'two' seconds:" in capsys.readouterr().err
    assert not (tmp_path / "more" / "show.skyc").exists()


@pytest.mark.parametrize(("times", "said"), [
    ({"seconds": 0.5}, "no flight there takes less than"),
    ({"at": 2.0}, "nobody is there before"),
    ({"at": 6.0, "seconds": 5.0}, "nobody is there before"),
])  # fmt: skip
def test_times_that_no_flight_keeps_are_refused_before_anything_is_planned(times, said):
    home = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    act = Act("far", home + (0.0, 9.0, 12.0), **times)
    show = Show(home, (act,), minsnap.Separation(1.0), minsnap.Limits(speed=4.0, acceleration=3.0))
    told = []
    with pytest.raises(minsnap.errors.FleetError, match=said):
        fly(show, told=told.append)
    assert told == []


def test_no_flight_is_quicker_than_its_least_time():
    rng = np.random.default_rng(5)
    for _ in range(5):
        starts, goals = rng.uniform(0.0, 30.0, (2, 6, 3))
        limits = minsnap.Limits(speed=4.0, acceleration=3.0, norm=("axis", "euclidean")[int(rng.integers(2))])
        ways = np.stack([starts, goals[minsnap.assign(starts, goals)]], axis=1)
        flight = minsnap.plan_fleet(ways, limits, 0.01)
        assert least_seconds(starts, goals, limits) <= flight.duration
        alone = minsnap.plan([(0, 0, 0), (0, 0, 20)], limits=limits)
        assert (
            0.9 * alone.duration
            <= least_seconds(np.zeros((1, 3)), np.array([[0, 0, 20.0]]), limits)
            <= alone.duration * 1.8
        )


def test_each_flight_says_how_near_it_is_to_the_least_time():
    """Not one whose time is given; no flight of a vehicle from place to place is shorter than its bound."""
    show = show_of(
        Act("ring", RING, 1.0), Act("high", HIGH, 1.0, seconds=9.0), Act("late", RING, delays=np.arange(6.0))
    )
    flown = fly(show, to="skyc")
    stages = {stage.name: stage for stage in flown.stages}
    assert stages["high"].longer is None and stages["late"].longer is None
    for name in ("take-off", "ring", "return", "landing"):
        stage = stages[name]
        ways = flown.fleet(np.array([stage.start, stage.arrival]))
        upright = {"vertical_speed": 1.0} if name in ("take-off", "landing") else {}
        limits = minsnap.Limits(**show.flown_limits.given() | upright)
        alone = max(minsnap.plan(way, limits=limits, pieces=8).duration for way in ways if np.ptp(way, 0).any())
        assert stage.least <= alone and 0.0 <= stage.longer < 0.25, (name, stage)

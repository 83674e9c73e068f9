"""Ways home from every second of a show, what one meets that fails, and the block of files that holds returns."""

import json
import re
import zipfile

import numpy as np
import pytest

import minsnap
from minsnap.cli.app import main
from minsnap.errors import FileError
from minsnap.files.formats.return_entries import ReturnEntry, return_bytes, returns_of
from minsnap.files.formats.skybrush import read_skybrush
from minsnap.shows import write_fleet
from minsnap.shows.acts import Act, Show
from minsnap.shows.failures import failures_of
from minsnap.shows.fleet_files import read_fleet
from minsnap.shows.formations import circle, grid
from minsnap.shows.return_figure import return_figure, spans_text
from minsnap.shows.returns import plan_returns
from minsnap.shows.show import fly

LIMITS = minsnap.Limits(speed=3, acceleration=2)
APART = minsnap.Separation(1.0, 2.0)


@pytest.fixture(scope="module")
def flown():
    acts = (Act("ring", circle(12, 6.0, 9.0), 4.0), Act("wheel", circle(12, 6.0, 4.0, upright=True), 3.0))
    return fly(Show(grid(12, 2.0), acts, APART, LIMITS, take_off=4.0)).fleet


@pytest.fixture(scope="module")
def returns(flown):
    return plan_returns(flown, APART, LIMITS, 4.0)


def way(plan, vehicle, acceleration, t):
    """Places of a vehicle t seconds after it was called, as Skybrush's firmware flies the entry: a trapezoid."""
    start, goal, lasts = plan.starts[vehicle], plan.goals[vehicle], plan.lasts
    length = np.linalg.norm(goal - start)
    speed = 0.5 * (acceleration * lasts - np.sqrt(acceleration**2 * lasts**2 - 4.0 * acceleration * length))
    ramp, u = speed / acceleration, np.clip(t - plan.waits[vehicle], 0.0, lasts)
    gone = np.where(u < ramp, 0.5 * acceleration * u * u, speed * (u - 0.5 * ramp))
    gone = np.where(u > lasts - ramp, length - 0.5 * acceleration * (lasts - u) ** 2, gone)
    return start + gone[:, None] * (goal - start) / max(length, 1e-12)


def test_all_are_apart_on_their_ways_home_whenever_they_are_called(flown, returns):
    moving = [plan for plan in returns.plans if plan.homes is not None]
    assert len(moving) > 10 and len(returns.plans) + len(returns.unproved) == int(np.ceil(flown.duration)) + 1
    for plan in moving:
        assert sorted(plan.homes) == list(range(12)), "each at a home of its own"
        assert plan.starts == pytest.approx(flown(min(plan.second, flown.duration)))
        t = np.linspace(0.0, plan.duration, 800)
        places = APART.flat(np.stack([way(plan, i, returns.acceleration, t) for i in range(12)]))
        distances = np.linalg.norm(places[:, None] - places[None], axis=-1)
        distances[np.arange(12), np.arange(12)] = np.inf
        assert 1.0 <= plan.distance <= distances.min() + 1e-9, plan.second
        assert np.abs(np.diff(places, axis=1)).max() / (t[1] - t[0]) <= 3.0 + 1e-6
        assert plan.goals[:, :2] == pytest.approx(flown(0.0)[plan.homes, :2], abs=6e-4)
        assert (plan.goals[:, 2] <= plan.starts[:, 2].min() + 6e-4).all(), "nobody flies below one who comes down"


def test_vehicles_above_their_homes_land_there(flown, returns):
    first, last = returns.plans[0], returns.plans[-1]
    assert (first.second, last.second) == (0, int(np.ceil(flown.duration)))
    for plan in (first, last):
        assert plan.homes is None and plan.duration == 0 and plan.distance == pytest.approx(2.0)
        assert plan.entry(3, returns.homes) == ReturnEntry(plan.second)


def test_vehicles_that_move_are_proved_while_they_stop(returns, flown):
    """The swing begins with the velocity that they have."""
    swinging = [plan for plan in returns.plans if plan.homes is not None and plan.waits.min() > 0]
    assert swinging
    for plan in swinging:
        fastest = np.linalg.norm(flown(float(plan.second), 1), axis=1).max()
        assert plan.waits.min() >= fastest / 2.0


def test_seconds_in_which_two_would_swing_into_each_other_have_no_plan():
    there, back = (minsnap.plan([(x, y, 5.0), (-x, y, 5.0)], total_time=8.0) for x, y in ((-8.0, 0.0), (8.0, 1.05)))
    flown = minsnap.Fleet((there, back))
    assert minsnap.certify_fleet(flown, 1.0).ok
    found = plan_returns(flown, minsnap.Separation(1.0), LIMITS, 5.0)
    assert 0 < len(found.plans) and found.least.distance >= 1.0
    alone = plan_returns(minsnap.Fleet((there,)), minsnap.Separation(1.0), LIMITS, 5.0)
    assert alone.unproved == () and alone.least is None and alone.longest_wait == 1


def test_a_wait_lets_one_pass_who_would_be_in_the_way():
    """One flies home over the place of another that is nearer to its own."""
    homes = np.array([[0.0, 0, 0], [3.0, 0, 0], [6.0, 0, 0]])
    rows = [[homes[0], (14.0, 0, 5.0)], [homes[1], (9.0, 0.2, 5.0)], [homes[2], (11.5, 0.1, 5.0)]]
    flown = minsnap.plan_fleet(np.array(rows), LIMITS, 1.0)
    found = plan_returns(flown, minsnap.Separation(1.0), LIMITS, 2.0)
    assert found.plans[-1].second == int(np.ceil(flown.duration)) and found.least.distance >= 1.0


def failing(fleet, vehicle, second, other, fall, step=0.002):
    """Distance of another to one that comes down, by heights as a function of the time since the second."""
    place = fleet(min(float(second), fleet.duration))[vehicle]
    t = np.arange(0.0, place[2] + step, step)
    places = fleet[other](np.minimum(second + t, fleet[other].duration))
    column = np.column_stack((np.full(len(t), place[0]), np.full(len(t), place[1]), np.maximum(fall(place[2], t), 0.0)))
    return np.linalg.norm(APART.flat(places - column), axis=1).min()


def test_one_that_fails_keeps_its_distance_however_it_comes_down(flown):
    found, count = failures_of(flown, APART, 1.0), 0
    falls = [lambda z, t: z - t, lambda z, t: z - 4.9 * t * t, lambda z, t: z - 2.5 * t]
    for second in range(0, len(found.distances), 3):
        for vehicle in np.flatnonzero(found.clear[second]):
            for fall in falls:
                near = min(
                    failing(flown, vehicle, second, other, fall, 0.02) for other in range(12) if other != vehicle
                )
                assert near >= 1.0 - 1e-6, (second, vehicle)
                count += 1
        if found.clear[second].all():
            assert found.distances[second] >= 1.0
    assert count > 200 and 0 < found.seconds_apart < len(found.distances)
    wheel = found.clear[[bool(flown(float(s))[:, 2].max() > 15.9) for s in range(len(found.distances))]]
    assert len(wheel) and not wheel.all(), "the upper half of a wheel falls through the lower one"


ENTRIES = (
    ReturnEntry(0),
    ReturnEntry(3, (1.0, 2.0, 0.0), 5.0, 200, 17),
    ReturnEntry(4, (-40.0, 2.0, 0.0), 5.0, 0, 17, 3),
    ReturnEntry(304, (1.0, 2.0, 0.0), 6.0, 1, 130),
)


def test_a_block_of_returns_reads_back():
    assert returns_of(return_bytes(ENTRIES, 3.0)) == (ENTRIES, 3.0)
    # land at 0 s; from 15 s level to (30, 40) m in 50 s and 5 s there; the same at 45 s in 20 s: 10 mm units
    whole = bytes.fromhex("000ad0070100b80ba00f00000300" + "1000" + "210f003205" + "001e14")
    assert returns_of(whole) == (
        (
            ReturnEntry(0),
            ReturnEntry(15, (30.0, 40.0, 0.0), None, 0, 50, 5),
            ReturnEntry(45, (30.0, 40.0, 0.0), lasts=20),
        ),
        2.0,
    )
    with pytest.raises(FileError, match="has a neck"):
        returns_of(bytes.fromhex("0001d007010000000000000001003005000000010000" + "05" + "05"))
    for cut in range(1, len(whole)):
        with pytest.raises(FileError, match="is cut off"):
            returns_of(whole[:cut])
    with pytest.raises(FileError, match="in their order"):
        return_bytes(ENTRIES[::-1], 3.0)
    with pytest.raises(FileError, match="a return leads 5000 m away"):
        return_bytes((ReturnEntry(1, (5000.0, 0.0, 0.0), 5.0, 0, 9),), 3.0)


def test_files_of_skybrush_hold_the_returns_and_others_say_that_they_do_not(tmp_path, flown, returns):
    write_fleet(flown, tmp_path / "out", "skyb", returns=returns)
    for vehicle in (0, 11):
        held = read_skybrush(tmp_path / "out" / f"traj{vehicle}.skyb")
        entries, acceleration = returns_of(held.returns)
        assert acceleration == 2.0 and len(entries) == len(returns.plans)
        for entry, planned in zip(entries, returns.entries(vehicle), strict=True):
            assert (entry.second, entry.wait, entry.lasts) == (planned.second, planned.wait, planned.lasts)
            assert (entry.target is None) == (planned.target is None)
            if entry.target is not None:
                assert entry.target == pytest.approx(planned.target, abs=6e-4)
                assert entry.altitude == pytest.approx(planned.altitude, abs=6e-4)
    assert len(read_fleet(tmp_path / "out")) == 12
    with pytest.raises(FileError, match="hold no returns"):
        write_fleet(flown, tmp_path / "more", "csv", returns=returns)
    assert not (tmp_path / "more").exists()


def test_a_skyc_holds_the_returns_in_which_all_keep_their_heights(tmp_path, flown, returns):
    level = plan_returns(flown, APART, LIMITS, 4.0, level=True)
    moving = [plan for plan in level.plans if plan.homes is not None]
    assert moving and 0 < len(level.plans) < len(returns.plans)
    for plan in moving:
        assert plan.goals[:, 2] == pytest.approx(plan.starts[:, 2])
        t = np.linspace(0.0, plan.duration, 800)
        share = np.clip((t[None] - plan.waits[:, None]) / plan.lasts, 0.0, 1.0)[:, :, None]  # at one speed throughout
        even = plan.starts[:, None] + share * (plan.goals - plan.starts)[:, None]
        for places in (even, np.stack([way(plan, i, level.acceleration, t) for i in range(12)])):
            flat = APART.flat(places)
            distances = np.linalg.norm(flat[:, None] - flat[None], axis=-1)
            distances[np.arange(12), np.arange(12)] = np.inf
            assert distances.min() >= 1.0, plan.second
    write_fleet(flown, tmp_path / "show.skyc", returns=level)
    with zipfile.ZipFile(tmp_path / "show.skyc") as archive:
        drones = json.loads(archive.read("show.json"))["swarm"]["drones"]
    for vehicle, drone in enumerate(drones):
        plan = drone["settings"]["rthPlan"]
        assert plan["version"] == 1 and len(plan["entries"]) == len(level.plans)
        for entry, planned in zip(plan["entries"], level.entries(vehicle), strict=True):
            assert entry["time"] == planned.second and isinstance(entry["time"], int)
            assert entry["action"] == ("land" if planned.target is None else "goTo")
            if planned.target is not None:
                assert entry["target"] == pytest.approx(planned.target[:2]) and entry["duration"] == planned.lasts
                assert entry.get("preDelay", 0) == planned.wait
    assert len(read_fleet(tmp_path / "show.skyc")) == 12
    with pytest.raises(FileError, match="changes heights"):
        write_fleet(flown, tmp_path / "other.skyc", returns=returns)
    assert not (tmp_path / "other.skyc").exists()


def test_the_figure_shows_every_second(returns, flown):
    figure = return_figure(returns, failures_of(flown, APART))
    assert len(figure.axes) == 3 and len(figure.axes[0].lines[0].get_xdata()) == len(returns.plans)
    assert len(return_figure(returns, None).axes) == 2
    assert spans_text((3,)) == "3" and spans_text((3, 7, 8, 9, 12)) == "3, 7 to 9, 12"


@pytest.mark.slow
@pytest.mark.parametrize("to", ["skyb", "csv"])
def test_the_command_proves_ways_home(tmp_path, capsys, to):
    text = "vehicles: 6\nseparation: 1\nlimits: {speed: 3, acceleration: 2}\nhome: {grid: {spacing: 2}}\ntake_off: 3\n"
    (tmp_path / "show.yaml").write_text(text + "acts: [{formation: {circle: {radius: 4, height: 6}}, hold: 4}]\n")
    page = tmp_path / "page.html"
    words = ["fleet", tmp_path / "show.yaml", "-o", tmp_path / "out", "--to", to, "--returns", "--report", page]
    with pytest.raises(SystemExit) as left:
        main([str(word) for word in words])
    said = capsys.readouterr().out
    assert not left.value.code
    found = re.search(r"returns\s+from (\d+) of (\d+) seconds, \d+ s to the next at most; ([\d.]+) m apart", said)
    assert int(found[1]) > 10 and float(found[3]) >= 1.0 and "any one may fail" in said
    html = page.read_text()
    assert "<h2>Home from every second</h2>" in html and f"{found[1]} of {found[2]}" in html
    if to == "skyb":
        assert len(returns_of(read_skybrush(tmp_path / "out" / "traj0.skyb").returns)[0]) == int(found[1])

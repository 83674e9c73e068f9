"""Groups that fly acts of their own at their own times, while others fly theirs or stay."""

import numpy as np
import pytest

import minsnap
from minsnap.cli.app import main
from minsnap.errors import FleetError, UnprovedError
from minsnap.shows.acts import Act, Group, Groups, Show
from minsnap.shows.csv_show import read_frames
from minsnap.shows.fleet_files import read_fleet
from minsnap.shows.formations import circle, grid
from minsnap.shows.moves import Move
from minsnap.shows.show import fly
from minsnap.shows.show_yaml import read_show

LIMITS, APART = minsnap.Limits(speed=4, acceleration=3), minsnap.Separation(1.0)
LEFT, RIGHT, TOP = (circle(6, 3.0, 8.0) + shift for shift in ((-6, 0, 0), (6, 0, 0), (0, 0, 8)))
ALL = circle(14, 6.0, 9.0)


def show_of(*acts, vehicles=14, **how):
    return Show(grid(vehicles, 2.0), acts, APART, LIMITS, take_off=3.0, **how)


def pair_of(left, right, **how):
    return Groups("pair", (Group("a", left), Group("b", right)), **how)


def spacing(flown, step=0.01):
    """Least distance of any two at samples, by the definition."""
    t = np.arange(0.0, flown.fleet.duration, step)
    places = flown.fleet(t)
    i, j = np.triu_indices(len(places), 1)
    return float(np.sqrt(((places[i] - places[j]) ** 2).sum(axis=2)).min())


def at_points(flown, stage, points):
    """Which vehicles stand at points when a stage is reached."""
    there = flown.fleet(stage.arrival)
    away = np.linalg.norm(there[:, None] - points[None], axis=2)
    who = away.argmin(axis=0)
    assert away.min(axis=0).max() < 1e-6 and len(set(who.tolist())) == len(points)
    assert np.abs(flown.fleet(stage.arrival, 1)[who]).max() < 1e-6
    return who


@pytest.mark.parametrize("to", ["csv", "skyc", "traj"])
def test_groups_fly_at_their_own_times_while_others_stay(to):
    a = (Act("a1", LEFT, 0.5, (255, 0, 0)), Act("a2", TOP, 3.0, (0, 255, 0), moves=(Move(np.pi / 3),)))
    b = (Act("b1", RIGHT, 6.0, (0, 0, 255)), Act("b2", RIGHT + (0, 0, 3.0), 0.0))
    show = show_of(Act("all", ALL, 1.0), pair_of(a, b), Act("again", ALL, 1.0))
    flown = fly(show, to=to)
    stages = {stage.name: stage for stage in flown.stages}
    left, right = at_points(flown, stages["a1"], LEFT), at_points(flown, stages["b1"], RIGHT)
    assert set(at_points(flown, stages["a2"], TOP)) == set(left)
    assert stages["a2"].start < stages["b2"].start < stages["a2 moves"].arrival, "they fly at their own times"
    rest = [i for i in range(14) if i not in (*left, *right)]
    t = np.linspace(stages["a1"].start, stages["b2"].arrival, 200)
    assert np.ptp(flown.fleet(t)[rest], axis=1).max() < 1e-9, "those of no group stay"
    t = np.linspace(stages["b1"].arrival, stages["b2"].start, 50)
    assert np.ptp(flown.fleet(t)[right], axis=1).max() < 1e-9, "a group stays while the other flies"
    assert minsnap.certify_fleet(flown.fleet, APART, LIMITS).ok and spacing(flown) >= 1.0
    lamps = np.stack([lamp(np.array(stages["a2"].arrival + 0.1)) for lamp in flown.lights])
    assert (lamps[left] == (0, 255, 0)).all() and (lamps[right] == (0, 0, 255)).all() and (lamps[rest] == 255).all()


def test_groups_that_change_places_at_once_are_planned_together():
    """Each would find the other standing where it flies to."""
    show = show_of(
        pair_of((Act("a1", LEFT, 1.0), Act("a2", RIGHT, 1.0)), (Act("b1", RIGHT, 1.0), Act("b2", LEFT, 1.0)))
    )
    flown = fly(show)
    stages = {stage.name: stage for stage in flown.stages}
    assert stages["a2"].arrival == pytest.approx(stages["b2"].arrival)
    assert set(at_points(flown, stages["a1"], LEFT)) == set(at_points(flown, stages["a2"], RIGHT))
    assert spacing(flown) >= 1.0


def test_a_group_goes_around_what_flies_already():
    """It leaves while the other is on its way through its own."""
    a = (Act("a1", LEFT, 1.0), Act("a2", RIGHT + (0.0, 0.0, 1.2), 8.0))
    b = (Act("b1", RIGHT, 2.0), Act("b2", LEFT, 1.0))
    flown = fly(show_of(pair_of(a, b)))
    stages = {stage.name: stage for stage in flown.stages}
    assert stages["a2"].start < stages["b2"].start < stages["a2"].arrival
    assert "joint" in stages["b2"].method
    assert spacing(flown) >= 1.0 and minsnap.certify_fleet(flown.fleet, APART, LIMITS).ok


@pytest.mark.parametrize("to", ["csv", "skyc"])
def test_acts_of_groups_are_at_instants(to):
    a = (Act("a1", LEFT, 1.0, seconds=9.0), Act("a2", TOP, 2.0, at=30.0, seconds=6.0))
    b = (Act("b1", RIGHT, 1.0), Act("b2", RIGHT + (0, 2, 3.0), 1.0, at=24.0))
    show = show_of(Act("all", ALL, 1.0), pair_of(a, b), Act("again", ALL, 1.0))
    flown = fly(show, to=to)
    stages = {stage.name: stage for stage in flown.stages}
    assert stages["a1"].arrival - stages["a1"].start == pytest.approx(9.0)
    assert stages["b1"].start == pytest.approx(stages["a1"].start) and stages["b1"].arrival < stages["a1"].arrival - 1.0
    assert (stages["a2"].start, stages["a2"].arrival) == pytest.approx((24.0, 30.0))
    assert stages["b2"].arrival == pytest.approx(24.0)
    for name, points in (("a1", LEFT), ("b1", RIGHT), ("a2", TOP), ("b2", RIGHT + (0, 2, 3.0))):
        at_points(flown, stages[name], points)
    assert spacing(flown) >= 1.0 and minsnap.certify_fleet(flown.fleet, APART, LIMITS).ok


@pytest.mark.parametrize(
    ("left", "right", "sentence"),
    [
        ([Act("x", LEFT)], [Act("y", ALL)], "groups of 'pair' have 20 vehicles, and home has 14: give them fewer"),
        ([Act("x", LEFT), Act("z", LEFT[:5])], [Act("y", RIGHT)], "group 'a' has 6 vehicles, and its act 'z' 5 points"),
        ([Act("x", LEFT)], [Act("y", LEFT + (0, 0, 0.5))], "where groups of 'pair' end, are 0.500 m apart"),
        (
            [Act("x", LEFT), Act("z", TOP)],
            [Act("y", LEFT + (0, 0, 0.5)), Act("u", RIGHT)],
            "point . of act 'x' and point . of act 'y', to which groups of 'pair' fly at once, are 0.500 m apart",
        ),
        (
            [Act("x", LEFT, at=2.0)],
            [Act("y", RIGHT)],
            "act 'x' is at 2 s, and within the limits nobody is there before",
        ),
        ([Act("x", LEFT, seconds=0.5)], [Act("y", RIGHT)], "the flight to act 'x' is to last 0.5 s, and no flight"),
        (
            [Act("x", LEFT, at=30.0), Act("z", TOP, at=31.0)],
            [Act("y", RIGHT)],
            "act 'z' is at 31 s, and act 'x' lasts until 33 s",
        ),
        ([Act("x", LEFT - (0, 0, 9.0))], [Act("y", RIGHT)], "act 'x' is 1 m below the lowest home: raise it"),
    ],
)
def test_what_cannot_be_is_refused_before_it_is_planned(left, right, sentence, tmp_path):
    with pytest.raises(FleetError, match=sentence):
        fly(show_of(pair_of(tuple(left), tuple(right))), tmp_path / "kept")
    assert not (tmp_path / "kept").exists()


@pytest.mark.parametrize("turned", [False, True])
def test_acts_near_vehicles_of_no_group_are_refused_before_anything_is_planned(turned, tmp_path):
    """Those of no group stay where the act before has left them: above their homes, or where its move ends."""
    home = np.array([[3.0 * i, 0.0, 0.0] for i in range(4)])
    before = Act("line", home + (0, 0, 6.0), 1.0, moves=(Move(along=np.array([[0.0, 0, 0], [0, 4, 0]])),))
    stays = np.array([6.0, 4.0, 6.0]) if turned else np.array([6.0, 0.0, 3.0])
    group = Group("a", (Act("x", np.array([[0.0, 0.0, 9.0]])), Act("z", stays[None] + (0.2, 0.0, 0.0))))
    acts = (before, Groups("pair", (group,))) if turned else (Groups("pair", (group,)), before)
    show = Show(home, acts, APART, LIMITS, take_off=3.0)
    said = "point 0 of act 'z' and a vehicle of no group of 'pair', which stays where it is, are 0.200 m apart"
    with pytest.raises(FleetError, match=said):
        fly(show, tmp_path / "kept")
    assert not (tmp_path / "kept").exists()


def test_what_comes_too_near_in_time_is_refused_with_the_pair():
    """One is to stand where another stands until later."""
    a = (Act("a1", LEFT, 1.0), Act("a2", RIGHT, 1.0), Act("a3", TOP))
    with pytest.raises(FleetError, match=r"act 'a2' of group 'a': vehicles \d+ and \d+ would be .* is there still"):
        fly(show_of(pair_of(a, (Act("b1", RIGHT, 9.0),))))
    moves = (Act("a1", LEFT, 1.0, moves=(Move(along=np.array([[0.0, 0, 0], [12, 0, 0], [0, 0, 0]])),)),)
    with pytest.raises(FleetError, match="a move of act 'a1' of group 'a' comes within .* of what others fly"):
        fly(show_of(pair_of(moves, (Act("b1", RIGHT, 9.0),))))


def test_a_time_that_is_too_short_for_a_group_says_one_that_goes():
    b = (Act("b1", RIGHT, 1.0),)
    with pytest.raises(UnprovedError, match="the flight to act 'a1' of group 'a'.*seconds: [0-9.]+ or more") as short:
        fly(show_of(pair_of((Act("a1", LEFT, seconds=3.7),), b)), to="skyc")
    seconds = float(str(short.value).split("seconds: ")[1].split()[0])
    assert fly(show_of(pair_of((Act("a1", LEFT, seconds=seconds + 0.2),), b)), to="skyc").fleet.duration > seconds


GROUPED = """
vehicles: 8
separation: 1
limits: {speed: 4, acceleration: 3}
home: {grid: {spacing: 2}}
take_off: 3
acts:
  - name: two
    groups:
      - {name: a, vehicles: 4, acts: [{name: low, formation: {circle: {radius: 2, height: 6}}, shift: [-4, 0, 0]}]}
      - {vehicles: 3, acts: [{formation: {circle: {radius: 2, height: 9}}, shift: [4, 0, 0], hold: 1}]}
"""


def test_groups_are_written_in_yaml(tmp_path, capsys):
    file = tmp_path / "show.yaml"
    file.write_text(GROUPED)
    show = read_show(file)
    (groups,) = show.acts
    assert [group.name for group in groups.groups] == ["a", "group 2"] and show.flying == 7
    out = tmp_path / "out"
    with pytest.raises(SystemExit) as ended:
        main(["fleet", str(file), "-o", str(out), "--to", "skyc", "--report", str(tmp_path / "r.html")])
    assert ended.value.code == 0 and minsnap.certify_fleet(read_fleet(out / "show.skyc"), APART).ok
    assert "a: low" in (tmp_path / "r.html").read_text()
    for change, sentence in (
        (("vehicles: 3", "vehicles: 0"), "group 2 of act 1 has 0 vehicles: give a number from 1 to 8"),
        (("{vehicles: 3, ", "{"), "has no vehicles: give it"),
        (("groups:", "group:"), "'group' is not known"),
    ):
        capsys.readouterr()
        file.write_text(GROUPED.replace(*change))
        with pytest.raises(SystemExit) as ended:
            main(["fleet", str(file), "-o", str(tmp_path / "other")])
        said = capsys.readouterr().err
        assert ended.value.code == 2 and sentence in said and said.count("\n") == 1, said
        assert not (tmp_path / "other").exists()


def test_a_zip_is_written_beside_the_folder_that_is_proved(tmp_path, capsys):
    (tmp_path / "show.yaml").write_text(GROUPED)
    with pytest.raises(SystemExit) as ended:
        main(["fleet", str(tmp_path / "show.yaml"), "-o", str(tmp_path / "played.zip")])
    assert ended.value.code == 0 and "apart at every instant" in capsys.readouterr().out
    held, frames = read_fleet(tmp_path / "played"), read_frames(tmp_path / "played.zip")
    for curve, t, places in zip(held, frames.instants, frames.positions, strict=True):
        assert np.abs(curve(np.minimum(t, curve.duration)) - places).max() < 2e-3

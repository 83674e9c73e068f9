"""Acts of fewer vehicles, reserves on the ground, a missing vehicle, named colours and gradients."""

import numpy as np
import pytest

import minsnap
from minsnap.cli.app import main
from minsnap.errors import FileError, FleetError
from minsnap.shows.acts import Act, Show
from minsnap.shows.fleet_files import read_fleet
from minsnap.shows.formations import circle, grid
from minsnap.shows.moves import Move
from minsnap.shows.returns import plan_returns
from minsnap.shows.show import fly
from minsnap.shows.show_yaml import read_show

LIMITS, APART = minsnap.Limits(speed=3, acceleration=2), minsnap.Separation(1.0, 1.5)


def show_of(*acts, vehicles=8, **how):
    return Show(**({"home": grid(vehicles, 2.0), "take_off": 3.0} | how), acts=acts, separation=APART, limits=LIMITS)


@pytest.mark.parametrize("to", ["csv", "skyc"])
def test_those_without_a_point_wait_above_their_homes(to):
    ring, small = circle(8, 5.0, 9.0), circle(5, 3.0, 8.0)
    red = np.tile([255.0, 0.0, 0.0], (5, 1))
    acts = (Act("ring", ring, 1.0), Act("small", small, 1.0, red, moves=(Move(np.pi / 2),)), Act("again", ring, 1.0))
    show = show_of(*acts)
    flown = fly(show, to=to)
    stages = {stage.name: stage for stage in flown.stages}
    there = flown.fleet(stages["small"].arrival)
    away = np.linalg.norm(there[:, None] - small[None], axis=2).min(axis=1)
    members = away < 1e-6
    assert members.sum() == 5 and there[~members] == pytest.approx(show.above[~members])
    after = flown.fleet(stages["small moves"].arrival)
    assert after[~members] == pytest.approx(there[~members]) and np.abs(after[members] - there[members]).max() > 1.0
    assert minsnap.certify_fleet(flown.fleet, APART, LIMITS).ok
    colours = np.array([lamp(stages["small"].arrival + 0.05) for lamp in flown.lights])
    assert (colours[members] == (255, 0, 0)).all() and not colours[~members].any()


def test_reserves_stay_on_the_ground_in_the_dark():
    flown = fly(show_of(Act("small", circle(5, 3.0, 8.0), 1.0), vehicles=7), to="skyc")
    t = np.linspace(0.0, flown.fleet.duration, 99)
    for vehicle in (5, 6):
        assert np.abs(flown.fleet[vehicle](t) - grid(7, 2.0)[vehicle]).max() < 1e-12
        assert not flown.lights[vehicle](5.0).any()
    assert minsnap.certify_fleet(flown.fleet, APART, LIMITS).ok
    assert flown.stages[0].start > 0.0, "the wait of Skybrush's firmware is that of those that climb"


@pytest.mark.parametrize(
    ("acts", "how", "sentence"),
    [
        (
            [Act("a", circle(5, 3.0, 8.0))],
            {"take_off": 1.0},
            "take_off is 1 m, over 3 vehicles that stay on the ground",
        ),
        (
            [Act("a", grid(8, 2.0, 1.0)[3:])],
            {},
            r"point . of act 'a' is .* m from vehicle ., which stays on the ground",
        ),
        (
            [Act("a", grid(8, 2.0, 6.0)), Act("b", grid(8, 1.6)[[0, 2, 3, 5, 6]] + (0.8, 0.0, 3.2))],
            {"home": grid(8, 1.6)},
            "3 vehicles wait above their homes during act 'b', and",
        ),
        ([Act("a", np.zeros((0, 3)))], {}, "has 0 points"),
        ([Act("a", circle(5, 3.0, 8.0), delays=np.zeros(8))], {}, "has 8 delays for 5 vehicles"),
    ],
)
def test_acts_of_fewer_that_cannot_be_are_refused(acts, how, sentence):
    with pytest.raises(FleetError, match=sentence):
        fly(show_of(*acts, **how))


def test_shows_may_land_below_their_last_act():
    ring = circle(8, 5.0, 9.0)
    flown = fly(show_of(Act("ring", ring, 1.0), return_home=False))
    assert [stage.name for stage in flown.stages] == ["take-off", "ring", "landing"]
    ends = flown.fleet(flown.fleet.duration)
    assert sorted(map(tuple, ends.round(6))) == sorted(map(tuple, (ring * (1, 1, 0)).round(6)))
    assert minsnap.certify_fleet(flown.fleet, APART, LIMITS).ok
    returns = plan_returns(flown.fleet, APART, LIMITS, 3.0)
    landing = [plan for plan in returns.plans if plan.second > flown.stages[-1].start]
    assert landing and all(plan.homes is None for plan in landing), "nobody flies along the ground"
    with pytest.raises(FleetError, match="the flight to landing: .*goals"):
        fly(show_of(Act("wheel", circle(8, 5.0, 4.0, upright=True), 1.0), return_home=False))


TEXT = """
vehicles: 6
separation: 1
limits: {speed: 3, acceleration: 2}
home: {grid: {spacing: 2}}
take_off: 3
return_home: true
acts:
  - {name: one, formation: {circle: {radius: 4, height: 7}}, colour: orange}
  - name: two
    vehicles: 4
    formation: {circle: {radius: 3, height: 5, upright: true}}
    colour: {from: red, to: [0, 0, 255]}
  - {name: three, formation: {grid: {spacing: 2, height: 6}}, colour: ['#102030', red, red, red, red, [1, 2, 3]]}
"""


def test_colours_have_names_and_gradients(tmp_path):
    (tmp_path / "show.yaml").write_text(TEXT)
    one, two, three = read_show(tmp_path / "show.yaml").acts
    assert one.colour == pytest.approx([255, 165, 0]) and len(two.points) == 4
    lowest, highest = two.points[:, 2].argmin(), two.points[:, 2].argmax()
    for point, colour in ((lowest, [255, 0, 0]), (highest, [0, 0, 255]), (0, [127.5, 0, 127.5])):
        assert two.colour.at(point, np.zeros(1))[0] == pytest.approx(colour)
    assert three.colour[0] == pytest.approx([16, 32, 48]) and three.colour[5] == pytest.approx([1, 2, 3])
    for old, new, sentence in (
        ("orange", "oranje", "'oranje', which is not known"),
        ("from: red", "from: [300, 0, 0]", "from 0 to 255"),
        ("to: [0, 0, 255]", "along: z", "has no to"),
        ("to: [0, 0, 255]", "to: blue, along: w", "one of x, y, z"),
        ("red, red, red, red, ", "red, ", "has 3 colours for 6 points"),
        ("vehicles: 4", "vehicles: 0", "act 2 has 0 vehicles"),
    ):
        (tmp_path / "show.yaml").write_text(TEXT.replace(old, new))
        with pytest.raises(FileError, match=sentence):
            read_show(tmp_path / "show.yaml")


@pytest.mark.slow
def test_without_a_vehicle_all_others_fly_as_they_do(tmp_path, capsys):
    (tmp_path / "show.yaml").write_text(TEXT)
    words = ["fleet", str(tmp_path / "show.yaml"), "-o", str(tmp_path / "out"), "--to", "skyc"]
    with pytest.raises(SystemExit) as left:
        main(words)
    whole = read_fleet(tmp_path / "out")
    assert not left.value.code
    with pytest.raises(SystemExit) as left:
        main([*words, "--without", "1,4"])
    said = capsys.readouterr()
    assert not left.value.code and said.err.count("(kept)") >= 3
    fewer = read_fleet(tmp_path / "out")
    assert fewer.names == ("vehicle 0", "vehicle 2", "vehicle 3", "vehicle 5")
    for name, curve in zip(fewer.names, fewer, strict=True):
        assert (curve.control_points == whole[int(name[-1])].control_points).all()

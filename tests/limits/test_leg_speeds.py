"""A speed of each leg: kept, certified, measured, written and read, in Python and in files."""

from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap import Limits
from minsnap.errors import FileError, LimitError, WaypointError
from minsnap.files.formats.polynomials import read_polynomials
from minsnap.limits.uses_over_time import uses_at
from minsnap.vehicle import Quadrotor

POINTS = np.array([(0, 0, 1), (5, 0, 1), (5, 5, 1.5), (0, 5, 1)], dtype=float)
SPEEDS = (4.0, 1.5, 3.0)
LIMITS = Limits(speed=SPEEDS, acceleration=6, jerk=40)


def fastest(path):
    """Greatest speed on each leg, sampled apart from the library's maxima."""
    return [
        np.linalg.norm(path(np.linspace(*path.leg_breaks[leg : leg + 2], 2001), 1), axis=1).max()
        for leg in range(path.legs)
    ]


@pytest.mark.parametrize("pieces", [1, "auto"])
def test_every_leg_keeps_its_own_speed_and_uses_it(pieces):
    path = minsnap.plan(POINTS, limits=LIMITS, pieces=pieces)
    assert minsnap.certify(path, POINTS, limits=LIMITS).ok
    assert all(found <= most * (1 + 1e-9) for found, most in zip(fastest(path), SPEEDS, strict=True))
    assert fastest(path)[1] == pytest.approx(1.5, rel=1e-3)
    slow, quick = (
        minsnap.plan(POINTS, limits=replace(LIMITS, leg_speeds=(), speed=v), pieces=pieces) for v in (1.5, 4.0)
    )
    assert quick.duration < path.duration < slow.duration


def test_the_use_of_the_speed_is_that_of_the_leg_that_uses_most_of_its_own():
    path = minsnap.plan(POINTS, [3.0, 3.0, 3.0])
    shares = np.array(fastest(path)) / SPEEDS
    (used,) = Limits(speed=SPEEDS).utilisation(path)
    assert used.leg == shares.argmax() and used.fraction == pytest.approx(shares.max(), rel=1e-4)
    assert used.limit == SPEEDS[used.leg]
    assert path.leg_breaks[used.leg] <= used.instant <= path.leg_breaks[used.leg + 1]
    assert not minsnap.certify(path, POINTS, limits=Limits(speed=(4, 0.9 * fastest(path)[1], 4))).ok
    t = np.linspace(0.0, path.duration, 4001)
    assert uses_at(path, Limits(speed=SPEEDS), t)["speed"].max() == pytest.approx(shares.max(), rel=1e-3)


@pytest.mark.parametrize(
    "asked",
    [
        {"total_time": 9.0},
        {"durations": [2.5, 5.0, 4.0]},
        {"search": minsnap.Search(time_weight=500.0)},
        {"avoid": [minsnap.Cylinder((2.5, 0.1), 0.3)]},
        {"corridor": 0.3},
        {"limits": Limits(speed=SPEEDS, acceleration=6, norm="axis")},
        {"limits": Limits.of(Quadrotor.crazyflie(), 0.1, speed=SPEEDS)},
    ],
)
def test_speeds_of_legs_go_with_every_kind_of_plan(asked):
    limits = asked.get("limits", LIMITS)
    path = minsnap.plan(POINTS, **({"limits": limits, "pieces": 1} | asked))
    assert minsnap.certify(path, POINTS, limits=limits).ok
    if limits.norm == "euclidean":
        assert all(found <= most * (1 + 1e-6) for found, most in zip(fastest(path), SPEEDS, strict=True))


def test_another_speed_scales_all_and_none_takes_them_off():
    assert LIMITS.speed == 4.0 and LIMITS.given()["speed"] == 4.0 and LIMITS.named()["speed"] == list(SPEEDS)
    assert replace(LIMITS, speed=2.0).leg_speeds == (2.0, 0.75, 1.5)
    assert replace(LIMITS, speed=None).leg_speeds == ()
    assert Limits(speed=np.array([2.0, 1.0])).leg_speeds == (2.0, 1.0)
    assert LIMITS.speeds_of(6).tolist() == [4.0, 4.0, 1.5, 1.5, 3.0, 3.0]


def test_malformed_speeds_are_refused():
    for speeds, words in (((), "empty"), ((3, 0), "positive"), ((3, np.nan), "positive"), ("fast", "positive")):
        with pytest.raises(LimitError, match=words):
            Limits(speed=speeds)
    with pytest.raises(LimitError, match="2 speeds, one of each leg, and there are 3 legs"):
        minsnap.plan(POINTS, limits=Limits(speed=(3, 2), acceleration=6), pieces=1)


def test_a_column_is_the_speed_of_the_leg_that_begins_there(tmp_path):
    file = tmp_path / "points.csv"
    file.write_text("x,y,z,speed\n0,0,1,4\n5,0,1,1.5\n5,5,1.5,3\n0,5,1,\n")
    read = minsnap.read_waypoints(file)
    assert read.speeds.tolist() == list(SPEEDS)
    table = {"x": POINTS[:, 0], "y": POINTS[:, 1], "z": POINTS[:, 2], "speed": [4.0, 1.5, 3.0, np.nan]}
    path = minsnap.plan(table, limits=Limits(acceleration=6, jerk=40), pieces=1)
    assert path.duration == minsnap.plan(POINTS, limits=LIMITS, pieces=1).duration
    capped = minsnap.plan(table, limits=Limits(speed=2, acceleration=6), pieces=1)
    assert max(fastest(capped)) <= 2 * (1 + 1e-9) and fastest(capped)[1] <= 1.5 * (1 + 1e-9)
    with pytest.raises(WaypointError, match="the speed of leg 1 is 0"):
        minsnap.plan(table | {"speed": [4.0, 0.0, 3.0, 1.0]}, limits=LIMITS)
    file.write_text("x,y,z,speed\n0,0,1,4\n5,0,1,\n5,5,1.5,3\n0,5,1,\n")
    with pytest.raises(FileError, match="the speed of leg 1 is nan"):
        minsnap.read_waypoints(file)


def test_commands_and_files_keep_the_speeds(tmp_path, capsys):
    from minsnap.cli.app import main

    file, plan, request = tmp_path / "points.csv", tmp_path / "plan.json", tmp_path / "request.yaml"
    file.write_text("x,y,z,speed\n0,0,1,4\n5,0,1,1.5\n5,5,1.5,3\n0,5,1,\n")
    request.write_text(
        "waypoints: [[0, 0, 1], [5, 0, 1], [5, 5, 1.5], [0, 5, 1]]\nlimits: {speed: [4, 1.5, 3]}\npieces: 1\n"
    )
    for source in (file, request):
        with pytest.raises(SystemExit) as ended:
            main(["plan", str(source), "-o", str(plan), "--pieces", "1"])
        assert not ended.value.code
        stored = read_polynomials(plan)
        assert stored.limits.leg_speeds == SPEEDS and stored.limits.acceleration == 6.0
        assert not stored.certified()[1] and fastest(stored.trajectory)[1] <= 1.5 * (1 + 1e-9)
    with pytest.raises(SystemExit):
        main(["plan", str(file), "-o", str(plan), "--pieces", "1", "--max-speed", "2"])
    assert read_polynomials(plan).limits.leg_speeds == ()
    capsys.readouterr()


def test_what_has_no_legs_of_its_own_refuses_speeds_of_legs(tmp_path):
    from minsnap.studio.documents import open_scene

    request = tmp_path / "request.yaml"
    request.write_text("waypoints: [[0, 0, 1], [5, 0, 1], [5, 5, 1]]\nlimits: {speed: [4, 1.5]}\n")
    calls = (
        lambda: minsnap.Replanner(limits=LIMITS),
        lambda: minsnap.plan_fleet([POINTS, POINTS + 5], limits=LIMITS, separation=minsnap.Separation(0.3)),
        lambda: minsnap.circle(1.0).within(LIMITS),
        lambda: open_scene(request),
    )
    for call in calls:
        with pytest.raises(LimitError, match="one speed for all legs"):
            call()


def test_the_bound_takes_the_greatest_and_says_so():
    bound = minsnap.least_time(POINTS, LIMITS)
    assert bound.left_out == ("jerk away from hover", "slower speeds of legs") and bound.verify()
    assert bound.seconds < minsnap.plan(POINTS, limits=LIMITS, pieces=1).duration

"""Numbers that are in another unit than they are taken in: said, or refused where they cannot be meant."""

import numpy as np
import pytest

import minsnap
from minsnap.errors import FileError, MagnitudeWarning, TimingError

POINTS = [(0, 0, 1), (2, 0, 1), (2, 2, 1)]


def test_a_period_in_the_place_of_a_rate_is_refused(call, tmp_path):
    """A flight of 6 s became two rows, at 0 and 20 s."""
    path = minsnap.plan(POINTS, [3.0, 3.0])
    with pytest.raises(TimingError, match="one setpoint every 20 s: if it is a period, give rate=20"):
        minsnap.write_csv(path, tmp_path / "a.csv", rate=0.05)
    assert not (tmp_path / "a.csv").exists()
    run = call("line", "-o", "a.csv", "--rate", 0.05)
    assert run.returncode == 2 and "if it is a period" in run.stderr
    minsnap.write_csv(path, tmp_path / "a.csv", rate=1.0)


@pytest.mark.parametrize("ending", ["xlsx", "ods", "XLS"])
def test_a_spreadsheet_is_no_csv(tmp_path, ending):
    with pytest.raises(FileError, match=r"is a spreadsheet by its ending: write a\.csv"):
        minsnap.write_csv(minsnap.plan(POINTS, [3.0, 3.0]), tmp_path / f"a.{ending}")
    assert not list(tmp_path.iterdir())


def test_a_tilt_in_radians_is_doubted(process):
    doubted = process("line", "--max-tilt", 0.5, "--no-limit", "acceleration")
    assert doubted.returncode == 0
    assert doubted.stderr == "minsnap: --max-tilt is 0.5 degrees: if that is in radians, give 28.6\n"
    assert process("line", "--max-tilt", 20).stderr == ""


def test_a_yaw_in_radians_is_doubted(process):
    for option, value, degrees in (("--yaw", 1.57, 90), ("--yaw", -3.1416, -180), ("--yaw-at-start", 0.785, 45)):
        asked = ("line", option, value) if option == "--yaw" else ("rect", "--yaw", "velocity", option, value)
        doubted = process(*asked)
        assert doubted.returncode == 0
        assert doubted.stderr == f"minsnap: {option} is {value:g} degrees: if that is in radians, give {degrees}\n"
    assert process("line", "--yaw", 5).stderr == process("line", "--yaw", 90).stderr == ""


@pytest.mark.parametrize("name", ["body_rate", "yaw_rate"])
def test_rates_in_degrees_are_doubted(name):
    with pytest.warns(MagnitudeWarning, match=f"{name} is 220 rad/s: if it is degrees per second, give radian"):
        minsnap.Limits(**{name: 220.0})
    with pytest.warns(MagnitudeWarning, match="yaw_rate is 45 rad/s: if it is degrees per second"):
        minsnap.Velocity(yaw_rate=45.0)


@pytest.mark.parametrize(
    ("yaw", "said"),
    [
        ([0.0, 6.28, 6.28], r"from 0 to 6.28 rad on leg 0, nearly a turn, .* give a difference of 2 pi, 6.283185307"),
        (7.0, "yaw goes to 7 rad, 1.1 turns: if it is degrees, give radians"),
        ([0, 10, 10], "yaw goes to 10 rad, 1.6 turns: if it is degrees"),
    ],
)
def test_a_yaw_beyond_a_turn_or_nearly_one_is_doubted(yaw, said):
    with pytest.warns(MagnitudeWarning, match=said):
        minsnap.plan(POINTS, [3.0, 3.0], yaw=yaw)


@pytest.mark.parametrize(
    "yaw", [[0.0, 2.0 * np.pi, 4.0 * np.pi], [0.0, 6.0, 0.0], 6.28, [0.5, 7.5, 0.5], [4, 6, 8], "velocity"]
)
def test_turns_that_are_meant_are_not_doubted(yaw, recwarn):
    minsnap.plan(POINTS, [3.0, 3.0], yaw=yaw)
    assert not recwarn.list


def test_milliseconds_and_centimetres_are_noted():
    slow = minsnap.plan(POINTS, [4000.0, 3000.0]).report.notes
    assert slow == ("leg 0 takes 4000 s over 2 m: if that is milliseconds, divide it by 1000",)
    hold = [POINTS[0], POINTS[0], POINTS[1]]
    assert minsnap.plan(hold, [4000.0, 3.0]).report.notes == ()
    limits = minsnap.Limits(speed=2.0, acceleration=3.0, jerk=20.0)
    for asked in ({"durations": [4.0, 3.0]}, {"limits": limits, "pieces": 1}, {"total_time": 9.0}):
        (wide,) = minsnap.plan(POINTS, corridor=30.0, **asked).report.notes
        assert wide == (
            "the corridor is 30 m to each side of legs of up to 2 m: if that is centimetres, divide it by 100"
        )
        assert minsnap.plan(POINTS, corridor=0.3, **asked).report.notes == ()
        room = minsnap.Room((-9, -9, 0), (9, 9, 9))
        beside = minsnap.plan(POINTS, corridor=[minsnap.Tube(30.0), room], **asked).report.notes
        assert wide in beside


def test_a_tube_of_a_course_in_centimetres_is_noted():
    course = minsnap.Course(tuple(map(minsnap.Stop, POINTS)), tube=30.0)
    assert any("if that is centimetres" in note for note in minsnap.plan_mission(course).notes)

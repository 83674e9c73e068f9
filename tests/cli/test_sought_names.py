"""Names that one looks for are answered with what they are here."""

from inspect import isfunction, signature

import numpy as np
import pytest

import minsnap
from minsnap.errors import ArgumentNameError, FileError, TimingError, WaypointError

LIMITS = minsnap.Limits(speed=2.0, acceleration=3.0)
POINTS = [(0, 0, 1), (4, 0, 1), (4, 3, 1)]
PLAN = minsnap.plan(POINTS, limits=LIMITS)


@pytest.mark.parametrize("name", ["simulate", "Quadrotor", "Sphere", "Box", "write_json", "rect", "load"])
def test_names_of_the_package(name):
    with pytest.raises(AttributeError, match=f"minsnap has no {name}: it is "):
        getattr(minsnap, name)
    with pytest.raises(AttributeError, match="nothing_like_it"):
        minsnap.nothing_like_it  # noqa: B018


@pytest.mark.parametrize("path", [PLAN, minsnap.circle()], ids=["plan", "circle"])
@pytest.mark.parametrize("name", ["max_speed", "times", "coefficients", "yaw_rate", "length", "total_time"])
def test_names_of_a_path(path, name):
    with pytest.raises(AttributeError, match=f"has no {name}: it is "):
        getattr(path, name)
    assert not hasattr(path, "nothing_like_it") and getattr(path, "nothing_like_it", 3) == 3


@pytest.mark.parametrize("name", ["vmax", "max_velocity", "times", "obstacles", "cost", "T"])
def test_arguments_of_plan(name):
    with pytest.raises(ArgumentNameError, match=f"plan has no argument {name}: write "):
        minsnap.plan(POINTS, **{name: 3.0})


@pytest.mark.parametrize("name", sorted(name for name in dir(minsnap) if isfunction(getattr(minsnap, name, None))))
def test_every_function_answers_an_unknown_argument(name):
    """`certify(obstacles=...)` was a bare TypeError. What takes those that are passed on answers for them."""
    function = getattr(minsnap, name)
    parameters = signature(function).parameters.values()
    if not parameters or any(each.kind is each.VAR_KEYWORD for each in parameters):
        return
    with pytest.raises(ArgumentNameError, match=f"{name} has no argument 'nothing_like_it': "):
        function(nothing_like_it=1)


def test_arguments_that_others_have():
    with pytest.raises(ArgumentNameError, match="write avoid="):
        minsnap.certify(PLAN, obstacles=[])
    with pytest.raises(ArgumentNameError, match="write rate="):
        minsnap.write_csv(PLAN, "never.csv", hz=20)
    with pytest.raises(ArgumentNameError, match="cost has no argument limits: write nothing: the cost is of given"):
        minsnap.torch.cost(POINTS, [3.0, 3.0], limits=LIMITS)


def test_a_state_has_no_heading():
    for name in ("yaw", "heading"):
        with pytest.raises(WaypointError, match=rf"start pins '{name}': .*; a heading is yaw=, such as Velocity\("):
            minsnap.plan(POINTS, [3.0, 3.0], start={name: 1.0})
    with pytest.raises(WaypointError, match="pins 'vel': did you mean velocity?"):
        minsnap.plan(POINTS, [3.0, 3.0], start={"vel": (0, 0, 0)})


def test_a_report_prints_as_a_card():
    lines = str(PLAN.report).splitlines()
    assert 4 < len(lines) < 20 and max(map(len, lines)) < 200
    assert lines[0].startswith("cost ") and any("limit speed" in line for line in lines)


def test_limits_of_a_vehicle_by_its_name():
    assert minsnap.Limits.of("crazyflie", speed=1.0).speed == 1.0


def test_a_whole_turn_over_one_leg_is_turned():
    """It stood still; differences of less than a turn go the shortest way round, as before."""
    turned = minsnap.plan(POINTS[:2], [4.0], yaw=[0.0, 2.0 * np.pi])
    assert turned.yaw(2.0) == pytest.approx(np.pi) and turned.yaw(4.0) == pytest.approx(2.0 * np.pi)
    twice = minsnap.plan(POINTS, [3.0, 3.0], yaw=[1.0, 1.0 - 4.0 * np.pi, 1.0 - 4.0 * np.pi])
    assert twice.yaw(3.0) == pytest.approx(1.0 - 4.0 * np.pi)
    short = minsnap.plan(POINTS, [3.0, 3.0], yaw=[0.0, 3.0, -3.0])
    assert short.yaw(6.0) == pytest.approx(2.0 * np.pi - 3.0)


def test_a_change_that_has_not_begun_is_not_replanned():
    with pytest.raises(TimingError, match=r"fly the former plan until change\.splice"):
        minsnap.replan(PLAN, -0.1, POINTS[1:], limits=LIMITS)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("plan", "w.csv", "--speed", 3), "No such option: --speed: did you mean --max-speed?"),
        (("circle", "--time", 5), "did you mean --period?"),
        (("plan", "w.csv", "--corridor", 0.3, 0.5), "joined by commas, as in --corridor=0.3,0.5"),
        (("rect", "--foo"), "Possible options"),
    ],
)
def test_options_of_the_command_line(call, tmp_path, words, said):
    (tmp_path / "w.csv").write_text("x,y,z\n0,0,1\n4,0,1\n")
    done = call(*words)
    assert done.returncode == 2 and said in done.stderr


def test_what_is_not_written_is_said(call, tmp_path):
    (tmp_path / "w.csv").write_text("x,y,z\n0,0,1\n4,0,1\n")
    assert "nothing: give -o FILE" in call("plan", "w.csv").stdout
    assert "nothing" not in call("plan", "w.csv", "-o", "a.csv").stdout


def test_a_cuboid_by_two_corners_and_a_gate_with_another_spelling(call, tmp_path):
    (tmp_path / "c.yaml").write_text("waypoints: [[0,0,1],[4,0,1]]\navoid: [{cuboid: [[1,-2,0],[2,-1,3]]}]\n")
    assert call("plan", "c.yaml", "--max-speed", 2).returncode == 0
    (tmp_path / "g.yaml").write_text("gates: [{centre: [0,0,1], width: 1}, {center: [3,0,1], width: 1}]\n")
    assert "'centre' is not known: did you mean center?" in call("plan", "g.yaml").stderr


def test_polynomials_that_jump_say_where(call, tmp_path):
    torn = minsnap.Trajectory(np.array([[[0, 0, 1], [1, 0, 1]], [[1.3, 0, 1], [2, 0, 1]]], dtype=float), [1.0, 1.0])
    from minsnap.files.formats.crazyflie import write_crazyflie
    from minsnap.shows.memory_parts import upload_of

    write_crazyflie(torn, tmp_path / "torn.csv")
    done = call("check", "torn.csv")
    assert done.returncode == 1 and "problem: piece 0 ends 0.3 m from piece 1, at 1 s" in done.stdout
    long = minsnap.Trajectory(np.repeat(torn.control_points, 30, axis=0), np.full(60, 0.5))
    with pytest.raises(FileError, match=r"piece \d+ ends .* m from piece \d+, at .* s: mend the curve"):
        upload_of(long)

"""Limits: what is refused, what they are as walls, and that walls and measures say the same."""

import numpy as np
import pytest

import minsnap
from minsnap.basics.limit_kinds import KINDS
from minsnap.cli.app import exit_status
from minsnap.corridors.margins import nearest_wall
from minsnap.errors import LimitError
from minsnap.limits.limits import Limits

POINTS = np.array([(0.0, 0.0, 1.0), (3.0, 1.0, 2.0), (4.0, -2.0, 0.5), (0.0, 0.0, 1.0)])


@pytest.fixture(scope="module")
def path():
    return minsnap.plan(POINTS, [2.0, 1.7, 2.4])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"speed": 0}, "speed is 0: it must be a positive number"),
        ({"acceleration": -1.0}, "acceleration is -1.0: it must be a positive number"),
        ({"jerk": float("nan")}, "jerk is nan"),
        ({"snap": float("inf")}, "snap is inf"),
        ({"speed": "3"}, "speed is '3': it must be a positive number"),
        ({"speed": True}, "must be a positive number"),
        ({"climb_speed": [1.0, 2.0]}, "climb_speed is .* must be a positive number"),
        ({"norm": "manhattan"}, "use 'euclidean' or 'axis'"),
        ({"speed": 1.0, "gravity": 0.0}, "gravity is 0.0"),
    ],
)
def test_what_is_no_limit_is_named(given, said):
    with pytest.raises(LimitError, match=said):
        Limits(**given)


@pytest.mark.parametrize(
    ("given", "attribute", "value"),
    [
        ({"max_thrust": 0.9}, "smallest", 1.0),
        ({"max_thrust": 1.0}, "smallest", 1.0),
        ({"min_thrust": 1.2}, "largest", 1.0),
        ({"min_thrust": 1.0}, "largest", 1.0),
        ({"tilt": 1.6}, "largest", np.pi / 2.0),
        ({"tilt": np.pi / 2.0}, "largest", np.pi / 2.0),
    ],
)
def test_what_cannot_hover_is_refused_with_the_value_that_would_do(given, attribute, value):
    with pytest.raises(LimitError) as refused:
        Limits(**given)
    assert getattr(refused.value, attribute) == value
    side, other = ("above", "largest") if attribute == "smallest" else ("below", "smallest")
    assert f"no vehicle holds altitude unless it is {side} {value:.4g}" in str(refused.value)
    assert getattr(refused.value, other) is None
    assert exit_status(refused.value) == 2 and isinstance(refused.value, ValueError)


def test_only_limits_that_are_set_are_given():
    assert Limits(speed=3.0, tilt=0.5, norm="axis", gravity=3.7).given() == {"speed": 3.0, "tilt": 0.5}
    assert Limits().given() == {}


@pytest.mark.parametrize("name", ["tilt", "max_thrust", "climb_speed", "horizontal_speed", "body_rate"])
def test_limits_in_space_need_three_coordinates(name):
    limits = Limits(**{name: 1.2})
    plane = minsnap.plan(POINTS[:, :2], [2.0, 1.7, 2.4])
    with pytest.raises(LimitError, match=f"{name} needs three coordinates"):
        limits.utilisation(plane)
    with pytest.raises(LimitError, match=f"{name} needs three coordinates"):
        minsnap.plan(POINTS[:, :2], limits=limits)


CONVEX = {
    "speed": 2.0,
    "acceleration": 4.0,
    "jerk": 20.0,
    "snap": 90.0,
    "horizontal_speed": 2.0,
    "horizontal_acceleration": 4.0,
    "climb_speed": 0.8,
    "descent_speed": 0.8,
    "vertical_speed": 0.8,
    "vertical_acceleration": 2.0,
    "max_thrust": 1.1,
    "tilt": 0.3,
}


def test_every_limit_with_walls_is_compared_with_them():
    """But a least thrust, whose wall is nearer than its measure, below."""
    walls = Limits(**{kind.name: 0.5 if kind.least else 1.2 for kind in KINDS if kind.measure != "rotors"}).walls(
        POINTS
    )
    assert CONVEX.keys() == {wall.name for wall in walls} - {"min_thrust"}


@pytest.mark.parametrize("norm", ["euclidean", "axis"])
@pytest.mark.parametrize("name", CONVEX)
def test_walls_are_touched_where_the_measure_is_one(path, name, norm):
    """Take the measured maximum itself as limit, barely more, barely less: walls and measure change sides there."""
    value = Limits(**{name: CONVEX[name], "norm": norm}).utilisation(path)[0].value
    for factor in (1.0 - 1e-6, 1.0 + 1e-6):
        limits = Limits(**{name: value * factor, "norm": norm})
        inside = nearest_wall(path, limits.walls(POINTS)).value >= 0.0
        assert inside == (limits.utilisation(path)[0].fraction <= 1.0) == (factor > 1.0)


def test_the_wall_of_a_least_thrust_is_on_the_safe_side(path):
    """Its vertical part alone: inside the wall the thrust is at least as large."""
    least = 1.0 + path(np.linspace(0.0, path.duration, 20001), 2)[:, 2].min() / Limits().gravity
    limits = Limits(min_thrust=float(least) * (1.0 - 1e-6))
    assert nearest_wall(path, limits.walls(POINTS)).value >= 0.0
    assert limits.utilisation(path)[0].fraction <= 1.0
    assert nearest_wall(path, Limits(min_thrust=float(least) * (1.0 + 1e-6)).walls(POINTS)).value < 0.0


@pytest.mark.parametrize("order", [1, 2])
def test_axis_limits_hold_for_each_axis_and_are_weaker(path, order):
    name = {1: "speed", 2: "acceleration"}[order]
    values = path(np.linspace(0.0, path.duration, 20001), order)
    axis = Limits(**{name: 1.0, "norm": "axis"}).utilisation(path)[0].value
    norm = Limits(**{name: 1.0}).utilisation(path)[0].value
    assert axis == pytest.approx(np.abs(values).max(), rel=1e-6)
    assert norm == pytest.approx(np.linalg.norm(values, axis=1).max(), rel=1e-6)
    assert axis < norm


def test_climbing_and_descending_have_limits_of_their_own():
    up_and_down = [(0, 0, 0), (0, 0, 5), (0, 0, 0)]
    path = minsnap.plan(up_and_down, limits=Limits(climb_speed=2.0, descent_speed=0.5, acceleration=5.0))
    speed = path(np.linspace(0.0, path.duration, 20001), 1)[:, 2]

    assert speed.max() <= 2.0 + 1e-9 and speed.min() >= -0.5 - 1e-9
    assert speed.max() > 2.0 * -speed.min(), "the climb may be faster than the descent"


def test_numbers_of_numpy_become_those_of_python():
    limits = Limits(speed=np.float32(3.0), gravity=np.float64(9.8))
    assert (limits.speed, limits.gravity) == (3.0, 9.8) and type(limits.speed) is type(limits.gravity) is float


def test_names_that_limits_do_not_have_are_answered():
    with pytest.raises(TypeError, match="did you mean speed"):
        Limits(max_speed=3.0)
    with pytest.raises(LimitError, match=r"did you mean Limits\(speed=3\)\?"):
        minsnap.plan([(0, 0, 1), (4, 0, 1)], limits={"speed": 3})


def test_limits_of_a_mass_and_a_thrust():
    """A racer of 0.8 kg with 28 N: 3.57 times its weight, less the reserve above and below hover."""
    weight = 0.8 * 9.80665
    racer = Limits.of_mass(0.8, 28.0, reserve=0.0, body_rate=12.0)
    assert racer.max_thrust == pytest.approx(28.0 / weight) and racer.body_rate == 12.0 and racer.min_thrust is None
    kept = Limits.of_mass(0.8, 28.0, min_thrust=2.0)
    assert kept.max_thrust == pytest.approx(1.0 + 0.9 * (28.0 / weight - 1.0))
    assert kept.min_thrust == pytest.approx(1.0 - 0.9 * (1.0 - 2.0 / weight))
    for given, says in (((0.8, 7.0), "all rotors"), ((0.0, 28.0), "mass"), ((0.8, 28.0, 9.0), "min_thrust")):
        with pytest.raises(LimitError, match=says):
            Limits.of_mass(given[0], given[1], min_thrust=given[2] if len(given) > 2 else None)


@pytest.mark.parametrize(
    "limits",
    [
        {"speed": 3, "acceleration": 6, "jerk": 30, "snap": 100},
        {"max_thrust": 2, "body_rate": 6},
        {"max_thrust": 2, "tilt": 1, "yaw_rate": 2},
    ],
)
def test_whole_numbers_are_limits_like_others(limits):
    points = np.array([(0, 0, 1), (4, 0, 1), (4, 3, 2)])
    whole = minsnap.plan(points, limits=minsnap.Limits(**limits))
    decimal = minsnap.plan(points, limits=minsnap.Limits(**{name: float(value) for name, value in limits.items()}))
    assert np.array_equal(whole.control_points, decimal.control_points)

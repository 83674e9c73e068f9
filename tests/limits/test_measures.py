"""Thresholds of the measures: where thrust counts as none, and how far above free fall the tilt's walls begin."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

import minsnap
from minsnap.limits.limits import Limits
from minsnap.limits.measures import MEASURES, Extent, Motion
from minsnap.native.library import using
from minsnap.trajectory.medium import Medium


@pytest.mark.parametrize(("thrust", "turning"), ((0.9e-12, np.inf), (1.1e-12, 1.0 / 1.1e-12)))
def test_a_thrust_of_a_trillionth_of_the_weight_has_no_direction(thrust, turning):
    """Thrust along z at gravity 1, and a jerk of 1 m/s^3 across it: the rate of turning is jerk over thrust."""
    orders = {2: (0.0, 0.0, thrust - 1.0), 3: (1.0, 0.0, 0.0)}
    motion = Motion(lambda order: np.array(orders[order])[None, None, :], "euclidean", Medium(1.0))
    assert MEASURES["body_rate"].largest(motion, 2)[0] == pytest.approx(turning, rel=1e-3)


def test_walls_of_the_tilt_begin_a_billionth_of_gravity_above_free_fall():
    """At free fall itself the tilt is that of no vector."""
    up, _ = MEASURES["tilt"].walls(Extent(1, 3), 0.5, "tilt", 2, "euclidean", 9.81)
    assert 0.9e-9 < -up.radius[0] / 9.81 + 1.0 < 1.1e-9


@pytest.mark.parametrize(("vertical", "tilt"), ((0.0, np.pi / 2.0), (-1e-9, np.pi), (1.0, np.pi / 4.0)))
def test_a_thrust_without_a_vertical_part_is_at_a_right_angle(vertical, tilt):
    """And one that points down at all counts as upside down."""
    motion = Motion(lambda order: np.array([[[1.0, 0.0, vertical - 1.0]]]), "euclidean", Medium(1.0))
    assert MEASURES["tilt"].largest(motion, 2)[0] == pytest.approx(tilt, rel=1e-12)


def test_free_fall_from_rest_has_no_thrust_with_drag_either():
    orders = {1: (0.0, 0.0, 0.0), 2: (0.0, 0.0, -1.0)}
    motion = Motion(lambda order: np.array([orders[order]]), "euclidean", Medium(1.0, 0.5, 0.1, 0.2, 0.1))
    assert motion.thrust().tolist() == [[0.0, 0.0, 0.0]]


def test_derivatives_of_a_state_that_are_not_given_are_zero():
    used = Limits(speed=2.0, acceleration=1.0).use_of_state({1: np.array([0.0, 3.0, 4.0])}, 3)
    assert [entry.fraction for entry in used] == [2.5, 0.0]
    by_axis = Limits(speed=2.0, norm="axis").use_of_state({1: np.array([0.0, 3.0, 4.0])}, 3)
    assert [entry.fraction for entry in by_axis] == [2.0]


def test_speeds_upwards_and_downwards_at_samples():
    motion = Motion(lambda order: np.array([[1.0, 1.0, 0.2], [1.0, 1.0, -0.3]]), "euclidean", Medium(1.0))
    assert MEASURES["upwards"].sampled(motion, 1).tolist() == [0.2, 0.0]
    assert MEASURES["downwards"].sampled(motion, 1).tolist() == [0.0, 0.3]


def test_both_cores_measure_the_same():
    path = minsnap.plan([(0.0, 0.0, 1.0), (3.0, 1.0, 2.0), (4.0, -2.0, 0.5), (0.0, 0.0, 1.0)], [1.0, 0.9, 1.2])
    limits = Limits(tilt=0.5, body_rate=2.0, max_thrust=1.5, min_thrust=0.3, climb_speed=1.0, horizontal_speed=2.0)
    found = limits.utilisation(path)
    with using("python"):
        expected = limits.utilisation(path)
    for one, other in zip(found, expected, strict=True):
        assert (one.value, one.instant) == pytest.approx((other.value, other.instant), rel=1e-9), one.name


@pytest.mark.parametrize(
    ("given", "order", "columns"),
    [
        ({"norm": "axis", "jerk": 9.0}, 3, (0, 1, 2)),
        ({"horizontal_acceleration": 9.0}, 2, (0, 1)),
        ({"climb_speed": 9.0}, 1, (2,)),
    ],
)
def test_what_rounding_may_hide_of_a_derivative_is_counted(given, order, columns):
    """Points a meter apart within some thousandths of a second: differences lose digits, which are added as bounds."""
    for points in np.random.default_rng(1).uniform(-2.0, 2.0, (40, 4, 3)):
        (used,) = minsnap.Limits(**given).utilisation(minsnap.Trajectory(points[None], [3e-3]))
        exact, factor = [[Fraction(x) for x in row] for row in points.tolist()], Fraction(1)
        for lost in range(order):
            exact = [[b - a for a, b in zip(*pair, strict=True)] for pair in pairwise(exact)]
            factor *= (3 - lost) / Fraction(3e-3)
        ends = [[factor * row[column] for column in columns] for row in (exact[0], exact[-1])]
        if len(columns) == 2:
            assert Fraction(used.value) ** 2 >= max(x * x + y * y for x, y in ends)
        else:
            assert Fraction(used.value) >= max(abs(x) if order == 3 else x for row in ends for x in row)

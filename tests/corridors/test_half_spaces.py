"""Half-spaces: legs that are named, and rows that are refused."""

import numpy as np
import pytest

import minsnap
from minsnap import HalfSpaces
from minsnap.basics.arrays import SMALLEST
from minsnap.errors import CorridorError

POINTS = [(0.0, 0.0, 1.0), (2.0, 0.0, 1.5), (4.0, 0.0, 1.0)]


def test_half_spaces_on_no_leg_bound_nothing():
    nowhere = HalfSpaces((0, 0, 1), 1.0, legs=())
    assert nowhere.legs == () and not nowhere.walls(np.array(POINTS))[0].leg.size
    assert minsnap.plan(POINTS, [1, 1], corridor=nowhere).cost() == minsnap.plan(POINTS, [1, 1]).cost()


def test_fields_are_numbers_of_python_and_arrays_that_cannot_be_written():
    half = HalfSpaces((0, 0, 1), 2, legs=np.array([1, 0]), order=np.int64(1))
    assert half.legs == (1, 0) and all(type(leg) is int for leg in half.legs) and type(half.order) is int
    assert half.normal.shape == (1, 3) and half.offset.shape == (1,)
    with pytest.raises(ValueError, match="read-only"):
        half.offset[0] = 1.0


@pytest.mark.parametrize("legs", (3, "", "01", [0.5], [True], [2**31], [0, -(2**31)]))
def test_legs_that_are_no_numbers_of_legs_are_refused(legs):
    with pytest.raises(CorridorError, match="^the legs of half-spaces are .*: give whole numbers"):
        HalfSpaces((0, 0, 1), 2, legs=legs)


@pytest.mark.parametrize("leg", (2**31 - 1, -(2**31) + 1, 2, -1))
def test_legs_that_do_not_exist_are_refused_on_use(leg):
    with pytest.raises(CorridorError, match=rf"^half-spaces name legs \[{leg}\]: there are legs 0 to 1"):
        HalfSpaces((0, 0, 1), 2, legs=[leg]).walls(np.array(POINTS))


@pytest.mark.parametrize(
    ("normal", "offset", "message"),
    [
        ("up", 1.0, "^the normals of the half-spaces must be numbers"),
        ((0, 0, 1), "high", "^the offsets of the half-spaces must be numbers"),
        (np.ones((2, 3, 1)), (1, 1), r"have shape \(2, 3, 1\)"),
        (np.ones((0, 3)), (), r"have shape \(0, 3\)"),
        ([(0, 0, 1), (0, np.inf, 1)], (1, 1), "^row 1 of the half-spaces is not finite"),
        ([(0, 0, 1), (0.9 * SMALLEST, 0, 0)], (1, 1), "^row 1 of the half-spaces has a normal of zeros"),
    ],
)
def test_rows_that_are_no_half_spaces_are_refused(normal, offset, message):
    with pytest.raises(CorridorError, match=message):
        HalfSpaces(normal, offset)


def test_a_short_normal_has_a_direction():
    wall = HalfSpaces((0, SMALLEST, 0), SMALLEST).walls(np.array(POINTS))[0]
    assert wall.slope == pytest.approx(np.array([(0, -1, 0)] * 2)) and wall.radius == pytest.approx([1.0, 1.0])


def test_half_spaces_have_the_coordinates_of_the_waypoints():
    with pytest.raises(CorridorError, match="^the normal of the half-spaces has 2 coordinates and the waypoints 3"):
        minsnap.plan(POINTS, [1, 1], corridor=HalfSpaces((0, 1), 2))

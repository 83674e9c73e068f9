"""Sequences of boxes: what is refused, and the optimum through them."""

import numpy as np
import pytest
from corridors import staircase
from oracles.box_programme import bernstein, optimum, sub_hulls

import minsnap
from minsnap import Boxes
from minsnap.errors import CorridorError

CORNERS = np.array([(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)], dtype=float)
TIMES = [4.0, 2.0, 4.0, 2.0]
RECTANGLE = Boxes(np.minimum(CORNERS[:-1], CORNERS[1:]) - 0.3, np.maximum(CORNERS[:-1], CORNERS[1:]) + 0.3)


def through(boxes, durations, start, end, **rest):
    return minsnap.plan(None, durations, corridor=boxes, start={"position": start}, end={"position": end}, **rest)


def test_rectangle_with_free_corners_costs_what_is_published():
    traj = through(RECTANGLE, TIMES, CORNERS[0], CORNERS[-1])
    assert traj.cost() == pytest.approx(813.610, rel=2e-6)
    certificate = minsnap.certify(traj, corridor=RECTANGLE)
    assert certificate.ok and certificate.corridor_margin >= 0.0
    assert certificate.continuity >= 3


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 2, 5, 12])
@pytest.mark.parametrize("degree", [5, 7])
def test_cost_lies_between_samples_and_hull(count, degree):
    lower, upper, start, end = staircase(count, seed=count)
    durations = np.linspace(1.5, 2.5, count)
    traj = through(Boxes(lower, upper), durations, start, end, degree=degree)
    below = optimum(lower, upper, durations, start, end, degree, bernstein(degree, np.linspace(0, 1, 60)))
    above = optimum(lower, upper, durations, start, end, degree, sub_hulls(degree, 16))
    assert below * (1 - 1e-6) <= traj.cost((degree + 1) // 2) <= above * (1 + 1e-5)
    assert above < 1.01 * below
    assert minsnap.certify(traj, corridor=Boxes(lower, upper)).corridor_margin >= 0.0


def test_thousand_boxes_are_certified_at_a_cost_as_of_their_parts():
    """By the principle of optimality its first half is the best one between its own ends."""
    lower, upper, start, end = staircase(1000, seed=3)
    traj = through(Boxes(lower, upper), np.full(1000, 2.0), start, end)
    assert minsnap.certify(traj, corridor=Boxes(lower, upper)).ok and traj.report.fallback == ()
    knots = traj(traj.leg_breaks)
    state = {"velocity": traj(1000.0, 1), "acceleration": traj(1000.0, 2), "jerk": traj(1000.0, 3)}
    half = minsnap.plan(
        None,
        np.full(500, 2.0),
        corridor=Boxes(lower[:500], upper[:500]),
        start={"position": start},
        end={"position": knots[500]} | state,
    )
    assert half.cost() == pytest.approx(traj.between(0.0, 1000.0).cost(), rel=1e-4)


def test_knots_stay_in_the_overlaps():
    lower, upper, start, end = staircase(6, seed=1)
    knots = through(Boxes(lower, upper), np.full(6, 2.0), start, end)
    knots = knots(knots.leg_breaks)
    assert (knots[1:-1] >= np.maximum(lower[:-1], lower[1:])).all()
    assert (knots[1:-1] <= np.minimum(upper[:-1], upper[1:])).all()
    assert np.array_equal(knots[[0, -1]], [start, end])


def test_boxes_hold_with_waypoints_given_too():
    traj = minsnap.plan(CORNERS, TIMES, corridor=RECTANGLE)
    assert minsnap.certify(traj, CORNERS, RECTANGLE).ok
    assert traj.cost() == pytest.approx(1557.0050, rel=1e-5)  # that of the tube: the boxes' ends are not reached


def test_result_does_not_depend_on_where_the_origin_is_nor_on_units():
    lower, upper, start, end = staircase(5, seed=7)
    plain = through(Boxes(lower, upper), np.full(5, 2.0), start, end).cost()
    far = through(Boxes(lower + 500.0, upper + 500.0), np.full(5, 2.0), start + 500.0, end + 500.0).cost()
    large = through(Boxes(1e3 * lower, 1e3 * upper), np.full(5, 2.0), 1e3 * start, 1e3 * end).cost()
    assert [far, large / 1e6] == pytest.approx([plain, plain], rel=1e-5)


def test_lap_through_boxes_closes_smoothly():
    traj = minsnap.plan(None, TIMES, corridor=RECTANGLE, closed=True)
    for order in range(4):
        ends = traj(np.array([0.0, traj.duration]), order)
        assert np.abs(ends[1] - ends[0]).max() <= 1e-9 * max(np.abs(traj.sample(50).velocity).max(), 1.0)
    assert minsnap.certify(traj, corridor=RECTANGLE).ok
    assert traj.cost() < 813.0


def test_lap_that_does_not_close_names_the_boxes():
    boxes = Boxes([[0, 0], [0.5, 0], [2.5, 0]], [[1, 1], [3, 1], [5, 1]])
    with pytest.raises(CorridorError, match="box 2, the last one, to overlap box 0"):
        minsnap.plan(None, [1, 1, 1], corridor=boxes, closed=True)


def test_boxes_own_what_they_are_given():
    lower = np.zeros((1, 2))
    boxes = Boxes(lower, [[1, 1]])
    lower[:] = 9.0
    assert (boxes.lower == 0.0).all()
    with pytest.raises(ValueError, match="read-only"):
        boxes.lower[0, 0] = 1.0


@pytest.mark.parametrize(
    ("lower", "upper", "message"),
    [
        ([[0, 0], [0, 5]], [[1, 1], [1, 4]], "box 1 runs from 5 to 4 along y: its lower bound must be a number below"),
        ([[0, 0], [0, np.nan]], [[1, 1], [1, 4]], "box 1 runs from nan to 4 along y"),
        ([[0, 0]], [[1, np.inf]], "box 0 is unbounded along y"),
        ([[0, 0, 1]], [[1, 1, 1]], "box 0 runs from 1 to 1 along z"),
        ([[0, 0], [2, 0]], [[1, 1], [3, 1]], "boxes 0 and 1 do not overlap: along x they run from 0 to 1 and from 2"),
        ([[0, 0], [0, 0], [0, 1]], [[1, 1], [3, 1], [3, 2]], "boxes 1 and 2 only touch: along y"),
        ([[0, 0], [0, 0]], [[1, 1]], r"shapes \(2, 2\) and \(1, 2\)"),
        ([0, 0], [1, 1], "give both the shape"),
        (np.zeros((0, 2)), np.zeros((0, 2)), "give both the shape"),
        ("a", [[1, 1]], "lower bounds of the boxes must be numbers"),
        ([[1, 2], [1]], [[1, 1]], "lower bounds of the boxes must be numbers"),
    ],
)
def test_bad_boxes_are_refused_by_index(lower, upper, message):
    with pytest.raises(CorridorError, match=message) as caught:
        Boxes(lower, upper)
    assert "\n" not in str(caught.value) and isinstance(caught.value, ValueError)


def test_number_and_coordinates_of_boxes_must_be_those_of_the_legs():
    boxes = Boxes([[0, 0]], [[1, 1]])
    with pytest.raises(CorridorError, match="1 boxes for 2 legs"):
        minsnap.plan([(0, 0), (0.5, 0), (1, 1)], [1, 1], corridor=boxes)
    with pytest.raises(CorridorError, match="2 coordinates and the waypoints 3"):
        minsnap.plan([(0, 0, 0), (1, 1, 1)], [1], corridor=boxes)


def test_boxes_that_do_not_overlap_are_told_with_both_their_ranges():
    with pytest.raises(CorridorError, match="0 and 1 do not overlap: along x they run from 0 to 1 and from 2 to 3;"):
        Boxes([(0, 0, 0), (2, 0, 0), (2, 0, 0)], [(1, 1, 1), (3, 1, 1), (9, 1, 1)])
    with pytest.raises(CorridorError, match="0 and 1 only touch: along 3 they run from 0 to 1 and from 1 to 2;"):
        Boxes([(0, 0, 0, 0), (0, 0, 0, 1)], [(1, 1, 1, 1), (1, 1, 1, 2)])


def test_excess_is_judged_by_half_of_a_side():
    assert Boxes([(0, 0)], [(2, 6)]).walls(np.array([(0, 0), (1, 1)]))[0].width.tolist() == [1.0, 3.0] * 2

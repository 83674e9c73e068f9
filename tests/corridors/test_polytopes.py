"""Sequences of polytopes: what is refused, and the optimum through them."""

import numpy as np
import pytest
from corridors import staircase
from scipy.spatial.transform import Rotation

import minsnap
from minsnap import Boxes, Polytopes
from minsnap.errors import CorridorError
from minsnap.native.half_space_sets import bounding_boxes, inner_balls

SIDES = np.vstack([np.eye(3), -np.eye(3)])


def box(lower, upper):
    return SIDES, np.concatenate((upper, np.negative(lower)))


def through(sets, durations, start, end, **rest):
    return minsnap.plan(None, durations, corridor=sets, start={"position": start}, end={"position": end}, **rest)


def test_polytopes_that_are_boxes_cost_what_boxes_do():
    lower, upper, start, end = staircase(5, seed=2)
    rows = Polytopes([box(low, high) for low, high in zip(lower, upper, strict=True)])
    ours = through(rows, np.full(5, 2.0), start, end)
    assert ours.cost() == pytest.approx(through(Boxes(lower, upper), np.full(5, 2.0), start, end).cost(), rel=3e-6)


def test_turned_polytopes_cost_the_same_although_their_axes_are_coupled():
    lower, upper, start, end = staircase(4, seed=4)
    turn = Rotation.from_euler("zyx", [0.4, -0.7, 1.1]).as_matrix()
    sets = [box(low, high) for low, high in zip(lower, upper, strict=True)]
    turned = Polytopes([(A @ turn.T, b) for A, b in sets])
    cost = through(Polytopes(sets), np.full(4, 2.0), start, end).cost()
    traj = through(turned, np.full(4, 2.0), turn @ start, turn @ end)
    assert traj.cost() == pytest.approx(cost, rel=1e-5)
    assert minsnap.certify(traj, corridor=turned).corridor_margin >= 0.0


def test_rows_need_not_be_normalised():
    rows = [(SIDES * 7.0, np.array([7.0, 14, 21, 7, 7, 7]))]
    scaled, plain = Polytopes(rows), Polytopes([(SIDES, np.array([1.0, 2, 3, 1, 1, 1]))])
    points = np.array([(0, 0, 0), (0.5, 1, 1)])
    first, second = scaled.walls(points)[0], plain.walls(points)[0]
    assert np.allclose(first.slope, second.slope) and np.allclose(first.radius, second.radius)


def test_excess_is_judged_by_the_inner_ball():
    diamond = (np.array([[1.0, 1], [1, -1], [-1, 1], [-1, -1]]), np.ones(4))
    walls = Polytopes([diamond]).walls(np.array([(0.0, 0), (0.5, 0)]))[0]
    assert walls.width == pytest.approx(np.full(4, 0.5))
    walls = Polytopes([diamond]).walls(np.array([(0.0, 0), (0.9, 0)]))[0]
    assert walls.width == pytest.approx(np.full(4, np.sqrt(0.5)))


def test_unbounded_polytopes_serve_where_waypoints_are_given():
    below = (np.array([[0.0, 1.0]]), np.array([0.3]))
    points = [(0, 0), (1, 0.25), (2, 0.25), (3, 0)]
    traj = minsnap.plan(points, [1, 1, 1], corridor=Polytopes([below] * 3))
    assert minsnap.certify(traj, points, Polytopes([below] * 3)).ok
    assert traj.extent((0, 1))[1] <= 0.3 < minsnap.plan(points, [1, 1, 1]).extent((0, 1))[1]


@pytest.mark.parametrize("floor", ([], [([0.0, -1.0], 0.0)]))
def test_overlap_that_is_unbounded_is_named_with_its_axis(floor):
    rows = [([-1.0, 0.0], 0.0), *floor]
    slabs = Polytopes([(np.array([[1.0, 0]]), [1.0]), ([normal for normal, _ in rows], [offset for _, offset in rows])])
    with pytest.raises(CorridorError, match="overlap of polytopes 0 and 1 is unbounded along y"):
        through(slabs, [1, 1], (0, 0), (2, 0))


@pytest.mark.parametrize(
    ("sets", "message"),
    [
        ([box((0, 0, 0), (1, 1, 1)), box((0, 0, 0), (1, 1, -1))], "polytope 1 is empty: .* by 0.5 m"),
        ([box((0, 0, 0), (1, 1, 0))], "polytope 0 has no interior"),
        ([box((0, 0, 0), (1, 1, 1)), box((2, 0, 0), (3, 1, 1))], "polytopes 0 and 1 do not overlap"),
        ([box((0, 0, 0), (1, 1, 1)), box((1, 0, 0), (3, 1, 1))], "polytopes 0 and 1 only touch"),
        ([(SIDES, np.ones(5))], r"shape \(6, 3\) and the offsets \(5,\)"),
        ([(SIDES * np.nan, np.ones(6))], "row 0 of polytope 0 is not finite"),
        ([(np.vstack([SIDES, np.zeros(3)]), np.ones(7))], "row 6 of polytope 0 has a normal of zeros"),
        ([box((0, 0, 0), (1, 1, 1)), (np.eye(2), np.ones(2))], "polytope 1 has 2 coordinates and polytope 0 has 3"),
        ([SIDES], "polytope 0 is not a pair"),
        ([(SIDES, np.ones(6), np.ones(6))], "polytope 0 is not a pair"),
        ([], "list of pairs"),
        (3, "list of pairs"),
    ],
)
def test_bad_polytopes_are_refused_by_index(sets, message):
    with pytest.raises(CorridorError, match=message):
        Polytopes(sets)


def test_inner_balls_and_boxes_of_simplices_are_those_of_geometry():
    triangle = (np.array([[-1.0, 0], [0, -1], [3 / 5, 4 / 5]]), np.array([0.0, 0.0, 12 / 5]))
    center, radius = inner_balls([triangle, triangle])
    assert radius == pytest.approx([1.0, 1.0]) and center == pytest.approx(np.ones((2, 2)))
    lower, upper = bounding_boxes([triangle])
    assert lower[0] == pytest.approx([0.0, 0.0], abs=1e-9) and upper[0] == pytest.approx([4.0, 3.0])


@pytest.mark.parametrize(("radius", "flat"), ((1.8e-9, True), (2.2e-9, False)))
def test_a_polytope_has_an_interior_above_a_billionth_of_its_size(radius, flat):
    """Its size is 1 m more than the largest offset, here 2 m."""
    rows = np.concatenate((np.eye(2), -np.eye(2))), np.array([2.0 * radius, 1.0, 0.0, 0.0])
    if flat:
        with pytest.raises(CorridorError, match="interior"):
            Polytopes([rows])
    else:
        Polytopes([rows])


def test_a_set_without_an_end_has_a_ball_of_a_thousand_times_its_size():
    assert inner_balls([(np.array([[1.0, 0.0]]), np.array([3.0]))])[1] == pytest.approx([4000.0])
    assert inner_balls([box((-300.0,) * 3, (300.0,) * 3)])[1] == pytest.approx([300.0])


def test_there_is_one_polytope_for_each_leg():
    with pytest.raises(CorridorError, match="the corridor has 1 polytopes for 2 legs"):
        minsnap.plan([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [1, 1], corridor=Polytopes([box((-1, -1, -1), (3, 1, 1))]))
    with pytest.raises(CorridorError, match="the corridor has 3 coordinates and the waypoints 2"):
        minsnap.plan([(0, 0), (1, 0)], [1], corridor=Polytopes([box((-1, -1, -1), (3, 1, 1))]))


def test_a_single_polytope_has_no_passages_and_stays_as_it_is():
    single = Polytopes([(np.concatenate((np.eye(2), -np.eye(2))), np.ones(4))])
    assert [part.shape for part in single.passages()] == [(0, 2)] * 3
    with pytest.raises(ValueError, match="read-only"):
        single.half_spaces[0][1][0] = 2.0
    with pytest.raises(ValueError, match="read-only"):
        single.radius[0] = 2.0


def test_a_closed_lap_begins_where_its_last_polytope_meets_the_first():
    lower = [(0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 0)]
    upper = [(3, 1, 1), (3, 3, 1), (3, 3, 1), (1, 3, 1)]
    lap = Polytopes([box(low, high) for low, high in zip(lower, upper, strict=True)])
    for found, expected in zip(lap.passages(closed=True), Boxes(lower, upper).passages(closed=True), strict=True):
        assert found == pytest.approx(expected, abs=1e-6)


def test_boxes_around_polytopes_far_from_the_origin():
    sides = np.concatenate((np.eye(2), -np.eye(2)))
    lower, upper = bounding_boxes([(sides, np.array([-5.0, -1.0, 70.0, 30.0])), (sides, np.array([70.0, 30, -5, -1]))])
    assert lower == pytest.approx(np.array([(-70.0, -30.0), (5.0, 1.0)]))
    assert upper == pytest.approx(np.array([(-5.0, -1.0), (70.0, 30.0)]))


@pytest.mark.parametrize("side", (1.0, -1.0))
def test_boxes_around_polytopes_are_unbounded_where_these_are(side):
    lower, upper = bounding_boxes([(np.array([[side, 0.0], [0.0, 1.0], [0.0, -1.0]]), np.array([2.0, 3.0, 1.0]))])
    x = (-np.inf, 2.0) if side > 0.0 else (-2.0, np.inf)
    assert (lower[0, 0], upper[0, 0]) == pytest.approx(x) and (lower[0, 1], upper[0, 1]) == pytest.approx((-1.0, 3.0))

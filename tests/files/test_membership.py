"""Samples in corridors: margins by geometry, and each sample counted to the leg that suits it."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from minsnap.corridors.constraint import Walls
from minsnap.corridors.tubes import RoundTube, Tube
from minsnap.errors import WaypointError
from minsnap.files.consistency import check_membership, leg_margins
from minsnap.trajectory.samples import Samples

CORNERS = np.array([(0.0, 0.0, 1.0), (8.0, 0.0, 1.0), (8.0, 4.0, 1.0)])


def samples(*points):
    return Samples(np.arange(float(len(points))), np.array(points, dtype=float))


def test_margin_is_the_distance_to_the_nearest_wall_of_the_leg():
    flown = samples((0, 0, 1), (4, 0.1, 0.95), (8, 0, 1), (7.8, 2, 1.05), (8, 4, 1))
    found = check_membership(flown, CORNERS, Tube(0.3))
    assert (found.margin, found.instant, found.leg) == (pytest.approx(0.1), 3.0, 1)
    assert found.ok


def test_a_sample_outside_has_a_negative_margin():
    found = check_membership(samples((0, 0, 1), (4, 0.5, 1), (8, 0, 1), (8, 4, 1)), CORNERS, Tube(0.3))
    assert not found.ok
    assert (found.margin, found.instant, found.leg) == (pytest.approx(-0.2), 1.0, 0)


def test_skew_leg_is_measured_in_the_infinity_norm_and_round_ones_in_the_euclidean():
    waypoints = np.array([(0.0, 0.0), (4.0, 4.0)])
    flown = Samples(np.arange(3.0), np.array([(0.0, 0.0), (2.5, 1.5), (4.0, 4.0)]))
    assert check_membership(flown, waypoints, Tube(0.6)).margin == pytest.approx(0.1)
    assert check_membership(flown, waypoints, RoundTube(1.0)).margin == pytest.approx(1.0 - np.sqrt(0.5))


def test_there_and_back_is_told_apart_by_order():
    back = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (0.0, 1.0)])
    flown = Samples(np.arange(5.0), np.array([(0, 0), (4, 0), (4, 1), (2, 0.0), (0, 1)], dtype=float))
    assert not check_membership(flown, back, Tube(0.3)).ok


def test_the_assignment_is_the_best_of_all():
    rng = np.random.default_rng(3)
    waypoints = rng.normal(size=(4, 2))
    for _ in range(20):
        position = rng.normal(size=(7, 2))
        margins = leg_margins(position, waypoints, Tube(0.5))
        best = max(
            min(margins[leg, i] for i, leg in enumerate(assignment))
            for assignment in itertools.product(range(3), repeat=7)
            if assignment[0] == 0 and assignment[-1] == 2 and set(np.diff(assignment)) <= {0, 1}
        )
        assert check_membership(Samples(np.arange(7.0), position), waypoints, Tube(0.5)).margin == pytest.approx(best)


def test_waypoints_that_do_not_go_with_the_samples_are_refused():
    with pytest.raises(WaypointError, match="2 coordinates|shape"):
        check_membership(samples((0, 0, 1), (1, 0, 1)), CORNERS[:, :2], Tube(0.3))
    with pytest.raises(WaypointError, match="1 samples"):
        check_membership(samples((0, 0, 1)), CORNERS, Tube(0.3))


class Funnel:
    """Within a cone around the vertical through a point: 0.2 m wide there, 0.5 m wider per metre of height."""

    def walls(self, waypoints):
        legs = len(waypoints) - 1
        across = np.broadcast_to(np.eye(2, 3), (legs, 2, 3))
        anchor, slope = np.tile((1.0, 2.0, 0.0), (legs, 1)), np.tile((0.0, 0.0, 0.5), (legs, 1))
        return [Walls.balls(np.arange(legs), across, anchor, np.full(legs, 0.2), slope=slope)]


def test_a_cone_is_wider_where_it_is_farther_from_its_tip():
    ends = np.array([(1.0, 2.0, 4.0), (1.0, 2.0, 0.0)])
    flown = samples((1, 2, 4), (2.6, 2, 3), (1, 2.1, 0))
    assert leg_margins(flown.position, ends, Funnel())[0] == pytest.approx([2.2, 0.1, 0.1])
    assert check_membership(flown, ends, Funnel()).ok
    assert not check_membership(samples((1, 2, 4), (2.6, 2, 2.7), (1, 2, 0)), ends, Funnel()).ok

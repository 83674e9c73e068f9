"""Assignments, and the closed form of straight lines with a common profile."""

from itertools import permutations

import numpy as np
import pytest

import minsnap


def test_an_assignment_has_the_least_sum_of_squares():
    rng = np.random.default_rng(1)
    starts, goals = rng.uniform(0.0, 5.0, (6, 3)), rng.uniform(0.0, 5.0, (6, 3))
    order = minsnap.assign(starts, goals)
    costs = [((starts - goals[list(each)]) ** 2).sum() for each in permutations(range(6))]
    assert ((starts - goals[order]) ** 2).sum() == pytest.approx(min(costs))


def test_spare_goals_are_left_out_and_missing_ones_refused():
    assert minsnap.assign([(0.0, 0.0)], [(5.0, 5.0), (1.0, 0.0)]).tolist() == [1]
    with pytest.raises(minsnap.errors.FleetError, match="2 vehicles and 1 goals"):
        minsnap.assign([(0.0, 0.0), (1.0, 1.0)], [(5.0, 5.0)])


def test_the_closed_form_agrees_with_the_certificate_of_the_lines():
    rng = np.random.default_rng(2)
    starts, goals = rng.uniform(0.0, 9.0, (300, 3)), rng.uniform(0.0, 9.0, (300, 3))
    separation = minsnap.Separation(0.2, downwash=2.0)
    found = minsnap.fleet.line_distance(starts, goals, separation)
    lines = [minsnap.plan([a, b], total_time=4.0) for a, b in zip(starts, goals, strict=True)]
    proved = minsnap.certify_fleet(lines, separation)
    assert found.pair == proved.pair
    assert found.least_distance == pytest.approx(proved.least_distance, abs=1e-9)
    assert found.apart == proved.ok


def test_grids_apart_by_root_two_of_the_separation_are_apart_on_the_way():
    rng = np.random.default_rng(4)
    grid = 1.42 * np.stack(np.meshgrid(*[np.arange(4.0)] * 3), axis=-1).reshape(-1, 3)
    goals = rng.permutation(grid)[:40] + [3.0, 20.0, 5.0]
    starts = rng.permutation(grid)[:40]
    assert minsnap.fleet.line_distance(starts, goals[minsnap.assign(starts, goals)], 1.0).apart
    assert not minsnap.fleet.line_distance(starts, starts[::-1] + [0.1, 0.0, 0.0], 1.0).apart


@pytest.mark.parametrize("starts", [[(0.0, np.nan, 1.0)], [], "here", [(1.0, 2.0, 3.0, 4.0)]])
def test_bad_points_are_one_sentence(starts):
    with pytest.raises(minsnap.errors.FleetError, match="starts"):
        minsnap.assign(starts, [(0.0, 0.0, 0.0)])


def places(kind, count):
    """Return a grid on the ground, a ball above it, or points at random."""
    side = int(np.ceil(np.sqrt(count)))
    if kind == "grid":
        return 3.0 * np.stack([np.arange(count) % side, np.arange(count) // side, np.zeros(count)], axis=1)
    cube = np.stack(np.meshgrid(*[np.arange(-9.0, 10.0)] * 3), axis=-1).reshape(-1, 3)
    if kind == "ball":
        return 3.2 * cube[np.argsort((cube**2).sum(axis=1), kind="stable")[:count]] + [20.0, 20.0, 60.0]
    return np.random.default_rng(7).uniform(0.0, 60.0, (count, 3))


@pytest.mark.parametrize(
    ("starts", "goals", "spare"), [("grid", "ball", 0), ("ball", "random", 0), ("grid", "random", 40)]
)
def test_an_auction_is_as_near_the_least_sum_as_its_prices_prove(starts, goals, spare):
    from scipy.optimize import linear_sum_assignment
    from scipy.spatial.distance import cdist

    from minsnap.fleet.auction import AUCTION, auction

    begin, end = places(starts, 300), places(goals, 300 + spare)
    found = auction(begin, end)
    costs = cdist(begin, end, "sqeuclidean")
    rows, columns = linear_sum_assignment(costs)
    least = costs[rows, columns].sum()
    assert len(set(found.order.tolist())) == len(begin)
    assert found.cost == pytest.approx(costs[rows, found.order].sum())
    assert (
        found.bound <= least * (1.0 + 1e-9) <= found.cost * (1.0 + 2e-9) <= least * (1.0 + AUCTION.gap) * (1.0 + 3e-9)
    )


def test_vehicles_that_are_where_they_fly_to_stay_there():
    from minsnap.fleet.auction import auction

    begin = places("ball", 200)
    found = auction(begin, begin[::-1])
    assert found.order.tolist() == list(range(199, -1, -1))
    assert found.cost == 0.0


def test_thousands_are_assigned_by_an_auction():
    begin, end = places("grid", 1100), places("ball", 1100)
    order = minsnap.assign(begin, end)
    assert sorted(order.tolist()) == list(range(1100))
    assert minsnap.fleet.line_distance(begin, end[order], 2.0).apart


def test_the_distances_of_fleets_in_a_cube_are_those_of_all_pairs():
    rng = np.random.default_rng(11)
    begin, end = rng.uniform(0.0, 6.0, (2, 90, 3))
    ways = [minsnap.plan([a, b], total_time=3.0) for a, b in zip(begin, end, strict=True)]
    separation = minsnap.Separation(0.5, downwash=2.0)
    whole = minsnap.certify_fleet(ways, separation, reach=2.0)
    alone = {}
    for i in range(len(ways)):
        for j in range(i + 1, len(ways)):
            near = minsnap.certify_fleet([ways[i], ways[j]], separation).closest
            if near.share < 2.0:
                alone[i, j] = near.distance
    assert {near.pair: near.distance for near in whole.nearest} == pytest.approx(alone, abs=1e-9)

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

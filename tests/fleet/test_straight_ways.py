"""Straight ways of fleets in stages: distances of segments, permuted places, those that stand too near."""

import numpy as np
import pytest

import minsnap
from minsnap.errors import FleetError
from minsnap.fleet.straight_ways import nearest_of_stages, nearest_of_ways, segment_distances, stages_between

SEPARATION = minsnap.Separation(0.3, downwash=2.0)


def sampled_distances(a, b, c, d, count=201):
    """The least distance of points on two segments, at equal shares of each; never below the true one."""
    share = np.linspace(0.0, 1.0, count)[:, None]
    one, two = (first + share * (second - first) for first, second in ((a, b), (c, d)))
    return np.linalg.norm(one[:, None] - two, axis=2).min()


@pytest.mark.parametrize("dim", [2, 3])
def test_distances_of_segments_are_those_of_their_nearest_points(dim):
    random = np.random.default_rng(3)
    ends = random.uniform(-1.0, 1.0, (4, 60, dim))
    ends[1, :10] = ends[0, :10]  # a point
    ends[3, 5:15] = ends[2, 5:15]
    ends[3, 20:30] = ends[2, 20:30] + 0.7 * (ends[1, 20:30] - ends[0, 20:30])  # parallel
    ends[2, 40:45] = ends[0, 40:45]  # they touch
    found = segment_distances(*ends)
    for number, rows in enumerate(zip(*ends, strict=True)):
        length = sum(np.linalg.norm(two - one) for one, two in (rows[:2], rows[2:]))
        sampled = sampled_distances(*rows)
        assert sampled - 0.01 * length <= found[number] <= sampled + 1e-12


def grid(count):
    side = int(np.ceil(np.sqrt(count)))
    return 0.6 * np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(-1, 2)[:count]


@pytest.mark.slow
@pytest.mark.parametrize("level", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_vehicles_on_each_others_places_find_ways(level, seed):
    """Any order of ten on a narrow grid: nearly every straight line meets another vehicle."""
    random = np.random.default_rng(seed)
    places = np.column_stack([random.permutation(grid(10)), np.zeros(10)])
    goals = np.column_stack([grid(10), np.ones(10) if level else random.uniform(0.5, 2.0, 10)])
    stages = stages_between(places, goals, np.ones(10, dtype=bool), SEPARATION)
    assert (stages[0] == places).all() and (stages[-1] == goals).all()
    flat = SEPARATION.flat(stages)
    pairs = np.triu_indices(10, 1)
    for before, after in zip(flat, flat[1:], strict=False):
        moved = np.flatnonzero((before != after).any(axis=1))
        for one, two in zip(*pairs, strict=True):
            if one in moved or two in moved:
                assert sampled_distances(before[one], after[one], before[two], after[two], 41) >= 0.3 - 1e-9
    assert nearest_of_stages(stages, SEPARATION).apart


def test_those_that_do_not_fly_stay_and_are_kept_clear_of():
    places = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0)])
    goals = np.array([(2.0, 0.0, 0.7), (1.0, 0.0, 0.0), (0.0, 0.0, 0.7)])
    stages = stages_between(places, goals, np.array([True, False, True]), SEPARATION)
    assert (stages[:, 1] == places[1]).all() and (stages[-1] == goals).all()
    assert nearest_of_stages(stages, SEPARATION).apart


def test_refusals_name_the_pair_and_the_distance():
    places = np.array([(0.0, 0.0, 0.0), (0.2, 0.0, 0.0)])
    with pytest.raises(
        FleetError, match=r"vehicles 0 and 1 would come as near as 0\.2 m, and 0\.3 m are asked"
    ) as caught:
        stages_between(places, places + (0.0, 0.0, 1.0), np.ones(2, dtype=bool), SEPARATION)
    assert caught.value.pair == (0, 1)
    goals = np.array([(0.0, 0.0, 1.0), (0.1, 0.0, 1.0)])
    with pytest.raises(FleetError, match="on straight ways, at once or in turn: change their places"):
        stages_between(np.array([(0.0, 0.0, 0.0), (3.0, 0.0, 0.0)]), goals, np.ones(2, dtype=bool), SEPARATION)


def test_one_vehicle_meets_nobody():
    stages = stages_between(np.zeros((1, 3)), np.array([[1.0, 0.0, 1.0]]), np.ones(1, dtype=bool), SEPARATION)
    assert len(stages) == 3 and nearest_of_stages(stages, SEPARATION) is None
    assert nearest_of_ways(stages[None, :, 0], SEPARATION) is None

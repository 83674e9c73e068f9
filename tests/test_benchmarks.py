"""Questions that benchmarks ask by dictionaries of arguments: a changed argument of ``plan`` must not pass them by."""

import bench_limits
import bench_timing
import pytest

import minsnap


@pytest.mark.parametrize("way", bench_limits.WAYS)
def test_random_limits_are_kept_every_way(way):
    seed = next(seed for seed in range(50) if bench_limits.problem(seed)[0] == way)
    assert bench_limits.judged(seed)[2] == ""


def test_the_best_splits_cost_less_than_those_by_distance():
    for name in list(bench_timing.SPLITS)[:3]:
        asked = bench_timing.SPLITS[name]
        by_distance = minsnap.plan(search=minsnap.Search(split="distance"), **asked)
        assert minsnap.plan(**asked).cost() < 0.5 * by_distance.cost()


def test_every_way_to_the_shortest_time_keeps_the_limits_of_the_rectangle():
    course = bench_timing.RECTANGLE
    for way in bench_timing.SHORTEST.values():
        path = minsnap.plan(**course.arguments, **way)
        assert minsnap.certify(path, **course.checks).ok
        assert path.duration > course.best.seconds * (1.0 - 1e-4)

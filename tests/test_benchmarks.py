"""Questions that benchmarks ask by dictionaries of arguments: a changed argument of ``plan`` must not pass them by."""

import re
from pathlib import Path

import bench_limits
import bench_timing
import history
import pytest
import random_combinations

import minsnap
from minsnap.basics.limit_kinds import KINDS

LIMIT_NAMES = [kind.name for kind in KINDS if kind.measure != "rotors"]
"""Of all limits that are given by numbers alone, without a vehicle."""


def test_random_problems_have_every_limit():
    path = minsnap.plan([(0, 0, 1), (4, 0, 2)], [2.0])
    assert bench_limits.SPANS.keys() == bench_limits.sampled(path, minsnap.Limits()).keys() == set(LIMIT_NAMES)
    judged = set(re.findall(r'"(\w+)"', Path(random_combinations.__file__).read_text()))
    assert set(LIMIT_NAMES) - judged == set()


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


def test_the_history_has_a_row_for_every_ratio_that_is_measured():
    rows = history.read_history()
    named = {ratio.__name__ for ratio in history.RATIOS}
    assert [row["date"] for row in rows] == sorted(row["date"] for row in rows)
    for made in {(row["date"], row["version"]) for row in rows}:
        own = [row["name"] for row in rows if (row["date"], row["version"]) == made]
        assert len(own) == len(set(own)) and set(own) <= named
    assert all(float(row["ratio"]) > 0.0 for row in rows)


def test_ratios_against_bounds_and_optima_are_not_below_them():
    for ratio in (history.cost_over_optimum, history.shortest_over_bound):
        assert 1.0 - 1e-6 < ratio(0.0) < 1.1


def test_a_day_is_kept_once_for_each_version(tmp_path):
    file, row = tmp_path / "history.csv", {"date": "2026-01-02", "version": "1.0.0", "name": "a", "ratio": "2"}
    history.add([row], file)
    history.add([row | {"ratio": "3"}], file)
    history.add([row | {"version": "1.1.0"}], file)
    assert [(kept["version"], kept["ratio"]) for kept in history.read_history(file)] == [("1.0.0", "3"), ("1.1.0", "2")]
    history.draw(history.read_history(), tmp_path / "history.png")
    assert (tmp_path / "history.png").stat().st_size > 0

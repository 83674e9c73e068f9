"""Splits of a total time: by distance, and so that the cost is least."""

import numpy as np
import pytest
from scipy.optimize import minimize
from tasks import REFERENCE, random_legs, task_of

import minsnap
from minsnap.durations.least_cost import Log
from minsnap.errors import TimingError
from minsnap.trajectory.report import Step


def test_distance_split_is_in_proportion_to_the_lengths():
    path = minsnap.plan(REFERENCE, total_time=12.0, search=minsnap.Search(split="distance"))
    assert np.diff(path.leg_breaks) == pytest.approx([4.0, 2.0, 4.0, 2.0], abs=1e-12)
    assert path.cost() == pytest.approx(216.8955, abs=1e-3)
    assert path.report.steps == ()


def test_best_split_of_the_reference_rectangle():
    path = minsnap.plan(REFERENCE, total_time=12.0)
    assert path.cost() == pytest.approx(47.58486, rel=1e-6)
    assert path.duration == pytest.approx(12.0, abs=1e-12)
    assert len(path.report.steps) <= 30


def test_best_split_of_the_reference_rectangle_in_its_corridor():
    path = minsnap.plan(REFERENCE, total_time=12.0, corridor=0.3)
    assert path.cost() <= 303.9
    assert minsnap.certify(path, REFERENCE, corridor=0.3).ok
    assert path.duration == pytest.approx(12.0, abs=1e-12)


def by_brute_force(points, total, corridor=None):
    """The least cost found from five starts without gradients, over shares of the total."""

    def cost(logarithms):
        shares = np.exp(np.append(logarithms, 0.0))
        return np.log(minsnap.plan(points, total * shares / shares.sum(), corridor=corridor).cost())

    random = np.random.default_rng(0)
    legs = len(points) - 1
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    first = np.log(lengths[:-1] / lengths[-1])
    options = {"xatol": 1e-8, "fatol": 1e-12, "maxiter": 4000, "maxfev": 4000, "adaptive": True}
    starts = [first, *(first + random.normal(scale=0.4, size=legs - 1) for _ in range(2))]
    return np.exp(min(minimize(cost, start, method="Nelder-Mead", options=options).fun for start in starts))


@pytest.mark.parametrize(("seed", "legs"), [(0, 2), (1, 3), (2, 4)])
def test_no_search_without_gradients_finds_less(seed, legs):
    points, _ = random_legs(seed, legs)
    cost = minsnap.plan(points, total_time=5.0).cost()
    assert cost == pytest.approx(by_brute_force(points, 5.0), rel=1e-6)


@pytest.mark.slow
def test_no_search_without_gradients_finds_less_in_a_corridor():
    points, _ = random_legs(3, 3)
    cost = minsnap.plan(points, total_time=5.0, corridor=0.2).cost()
    assert cost <= by_brute_force(points, 5.0, 0.2) * (1.0 + 1e-5)


def test_ten_legs_end_where_random_starts_of_another_optimiser_end():
    points, _ = random_legs(4, 10)
    cost = minsnap.plan(points, total_time=20.0).cost()

    def function(logarithms):
        shares = np.exp(logarithms)
        path = minsnap.plan(points, 20.0 * shares / shares.sum())
        return np.log(path.cost())

    random = np.random.default_rng(5)
    found = [minimize(function, random.normal(scale=0.3, size=10), method="BFGS", tol=1e-7).fun for _ in range(3)]
    assert cost <= np.exp(min(found)) * (1.0 + 1e-6)


def test_a_thousand_legs():
    points, _ = random_legs(6, 1000)
    by_distance = minsnap.plan(points, total_time=2000.0, search=minsnap.Search(split="distance")).cost()
    path = minsnap.plan(points, total_time=2000.0)
    assert path.cost() < 0.5 * by_distance
    assert np.diff(path.leg_breaks).min() > 0.0 and path.duration == pytest.approx(2000.0, rel=1e-12)


def test_total_time_scales_the_split_and_the_cost_by_its_seventh_power():
    points, _ = random_legs(7, 5)
    short, long = minsnap.plan(points, total_time=4.0), minsnap.plan(points, total_time=40.0)
    assert np.diff(long.leg_breaks) / 10.0 == pytest.approx(np.diff(short.leg_breaks), rel=1e-4)
    assert short.cost() == pytest.approx(long.cost() * 1e7, rel=1e-8)


@pytest.mark.parametrize("degree", [3, 5, 9, 11])
def test_every_degree_gains_by_the_split(degree):
    half = (degree + 1) // 2
    best = minsnap.plan(REFERENCE, total_time=12.0, degree=degree).cost(half)
    assert best < minsnap.plan(REFERENCE, total_time=12.0, degree=degree, search=minsnap.Search(split="distance")).cost(
        half
    )


def test_closed_laps_are_split_too():
    best = minsnap.plan(REFERENCE, total_time=12.0, closed=True, corridor=0.3)
    assert (
        best.cost()
        < minsnap.plan(
            REFERENCE, total_time=12.0, closed=True, corridor=0.3, search=minsnap.Search(split="distance")
        ).cost()
    )


def test_one_leg_has_nothing_to_split():
    assert minsnap.plan(REFERENCE[:2], total_time=3.0).duration == 3.0


@pytest.mark.parametrize("weight", [1e-2, 1.0, 1e3])
def test_a_price_on_time_balances_cost_against_it(weight):
    """At the optimum stretching all times by a changes J a^-7 + weight T a to no order: 7 J = weight T."""
    path = minsnap.plan(REFERENCE, search=minsnap.Search(time_weight=weight))
    assert 7.0 * path.cost() == pytest.approx(weight * path.duration, rel=1e-3)
    best = minsnap.plan(REFERENCE, total_time=path.duration).cost()
    assert path.cost() == pytest.approx(best, rel=1e-4), "the cost is least for its time"


def test_time_gets_dearer_with_its_weight():
    paths = [
        minsnap.plan(REFERENCE, corridor=0.3, search=minsnap.Search(time_weight=weight))
        for weight in (1.0, 10.0, 100.0)
    ]
    durations, costs = [p.duration for p in paths], [p.cost() for p in paths]
    assert durations == sorted(durations, reverse=True) and costs == sorted(costs)
    assert all(minsnap.certify(p, REFERENCE, corridor=0.3).ok for p in paths)


def test_steps_are_told_as_they_are_made_and_kept():
    told = []
    path = minsnap.plan(REFERENCE, total_time=12.0, progress=told.append)
    assert tuple(told) == path.report.steps and len(told) > 2
    assert [step.evaluation for step in told] == list(range(1, len(told) + 1))
    assert all(step.best <= before.best for before, step in zip(told, told[1:], strict=False))
    assert told[-1].best == pytest.approx(path.cost(), rel=1e-6)
    assert all(step.total_time == pytest.approx(12.0) for step in told)


def test_log_keeps_the_best():
    log = Log(None)
    for value in (3.0, 1.0, 2.0):
        log.add(5.0, value)
    assert log.steps[-1] == Step(3, 5.0, 2.0, 1.0)


def test_a_split_of_unknown_name_is_refused():
    with pytest.raises(TimingError, match="'optimal' or 'distance'"):
        minsnap.plan(REFERENCE, total_time=12.0, search=minsnap.Search(split="equal"))


def test_a_task_knows_the_lengths_that_splits_use():
    assert task_of(REFERENCE).lengths == pytest.approx([8.0, 4.0, 8.0, 4.0])


def test_a_lap_that_may_rest_costs_nothing():
    """The logarithm of no cost led to durations that were not numbers, and out of ``plan`` by decimals' own error."""
    walls, ball = minsnap.HalfSpaces([-0.33], 2.1, order=2), minsnap.Ball(0.6)
    points = [(-0.25,), (-0.47,), (-0.25,)]
    path = minsnap.plan(points, closed=True, total_time=1.1, waypoint_tolerance=ball, corridor=walls)
    assert path.cost() == pytest.approx(0.0, abs=1e-9) and path.duration == pytest.approx(1.1)

"""Costs of random plans in every kind of corridor beside the optimum that sums of squares find."""

import pytest
from oracles.small_questions import KINDS, small_question
from oracles.sum_of_squares import enclosed

import minsnap
from minsnap.native.library import using


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("kind", KINDS)
def test_both_cores_find_the_least_cost_to_a_millionth(kind, seed):
    (points, durations, plan), (_, _, oracle) = small_question(kind, seed)
    least, most = enclosed(points, durations, **oracle)
    assert most - least <= 1e-8 * most
    for core in ("python", "native"):
        with using(core):
            assert least * (1.0 - 1e-8) <= minsnap.plan(points, durations, **plan).cost() <= most * (1.0 + 1e-6), core

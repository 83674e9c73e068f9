"""Costs, their gradients and best splits of the native core, against exact rationals and the Python core."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles.exact import Spline
from tasks import REFERENCE, random_legs, task_of

import minsnap
from minsnap.basics.deadline import WORK, Deadline, LateError, Work
from minsnap.durations.native_split import native_split
from minsnap.native import durations as native
from minsnap.native.library import core, using
from minsnap.native.plan_batches import ManyChains, many_gradients
from minsnap.native.status import Status
from minsnap.optimisation.gradient import cost_gradient as python_gradient
from minsnap.optimisation.solve import solve

pytestmark = pytest.mark.skipif(core().library is None, reason="the native core is not in use")


def gradient(points, durations, half, start=None, end=None):
    """Gradient of the optimal cost in the durations, and in the waypoints."""
    chain = ManyChains(points, durations, np.array([0, len(durations)]), half, 1)
    slopes = many_gradients(chain, (start, end))
    return slopes.durations, np.diff(-slopes.displacements, axis=0, prepend=0.0, append=0.0)


def cost(points, durations, half, pins=None):
    """Return the optimal cost, with which a search for the best split begins."""
    return native.best_split(points, durations, half, None, pins or {}).history[0, 1]


def central(function, values, index, step):
    above, below = values.copy(), values.copy()
    above[index] += step
    below[index] -= step
    return (function(above) - function(below)) / (2.0 * step)


@pytest.mark.slow
@pytest.mark.parametrize("half", (2, 3, 4, 5, 6))
def test_cost_and_gradients_are_those_of_exact_splines(half):
    points, durations = random_legs(half, legs=4)
    degree, found = 2 * half - 1, cost(points, durations, half)
    slopes, forces = gradient(points, durations, half)
    assert found == pytest.approx(Spline(points, durations, degree).cost(), rel=1e-10)
    for leg in range(4):
        exact = central(lambda T: Spline(points, T, degree).cost(), durations, leg, 1e-5)
        assert slopes[leg] == pytest.approx(exact, rel=1e-6, abs=1e-7 * found)
    for place in ((0, 0), (2, 1), (4, 2)):
        exact = central(lambda X: Spline(X, durations, degree).cost(), points, place, 1e-5)
        assert forces[place] == pytest.approx(exact, rel=1e-6, abs=1e-7 * found)


@pytest.mark.parametrize("dim", (1, 2, 3, 5, 7))
def test_the_gradient_is_that_of_the_python_core(dim):
    points, durations = random_legs(dim, legs=6, dim=dim)
    with using("python"):
        solved = solve(task_of(points), durations)
        expected = python_gradient(solved)
    slopes, forces = gradient(points, durations, 4)
    assert cost(points, durations, 4) == pytest.approx(solved.cost, rel=1e-9)
    assert slopes == pytest.approx(expected, rel=1e-6, abs=1e-7 * np.abs(expected).max())
    assert forces.sum(axis=0) == pytest.approx(np.zeros(dim), abs=1e-9 * np.abs(forces).max())


def test_moving_ends_have_their_gradient_too():
    points, durations = random_legs(3, legs=5)
    pins = {0: {1: np.array([1.0, 0.2, -0.3])}, 5: {2: np.array([0.1, 0.0, 0.5])}}
    rest = {order: np.zeros(3) for order in (1, 2, 3)}
    states = {0: rest | pins[0], 5: rest | pins[5]}
    start, end = (np.array([[state[order] for order in (1, 2, 3)]]) for state in states.values())
    assert cost(points, durations, 4, pins) == pytest.approx(Spline(points, durations, states=states).cost(), rel=1e-10)
    exact = central(lambda T: Spline(points, T, states=states).cost(), durations, 0, 1e-5)
    assert gradient(points, durations, 4, start, end)[0][0] == pytest.approx(exact, rel=1e-6)


KINDS = (
    {},
    {"closed": True},
    {"degree": 5},
    {"degree": 11},
    {"pieces": 2},
    {"pins": {2: {"velocity": (-1.0, 0.0, 0.0)}}},
    {"start": {"velocity": (0.5, 0.0, 0.0)}},
    {"degree": 9},
    {"corridor": 0.3},
    {"corridor": 0.3, "closed": True},
    {"corridor": 0.3, "pieces": 2},
    {"corridor": 0.2, "degree": 9},
    {"waypoint_tolerance": 0.2},
)


@pytest.mark.parametrize("kind", KINDS, ids=[" ".join(map(str, kind)) or "free" for kind in KINDS])
def test_the_best_split_costs_what_the_python_core_finds(kind):
    with using("python"):
        expected = minsnap.plan(REFERENCE, total_time=12.0, **kind)
    found = minsnap.plan(REFERENCE, total_time=12.0, **kind)
    assert found.report.cost <= expected.report.cost * (1.0 + 1e-6)
    assert found.duration == pytest.approx(12.0, rel=1e-12)
    assert minsnap.certify(found, REFERENCE, kind.get("corridor"), tolerance=kind.get("waypoint_tolerance", 0.0)).ok
    assert found.report.steps[-1].best == pytest.approx(found.report.cost, rel=3e-6)


@pytest.mark.parametrize("corridor", (None, 0.3))
@pytest.mark.parametrize("weight", (1e-2, 1e2))
def test_a_price_of_time_is_balanced(weight, corridor):
    """Stretching all times by a changes J a^-7 + weight T a to no order: 7 J = weight T."""
    path = minsnap.plan(REFERENCE, corridor=corridor, search=minsnap.Search(time_weight=weight))
    assert 7.0 * path.report.cost == pytest.approx(weight * path.duration, rel=2e-3)


@pytest.mark.parametrize("seed", [6, 11, 12, 13, 15])
def test_evaluations_in_a_corridor_are_exact_where_the_search_ends(seed):
    """Walls that move inwards for a proof made costs differ by 3e-7, and searches take steps against that noise."""
    points, durations = random_legs(seed, legs=8)
    steps = minsnap.plan(points, total_time=float(durations.sum()), corridor=0.05).report.steps
    values = np.array([step.value for step in steps])
    last = values[np.argmax(values <= (1.0 + 1e-6) * values.min()) :]
    assert len(last) > 1 and np.diff(last).max() <= 1e-9 * last[0]


@pytest.mark.parametrize(
    ("legs", "width", "closed"), [(60, 0.5, False), (60, 0.05, False), (100, 0.3, False), (60, 0.1, True)]
)
def test_the_best_split_of_many_legs_costs_less_than_others(legs, width, closed):
    points, durations = random_legs(3, legs=legs)
    points[-1] = points[0] if closed else points[-1]
    task = task_of(points, minsnap.Tube(width), closed=closed)
    found = native_split(task, durations, None)
    assert found.durations.sum() == pytest.approx(durations.sum(), rel=1e-12)
    asked = {"corridor": width, "closed": closed}
    best = minsnap.plan(points, found.durations, **asked).cost()
    assert best == pytest.approx(found.history[:, 1].min(), rel=2e-6)
    for seed in range(6):
        others = found.durations * np.exp(0.01 * np.random.default_rng(seed).normal(size=legs))
        others *= found.durations.sum() / others.sum()
        assert minsnap.plan(points, others, **asked).cost() > (1.0 + 1e-5) * best


def test_tasks_of_other_kinds_are_left_to_python():
    points, durations = random_legs(0)
    assert native_split(replace(task_of(points, minsnap.RoundTube(0.3)), solver="piqp"), durations, None) is None
    with using("python"):
        assert native_split(task_of(points), durations, None) is None


@pytest.mark.parametrize(("half", "ratio"), ((4, 1e4), (5, 300.0), (6, 50.0)))
def test_the_cost_of_durations_far_apart_is_that_of_the_optimum(half, ratio):
    points, durations = random_legs(half, legs=3)
    durations[1] = durations[0] / ratio
    assert cost(points, durations, half) == pytest.approx(Spline(points, durations, 2 * half - 1).cost(), rel=1e-6)


@pytest.mark.parametrize(("half", "ratio"), ((4, 50.0), (5, 15.0), (6, 6.0)))
def test_the_gradient_of_durations_far_apart_obeys_euler(half, ratio):
    points, durations = random_legs(half, legs=3)
    durations[1] = durations[0] / ratio
    slopes, _ = gradient(points, durations, half)
    assert durations @ slopes == pytest.approx((1 - 2 * half) * cost(points, durations, half), rel=1e-6)


@pytest.mark.parametrize("corridor", (None, minsnap.Tube(0.3)))
def test_once_the_time_is_over_the_best_so_far_is_returned(corridor):
    points, durations = random_legs(0)
    task = task_of(points, *([] if corridor is None else [corridor]))
    whole = native_split(task, durations, 2.0)
    late = native_split(replace(task, deadline=Deadline(0.0, lambda: 0.0)), durations, 2.0)
    assert len(late.history) == 1 < len(whole.history)
    assert late.durations == pytest.approx(durations)
    assert whole.history[:, 1].min() < late.history[0, 1]
    if corridor is not None:
        with pytest.raises(LateError):
            native_split(replace(task, deadline=Deadline(-1.0, lambda: 0.0)), durations, 2.0)


def test_once_the_work_is_done_the_best_so_far_is_returned():
    points, durations = random_legs(0)
    task, deadline = task_of(points, minsnap.Tube(0.3)), Deadline(work=Work(1e9))
    whole = native_split(replace(task, deadline=deadline), durations, None)
    ended = native_split(replace(task, deadline=Deadline(work=Work(1e-6))), durations, None)
    assert len(whole.history) > 2 and deadline.work.done == pytest.approx(WORK.solve * whole.work) and whole.work > 0.0
    assert len(ended.history) == 1 and whole.history[:, 1].min() < ended.history[0, 1]


@pytest.mark.parametrize("seed", (1, 3, 5))
def test_a_leg_that_weighs_more_than_all_others_keeps_its_size(seed):
    """A last leg of 5 cm took half of the first cost, and the search made it longer than all others together."""
    step = np.random.default_rng(seed).normal(size=(2000, 3))
    step[-2:] *= np.array([[0.83], [0.05]]) / np.linalg.norm(step[-2:], axis=1, keepdims=True)
    points, lengths = np.cumsum(np.vstack((np.zeros(3), step)), axis=0), np.linalg.norm(step, axis=1)
    split = native.best_split(points, 2000.0 * lengths / lengths.sum(), 4, None, {})
    slopes = gradient(points, split.durations, 4)[0]
    assert np.abs(split.durations * (slopes - np.median(slopes))).max() <= 1e-4 * split.history[-1, 1]
    assert split.durations.max() < 10.0


def test_every_status_of_a_split():
    points, durations = random_legs(0)
    still = np.repeat(points[:1], len(points), axis=0)
    assert native.best_split(still, durations, 4, None, {}) is Status.INFEASIBLE
    for half in (1, 7):
        assert native.best_split(points, durations, half, None, {}) is Status.BAD_SIZE
    for wrong in (durations * np.inf, -durations):
        assert native.best_split(points, wrong, 4, None, {}) is Status.BAD_NUMBER
    assert native.best_split(np.where(points == points[1], np.nan, points), durations, 4, None, {}) is Status.BAD_NUMBER
    apart = durations * np.geomspace(1e-12, 1.0, len(durations))
    assert native.best_split(points, apart, 4, None, {}) is Status.UNSUPPORTED
    closed = np.concatenate((points, points[:1])), np.append(durations, 1e-6)
    assert native.best_split(*closed, 4, None, {}, True) is Status.UNSUPPORTED


@given(
    st.integers(1, 8),
    st.integers(1, 6),
    st.integers(1, 9),
    st.integers(0, 2**32 - 1),
    st.sampled_from((0.0, np.nan, np.inf, 1e300)),
)
def test_no_argument_breaks_the_core(half, legs, dim, seed, bad):
    random = np.random.default_rng(seed)
    points, durations = random.normal(size=(legs + 1, dim)), random.uniform(0.1, 3.0, legs)
    if seed % 3 == 0:
        points.reshape(-1)[seed % points.size] = bad
    elif seed % 3 == 1:
        durations[seed % legs] = bad
    found = native.best_split(points, durations, half, None, {})
    assert isinstance(found, (Status, native.BestSplit))
    assert isinstance(found, Status) or np.isfinite(found.durations).all()

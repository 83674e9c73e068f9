"""Gradients of plan_many: against differences of costs, and against formulas of the Python core."""

from dataclasses import replace

import numpy as np
import pytest
from tasks import task_of

import minsnap
from minsnap.corridors.named_constraints import TUBES
from minsnap.errors import InputError
from minsnap.native import library
from minsnap.native.plan_batches import ManyChains, many_tubes
from minsnap.optimisation.gradient import cost_gradient
from minsnap.optimisation.solve import solve

NATIVE = library.core().library is not None
needs_native = pytest.mark.skipif(not NATIVE, reason="the native core is not built")


def questions(count, legs, dim=3, seed=0):
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.normal(size=(count, legs + 1, dim)), axis=1), rng.uniform(0.7, 1.4, (count, legs))


class Stranger(minsnap.Tube):
    """A constraint of somebody else, whose walls may follow the waypoints in any way."""

    def __init__(self):
        super().__init__(0.3)


def differences(cost, values, step):
    """Central differences of a cost of one problem in every entry of an array."""
    slopes = np.empty(values.shape)
    for index in np.ndindex(values.shape):
        above, below = values.copy(), values.copy()
        above[index] += step
        below[index] -= step
        slopes[index] = (cost(above) - cost(below)) / (2.0 * step)
    return slopes


@pytest.mark.parametrize("degree", [3, 5, 7, 9, 11])
@pytest.mark.parametrize("dim", [1, 3])
def test_gradients_without_walls_are_those_of_differences(degree, dim):
    points, durations = questions(3, 4, dim, degree)
    ends = {"start": {"velocity": np.full(dim, 0.5)}}
    many = minsnap.plan_many(points, durations, degree=degree, gradients=True, **ends)

    def cost(P, T):
        return minsnap.plan(P, durations=T, degree=degree, **ends).cost()

    times, places = many.gradients.durations.reshape(3, 4), many.gradients.waypoints.reshape(3, 5, dim)
    for b in range(3):
        by_time = differences(lambda T, b=b: cost(points[b], T), durations[b], 1e-5)
        by_place = differences(lambda P, b=b: cost(P, durations[b]), points[b], 1e-4)
        assert np.allclose(times[b], by_time, rtol=1e-5, atol=1e-6 * np.abs(by_time).max())
        assert np.allclose(places[b], by_place, rtol=1e-6, atol=1e-7 * np.abs(by_place).max())
    assert many.gradients.corridor is None
    assert np.allclose(many.costs, [cost(P, T) for P, T in zip(points, durations, strict=True)], rtol=1e-12)


@needs_native
@pytest.mark.parametrize("degree", [5, 7, 11])
def test_both_cores_have_the_same_gradients_without_walls(degree):
    points, durations = questions(20, 6, 3, 1)
    native = minsnap.plan_many(points, durations, degree=degree, gradients=True).gradients
    with library.using("python"):
        python = minsnap.plan_many(points, durations, degree=degree, gradients=True).gradients
    for one, other in ((native.durations, python.durations), (native.waypoints, python.waypoints)):
        assert np.allclose(one, other, rtol=1e-7, atol=1e-8 * np.abs(other).max())


@needs_native
@pytest.mark.parametrize(("dim", "degree"), [(3, 7), (2, 7), (3, 9), (2, 5)])
def test_gradients_in_tubes_are_those_of_differences(dim, degree):
    (points,), (durations,) = questions(1, 4, dim, degree)
    widths, half, offsets = np.array([0.04, 0.06, 0.03, 0.05]), (degree + 1) // 2, np.array([0, 4])

    def cost(P, T, W):
        return many_tubes(ManyChains(P, T, offsets, half, 1), W, gap=1e-11).figures[0, 0]

    found = many_tubes(ManyChains(points, durations, offsets, half, 1), widths, True, 1e-11)
    assert found.statuses[0] == 0 and found.figures[0, 2] >= 2
    times, moves, walls = found.slopes
    places = np.zeros(points.shape)
    places[:-1] -= moves
    places[1:] += moves
    by_time = differences(lambda T: cost(points, T, widths), durations, 1e-4)
    by_place = differences(lambda P: cost(P, durations, widths), points, 1e-4)
    by_width = differences(lambda W: cost(points, durations, W), widths, 1e-5)
    for exact, seen in ((times, by_time), (places, by_place), (walls, by_width)):
        assert np.allclose(exact, seen, rtol=2e-4, atol=2e-5 * np.abs(seen).max())
    assert (walls <= 0.0).all() and (walls < 0.0).any()


@needs_native
def test_gradients_in_durations_inside_tubes_are_those_of_the_python_core():
    points, durations = questions(5, 5, 3, 4)
    many = minsnap.plan_many(points, durations, corridor=0.2, gradients=True)
    for b in range(5):
        with library.using("python"):
            exact = cost_gradient(solve(task_of(points[b], minsnap.Tube(0.2)), durations[b]))
        assert np.allclose(many.gradients.durations[5 * b : 5 * b + 5], exact, atol=2e-3 * np.abs(exact).max())


@needs_native
def test_moving_everything_or_scaling_time_changes_what_it_must():
    points, durations = questions(50, 6, 3, 2)
    for corridor in (None, 0.3):
        many = minsnap.plan_many(points, durations, corridor=corridor, gradients=True)
        places = many.gradients.waypoints.reshape(50, 7, 3)
        scale = np.abs(places).max(axis=(1, 2))
        assert (np.abs(places.sum(axis=1)).max(axis=1) <= 1e-9 * scale).all()
        times = (many.gradients.durations.reshape(50, 6) * durations).sum(axis=1)
        assert np.allclose(times, -7.0 * many.costs, rtol=1e-3 if corridor else 1e-9)


@needs_native
def test_lengths_scale_together():
    """The cost grows with the square of all lengths: Euler's theorem joins waypoints and half-widths."""
    points, durations = questions(50, 5, 3, 3)
    many = minsnap.plan_many(points, durations, corridor=0.25, gradients=True)
    by_place = (many.gradients.waypoints.reshape(50, 6, 3) * points).sum(axis=(1, 2))
    by_width = 0.25 * many.gradients.corridor.reshape(50, 5).sum(axis=1)
    assert np.allclose(by_place + by_width, 2.0 * many.costs, rtol=1e-3)


def test_plans_that_fail_have_no_gradients_and_the_others_have():
    points, durations = questions(4, 3)
    points[1, 1, 0] = np.nan
    durations[2, 0] = 1e9  # left to the Python core
    many = minsnap.plan_many(points, durations, gradients=True)
    legs = many.gradients.durations.reshape(4, 3)
    assert np.isnan(legs[1]).all() and np.isfinite(legs[[0, 2, 3]]).all()
    assert np.isnan(many.costs[1]) and np.isfinite(many.costs[[0, 2, 3]]).all()
    assert not many.gradients.waypoints.flags.writeable


WALKED = np.array([(0.0, 0.0, 0.0), (1.2, 0.3, -0.2), (1.6, 1.5, 0.1), (0.4, 1.9, 0.8)])
TIMES = np.array([1.1, 0.9, 1.2])
BOXES = minsnap.Boxes(
    np.minimum(WALKED[:-1], WALKED[1:]) - (0.05, 0.06, 0.04), np.maximum(WALKED[:-1], WALKED[1:]) + (0.05, 0.06, 0.04)
)
MOVING = {"velocity": (0.7, 0.2, -0.1)}


TUBE_OF = {minsnap.Tube: minsnap.Tube, minsnap.RoundTube: minsnap.RoundTube}
"""What makes a tube of each kind with one width per leg, of which its walls are nearer or further."""


def test_every_tube_is_compared_with_differences():
    assert TUBE_OF.keys() == set(TUBES)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("walls", "further"),
    [
        *((tube, {"start": MOVING}) for tube in TUBE_OF.values()),
        *((tube, {"pins": {1: {"velocity": (0.15, 0.15, 0.0)}}}) for tube in TUBE_OF.values()),
        (lambda width: minsnap.Tube([np.inf, width[1], width[2]]), {"start": MOVING}),
        (lambda width: BOXES, {}),
        (lambda width: minsnap.RoundTube(width), {}),
        (lambda width: minsnap.RoundTube(width), {"start": MOVING, "pins": {1: {"velocity": (0.15, 0.15, 0.0)}}}),
        (lambda width: [minsnap.Tube(width), minsnap.Room((-0.1, -0.1, -0.3), (1.65, 2.0, 0.9))], {"start": MOVING}),
        (None, {"pins": {1: {"velocity": (0.15, 0.15, 0.0)}}}),
    ],
)
def test_gradients_in_any_walls_are_those_of_differences(walls, further):
    widths = np.array([0.06, 0.05, 0.07])

    def many(P, T, W, gradients=False):
        corridor = None if walls is None else [walls(W)]
        given = {k: [v] if k == "pins" else v for k, v in further.items()}
        return minsnap.plan_many([P], [T], corridor, **given, gradients=gradients)

    def cost(P, T, W):
        found = many(P, T, W)
        if walls is None:
            return found.costs[0]
        parts = walls(W) if isinstance(walls(W), list) else [walls(W)]
        faces = [wall for part in parts for wall in part.walls(P)]
        ends = {order: np.zeros(3) for order in (1, 2, 3)}
        start = ends | {1: np.array(further.get("start", {"velocity": (0, 0, 0)})["velocity"])}
        pins = {1: {1: np.array(further["pins"][1]["velocity"])}} if "pins" in further else {}
        task = replace(task_of(P, None, pins=pins | {0: start, 3: ends}), walls=faces)
        return solve(task, T, gap=1e-11).cost

    found = many(WALKED, TIMES, widths, True).gradients
    exact = found.durations, found.waypoints, found.corridor
    by_time = differences(lambda T: cost(WALKED, T, widths), TIMES, 1e-4)
    by_place = differences(lambda P: cost(P, TIMES, widths), WALKED, 1e-4)
    by_width = differences(lambda W: cost(WALKED, TIMES, W), widths, 1e-5)
    for one, seen in zip(exact, (by_time, by_place, by_width), strict=True):
        if one is None:
            assert not seen.any()
        else:
            assert np.allclose(one, seen, rtol=3e-4, atol=1e-4 * max(np.abs(seen).max(), 1e-3))
    if walls is not None and not isinstance(walls(widths), minsnap.Boxes):
        assert (found.corridor <= 0.0).all() and (found.corridor < 0.0).any()


def test_a_plan_that_fails_in_walls_has_no_gradients_and_the_others_have():
    points = [WALKED, WALKED, WALKED]
    many = minsnap.plan_many(points, [TIMES, -TIMES, TIMES], [BOXES, BOXES, 0.1], gradients=True)
    assert [error is None for error in many.errors] == [True, False, True]
    legs, places = many.gradients.durations.reshape(3, 3), many.gradients.waypoints.reshape(3, 4, 3)
    assert np.isnan(legs[1]).all() and np.isnan(places[1]).all() and np.isfinite(legs[[0, 2]]).all()
    assert many.gradients.offsets.tolist() == [0, 3, 6, 9]
    alone = minsnap.plan_many([WALKED], [TIMES], 0.1, gradients=True).gradients
    assert np.allclose(places[2], alone.waypoints, rtol=1e-4, atol=1e-4 * np.abs(alone.waypoints).max())
    assert (many.gradients.corridor[:3] == 0.0).all()


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"limits": minsnap.Limits(speed=3.0)}, "for fixed durations"),
        ({"total_time": 3.0}, "for fixed durations"),
        ({"pieces": 3}, "one polynomial per leg"),
        ({"corridor": [Stranger(), Stranger()]}, "not of Stranger"),
    ],
)
def test_gradients_that_are_not_known_are_refused(given, says):
    points, durations = questions(2, 2)
    times = None if "total_time" in given or "limits" in given else durations
    with pytest.raises(InputError, match=says):
        minsnap.plan_many(points, times, gradients=True, **given)


def test_gradients_have_a_row_for_each_plan():
    points, durations = questions(3, 2)
    gradients = minsnap.plan_many(points, durations, 0.3, gradients=True).gradients
    stacked = gradients.stacked
    assert stacked.durations.shape == durations.shape and stacked.waypoints.shape == points.shape
    assert np.array_equal(stacked.durations.ravel(), gradients.durations) and stacked.corridor.shape == durations.shape
    uneven = minsnap.plan_many([points[0], points[1][:2]], [durations[0], durations[1][:1]], gradients=True)
    with pytest.raises(InputError, match="different numbers of legs"):
        _ = uneven.gradients.stacked
    assert minsnap.plan_many(points[:0], durations[:0], gradients=True).gradients.stacked.durations.shape == (0, 0)

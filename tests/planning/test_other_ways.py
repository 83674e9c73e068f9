"""The quickest flight wins where the shortest way bends: around obstacles, through maps, and with ``avoid``."""

import dataclasses

import numpy as np
import pytest

import minsnap
from minsnap.paths.routes import plan_route
from minsnap.planning import around
from minsnap.planning.other_ways import OTHER_WAYS, least_by_length

LIMITS = minsnap.Limits(speed=6.0, acceleration=3.0)
NONE = dataclasses.replace(OTHER_WAYS, gain=1e9)


def chicane() -> list[minsnap.Cuboid]:
    """Four walls with gaps to the left and to the right in turn, and one straight passage beside, farther away."""

    def box(x: float, low: float, high: float, long: float = 0.2) -> minsnap.Cuboid:
        return minsnap.Cuboid((x, low, -5.0), (x + long, high, 9.0))

    walls = [box(7.5, 3.8, 4.0, 3.2), box(7.5, 5.0, 5.2, 3.2)]
    for index in range(4):
        low, high = (0.05, 0.75) if index % 2 else (-0.75, -0.05)
        walls += [box(7.5 + index, *side) for side in ((-8.0, low), (high, 4.0), (5.0, 8.0))]
    return walls


def as_cells(layers: int | None) -> np.ndarray:
    """The same as a map of cells of 0.1 m, whose origin is (0, -8)."""
    x, y = np.meshgrid(0.1 * np.arange(190) + 0.05, 0.1 * np.arange(160) - 7.95, indexing="ij")
    taken = np.zeros(x.shape, dtype=bool)
    for wall in chicane():
        (a, b), (c, d) = wall.lower[:2], wall.upper[:2]
        taken |= (x > a) & (x < c) & (y > b) & (y < d)
    return taken if layers is None else np.repeat(taken[..., None], layers, axis=2)


@pytest.fixture
def alone(monkeypatch):
    """Plan along the first way alone."""

    def plan(make):
        with monkeypatch.context() as patch:
            patch.setattr(plan_route, "OTHER_WAYS", NONE)
            patch.setattr(around, "OTHER_WAYS", NONE)
            return make()

    return plan


@pytest.mark.slow
def test_a_longer_way_without_bends_is_flown_around_obstacles(alone):
    def make():
        return plan_route.plan_through(chicane(), (0, 0), (19, 0), 0.2, limits=LIMITS)

    first, quickest = alone(make), make()
    assert first.way[:, 1].max() < 1.0 and quickest.way[:, 1].max() > 4.0
    assert quickest.duration < 0.8 * first.duration
    assert minsnap.certify(quickest.trajectory, corridor=quickest.corridor, limits=LIMITS, avoid=chicane()).ok


@pytest.mark.slow
@pytest.mark.parametrize("layers", [None, 10])
def test_a_longer_way_without_bends_is_flown_through_maps(alone, layers):
    ends = [(0.15, 0.0, 0.5)[: 2 if layers is None else 3], (18.8, 0.0, 0.5)[: 2 if layers is None else 3]]
    origin = (0.0, -8.0) if layers is None else (0.0, -8.0, 0.0)

    def make():
        how = {"resolution": 0.1, "origin": origin, "limits": LIMITS}
        return plan_route.plan_through(as_cells(layers), *ends, 0.2, **how)

    first, quickest = alone(make), make()
    assert first.way[:, 1].max() < 1.0 and quickest.way[:, 1].max() > 4.0
    assert quickest.duration < 0.8 * first.duration and quickest.distance >= 0.2 - 1e-9


@pytest.mark.slow
def test_a_longer_way_without_bends_is_flown_by_plans_that_avoid(alone):
    walls = [minsnap.Cuboid(np.array(each.lower) - 0.2, np.array(each.upper) + 0.2) for each in chicane()]

    def make():
        return minsnap.plan(
            [(0, 0, 1), (19, 0, 1)], limits=LIMITS, avoid=walls, corridor=minsnap.Room((-9, -9, 0), (30, 9, 2))
        )

    first, quickest = alone(make), make()
    assert quickest.duration <= first.duration
    assert minsnap.certify(quickest, limits=LIMITS, avoid=walls).ok


def test_a_time_that_is_given_takes_the_first_way(monkeypatch):
    monkeypatch.setattr(plan_route, "other_ways", lambda *_: pytest.fail("no other way is quicker in a given time"))
    route = plan_route.plan_through(chicane(), (0, 0), (19, 0), 0.2, total_time=30.0)
    assert route.duration == pytest.approx(30.0)


def test_the_least_time_by_length_is_that_of_a_trapezoid():
    line = np.array([(0.0, 0.0), (3.0, 4.0), (3.0, 34.0)])
    assert least_by_length(line, LIMITS) == pytest.approx(35.0 / 6.0 + 2.0)
    assert least_by_length(line[:2], LIMITS) == pytest.approx(2.0 * np.sqrt(5.0 / 3.0))
    assert least_by_length(line, minsnap.Limits(speed=5.0, acceleration=5.0, norm="axis")) == pytest.approx(34 / 5 + 1)
    assert least_by_length(line, minsnap.Limits(jerk=3.0)) == 0.0

"""Largest balls and reach of sets of half-spaces, against SciPy's linear programmes and against geometry."""

import numpy as np
import pytest
from scipy.optimize import linprog

from minsnap.native import library
from minsnap.native.half_space_sets import largest_balls, least_products

FAR = 1e3


@pytest.fixture(autouse=True)
def native():
    with library.using("auto") as core:
        if core.library is None:
            pytest.skip("there is no native core")
        yield


def box(lower, upper):
    axes = np.eye(len(lower))
    return np.concatenate((axes, -axes)), np.concatenate((upper, np.negative(lower)))


def random_set(rng, dim):
    """Half-spaces around a point, some twice, some with no point in common."""
    normals = rng.normal(size=(rng.integers(1, 25), dim))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    bounds = normals @ rng.normal(size=dim) * 10.0 + rng.uniform(-0.1, 2.0, len(normals))
    twice = rng.integers(0, len(normals), 5)
    return np.concatenate((normals, normals[twice])), np.concatenate((bounds, bounds[twice]))


def scipys(costs, normals, bounds, size):
    found = linprog(costs, normals, bounds, bounds=size, options={"primal_feasibility_tolerance": 1e-10})
    return found.fun if found.status == 0 else np.nan


@pytest.mark.parametrize("dim", (1, 2, 3, 6))
def test_radii_and_reach_are_those_of_another_solver(dim):
    rng = np.random.default_rng(dim)
    for _ in range(40):
        normals, bounds = random_set(rng, dim)
        size = 1.0 + np.abs(bounds).max()
        free = [(None, None)] * dim
        with_radius = np.column_stack((normals, np.ones(len(bounds))))
        radius = -scipys(-np.eye(dim + 1)[dim], with_radius, bounds, [*free, (None, FAR * size)])
        (center,), (ours,) = largest_balls([(normals, bounds)], FAR)
        assert ours == pytest.approx(radius, rel=1e-8, abs=1e-8 * size)
        assert (normals @ center + ours - bounds).max() <= 1e-12 * (np.abs(center).sum() + size)
        way = rng.normal(size=dim)
        expected = scipys(way, normals, bounds, [(-FAR * size, FAR * size)] * dim)
        least = least_products(way[None], [(normals, bounds)], FAR)
        if ours > 1e-6:
            assert least[0, 0] == pytest.approx(expected, rel=1e-7, abs=1e-7)
        elif ours < -1e-6:
            assert least is None


def test_a_center_with_room_is_in_the_middle():
    (center,), (radius,) = largest_balls([box((0.0, 0.0, 0.0), (10.0, 2.0, 4.0))], FAR)
    assert radius == pytest.approx(1.0) and center == pytest.approx([5.0, 1.0, 2.0])


def test_many_sets_are_answered_in_their_order():
    sets = [box((float(i), 0.0), (i + 1.0, 0.5 + i)) for i in range(50)]
    centers, radii = largest_balls(sets, FAR)
    assert radii == pytest.approx([min(0.5, 0.25 + i / 2.0) for i in range(50)])
    assert [tuple(center) for center in centers] == [pytest.approx((i + 0.5, 0.25 + i / 2.0)) for i in range(50)]


def test_a_corner_of_many_planes_is_reached():
    """A cone of 200 planes that all pass its tip, where every basis is degenerate."""
    angle = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    normals = np.column_stack((np.cos(angle), np.sin(angle), np.ones(200))) / np.sqrt(2.0)
    down = least_products(np.array([(0.0, 0.0, -1.0), (1.0, 0.0, 0.0)]), [(normals, np.zeros(200))], FAR)
    assert down[0] == pytest.approx([0.0, -1000.0], abs=1e-9)


def test_more_coordinates_than_it_takes_are_left_to_another_solver():
    assert largest_balls([box(np.zeros(9), np.ones(9))], FAR) is None

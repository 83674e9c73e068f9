"""The proof that a curve keeps its walls is never optimistic: against exact rationals."""

from fractions import Fraction
from math import comb, perm

import numpy as np
import pytest
from native_questions import walls_kept

from minsnap.corridors.constraint import Walls
from minsnap.native import library

GRID = 1024

pytestmark = pytest.mark.skipif(library.core().library is None, reason="there is no native core")


def exact_value(points, duration, normal, anchor, order, step):
    """n . (r^(p)(s) - a) of one piece at s = step / GRID, as a rational number."""
    degree, s = len(points) - 1 - order, Fraction(step, GRID)
    weights = [comb(degree, j) * s**j * (1 - s) ** (degree - j) for j in range(degree + 1)]
    total, factor = Fraction(0), Fraction(perm(len(points) - 1, order)) / Fraction(duration) ** order
    for axis, along in enumerate(normal):
        own = [Fraction(value) for value in points[:, axis].tolist()]
        for _ in range(order):
            own = [after - before for before, after in zip(own[:-1], own[1:], strict=True)]
        value = factor * sum(w * v for w, v in zip(weights, own, strict=True))
        total += Fraction(float(along)) * (value - Fraction(float(anchor[axis])))
    return total


def below(number):
    """Largest double that is less than a rational number."""
    near = float(number)
    return near if Fraction(near) < number else float(np.nextafter(near, -np.inf))


def random_piece(random):
    """Control points near a line, up to 1e6 m from the origin and 1e-6 to 1e3 m long, and a wall along it."""
    half, dim = int(random.integers(2, 7)), int(random.integers(1, 4))
    size = 10.0 ** random.uniform(-6.0, 3.0)
    points = random.normal(size=dim) * 10.0 ** random.uniform(-2.0, 6.0) + size * random.normal(size=(2 * half, dim))
    normal = random.normal(size=dim) if random.random() < 0.7 else np.eye(dim)[0]
    order = int(random.integers(0, 2 * half - 1)) if random.random() < 0.5 else 0
    anchor = points[0].copy() if order == 0 and random.random() < 0.5 else np.zeros(dim)
    return points, 10.0 ** random.uniform(-2.0, 2.0), normal, anchor, order


def highest_step(points, normal, order):
    """Step of the grid at which the wall's polynomial is about largest."""
    along = np.diff(points @ normal, n=order, axis=0)
    s = np.arange(GRID + 1) / GRID
    degree = len(along) - 1
    return int(np.argmax(sum(comb(degree, j) * s**j * (1 - s) ** (degree - j) * along[j] for j in range(degree + 1))))


def kept(points, duration, normal, anchor, order, bound, when=None):
    matrix, at = np.zeros((1, 0, len(normal))), None if when is None else np.full(1, when)
    numbers = np.array([anchor]), -np.array([normal]), np.array([bound]), np.ones(1)
    one = Walls(np.zeros(1, dtype=np.int64), matrix, *numbers, order, at=at)
    return bool(walls_kept(points[None], np.array([duration]), one)[0])


def check(seeds):
    proved = 0
    for seed in seeds:
        points, duration, normal, anchor, order = random_piece(np.random.default_rng(seed))
        step = highest_step(points, normal, order)
        top = exact_value(points, duration, normal, anchor, order, step)
        assert not kept(points, duration, normal, anchor, order, below(top)), seed
        size = float(np.abs(points).max() * np.abs(normal).sum() * perm(len(points) - 1, order) / duration**order)
        proved += kept(points, duration, normal, anchor, order, float(top) + 1e-4 * size * 2.0**order)
    return proved


def test_a_bound_that_is_exceeded_by_less_than_a_rounding_is_never_called_kept():
    assert check(range(1500)) > 1000


@pytest.mark.slow
def test_nor_for_many_more_polynomials():
    check(range(10_000, 18_000))


def test_a_bound_with_room_for_rounding_is_called_kept():
    random = np.random.default_rng(0)
    for _ in range(200):
        points = random.normal(size=(8, 3))
        step = highest_step(points, np.array([1.0, 0.0, 0.0]), 0)
        top = float(exact_value(points, 1.0, (1.0, 0.0, 0.0), np.zeros(3), 0, step))
        assert kept(points, 1.0, (1.0, 0.0, 0.0), np.zeros(3), 0, top + 1e-4)


def test_a_start_on_a_face_is_inside_to_the_last_bit():
    points = np.array([0.1, 0.1, 0.1, 0.1, 0.0, -0.3, -0.3, -0.3])[:, None]
    assert kept(points, 1.0, (1.0,), np.zeros(1), 0, 0.1)
    assert not kept(points, 1.0, (1.0,), np.zeros(1), 0, np.nextafter(0.1, 0.0))


@pytest.mark.parametrize(
    ("when", "bound", "answer"), [(0, 0.0, True), (1, 0.0, False), (1, 1.0, True), (-1, 0.9, False)]
)
def test_a_wall_that_holds_at_one_end_is_checked_there_only(when, bound, answer):
    line = np.linspace(0.0, 1.0, 8)[:, None]
    assert kept(line, 1.0, (1.0,), np.zeros(1), 0, bound, when) is answer


def test_twin_peaks_closer_than_any_grid_are_told_apart():
    s = np.linspace(0.0, 1.0, 8)
    twin = -(((s - 0.5) ** 2 - 1e-6) ** 2)
    degrees = np.arange(8)
    basis = np.array([[comb(7, j) * t**j * (1 - t) ** (7 - j) for j in degrees] for t in s])
    points = np.linalg.solve(basis, twin)[:, None]
    assert kept(points, 1.0, (1.0,), np.zeros(1), 0, 1e-13)
    assert not kept(points, 1.0, (1.0,), np.zeros(1), 0, -1e-12)


def test_numbers_that_cannot_be_are_refused():
    with pytest.raises(ValueError, match="finite"):
        kept(np.full((8, 1), np.nan), 1.0, (1.0,), np.zeros(1), 0, 1.0)

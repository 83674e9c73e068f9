"""Ways through grids: their lengths against networks of a few lines, and the widest by trying every clearance."""

import heapq
from itertools import product

import numpy as np
import pytest

from minsnap.corridors.occupancy_grid import gaps
from minsnap.paths.routes import passage
from minsnap.paths.routes.passage import shortest_way, widest


def length_by_hand(free, size, start, goal):
    """Dijkstra's algorithm on the grid itself, cell by cell."""
    best, queue = {start: 0.0}, [(0.0, start)]
    while queue:
        so_far, cell = heapq.heappop(queue)
        if cell == goal:
            return so_far
        for step in product((-1, 0, 1), repeat=free.ndim):
            block = list(product(*({0, change} for change in step)))
            cells = [tuple(np.add(cell, part)) for part in block]
            inside = all(0 <= i < n for other in cells for i, n in zip(other, free.shape, strict=True))
            if not any(step) or not inside or not all(free[other] for other in cells):
                continue
            there, total = tuple(np.add(cell, step)), so_far + np.linalg.norm(size * step)
            if total < best.get(there, np.inf) - 1e-12:
                best[there] = total
                heapq.heappush(queue, (total, there))
    return None


def length_of(way, size):
    return np.linalg.norm(np.diff(way, axis=0) * size, axis=1).sum()


def touches_free_cells_alone(way, free):
    """Whether all cells near many points of a line are free: each within rounding, so that edges and corners count."""
    share = np.linspace(0.0, 1.0, 997)[:, None]
    inner = np.concatenate([a + share * (b - a) for a, b in zip(way[:-1], way[1:], strict=True)] or [way])
    around = (inner + 0.5)[:, None] + 1e-9 * np.array(list(product((-1, 1), repeat=free.ndim)))
    return free[tuple(np.floor(around).astype(int).reshape(-1, free.ndim).T)].all()


@pytest.mark.slow
@pytest.mark.parametrize("shape", [(14, 11), (7, 6, 5)])
def test_a_way_is_no_longer_than_one_by_steps_and_never_cuts_a_corner(shape):
    draw, size, found, shorter = np.random.default_rng(0), np.arange(1, len(shape) + 1) * 0.1, 0, 0
    for _ in range(60):
        free = draw.random(shape) > 0.3
        start, goal = np.zeros(len(shape), dtype=int), np.array(shape) - 1
        free[tuple(start)] = free[tuple(goal)] = True
        way = shortest_way(free, size, start, goal)
        by_steps = length_by_hand(free, size, tuple(start), tuple(goal))
        assert (way is None) == (by_steps is None)
        if way is not None:
            assert (way[0] == start).all() and (way[-1] == goal).all() and touches_free_cells_alone(way, free)
            assert np.linalg.norm(size * (goal - start)) <= length_of(way, size) + 1e-9 <= by_steps + 2e-9
            found, shorter = found + 1, shorter + (length_of(way, size) < by_steps - 1e-6)
    assert found >= 6 and shorter >= found // 2


def test_a_way_in_the_open_is_one_straight_line():
    way = shortest_way(np.ones((90, 40), dtype=bool), np.ones(2), np.array([1, 2]), np.array([80, 33]))
    assert way.tolist() == [[1, 2], [80, 33]]


def test_a_way_in_blocks_is_free_and_at_most_a_little_longer(monkeypatch):
    free = np.ones((60, 50), dtype=bool)
    free[20:23, :40] = free[40:43, 10:] = False
    start, goal, ones = np.array([1, 1]), np.array([58, 47]), np.ones(2)
    exact = length_of(shortest_way(free, ones, start, goal), ones)
    monkeypatch.setattr(passage, "LARGE", 1000)
    way = shortest_way(free, ones, start, goal)
    assert (way[0] == start).all() and (way[-1] == goal).all()
    assert length_of(way, ones) <= 1.1 * exact
    fine = np.linspace(0, 1, 50)[:, None]
    inner = np.concatenate([a + fine * (b - a) for a, b in zip(way[:-1], way[1:], strict=True)])
    assert free[tuple(np.round(inner).astype(int).T)].all()


@pytest.mark.parametrize("shape", [(40, 31), (13, 12, 9)])
@pytest.mark.parametrize("large", [40, 400])
def test_a_way_in_blocks_touches_free_cells_alone(monkeypatch, shape, large):
    """Lines between the first cells of blocks touched others, and the route was refused; blocks of blocks too."""
    monkeypatch.setattr(passage, "LARGE", large)
    draw, size, found = np.random.default_rng(1), np.ones(len(shape)), 0
    for _ in range(60):
        free = np.ones(shape, dtype=bool)
        for corner in draw.integers(0, shape, (6, len(shape))):
            free[tuple(slice(at, at + 3) for at in corner)] = False
        start, goal = draw.integers(0, shape), draw.integers(0, shape)
        free[tuple(start)] = free[tuple(goal)] = True
        way = shortest_way(free, size, start, goal)
        if way is not None:
            assert (way[0] == start).all() and (way[-1] == goal).all() and touches_free_cells_alone(way, free)
            found += bool((way % 1.0).any())
    assert found > 10


def test_a_gap_of_one_cell_is_found_where_no_block_passes(monkeypatch):
    free = np.ones((40, 40), dtype=bool)
    free[20] = False
    free[20, 13] = True
    monkeypatch.setattr(passage, "LARGE", 100)
    way = shortest_way(free, np.ones(2), np.array([0, 0]), np.array([39, 39]))
    assert [20, 13] in way.tolist() and touches_free_cells_alone(way, free)


def test_the_widest_way_is_that_of_the_largest_clearance_that_passes():
    draw, size, tried = np.random.default_rng(3), np.array([0.1, 0.1]), 0
    for _ in range(20):
        taken = draw.random((30, 30)) < 0.02
        gap = gaps(taken, size)
        start, goal = np.array([2, 2]), np.array([27, 27])
        if taken[2, 2] or taken[27, 27]:
            continue
        most = widest(gap, ~taken, start, goal)
        passing = [
            v
            for v in np.unique(gap)
            if shortest_way((gap >= v) & ~taken, size, start, goal) is not None
            and (gap[2, 2] >= v and gap[27, 27] >= v)
        ]
        tried += 1
        assert most == pytest.approx(max(passing))
    assert tried > 5

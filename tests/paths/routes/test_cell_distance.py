"""The least distance to occupied cells, against straight flights whose distance is known and against dense samples."""

import numpy as np
import pytest

import minsnap
from minsnap.paths.routes import GridMap
from minsnap.paths.routes.nearness import nearest_cell


def brute(traj, grid, count=100_001):
    points, best = traj(np.linspace(0.0, traj.duration, count))[:, : grid.dim], np.inf
    for cell in np.argwhere(grid.occupied):
        low = grid.lower + grid.resolution * cell
        apart = np.maximum(np.maximum(low - points, points - low - grid.resolution), 0.0)
        best = min(best, np.sqrt((apart**2).sum(axis=1)).min())
    return best


def test_a_flight_along_a_wall_is_at_its_distance():
    cells = np.zeros((50, 30), dtype=bool)
    cells[:, 0] = True
    traj = minsnap.plan([(0.5, 1.35), (4.5, 1.35)], total_time=4.0)
    found = nearest_cell(traj, GridMap(cells, 0.1))
    assert found.distance == pytest.approx(1.25, abs=2e-9)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
def test_random_flights_past_random_cells(seed):
    draw = np.random.default_rng(seed)
    dim = 2 + seed % 2
    cells = draw.random((20,) * dim) < (0.03 if dim == 2 else 0.005)
    grid = GridMap(cells, draw.uniform(0.1, 0.3, dim), draw.uniform(-1, 1, dim))
    points = draw.uniform(grid.lower, grid.upper, (5, dim))
    traj = minsnap.plan(points, durations=draw.uniform(0.5, 3.0, 4))
    found, sampled = nearest_cell(traj, grid), brute(traj, grid)
    assert found.distance - 1e-9 <= sampled <= found.distance + 1e-4
    assert found.lower <= found.distance <= found.lower + 2e-9


def test_far_from_the_only_cell_the_nearest_instant_is_found():
    cells = np.zeros((80, 80), dtype=bool)
    cells[40, 79] = True
    traj = minsnap.plan([(0.2, 0.2), (7.8, 0.2)], total_time=5.0)
    found = nearest_cell(traj, GridMap(cells, 0.1))
    assert found.distance == pytest.approx(7.7, abs=2e-9) and found.cell == (40, 79)
    assert 3.99 <= traj(found.instant)[0] <= 4.11


def test_a_flight_through_a_cell_touches_it():
    cells = np.zeros((20, 20), dtype=bool)
    cells[10, 10] = True
    assert nearest_cell(minsnap.plan([(0.1, 1.05), (1.9, 1.05)], total_time=2.0), GridMap(cells, 0.1)).distance == 0.0


def test_nothing_occupied_is_infinitely_far():
    found = nearest_cell(minsnap.plan([(0, 0), (1, 1)], total_time=1.0), GridMap(np.zeros((9, 9), dtype=bool), 1.0))
    assert found.distance == np.inf and found.instant is None

"""Boxes from occupancy grids: free, connected, holding the path, and what is refused."""

import numpy as np
import pytest

import minsnap
from minsnap import corridor_from_grid
from minsnap.corridors.occupancy_grid import connected, gaps, grown, pruned, visited
from minsnap.errors import CorridorError

GRID = np.zeros((30, 20), dtype=int)
GRID[10, :15] = GRID[20, 5:] = 1
PATH = [(0.5, 0.5), (0.9, 1.75), (1.25, 1.75), (1.75, 0.2), (2.25, 0.2), (2.9, 1.9)]


def covered(boxes, shape, resolution):
    """Cells of each box, by their corners."""
    low = np.round(boxes.lower / resolution).astype(int)
    high = np.round(boxes.upper / resolution).astype(int)
    assert np.allclose(boxes.lower / resolution, low) and np.allclose(boxes.upper / resolution, high)
    assert (low >= 0).all() and (high <= shape).all()
    return [tuple(slice(a, b) for a, b in zip(*corner, strict=True)) for corner in zip(low, high, strict=True)]


def test_boxes_are_free_and_lead_from_start_to_end():
    found = corridor_from_grid(GRID, 0.1, PATH)
    assert not any(GRID[cells].any() for cells in covered(found.boxes, GRID.shape, 0.1))
    assert (found.boxes.lower[0] <= PATH[0]).all() and (PATH[0] <= found.boxes.upper[0]).all()
    assert (found.boxes.lower[-1] <= PATH[-1]).all() and (PATH[-1] <= found.boxes.upper[-1]).all()
    assert found.waypoints.shape == (len(found.boxes) + 1, 2)
    assert (found.waypoints[1:-1] == found.boxes.passages()[0]).all()
    with pytest.raises(ValueError, match="read-only"):
        found.waypoints[0] = 0.0


@pytest.mark.parametrize("cells", range(5, 60))
def test_a_path_may_end_on_the_border_whatever_rounding_makes_of_it(cells):
    border = 0.26 + 0.3 * cells
    found = corridor_from_grid(np.zeros((cells, 2)), 0.3, [(0.26, 0.0), (border, 0.6)], origin=(0.26, 0.0))
    assert len(found.boxes) == 1 and found.boxes.upper[0] == pytest.approx([border, 0.6])


def test_boxes_cannot_grow_any_further():
    found = corridor_from_grid(GRID, 0.1, PATH)
    for cells in covered(found.boxes, GRID.shape, 0.1):
        for axis in (0, 1):
            for at in (cells[axis].start - 1, cells[axis].stop):
                layer = list(cells)
                layer[axis] = at
                assert not 0 <= at < GRID.shape[axis] or GRID[tuple(layer)].any()


def test_plan_through_them_never_meets_an_obstacle():
    found = corridor_from_grid(GRID, 0.1, PATH)
    traj = minsnap.plan(
        None,
        total_time=12,
        corridor=found.boxes,
        start=found.start,
        end=found.end,
        search=minsnap.Search(split="distance"),
    )
    assert minsnap.certify(traj, corridor=found.boxes).ok
    cells = np.floor(traj(np.linspace(0, traj.duration, 3000)) / 0.1).astype(int)
    assert not GRID[tuple(np.minimum(cells, np.array(GRID.shape) - 1).T)].any()


def test_boxes_keep_the_clearance_from_every_obstacle():
    path = [(0.5, 0.5), (0.55, 1.75), (1.55, 1.75), (1.55, 0.2), (2.55, 0.2), (2.6, 1.9)]
    found = corridor_from_grid(GRID, 0.1, path, clearance=0.15)
    taken = np.argwhere(GRID) * 0.1
    for lower, upper in zip(found.boxes.lower, found.boxes.upper, strict=True):
        gap = np.maximum(np.maximum(taken - upper, lower - taken - 0.1), 0.0)
        assert 0.15 - 1e-9 <= np.linalg.norm(gap, axis=1).min() <= 0.2 + 1e-9


@pytest.mark.parametrize("size", (np.array([0.1, 0.15, 0.2]), np.array([0.2, 0.15, 0.1])), ids=("upwards", "downwards"))
def test_obstacles_grow_by_all_cells_that_have_a_point_too_near(size):
    draw = np.random.default_rng(0)
    for clearance in (0.0, 0.05, 0.2, 0.25, 0.41, 1.0, 9.0):
        taken = draw.random((9, 8, 7)) < 0.01
        taken[4, 4, 4] = True
        apart = np.abs(np.argwhere(np.ones_like(taken))[:, None] - np.argwhere(taken)[None])
        near = np.linalg.norm(np.maximum(apart - 1, 0) * size, axis=2).min(axis=1) < clearance
        near |= taken.reshape(-1)
        assert np.array_equal(grown(taken, clearance, size).reshape(-1), near)
        assert np.array_equal((taken | (gaps(taken, size) < clearance)).reshape(-1), near)


def test_growing_by_shifts_and_by_distances_agree_in_the_plane(monkeypatch):
    taken = np.random.default_rng(2).random((60, 50)) < 0.003
    quick = grown(taken, 0.9, np.array([0.1, 0.2]))
    monkeypatch.setattr("minsnap.corridors.occupancy_grid.FEW_SHIFTS", 0)
    assert np.array_equal(quick, grown(taken, 0.9, np.array([0.1, 0.2]))) and quick.sum() > 2 * taken.sum()


def test_gaps_without_anything_occupied_are_infinite():
    assert np.isinf(gaps(np.zeros((3, 4), dtype=bool), np.ones(2))).all()


def test_random_grids_in_space_are_crossed_along_any_free_path():
    draw = np.random.default_rng(4)
    for _ in range(20):
        grid = draw.random((12, 10, 8)) < 0.35
        cells = [np.array([0, 0, 0])]
        for _ in range(60):
            step = np.zeros(3, dtype=int)
            step[draw.integers(3)] = draw.choice([-1, 1])
            cells.append(np.clip(cells[-1] + step, 0, np.array(grid.shape) - 1))
        grid[tuple(np.array(cells).T)] = False
        origin, size = np.array([-3.0, 2.0, 0.5]), np.array([0.2, 0.3, 0.4])
        found = corridor_from_grid(grid, size, origin + size * (np.array(cells) + 0.5), origin)
        shifted = minsnap.Boxes((found.boxes.lower - origin) / size, (found.boxes.upper - origin) / size)
        assert not any(grid[inside].any() for inside in covered(shifted, grid.shape, 1.0))
        low, high = shifted.passages()[1:]
        assert (high - low > 0.99).all()
        for box, point in ((0, found.start["position"]), (-1, found.end["position"])):
            assert (found.boxes.lower[box] < point).all() and (point < found.boxes.upper[box]).all()


def test_one_side_serves_all_axes_and_one_cell_is_a_path():
    whole = corridor_from_grid(GRID, 0.1, PATH)
    assert np.array_equal(corridor_from_grid(GRID, [0.1], PATH).waypoints, whole.waypoints)
    assert len(corridor_from_grid(GRID, 0.1, [(0.51, 0.51), (0.53, 0.53)]).boxes) == 1


def test_empty_grid_is_one_box_and_its_side_can_be_bounded():
    grid = np.zeros((40, 10))
    assert len(corridor_from_grid(grid, 0.1, [(0.05, 0.05), (3.95, 0.95)]).boxes) == 1
    found = corridor_from_grid(grid, 0.1, [(0.05, 0.05), (3.95, 0.95)], largest=1.0)
    assert (found.boxes.upper - found.boxes.lower).max() <= 1.0 + 1e-9 and len(found.boxes) > 3


@pytest.mark.parametrize("corner", [(0, 1), (1, 0)])
def test_step_through_a_corner_goes_round_by_the_free_side(corner):
    grid = np.zeros((2, 2), dtype=int)
    grid[corner] = 1
    found = corridor_from_grid(grid, 1.0, [(0.5, 0.5), (1.5, 1.5)])
    assert not any(grid[cells].any() for cells in covered(found.boxes, grid.shape, 1.0))
    grid[corner[::-1]] = 1
    with pytest.raises(CorridorError, match="meets an occupied cell"):
        corridor_from_grid(grid, 1.0, [(0.5, 0.5), (1.5, 1.5)])


def test_visited_cells_are_those_that_fine_sampling_finds():
    draw = np.random.default_rng(1)
    points = draw.random((40, 3)) * [12, 10, 8]
    shape, ones = np.array([12, 10, 8]), np.ones(3)
    cells = connected(np.ones(shape, dtype=bool), visited(shape, points, ones, 0 * ones), ones, 0 * ones, 0.0)
    assert (np.abs(np.diff(cells, axis=0)).sum(axis=1) == 1).all()
    s = np.linspace(0, 1, 4000)[:, None]
    fine = np.concatenate([a + s * (b - a) for a, b in zip(points[:-1], points[1:], strict=True)])
    assert set(map(tuple, np.floor(fine).astype(int))) <= set(map(tuple, cells))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"occupancy": np.zeros(5)}, r"2 or 3 axes of numbers, 0 where free, not shape \(5,\)"),
        ({"occupancy": np.full((3, 3), "x")}, "2 or 3 axes of numbers"),
        ({"resolution": 0.0}, "a cell has a positive side"),
        ({"resolution": (0.1, 0.1, 0.1)}, "resolution is .* give one finite number, or 2"),
        ({"resolution": np.nan}, "give one finite number, or 2"),
        ({"origin": (0, 0, 0)}, r"origin is \(0, 0, 0\): give one finite number, or 2"),
        ({"occupancy": [[0, 0], [0]]}, "2 or 3 axes of numbers, 0 where free, in rows of equal length"),
        ({"occupancy": np.zeros((0, 3))}, r"not shape \(0, 3\)"),
        (
            {"path": [(0.5, 0.5), (3.5, 0.5)]},
            r"point 1 of the path, \(3.5, 0.5\) m, is outside .* \(0, 0\) to \(3, 2\) m",
        ),
        ({"path": [(0.5, 0.5), (1.5, 0.5)]}, r"an occupied cell at \(1.05, 0.55\) m, cell \(10, 5\)"),
        ({"path": [(0.5, 0.5, 0.5), (1.5, 0.5, 0.5)]}, "the path has 3 coordinates and the grid 2 axes"),
        ({"clearance": -1.0}, "the clearance is -1.0"),
        ({"largest": -1.0}, "the longest side is -1.0: it must be a positive number"),
        ({"largest": np.nan}, "the longest side is nan"),
        ({"largest": "wide"}, "the longest side is 'wide'"),
        ({"clearance": 0.2}, "nearer than 0.2 m to an occupied one: leave 0.1 m, a cell, more than the clearance"),
    ],
)
def test_bad_input_is_refused(arguments, message):
    with pytest.raises(CorridorError, match=message):
        corridor_from_grid(**{"occupancy": GRID, "resolution": 0.1, "path": PATH, **arguments})


@pytest.mark.parametrize(("rise", "cells"), ((1.8e-9, 2), (2.2e-9, 3)))
def test_a_cell_is_met_if_more_than_a_billionth_of_the_segment_is_in_it(rise, cells):
    """Half of the rise is the share between the borders x = 1 and y = 1."""
    points = np.array([(0.5, 0.5), (1.5, 1.5 + rise)])
    assert len(visited(np.array([3, 3]), points, np.ones(2), np.zeros(2))) == cells


@pytest.mark.parametrize("few_shifts", (0, 500))
@pytest.mark.parametrize(("excess", "count"), ((0.9e-12, 3), (1.1e-12, 5)))
def test_cells_at_the_clearance_are_free_to_a_trillionth(monkeypatch, few_shifts, excess, count):
    monkeypatch.setattr("minsnap.corridors.occupancy_grid.FEW_SHIFTS", few_shifts)
    taken = np.zeros((9, 1), dtype=bool)
    taken[4] = True
    assert grown(taken, 1.0 + excess, np.ones(2)).sum() == count


@pytest.mark.parametrize(("largest", "side"), ((3.0 - 0.9e-9, 1.5), (3.0 - 1.1e-9, 1.0)))
def test_the_side_of_a_box_is_a_number_of_cells_to_a_billionth(largest, side):
    boxes = corridor_from_grid(np.zeros((9, 9)), 0.5, [(0.2, 0.2), (4.2, 0.2)], largest=0.5 * largest).boxes
    assert (boxes.upper - boxes.lower).max() == side


@pytest.mark.parametrize("few_shifts", (0, 500))
def test_one_cell_in_a_corner_grows_to_the_whole_grid(monkeypatch, few_shifts):
    monkeypatch.setattr("minsnap.corridors.occupancy_grid.FEW_SHIFTS", few_shifts)
    taken = np.zeros((4, 3), dtype=bool)
    taken[0, 0] = True
    assert grown(taken, 99.0, np.ones(2)).all()


@pytest.mark.parametrize("few_shifts", (0, 500))
def test_cells_that_are_no_squares_grow_by_the_clearance(monkeypatch, few_shifts):
    """Against the distances between all cells."""
    monkeypatch.setattr("minsnap.corridors.occupancy_grid.FEW_SHIFTS", few_shifts)
    taken, size = np.zeros((9, 11), dtype=bool), np.array([2.0, 0.7])
    taken[3, 4] = taken[8, 10] = True
    cells = np.stack(np.indices(taken.shape), axis=-1)
    apart = np.abs(cells[:, :, None] - np.argwhere(taken))
    gap = np.linalg.norm(np.maximum(apart - 1, 0) * size, axis=-1).min(axis=-1)
    assert np.array_equal(grown(taken, 2.5, size), taken | (gap < 2.5))


@pytest.mark.parametrize("beyond", (0.0, 1e-10))
def test_a_path_that_turns_on_a_border_meets_the_cell_behind_it(beyond):
    points = np.array([(0.0, 0.5), (1.0 + beyond, 0.5), (1.8, 1.6)])
    assert visited(np.array([2, 2]), points, np.ones(2), np.zeros(2)).tolist() == [[0, 0], [1, 0], [1, 1]]


def test_a_path_to_the_far_border_ends_in_the_last_cell():
    assert visited(np.array([3, 2]), np.array([(0.5, 0.5), (3.0, 2.0)]), np.ones(2), np.zeros(2))[-1].tolist() == [2, 1]


def test_the_cell_behind_the_upper_side_of_a_box_is_not_in_it():
    boxes = [(np.array([0, 0]), np.array([2, 2])), (np.array([1, 0]), np.array([3, 2]))]
    assert pruned(boxes, np.array([0, 0]), np.array([2, 0])) == boxes
    assert pruned(boxes, np.array([0, 0]), np.array([1, 0])) == boxes[:1]

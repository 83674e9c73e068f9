"""Cells that a sensor's lines pass, against the intersection of each line with each cell of the block."""

import numpy as np
import pytest

from minsnap.paths.routes.known_map import FREE, OCCUPIED, UNKNOWN, KnownMap


def passed(low, high, start, ends):
    """Whether any line from a start to ends (k, dim) meets boxes (n, dim), by clipping at their sides."""
    met = np.zeros(len(low), dtype=bool)
    for end in ends:
        begin, behind = np.zeros(len(low)), np.ones(len(low))
        for axis in range(len(start)):
            way = end[axis] - start[axis]
            sides = np.stack((low[:, axis], high[:, axis])) - start[axis]
            if way == 0.0:
                behind[(sides[0] > 0.0) | (sides[1] < 0.0)] = -1.0
                continue
            shares = np.sort(sides / way, axis=0)
            begin, behind = np.maximum(begin, shares[0]), np.minimum(behind, shares[1])
        met |= begin <= behind
    return met


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_cells_on_lines_are_free_and_those_of_points_occupied(dim, seed):
    draw, size, slack = np.random.default_rng(seed), 0.25, 1e-9
    place = draw.uniform(-1.0, 1.0, dim)
    points, ends = (place + draw.normal(size=(12, dim)) for _ in range(2))
    if seed == 0:  # lines along axes, and ends on sides of cells
        place, points, ends = (np.round(each / size) * size for each in (place, points, ends))
        points[:4, 1:], ends[:4, :-1] = place[1:], place[:-1]
    known = KnownMap(dim, size)
    known.see(place, points, ends)
    cells = known.first + np.indices(known.states.shape).reshape(dim, -1).T
    states, low = known.states.reshape(-1), size * cells
    lines = np.concatenate((points, ends))
    at = np.unique(np.floor(points / size).astype(int), axis=0)
    assert {tuple(cell) for cell in cells[states == OCCUPIED].tolist()} == {tuple(cell) for cell in at.tolist()}
    assert (states[passed(low + slack, low + size - slack, place, lines)] != UNKNOWN).all()
    assert passed(low - slack, low + size + slack, place, lines)[states == FREE].all()
    boxes = known.boxes(points.min(axis=0), points.max(axis=0), unknown=False)
    within = (
        (points[:, None] >= boxes[:, 7 : 7 + dim] - slack) & (points[:, None] <= boxes[:, 10 : 10 + dim] + slack)
    ).all(axis=2)
    assert within.any(axis=1).all() and within.any(axis=0).all()
    assert (boxes[:, 10 : 10 + dim] - boxes[:, 7 : 7 + dim] <= size * (1.0 + slack)).all()


def test_what_is_seen_later_is_added_to_what_is_known():
    known = KnownMap(2, 0.5)
    known.see(np.array([0.2, 0.2]), np.array([[2.2, 0.2]]), np.zeros((0, 2)))
    known.see(np.array([-60.2, 0.2]), np.array([[-58.2, 0.2]]), np.array([[-60.2, 3.2]]))
    known.see(np.array([0.2, 0.2]), np.zeros((0, 2)), np.array([[4.2, 0.2]]))  # through what was occupied
    x, y = (
        (np.array([2.2, -58.2, 1.2, -59.2, -60.2]) // 0.5).astype(int),
        (np.array([0.2] * 4 + [2.7]) // 0.5).astype(int),
    )
    assert known.states[x - known.first[0], y - known.first[1]].tolist() == [OCCUPIED, OCCUPIED, FREE, FREE, FREE]
    assert known.states[-20 - known.first[0], 0 - known.first[1]] == UNKNOWN

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from minsnap.batch.dataset_rows import blocks, boxes, shortest_way
from minsnap.errors import CorridorError

SHAPE = {"extent": 12.0, "height": 4.0, "cell": 0.5, "occupied": 0.2, "clearance": 0.2}


def steps_by_dijkstra(free, start):
    """Return steps from a cell to all others over the graph of free cells, infinite where there is no way."""
    index = np.arange(free.size).reshape(free.shape)
    pairs = []
    for axis in range(free.ndim):
        low, high = np.take(index, range(free.shape[axis] - 1), axis), np.take(index, range(1, free.shape[axis]), axis)
        open_ = free.reshape(-1)[low] & free.reshape(-1)[high]
        pairs.append((low[open_], high[open_]))
    rows, columns = (np.concatenate(part) for part in zip(*pairs, strict=True))
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(free.size, free.size)).tocsr()
    return dijkstra(graph, directed=False, indices=index[tuple(start)]).reshape(free.shape)


@pytest.mark.parametrize("cells", [(15, 12), (10, 9, 5)])
def test_a_way_is_free_connected_and_as_short_as_by_dijkstra(cells):
    found = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        free = ~blocks(np.array(cells), 0.35, rng)
        way = shortest_way(free, rng)
        if not len(way):
            continue
        found += 1
        assert free[tuple(way.T)].all() and way[0, 0] == 0 and way[-1, 0] == cells[0] - 1
        assert (np.abs(np.diff(way, axis=0)).sum(axis=1) == 1).all()
        assert len(way) - 1 == steps_by_dijkstra(free, way[0])[tuple(way[-1])]
    assert found >= 5


def test_there_is_no_way_through_a_wall():
    free = np.ones((6, 5, 4), dtype=bool)
    free[3] = False
    assert len(shortest_way(free, np.random.default_rng(0))) == 0
    free[3, 2, 1] = True
    assert (shortest_way(free, np.random.default_rng(0)) == (3, 2, 1)).all(axis=1).any()


def test_blocks_cover_at_least_their_share():
    taken = blocks(np.array([20, 20, 8]), 0.3, np.random.default_rng(4))
    assert 0.3 <= taken.mean() < 0.6


def test_boxes_of_a_map_overlap_and_join_both_sides():
    found = boxes(SHAPE, 3, np.random.default_rng(2))
    lower, upper = found.boxes.lower, found.boxes.upper
    assert (np.maximum(lower[:-1], lower[1:]) < np.minimum(upper[:-1], upper[1:])).all()
    assert found.waypoints[0, 0] == 0.25 and found.waypoints[-1, 0] == 11.75


def test_maps_without_a_way_and_of_too_many_cells_are_refused():
    with pytest.raises(CorridorError, match="none of 20 random maps has a way"):
        boxes(SHAPE | {"occupied": 0.9, "clearance": 1.0}, 3, np.random.default_rng(0))
    with pytest.raises(CorridorError, match="cells is too large"):
        boxes(SHAPE | {"extent": 1e4}, 3, np.random.default_rng(0))

"""Plans through maps: free over all time, near the distance that is said, and refused with the place and the amount."""

import numpy as np
import pytest
from octree_files import octree_file, put

import minsnap
from minsnap.errors import CorridorError, InfeasibleError, WaypointError
from minsnap.paths.routes import GridMap, plan_through

CELLS = np.zeros((100, 80), dtype=np.uint8)
CELLS[30:33, :55] = CELLS[60:63, 25:] = CELLS[45:48, 40:60] = 1
START, GOAL = (1.0, 1.0), (9.0, 7.0)


def distance_of_samples(route, count=20_001):
    """Least distance of many samples to any occupied cell, by brute force."""
    grid = route.grid
    points = route(np.linspace(0.0, route.duration, count))[:, : grid.dim]
    best = np.inf
    for cell in np.argwhere(grid.occupied):
        low = grid.lower + grid.resolution * cell
        apart = np.maximum(np.maximum(low - points, points - low - grid.resolution), 0.0)
        best = min(best, np.sqrt((apart**2).sum(axis=1)).min())
    return best


@pytest.fixture(scope="module")
def route():
    return plan_through(CELLS, START, GOAL, clearance=0.3, resolution=0.1)


def test_a_route_leads_from_start_to_goal_and_keeps_its_clearance(route):
    assert np.allclose(route(0.0), START) and np.allclose(route(route.duration), GOAL)
    assert route.distance >= 0.3 - 1e-9
    assert distance_of_samples(route) == pytest.approx(route.distance, abs=1e-6)
    assert minsnap.certify(route.trajectory, corridor=route.corridor, limits=route.limits).ok


def test_where_it_is_nearest_is_said(route):
    low = route.grid.resolution * np.array(route.approach.cell)
    place = route(route.approach.instant)
    apart = np.maximum(np.maximum(low - place, place - low - 0.1), 0.0)
    assert np.linalg.norm(apart) == pytest.approx(route.distance, abs=1e-9)
    assert route.approach.lower <= route.distance <= route.approach.lower + 2e-9


def test_a_route_is_a_path(route, tmp_path):
    minsnap.write_csv(route, tmp_path / "route.csv")
    assert minsnap.read_csv(tmp_path / "route.csv").position[0] == pytest.approx([1.0, 1.0, 0.0])
    assert minsnap.certify(route, corridor=route.corridor, limits=route.limits).ok


def test_altitudes_above_a_plane_map_are_flown():
    found = plan_through(CELLS, (*START, 1.0), (*GOAL, 2.0), clearance=0.3, resolution=0.1, total_time=20.0)
    assert found.dim == 3 and found(found.duration)[2] == pytest.approx(2.0)
    assert distance_of_samples(found, 4001) == pytest.approx(found.distance, abs=1e-4)
    assert found.limits is None and found.duration == pytest.approx(20.0)


def test_walls_in_space_are_passed_above_unless_altitudes_forbid_it():
    cells = np.zeros((40, 20, 30), dtype=bool)
    cells[18:22, :, :15] = True
    cells[18:22, :4, :] = False
    over = plan_through(cells, (0.5, 1.5, 0.8), (3.5, 1.5, 0.8), clearance=0.15, resolution=0.1)
    around = plan_through(cells, (0.5, 1.5, 0.8), (3.5, 1.5, 0.8), clearance=0.15, resolution=0.1, altitudes=(0, 1.5))
    assert over(np.linspace(0, over.duration, 500))[:, 2].max() > 1.6
    assert around(np.linspace(0, around.duration, 500))[:, 2].max() <= 1.5 + 1e-9
    assert min(over.distance, around.distance) >= 0.15 - 1e-9


def test_what_is_above_and_below_the_altitudes_is_kept_away_from():
    cells = np.zeros((40, 20, 30), dtype=bool)
    cells[10:30, :, 8] = True  # a table, whose top is at 0.9 m
    ends = (0.5, 1.0, 1.05), (3.5, 1.0, 1.05)
    found = plan_through(cells, *ends, clearance=0.4, resolution=0.1, altitudes=(1.0, np.inf), total_time=20.0)
    assert 0.4 - 1e-9 <= found.distance < 1.0
    with pytest.raises(InfeasibleError, match="too narrow") as refused:
        plan_through(cells, *ends, clearance=0.4, resolution=0.1, altitudes=(1.0, 1.2))
    assert refused.value.verify() and refused.value.smallest_width == pytest.approx(0.2)
    with pytest.raises(WaypointError, match="outside the altitudes"):
        plan_through(cells, *ends, clearance=0.4, resolution=0.1, altitudes=(1.2, 2.0))


def test_origin_and_sides_of_cells_are_those_of_the_world():
    grid = GridMap(CELLS.astype(bool), (0.1, 0.2), (-5.0, 2.0))
    found = plan_through(grid, (-4.0, 4.0), (4.0, 16.0), clearance=0.25)
    assert np.allclose(found(found.duration), (4.0, 16.0)) and found.distance >= 0.25 - 1e-9


def test_an_empty_map_is_flown_straight():
    found = plan_through(np.zeros((50, 50)), (1, 1), (4, 4), resolution=0.1)
    assert found.distance == np.inf and len(found.corridor) == 1


def test_the_widest_way_is_named_where_it_is_too_narrow():
    cells = np.zeros((40, 40), dtype=int)
    cells[20, :18] = cells[20, 25:] = 1
    with pytest.raises(
        InfeasibleError, match=r"at \((1.95|2.05), 2.15\) m, cell \((19|20), 21\), 0.1 m too narrow"
    ) as caught:
        plan_through(cells, (0.5, 0.5), (3.5, 3.5), clearance=0.4, resolution=0.1)
    assert caught.value.smallest_width == pytest.approx(0.3)
    passing = plan_through(cells, (0.5, 0.5), (3.5, 3.5), clearance=caught.value.smallest_width, resolution=0.1)
    assert passing.distance >= 0.3 - 1e-9


def test_the_narrowest_place_is_the_hole_and_not_where_the_way_passes_along_a_wall():
    cells = np.zeros((60, 60), dtype=bool)
    cells[30] = True
    cells[30, 40:45] = False
    with pytest.raises(InfeasibleError, match=r"0.2 m on each side at \((2.95|3.05), 4.25\) m") as caught:
        plan_through(cells, (1.0, 0.6), (5.0, 0.6), clearance=0.35, resolution=0.1)
    assert caught.value.smallest_width == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"start": (1, 9)}, WaypointError, r"start \(1, 9\) m is outside .* y from 0 to 8 m, 100 x 80 cells"),
        ({"goal": (7, 9)}, WaypointError, "the first axis of the array is x; if its rows are y, transpose it"),
        ({"start": (3.1, 1)}, WaypointError, r"start \(3.1, 1\) m, cell \(31, 10\), is in an occupied cell"),
        (
            {"start": (2.85, 1)},
            WaypointError,
            r"is 0.15 m from the occupied cell at \(3.05, (0.95|1.05)\) m, cell \(30, (9|10)\)",
        ),
        (
            {"start": (2.72, 1), "clearance": 0.25},
            WaypointError,
            "leave 0.1 m, a cell, more than the clearance of 0.25",
        ),
        ({"goal": START}, WaypointError, "start and goal are one point"),
        ({"goal": (1, 2, 3, 4)}, WaypointError, "give two coordinates, or three"),
        ({"resolution": None}, CorridorError, "does not say how large its cells are"),
        ({"clearance": -1}, CorridorError, "the clearance is -1"),
        ({"unknown": "maybe"}, CorridorError, "unknown cells count as 'occupied' or 'free'"),
        ({"altitudes": (0, 1)}, CorridorError, "is plane"),
        ({"grid": CELLS[:, :, None], "altitudes": (np.nan, 1)}, CorridorError, "give two numbers"),
        ({"grid": CELLS[:, :, None], "altitudes": (2, 1)}, CorridorError, "the lower one first"),
        ({"grid": CELLS[:, :, None], "altitudes": (2, 3)}, CorridorError, "2 to 3 m are not in the map"),
    ],
)
def test_what_cannot_be_flown_is_refused_in_metres_and_cells(arguments, error, message):
    asked = {"grid": CELLS, "start": START, "goal": GOAL, "resolution": 0.1, "clearance": 0.3, "total_time": 20.0}
    with pytest.raises(error, match=message):
        plan_through(**asked | arguments)


def test_a_large_map_in_space_is_crossed():
    draw, cells = np.random.default_rng(0), np.zeros((200, 200, 40), dtype=bool)
    for x, y in draw.integers(0, 190, (60, 2)):
        cells[x : x + 8, y : y + 8, : draw.integers(10, 40)] = True
    cells[:, :, 0] = True
    found = plan_through(cells, (0.5, 0.5, 1.0), (19.0, 19.5, 1.0), clearance=0.35, resolution=0.1, total_time=30.0)
    assert found.distance >= 0.35 - 1e-9


def test_the_figure_has_the_cells_the_path_and_where_it_is_nearest(route):
    figure = minsnap.plot.plot_route(route, title="map")
    plane = figure.subfigs[0].axes[0]
    assert "m from what is occupied" in figure.get_suptitle() and len(plane.images) == 1
    shown = plane.images[0].get_array()
    assert (~np.ma.getmaskarray(shown)).sum() == CELLS.sum()
    nearest = next(line for line in plane.lines if line.get_label() == "nearest")
    assert np.linalg.norm(np.diff(nearest.get_xydata(), axis=0)) == pytest.approx(route.distance, abs=1e-8)


def test_a_closed_room_has_no_way_whatever_the_clearance():
    cells = np.zeros((30, 30))
    cells[15] = 1
    with pytest.raises(InfeasibleError, match="occupied cells close it off"):
        plan_through(cells, (0.5, 0.5), (2.5, 2.5), clearance=0.1, resolution=0.1)


WALLED = np.zeros((30, 20))
WALLED[15], WALLED[15, 12:16] = 1.0, -1.0  # a wall, with a part of which nothing is known

OPEN_ABOVE, LOW = np.array([1.0] * 9 + [0.0] * 6), {"altitudes": (0.0, 0.5)}


@pytest.mark.parametrize(
    ("cells", "asked", "says", "never"),
    [
        (WALLED != 0, {}, r"ways end at \(1.45, 0.55\) m, 1.05 m from the goal$", "unknown"),
        (WALLED, {}, r'1.05 m from the goal; unknown cells are among them: unknown="free" \(--unknown free\)', "altit"),
        (np.where(WALLED < 0.0, 1.0, WALLED), {}, "from the goal$", "unknown"),
        (abs(WALLED)[:, :, None] * OPEN_ABOVE, LOW, "; other altitudes leave a way$", "unknown"),
        (WALLED[:, :, None] * OPEN_ABOVE, LOW, "unknown cells are among them", "altitudes"),
    ],
)  # fmt: skip
def test_what_is_closed_off_names_the_nearest_place_and_what_would_open_it(cells, asked, says, never):
    """Unknown cells were to be checked where there are none, and nothing said where ways end."""
    ends = [(0.5, 0.55, 0.25)[: cells.ndim], (2.5, 0.55, 0.25)[: cells.ndim]]
    with pytest.raises(InfeasibleError, match=says) as refused:
        plan_through(cells, *ends, clearance=0.05, resolution=0.1, **asked)
    assert never not in str(refused.value) and refused.value.verify()
    if "unknown cells" in says:
        assert plan_through(cells, *ends, clearance=0.05, resolution=0.1, unknown="free", **asked).distance >= 0.05


@pytest.mark.parametrize("name", ["array", "picture", "octree"])
def test_a_goal_in_unknown_cells_is_told_from_one_in_occupied_cells(tmp_path, name):
    if name == "array":
        cells, how = np.where(np.arange(400).reshape(20, 20) % 20 > 9, -1, 0).astype(np.int8), {"resolution": 0.1}
        cells[3, 3] = 1
    elif name == "picture":
        lines = [("128 " * 20 if row < 10 else "254 " * 20) for row in range(20)]
        lines[16] = "254 254 254 0 " + "254 " * 16
        (tmp_path / "map.pgm").write_text("P2 20 20 255\n" + "\n".join(lines))
        (tmp_path / "map.yaml").write_text("image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n")
        cells, how = tmp_path / "map.yaml", {}
    else:
        tree = {}
        for i, j, k in np.ndindex(8, 4, 4):
            put(tree, [(1 << 15) + i, (1 << 15) + j, (1 << 15) + k], 16, 1.0 if i == j == k == 3 else -1.0)
        (tmp_path / "map.bt").write_bytes(octree_file(tree, True, 0.1))
        cells, how = tmp_path / "map.bt", {}
    up = (0.25,) * (name == "octree")
    free, taken, unknown = (0.25, 0.25, *up), (0.35, 0.35, *(0.35 for _ in up)), (0.25, 1.55, *up)
    with pytest.raises(
        WaypointError, match=r"goal .* is in an unknown cell.*: move it; unknown=\"free\" \(--unknown free\)"
    ):
        plan_through(cells, free, unknown, clearance=0.0, **how)
    with pytest.raises(WaypointError, match="is in an occupied cell: move it to a free one$"):
        plan_through(cells, free, taken, clearance=0.0, **how)


@pytest.mark.parametrize("dim", [2, 3])
def test_points_that_are_not_finite_are_named(dim):
    cloud = np.full((50, dim), 9.0)
    cloud[17, 1], cloud[30, 0] = np.nan, 1e300
    with pytest.raises(
        CorridorError, match=r"point 17 of what is around the path is \(9, nan.*, and 1 more are like it"
    ):
        plan_through(cloud, (0, 0, 1)[:dim], (5, 0, 1)[:dim])
    with pytest.raises(CorridorError, match="point 17 of"):
        minsnap.routes.corridor(cloud, [(0, 0, 1)[:dim], (5, 0, 1)[:dim]])
    with pytest.raises(CorridorError, match=r"point 1 of the polygon of a prism is \(nan, 0\): give finite"):
        minsnap.Prism([(0, 0), (np.nan, 0), (1, 1)])


@pytest.mark.parametrize("far", [1e6, 1e7])
@pytest.mark.parametrize("around", ["points", "cells"])
def test_far_from_the_origin_a_flight_is_measured_to_its_rounding(far, around):
    """Arcs were halved without an end: bound and distance never agreed to a nanometre."""
    if around == "points":
        route = plan_through([(far + 5.0, far, far + 1.0)], (far, far, far + 1.0), (far + 10.0, far, far + 1.0))
        apart = np.linalg.norm(
            route(np.linspace(0.0, route.duration, 20_001)) - (far + 5.0, far, far + 1.0), axis=1
        ).min()
    else:
        route = plan_through(CELLS, *(np.add(end, far) for end in (START, GOAL)), resolution=0.1, origin=(far, far))
        apart = distance_of_samples(route, 4001)
    assert route.distance == pytest.approx(apart, abs=max(1e-5, 1e-13 * far)) and route.distance >= 0.3 - 1e-13 * far


def test_points_far_beyond_all_others_are_kept_away_from_and_disturb_nothing():
    """Their cells were more than an integer holds."""
    route = plan_through([(1e30, 0.0, 1.0), (5.0, 0.0, 1.0)], (0.0, 0.0, 1.0), (10.0, 0.0, 1.0))
    assert route.duration == plan_through([(5.0, 0.0, 1.0)], (0.0, 0.0, 1.0), (10.0, 0.0, 1.0)).duration


def trunk_distance(route, trunks, radius):
    place = route(np.linspace(0.0, route.duration, 8001))[:, :2]
    return min(np.hypot(*(place - center).T).min() for center in trunks) - radius


@pytest.mark.slow
@pytest.mark.parametrize("dim", [2, 3])
def test_obstacles_and_points_are_routed_around_as_maps_are(dim):
    rng = np.random.default_rng(2)
    trunks = [c for c in rng.uniform((1, -5), (19, 5), (40, 2)) if abs(c[0] - 10) < 8]
    start, goal = (0, 0, 1)[:dim], (20, 0, 1)[:dim]
    around = [minsnap.Cylinder(center, 0.4) for center in trunks]
    limits = minsnap.Limits(speed=4, acceleration=6)
    route = plan_through(around, start, goal, clearance=0.3, limits=limits, pieces="auto")
    assert route.distance == pytest.approx(trunk_distance(route, trunks, 0.4), abs=1e-4) and route.distance >= 0.3
    assert minsnap.certify(route.trajectory, corridor=route.corridor, limits=limits).ok
    assert route.duration <= 1.1 * (20 / 4 + 4 / 6)
    points = np.array([c for c in trunks])[:, None] + 0.4 * np.stack([np.cos(np.arange(24)), np.sin(np.arange(24))], -1)
    cloud = points.reshape(-1, 2)
    if dim == 3:
        cloud = np.concatenate([np.column_stack((cloud, np.full(len(cloud), z))) for z in np.arange(0.0, 2.1, 0.25)])
    found = plan_through(cloud, start, goal, clearance=0.3, limits=limits, pieces="auto")
    sampled = found(np.linspace(0.0, found.duration, 2001))
    apart = np.sqrt(((sampled[:, None] - cloud[None]) ** 2).sum(axis=2)).min()
    assert found.distance == pytest.approx(apart, abs=1e-3) and found.distance >= 0.3


@pytest.mark.parametrize(
    ("around", "start", "more", "error", "words"),
    [
        ([minsnap.Cylinder((1, 1), 0.5)], (1.2, 1.0), {}, WaypointError, "is 0.3 m inside obstacle 0"),
        ([(1.0, 1.0), (3.0, 3.0)], (1.2, 1.0), {}, WaypointError, "is 0.2 m from point 0"),
        ([(1.0, 1.0), (3.0, 3.0)], (0.0, 1.0), {"altitudes": (0, 1)}, CorridorError, "altitudes is for maps"),
    ],
)
def test_what_cannot_be_around_obstacles_is_said_in_a_sentence(around, start, more, error, words):
    with pytest.raises(error, match=words):
        plan_through(around, start, (9.0, 7.0), clearance=0.3, **more)


def test_what_encloses_the_goal_leaves_no_way():
    ring = [minsnap.Cylinder((9 + 1.5 * np.cos(a), 7 + 1.5 * np.sin(a)), 0.3) for a in np.linspace(0, 6.1, 30)]
    with pytest.raises(minsnap.UnprovedError, match="no way from .* with a clearance of 0.2 m"):
        plan_through(ring, (1.0, 1.0), (9.0, 7.0), clearance=0.2)


def test_nothing_around_and_ways_that_are_too_narrow_are_said():
    walls = [minsnap.Cuboid((2, -50, -50), (3, -0.2, 50)), minsnap.Cuboid((2, 0.2, -50), (3, 50, 50))]
    with pytest.raises(InfeasibleError, match=r"the widest one has about 0.1\d* m on each side, near"):
        minsnap.routes.plan_through(walls, (0, 0), (5, 0), clearance=0.5)
    ring = [minsnap.Cuboid((-9, -9, -9), (9, -2, 9)), minsnap.Cuboid((-9, 2, -9), (9, 9, 9))]
    ring += [minsnap.Cuboid((-9, -9, -9), (-2, 9, 9)), minsnap.Cuboid((2, -9, -9), (3, 9, 9))]
    with pytest.raises(InfeasibleError, match=r"none was found without any clearance either: .* ways end at \(1.\d+, "):
        minsnap.routes.plan_through(ring, (0, 0), (5, 0), clearance=0.1)
    with pytest.raises(CorridorError, match="there is nothing around: give a map, obstacles"):
        minsnap.routes.plan_through([], (0, 0), (5, 0))
    assert (
        minsnap.routes.plan_through(np.zeros((0, 2)), (0, 0), (5, 0), limits=minsnap.Limits(speed=2)).distance == np.inf
    )

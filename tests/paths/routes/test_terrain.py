"""Ground from ESRI ASCII grids: its walls against dense samples of the bilinear surface, and grids that are none."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

import minsnap
from minsnap.errors import FileError, ShapeError, WaypointError
from minsnap.paths.routes import Terrain, read_terrain
from minsnap.paths.routes.terrain_walls import build_terrain_walls

HEAD = "ncols 3\nnrows 2\nxllcorner -5\nyllcorner 0.5\ncellsize 10\nNODATA_value -9999\n"


def hills(seed, count=60, side=10.0):
    random = np.random.default_rng(seed)
    heights = sum(random.uniform(-9, 9) * np.cos(random.uniform(0, 2, 2) @ grid(count) + k) for k in range(6))
    return Terrain(heights + 0.1 * random.standard_normal((count, count)), np.array([-50.0, 20.0]), side, "hills")


def grid(count):
    return np.stack(np.meshgrid(*2 * [np.arange(count) / 6], indexing="ij")).transpose(1, 0, 2)


def surface(ground):
    axes = [ground.middle[i] + ground.side * np.arange(ground.heights.shape[i]) for i in range(2)]
    return RegularGridInterpolator(axes, ground.heights)


def test_a_grid_has_its_last_row_at_the_corner(tmp_path):
    (tmp_path / "g.asc").write_text(HEAD + "1 2 3\n4 5.5 -9999\n")
    found = read_terrain(tmp_path / "g.asc")
    assert np.array_equal(found.heights, [[4, 1], [5.5, 2], [np.nan, 3]], equal_nan=True)
    assert found.middle == pytest.approx([0.0, 5.5]) and found.side == 10.0
    (tmp_path / "c.asc").write_text(HEAD.upper().replace("CORNER", "CENTER") + "1 2 3 4 5.5 -9999")
    assert read_terrain(tmp_path / "c.asc").middle == pytest.approx([-5.0, 0.5])


@pytest.mark.parametrize("shape", [(2,), (40, 2), (5, 4, 2)])
def test_the_ground_is_bilinear_between_its_heights(shape):
    ground, random = hills(3), np.random.default_rng(3)
    places = random.uniform(*ground.reach, shape)
    assert ground.at(places) == pytest.approx(surface(ground)(places).reshape(shape[:-1]), abs=1e-12)
    for corner in (0, 1):
        assert ground.at(ground.reach[corner]) == pytest.approx(ground.heights[-corner, -corner])


def test_ground_that_is_not_known_is_refused_with_where(tmp_path):
    (tmp_path / "g.asc").write_text(HEAD + "1 2 3\n4 5.5 -9999\n")
    found = read_terrain(tmp_path / "g.asc")
    with pytest.raises(ShapeError, match=r"\(99, 6\) m is beyond .* x from 0 to 20 m, y from 5.5 to 15.5 m"):
        found.at([(1, 6), (99, 6)])
    with pytest.raises(ShapeError, match=r"is not known at \(18, 6\) m"):
        found.at((18, 6))
    with pytest.raises(ShapeError, match="give x and y of each"):
        found.at((1, 2, 3))


@pytest.mark.parametrize("seed", range(6))
def test_every_point_of_a_polytope_has_its_height(seed):
    ground, random = hills(seed), np.random.default_rng(seed)
    level = surface(ground)
    points = np.column_stack((random.uniform([10, 80], [480, 550], (4, 2)), random.uniform(90, 130, 4)))
    walls = build_terrain_walls(ground, points, 30.0, 220.0)
    touched = 0
    for (a, b), (rows, ends) in zip(zip(points[:-1], points[1:], strict=True), walls.half_spaces, strict=True):
        places = np.linspace(a, b, 200)[:, None] + np.append(
            random.uniform(-28, 28, (60, 2)), np.zeros((60, 1)), axis=1
        )
        places[..., 2] = level(places[..., :2]) + random.choice([29.999, 220.001], places.shape[:2])
        assert not (places @ rows.T <= ends).all(axis=-1).any()
        assert (np.linspace(a, b, 9) @ rows.T < ends).all()
        places[..., 2] = level(places[..., :2]) + 45.0
        touched += (places @ rows.T <= ends).all(axis=-1).sum()
    assert touched > 0


def test_a_plan_is_certified_above_the_ground():
    ground = hills(9)
    points = [(20.0, 100.0, 70.0), (250.0, 300.0, 75.0), (450.0, 200.0, 70.0)]
    walls = build_terrain_walls(ground, np.array(points), 30.0)
    curve = minsnap.plan(points, corridor=walls, total_time=60.0)
    assert minsnap.certify(curve, corridor=walls).ok
    flown = curve(np.linspace(0.0, 60.0, 4000))
    assert (flown[:, 2] - surface(ground)(flown[:, :2])).min() >= 30.0


def test_a_vertical_leg_has_walls_too():
    ground, points = hills(2), np.array([(200.0, 300.0, 90.0), (200.0, 300.0, 140.0)])
    ((rows, ends),) = build_terrain_walls(ground, points, 30.0, 200.0).half_spaces
    assert (points @ rows.T < ends).all()
    beside = np.array([(200.0, 300.0), (215.0, 290.0)])
    for height in (29.999, 200.001):
        tops = np.column_stack((beside, surface(ground)(beside) + height))
        assert not (tops @ rows.T <= ends).all(axis=1).any()


@pytest.mark.parametrize(
    ("points", "heights", "message"),
    [
        ([(20, 100, 20), (250, 300, 75)], (30, None), r"leg 0 is .* m above the ground at .* raise it by more than"),
        ([(20, 100, 75), (250, 300, 75)], (30, 60), r"leg 0 is .* and at most 60 m are asked for: lower it"),
        ([(20, 100, 75), (250, 300, 75), (900, 300, 75)], (30, None), "leg 1 and 20 m around it lead beyond"),
        ([(1e300, 100, 75), (250, 300, 75)], (30, None), "leg 0 and 20 m around it lead beyond the heights"),
    ],
)
def test_a_leg_that_cannot_be_is_refused(points, heights, message):
    with pytest.raises(WaypointError, match=message):
        build_terrain_walls(hills(1), np.array(points, dtype=float), *heights)


def test_unknown_ground_is_refused_where_a_leg_passes_it():
    ground = hills(3)
    ground.heights[20, 20] = np.nan
    with pytest.raises(WaypointError, match=r"leg 0 leads over ground of unknown height, such as at \(150, 220\) m"):
        build_terrain_walls(ground, np.array([(100.0, 230.0, 90.0), (300.0, 230.0, 90.0)]), 30.0)
    assert len(build_terrain_walls(ground, np.array([(100.0, 300.0, 90.0), (300.0, 300.0, 90.0)]), 30.0)) == 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is no ESRI ASCII grid: it has no ncols and no nrows and no cellsize"),
        (HEAD + "1 2 3\n4 5\n", "has 5 heights where its header says 2 x 3"),
        (HEAD.replace("xllcorner -5\n", "") + "1 2 3 4 5 6", "does not say where it lies"),
        (HEAD.replace("10", "-1") + "1 2 3 4 5 6", "cellsize is -1"),
        (HEAD + "1 2 3\n4 x 6\n", "is not an ESRI ASCII grid of heights"),
        (HEAD + HEAD + "1 2 3 4 5 6", "two entries ncols"),
    ],
)
def test_what_is_no_grid_says_why(tmp_path, text, message):
    (tmp_path / "g.asc").write_text(text)
    with pytest.raises(FileError, match=message):
        read_terrain(tmp_path / "g.asc")

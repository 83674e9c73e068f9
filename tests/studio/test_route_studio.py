"""The page of a route: cells as faces, larger ones where they are many, obstacles and points; what it tells."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import minsnap
from minsnap.errors import InputError
from minsnap.paths.routes import GridMap
from minsnap.plot.map_cells import near_cells, surface
from minsnap.studio import RouteStudio, show
from minsnap.studio.map_view import in_space
from minsnap.studio.route_studio import facts

pytest.importorskip("viser")


def area(faces):
    """Return the sum of the areas of faces, shape (n, 4, 3)."""
    return np.linalg.norm(np.cross(faces[:, 1] - faces[:, 0], faces[:, 3] - faces[:, 0]), axis=1).sum()


@pytest.mark.parametrize("shape", [(7, 6, 5), (9, 8, 1), (1, 1, 1)])
def test_faces_are_those_between_taken_cells_and_others(shape):
    taken = np.random.default_rng(0).random(shape) < 0.4
    faces, size = surface(taken)
    around = np.pad(taken, 1)
    free = [taken & ~np.roll(around, step, axis)[1:-1, 1:-1, 1:-1] for axis in range(3) for step in (1, -1)]
    assert size == 1 and area(faces) == pytest.approx(np.sum(free))
    assert np.ptp(faces, axis=1).min(axis=1).max(initial=0.0) == 0.0


def test_many_cells_are_drawn_as_fewer_that_cover_them():
    taken = np.random.default_rng(1).random((60, 50, 11)) < 0.05
    faces, size = surface(taken, 2000)
    assert size > 1 and 0 < len(faces) <= 2000
    assert (faces.min(axis=(0, 1)) <= np.argwhere(taken).min(axis=0)).all()
    assert (faces.max(axis=(0, 1)) >= np.argwhere(taken).max(axis=0) + 1).all()
    flat = np.random.default_rng(2).random((300, 300, 1)) < 0.5
    assert surface(flat, 2000)[0][..., 2].max() <= surface(flat, 2000)[1]


def test_a_ceiling_does_not_hide_the_flight():
    cells = np.zeros((20, 20, 10), dtype=bool)
    cells[:, :, -1] = cells[:, :, 0] = True
    places = np.array([[0.5, 0.5, 0.4], [1.5, 1.5, 0.5]])
    taken, side, corner = near_cells(GridMap(cells, 0.1), places, 0.2)
    assert taken.shape == (20, 20, 7) and taken[:, :, 0].all() and not taken[:, :, 1:].any()
    assert side == pytest.approx([0.1] * 3) and corner == pytest.approx([0.0] * 3)


@pytest.fixture(scope="module")
def routes():
    cells = np.zeros((100, 80), dtype=bool)
    cells[50, :60] = True
    posts = [minsnap.Cylinder((2, 0.1), 0.5), minsnap.Cuboid((3.5, -1, 0), (4, -0.2, 2))]
    fence = minsnap.Prism([(-1, -2), (7, -2), (7, 2), (-1, 2)], inclusion=True)
    points = np.random.default_rng(3).uniform((2, -1, 0), (4, 0.2, 2), (80, 3))
    through = minsnap.routes.plan_through
    return [
        through(cells, (1, 1), (9, 7), clearance=0.3, resolution=0.1),
        through(cells, (1, 1, 1), (9, 7, 1), clearance=0.3, resolution=0.1),
        through([*posts, fence], (0, 0, 1), (6, 0, 1), clearance=0.3),
        through(points, (0, 0, 1), (6, 0, 1), clearance=0.3),
    ]


@pytest.mark.parametrize("which", range(4))
def test_a_route_is_shown_with_its_surroundings_and_flown(routes, which):
    route = routes[which]
    page = show(route, browser=False, block=False)
    assert isinstance(page, RouteStudio) and page.certificate.ok
    drawn = {handle.name for handle in page._server.scene._handle_from_node_name.values()}
    around = ["/map/cells", "/map/cells", "/map/obstacles", "/map/points"][which]
    assert around in drawn and "/plan/polytope/0" in drawn and ("/map/fence/0" in drawn) == (which == 2)
    page.seek(0.5 * route.duration)
    assert page._vehicle._frame.position == pytest.approx(in_space(route.trajectory)(0.5 * route.duration), abs=0.02)
    assert dict(facts(route, page.certificate))["obstacle distance"] == f"{route.distance:.3f} m"
    page.darken()
    page.close()


def test_a_plane_route_is_the_same_at_one_height(routes):
    plane = routes[0].trajectory
    t = np.linspace(0.0, plane.duration, 50)
    for order in range(4):
        assert in_space(plane)(t, order)[:, :2] == pytest.approx(plane(t, order))
    assert in_space(plane)(t)[:, 2] == pytest.approx(np.full(50, 0.5))
    assert in_space(routes[1].trajectory) is routes[1].trajectory


def test_what_is_no_route_is_refused():
    with pytest.raises(InputError, match="a Trajectory, a Fleet or a Route"):
        show(minsnap.circle(), browser=False, block=False)


@pytest.mark.slow
def test_the_command_opens_the_page_of_its_route(tmp_path):
    cells = np.zeros((100, 80), dtype=bool)
    cells[50, :60] = True
    np.save(tmp_path / "map.npy", cells)
    way = ["--start", "-4", "-3", "--goal", "4", "3", "--resolution", "0.1", "--origin", "-5", "-4"]
    command = [sys.executable, "-m", "minsnap", "route", "map.npy", *way, "-o", "route.csv", "--studio"]
    known = os.environ | {"BROWSER": "true", "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(command, cwd=tmp_path, env=known, stdout=subprocess.PIPE, text=True)
    said = next(line for line in process.stdout if line.startswith("studio: "))
    assert "http://127.0.0.1:" in said and Path(tmp_path / "route.csv").is_file()
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode == 0

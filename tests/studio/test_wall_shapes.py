"""Walls as triangles, against the bodies of the figures and against the walls themselves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from minsnap.corridors.tubes import Tube
from minsnap.studio.wall_view import box_edges, box_surface, face_centres, tube_prism

COORDINATES = st.tuples(*[st.floats(-5.0, 5.0)] * 3)
BOX = ((0.0, -1.0, 2.0), (1.0, 3.0, 7.0))


@given(COORDINATES, COORDINATES, st.floats(0.05, 2.0))
def test_the_sides_of_a_prism_surround_it_and_do_not_close_its_ends(start, end, width):
    length = np.linalg.norm(np.subtract(end, start))
    if length < 0.1:
        return
    vertices, faces = tube_prism(start, end, width)
    triangles = vertices[faces]
    areas = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1) / 2
    hull = ConvexHull(vertices)
    assert areas.sum() == pytest.approx(hull.area - 2.0 * hull.volume / length, rel=1e-6)


def test_corners_of_a_prism_touch_the_walls_of_the_tube():
    start, end = np.array([0.0, 0.0, 1.0]), np.array([3.0, 2.0, 1.5])
    walls = Tube(np.array(0.3)).walls(np.array([start, end]))[0]
    for vertex in tube_prism(start, end, 0.3)[0]:
        offsets = np.abs(np.sum(walls.slope * (vertex - walls.anchor), axis=1))
        assert offsets.max() == pytest.approx(0.3)


@pytest.mark.parametrize("length", [1e-30, 1.0, 1e6, 1e20, 1e40])
def test_a_prism_has_sides_at_any_length_and_width(length):
    """The hull of a very long or very thin one was not found, which was an error of the page."""
    vertices, faces = tube_prism((0.0, 0.0, 0.0), (length, 0.0, 0.0), 0.3)
    assert vertices.shape == (8, 3) and faces.shape == (8, 3)
    assert set(vertices[:, 0]) == {0.0, length} and np.abs(vertices[:, 1:]).max() == pytest.approx(0.3)


def test_a_box_has_its_corners_edges_and_face_centres():
    vertices, faces = box_surface(BOX)
    assert len(np.unique(vertices, axis=0)) == 8 and (vertices.min(axis=0), vertices.max(axis=0)) == (
        pytest.approx(BOX[0]),
        pytest.approx(BOX[1]),
    )
    triangles = vertices[faces]
    area = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1) / 2
    assert area.sum() == pytest.approx(2 * (1 * 4 + 1 * 5 + 4 * 5))
    lengths = np.linalg.norm(np.diff(box_edges(BOX), axis=1)[:, 0], axis=1)
    assert sorted(lengths) == pytest.approx([1.0] * 4 + [4.0] * 4 + [5.0] * 4)
    assert face_centres(BOX)[1, 0] == pytest.approx([0.5, -1.0, 4.5])

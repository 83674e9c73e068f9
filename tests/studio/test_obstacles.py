"""Obstacles that a page shows."""

import numpy as np
import pytest
from PIL import Image

from minsnap.errors import FileError, InputError
from minsnap.studio.ground_view import MOST_POINTS, cloud, floor, grid, read_obstacles
from minsnap.studio.wall_view import box_surface


def test_boxes_cover_exactly_the_occupied_cells():
    taken = np.random.default_rng(2).random((4, 3, 5)) < 0.4
    boxes = grid(taken, (0.5, 1.0, 2.0), (1.0, -1.0, 0.0)).boxes
    centers = np.stack(np.meshgrid(*(np.arange(n) + 0.5 for n in taken.shape), indexing="ij"), axis=-1)
    centers = np.array([1.0, -1.0, 0.0]) + centers * [0.5, 1.0, 2.0]
    inside = ((centers[..., None, :] > boxes[:, 0]) & (centers[..., None, :] < boxes[:, 1])).all(axis=-1).sum(axis=-1)
    assert np.array_equal(inside, taken.astype(int))
    assert np.prod(boxes[:, 1] - boxes[:, 0], axis=1).sum() == pytest.approx(taken.sum() * 0.5 * 1.0 * 2.0)


def test_a_surface_has_the_triangles_of_all_boxes():
    shown = grid(np.array([[1, 0], [0, 1]]), 1.0)
    vertices, faces = box_surface(shown.boxes)
    assert vertices.shape == (16, 3) and faces.shape == (24, 3) and faces.max() == 15
    assert vertices[:, 2].max() == 1.0


def test_large_clouds_are_thinned():
    assert len(cloud(np.zeros((2 * MOST_POINTS + 1, 3))).points) <= MOST_POINTS


def test_files_are_read(tmp_path):
    points = np.arange(12.0).reshape(4, 3)
    np.savez(tmp_path / "a.npz", points=points)
    (tmp_path / "b.csv").write_text("x,y,z\n0,1,2\n3,4,5\n")
    np.savez(tmp_path / "c.npz", occupancy=np.eye(3), resolution=0.5, origin=np.zeros(2))
    assert np.array_equal(read_obstacles(tmp_path / "a.npz").points, points)
    assert len(read_obstacles(tmp_path / "b.csv").points) == 2
    assert len(read_obstacles(tmp_path / "c.npz").boxes) == 3


def test_what_is_malformed_is_refused(tmp_path):
    np.savez(tmp_path / "a.npz", other=np.zeros(3))
    np.savez(tmp_path / "b.npz", occupancy=np.zeros((2, 2)), resolution=-1.0)
    np.save(tmp_path / "c.npy", np.array([{}], dtype=object), allow_pickle=True)
    for name in ("a.npz", "b.npz", "c.npy", "d.npz"):
        with pytest.raises(FileError):
            read_obstacles(tmp_path / name)
    for points in (np.zeros((2, 2)), np.full((2, 3), np.nan), np.zeros((0, 3))):
        with pytest.raises(InputError):
            cloud(points)


def test_a_map_is_a_floor_where_it_says(tmp_path):
    colours = np.arange(4 * 6 * 3, dtype=np.uint8).reshape(4, 6, 3)
    Image.fromarray(colours).save(tmp_path / "hall.png")
    (tmp_path / "hall.yaml").write_text("{image: hall.png, resolution: 0.5, origin: [-1, 2, 0]}")
    laid = read_obstacles(tmp_path / "hall.yaml").floor
    assert (laid.picture == colours).all() and laid.size == (3.0, 2.0) and laid.corner == (-1.0, 2.0)
    (tmp_path / "hall.yaml").write_text("{image: hall.yaml, resolution: 0.5, origin: [-1, 2, 0]}")
    for wrong in (tmp_path / "hall.yaml", tmp_path / "none.yaml"):
        with pytest.raises(FileError):
            read_obstacles(wrong)
    with pytest.raises(InputError, match="side of a pixel"):
        floor(tmp_path / "hall.png", 0.0, (0.0, 0.0))

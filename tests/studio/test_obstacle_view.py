"""A page plans around what it shows: obstacles of the document, and cells and points of files as boxes."""

import json

import numpy as np
import pytest

import minsnap
from minsnap import Cuboid, Cylinder
from minsnap.files.file_request import FileRequest
from minsnap.studio.documents import open_scene, save_as
from minsnap.studio.file_panel import as_python, facts, without_obstacles
from minsnap.studio.ground_view import Obstacles, cloud, grid
from minsnap.studio.obstacle_view import MOST_BOXES, avoiding, covered, merged, triangles
from minsnap.studio.workbench import BenchState, planned_in_stages

ACROSS = FileRequest(((0.0, 0.0, 1.0), (6.0, 0.0, 1.0)), total_time=6.0)
WALL = np.array([(3.0, y, z) for y in np.linspace(-1.0, 0.3, 14) for z in np.linspace(0.0, 2.0, 21)])


def final(request):
    """Return the last plan of a request."""
    return list(planned_in_stages(request, None, lambda: False))[-1]


def test_merged_cells_are_covered_exactly():
    taken = np.random.default_rng(2).random((5, 4, 6)) < 0.5
    boxes = merged(np.argwhere(taken))
    inside = np.zeros(taken.shape, dtype=int)
    for low, high in boxes.astype(int):
        inside[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] += 1
    assert (inside == taken).all() and len(boxes) < taken.sum()
    assert merged([(0, 0, 0), (0, 0, 1), (0, 1, 0), (0, 1, 1), (1, 0, 0)]).shape == (2, 2, 3)


@pytest.mark.parametrize("kind", ["a wall", "scattered", "cells", "one point"])
def test_few_boxes_cover_every_point_and_every_cell(kind):
    draw = np.random.default_rng(3)
    found = {
        "a wall": cloud(WALL),
        "scattered": cloud(draw.uniform(-5.0, 5.0, (3000, 3))),
        "cells": grid(draw.random((20, 20, 4)) < 0.1, 0.5, (-5.0, -5.0, 0.0)),
        "one point": cloud([(1.0, 2.0, 3.0)]),
    }[kind]
    boxes = covered(found)
    assert 1 <= len(boxes) <= MOST_BOXES
    points = np.concatenate((found.points, found.boxes.mean(axis=1), found.boxes.reshape(-1, 3)))
    slack = 1e-6 * (1.0 + np.abs(points).max())
    inside = (points[:, None] >= boxes[:, 0] - slack) & (points[:, None] <= boxes[:, 1] + slack)
    assert inside.all(axis=2).any(axis=1).all()
    assert len(covered(Obstacles())) == 0


def test_the_plan_keeps_its_room_from_every_point_that_is_shown():
    straight = final(ACROSS)
    scene = final(avoiding(cloud(WALL), 0.25)(ACROSS))
    apart = [
        np.linalg.norm(plan.trajectory(np.linspace(0.0, 6.0, 601))[:, None] - WALL, axis=2).min()
        for plan in (straight, scene)
    ]
    assert apart[0] < 0.1 and apart[1] >= 0.25
    assert scene.certificate.ok and scene.certificate.obstacle_margin >= -1e-9
    told = dict(facts(BenchState(scene.request, scene)))
    assert told["obstacle margin"].endswith(" m") and "obstacle margin" not in dict(facts(BenchState(ACROSS, straight)))
    assert without_obstacles(scene.request) == ACROSS
    once = avoiding(cloud(WALL), 0.25)(ACROSS)
    assert avoiding(cloud(WALL), 0.25)(once) == once


def test_obstacles_of_a_document_are_drawn_saved_and_opened_again(tmp_path):
    request = FileRequest(**vars(ACROSS) | {"avoid": (("cylinder", (3.0, 0.2, 0.4)), ("cuboid", (1, 1, 0, 2, 2, 2)))})
    vertices, faces = triangles(request.obstacles, np.array(request.waypoints))
    assert vertices[:, 0].min() == pytest.approx(1.0) and vertices[:, 0].max() == pytest.approx(3.4)
    assert faces.max() < len(vertices) and triangles((), np.array(ACROSS.waypoints))[1].shape == (0, 3)
    plan = final(request)
    state = BenchState(request, plan)
    for kind, name in (("plan (JSON)", "a.json"), ("request (YAML)", "a.yaml")):
        save_as(kind, state, tmp_path / name)
        again = open_scene(tmp_path / name)
        assert [each.numbers().tolist() for each in again.obstacles] == [
            each.numbers().tolist() for each in request.obstacles
        ]
    assert json.loads((tmp_path / "a.json").read_text())["avoid"][0] == {"cylinder": [3.0, 0.2, 0.4]}
    made = {}
    exec(as_python(request), made)
    assert minsnap.certify(made["trajectory"], avoid=[Cylinder((3.0, 0.2), 0.4), Cuboid((1, 1, 0), (2, 2, 2))]).ok

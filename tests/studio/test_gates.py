"""Gates of a scene: edits keep them at their waypoints, files and Python hold them, courses with gates are opened."""

import asyncio
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import minsnap
from minsnap.errors import FileError, WaypointError
from minsnap.files.request_yaml import read_request, write_request
from minsnap.studio import Studio, documents, edits
from minsnap.studio.edit_panels import gate_with_room
from minsnap.studio.file_panel import as_python
from minsnap.vehicle import named_vehicle

POINTS = ((0.0, 0.0, 1.0), (4.0, 0.0, 1.5), (4.0, 4.0, 1.0), (0.0, 4.0, 1.0))
SCENE = edits.with_gate(documents.FileRequest(POINTS, total_time=6.0), 1, True)


def gate_of(request, index=1):
    return request.places[index]


def test_a_new_gate_stands_across_the_way_and_is_flown_through():
    gate = gate_of(SCENE)
    assert gate.normal == pytest.approx(np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)) and gate.crossing == 1
    assert np.linalg.norm(np.diff(gate.corners, axis=0), axis=1) == pytest.approx([1.0] * 3)
    curve = minsnap.plan(**SCENE.request().arguments())
    assert minsnap.certify(curve, waypoints=SCENE.places).ok
    assert abs(curve(curve.leg_breaks[1]) - POINTS[1]).max() > 0.05
    assert edits.with_gate(SCENE, 1, False).openings == ()


def test_a_gate_of_the_page_has_room_for_the_vehicle():
    """It was grazed: the margin was 0."""
    for vehicle in (None, "crazyflie", "px4_sih"):
        scene = gate_with_room(documents.FileRequest(POINTS, total_time=6.0, vehicle=vehicle), 1, True)
        arm = named_vehicle(vehicle or "dji_f330").arm_length
        assert arm <= gate_of(scene).margin < arm + 0.051
        assert minsnap.certify(minsnap.plan(**scene.request().arguments()), waypoints=scene.places).ok


def test_gates_stay_at_their_waypoints_in_every_edit():
    moved = edits.move_waypoint(SCENE, 1, (5.0, 1.0, 2.0))
    assert gate_of(moved).center == pytest.approx([5.0, 1.0, 2.0])
    assert gate_of(edits.insert_waypoint(SCENE, 0), 2).center == pytest.approx(POINTS[1])
    assert gate_of(edits.insert_waypoint(SCENE, 1)).center == pytest.approx(POINTS[1])
    assert gate_of(edits.delete_waypoint(SCENE, 0), 0).center == pytest.approx(POINTS[1])
    assert edits.delete_waypoint(SCENE, 1).openings == ()
    assert gate_of(edits.move_in_order(SCENE, 1, 1), 2).center == pytest.approx(POINTS[1])


def test_a_gate_is_turned_and_sized_about_its_center():
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = gate_of(edits.reshape_gate(SCENE, 1, turn))
    assert turned.normal == pytest.approx(turn @ gate_of(SCENE).normal)
    larger = gate_of(edits.resize_gate(SCENE, 1, (2.0, 0.5)))
    assert larger.center == pytest.approx(POINTS[1])
    assert np.linalg.norm(np.diff(larger.corners, axis=0), axis=1) == pytest.approx([2.0, 0.5, 2.0])


@pytest.mark.parametrize("roll", [-0.7, 0.5, 1.2])
def test_a_rolled_gate_is_sized_along_its_sides(roll):
    x, y, z = gate_of(SCENE).normal
    about = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rolled = edits.reshape_gate(SCENE, 1, np.eye(3) + np.sin(roll) * about + (1.0 - np.cos(roll)) * about @ about)
    assert edits.size_of(gate_of(rolled).corners) == pytest.approx([1.0, 1.0])
    larger = gate_of(edits.resize_gate(rolled, 1, (2.0, 0.5))).corners
    sides = np.diff(larger, axis=0)
    assert sorted(np.linalg.norm(sides[:2], axis=1)) == pytest.approx([0.5, 2.0])
    assert sides[0] @ sides[1] == pytest.approx(0.0, abs=1e-12)


def test_files_and_python_hold_gates_exactly(tmp_path):
    write_request(SCENE, tmp_path / "a.yaml")
    assert read_request(tmp_path / "a.yaml") == documents.open_scene(tmp_path / "a.yaml") == SCENE
    made = {}
    exec(as_python(SCENE), made)  # noqa: S102
    assert (made["trajectory"].control_points == minsnap.plan(**SCENE.request().arguments()).control_points).all()
    (tmp_path / "b.yaml").write_text((tmp_path / "a.yaml").read_text().replace("waypoint: 1", "waypoint: 7"))
    with pytest.raises(WaypointError, match="waypoint 7, and they go from 0 to 3"):
        minsnap.plan(**read_request(tmp_path / "b.yaml").request().arguments())


def test_a_course_with_gates_is_opened_and_one_with_more_is_refused(tmp_path):
    text = (
        "waypoints:\n  - [0, 0, 1]\n  - {center: [4, 0, 1], heading: 0, radius: 0.6, margin: 0.1}\n  - [8, 0, 1]\n"
        "tube: 1.0\nlimits: {speed: 4}\n"
    )
    (tmp_path / "course.yaml").write_text(text)
    scene = documents.open_scene(tmp_path / "course.yaml")
    assert len(gate_of(scene).corners) == 24 and gate_of(scene).margin == 0.1
    assert scene.corridor == (1.0, 1.0) and dict(scene.limits)["speed"] == 4.0
    (tmp_path / "course.yaml").write_text(text + "takeoff: true\n")
    with pytest.raises(FileError, match="minsnap plan flies all of it"):
        documents.open_scene(tmp_path / "course.yaml")


def give(handle, value):
    """Give an input a value, as a browser does."""
    for act in handle._impl.update_cb:
        asyncio.run(act(SimpleNamespace(client_id=1, target=SimpleNamespace(value=value))))


def test_the_page_draws_and_turns_gates(tmp_path):
    pytest.importorskip("viser")
    page = Studio(SCENE, str(tmp_path), port=0)
    try:
        assert page.wait(60.0)
        assert page.trajectory is not None and page._gates._edges.points.shape == (5, 2, 3)
        page._route.choose(1)
        assert page._route._gate.value and page._route._size.value == (1.0, 1.0)
        handle = page._gates._handle
        (turned,) = handle._impl_aux.update_cb
        handle.wxyz = (np.cos(0.25), 0.0, 0.0, np.sin(0.25))
        asyncio.run(turned(SimpleNamespace(phase="update")))
        angle = np.arctan2(*gate_of(page.request).normal[[1, 0]]) - np.arctan2(*gate_of(SCENE).normal[[1, 0]])
        assert angle == pytest.approx(0.5)
        give(page._route._size, (2.0, 0.5))
        give(page._route._margin, 0.1)
        assert gate_of(page.request).margin == 0.1 and page._route._size.value == (2.0, 0.5)
        page._route.choose(0)
        assert page._gates._handle is None and not page._route._gate.value
    finally:
        page.close()


@pytest.mark.slow
def test_a_plan_with_gates_is_drawn_and_saved_with_them(tmp_path):
    from minsnap.studio.workbench import BenchState, planned_in_stages

    planned = list(planned_in_stages(SCENE, None, lambda: False))[-1]
    documents.save_as("figure (SVG)", BenchState(SCENE, planned), tmp_path / "a.svg")
    assert (tmp_path / "a.svg").stat().st_size > 1000
    documents.save_as("plan (JSON)", BenchState(SCENE, planned), tmp_path / "a.json")
    opened = documents.open_scene(tmp_path / "a.json")
    assert opened.openings == SCENE.openings and np.allclose(opened.waypoints, SCENE.waypoints, atol=1e-12)
    assert np.array_equal(opened.durations, np.diff(planned.trajectory.leg_breaks))
    assert planned.certificate.ok and replace(SCENE) == planned.request

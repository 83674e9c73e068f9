"""Opening and saving of scenes."""

import json
from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap.errors import FileError, WaypointError
from minsnap.files.convert import write_any
from minsnap.files.request_yaml import read_request
from minsnap.studio import documents
from minsnap.studio.documents import WorkingFolder
from minsnap.studio.edits import set_width, with_boxes, with_room
from minsnap.studio.workbench import BenchState, planned_in_stages

EXAMPLE = documents.example_scene()


@pytest.fixture(scope="module")
def planned():
    return list(planned_in_stages(EXAMPLE, None, lambda: False))[-1]


def test_setpoints_are_byte_by_byte_those_of_the_library(tmp_path, planned):
    documents.save_as("setpoints (CSV)", BenchState(EXAMPLE, planned), tmp_path / "a.csv")
    minsnap.write_csv(minsnap.plan(EXAMPLE.waypoints, total_time=12.0, corridor=0.3), tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("kind", documents.EXPORTS)
def test_every_kind_is_written(tmp_path, planned, kind):
    target = tmp_path / f"scene{documents.EXPORTS[kind][0]}"
    documents.save_as(kind, BenchState(EXAMPLE, planned), target)
    assert target.stat().st_size > 200
    if target.suffix == ".yaml":
        assert read_request(target) == EXAMPLE
    elif kind == "plan (JSON)":
        again = documents.open_scene(target)
        assert again.corridor == EXAMPLE.corridor and again.waypoints == EXAMPLE.waypoints
        assert again.durations == pytest.approx(np.diff(planned.trajectory.leg_breaks))


def test_a_plan_in_every_wall_within_the_rotors_is_the_same_scene_when_opened(tmp_path):
    walls = replace(
        with_room(with_boxes(EXAMPLE, True), True), corridor=(0.4, 0.3, 0.3, 0.3), total_time=None, pieces=1
    )
    scene = replace(walls, limits=(("speed", 3.0),), rotors=0.25, yaw="velocity")
    planned = list(planned_in_stages(scene, None, lambda: False))[-1]
    documents.save_as("plan (JSON)", BenchState(scene, planned), tmp_path / "a.json")
    assert replace(documents.open_scene(tmp_path / "a.json"), durations=None) == scene


CORNERS = [(0, 0, 1), (3, 0, 1), (3, 2, 1.5), (0, 2, 1)]


def test_a_plan_of_a_lap_is_opened_as_one(tmp_path):
    lap = minsnap.plan([*CORNERS, CORNERS[0]], limits=minsnap.Limits(speed=2.0, acceleration=4.0), closed=True)
    write_any(lap, tmp_path / "lap.json")
    assert lap.max_norm(1)[0] > 1.0 and np.linalg.norm(lap(0.0, 1)) > 0.5
    opened = documents.open_scene(tmp_path / "lap.json")
    assert opened.closed and opened.legs == 4
    write_any(minsnap.plan(CORNERS, total_time=9.0), tmp_path / "rests.json")
    assert not documents.open_scene(tmp_path / "rests.json").closed


def test_a_plan_that_begins_or_ends_in_motion_is_not_opened_as_one_at_rest(tmp_path):
    moving = minsnap.plan(CORNERS, [2.0, 2.0, 2.0], start={"velocity": (0.5, 0, 0)})
    for curve in (moving, moving.reversed()):
        write_any(curve, tmp_path / "moving.json")
        with pytest.raises(WaypointError, match="begins or ends in motion"):
            documents.open_scene(tmp_path / "moving.json")


def test_a_plan_of_another_scene_is_not_saved(tmp_path, planned):
    other = set_width(EXAMPLE, 0, 0.1)
    for scene, request in ((planned, other), (replace(planned, final=False), EXAMPLE), (None, EXAMPLE)):
        with pytest.raises(FileError, match="no final plan"):
            documents.save_as("setpoints (CSV)", BenchState(request, scene), tmp_path / "a.csv")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", documents.EXAMPLES)
def test_every_example_of_the_page_is_planned_and_certified(name):
    *_, last = planned_in_stages(documents.EXAMPLES[name](), (), lambda: False)
    assert last.final and last.certificate.ok


def test_files_without_times_are_planned_within_ordinary_limits(tmp_path):
    (tmp_path / "a.csv").write_text("x,y,z\n0,0,1\n3,4,1\n3,4,3\n")
    opened = documents.open_scene(tmp_path / "a.csv")
    assert dict(opened.limits) == {"speed": 3.0, "acceleration": 6.0, "jerk": 30.0}
    assert opened.durations is None and opened.request().polynomials == "auto"


@pytest.mark.parametrize(
    ("name", "text", "error"),
    [
        ("a.txt", "x,y,z\n0,0,1\n3,4,1\n", FileError),
        ("a.csv", "x,y\n0,0\n3,4\n", WaypointError),
        ("a.yaml", "!!python/object/apply:os.system ['touch bad']", FileError),
        ("a.csv", "x,y,z\n" + "".join(f"{i},0,1\n" for i in range(300)), FileError),
        ("a.plan", json.dumps({"fileType": "Plan"}), FileError),
    ],
)
def test_what_cannot_be_opened_is_refused_and_nothing_stays(tmp_path, name, text, error):
    with pytest.raises(error):
        documents.open_upload(f"../{name}", text.encode(), WorkingFolder(tmp_path))
    assert not list(tmp_path.iterdir())


def test_what_is_wrong_with_an_upload_is_said_by_its_name(tmp_path):
    for text in ("x,y,z\n0,0,1\n3,a,1\n", "x,y,z\n" + "".join(f"{i},0,1\n" for i in range(300))):
        with pytest.raises(FileError, match=r"^my course\.csv"):
            documents.open_upload("my course.csv", text.encode(), WorkingFolder(tmp_path))


def test_an_upload_is_the_scene_that_was_saved(tmp_path):
    scene = with_boxes(EXAMPLE, True)
    documents.save_as("request (YAML)", BenchState(scene, None), tmp_path / "a.yaml")
    content = (tmp_path / "a.yaml").read_bytes()
    assert documents.open_upload("x.YAML", content, WorkingFolder(tmp_path)) == scene

"""No name leads out of the working folder."""

import os

import pytest

from minsnap.errors import FileError
from minsnap.studio.documents import WorkingFolder, example_scene, open_scene, open_upload, save_as
from minsnap.studio.workbench import BenchState


@pytest.fixture
def folder(tmp_path):
    inside = tmp_path / "work"
    inside.mkdir()
    (tmp_path / "outside.csv").write_text("kept")
    return WorkingFolder(inside)


@pytest.mark.parametrize(
    "name",
    ["../outside", "..", "a/b", "/etc/x", "\\\\host\\x", "", ".hidden", "~", "a\nb", "a\0b", "x" * 200, "C:x", "-rf"],
)
def test_names_that_lead_out_are_refused(folder, tmp_path, name):
    with pytest.raises(FileError, match="working folder"):
        folder.destination(name, ".csv")
    assert sorted(os.listdir(tmp_path)) == ["outside.csv", "work"]


def test_links_and_folders_are_refused(folder, tmp_path):
    (folder.path / "link.csv").symlink_to(tmp_path / "outside.csv")
    (folder.path / "made.csv").mkdir()
    for name in ("link", "made.csv"):
        with pytest.raises(FileError, match="link or no file"):
            folder.destination(name, ".csv")


def test_plain_names_are_inside_and_get_their_ending(folder):
    assert folder.destination("Flight 3.b", ".csv") == folder.path / "Flight 3.b.csv"
    assert folder.destination("flight.csv", ".csv") == folder.path / "flight.csv"


def test_scratch_files_are_inside_and_go(folder):
    with folder.scratch(".yaml") as path:
        path.write_text("x")
        assert folder.path in path.parents
    assert os.listdir(folder.path) == []


def test_errors_say_the_name_that_the_user_knows(folder):
    for name in ("my course.csv", "../../../my course?.csv"):
        with pytest.raises(FileError) as refused, folder.scratch(".csv", name) as path:
            raise FileError(f"{path}, line 3: 'a' is no number")
        assert str(refused.value) == f"{name}, line 3: 'a' is no number"


def test_a_folder_must_exist(tmp_path):
    with pytest.raises(FileError, match="no folder"):
        WorkingFolder(tmp_path / "nowhere")


POINTS = "x,y,z\n0,0,1\n8,0,1\n8,4,1\n"


def test_what_was_opened_is_replaced_by_its_own_kind_alone(folder):
    """Setpoints of the same name took the place of the waypoints, without a word."""
    course, scene = folder.path / "course.csv", folder.path / "scene.yaml"
    course.write_text(POINTS)
    save_as("request (YAML)", BenchState(example_scene()), scene)
    gates = folder.path / "gates.yaml"
    gates.write_text("{name: ours, closed: true, waypoints: [[0, 0, 1], [8, 0, 1], [8, 4, 1]]}")
    opened = WorkingFolder(folder.path, course, scene, gates, None)
    for kind, name in (("setpoints (CSV)", "course"), ("Crazyflie (CSV)", "course.csv"), ("request (YAML)", "gates")):
        with pytest.raises(FileError, match="is the file that is read: choose another name"):
            opened.target(kind, name)
    assert opened.target("request (YAML)", "scene") == scene
    assert opened.target("setpoints (CSV)", "flown") == folder.path / "flown.csv"


def test_what_a_page_has_read_from_the_folder_is_kept(folder):
    """An upload from the folder was replaced in the same way; another file of that name is none that was read."""
    (folder.path / "course.csv").write_text(POINTS)
    open_upload("course.csv", POINTS.replace("8", "9").encode(), folder)
    assert folder.target("setpoints (CSV)", "course")
    assert open_upload("course.csv", POINTS.encode(), folder) == open_scene(folder.path / "course.csv")
    with pytest.raises(FileError, match="is the file that is read"):
        folder.target("setpoints (CSV)", "course")

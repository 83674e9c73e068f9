"""The command that plans through a map."""

import json

import numpy as np
import pytest
from PIL import Image

from minsnap.cli.plan_commands import joined_points
from minsnap.files.setpoint_csv import read_csv


@pytest.fixture
def folder(tmp_path):
    cells = np.zeros((100, 80), dtype=np.uint8)
    cells[30:33, :55] = cells[60:63, 25:] = 1
    np.save(tmp_path / "map.npy", cells)
    return tmp_path


WAY = ["route", "map.npy", "--resolution", "0.1", "--start", "1", "1", "--goal", "9", "7", "--clearance", "0.3"]


@pytest.mark.slow
def test_one_command_leads_from_a_map_to_setpoints_and_a_figure(call, folder):
    done = call(*WAY, "-o", "route.csv", "--plot", "route.png", "--json")
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout)
    assert (
        figures["altitude"] == 0.0 and figures["obstacle_distance"] >= 0.3 - 1e-9 and figures["max_speed"] <= 3.0 + 1e-6
    )
    assert (folder / "route.png").read_bytes().startswith(b"\x89PNG")
    found = read_csv("route.csv")
    assert found.position[0] == pytest.approx([1, 1, 0]) and found.position[-1] == pytest.approx([9, 7, 0])
    assert call("check", "route.csv").returncode == 0


@pytest.mark.parametrize(
    ("map_file", "written"),
    [("map.npy", ("-o", "map.npy")), ("map.yaml", ("-o", "map.yaml")), ("map.yaml", ("--plot", "map.png"))],
)
def test_the_files_of_the_map_are_not_replaced(call, folder, map_file, written):
    Image.fromarray(np.full((80, 100), 254, dtype=np.uint8)).save(folder / "map.png")
    (folder / "map.yaml").write_text("image: map.png\nresolution: 0.1\norigin: [0, 0, 0]\n")
    kept = {file: file.read_bytes() for file in folder.iterdir()}
    done = call("route", map_file, *WAY[4:], *(WAY[2:4] if map_file == "map.npy" else ()), *written)
    assert done.returncode == 2 and f"{written[1]} is the file that is read" in done.stderr
    assert {file: file.read_bytes() for file in folder.iterdir()} == kept


def test_altitudes_a_time_and_a_plan_as_a_file(call, folder):
    done = call(*WAY[:4], "--start", "1", "1", "1.2", "--goal", "9", "7", "1.2", "--time", "15", "-o", "route.json")
    assert done.returncode == 0, done.stderr
    assert "obstacle distance" in done.stdout and "15 s" in done.stdout and "altitude" not in done.stdout
    assert call("plan", "route.json", "-o", "again.csv").returncode == 0
    assert read_csv("again.csv").position[:, 2].min() > 0.2


def test_no_way_is_status_1_and_says_where(call, folder):
    done = call(*WAY[:-1], "1.6")
    assert done.returncode == 1 and "widest one has 1.3 m on each side" in done.stderr and "cell (" in done.stderr
    done = call(*WAY[:4], "--start", "2.7", "1", "--goal", "9", "7", "--clearance", "0.5")
    assert done.returncode == 2 and "move it by 0.2 m and a cell" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([*WAY[:4], "--start", "1", "--goal", "9", "7"], "--start is '1': give X Y or X Y Z"),
        ([*WAY[:2], *WAY[4:]], "does not say how large its cells are: give the resolution"),
        ([*WAY, "--unknown", "both"], "unknown cells count as"),
        ([*WAY, "--origin", "a,b"], "--origin is 'a'"),
        ([*WAY, "-o", "route.xyz"], "route.xyz"),
    ],
)
def test_bad_usage_is_one_sentence(call, folder, arguments, message):
    done = call(*arguments)
    assert done.returncode == 2 and message in done.stderr and done.stderr.count("\n") == 1


def test_rows_of_y_are_transposed_where_that_is_said(call, folder):
    np.save("turned.npy", np.load("map.npy").T)
    assert "transpose" in call("route", "turned.npy", *WAY[2:]).stderr
    assert call("route", "turned.npy", *WAY[2:], "--transpose", "--time", "20").returncode == 0


def test_numbers_after_a_point_are_joined_whatever_their_sign():
    assert joined_points(["m", "--start", "-1", "2", "-3e1", "--goal", "1", "2", "-o", "x"]) == [
        "m",
        "--start=-1,2,-3e1",
        "--goal=1,2",
        "-o",
        "x",
    ]
    assert joined_points(["--start=1,2", "--goal"]) == ["--start=1,2", "--goal"]

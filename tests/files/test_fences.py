"""Geofences of QGroundControl's plans, in metres from their home, and on the command line."""

import json

import numpy as np
import pytest

import minsnap
from minsnap.cli.app import main as command
from minsnap.errors import FileError, InputError
from minsnap.files.geodesy import geodetic_positions

HOME = (47.3977, 8.5456, 488.0)
SQUARE = [(-20, -20), (40, -20), (40, 30), (-20, 30)]
SHED = [(8, -5), (12, -5), (12, 5), (8, 5)]


def main(words):
    """Return the exit status of a command."""
    with pytest.raises(SystemExit) as left:
        command(words)
    return left.value.code


def plan_text(**changes):
    def degrees(places):
        places = np.column_stack((places, np.full(len(places), 0.0)))
        return geodetic_positions(places, HOME)[:, :2].tolist()

    fence = {
        "circles": [{"circle": {"center": degrees([(30, 20)])[0], "radius": 4.0}, "inclusion": False, "version": 1}],
        "polygons": [
            {"inclusion": True, "polygon": degrees(SQUARE), "version": 1},
            {"inclusion": False, "polygon": degrees(SHED), "version": 1},
        ],
        "version": 2,
    }
    content = {"fileType": "Plan", "geoFence": fence, "mission": {"plannedHomePosition": list(HOME)}, "version": 1}
    return json.dumps(content | changes)


def test_a_fence_is_read_in_metres_from_the_home(tmp_path):
    file = tmp_path / "field.plan"
    file.write_text(plan_text())
    square, shed, mast = minsnap.read_fence(file)
    assert square.inclusion and not shed.inclusion
    assert square.polygon == pytest.approx(np.array(SQUARE, dtype=float), abs=1e-3)
    assert shed.polygon == pytest.approx(np.array(SHED, dtype=float), abs=1e-3)
    assert mast.center == pytest.approx([30, 20], abs=1e-3) and mast.radius == 4.0
    moved = minsnap.read_fence(file, geodetic_positions((10.0, 0.0, 0.0), HOME))[1]
    assert moved.polygon == pytest.approx(np.array(SHED) - (10, 0), abs=1e-3)


def test_circles_to_stay_in_are_polygons_inside_of_them(tmp_path):
    file = tmp_path / "field.plan"
    circle = {"circle": {"center": HOME[:2], "radius": 25.0}, "inclusion": True}
    file.write_text(plan_text(geoFence={"circles": [circle], "polygons": []}))
    (inside,) = minsnap.read_fence(file)
    assert inside.inclusion and np.linalg.norm(inside.polygon, axis=1) == pytest.approx(25.0, abs=1e-3)


def test_the_command_line_plans_within_a_fence(tmp_path, capsys):
    fence, points, flight = tmp_path / "field.plan", tmp_path / "points.csv", tmp_path / "flight.json"
    fence.write_text(plan_text())
    points.write_text("x,y,z\n0,0,10\n20,0,10\n")
    assert main(["plan", str(points), "--fence", str(fence), "-o", str(flight)]) == 0
    assert main(["check", str(flight)]) == 0
    assert "obstacles" in capsys.readouterr().out
    np.save(tmp_path / "map.npy", np.zeros((60, 50), dtype=bool))
    asked = ["route", str(tmp_path / "map.npy"), "--resolution", "1", "--origin", "-20,-20", "--clearance", "0.5"]
    asked += ["--start", "0,0", "--goal", "20,0", "--fence", str(fence), "-o", str(tmp_path / "route.csv")]
    assert main(asked) == 0
    points.write_text("x,y,z\n0,0,10\n50,0,10\n")
    assert main(["plan", str(points), "--fence", str(fence)]) == 2
    assert "is 10 m outside fence 0: move it" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{}", "is no plan of QGroundControl"),
        ("[1", "is not a plan of QGroundControl|field.plan"),
        (plan_text(mission={}), "has no plannedHomePosition: give the origin"),
        (plan_text(geoFence={"polygons": [], "circles": []}), "has a geofence without polygons and circles"),
        (
            plan_text(geoFence={"polygons": [{"inclusion": True, "polygon": [[47, 8], [48, 8]]}]}),
            "2 corners and no area",
        ),
        (plan_text(geoFence={"circles": [{"inclusion": True}]}), "geofence"),
    ],
)
def test_what_is_no_fence_is_refused(tmp_path, text, said):
    file = tmp_path / "field.plan"
    file.write_text(text)
    with pytest.raises(FileError, match=said):
        minsnap.read_fence(file)
    with pytest.raises((InputError, FileError)):
        minsnap.read_fence(file, (1.0, 2.0))

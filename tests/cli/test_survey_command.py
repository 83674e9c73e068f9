"""Surveys on the command line."""

import json

import numpy as np
import pytest

import minsnap
from minsnap.files.geodetic_missions import read_mission

AREA = "x,y\n0,0\n60,0\n60,40\n0,40\n"
KML = (
    '<kml xmlns="http://www.opengis.net/kml/2.2"><Placemark><Polygon><outerBoundaryIs><LinearRing><coordinates>'
    "8.5456,47.3977,0 8.5464,47.3977,0 8.5464,47.3981,0 8.5456,47.3981,0 8.5456,47.3977,0"
    "</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark></kml>"
)


def test_an_area_is_surveyed_drawn_and_written(call, tmp_path):
    (tmp_path / "area.csv").write_text(AREA)
    done = call("survey", "area.csv", "--spacing", 20, "--height", 40, "--speed", 5, "-o", "s.csv", "--plot", "s.png")
    assert done.returncode == 0 and "of the time at 5 m/s" in done.stdout, done.stderr
    assert minsnap.read_csv(tmp_path / "s.csv").position[:, 2] == pytest.approx(40.0)
    said = json.loads(call("survey", "area.csv", "--spacing", 20, "--height", 40, "--json").stdout)
    assert len(said["survey"]["lines"]) == 2 and said["max_speed"] <= 3.0 + 1e-9
    assert call("check", "s.csv").returncode == 0 and (tmp_path / "s.png").stat().st_size > 1000


def test_a_polygon_of_google_earth_becomes_a_mission(call, tmp_path):
    (tmp_path / "area.kml").write_text(KML)
    origin = ("--origin", 47.3977, 8.5456, 488)
    done = call("survey", "area.kml", "--spacing", 20, "--height", 40, "-o", "s.plan", *origin)
    assert done.returncode == 0, done.stderr
    points = read_mission(tmp_path / "s.plan").points
    assert points[:, 2] == pytest.approx(40.0, abs=0.01) and points[:, :2].max() > 60.0


def test_the_height_is_above_the_highest_ground(call, tmp_path):
    (tmp_path / "area.csv").write_text(AREA)
    heights = np.full((30, 30), 5.0)
    heights[18, 12] = 17.0
    grid = "\n".join(" ".join(f"{value:g}" for value in row) for row in heights)
    (tmp_path / "dem.asc").write_text(f"ncols 30\nnrows 30\nxllcorner -50\nyllcorner -50\ncellsize 6\n{grid}\n")
    done = call("survey", "area.csv", "--spacing", 20, "--height", 40, "--terrain", "dem.asc", "-o", "s.csv")
    assert done.returncode == 0, done.stderr
    assert minsnap.read_csv(tmp_path / "s.csv").position[:, 2] == pytest.approx(57.0)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--height", 3), "Missing option '--spacing'"),
        (("--spacing", 3), "give --height of the lines over an area, or --facade LOW HIGH"),
        (("--spacing", 3, "--height", 3, "--facade", 1, 2), "give --height of the lines"),
        (("--spacing", 3, "--facade", 1, 2), "has 4 places: a facade has two"),
        (("--spacing", 3, "--facade", 1, 2, "--angle", 3), "--angle is of lines over an area"),
        (("--spacing", 3, "--height", 3, "--distance", 3), "--distance is from a wall"),
        (("--spacing", 3, "--height", 3, "-o", "s.plan"), "give the origin"),
        (("--spacing", 3, "--height", 3, "--speed", 9, "--max-speed", 5), "above the limit of 5"),
    ],
)
def test_what_is_wrong_is_one_sentence(call, tmp_path, words, said):
    (tmp_path / "area.csv").write_text(AREA)
    done = call("survey", "area.csv", *words)
    assert done.returncode == 2 and said in done.stderr, done.stderr

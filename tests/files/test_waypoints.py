"""Waypoint files in CSV and YAML, and every way they can be bad."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import minsnap
from minsnap.errors import FileError

POINTS = [[0.0, 0.0, 1.0], [8.0, 0.0, 1.0], [8.0, 4.0, 1.5]]


@pytest.fixture
def write(tmp_path):
    def _write(text, name="given.csv"):
        file = tmp_path / name
        file.write_text(text)
        return file

    return _write


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.csv", "x,y,z\n0,0,1\n8,0,1\n8,4,1.5\n"),
        ("a.txt", "0,0,1\n8,0,1\n8,4,1.5\n"),
        ("a.csv", "z,x,y\n1,0,0\n1,8,0\n1.5,8,4\n"),
        ("a.csv", "X,Y,Z\n0,0,1\n8,0,1\n8,4,1.5\n"),
        ("a.csv", "x;y;z\n0;0;1\n8;0;1\n8;4;1.5\n"),
        ("a.tsv", "x\ty\tz\n0\t0\t1\n8\t0\t1\n8\t4\t1.5\n"),
        ("a.txt", "x y  z\n0  0 1\n 8 0 1\n8 4 1.5\n"),
        ("a.txt", "0.0e+00 0.0e+00 1.0e+00\n8.0e+00 0.0e+00 1.0e+00\n8.0e+00 4.0e+00 1.5e+00\n"),
        ("a.txt", "# x y z\n0 0 1\n8 0 1\n8 4 1.5\n"),
        ("a.txt", "# z, x, y\n1 0 0\n1 8 0\n1.5 8 4\n"),
        ("a.csv", "# a flight of 2026\nx, y, z\n\n0, 0, 1  # the start\n8, 0, 1\n8, 4, 1.5\n\n"),
        ("a.csv", '"x [m]","y [m]","z (m)"\n0,0,1\n8,0,1\n8,4,1.5\n'),
        ("a.csv", "\ufeffx,y,z\r\n0,0,1\r\n8,0,1\r\n8,4,1.5\r\n"),
        ("a.yaml", "- [0, 0, 1]\n- [8, 0, 1]\n- {x: 8, y: 4, z: 1.5}\n"),
        ("a.yml", "waypoints: [[0, 0, 1], [8, 0, 1], [8, 4, 1.5]]\n"),
    ],
)
def test_points_in_every_form(write, name, text):
    found = minsnap.read_waypoints(write(text, name))
    assert np.array_equal(found.points, POINTS)
    assert found.yaw is None and found.durations is None


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.csv", "x,y,z,yaw,duration\n0,0,1,0,4\n8,0,1,0.5,2\n8,4,1.5,1,\n"),
        ("a.csv", "x,y,z,yaw,duration\n0,0,1,0,\n8,0,1,0.5,4\n8,4,1.5,1,2\n"),
        ("a.csv", "t,x,y,z,yaw\n1,0,0,1,0\n5,8,0,1,0.5\n7,8,4,1.5,1\n"),
        ("a.csv", "Time;X;Y;Z;Yaw\n0;0;0;1;0\n4;8;0;1;0.5\n6;8;4;1.5;1\n"),
        ("a.tsv", "x\ty\tz\tyaw\tduration\n0\t0\t1\t0\t4\n8\t0\t1\t0.5\t2\n8\t4\t1.5\t1\t\n"),
        (
            "a.yaml",
            "- {x: 0, y: 0, z: 1, yaw: 0, duration: 4}\n"
            "- {x: 8, y: 0, z: 1, yaw: 0.5, duration: 2}\n"
            "- {x: 8, y: 4, z: 1.5, yaw: 1}\n",
        ),
        ("a.yaml", "waypoints: [[0, 0, 1], [8, 0, 1], [8, 4, 1.5]]\nyaw: [0, 0.5, 1]\ndurations: [4, 2]\n"),
    ],
)
def test_yaw_and_durations(write, name, text):
    found = minsnap.read_waypoints(write(text, name))
    assert np.array_equal(found.points, POINTS)
    assert np.array_equal(found.yaw, [0.0, 0.5, 1.0])
    assert np.array_equal(found.durations, [4.0, 2.0])


def test_two_dimensions_and_an_empty_column_of_durations(write):
    found = minsnap.read_waypoints(write("x,y,duration\n0,0,\n1,2,\n"))
    assert np.array_equal(found.points, [[0.0, 0.0], [1.0, 2.0]])
    assert found.durations is None


def test_what_numpy_writes_is_read_to_the_last_bit(tmp_path):
    points = np.random.default_rng(0).normal(size=(6, 3))
    np.savetxt(tmp_path / "plain.txt", points)
    np.savetxt(tmp_path / "named.txt", points[:, [1, 2, 0]], header="y z x")
    np.savetxt(tmp_path / "commas.csv", points, delimiter=",", header="x,y,z", comments="")
    for name in ("plain.txt", "named.txt", "commas.csv"):
        assert np.array_equal(minsnap.read_waypoints(tmp_path / name).points, points)


def test_a_yaw_in_degrees_says_so(write):
    found = minsnap.read_waypoints(write("x,y,yaw [deg]\n0,0,90\n1,2,-180\n"))
    assert found.yaw == pytest.approx([np.pi / 2, -np.pi])


def test_what_is_read_cannot_be_written_to(write):
    found = minsnap.read_waypoints(write("0,0\n1,2\n"))
    with pytest.raises(ValueError, match="read-only"):
        found.points[0, 0] = 1.0


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.csv", "", "is empty"),
        ("a.csv", "x,y,z\n", "no rows"),
        ("a.csv", "x,z\n0,1\n", "line 1: no column y"),
        ("a.csv", "x,y,z,pace\n0,0,1,2\n", "line 1: column 'pace' is not known"),
        ("a.csv", "t,x,y,z,vx,vy,vz\n0,0,0,1,2,0,0\n", "column 'vx' is not known.*; setpoints are planned already"),
        ("a.csv", "0,0,1,4\n8,0,1,2\n", "line 1: 4 numbers without a header"),
        ("a.csv", "x,y,z\n0,0,1\n8,0\n", "line 3: 2 numbers"),
        ("a.csv", "x;y\n1,5;2.5\n3;4\n", "line 2: semicolons and commas are mixed.*a point for decimals"),
        ("a.csv", "0,0,1\n8\t0\t1\n", "are mixed"),
        ("a.csv", "t,x,y\n0,0,0\n0,1,1\n", "waypoint 1 is passed at t = 0 s, not after waypoint 0"),
        ("a.csv", "t,x,y,duration\n0,0,0,1\n1,1,1,\n", "duration and t both say when"),
        ("a.csv", "x [mm],y [mm]\n0,0\n1,1\n", "line 1: x is in 'mm': convert it to m"),
        ("a.csv", "0,0,one\n8,0,1\n", "line 1: 'one' is not a finite number"),
        ("a.csv", "5\n6\n", "line 1: 1 number without a header"),
        ("a.csv", "# x y z w\n", "is empty"),
        ("a.csv", "x,y,X\n0,0,1\n", "column x is there twice"),
        ("a.csv", "x,y,z\n0,0,1\n8,zero,1\n", "line 3: y is 'zero'"),
        ("a.csv", "x,y,z\n0,0,1\n8,inf,1\n", "line 3: y is 'inf'"),
        ("a.csv", "x,y,duration\n0,0,nan\n8,1,2\n", "line 2: duration is 'nan'"),
        ("a.csv", "x,y,duration\n0,0,1\n8,1,2\n", "2 waypoints have 1 legs.*0 are"),
        ("a.csv", "x,y,duration\n0,0,1\n8,1,\n9,1,2\n", "one empty; 1 are"),
        ("a.yaml", "", "needs a list of waypoints"),
        ("a.yaml", "[]", "needs a list of waypoints"),
        ("a.yaml", "speed: 3\nwaypoints: [[0, 0], [1, 1]]", "'speed' is not known: did you mean limits: "),
        ("a.yaml", "- [0, 0, 1]\n- [1]\n", r"waypoint 1 is \[1\]: give"),
        ("a.yaml", "- [0, 0, 1]\n- {x: 1, y: 1, height: 3}\n", "waypoint 1: 'height' is not known"),
        ("a.yaml", "- [0, 0, 1]\n- [1, 2]\n", "waypoint 1: z is missing"),
        ("a.yaml", "- [0, 0, 1]\n- [1, true, 2]\n", "waypoint 1: y is True"),
        ("a.yaml", "- [0, 0, 1]\n- [1, .nan, 2]\n", "waypoint 1: y is nan"),
        ("a.yaml", "- [0, 0, 1]\n- [1, up, 2]\n", "waypoint 1: y is 'up'"),
        ("a.yaml", "waypoints: [[0, 0], [1, 1]]\nyaw: 3\n", "yaw is 3: give one list"),
        ("a.yaml", "waypoints: [{x: 0, y: 0, yaw: 1}, {x: 1, y: 0, yaw: 1}]\nyaw: [0, 1]\n", "not both"),
        ("a.yaml", "- [0, 0\n- [1, 2]\n", "line 2"),
        ("a.yaml", "- !!python/object/apply:os.getcwd []\n", "line 1"),
    ],
)
def test_a_bad_file_is_refused_with_its_place(write, name, text, said):
    with pytest.raises(FileError, match=said):
        minsnap.read_waypoints(write(text, name))


def test_a_missing_file_is_bad_input(tmp_path):
    for name in ("none.csv", "none.yaml"):
        with pytest.raises(FileError, match="No such file"):
            minsnap.read_waypoints(tmp_path / name)


@pytest.mark.parametrize("name", ["a.csv", "a.yaml"])
@given(
    content=st.one_of(st.binary(max_size=60), st.text("0123456789.,-:[]{}xyz!&*'\"\n ", max_size=60).map(str.encode))
)
def test_whatever_a_file_holds_it_is_read_or_refused(tmp_path_factory, name, content):
    file = tmp_path_factory.mktemp("any") / name
    file.write_bytes(content)
    try:
        assert np.isfinite(minsnap.read_waypoints(file).points).all()
    except FileError as error:
        assert str(file) in str(error)

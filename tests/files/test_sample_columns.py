"""Tables of samples as other programs write them: names, units, separators, and places on the ellipsoid."""

from __future__ import annotations

import numpy as np
import pytest

import minsnap
from minsnap.errors import FileError, FrameError
from minsnap.files.geodesy import local_positions

TABLES = {
    "mavsdk_drone_show": (
        "idx,t,px,py,pz,vx,vy,vz,ax,ay,az,yaw,mode,ledr\n0,0,1,2,3,4,5,6,7,8,9,0.5,70,255\n1,.1,1,2,3,4,5,6,7,8,9,0.5,70,1\n",
        {"vy": 5.0, "az": 9.0, "yaw": 0.5},
    ),
    "Skybrush": ("Time [msec],x [m],y [m],z [m],Red,Green\n0,1,2,3,255,0\n100,1,2,3,255,0\n", {}),
    "rpg and gym-pybullet-drones": (
        "t,p_x,p_y,p_z,q_w,q_x,q_y,q_z,v_x,v_y,v_z,a_lin_x,a_lin_y,a_lin_z\n"
        "0,1,2,3,1,0,0,0,4,5,6,7,8,9\n0.1,1,2,3,1,0,0,0,4,5,6,7,8,9\n",
        {"vy": 5.0, "az": 9.0},
    ),
    "uav_trajectories": ("t,posx,posy,posz,velx,vely,velz\n0,1,2,3,4,5,6\n0.1,1,2,3,4,5,6\n", {"vy": 5.0}),
    "cflib": (
        "timestamp,stateEstimate.x,stateEstimate.y,stateEstimate.z,stabilizer.yaw\n0,1,2,3,90\n100,1,2,3,90\n",
        {"yaw": np.pi / 2},
    ),
    "millimetres": ("time_ms;X (mm);Y (mm);Z (mm)\n0;1000;2000;3000\n100;1000;2000;3000\n", {}),
    "decimal commas": ("Time (s);x;y;z\n0;1,0;2,0;3\n0,1;1,0;2,0;3\n", {}),
    "tabs and decimal commas": ("time\tpos x\tpos y\tpos z\n0\t1,0\t2,0\t3\n0,1\t1,0\t2,0\t3\n", {}),
    "words between numbers": ("state,time,x,y,z\nup,0,1,2,3\nup,0.1,1,2,3\n", {}),
    "a trailing separator": ("time,x,y,z\n0,1,2,3,\n0.1,1,2,3,\n", {}),
}


@pytest.fixture
def write(tmp_path):
    def _write(text, name="given.csv"):
        file = tmp_path / name
        file.write_text(text, encoding="utf-8")
        return file

    return _write


@pytest.mark.parametrize("name", TABLES)
def test_usual_names_and_units_are_read(write, name):
    text, others = TABLES[name]
    found = minsnap.read_csv(write(text)).columns()
    assert found["t"] == pytest.approx([0.0, 0.1])
    for axis, value in {"x": 1.0, "y": 2.0, "z": 3.0, **others}.items():
        assert found[axis] == pytest.approx([value] * 2), axis
    assert set(found) >= {"t", "x", "y", "z", *others}


def test_columns_are_named(write):
    file = write("clock,north,east,up,heading\n0,1,2,3,90\n10,1,2,3,90\n")
    with pytest.raises(FileError, match="no column"):
        minsnap.read_csv(file)
    named = {"t": "clock:ms", "x": "north", "y": "east", "z": "up", "yaw": "heading:deg"}
    found = minsnap.read_csv(file, columns=named)
    assert found.t == pytest.approx([0.0, 0.01]) and found.yaw == pytest.approx([np.pi / 2] * 2)
    assert found.position == pytest.approx(np.array([[1.0, 2.0, 3.0]] * 2))


def test_places_on_the_ellipsoid_need_an_origin(write):
    places = np.array([[47.1, 8.2, 500.0], [47.1005, 8.2007, 512.0]])
    rows = "".join(f"{i},{lat!r},{lon!r},{alt!r}\n" for i, (lat, lon, alt) in enumerate(places.tolist()))
    file = write("Time,Latitude [deg],Lng,Altitude (m)\n" + rows)
    with pytest.raises(FileError, match=r"latitudes and longitudes: give the origin.*--origin LAT LON ALT"):
        minsnap.read_csv(file)
    found = minsnap.read_csv(file, origin=(47.1, 8.2, 500.0))
    assert found.position == pytest.approx(local_positions(places, places[0]))


@pytest.mark.parametrize(
    ("text", "asked", "said"),
    [
        ("time,x,y,z\n0,1,2,q\n1,1,2,3\n", {}, "line 2: z is 'q', not a finite number"),
        ("time,x (in),y,z\n0,1,2,3\n1,1,2,3\n", {}, "x \\(in\\) is in 'in': convert it to one of m, "),
        (
            "timestamp,x,y,z\n0,1,2,3\n10,1,2,3\n20,1,2,3\n2000,1,2,3\n",
            {},
            "says no unit: give it, such as t=timestamp:ms",
        ),
        ("time,x,y,z\n0,1,2\n", {}, "line 2: 3 cells, but there are 4 columns"),
        ("time,x,y,z\n", {}, "a header and no rows"),
        ("time,x,y,z\n0,1,2,3\n", {"columns": {"t": "clock"}}, "has no column 'clock': the columns are time, x, y, z"),
        ("time,x,y,z\n0,1,2,3\n", {"columns": {"q": "x"}}, "no column is called 'q': there are t, x, y, z"),
        ("time,x,y,z\n0,1,2,3\n", {"columns": {"t": "time:parsec"}}, "is in 'parsec': convert it to one of s, "),
        ("time,lat,lon,alt\n0,91,2,3\n", {"origin": (0, 0, 0)}, "beyond 90 and 180 degrees"),
        ("time,x,y,z\n0,1,2,3\n", {"origin": (0, 0, 0)}, "no column is known as lat, lon, alt"),
        ("time,lat,lon,alt\n0,1,2,3\n", {"origin": (0, "x", 0)}, "the origin"),
        ("time,x,y\n0,1,2\n", {"columns": {"t": "time"}}, "no column is known as z; the columns are time, x, y"),
        ("time,x,y,z\n0,1,2,3\n0,1,2,3\n", {}, "not after the"),
    ],
)
def test_what_is_wrong_is_one_sentence(write, text, asked, said):
    with pytest.raises(FileError, match=said):
        minsnap.read_csv(write(text), **asked)


def test_what_lies_below_ground_has_to_say_its_frame(write):
    file = write("t,px,py,pz\n0,1,2,-3\n1,1,2,-3\n")
    with pytest.raises(FrameError, match="does not say its frame"):
        minsnap.read_csv(file)
    assert minsnap.read_csv(file, "ned").position[0] == pytest.approx([2.0, 1.0, 3.0])


def test_the_decimal_commas_of_waypoints(write):
    """The first line of a spreadsheet of half the world; a mixture of points and commas is refused still."""
    found = minsnap.read_waypoints(write("x;y;z\n0,5;1;1\n2;3,25;-1,5\n"))
    assert found.points == pytest.approx(np.array([[0.5, 1.0, 1.0], [2.0, 3.25, -1.5]]))
    with pytest.raises(FileError, match="semicolons and commas are mixed"):
        minsnap.read_waypoints(write("x;y\n0,5;1.5\n2;3\n"))

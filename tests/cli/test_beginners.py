"""Mistakes of a first day: each is one sentence that names what to do, status 2, and no file."""

from __future__ import annotations

import json

import numpy as np
import pytest

import minsnap
from minsnap.errors import ArgumentNameError

FILES = {
    "w.csv": "x,y,z\n0,0,1\n5,0,1\n5,5,1\n",
    "set.csv": "t,x,y,z,vx,vy,vz\n0,0,0,1,1,0,0\n1,1,0,1,1,0,0\n",
    "ragged.csv": "x,y,z\n0,0,1\n5,0\n",
    "text.csv": "x,y,z\n0,0,1\n5,0,abc\n",
    "one.csv": "x,y,z\n0,0,1\n",
    "twice.csv": "x,y,z\n0,0,1\n0,0,1\n3,3,1\n",
    "empty.csv": "",
    "mm.csv": "x [mm],y [mm],z [mm]\n0,0,1000\n5000,0,1000\n",
    "below.csv": "x,y,z\n0,0,-1\n5,0,-1\n",
    "names.csv": "east,north,up\n0,0,1\n5,0,1\n",
    "typo.yaml": "waypoints: [[0,0,1], [5,0,1]]\nlimit: {speed: 3}\n",
    "list.yaml": "waypoints: 3\n",
    "fast.yaml": "waypoints: [[0, 0, 1], [5, 0, 1]]\nmax_speed: 3\n",
    "slow.yaml": "waypoints: [[0, 0, 1], [5, 0, 1]]\nspeed: 3\n",
    "trees.yaml": "waypoints: [[0, 0, 1], [5, 0, 1]]\nlaps: 1\nobstacles: [{cylinder: [2, 0, 0.3]}]\n",
    "turned.yaml": "gates: [{center: [0, 0, 1], yaw: 90, width: 1}, {center: [5, 0, 1], heading: 0, width: 1}]\n",
    "places.yaml": "waypoints: [{lat: 47.3977, lon: 8.5456, alt: 10}, {lat: 47.3979, lon: 8.5456, alt: 10}]\n",
    "list.json": '{"waypoints": [[0, 0, 1], [5, 0, 1]]}\n',
    "bare.csv": "0,0,1\n4,0,1\n",
    "gps.csv": "lat,lon,alt\n47.4,8.5,10\n47.401,8.5,12\n",
    "notes.txt": "fly around the tree\n",
}

MISTAKES = [
    ("plan none.csv", "none.csv cannot be read"),
    ("plan set.csv", "setpoints are planned already"),
    ("plan ragged.csv", "line 3: 2 numbers, but there are 3 columns"),
    ("plan text.csv", "line 3: z is 'abc'"),
    ("plan one.csv", "at least 2 waypoints, not 1"),
    ("plan twice.csv", "waypoints 0 and 1 are both (0, 0, 1): remove one"),
    ("plan empty.csv", "is empty"),
    ("plan mm.csv", "convert it to m"),
    ("plan below.csv", "give --from-frame ned, or enu"),
    ("plan names.csv", "column 'east' is not known; the columns are x,y,z"),
    ("plan typo.yaml", "'limit' is not known: did you mean limits"),
    ("plan list.yaml", "needs a list of waypoints"),
    ("plan notes.txt", "notes.txt"),
    ("plan w.csv --corridor -1", "must be positive"),
    ("plan w.csv --corridor wide", "--corridor is 'wide', which is no number: give one, in metres"),
    ("plan w.csv --corridor 30cm", "--corridor is '30cm', which has a unit: give 0.3, in metres"),
    ("plan w.csv --corridor 0.3,0.3,0.3", "for 2 legs of 3 axes: give one"),
    ("plan w.csv --time 0", "--time is 0.0: it must be positive"),
    ("plan w.csv --max-speed 0", "it must be a positive number"),
    ("compare w.csv w.csv --max-speed nan", "it must be a positive number"),
    ("plan w.csv --max-speed 36km/h", "'36km/h' has a unit: give 10, in m/s"),
    ("plan w.csv --max-acceleration 3m/s^2", "has a unit: give 3, in m/s^2"),
    ("plan w.csv --time 2s", "Invalid value for '--time': '2s' has a unit: give 2, in seconds"),
    ("plan w.csv --time 2,5", "'2,5' has a comma: give 2.5"),
    ("plan w.csv --max-thrust 2g", "'2g' is no number (see"),
    ("circle --radius 200mm", "give 0.2, in metres"),
    ("plan fast.yaml", "'max_speed' is not known: did you mean limits: {speed: 3}?"),
    ("plan slow.yaml", "'speed' is not known: did you mean limits: {speed: 3}?"),
    ("plan trees.yaml", "'obstacles' is not known: did you mean avoid?"),
    ("plan turned.yaml", "gates 0: 'yaw' is not known: did you mean heading_deg?"),
    ("plan places.yaml", "latitudes are those of a CSV lat,lon,alt or a mission"),
    ("plan list.json", "list.json is no plan that was written here: give waypoints as .csv or .yaml"),
    ("check bare.csv", "waypoints have no instants before they are planned"),
    ("line 0 0 1 10 0 1", "such as --start 0 0 1 --goal 10 0 1"),
    ("line --end 10,0,1", "No such option: --end: did you mean --goal?"),
    ("helix --climb 1", "did you mean --pitch?"),
    (
        "convert set.csv other.csv --rate 10",
        "keep their instants: --rate is of a trajectory that is sampled; leave it out, or give --tolerance 1mm",
    ),
    (
        "plan gps.csv --origin 47.4 8.5 488",
        "lies below its origin throughout (z from -478 to -476 m): both altitudes are",
    ),
    ("rect 4 3", "each number has an option before it, such as --width 4 --length 3"),
    ("plan w.csv --yaw-at-start 90", "--yaw-at-start 90 is for a heading along the velocity"),
    ("plan w.csv --yaw velocity --yaw-at-start 1e9", "--yaw-at-start is 1e+09: give an angle in degrees"),
    ("plan w.csv --vehicle f330", "give -o FILE with it; the limits of a vehicle are asked for by vehicle: NAME"),
    ("fly w.csv", "No such command 'fly': did you mean 'stream'?"),
    ("swarm w.csv", "did you mean 'fleet'?"),
    ("tune set.csv set.csv --limits crazyflie", "crazyflie is the name of a vehicle, and no file"),
    ("plan w.csv --max-tilt 95", "95 degrees: it must be below 90"),
    ("plan w.csv --yaw north", "it takes degrees, velocity, tilt or free"),
    ("plan w.csv --degree 6", "it must be odd"),
    ("plan w.csv --from-frame nwu", "choose one of enu, ned"),
    ("plan w.csv --vehicle dji -o o.csv", "give f330, crazyflie, px4-sih, or a YAML file"),
    ("plan w.csv --time 10 -o o.xlsx", "cannot be written by its ending"),
    ("plan w.csv --time 10 -o none/o.csv", "cannot be written"),
    ("plan w.csv --time 10 --plot o.jpg", ".png, .svg, .pdf"),
    ("rect --widht 6", "--width"),
    ("rect --width 0", "the width is 0.0: it must be a positive number"),
    ("rect --no-corridor --corridor 0.3", "exclude each other"),
    ("circle --radius -2 -o o.csv", "the radius is -2.0"),
    ("circle --period 6 --speed 2", "exclude each other: give one"),
    ("retc", "Did you mean 'rect'?"),
    ("check w.csv", "waypoints have no instants before they are planned"),
    ("simulate w.csv", "waypoints have no instants before they are planned"),
    ("simulate w.csv --wind 3", "requires 3 arguments. (see minsnap simulate --help)"),
    ("plot set.csv", "--output"),
    ("convert w.csv o.foo", "o.foo cannot be written by its ending"),
    ("fit w.csv", "w.csv is no log of a flight"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("words", "said"), MISTAKES, ids=[words for words, _ in MISTAKES])
def test_a_mistake_is_one_sentence_status_2_and_no_file(call, tmp_path, words, said):
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    run = call(*words.split())
    assert run.returncode == 2 and run.stdout == ""
    assert run.stderr.startswith("minsnap: ") and run.stderr.count("\n") == 1 and said in run.stderr
    assert {file.name for file in tmp_path.iterdir()} == set(FILES)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: minsnap.line(length=5.0), "line has no argument length: write start= and end="),
        (lambda: minsnap.circle(diameter=3.0), "circle has no argument diameter: write radius="),
        (lambda: minsnap.circle(raduis=3.0), "circle has no argument 'raduis': did you mean radius?"),
        (lambda: minsnap.rectangle(speed=3.0), "write limits=Limits"),
        (lambda: minsnap.helix(turns=3), "write laps="),
        (lambda: minsnap.lemniscate(size=3.0), "write length= and width="),
    ],
)
def test_shapes_name_the_argument_that_is_meant(made, said):
    with pytest.raises(ArgumentNameError) as refused:
        made()
    assert said in str(refused.value)


def test_a_tilt_in_degrees_is_told_in_radians():
    with pytest.raises(minsnap.errors.LimitError, match="30 degrees are 0.5236 rad"):
        minsnap.Limits(tilt=30)


def test_a_tilt_beyond_the_level_is_told_in_both_units():
    """95 degrees of a page were told as 1.658 rad, and as degrees that would be 0.029 rad."""
    with pytest.raises(minsnap.errors.LimitError) as refused:
        minsnap.Limits(tilt=np.deg2rad(95.0))
    assert str(refused.value).startswith("tilt is 1.658 rad (95 degrees): ")
    assert str(refused.value).endswith("below 1.571 rad (90 degrees)")


def test_a_wrong_key_of_a_request_is_told_the_one_that_is_meant(call, tmp_path):
    """It was taken for a key of a course, among whose keys the right one is not."""
    (tmp_path / "a.yaml").write_text("waypoints: [[0, 0, 1], [8, 0, 1]]\ntotal_tme: 10\n")
    done = call("plan", "a.yaml")
    assert done.returncode == 2 and "'total_tme' is not known: did you mean total_time? " in done.stderr
    assert ", corridor, room, " in done.stderr and ", laps, " in done.stderr


def test_a_coordinate_that_overflows_is_one_sentence(process, tmp_path):
    """A warning of NumPy came before it."""
    (tmp_path / "a.csv").write_text("x,y,z\n0,0,1\n1e300,0,1\n")
    said = process("plan", "a.csv").stderr
    assert said.startswith("minsnap: waypoint 1 is (1e+300, 0, 1): ") and said.count("\n") == 1


@pytest.mark.parametrize("shape", ["eight", "circle", "helix"])
def test_a_shape_has_no_legs_in_its_limits(call, shape):
    """The number of an inner polynomial was told as that of a leg."""
    told = json.loads(call(shape, "--max-speed", "2", "--json").stdout)
    assert told["legs"] is None and {used["leg"] for used in told["limits"]} == {None}
    done = call(shape, "--max-speed", "2")
    assert "limit speed" in done.stdout and "on leg" not in done.stdout

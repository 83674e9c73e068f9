"""The public header of C and C++ programs: its structs, the bits of its plans, and what it says of bad input."""

import ctypes
import re
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from c_programs import HEADERS, TESTS, build, link_flags
from c_structs import structs_of

import minsnap
from minsnap.basics.version import __version__
from minsnap.limits.vehicle_use import medium_of
from minsnap.native import library
from minsnap.native.build import INCLUDE
from minsnap.native.library import core
from minsnap.native.status import Status
from minsnap.vehicle import BodyDrag
from minsnap.vehicle.quadrotor import named_vehicle

pytestmark = pytest.mark.skipif(core().library is None, reason="there is no native core")

HEADER = INCLUDE / "minsnap.h"
KINDS = ("vehicle", "limits", "problem", "curve")
RECTANGLE = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
LINE = [(0, 0, 1), (4, 1, 1.5), (7, -1, 2)]
BOXES = minsnap.Boxes([(-1, -1, 0), (3, -2, 0)], [(5, 1.02, 3), (8, 1.02, 3)])
SIDES = [(1, 1, 0), (-1, 1, 0), (0, -1, 0.5), (0, 0, 1), (0, 0, -2), (1, 0, 0), (-1, 0, 0)]
POLYTOPES = minsnap.Polytopes([([*SIDES, (0, 1, 0)], [8.5] * 7 + [1.03]), (SIDES, [8.5] * 7)])
USUAL = minsnap.Limits(speed=3.0, acceleration=4.0, jerk=30.0)
LIFTED = {"max_thrust": 1.6, "min_thrust": 0.5, "tilt": 0.5, "speed": 4.0, "jerk": 30.0}
START = {"velocity": (1, 0, 0), "acceleration": (0, 0.5, 0)}


def gate(center, normal, crossing=0):
    """An opening of 1.2 m by 0.8 m."""
    return minsnap.Gate(center, normal, 1.2, 0.8, crossing=crossing, margin=0.1)


START_GATE = gate(RECTANGLE[0], (0, -1, 0), -1)
LAP = [START_GATE, RECTANGLE[1], gate(RECTANGLE[2], (0, 3, 4)), RECTANGLE[3], START_GATE]
BALLS = {"waypoint_tolerance": minsnap.Ball([0, 0.3, 0, 0.3, 0])}
PLANS = {
    "durations": (RECTANGLE, {"durations": [4, 2, 4, 2]}),
    "tube": (RECTANGLE, {"durations": [4, 2, 4, 2], "corridor": 0.3}),
    "tube of two pieces a leg": (RECTANGLE, {"durations": [4, 2, 4, 2], "corridor": 0.3, "pieces": 2}),
    "total": (RECTANGLE, {"total_time": 12.0}),
    "total in a tube": (RECTANGLE, {"total_time": 12.0, "corridor": 0.3}),
    "lap": (RECTANGLE, {"durations": [4, 2, 4, 2], "closed": True}),
    "lap in a tube, total": (RECTANGLE, {"total_time": 12.0, "corridor": 0.5, "closed": True}),
    "degree 9": (RECTANGLE, {"durations": [4, 2, 4, 2], "corridor": 0.5, "degree": 9}),
    "moving start": (LINE, {"durations": [2, 2], "start": START}),
    "moving start, total and a ball": (
        LINE,
        {"total_time": 4.0, "start": START, "waypoint_tolerance": minsnap.Ball(0.3)},
    ),
    "moving start in a tube": (LINE, {"durations": [2, 2], "start": START, "corridor": 0.6}),
    "boxes": (LINE, {"durations": [2, 2], "corridor": BOXES}),
    "boxes and a ball": (LINE, {"durations": [2, 2], "corridor": BOXES, "waypoint_tolerance": minsnap.Ball(0.4)}),
    "polytopes": (LINE, {"durations": [2, 2], "corridor": POLYTOPES}),
    "limits, one piece": (RECTANGLE, {"limits": USUAL, "pieces": 1}),
    "limits": (RECTANGLE, {"limits": USUAL}),
    "limits in a tube": (RECTANGLE, {"limits": USUAL, "corridor": 0.3}),
    "limits and a ball": (LINE, {"limits": USUAL, "waypoint_tolerance": minsnap.Ball(0.3)}),
    "limits from a moving start": (LINE, {"limits": USUAL, "start": {"velocity": (1, 0, 0)}}),
    "limits in boxes": (LINE, {"limits": USUAL, "corridor": BOXES}),
    "thrust and tilt": (RECTANGLE, {"limits": minsnap.Limits(**LIFTED)}),
    "thrust, tilt and body rate": (RECTANGLE, {"limits": minsnap.Limits(**LIFTED, body_rate=3.0)}),
    "limits, six pieces": (LINE, {"limits": USUAL, "pieces": 6}),
    "limits, degree 5": (LINE, {"limits": USUAL, "degree": 5}),
    "limits, degree 9, in a tube": (RECTANGLE, {"limits": USUAL, "degree": 9, "corridor": 0.4}),
    "limits in the plane": ([(0, 0), (5, 0), (5, 3)], {"limits": USUAL}),
    "yaws": (RECTANGLE, {"durations": [4, 2, 4, 2], "yaw": [0, 1.5, 3.2, -1.6, 7]}),
    "lap within limits with yaws": (RECTANGLE, {"limits": USUAL, "closed": True, "yaw": [0.1, 1, 5, -3, 0.1]}),
    "gate": ([LINE[0], gate(LINE[1], (1, 0, 0)), LINE[2]], {"durations": [2, 2]}),
    "slanted gate, total": ([LINE[0], gate(LINE[1], (3, -4, 0), 1), LINE[2]], {"total_time": 4.0}),
    "gate of three corners, total": (
        [LINE[0], minsnap.Gate.polygon([(4, 0, 1), (4, 2, 1), (4, 1, 2.5)], margin=0.1), LINE[2]],
        {"total_time": 4.0},
    ),
    "gates within limits": (
        [
            RECTANGLE[0],
            gate(RECTANGLE[1], (1, 1, 0)),
            gate(RECTANGLE[2], (0, 0, 1), -1),
            gate(RECTANGLE[3], (-1, 0, 1)),
            RECTANGLE[4],
        ],
        {"limits": USUAL},
    ),
    "lap of gates and balls within limits": (LAP, {"limits": USUAL, "pieces": 1, "closed": True, **BALLS}),
    "lap of gates and balls, total": (LAP, {"total_time": 12.0, "closed": True, **BALLS}),
}
"""The plans of tests/cpp/plans.cpp, as Python asks for them."""


def digest(curve):
    """The digest of tests/cpp/plans.cpp, of all bits of a trajectory and its heading."""
    value = 14695981039346656037
    turns = [] if curve.yaw.polynomial is None else [curve.yaw.polynomial.control_points]
    for array in (curve.durations, curve.control_points, *turns):
        for byte in (np.ascontiguousarray(array) + 0.0).tobytes():
            value = (value ^ byte) * 1099511628211 % 2**64
    return f"{value:016x}"


def stored():
    lines = (TESTS / "digests.txt").read_text(encoding="utf-8").splitlines()
    return {name: digits for digits, name in (line.split(" ", 1) for line in lines)}


def test_every_plan_of_the_cpp_tests_is_compared():
    assert stored().keys() == PLANS.keys()


@pytest.mark.parametrize("name", PLANS)
def test_python_plans_have_the_bits_of_those_from_cpp(name):
    waypoints, asked = PLANS[name]
    assert digest(minsnap.plan(waypoints, **asked)) == stored()[name]


def array(values):
    return np.ascontiguousarray(values, dtype=np.float64)


@pytest.mark.parametrize(
    ("name", "further"),
    [("crazyflie", None), ("dji_f330", None), ("dji_f330", {"tilt": 0.5, "max_thrust": 1.4, "body_rate": 2.5})],
)
def test_the_certificate_of_python_confirms_what_rotors_keep(name, further):
    """With further limits in the vehicle's drag, too."""
    structs, native = structs_of(HEADER), core().library
    made = {kind: structs[f"minsnap_{kind}"](size=ctypes.sizeof(structs[f"minsnap_{kind}"])) for kind in KINDS}
    vehicle = named_vehicle(name)
    vehicle = vehicle if further else replace(vehicle, drag=BodyDrag())
    body = made["vehicle"]
    body.mass, body.reserve, (body.least, body.most) = vehicle.mass, 0.1, vehicle.rotor_thrust_limits
    body.inertia[:], body.mixer[:] = vehicle.inertia.reshape(-1), vehicle.inverse_mixer.reshape(-1)
    body.drag[:] = medium_of(vehicle).values[1:]
    made["limits"].vehicle, made["limits"].jerk = ctypes.addressof(body), 60.0
    for limit, value in (further or {}).items():
        setattr(made["limits"], limit, value)
    points, planner, problem, curve = array(LINE), ctypes.c_void_p(), made["problem"], made["curve"]
    problem.dim, problem.waypoints, problem.points = 3, len(LINE), points.ctypes.data
    problem.limits = ctypes.addressof(made["limits"])
    assert native.minsnap_open(library.ABI, ctypes.byref(planner)) == 0
    assert native.minsnap_plan(planner, ctypes.byref(problem), ctypes.byref(curve)) == 0
    count = curve.legs * curve.pieces
    durations = np.array((ctypes.c_double * count).from_address(curve.durations))
    controls = np.array((ctypes.c_double * (24 * count)).from_address(curve.points)).reshape(-1, 8, 3)
    native.minsnap_close(planner)
    flown = minsnap.Trajectory(controls, durations, pieces=curve.pieces)
    assert bool(further) == any(body.drag)
    limits = minsnap.Limits.of(vehicle, 0.1, jerk=60.0, **further or {})
    assert minsnap.certify(flown, LINE, limits=limits).ok
    assert flown.duration < 1.2 * minsnap.plan(LINE, limits=limits).duration


@pytest.mark.parametrize(
    ("limits", "ball"),
    [
        ({"speed": 3.0, "acceleration": 4.0, "jerk": 30.0}, 0.0),
        ({"acceleration": 4.0}, 0.2),
        ({"speed": 3.0}, 0.2),
        ({"max_thrust": 1.7, "tilt": 0.6}, 0.0),
        ({"acceleration": 4.0, "jerk": 20.0, "snap": 300.0}, 0.2),
        ({"max_thrust": 1.7, "body_rate": 4.0}, 0.0),
    ],
)
def test_the_least_time_is_that_of_python(limits, ball):
    structs, native = structs_of(HEADER), core().library
    planner, seconds, points, radii = ctypes.c_void_p(), ctypes.c_double(), array(LINE), array([0.0, ball, 0.0])
    assert native.minsnap_open(library.ABI, ctypes.byref(planner)) == 0
    bounds = structs["minsnap_limits"](size=ctypes.sizeof(structs["minsnap_limits"]), **limits)
    known = {"dim": 3, "waypoints": len(LINE), "points": points.ctypes.data, "radii": radii.ctypes.data}
    asked = structs["minsnap_problem"](size=ctypes.sizeof(structs["minsnap_problem"]), **known)
    asked.limits = ctypes.addressof(bounds)
    assert native.minsnap_least_time(planner, ctypes.byref(asked), ctypes.byref(seconds)) == 0
    native.minsnap_close(planner)
    tolerance = minsnap.Ball(ball) if ball else None
    bound = minsnap.least_time(LINE, minsnap.Limits(**limits), waypoint_tolerance=tolerance)
    assert seconds.value == pytest.approx(bound.seconds, rel=1e-6)


def test_versions_agree():
    text = HEADER.read_text(encoding="utf-8")
    assert re.search(r'#define MINSNAP_VERSION "(.*)"', text)[1] == __version__
    assert int(re.search(r"#define MINSNAP_ABI (\d+)", text)[1]) == library.ABI
    native = core().library
    native.minsnap_version.restype = ctypes.c_char_p
    assert native.minsnap_version().decode() == __version__


def test_statuses_of_the_header_are_those_of_the_core():
    known = re.findall(r"MINSNAP_(\w+) = (\d+),? +/\*", HEADER.read_text(encoding="utf-8"))
    assert {name: int(number) for name, number in known} == {status.name: status.value for status in Status}


def test_every_field_has_a_comment_and_stands_where_ctypes_puts_it(tmp_path):
    structs = structs_of(HEADER)
    lines = [
        f'printf("%zu %zu\\n", offsetof({name}, {field}), sizeof(((({name} *)0)->{field})));'
        for name, struct in structs.items()
        for field, _ in struct._fields_
    ]
    source = tmp_path / "offsets.c"
    source.write_text(
        "#include <minsnap.h>\n#include <stddef.h>\n#include <stdio.h>\nint main(void) {"
        + "\n".join(lines)
        + "return 0; }"
    )
    printed = subprocess.run([build(source, tmp_path / "offsets")], capture_output=True, text=True, check=True).stdout
    own = [
        f"{getattr(struct, field).offset} {getattr(struct, field).size}"
        for struct in structs.values()
        for field, _ in struct._fields_
    ]
    assert len(own) > 40 and printed.splitlines() == own


@pytest.mark.parametrize("program", ["plans.cpp", "bad_input.cpp", "warm.cpp", "from_c.c"])
def test_programs_that_know_the_header_alone(tmp_path, program):
    made = build(TESTS / program, tmp_path / "program", *link_flags())
    run = subprocess.run([made, TESTS / "digests.txt"], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr


@pytest.mark.parametrize("header", HEADERS)
def test_headers_compile_alone_and_without_warnings(tmp_path, header):
    source = tmp_path / ("alone.cpp" if header.endswith("pp") else "alone.c")
    source.write_text(f"#include <{header}>\n#include <{header}>\nint main(void) {{ return 0; }}\n")
    strict = ["-Werror", "-Wall", "-Wextra", "-pedantic", "-Wshadow", "-Wconversion"]
    build(source, tmp_path / "alone", *strict, *link_flags())

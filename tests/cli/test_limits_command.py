"""The command that reads limits from a vehicle, in a file that plan takes."""

import json
import math
from dataclasses import replace

import pytest
from standin import StandIn

import minsnap
from minsnap.flight.mavlink.parameters import autopilot_limits
from minsnap.vehicle import BodyDrag, Quadrotor

PARAMETERS = {"MPC_XY_VEL_MAX": 12.0, "MPC_TILTMAX_AIR": 45.0, "MC_YAWRATE_MAX": 200.0}


@pytest.mark.slow
def test_limits_are_printed_and_planned_with(call, tmp_path):
    with StandIn(parameters=PARAMETERS) as vehicle:
        link = f"udpout:127.0.0.1:{vehicle.port}"
        done = call("limits", "--connect", link, "--vehicle", "px4-sih", "-o", "course.yaml")
        assert done.returncode == 0, done.stderr
        assert "horizontal_speed: 4.9" in done.stdout
        told = json.loads(call("limits", "--connect", link, "--drag", 1.0, "--json").stdout)
        craft = replace(Quadrotor.px4_sih(), mass=2.0, drag=BodyDrag((0.0, 0.0, 0.0), (0.2, 0.1, 0.1)))
        craft.to_yaml(tmp_path / "blunt.yaml")
        blunt = json.loads(call("limits", "--connect", link, "--vehicle", "blunt.yaml", "--json").stdout)
        both = call("limits", "--connect", link, "--vehicle", "blunt.yaml", "--drag", 1.0)
    assert both.returncode == 2 and "exclude each other" in both.stderr
    assert told["horizontal_speed"] == 4.903
    assert 0.1 * blunt["horizontal_speed"] ** 2 == pytest.approx(0.5 * 9.80665, rel=2e-3), "of its drag at that speed"
    course = tmp_path / "course.yaml"
    course.write_text(course.read_text() + "waypoints: [[0, 0, 2], [30, 0, 2], [30, 20, 2]]\n")
    planned = call("plan", "course.yaml", "-o", "path.csv", "--json")
    assert planned.returncode == 0, planned.stderr
    assert json.loads(planned.stdout)["max_speed"] < math.hypot(4.91, 3.0)


VERTICAL = {"MPC_Z_VEL_MAX_UP": 3.0, "MPC_Z_VEL_MAX_DN": 1.5, "MPC_ACC_UP_MAX": 4.0, "MPC_ACC_DOWN_MAX": 3.0}
RATES = {"MC_ROLLRATE_MAX": 220.0, "MC_PITCHRATE_MAX": 220.0}


@pytest.mark.slow
def test_a_plan_of_the_file_keeps_the_vehicles_own_limits_and_no_ordinary_ones(call, tmp_path):
    """Three metres a second and 6 m/s^2 held, which stood in neither."""
    with StandIn(parameters=PARAMETERS | VERTICAL | RATES | {"MPC_XY_P": 1.1}) as vehicle:
        link = f"udpout:127.0.0.1:{vehicle.port}"
        done = call("limits", "--connect", link, "-o", "course.yaml", "--loop", "loop.yaml", "--drag", 0.5)
    assert done.returncode == 0, done.stderr
    course = tmp_path / "course.yaml"
    course.write_text(course.read_text() + "waypoints: [[0, 0, 2], [40, 0, 2], [40, 20, 12]]\n")
    told = json.loads(call("plan", "course.yaml", "--json").stdout)
    names = {used["name"] for used in told["limits"]}
    assert {"climb_speed", "descent_speed", "vertical_acceleration", "jerk", "yaw_rate", "tilt"} <= names
    assert not names & {"speed", "acceleration"}
    assert told["max_speed"] > 6.0
    loop = minsnap.Loop.from_yaml(tmp_path / "loop.yaml")
    assert (loop.position_gain[0], loop.drag[0], loop.climb_speed) == (1.1, 0.5, 3.0)


def test_a_vehicle_that_tells_no_vertical_acceleration_has_that_of_ordinary_flight():
    limits = autopilot_limits("px4", PARAMETERS | RATES)
    assert (limits.vertical_acceleration, limits.climb_speed, limits.descent_speed) == (6.0, 3.0, 3.0)
    assert limits.jerk == pytest.approx(9.80665 * limits.body_rate, rel=1e-3)
    assert autopilot_limits("px4", PARAMETERS | VERTICAL).vertical_acceleration == pytest.approx(2.7)


COPTER_4_7 = {"WP_SPD": 10.0, "WP_SPD_UP": 2.5, "WP_SPD_DN": 1.5, "WP_ACC": 2.5, "WP_ACC_Z": 1.0, "ATC_ANGLE_MAX": 30.0}


@pytest.mark.slow
def test_an_arducopter_of_4_7_answers_by_its_new_names(call):
    """It was said not to have answered."""
    with StandIn(autopilot="ardupilot", parameters=COPTER_4_7 | {"PSC_JERK_NE": 5.0}) as vehicle:
        done = call("limits", "--connect", f"udpout:127.0.0.1:{vehicle.port}", "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["horizontal_speed"] == 9.0 and told["horizontal_acceleration"] == 2.25 and told["jerk"] == 4.5

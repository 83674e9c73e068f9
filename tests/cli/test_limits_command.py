"""The command that reads limits from a vehicle, in a file that plan takes."""

import json
from dataclasses import replace

import pytest
from standin import StandIn

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
    assert json.loads(planned.stdout)["max_speed"] < 4.91


COPTER_4_7 = {"WP_SPD": 10.0, "WP_SPD_UP": 2.5, "WP_SPD_DN": 1.5, "WP_ACC": 2.5, "WP_ACC_Z": 1.0, "ATC_ANGLE_MAX": 30.0}


@pytest.mark.slow
def test_an_arducopter_of_4_7_answers_by_its_new_names(call):
    """It was said not to have answered."""
    with StandIn(autopilot="ardupilot", parameters=COPTER_4_7 | {"PSC_JERK_NE": 5.0}) as vehicle:
        done = call("limits", "--connect", f"udpout:127.0.0.1:{vehicle.port}", "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["horizontal_speed"] == 9.0 and told["horizontal_acceleration"] == 2.25 and told["jerk"] == 4.5

"""Parameters held against a flight: read over MAVLink as both autopilots encode them, judged, written only if named."""

import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
from flying import PATH
from px4_parameters import PX4
from standin import StandIn, mavlink

from minsnap.errors import LinkError
from minsnap.flight.mavlink.link import Clock, open_link
from minsnap.flight.mavlink.parameters import Parameter, Parameters
from minsnap.flight.mavlink.preflight import RULES, FlightNeeds, check_parameters, flight_needs, rule_parameters

COPTER = {
    "GUID_TIMEOUT": 1.0,
    "WPNAV_SPEED": 1000.0,
    "WPNAV_SPEED_UP": 250.0,
    "WPNAV_SPEED_DN": 150.0,
    "WPNAV_ACCEL": 500.0,
    "WPNAV_ACCEL_Z": 250.0,
    "ANGLE_MAX": 3000.0,
    "PSC_ANGLE_MAX": 0.0,
    "PSC_JERK_XY": 10.0,
    "PSC_JERK_Z": 5.0,
    "FENCE_ENABLE": 1,
    "FENCE_TYPE": 7,
    "FENCE_ALT_MAX": 100.0,
    "FENCE_RADIUS": 300.0,
}
NEEDS = FlightNeeds(
    speed=5.0, climb=1.0, sink=1.0, acceleration=4.0, lift=2.0, tilt=math.radians(22.0), height=3.0, reach=8.0
)


def found(stack, values, needs=NEEDS):
    parameters = {name: Parameter(name, value) for name, value in values.items()}
    return {finding.name: finding for finding in check_parameters(stack, parameters, needs)}


@pytest.mark.parametrize(("stack", "values"), [("px4", PX4), ("ardupilot", COPTER)])
def test_good_parameters_fit(stack, values):
    assert set(rule_parameters(stack)) == set(values)
    assert [f for f in found(stack, values).values() if f.problem] == []


BAD = [
    ("px4", "COM_OF_LOSS_T", 0.3, "leaves OFFBOARD after a pause of 0.3 s"),
    ("px4", "COM_OF_LOSS_T", 5.0, "flies its last setpoint for 5 s"),
    ("px4", "COM_OBL_RC_ACT", 3, "climbs to RTL_RETURN_ALT .60 m."),
    ("px4", "COM_OBL_RC_ACT", 0, "a pilot must take over"),
    ("px4", "COM_OBL_RC_ACT", 7, "motors are stopped"),
    ("px4", "COM_RCL_EXCEPT", 0, "add 4"),
    ("px4", "MPC_XY_VEL_MAX", 4.9, "horizontal speed is cut at 4.9 m/s, and the flight needs 5 m/s"),
    ("px4", "MPC_Z_VEL_MAX_UP", 0.5, "climbing is cut"),
    ("px4", "MPC_Z_VEL_MAX_DN", 0.9, "descending is cut"),
    ("px4", "GF_MAX_HOR_DIST", 6.0, "the fence ends 6 m from home, and the file goes 8 m"),
    ("px4", "GF_MAX_VER_DIST", 2.5, "the fence ends 2.5 m above home, and the file goes 3 m"),
    ("px4", "MPC_TILTMAX_AIR", 20.0, "tilt is cut at 20 deg, and the flight needs 22 deg"),
    ("px4", "EKF2_EV_CTRL", 8, "not their horizontal position"),
    ("px4", "EKF2_HGT_REF", 0, "the height still follows the barometer"),
    ("px4", "EKF2_HGT_REF", 1, "the height still follows GPS: 3 takes it"),
    ("ardupilot", "GUID_TIMEOUT", 3.0, "flies on for 3 s, up to 15 m"),
    ("ardupilot", "WPNAV_SPEED", 450.0, "cut at 4.5 m/s"),
    ("ardupilot", "WPNAV_SPEED_UP", 90.0, "climbing is cut at 0.9 m/s"),
    ("ardupilot", "WPNAV_SPEED_DN", 90.0, "descending is cut at 0.9 m/s"),
    ("ardupilot", "WPNAV_ACCEL", 250.0, "acceleration is cut at 2.5 m/s.2, and the flight needs 4"),
    ("ardupilot", "WPNAV_ACCEL_Z", 100.0, "vertical acceleration is cut at 1 m/s.2, and the flight needs 2"),
    ("ardupilot", "ANGLE_MAX", 2000.0, "tilt is cut at 20 deg, and the flight needs 22 deg"),
    ("ardupilot", "PSC_JERK_Z", 2.5, "it takes 0.8 s to build up the flight's 2 m/s.2"),
    ("ardupilot", "PSC_JERK_XY", 5.0, "it takes 0.8 s to build up"),
    ("ardupilot", "PSC_JERK_XY", 0.0, "it takes inf s to build up"),
    ("ardupilot", "FENCE_ALT_MAX", 2.0, "fence ends at 2 m, and the file goes up to 3 m"),
    ("ardupilot", "FENCE_RADIUS", 5.0, "fence ends 5 m from home"),
]


@pytest.mark.parametrize(("stack", "name", "value", "sentence"), BAD)
def test_what_does_not_fit_is_said(stack, name, value, sentence):
    values = {"px4": PX4, "ardupilot": COPTER}[stack] | {name: value}
    problems = {n: f.problem for n, f in found(stack, values).items() if f.problem}
    assert list(problems) == [name]
    assert re.search(sentence, problems[name])


def test_the_position_controllers_own_lean_angle_counts_where_it_is_given():
    assert "cut at 15 deg" in found("ardupilot", COPTER | {"PSC_ANGLE_MAX": 15.0})["ANGLE_MAX"].problem
    assert found("ardupilot", COPTER | {"PSC_ANGLE_MAX": 25.0, "ANGLE_MAX": 1000.0})["ANGLE_MAX"].problem is None


def test_the_height_source_matters_only_where_heights_from_outside_are_fused():
    assert found("px4", PX4 | {"EKF2_HGT_REF": 1, "EKF2_EV_CTRL": 9})["EKF2_HGT_REF"].problem is None


def test_every_rule_is_seen_to_object():
    judged = {name for _, name, _, _ in BAD}
    assert judged == {rule.names[0] for rules in RULES.values() for rule in rules}


NEW_NAMES = {  # as ArduPilot's page of renamed parameters has them
    "WPNAV_SPEED": ("WP_SPD", 0.01),
    "WPNAV_SPEED_UP": ("WP_SPD_UP", 0.01),
    "WPNAV_SPEED_DN": ("WP_SPD_DN", 0.01),
    "WPNAV_ACCEL": ("WP_ACC", 0.01),
    "WPNAV_ACCEL_Z": ("WP_ACC_Z", 0.01),
    "ANGLE_MAX": ("ATC_ANGLE_MAX", 0.01),
    "PSC_JERK_XY": ("PSC_JERK_NE", 1.0),
    "PSC_JERK_Z": ("PSC_JERK_D", 1.0),
}
LATEST = {"PSC_JERK_NE": "PSC_NE_JERK", "PSC_JERK_D": "PSC_D_JERK"}  # 4.7.1


def renamed(values, latest):
    newer = {
        NEW_NAMES[name][0] if name in NEW_NAMES else name: NEW_NAMES.get(name, ("", 1.0))[1] * value
        for name, value in values.items()
    }
    return {LATEST.get(name, name) if latest else name: value for name, value in newer.items()}


@pytest.mark.parametrize("latest", [False, True])
@pytest.mark.parametrize(("stack", "name", "value", "sentence"), [row for row in BAD if row[0] == "ardupilot"])
def test_arducopter_4_7_is_held_to_the_same_by_its_own_names(stack, name, value, sentence, latest):
    assert [f for f in found(stack, renamed(COPTER, latest)).values() if f.problem or not f.known] == []
    problems = {n: f.problem for n, f in found(stack, renamed(COPTER | {name: value}, latest)).items() if f.problem}
    assert list(problems) == list(renamed({name: value}, latest))
    assert re.search(sentence, problems[list(problems)[0]])


def test_a_plan_that_the_vehicle_cuts_is_refused_and_what_may_happen_is_said():
    """`preflight` said that it does not fit, and `stream` flew it."""
    for stack, name, value, _ in BAD:
        refused = name.startswith(("MPC_", "WPNAV_", "ANGLE_MAX", "GF_", "FENCE_"))
        assert found(stack, {"px4": PX4, "ardupilot": COPTER}[stack] | {name: value})[name].grave == refused, name


def test_an_unanswered_parameter_is_neither_good_nor_bad():
    values = {name: value for name, value in PX4.items() if name != "RTL_RETURN_ALT"}
    finding = found("px4", values)["COM_OBL_RC_ACT"]
    assert not finding.known and finding.problem is None and finding.unanswered == ("RTL_RETURN_ALT",)


def test_needs_are_those_of_the_samples():
    needs = flight_needs(PATH)
    velocity, acceleration = PATH.velocity, PATH.acceleration
    assert needs.speed == np.linalg.norm(velocity[:, :2], axis=1).max()
    assert needs.climb == velocity[:, 2].max() and needs.sink == -velocity[:, 2].min()
    assert needs.lift == np.abs(acceleration[:, 2]).max()
    thrust = acceleration + [0, 0, 9.80665]
    tilt = np.arccos(thrust[:, 2] / np.linalg.norm(thrust, axis=1)).max()
    assert needs.tilt == pytest.approx(tilt, abs=1e-12) and needs.height == PATH.position[:, 2].max()


@pytest.mark.slow
@pytest.mark.parametrize(("stack", "values"), [("px4", PX4), ("ardupilot", COPTER)])
def test_parameters_are_read_and_written_as_the_autopilot_encodes_them(stack, values):
    clock = Clock()
    with StandIn(autopilot=stack, parameters=dict(values)) as vehicle:
        link = open_link(f"udpout:127.0.0.1:{vehicle.port}", clock)
        try:
            link.wait_for_vehicle(10.0)
            parameters = Parameters(link, clock)
            read = parameters.read([*values, "NO_SUCH_NAME"])
            assert {name: p.value for name, p in read.items()} == values and vehicle.written == []
            name = "COM_OBL_RC_ACT" if stack == "px4" else "FENCE_TYPE"
            assert parameters.write(name, 5).value == 5 == vehicle.parameters[name]
            with pytest.raises(LinkError, match="is an integer: it cannot be 1.5"):
                parameters.write(name, 1.5)
            for unknown in ("NO_SUCH_NAME", "COM_ÖBL", "COM_OBL_RC_ACT_AND_MORE", ""):
                with pytest.raises(LinkError, match=f"has no parameter {unknown}"):
                    parameters.write(unknown, 1.0)
            real, before = ("COM_OF_LOSS_T" if stack == "px4" else "WPNAV_SPEED"), list(vehicle.written)
            for wrong in ((name, math.nan), (name, -math.inf), (name, 1e11), (real, math.nan), (real, 1e300)):
                with pytest.raises(LinkError, match="cannot hold"):
                    parameters.write(*wrong)
            assert vehicle.written == before
            vehicle.parameters[real] = math.nan
            assert parameters.read([real]) == {}
            vehicle.parameters |= {"WP_ACC": 2.5}
            vehicle.parameters.pop("WPNAV_ACCEL", None)
            with pytest.raises(LinkError, match="has no parameter WPNAV_ACCEL.* it has WP_ACC, and there that is 6$"):
                parameters.write("WPNAV_ACCEL", 600.0)
            assert list(parameters.read_known(["WPNAV_ACCEL"])) == ["WP_ACC"]
        finally:
            link.close()


class Stubborn:
    """A link to a vehicle that answers what it likes when a parameter is set."""

    def __init__(self, autopilot, kind, before, after):
        self.vehicle = SimpleNamespace(autopilot=autopilot, system=1, component=1)
        self.kind, self.value, self.after, self.answers, self.time = kind, before, after, [], 0.0

    def now(self):
        return self.time

    def send(self, message):
        if message.get_type() == "PARAM_SET":
            self.value = self.after
        if self.value is not None:
            told = mavlink.MAVLink_param_value_message(b"NAME", self.value, self.kind, 1, 0)
            self.answers.append(told)

    def pump(self, until):
        self.time, told, self.answers = until, self.answers, []
        return told


@pytest.mark.parametrize(
    ("after", "says"),
    [
        (0.25, "the vehicle did not take NAME = 0.1, and has NAME = 0.25"),
        (1.0, "the vehicle did not take NAME = 0.1, and has NAME = 1"),
        (None, "the vehicle did not confirm NAME = 0.1: it may have that or NAME = 1"),
    ],
)
def test_what_a_vehicle_has_that_does_not_take_a_value_is_what_it_said_last(after, says):
    """It was said to have what it had before, also where it had taken a value between, or had not answered."""
    link = Stubborn(12, 9, 1.0, after)
    with pytest.raises(LinkError, match=f"^{says}$"):
        Parameters(link, link).write("NAME", 0.1)


def test_integers_are_told_and_compared_exactly():
    """2^24 + 1 was sent to ArduPilot as the float beside it, and said to be set."""
    link = Stubborn(3, 6, 0.0, 2.0**24)
    with pytest.raises(LinkError, match="cannot hold"):
        Parameters(link, link).write("NAME", 2.0**24 + 1.0)
    assert link.value == 0.0 and str(Parameter("NAME", 50331651.0, 6)) == "NAME = 50331651"
    assert str(Parameter("NAME", float(np.float32(0.7)))) == "NAME = 0.7"

"""Check of an autopilot's parameters against a flight: each rule reads some parameters and reports conflicts.

Sources: PX4's parameter reference, ArduPilot's list of Copter parameters, and flights of both in simulation
(docs/offboard.rst).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np

from minsnap.basics.arrays import GRAVITY
from minsnap.flight.mavlink.parameters import Parameter
from minsnap.flight.mavlink.stream_options import SafetyRules
from minsnap.trajectory.samples import Samples


@dataclass(frozen=True)
class FlightNeeds:
    """What a setpoint file requires of the vehicle.

    Parameters
    ----------
    speed, climb, sink : float
        Greatest horizontal speed, greatest speed up and down [m/s].
    acceleration, lift : float
        Greatest horizontal acceleration, and greatest vertical one, up or down [m/s^2].
    tilt : float
        Greatest angle between thrust and the vertical, with what is stated to offset drag [rad].
    height : float
        Greatest height of the file [m].
    reach : float
        Greatest horizontal distance from the file's first setpoint [m].
    """

    speed: float = 0.0
    climb: float = 0.0
    sink: float = 0.0
    acceleration: float = 0.0
    lift: float = 0.0
    tilt: float = 0.0
    height: float = 0.0
    reach: float = 0.0


def flight_needs(samples: Samples) -> FlightNeeds:
    """Return the needs of samples in z-up world axes; without velocities or accelerations these are zero."""
    still = np.zeros((1, 3))
    velocity = still if samples.velocity is None else samples.velocity
    acceleration = still if samples.acceleration is None else samples.acceleration
    level = np.hypot(acceleration[:, 0], acceleration[:, 1])
    pull = acceleration if samples.feed_forward is None else acceleration + samples.feed_forward
    away = samples.position[:, :2] - samples.position[0, :2]
    return FlightNeeds(
        speed=float(np.hypot(velocity[:, 0], velocity[:, 1]).max()),
        climb=max(0.0, float(velocity[:, 2].max())),
        sink=max(0.0, float(-velocity[:, 2].min())),
        acceleration=float(level.max()),
        lift=float(np.abs(acceleration[:, 2]).max()),
        tilt=float(np.arctan2(np.hypot(pull[:, 0], pull[:, 1]), GRAVITY + pull[:, 2]).max()),
        height=float(samples.position[:, 2].max()),
        reach=float(np.hypot(away[:, 0], away[:, 1]).max()),
    )


Values = Mapping[str, float]
Judge = Callable[[Values, FlightNeeds], "str | None"]


@dataclass(frozen=True)
class Rule:
    """A condition on some parameters.

    Parameters
    ----------
    names : tuple of str
        Parameters that it needs; the first is the one to change.
    judge : callable
        Takes their values and the flight; returns what does not fit, or None.
    grave : bool
        Whether a flight that does not fit it is refused.
    """

    names: tuple[str, ...]
    judge: Judge
    grave: bool = False


@dataclass(frozen=True)
class Finding:
    """The result of one rule.

    Parameters
    ----------
    parameters : tuple of Parameter
        What it looked at; empty if the vehicle did not answer.
    name : str
        The parameter that it is about.
    problem : str or None
        Why it does not fit; None if it does, or if it is not known.
    seen : str or None
        What was seen, where it is no parameter.
    grave : bool
        Whether a flight with this problem is refused.
    """

    parameters: tuple[Parameter, ...]
    name: str
    problem: str | None
    seen: str | None = None
    grave: bool = False

    @property
    def known(self) -> bool:
        """Whether the vehicle has reported what it is about."""
        return bool(self.parameters) or self.seen is not None


def allows(
    names: tuple[str, ...],
    has: Callable[[Values], float],
    need: Callable[[FlightNeeds], float],
    said: str,
    grave: bool = False,
) -> Rule:
    """Return the rule that parameters allow what the flight needs; ``said`` is formatted with both."""

    def judge(values: Values, needs: FlightNeeds) -> str | None:
        allowed, wanted = has(values), need(needs)
        return None if allowed >= wanted else said.format(allowed, wanted)

    return Rule(names, judge, grave)


def at_least(name: str, need: Callable[[FlightNeeds], float], unit: str, what: str, scale: float = 1.0) -> Rule:
    """Return the rule that a parameter, times ``scale`` in SI units, is not below what the flight needs."""
    said = f"{what} at {{:.4g}} {unit}, and the flight needs {{:.4g}} {unit}"
    return allows((name,), lambda values: scale * values[name], need, said)


def _loss_time(values: Values, needs: FlightNeeds) -> str | None:
    time, gap = values["COM_OF_LOSS_T"], SafetyRules().max_gap
    if time <= gap:
        return f"the vehicle leaves OFFBOARD after a pause of {time:g} s, and this program allows pauses of {gap:g} s"
    return None if time <= 2.0 else f"after a loss of the stream the vehicle flies its last setpoint for {time:g} s"


def _loss_action(values: Values, needs: FlightNeeds) -> str | None:
    action = values["COM_OBL_RC_ACT"]
    if action in (4, 5):
        return None
    climbs = f"returns to launch and climbs to RTL_RETURN_ALT ({values['RTL_RETURN_ALT']:g} m) first"
    if action == 3:
        return f"after a loss of the stream the vehicle {climbs}; 4 lands and 5 holds"
    if action in (0, 1, 2):
        return f"after a loss of the stream a pilot must take over by radio control, without one the vehicle {climbs}"
    return "after a loss of the stream the motors are stopped in the air"


def _radio_exception(values: Values, needs: FlightNeeds) -> str | None:
    if int(values["COM_RCL_EXCEPT"]) & 4 or int(values["COM_RC_IN_MODE"]) == 4:
        return None
    return "without a radio control OFFBOARD ends in a failsafe: add 4 (offboard) if you fly without one"


def _external_pose(values: Values, needs: FlightNeeds) -> str | None:
    control = int(values["EKF2_EV_CTRL"])
    if control == 0 or control & 1:
        return None
    return "poses from outside are fused, but not their horizontal position (bit 0)"


def _height_source(values: Values, needs: FlightNeeds) -> str | None:
    source = {0: "the barometer", 1: "GPS", 2: "the range sensor"}.get(int(values["EKF2_HGT_REF"]))
    if source is None or not int(values["EKF2_EV_CTRL"]) & 2:
        return None
    return f"poses from outside are fused, and the height still follows {source}: 3 takes it from the poses"


def _lean_angle(values: Values) -> float:
    return values["PSC_ANGLE_MAX"] or 0.01 * values["ANGLE_MAX"]


def _tilt(needs: FlightNeeds) -> float:
    return math.degrees(needs.tilt)


def _guided_timeout(values: Values, needs: FlightNeeds) -> str | None:
    time = values["GUID_TIMEOUT"]
    if time <= 1.0:
        return None
    far = needs.speed * time
    return f"after a loss of the stream the vehicle flies on for {time:g} s, up to {far:.3g} m; 1 s is enough"


def jerk_time(name: str, need: Callable[[FlightNeeds], float]) -> Rule:
    """Return the rule that a limit of jerk lets the flight's acceleration build up within half a second."""

    def judge(values: Values, needs: FlightNeeds) -> str | None:
        time = need(needs) / values[name]
        return None if time <= 0.5 else f"it takes {time:.2g} s to build up the flight's {need(needs):.3g} m/s^2"

    return Rule((name,), judge)


def copter_fence(name: str, bit: int, need: Callable[[FlightNeeds], float], said: str) -> Rule:
    """Return the rule that ArduPilot's fence of one type, where it is on, encloses the flight."""

    def has(values: Values) -> float:
        on = int(values["FENCE_ENABLE"]) and int(values["FENCE_TYPE"]) & bit
        return values[name] if on else math.inf

    return allows((name, "FENCE_ENABLE", "FENCE_TYPE"), has, need, said, grave=True)


def px4_fence(name: str, need: Callable[[FlightNeeds], float], where: str) -> Rule:
    """Return the rule that PX4's fence by distance, 0 for none, encloses the flight."""

    def has(values: Values) -> float:
        return values[name] if int(values["GF_ACTION"]) and values[name] > 0.0 else math.inf

    said = f"the fence ends {{:g}} m {where} home, and the file goes {{:.3g}} m"
    return allows((name, "GF_ACTION"), has, need, said, grave=True)


RULES: dict[str, Sequence[Rule]] = {
    "px4": (
        Rule(("COM_OF_LOSS_T",), _loss_time),
        Rule(("COM_OBL_RC_ACT", "RTL_RETURN_ALT"), _loss_action),
        Rule(("COM_RCL_EXCEPT", "COM_RC_IN_MODE"), _radio_exception),
        at_least("MPC_XY_VEL_MAX", attrgetter("speed"), "m/s", "horizontal speed is cut"),
        at_least("MPC_Z_VEL_MAX_UP", attrgetter("climb"), "m/s", "the speed of climbing is cut"),
        at_least("MPC_Z_VEL_MAX_DN", attrgetter("sink"), "m/s", "the speed of descending is cut"),
        at_least("MPC_TILTMAX_AIR", _tilt, "deg", "tilt is cut"),
        px4_fence("GF_MAX_HOR_DIST", attrgetter("reach"), "from"),
        px4_fence("GF_MAX_VER_DIST", attrgetter("height"), "above"),
        Rule(("EKF2_EV_CTRL",), _external_pose),
        Rule(("EKF2_HGT_REF", "EKF2_EV_CTRL"), _height_source),
    ),
    "ardupilot": (
        Rule(("GUID_TIMEOUT",), _guided_timeout),
        at_least("WPNAV_SPEED", attrgetter("speed"), "m/s", "horizontal speed is cut", 0.01),
        at_least("WPNAV_SPEED_UP", attrgetter("climb"), "m/s", "the speed of climbing is cut", 0.01),
        at_least("WPNAV_SPEED_DN", attrgetter("sink"), "m/s", "the speed of descending is cut", 0.01),
        at_least("WPNAV_ACCEL", attrgetter("acceleration"), "m/s^2", "horizontal acceleration is cut", 0.01),
        at_least("WPNAV_ACCEL_Z", attrgetter("lift"), "m/s^2", "vertical acceleration is cut", 0.01),
        allows(
            ("ANGLE_MAX", "PSC_ANGLE_MAX"),
            _lean_angle,
            _tilt,
            "tilt is cut at {:.4g} deg, and the flight needs {:.4g} deg",
        ),
        jerk_time("PSC_JERK_XY", attrgetter("acceleration")),
        jerk_time("PSC_JERK_Z", attrgetter("lift")),
        copter_fence(
            "FENCE_ALT_MAX", 1, attrgetter("height"), "the fence ends at {:g} m, and the file goes up to {:.3g} m"
        ),
        copter_fence(
            "FENCE_RADIUS",
            2,
            attrgetter("reach"),
            "the fence ends {:g} m from home, and the file goes {:.3g} m from its start",
        ),
    ),
    "generic": (),
}
"""By autopilot; each rule names the parameters that it reads."""


def rule_parameters(autopilot: str) -> list[str]:
    """Return the names of all parameters that the rules of an autopilot read."""
    return list(dict.fromkeys(name for rule in RULES[autopilot] for name in rule.names))


def check_parameters(autopilot: str, parameters: Mapping[str, Parameter], needs: FlightNeeds) -> list[Finding]:
    """Check parameters against the needs of a flight.

    Parameters
    ----------
    autopilot : str
        ``px4``, ``ardupilot`` or ``generic``, for which there are no rules.
    parameters : mapping of str to Parameter
        What the vehicle has said.
    needs : FlightNeeds
        Of the file.

    Returns
    -------
    list of Finding
        One a rule.
    """
    findings = []
    for rule in RULES[autopilot]:
        known = tuple(parameters[name] for name in rule.names if name in parameters)
        if len(known) < len(rule.names):
            findings.append(Finding((), rule.names[0], None))
            continue
        values = {parameter.name: parameter.value for parameter in known}
        findings.append(Finding(known, rule.names[0], rule.judge(values, needs), grave=rule.grave))
    return findings

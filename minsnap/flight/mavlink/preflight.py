"""Check of a vehicle before a flight: its parameters against the flight, and a few seconds of its messages.

Sources: PX4's parameter reference, ArduPilot's list of Copter parameters, and flights of both in simulation
(docs/offboard.rst).

Bits are those of MAVLink's MAV_SYS_STATUS_SENSOR.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import GRAVITY, FloatArray
from minsnap.files import local_positions, map_vectors
from minsnap.flight.mavlink.estimates import ESTIMATORS, estimate_faults
from minsnap.flight.mavlink.link import Clock, Link
from minsnap.flight.mavlink.parameters import Parameter, Parameters, meaning_of
from minsnap.flight.mavlink.setpoints import tabulate
from minsnap.flight.mavlink.start_gate import begins_on_ground
from minsnap.flight.mavlink.stream_options import SafetyRules, StreamOptions
from minsnap.flight.mavlink.vehicle_messages import (
    ARDUPILOT,
    Autopilot,
    Message,
    Vector,
    VehicleState,
    command,
    rate_request,
)
from minsnap.trajectory import Samples


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
        Greatest height above home [m].
    reach : float
        Greatest horizontal distance from home [m].
    """

    speed: float = 0.0
    climb: float = 0.0
    sink: float = 0.0
    acceleration: float = 0.0
    lift: float = 0.0
    tilt: float = 0.0
    height: float = 0.0
    reach: float = 0.0

    @property
    def tilt_degrees(self) -> float:
        """The tilt, in the unit of autopilots [deg]."""
        return math.degrees(self.tilt)


ORIGIN: Vector = (0.0, 0.0, 0.0)
"""Where home is taken to be while the vehicle does not tell it: the local origin [m]."""


def flight_needs(samples: Samples, home: Vector = ORIGIN) -> FlightNeeds:
    """Return the needs of samples; without velocities or accelerations these are zero.

    Parameters
    ----------
    samples : Samples
        In z-up world axes.
    home : tuple of 3
        From where fences are measured, in the same axes [m].
    """
    velocity, acceleration = (np.zeros((1, 3)) if v is None else v for v in (samples.velocity, samples.acceleration))
    pull = acceleration if samples.feed_forward is None else acceleration + samples.feed_forward
    away = samples.position - home
    return FlightNeeds(
        speed=float(np.hypot(velocity[:, 0], velocity[:, 1]).max()),
        climb=max(0.0, float(velocity[:, 2].max())),
        sink=max(0.0, float(-velocity[:, 2].min())),
        acceleration=float(np.hypot(acceleration[:, 0], acceleration[:, 1]).max()),
        lift=float(np.abs(acceleration[:, 2]).max()),
        tilt=float(np.arctan2(np.hypot(pull[:, 0], pull[:, 1]), GRAVITY + pull[:, 2]).max()),
        height=float(away[:, 2].max()),
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
        Parameters that it needs, as ArduPilot called them before 4.7; the first is the one to change.
    judge : callable
        Takes their values, in the units of those names, and the flight; returns what does not fit, or None.
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
    unanswered : tuple of str
        Parameters that the vehicle did not answer for.
    """

    parameters: tuple[Parameter, ...]
    name: str
    problem: str | None
    seen: str | None = None
    grave: bool = False
    unanswered: tuple[str, ...] = ()

    @property
    def known(self) -> bool:
        """Whether the vehicle has reported what it is about."""
        return bool(self.parameters) or self.seen is not None


SLACK = 1e-3
"""Share by which a flight may need more than is allowed: numbers are rounded on their way."""


def allows(names: tuple[str, ...], has: Callable[[Values], float], need: str, said: str, grave: bool = False) -> Rule:
    """Return the rule that parameters allow what the flight needs; ``said`` is formatted with both."""

    def judge(values: Values, needs: FlightNeeds) -> str | None:
        allowed, wanted = has(values), getattr(needs, need)
        return None if allowed >= wanted * (1.0 - SLACK) else said.format(allowed, wanted)

    return Rule(names, judge, grave)


def at_least(name: str, need: str, unit: str, what: str, scale: float = 1.0) -> Rule:
    """Return the rule that a parameter, times ``scale`` in SI units, is not below what the flight needs."""
    return allows((name,), lambda values: scale * values[name], need, _cut(what, unit), grave=True)


def _cut(what: str, unit: str) -> str:
    return f"{what} is cut at {{:.4g}} {unit}, and the flight needs {{:.4g}} {unit}"


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


def _guided_timeout(values: Values, needs: FlightNeeds) -> str | None:
    time = values["GUID_TIMEOUT"]
    if time <= 1.0:
        return None
    far = needs.speed * time
    return f"after a loss of the stream the vehicle flies on for {time:g} s, up to {far:.3g} m; 1 s is enough"


def jerk_time(name: str, need: str) -> Rule:
    """Return the rule that a limit of jerk lets the flight's acceleration build up within half a second."""

    def judge(values: Values, needs: FlightNeeds) -> str | None:
        push = getattr(needs, need)
        time = push / values[name] if values[name] > 0.0 else math.inf
        return None if time <= 0.5 or not push else f"it takes {time:.2g} s to build up the flight's {push:.3g} m/s^2"

    return Rule((name,), judge)


def copter_fence(name: str, bit: int, need: str, said: str) -> Rule:
    """Return the rule that ArduPilot's fence of one type, where it is on, encloses the flight."""

    def has(values: Values) -> float:
        on = int(values["FENCE_ENABLE"]) and int(values["FENCE_TYPE"]) & bit
        return values[name] if on else math.inf

    return allows((name, "FENCE_ENABLE", "FENCE_TYPE"), has, need, f"the fence ends {said}", grave=True)


def px4_fence(name: str, need: str, where: str) -> Rule:
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
        at_least("MPC_XY_VEL_MAX", "speed", "m/s", "horizontal speed"),
        at_least("MPC_Z_VEL_MAX_UP", "climb", "m/s", "the speed of climbing"),
        at_least("MPC_Z_VEL_MAX_DN", "sink", "m/s", "the speed of descending"),
        at_least("MPC_TILTMAX_AIR", "tilt_degrees", "deg", "tilt"),
        px4_fence("GF_MAX_HOR_DIST", "reach", "from"),
        px4_fence("GF_MAX_VER_DIST", "height", "above"),
        Rule(("EKF2_EV_CTRL",), _external_pose),
        Rule(("EKF2_HGT_REF", "EKF2_EV_CTRL"), _height_source),
    ),
    "ardupilot": (
        Rule(("GUID_TIMEOUT",), _guided_timeout),
        at_least("WPNAV_SPEED", "speed", "m/s", "horizontal speed", 0.01),
        at_least("WPNAV_SPEED_UP", "climb", "m/s", "the speed of climbing", 0.01),
        at_least("WPNAV_SPEED_DN", "sink", "m/s", "the speed of descending", 0.01),
        at_least("WPNAV_ACCEL", "acceleration", "m/s^2", "horizontal acceleration", 0.01),
        at_least("WPNAV_ACCEL_Z", "lift", "m/s^2", "vertical acceleration", 0.01),
        allows(("ANGLE_MAX", "PSC_ANGLE_MAX"), _lean_angle, "tilt_degrees", _cut("tilt", "deg"), grave=True),
        jerk_time("PSC_JERK_XY", "acceleration"),
        jerk_time("PSC_JERK_Z", "lift"),
        copter_fence("FENCE_ALT_MAX", 1, "height", "at {:g} m, and the file goes up to {:.3g} m, above home"),
        copter_fence("FENCE_RADIUS", 2, "reach", "{:g} m from home, and the file goes {:.3g} m"),
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
        What the vehicle has said, by its own names.
    needs : FlightNeeds
        Of the file.

    Returns
    -------
    list of Finding
        One a rule.
    """
    said = {meaning_of(name)[0]: parameter for name, parameter in parameters.items()}
    findings = []
    for rule in RULES[autopilot]:
        known = tuple(said[name] for name in rule.names if name in said)
        named = said[rule.names[0]].name if rule.names[0] in said else rule.names[0]
        if len(known) < len(rule.names):
            missing = tuple(name for name in rule.names if name not in said)
            findings.append(Finding((), named, None, unanswered=missing))
            continue
        values = {meaning_of(one.name)[0]: meaning_of(one.name)[1] * one.value for one in known}
        findings.append(Finding(known, named, rule.judge(values, needs), grave=rule.grave))
    return findings


@dataclass(frozen=True)
class WatchSettings:
    """How long a vehicle is listened to, and what is worth a word.

    Parameters
    ----------
    listen : float
        For how long [s].
    answered : float
        For how long after the request for its arming checks [s].
    battery : int
        Charge below which a flight is not begun with confidence [%].
    lost : float
        Share of lost messages.
    silent : float
        Longest silence [s].
    start : float
        Distance from the start [m].
    place : float
        Distance of home from the place on the earth where the vehicle is to stand: GPS errs by a metre or two [m].
    rate : float
        At which the vehicle is asked for its state [Hz].
    asked : tuple of str
        The messages of it: a port for a companion computer sends few by itself, and ArduPilot's none.
    """

    listen: float = 3.0
    answered: float = 1.0
    battery: int = 30
    lost: float = 0.05
    silent: float = 1.0
    start: float = 1.0
    place: float = 2.0
    rate: float = 5.0
    asked: tuple[str, ...] = ("SYS_STATUS", "EXTENDED_SYS_STATE", "HOME_POSITION", "LOCAL_POSITION_NED")


WATCHED = WatchSettings()


_PREARM, _AHRS = 0x10000000, 0x200000
_SENSORS = {
    0x1: "gyroscope",
    0x2: "accelerometer",
    0x4: "compass",
    0x8: "barometer",
    0x20: "GPS",
    0x40: "optical flow",
    0x80: "vision position",
    0x8000: "motors",
    0x10000: "radio control",
    0x100000: "geofence",
    _AHRS: "attitude and position estimate",
    0x1000000: "logging",
    0x2000000: "battery",
}


class VehicleWatch:
    """What a vehicle says while it is listened to.

    Parameters
    ----------
    link : Link
        With a vehicle that has been heard.
    clock : Clock
        The same as the link's.
    frame : str
        Its local frame: ``ned`` or ``frd``.
    """

    def __init__(self, link: Link, clock: Clock, frame: str = "ned") -> None:
        self._link, self._clock, self._frame = link, clock, frame
        self._began = self._last = clock.now()
        self._silence = 0.0
        self._received = self._missing = self._strange = 0
        self._number: int | None = None
        self._unknown = link.unknown
        self._ends: deque[int] = deque(maxlen=4)
        self._passed: deque[int] = deque(maxlen=4)
        self._said: dict[str, Message] = {}
        self._estimates: list[Message] = []

    def ask(self) -> None:
        """Ask the vehicle for the messages of its state."""
        estimate = "EKF_STATUS_REPORT" if self._link.vehicle.autopilot == ARDUPILOT else "ESTIMATOR_STATUS"
        for name in (*WATCHED.asked, estimate):
            self._link.send(rate_request(self._link.vehicle, name, WATCHED.rate))

    def take(self, message: Message) -> None:
        """Take note of a message."""
        now = self._clock.now()
        self._silence, self._last = max(self._silence, now - self._last), now
        number, self._received = message.get_seq(), self._received + 1
        self._said[message.get_type()] = message
        self._estimates += [message] if message.get_type() in ESTIMATORS else []
        if number in self._passed:  # not lost, but overtaken on the way
            self._passed.remove(number)
            self._missing -= 1
            return
        missing = 0 if self._number is None else (number - self._number - 1) % 256
        if missing:  # where vehicles take turns, it goes on from where one of them was left
            self._strange += (number - 1) % 256 in self._ends
            self._ends.append(self._number or 0)
            self._missing += missing
            self._passed.extend((number - k) % 256 for k in range(1, missing + 1)[: self._passed.maxlen])
        self._number = number

    def listen(self) -> None:
        """Ask for the arming checks, and listen until :data:`WATCHED.listen` have passed since the beginning."""
        vehicle = self._link.vehicle
        if not vehicle.armed:
            self._link.send(command(vehicle, "MAV_CMD_RUN_PREARM_CHECKS"))
        for message in self._link.pump(max(self._began + WATCHED.listen, self._clock.now() + WATCHED.answered)):
            self.take(message)

    def wait_for_estimate(self, seconds: float, told: Callable[[str], None]) -> None:
        """Listen on until the estimate is fit to fly by: one that has just booted has no position for a while."""
        until, said = self._clock.now() + seconds, False
        while not self._link.vehicle.armed and self._clock.now() < until:
            problem, _ = _estimate(self._estimates, self._link.vehicle, self._said.get("SYS_STATUS"))
            if problem is None:
                return
            if not said:
                told(f"waiting: {problem}")
            said = True
            self._estimates.clear()
            for message in self._link.pump(min(until, self._clock.now() + WATCHED.answered)):
                self.take(message)

    @property
    def home(self) -> Vector | None:
        """Where home is, in the vehicle's local frame [m]; None where it was not told."""
        told = self._said.get("HOME_POSITION")
        place = None if told is None else (told.x, told.y, told.z)
        return None if place is None or not all(map(math.isfinite, place)) else place

    def needs(self, samples: Samples | None) -> FlightNeeds:
        """Return the needs of samples in z-up world axes, from home as it was told."""
        home = map_vectors(self.home or ORIGIN, self._frame, "enu")
        return FlightNeeds() if samples is None else flight_needs(samples, tuple(home.tolist()))

    def findings(
        self, autopilot: Autopilot, samples: Samples | None, stands: Sequence[float] | None = None
    ) -> list[Finding]:
        """Return one finding a subject from the messages; a subject without a message is unknown.

        ``stands`` is where the vehicle is to stand: latitude and longitude [degrees].
        """
        vehicle, system, needs = self._link.vehicle, self._said.get("SYS_STATUS"), self.needs(samples)
        places = None if samples is None else np.asarray(map_vectors(samples.position, "enu", self._frame))
        from_home = f"the file goes {needs.reach:.1f} m away from it and {needs.height:.1f} m above"
        subjects = {
            "mode": (None, f"{autopilot.mode_name(vehicle)}, {'' if vehicle.armed else 'not '}armed"),
            "estimate": _estimate(self._estimates, vehicle, system),
            "arming checks": _arming(vehicle, system),
            "battery": _battery(system),
            "position": _position(vehicle, places),
            "home": (None, None if samples is None or self.home is None else from_home),
            "place": (None, None) if stands is None else _placed_on_earth(self._said.get("HOME_POSITION"), stands),
            "link": self._quality(),
        }
        return [Finding((), name, *told, grave=name == "estimate" and bool(told[0])) for name, told in subjects.items()]

    def _quality(self) -> Told:
        lost = max(0, self._missing - self._link.unknown + self._unknown)
        share = lost / max(1, self._received + lost)
        silence = max(self._silence, self._clock.now() - self._last)
        seen = f"{self._received} messages, {100 * share:.1f} % lost, silent for {silence:.2f} s at most"
        system, component = self._link.vehicle.system, self._link.vehicle.component
        if self._strange + self._link.ignored[system, component] > WATCHED.lost * self._received:
            both = f"two vehicles have the MAVLink system id {system}, or one is heard in two ways: give each its own"
            return both, f"{self._received} messages"
        poor = share > WATCHED.lost or silence > WATCHED.silent
        return "messages of the vehicle do not arrive" if poor else None, seen


Told = tuple[str | None, str | None]
"""A problem and what was seen; both None where it is not known."""


def _estimate(statuses: Sequence[Message], vehicle: VehicleState, system: Message | None) -> Told:
    if statuses:
        faults = estimate_faults(statuses, vehicle.landed)
        problem = f"the estimate is not fit to fly by: {', '.join(faults)}" if faults else None
        return problem, f"flags {statuses[-1].flags}"
    if system is None or not system.onboard_control_sensors_present & _AHRS:
        return None, None
    well = system.onboard_control_sensors_health & _AHRS
    return None if well else "attitude and position are not estimated well", "SYS_STATUS"


def _arming(vehicle: VehicleState, system: Message | None) -> Told:
    if vehicle.arming.before_stream:
        return f"it is not ready to arm: {', '.join(vehicle.arming.before_stream)}", "EVENT"
    if system is None:
        return None, None
    ill = system.onboard_control_sensors_present & system.onboard_control_sensors_enabled
    ill &= ~system.onboard_control_sensors_health
    if not (ill & _PREARM or any(ill & bit for bit in _SENSORS)):
        return None, "SYS_STATUS"
    reasons = [name for bit, name in _SENSORS.items() if ill & bit]
    reasons += [f'"{text}"' for text in vehicle.warnings]
    return f"it is not ready to arm: {', '.join(reasons) or 'it does not say why'}", "SYS_STATUS"


def _battery(system: Message | None) -> Told:
    if system is None or not 0 <= system.battery_remaining <= 100:
        return None, None
    left = system.battery_remaining
    return f"{left} % are left" if left < WATCHED.battery else None, f"{left} %"


def _position(vehicle: VehicleState, places: FloatArray | None) -> Told:
    if vehicle.position is None:
        return "it reports no LOCAL_POSITION_NED: its distance to the start is not known", "none"
    if places is None:
        return None, f"{-vehicle.position[2]:.1f} m high"
    away = math.dist(vehicle.position[:2], places[0, :2])
    far = f"it is {away:.1f} m from the start, without its height" if away > WATCHED.start else None
    return far, f"{away:.1f} m from the start"


def _placed_on_earth(told: Message | None, stands: Sequence[float]) -> Told:
    """Say how far home is from where the vehicle is to stand; unknown where home has no place on the earth."""
    if told is None or not (told.latitude or told.longitude):
        return None, None
    here = (1e-7 * told.latitude, 1e-7 * told.longitude, 0.0)
    east, north, _ = local_positions(here, (stands[0], stands[1], 0.0)).tolist()
    away = math.hypot(east, north)
    sides = f"{abs(east):.1f} m {'east' if east > 0.0 else 'west'}"
    sides += f" and {abs(north):.1f} m {'north' if north > 0.0 else 'south'} of it"
    far = f"its home is {away:.1f} m from its place in the show, {sides}"
    return far if away > WATCHED.place else None, f"home is {away:.1f} m from its place in the show"


def _placed(samples: Samples, vehicle: VehicleState, frame: str, options: StreamOptions) -> Samples:
    """Return samples, in z-up world axes, where they are flown: at the vehicle, or from the ground where it stands."""
    if vehicle.position is None:
        return samples
    table = tabulate(samples, frame=frame)
    on_ground = begins_on_ground(table, vehicle)
    offset = options.offset(table.start.position, vehicle.position, on_ground)
    return replace(samples, position=samples.position + map_vectors(offset, frame, "enu"))


def check_vehicle(
    link: Link,
    clock: Clock,
    autopilot: Autopilot,
    samples: Samples | None = None,
    frame: str = "ned",
    options: StreamOptions | None = None,
    stands: Sequence[float] | None = None,
    told: Callable[[str], None] = lambda _: None,
) -> list[Finding]:
    """Read parameters and listen for three seconds; return one finding for each rule and each part of the state.

    Before a flight, whose options are given, an estimate that is not fit is waited for, as long as they say.

    Parameters
    ----------
    link : Link
        With a vehicle that has been heard.
    clock : Clock
        The same as the link's.
    autopilot : Autopilot
        Whose rules apply.
    samples : Samples, optional
        What is to be flown, in z-up world axes, with the feed-forward that is to be sent.
    frame : str
        The vehicle's local frame: ``ned`` or ``frd``.
    options : StreamOptions, optional
        Whether the flight begins where the vehicle is; by default where the samples do.
    stands : sequence of float, optional
        Latitude and longitude at which the vehicle is to stand [degrees].
    told : callable, optional
        Called with what is waited for.
    """
    watch = VehicleWatch(link, clock, frame)
    watch.ask()
    parameters = Parameters(link, clock, watch.take).read_known(rule_parameters(autopilot.name))
    watch.listen()
    if options is not None:
        watch.wait_for_estimate(options.wait, told)
    if samples is not None and options is not None:
        samples = _placed(samples, link.vehicle, frame, options)
    findings = check_parameters(autopilot.name, parameters, watch.needs(samples))
    return [*findings, *watch.findings(autopilot, samples, stands)]

"""Check of a vehicle before a flight: its parameters, and a few seconds of its messages.

Bits are those of MAVLink's ESTIMATOR_STATUS_FLAGS and MAV_SYS_STATUS_SENSOR.
"""

from __future__ import annotations

import math

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.files.frames import map_vectors
from minsnap.flight.mavlink.autopilot import Autopilot, command
from minsnap.flight.mavlink.dialect import Message
from minsnap.flight.mavlink.link import Link
from minsnap.flight.mavlink.parameters import Parameters
from minsnap.flight.mavlink.preflight import Finding, FlightNeeds, check_parameters, flight_needs, rule_parameters
from minsnap.flight.mavlink.schedule import Clock
from minsnap.trajectory.samples import Samples

LISTEN, ANSWERED = 3.0, 1.0
"""How long the vehicle is listened to, and after the request for its arming checks [s]."""

LOW_BATTERY = 30
"""Charge below which a flight is not begun with confidence [%]."""

LOST, SILENT, START = 0.05, 1.0, 1.0
"""Share of lost messages, longest silence [s] and distance from the start [m] that are worth a word."""

_ESTIMATED = {
    "attitude": 1,
    "horizontal velocity": 2,
    "vertical velocity": 4,
    "horizontal position": 8 | 16,
    "height": 32,
}
_SPOILT = {"its position is assumed constant": 128, "GPS glitches": 1024, "its accelerometer is off": 2048}
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
        self._received = self._missing = 0
        self._number: int | None = None
        self._said: dict[str, Message] = {}

    def take(self, message: Message) -> None:
        """Take note of a message."""
        now = self._clock.now()
        self._silence, self._last = max(self._silence, now - self._last), now
        number = message.get_seq()
        if self._number is not None:
            self._missing += (number - self._number - 1) % 256
        self._received, self._number = self._received + 1, number
        self._said[message.get_type()] = message

    def listen(self) -> None:
        """Ask for the arming checks, and listen until :data:`LISTEN` have passed since the beginning."""
        vehicle = self._link.vehicle
        if not vehicle.armed:
            self._link.send(command(vehicle, "MAV_CMD_RUN_PREARM_CHECKS"))
        for message in self._link.pump(max(self._began + LISTEN, self._clock.now() + ANSWERED)):
            self.take(message)

    def findings(self, autopilot: Autopilot, samples: Samples | None) -> list[Finding]:
        """Return one finding a subject from the messages; a subject without a message is unknown."""
        return [
            self._mode(autopilot),
            self._estimate(),
            self._arming(),
            self._battery(),
            self._place(samples),
            self._home(samples),
            self._quality(),
        ]

    def _mode(self, autopilot: Autopilot) -> Finding:
        vehicle = self._link.vehicle
        return Finding((), "mode", None, f"{autopilot.mode_name(vehicle)}, {'' if vehicle.armed else 'not '}armed")

    def _estimate(self) -> Finding:
        status, system = self._said.get("ESTIMATOR_STATUS"), self._said.get("SYS_STATUS")
        if status is not None:
            gone = [f"no {name}" for name, bits in _ESTIMATED.items() if not status.flags & bits]
            gone += [words for words, bit in _SPOILT.items() if status.flags & bit]
            problem = f"the estimate is not fit to fly by: {', '.join(gone)}" if gone else None
            return Finding((), "estimate", problem, f"flags {status.flags}", grave=True)
        if system is None or not system.onboard_control_sensors_present & _AHRS:
            return Finding((), "estimate", None)
        well = system.onboard_control_sensors_health & _AHRS
        problem = None if well else "attitude and position are not estimated well"
        return Finding((), "estimate", problem, "SYS_STATUS", grave=True)

    def _arming(self) -> Finding:
        system, failed = self._said.get("SYS_STATUS"), self._link.vehicle.arming.failed
        if failed:
            return Finding((), "arming checks", f"it is not ready to arm: {', '.join(failed)}", "EVENT")
        if system is None:
            return Finding((), "arming checks", None)
        ill = system.onboard_control_sensors_present & system.onboard_control_sensors_enabled
        ill &= ~system.onboard_control_sensors_health
        reasons = [name for bit, name in _SENSORS.items() if ill & bit]
        reasons += [f'"{text}"' for text in self._link.vehicle.warnings]
        problem = None
        if ill & _PREARM or any(ill & bit for bit in _SENSORS):
            problem = f"it is not ready to arm: {', '.join(reasons) or 'it does not say why'}"
        return Finding((), "arming checks", problem, "SYS_STATUS")

    def _battery(self) -> Finding:
        system = self._said.get("SYS_STATUS")
        if system is None or not 0 <= system.battery_remaining <= 100:
            return Finding((), "battery", None)
        left = system.battery_remaining
        return Finding((), "battery", f"{left} % are left" if left < LOW_BATTERY else None, f"{left} %")

    def _place(self, samples: Samples | None) -> Finding:
        height = self._link.vehicle.height
        if height is None:
            return Finding(
                (), "position", "it reports no LOCAL_POSITION_NED: its distance to the start is not known", "none"
            )
        if samples is None:
            return Finding((), "position", None, f"{height:.1f} m high")
        x, y, _ = self._link.vehicle.position or (math.nan,) * 3
        away = math.dist((x, y), self._local(samples)[0, :2])
        far = f"it is {away:.1f} m from the start, without its height" if away > START else None
        return Finding((), "position", far, f"{away:.1f} m from the start")

    def _home(self, samples: Samples | None) -> Finding:
        home = self._said.get("HOME_POSITION")
        if home is None or samples is None or not all(map(math.isfinite, (home.x, home.y, home.z))):
            return Finding((), "home", None)
        away = self._local(samples) - (home.x, home.y, home.z)
        reach, above = float(np.hypot(away[:, 0], away[:, 1]).max()), float(-away[:, 2].min())
        return Finding((), "home", None, f"the file goes {reach:.1f} m away from it and {above:.1f} m above")

    def _local(self, samples: Samples) -> FloatArray:
        """Return positions in the vehicle's local frame, shape (m, 3) [m]."""
        return np.asarray(map_vectors(samples.position, "enu", self._frame))

    def _quality(self) -> Finding:
        share = self._missing / max(1, self._received + self._missing)
        silence = max(self._silence, self._clock.now() - self._last)
        seen = f"{self._received} messages, {100 * share:.1f} % lost, silent for {silence:.2f} s at most"
        return Finding((), "link", seen if share > LOST or silence > SILENT else None, seen)


def check_vehicle(
    link: Link, clock: Clock, autopilot: Autopilot, samples: Samples | None = None, frame: str = "ned"
) -> list[Finding]:
    """Read parameters and listen for three seconds; return one finding for each rule and each part of the state.

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
    """
    watch = VehicleWatch(link, clock, frame)
    needs = FlightNeeds() if samples is None else flight_needs(samples)
    parameters = Parameters(link, clock, watch.take).read(rule_parameters(autopilot.name))
    watch.listen()
    return [*check_parameters(autopilot.name, parameters, needs), *watch.findings(autopilot, samples)]

"""State of a vehicle from its messages, as far as streaming of setpoints needs it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from minsnap.flight.mavlink.dialect import Message
from minsnap.flight.mavlink.px4_events import TEXTS, ArmingReport

Vector = tuple[float, float, float]

PX4, ARDUPILOT = 12, 3
"""MAV_AUTOPILOT of the two stacks."""

_CUSTOM_MODE = 1  # MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
_ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED


@dataclass(frozen=True)
class Refusal:
    """A command that the vehicle did not accept.

    Parameters
    ----------
    command : int
        MAV_CMD.
    result : int
        MAV_RESULT of the last answer.
    times : int
        How often it was refused without being accepted in between.
    """

    command: int
    result: int
    times: int = 1

    def __str__(self) -> str:
        name = _COMMANDS.get(self.command, "unknown")
        return f"command {self.command} ({name}) with result {self.result} ({_RESULTS.get(self.result, 'unknown')})"


_COMMANDS = {176: "change the mode", 400: "arm", 22: "take off", 21: "land", 20: "return to launch"}
_RESULTS = {1: "temporarily rejected", 2: "denied", 3: "unsupported", 4: "failed", 5: "in progress", 6: "cancelled"}
_WARNING = 4  # MAV_SEVERITY_WARNING: its number and smaller ones
_KEPT = 3  # warnings that are kept
_LONGEST = 500  # characters of a warning that came in parts
_ACCEPTED, _IN_PROGRESS = 0, 5
_ASIDE = (511, 401)  # a refused MAV_CMD_SET_MESSAGE_INTERVAL or MAV_CMD_RUN_PREARM_CHECKS may be ignored


@dataclass(frozen=True)
class VehicleState:
    """The latest reported state of the vehicle; times are those of the receiver's clock.

    Parameters
    ----------
    system, component : int
        MAVLink ids.
    autopilot : int
        MAV_AUTOPILOT of its heartbeat.
    base_mode, custom_mode : int
        Of its heartbeat.
    heard, heartbeat : float
        When anything, and when a heartbeat, last came [s]; minus infinity before.
    position, velocity : tuple of 3, or None
        LOCAL_POSITION_NED [m, m/s], None before the first.
    positioned : float
        When that came [s].
    refusal : Refusal or None
        The command that it refuses, None once it has accepted one.
    beat : float
        Time between its last two heartbeats [s]; infinite before two have come.
    warnings : tuple of str
        The last different texts of it that warn or worse (STATUSTEXT), the newest last.
    arming : ArmingReport
        Which of PX4's checks keep it from arming (EVENT).
    """

    system: int = 0
    component: int = 0
    autopilot: int = 0
    base_mode: int = 0
    custom_mode: int = 0
    heard: float = -math.inf
    heartbeat: float = -math.inf
    position: Vector | None = None
    velocity: Vector | None = None
    positioned: float = -math.inf
    refusal: Refusal | None = None
    beat: float = math.inf
    warnings: tuple[str, ...] = ()
    arming: ArmingReport = ArmingReport()

    @property
    def height(self) -> float | None:
        """Height above the origin of the local frame [m], None before a position has come."""
        return None if self.position is None else -self.position[2]

    @property
    def speed(self) -> float:
        """Reported speed [m/s]; infinite before a position has come."""
        return math.inf if self.velocity is None else math.hypot(*self.velocity)

    @property
    def armed(self) -> bool:
        """Whether its motors are armed."""
        return bool(self.base_mode & _ARMED)

    @property
    def known(self) -> bool:
        """Whether a heartbeat was received."""
        return self.heartbeat > -math.inf

    @property
    def main_mode(self) -> int:
        """PX4's main mode, or the whole custom mode of others; -1 without a custom mode."""
        if not self.base_mode & _CUSTOM_MODE:
            return -1
        return (self.custom_mode >> 16) & 0xFF if self.autopilot == PX4 else self.custom_mode

    def told(self, message: Message, now: float, events: Mapping[int, str] = TEXTS) -> VehicleState:
        """Return the state after this message of the vehicle; ``events`` are texts of PX4's events."""
        kind = message.get_type()
        if kind == "HEARTBEAT":
            modes = {"base_mode": message.base_mode, "custom_mode": message.custom_mode}
            beat = now - self.heartbeat
            return replace(self, heard=now, heartbeat=now, beat=beat, autopilot=message.autopilot, **modes)
        if kind == "LOCAL_POSITION_NED":
            position = (float(message.x), float(message.y), float(message.z))
            velocity = (float(message.vx), float(message.vy), float(message.vz))
            if all(map(math.isfinite, (*position, *velocity))):
                return replace(self, heard=now, position=position, velocity=velocity, positioned=now)
        if kind == "COMMAND_ACK" and message.command not in _ASIDE and message.result != _IN_PROGRESS:
            return replace(self, heard=now, refusal=self._refusal(message))
        if kind == "STATUSTEXT" and message.severity <= _WARNING:
            return replace(self, heard=now, warnings=self._warned(message))
        if kind == "EVENT":
            return replace(self, heard=now, arming=self.arming.told(message, events))
        return replace(self, heard=now)

    def _warned(self, message: Message) -> tuple[str, ...]:
        """Return the warnings with a new one, or with the rest of one that came in parts."""
        text = "".join(filter(str.isprintable, str(message.text)))
        if getattr(message, "chunk_seq", 0) and self.warnings:
            return (*self.warnings[:-1], (self.warnings[-1] + text)[:_LONGEST])
        return (*(before for before in self.warnings if before != text), text)[-_KEPT:]

    def _refusal(self, message: Message) -> Refusal | None:
        if message.result == _ACCEPTED:
            return None
        before = self.refusal
        again = before is not None and before.command == message.command
        times = before.times + 1 if before is not None and again else 1
        return Refusal(message.command, message.result, times)

    def distance(self, position: Vector) -> float:
        """Return the distance of the vehicle to a position in its local frame [m]; infinite if unknown."""
        return math.inf if self.position is None else math.dist(self.position, position)

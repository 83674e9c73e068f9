"""MAVLink's messages: the dialect, the state that a vehicle tells, and commands to each autopilot.

An event (MAVLink's EVENT) is a number, a level and arguments. The number is that of the component, 8 bits, and of a
hash of the event's name, 24 bits. Events of arming checks come between two summaries, and their arguments begin with
the modes concerned. Names and texts are in a JSON that every build of PX4 writes (``all_events.json``, in the format of
MAVLink's libevents); ``px4_events.json`` has those of the common checks.

Sources: the PX4 manual on offboard control (at least two setpoints per second, sent before the mode is entered), the
ArduPilot developer manual on Copter commands in guided mode (GUID_TIMEOUT, take-off before setpoints are taken).
"""

from __future__ import annotations

import json
import lzma
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from minsnap.basics.optional_packages import optional
from minsnap.basics.storage.text import FileName, read_bytes, reading
from minsnap.errors import LinkError

Message = Any
"""A message of pymavlink."""


def load_dialect() -> Any:
    """Return pymavlink's MAVLink 2 ``common`` dialect.

    Raises
    ------
    ImportError
        If pymavlink is not installed; the sentence names the extra.
    """
    dialect = optional("pymavlink.dialects.v20.common", "talking to a vehicle needs pymavlink", "mavlink")
    for message in TAUGHT:
        message.teach(dialect)
    return dialect


@dataclass(frozen=True)
class MessageDefinition:
    """A message that a dialect of pymavlink may lack, as MAVLink's message definitions have it.

    Parameters
    ----------
    number, checksum : int
        Its id and its CRC_EXTRA.
    name : str
    fields : tuple of (str, str)
        Name and type of each in the order of the wire, largest types first.
    array : int
        Length of the last field where that is an array of bytes, else 0.
    """

    number: int
    checksum: int
    name: str
    fields: tuple[tuple[str, str], ...]
    array: int = 0

    def teach(self, dialect: Any) -> None:
        """Add the message to a dialect that lacks it."""
        if self.number not in dialect.mavlink_map:
            dialect.mavlink_map[self.number] = self._kind(dialect)

    def _kind(self, dialect: Any) -> Any:
        definition, names, kinds = self, [name for name, _ in self.fields], [kind for _, kind in self.fields]
        sizes = [0] * (len(names) - 1) + [self.array]
        letters = "".join(_LETTERS[kind] for kind in kinds)
        packer = struct.Struct(f"<{letters[:-1]}{self.array or ''}{letters[-1]}")

        class Taught(dialect.MAVLink_message):  # type: ignore[misc]
            id, msgname, crc_extra = definition.number, definition.name, definition.checksum
            ordered_fieldnames, fieldnames, fieldtypes = names, names, tuple(kinds)
            orders, lengths, array_lengths = list(range(len(names))), [size or 1 for size in sizes], sizes
            native_format, unpacker = bytearray(f"<{letters}", "ascii"), packer

            def __init__(self, *values: Any) -> None:
                super().__init__(self.id, self.msgname)
                self._fieldnames = self.fieldnames
                for name, value in zip(self.fieldnames, values, strict=True):
                    setattr(self, name, value)

            def pack(self, mav: Any, force_mavlink1: bool = False) -> bytes:
                values = [getattr(self, name) for name in self.fieldnames]
                flat = [*values[:-1], *values[-1]] if definition.array else values
                return bytes(self._pack(mav, self.crc_extra, packer.pack(*flat), force_mavlink1=force_mavlink1))

        return Taught


_LETTERS = {"uint32_t": "I", "uint16_t": "H", "uint8_t": "B", "float": "f"}

EVENT = MessageDefinition(
    410,
    160,
    "EVENT",
    (
        *((name, "uint32_t") for name in ("id", "event_time_boot_ms")),
        ("sequence", "uint16_t"),
        *((name, "uint8_t") for name in ("destination_component", "destination_system", "log_levels", "arguments")),
    ),
    array=40,
)
"""A sentence of PX4, by number."""

CURRENT_MODE = MessageDefinition(
    436,
    193,
    "CURRENT_MODE",
    (("custom_mode", "uint32_t"), ("intended_custom_mode", "uint32_t"), ("standard_mode", "uint8_t")),
)
"""The mode, which PX4 sends as soon as it changes, where it is asked for often."""

EKF_STATUS_REPORT = MessageDefinition(
    193,
    71,
    "EKF_STATUS_REPORT",
    (
        *((f"{name}_variance", "float") for name in ("velocity", "pos_horiz", "pos_vert", "compass", "terrain_alt")),
        ("flags", "uint16_t"),
        ("airspeed_variance", "float"),
    ),
)
"""ArduPilot's estimate; of the dialect ardupilotmega."""

TAUGHT = (EVENT, CURRENT_MODE, EKF_STATUS_REPORT)
"""What the dialect is taught."""


OFFBOARD, EVERY_MODE = 1 << 14, 0xFFFFFFFF
"""Of the modes that a check concerns; a check that keeps from nothing says that it concerns every one."""

_ERROR = 3  # level of an event: its number and smaller ones

OFFBOARD_SIGNAL = 0x012F1DC7
"""The check whether setpoints come: check_modes_offboard_signal."""

BEGIN, END = 0x01A893E0, 0x011D3727
"""The summaries between which a report of the checks is: commander_arming_check_summary, commander_health_summary."""


def _texts_of(content: Any) -> dict[int, str]:
    return {
        int(component) << 24 | int(number): str(event["message"])
        for component, space in content["components"].items()
        for group in space.get("event_groups", {}).values()
        for number, event in group["events"].items()
    }


TEXTS: Mapping[int, str] = _texts_of(json.loads(Path(__file__).with_name("px4_events.json").read_text("utf-8")))
"""Texts of the common checks (src/modules/commander/HealthAndArmingChecks), by number."""


def read_events(path: FileName) -> dict[int, str]:
    """Read the texts of a build's events, ``all_events.json`` or ``.json.xz``, beside those known here.

    Raises
    ------
    FileError
        If the file is no such JSON.
    """
    raw = read_bytes(path)
    with reading(path, "events of PX4 (all_events.json)"):
        events = _texts_of(json.loads(lzma.decompress(raw) if raw.startswith(b"\xfd7zXZ") else raw))
    return {**events, **TEXTS}


@dataclass(frozen=True)
class ArmingReport:
    """What keeps a vehicle from arming in its offboard mode.

    Parameters
    ----------
    failed : tuple of str
        The checks of the last whole report that keep it from arming; PX4 reports others that do not, in the same way.
    coming : tuple of str or None
        Those of a report of which the end has not come; None outside of one.
    """

    failed: tuple[str, ...] = ()
    coming: tuple[str, ...] | None = None

    def told(self, event: Message, texts: Mapping[int, str] = TEXTS) -> ArmingReport:
        """Return the report after one more EVENT; texts are those of events by number."""
        if event.id == BEGIN:
            return ArmingReport(self.failed, ())
        if self.coming is None:
            return self
        if event.id == END:
            return ArmingReport(self.coming)
        (modes,) = struct.unpack("<I", bytes(event.arguments[:4]))
        optional = modes == EVERY_MODE and event.log_levels & 0xF > _ERROR
        if optional or not modes & OFFBOARD:
            return self
        unknown = f"event {event.id:#010x}, whose text its build has (all_events.json)"
        return ArmingReport(self.failed, (*self.coming, texts.get(event.id, unknown)))

    @property
    def before_stream(self) -> tuple[str, ...]:
        """The checks that failed, without the one that no vehicle passes before setpoints come."""
        return tuple(text for text in self.failed if text != TEXTS[OFFBOARD_SIGNAL])


Vector = tuple[float, float, float]

PX4, ARDUPILOT = 12, 3
"""MAV_AUTOPILOT of the two stacks."""

_CUSTOM_MODE = 1  # MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
_ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED
_ON_GROUND, _TAKEOFF = 1, 3  # MAV_LANDED_STATE


def text_of(message: Message) -> str:
    """Return the text of a STATUSTEXT without control characters, which a terminal would obey."""
    return "".join(filter(str.isprintable, str(message.text)))


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
_NO_POSITION = 0b111  # of a type mask: position is ignored
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
    landed_state : int
        MAV_LANDED_STATE (EXTENDED_SYS_STATE); 0 before it has come.
    mode_told : float
        When its mode came by itself (CURRENT_MODE), which no heartbeat may wait with [s].
    target : tuple of 3, or None
        The position that it is asked for, whoever asks (POSITION_TARGET_LOCAL_NED) [m].
    targeted : float
        When that came [s].
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
    landed_state: int = 0
    mode_told: float = -math.inf
    target: Vector | None = None
    targeted: float = -math.inf

    @property
    def taking_off(self) -> bool | None:
        """Whether it has still to leave the ground or to end its own take-off; None while it does not say."""
        return self.landed_state in (_ON_GROUND, _TAKEOFF) if self.landed_state else None

    @property
    def landed(self) -> bool:
        """Whether it stands on the ground, as it says; while it does not, whether its motors stand still."""
        return self.landed_state == _ON_GROUND if self.landed_state else self.disarmed

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
    def disarmed(self) -> bool:
        """Whether its heartbeat says that its motors stand still; one without any flag says nothing of them."""
        return self.base_mode != 0 and not self.armed

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
        if kind == "EXTENDED_SYS_STATE":
            return replace(self, heard=now, landed_state=message.landed_state)
        if kind == "CURRENT_MODE":
            return replace(self, heard=now, mode_told=now, custom_mode=message.custom_mode)
        if kind == "POSITION_TARGET_LOCAL_NED":
            target = (float(message.x), float(message.y), float(message.z))
            if all(map(math.isfinite, target)) and not message.type_mask & _NO_POSITION:
                return replace(self, heard=now, target=target, targeted=now)
        return replace(self, heard=now)

    def _warned(self, message: Message) -> tuple[str, ...]:
        """Return the warnings with a new one, or with the rest of one that came in parts."""
        text = text_of(message)
        if getattr(message, "chunk_seq", 0) and self.warnings:
            return (*self.warnings[:-1], (self.warnings[-1] + text)[:_LONGEST])
        return (*(before for before in self.warnings if before != text), text)[-_KEPT:]

    def _refusal(self, message: Message) -> Refusal | None:
        if message.result == _ACCEPTED:
            return None
        before = self.refusal
        times = before.times + 1 if before is not None and before.command == message.command else 1
        return Refusal(message.command, message.result, times)

    def distance(self, position: Vector, when: float | None = None) -> float:
        """Return the distance of the vehicle to a position in its local frame [m]; infinite if unknown.

        At an instant ``when`` [s], it is carried on to there with its velocity from where it was reported: one that
        reports five times a second and flies 7 m/s seemed 1.4 m away.
        """
        if self.position is None:
            return math.inf
        age = 0.0 if when is None else when - self.positioned
        moved = self.velocity if self.velocity is not None and math.isfinite(age) else (0.0, 0.0, 0.0)
        here = [place + speed * age for place, speed in zip(self.position, moved, strict=True)]
        return math.dist(here, position)


@dataclass(frozen=True)
class Autopilot:
    """Conventions of one flight stack.

    Parameters
    ----------
    name : str
        ``px4``, ``ardupilot`` or ``generic``.
    mode : str
        The mode in which it follows setpoints, as its manual calls it.
    main_mode : int or None
        The number of that mode; None for a stack whose modes are not known: every mode counts.
    lowest_rate : float
        Fewer setpoints per second than this make it leave the mode [Hz].
    takes_off : bool
        True when it must be told to take off before it follows setpoints.
    after_loss : str
        What it does when the stream ends while it follows it, unless it is set otherwise.
    loss_time : float
        A stream that pauses for longer is lost: its failsafe acts, and setpoints that come back take the vehicle from
        it [s].
    delay : float
        Of a vehicle's position after its setpoint, where nothing better is known [s]; seen in simulation (of PX4 1.17
        0.41 to 0.50 s).
    thrust : bool
        Whether the acceleration of a setpoint is passed on as thrust, so that it can offset drag.
    hold : (str, float, float) or None
        The mode in which it hovers by itself, without a pilot's sticks: its name and its numbers (MAV_CMD_DO_SET_MODE).
    """

    name: str
    mode: str
    main_mode: int | None
    lowest_rate: float
    takes_off: bool = False
    after_loss: str = "its own failsafe acts"
    loss_time: float = math.inf
    delay: float = 0.5
    thrust: bool = True
    hold: tuple[str, float, float] | None = None

    def follows(self, vehicle: VehicleState) -> bool:
        """Return whether the vehicle is in the mode in which it follows setpoints."""
        return vehicle.known and (self.main_mode is None or vehicle.main_mode == self.main_mode)

    def losses(self, vehicle: VehicleState) -> list[str]:
        """Return what a vehicle that flew by setpoints has lost, in words: the mode, its armed motors."""
        lost = [] if self.follows(vehicle) else [f"the vehicle left {self.mode}"]
        return [*lost, "the vehicle was disarmed"] if vehicle.disarmed else lost

    def acts_alone(self, vehicle: VehicleState) -> bool:
        """Return whether the vehicle flies by itself: a return or landing that a pilot or its failsafe began."""
        return vehicle.known and self.name == "px4" and vehicle.main_mode == _PX4_AUTO

    def mode_name(self, vehicle: VehicleState) -> str:
        """Return the mode of a vehicle as its manual calls it."""
        if self.name == "px4" and vehicle.main_mode == _PX4_AUTO:
            return _PX4_ALONE.get((vehicle.custom_mode >> 24) & 0xFF, "AUTO")
        names = {"px4": _PX4_MODES, "ardupilot": _COPTER_MODES}.get(self.name, {})
        return names.get(vehicle.main_mode, f"mode {vehicle.custom_mode}")


_PX4_AFTER_LOSS = (
    "after COM_OF_LOSS_T (1 s) PX4 does what COM_OBL_RC_ACT says; without a radio control it returns to launch, and "
    "climbs to RTL_RETURN_ALT first: indoors set COM_OBL_RC_ACT to 4 (land) or 5 (hold) before the flight"
)
_ARDUPILOT_AFTER_LOSS = (
    "ArduCopter flies on at its last velocity and acceleration for GUID_TIMEOUT (3 s), then brakes and hovers in GUIDED"
)

_PX4_AUTO = 4
_PX4_ALONE = {2: "TAKEOFF", 3: "HOLD", 4: "MISSION", 5: "RETURN", 6: "LAND", 8: "FOLLOW", 9: "PRECISION LAND"}
_PX4_MODES = {1: "MANUAL", 2: "ALTITUDE", 3: "POSITION", 5: "ACRO", 6: "OFFBOARD", 7: "STABILIZED"}
_COPTER_MODES = {0: "STABILIZE", 2: "ALT_HOLD", 3: "AUTO", 4: "GUIDED", 5: "LOITER", 6: "RTL", 9: "LAND", 17: "BRAKE"}

AUTOPILOTS = {
    pilot.name: pilot
    for pilot in (
        Autopilot("px4", "OFFBOARD", 6, 2.0, after_loss=_PX4_AFTER_LOSS, loss_time=1.0, hold=("HOLD", 4.0, 3.0)),
        Autopilot(
            "ardupilot",
            "GUIDED",
            4,
            1.0,
            takes_off=True,
            after_loss=_ARDUPILOT_AFTER_LOSS,
            delay=0.15,
            thrust=False,
            hold=("BRAKE", 17.0, 0.0),
        ),
        Autopilot("generic", "any mode", None, 2.0),
    )
}


def get_autopilot(name: str, vehicle: VehicleState) -> Autopilot:
    """Return the conventions by name; ``auto`` uses the autopilot type in the vehicle's heartbeat.

    Raises
    ------
    LinkError
        If no stack is called so.
    """
    if name == "auto":
        name = {PX4: "px4", ARDUPILOT: "ardupilot"}.get(vehicle.autopilot, "generic")
    if name not in AUTOPILOTS:
        raise LinkError(f"no autopilot is called {name!r}: choose auto, {', '.join(AUTOPILOTS)}")
    return AUTOPILOTS[name]


def command(vehicle: VehicleState, name: str, *parameters: float) -> Message:
    """COMMAND_LONG to the vehicle; parameters left out are 0."""
    dialect = load_dialect()
    values = (*parameters, *(0.0,) * (7 - len(parameters)))
    return dialect.MAVLink_command_long_message(vehicle.system, vehicle.component, getattr(dialect, name), 0, *values)


def rate_request(vehicle: VehicleState, message: str, rate: float) -> Message:
    """Request a message such as LOCAL_POSITION_NED at a rate [Hz]."""
    taught = {each.name: each.number for each in TAUGHT}
    wanted = float(taught.get(message) or getattr(load_dialect(), f"MAVLINK_MSG_ID_{message}"))
    return command(vehicle, "MAV_CMD_SET_MESSAGE_INTERVAL", wanted, 1e6 / rate)

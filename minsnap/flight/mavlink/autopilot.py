"""Differences between PX4 and ArduPilot: the mode that accepts setpoints, its name, and the command to enter it.

Sources: the PX4 manual on offboard control (at least two setpoints per second, sent before the mode is entered), the
ArduPilot developer manual on Copter commands in guided mode (GUID_TIMEOUT, take-off before setpoints are taken).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from minsnap.errors import LinkError
from minsnap.flight.mavlink.dialect import Message, load_dialect
from minsnap.flight.mavlink.vehicle_state import ARDUPILOT, PX4, VehicleState


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
        Of a vehicle's position after its setpoint, where nothing better is known [s]; seen in simulation.
    thrust : bool
        Whether the acceleration of a setpoint is passed on as thrust, so that it can offset drag.
    """

    name: str
    mode: str
    main_mode: int | None
    lowest_rate: float
    takes_off: bool = False
    after_loss: str = "its own failsafe acts"
    loss_time: float = math.inf
    delay: float = 0.4
    thrust: bool = True

    def follows(self, vehicle: VehicleState) -> bool:
        """Return whether the vehicle is in the mode in which it follows setpoints."""
        return vehicle.known and (self.main_mode is None or vehicle.main_mode == self.main_mode)

    def acts_alone(self, vehicle: VehicleState) -> bool:
        """Return whether the vehicle flies by itself: a return or landing that a pilot or its failsafe began."""
        return vehicle.known and self.name == "px4" and vehicle.main_mode == _PX4_AUTO

    def mode_name(self, vehicle: VehicleState) -> str:
        """Return the mode of a vehicle as its manual calls it."""
        if self.name == "px4" and vehicle.main_mode == _PX4_AUTO:
            return _PX4_ALONE.get((vehicle.custom_mode >> 24) & 0xFF, "AUTO")
        names = {"px4": _PX4_MODES, "ardupilot": _COPTER_MODES}.get(self.name, {})
        return names.get(vehicle.main_mode, f"mode {vehicle.custom_mode}")

    def mode_command(self, vehicle: VehicleState) -> Message:
        """MAV_CMD_DO_SET_MODE into that mode."""
        return command(vehicle, "MAV_CMD_DO_SET_MODE", 1.0, float(self.main_mode or 0))


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
        Autopilot("px4", "OFFBOARD", 6, 2.0, after_loss=_PX4_AFTER_LOSS, loss_time=1.0),
        Autopilot(
            "ardupilot", "GUIDED", 4, 1.0, takes_off=True, after_loss=_ARDUPILOT_AFTER_LOSS, delay=0.15, thrust=False
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


def arm_command(vehicle: VehicleState) -> Message:
    """Arm the motors."""
    return command(vehicle, "MAV_CMD_COMPONENT_ARM_DISARM", 1.0)


def land_command(vehicle: VehicleState) -> Message:
    """Land here; both stacks change into their landing mode."""
    return command(vehicle, "MAV_CMD_NAV_LAND")


def return_command(vehicle: VehicleState) -> Message:
    """Return to launch; both stacks change into their return mode."""
    return command(vehicle, "MAV_CMD_NAV_RETURN_TO_LAUNCH")


def takeoff_command(vehicle: VehicleState, height: float) -> Message:
    """Take off to a height above home [m] (ArduPilot's guided mode)."""
    return command(vehicle, "MAV_CMD_NAV_TAKEOFF", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, height)


def rate_request(vehicle: VehicleState, message: str, rate: float) -> Message:
    """Request a message such as LOCAL_POSITION_NED at a rate [Hz]."""
    wanted = float(getattr(load_dialect(), f"MAVLINK_MSG_ID_{message}"))
    return command(vehicle, "MAV_CMD_SET_MESSAGE_INTERVAL", wanted, 1e6 / rate)

"""PX4's events: what they say of the checks that keep it from arming.

An event (MAVLink's EVENT) is a number, a level and arguments. The number is that of the component, 8 bits, and of a
hash of the event's name, 24 bits. Events of arming checks come between two summaries, and their arguments begin with
the modes concerned. Names and texts are in a JSON that every build of PX4 writes (``all_events.json``, in the format of
MAVLink's libevents); those of the common checks are here.
"""

from __future__ import annotations

import json
import lzma
import os
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from minsnap.basics.storage.reading import check_size, reading
from minsnap.flight.mavlink.dialect import Message

CHECKS = {
    "check_modes_cannot_takeoff": "its mode does not allow arming",
    "check_modes_angular_velocity": "no valid angular velocity",
    "check_modes_attitude": "no valid attitude",
    "check_modes_local_pos": "no valid local position",
    "check_modes_global_pos": "no valid global position",
    "check_modes_local_alt": "no valid altitude",
    "check_modes_mission": "no mission",
    "check_modes_home_position": "no home position",
    "check_modes_manual_control": "no manual control",
    "check_modes_not_supported": "the vehicle does not have this mode",
    "check_system_flight_term_active": "flight termination is active",
    "check_system_usb_connected": "USB is connected",
    "check_system_no_global_pos": "a global position is required (COM_ARM_WO_GPS)",
    "check_system_no_home_pos": "a home position is required (COM_ARM_WO_GPS)",
    "check_system_safety_button": "its safety button is not pressed",
    "check_system_arm_auth_failed": "arming was not authorised",
    "check_estimator_missing_data": "the estimator has not started",
    "check_estimator_heading_not_stable": "the heading is not estimated well",
    "check_estimator_hor_vel_not_stable": "the horizontal velocity is not estimated well",
    "check_estimator_vert_vel_not_stable": "the vertical velocity is not estimated well",
    "check_estimator_hor_pos_not_stable": "the horizontal position is not estimated well",
    "check_estimator_hgt_not_stable": "the height is not estimated well",
    "check_estimator_mag_interference": "strong magnetic interference",
    "check_estimator_gps_fix_too_low": "no GPS fix",
    "check_estimator_gps_num_sats_too_low": "too few GPS satellites",
    "check_estimator_gps_pdop_too_high": "GPS satellites lie badly (PDOP)",
    "check_estimator_gps_hor_pos_err_too_high": "the GPS position is not exact enough",
    "check_estimator_gps_vert_pos_err_too_high": "the GPS height is not exact enough",
    "check_battery_missing": "a battery is missing",
    "check_battery_disconnected": "a battery is disconnected",
    "check_rc_dl_no_dllink": "no ground station is connected",
}
"""By PX4's names of the events (src/modules/commander/HealthAndArmingChecks)."""

OFFBOARD = 1 << 14
"""Of the modes that a check concerns."""

_AUTOPILOT = 1 << 24


def event_id(name: str) -> int:
    """Return the number of an event of the autopilot: FNV-1a of its name, 24 bits of it."""
    number = 0x811C9DC5
    for byte in name.encode():
        number = (number ^ byte) * 0x1000193 & 0xFFFFFFFF
    return _AUTOPILOT | number & 0xFFFFFF


TEXTS: Mapping[int, str] = {event_id(name): text for name, text in CHECKS.items()}
"""Texts of the common checks, by number."""

BEGIN, END = event_id("commander_arming_check_summary"), event_id("commander_health_summary")
"""The summaries between which a report of the checks is."""


def read_events(path: str | os.PathLike[str]) -> dict[int, str]:
    """Read the texts of a build's events, ``all_events.json`` or ``.json.xz``, beside those known here.

    Raises
    ------
    FileError
        If the file is no such JSON.
    """
    check_size(path)
    with reading(path, "events of PX4 (all_events.json)"):
        raw = Path(path).read_bytes()
        content = json.loads(lzma.decompress(raw) if raw.startswith(b"\xfd7zXZ") else raw)
        events = {
            int(component) << 24 | int(number): str(event["message"])
            for component, space in content["components"].items()
            for group in space.get("event_groups", {}).values()
            for number, event in group["events"].items()
        }
    return {**events, **TEXTS}


@dataclass(frozen=True)
class ArmingReport:
    """What keeps a vehicle from arming in its offboard mode.

    Parameters
    ----------
    failed : tuple of str
        The checks of the last whole report.
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
        unknown = f"event {event.id:#010x}, whose text its build has (all_events.json)"
        return ArmingReport(self.failed, (*self.coming, texts.get(event.id, unknown))) if modes & OFFBOARD else self

"""PX4's reports of its arming checks, as events."""

import struct

from standin import mavlink

from minsnap.flight.mavlink.vehicle_messages import EVENT

OFFBOARD, POSCTL = 1 << 14, 1 << 2


def event_id(name):
    """Return the number of an event of the autopilot: FNV-1a of its name, 24 bits of it."""
    number = 0x811C9DC5
    for byte in name.encode():
        number = (number ^ byte) * 0x1000193 & 0xFFFFFFFF
    return 1 << 24 | number & 0xFFFFFF


def event(name, modes=OFFBOARD, level=3):
    EVENT.teach(mavlink)
    number = name if isinstance(name, int) else event_id(name)
    arguments = list(struct.pack("<IB", modes, 3).ljust(40, b"\0"))
    return mavlink.mavlink_map[410](number, 1000, 7, 0, 0, 0x11 * level, arguments)


def report(*checks):
    return [event("commander_arming_check_summary"), *checks, event("commander_health_summary")]

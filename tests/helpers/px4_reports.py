"""PX4's reports of its arming checks, as events."""

import struct

from standin import mavlink

from minsnap.flight.mavlink.vehicle_messages import add_event_to, event_id

OFFBOARD, POSCTL = 1 << 14, 1 << 2


def event(name, modes=OFFBOARD):
    add_event_to(mavlink)
    number = name if isinstance(name, int) else event_id(name)
    arguments = list(struct.pack("<IB", modes, 3).ljust(40, b"\0"))
    return mavlink.mavlink_map[410](number, 1000, 7, 0, 0, 0x33, arguments)


def report(*checks):
    return [event("commander_arming_check_summary"), *checks, event("commander_health_summary")]

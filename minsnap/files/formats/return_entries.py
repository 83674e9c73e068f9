"""How a vehicle of a Skybrush show returns when all are called home: block 4 of a binary show.

A byte of flags, the unit u8 [mm], the acceleration u16 [mm/s^2] (0: none), the number of points u16 and their x, y, z
as int16 in units; then the number of entries u16, and each: a byte (bits 4 and 5 the action, bit 1: it waits before,
bit 0: after), the seconds since the entry before, and what the action needs. Whole numbers are varints. A vehicle
that is called at an instant flies the show until the first entry that is not before it, and then does what this one
says:

- land (1) where it is;
- go straight (3) to an altitude above a point, with the number of the point, the altitude (int16), a vertical neck
  before it (int16, and its seconds) and the seconds of the way; then it lands at the point.

(libskybrush 99beb12, ``rth_plan.c``. Other actions, same as before (0) and level flight (2), are read and not
written.)
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import Any

from minsnap.errors import FileError
from minsnap.files.formats.skybrush import UNIT_BITS, read_varint, varint

SAME, LAND, LEVEL, STRAIGHT = 0, 1, 2, 3
"""Actions."""

BEFORE, AFTER = 2, 1
"""Bits of an entry that waits before its way, and after it."""


@dataclass(frozen=True)
class ReturnEntry:
    """What a vehicle does that was called.

    Parameters
    ----------
    second : int
        Of the show, at which it begins.
    target : tuple of 3 or None
        Where it lands [m]; None: below its place.
    altitude : float or None
        At which it arrives above the target [m]; None: that at which it is.
    wait, lasts, after : int
        How long it stands before its way, how long this takes, and how long it stands after it [s].
    """

    second: int
    target: tuple[float, float, float] | None = None
    altitude: float | None = None
    wait: int = 0
    lasts: int = 0
    after: int = 0

    def level_json(self) -> dict[str, Any]:
        """Return the entry of a ``.skyc``, which lands, or flies to its target at the height that it has.

        (skybrush-server 215ece2, ``rth_plan.py``.)
        """
        if self.target is None:
            return {"time": self.second, "action": "land"}
        content: dict[str, Any] = {"time": self.second, "action": "goTo", "target": list(self.target[:2])}
        content["duration"] = self.lasts
        return content | {name: value for name, value in (("preDelay", self.wait), ("postDelay", self.after)) if value}


def return_bytes(entries: Sequence[ReturnEntry], acceleration: float) -> bytes:
    """Return the content of a block: ways straight to an altitude, and landings; ``acceleration`` in m/s^2.

    Raises
    ------
    FileError
        If a target or an altitude is too far away, or seconds do not ascend.
    """
    ways = [entry for entry in entries if entry.target is not None]
    reach = max((abs(x) for entry in ways for x in (*(entry.target or ()), entry.altitude or 0.0)), default=0.0)
    unit = max(1, ceil((1e3 * reach + 1.0) / 32768.0))
    if unit > UNIT_BITS:
        raise FileError(f"a return leads {reach:.0f} m away, and Skybrush's files hold {32.767 * UNIT_BITS:.0f} m")
    points = sorted({_units(entry.target, unit) for entry in ways if entry.target is not None})
    head = struct.pack("<BBHH", 0, unit, min(int(1e3 * acceleration + 0.5), 65535), len(points))
    body = b"".join(struct.pack("<3h", *point) for point in points) + struct.pack("<H", len(entries))
    before = 0
    for entry in entries:
        if entry.second < before:
            raise FileError(f"the return at {entry.second} s comes after that at {before} s: give them in their order")
        flags = BEFORE * (entry.wait > 0) + AFTER * (entry.after > 0)
        kind = LAND if entry.target is None else STRAIGHT
        body += bytes([kind << 4 | flags]) + varint(entry.second - before)
        before = entry.second
        if entry.target is not None:
            (altitude,) = _units((entry.altitude or 0.0,), unit)
            body += varint(points.index(_units(entry.target, unit))) + struct.pack("<hh", altitude, 0) + varint(0)
            body += varint(entry.lasts)
        body += varint(entry.wait) if entry.wait > 0 else b""
        body += varint(entry.after) if entry.after > 0 else b""
    return head + body


def _units(values: Sequence[float], unit: int) -> tuple[int, ...]:
    return tuple(round(1e3 * value / unit) for value in values)


def returns_of(content: bytes) -> tuple[tuple[ReturnEntry, ...], float]:
    """Return the entries of a block, and the acceleration of their ways, 0 where it says none [m/s^2].

    Raises
    ------
    FileError
        If it is cut off, or an entry has a neck, which is not read.
    """
    try:
        return _returns_of(content)
    except (struct.error, IndexError):
        raise FileError("a plan of returns is cut off") from None


def _returns_of(content: bytes) -> tuple[tuple[ReturnEntry, ...], float]:
    _, unit, acceleration, count = struct.unpack_from("<BBHH", content)
    unit &= UNIT_BITS
    points = [struct.unpack_from("<3h", content, 6 + 6 * i) for i in range(count)]
    targets = [tuple(value * unit / 1e3 for value in point) for point in points]
    offset = 6 + 6 * count
    (left,) = struct.unpack_from("<H", content, offset)
    offset, second, entries = offset + 2, 0, []
    kind, target, altitude = LAND, None, None
    for _ in range(left):
        flags = content[offset]
        step, offset = read_varint(content, offset + 1)
        second, lasts, wait, after = second + step, 0, 0, 0
        if flags >> 4 & 3 != SAME:
            kind, target, altitude = flags >> 4 & 3, None, None
            if kind in (LEVEL, STRAIGHT):
                which, offset = read_varint(content, offset)
                target = targets[which]
            if kind == STRAIGHT:
                height, neck = struct.unpack_from("<hh", content, offset)
                slow, offset = read_varint(content, offset + 4)
                if neck or slow:
                    raise FileError(f"the return at {second} s has a neck, which is not read")
                altitude = height * unit / 1e3
        if kind in (LEVEL, STRAIGHT):
            lasts, offset = read_varint(content, offset)
        if flags & BEFORE:
            wait, offset = read_varint(content, offset)
        if flags & AFTER:
            after, offset = read_varint(content, offset)
        entries.append(ReturnEntry(second, target, altitude, wait, lasts, after))
    return tuple(entries), acceleration / 1e3

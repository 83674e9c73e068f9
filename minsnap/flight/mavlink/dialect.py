"""The MAVLink 2 message set, through pymavlink; the numbers used here are those of MAVLink's common message set."""

from __future__ import annotations

import struct
from types import ModuleType
from typing import Any

Message = Any
"""A message of pymavlink."""


def load_dialect() -> ModuleType:
    """Return pymavlink's MAVLink 2 ``common`` dialect.

    Raises
    ------
    ImportError
        If pymavlink is not installed; the sentence names the extra.
    """
    try:
        from pymavlink.dialects.v20 import common
    except ImportError:
        raise ImportError("talking to a vehicle needs pymavlink: pip install minsnap[mavlink]") from None
    dialect: ModuleType = common
    add_event_to(dialect)
    return dialect


def add_event_to(dialect: Any) -> None:
    """Teach a dialect of pymavlink that lacks it the message EVENT (number 410, of MAVLink's common message set)."""
    if 410 in dialect.mavlink_map:
        return

    class EventMessage(dialect.MAVLink_message):  # type: ignore[misc]
        id, msgname, crc_extra = 410, "EVENT", 160
        ordered_fieldnames = (
            "id event_time_boot_ms sequence destination_component destination_system log_levels arguments".split()
        )
        fieldnames = ordered_fieldnames
        fieldtypes = ("uint32_t", "uint32_t", "uint16_t", *("uint8_t",) * 4)
        orders, lengths, array_lengths = list(range(7)), [1] * 6 + [40], [0] * 6 + [40]
        native_format, unpacker = bytearray(b"<IIHBBBB"), struct.Struct("<IIHBBB40B")
        fielddisplays_by_name: dict[str, str] = {}
        fieldenums_by_name: dict[str, str] = {}
        fieldunits_by_name: dict[str, str] = {}
        instance_field = None
        instance_offset = -1

        def __init__(self, *values: Any) -> None:
            super().__init__(self.id, self.msgname)
            self._fieldnames = self.fieldnames
            for name, value in zip(self.fieldnames, values, strict=True):
                setattr(self, name, value)

        def pack(self, mav: Any, force_mavlink1: bool = False) -> bytes:
            head = [getattr(self, name) for name in self.fieldnames[:6]]
            packed = self.unpacker.pack(*head, *self.arguments)
            return bytes(self._pack(mav, self.crc_extra, packed, force_mavlink1=force_mavlink1))

    dialect.mavlink_map[410] = EventMessage

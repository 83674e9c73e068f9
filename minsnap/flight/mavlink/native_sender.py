"""A thread of the native core that sends prepared messages at their instants and does nothing else."""

from __future__ import annotations

import ctypes
import socket
import sys
from collections.abc import Sequence
from ctypes import c_double, c_int32, c_int64, c_uint32, c_void_p
from dataclasses import dataclass

import numpy as np

from minsnap.native import Entry, address

LONGEST = 280
"""Bytes of the longest message, a MAVLink 2 message without signature."""

MOST_AHEAD = 200
"""Slots that may be prepared ahead; the ring has 256."""

_OPEN = Entry("minsnap_sender_open", c_int32, c_double, c_double, c_double, c_int32, c_int32, c_void_p)
_SUPPLY = Entry(
    "minsnap_sender_supply", c_void_p, c_int64, c_int64, c_int32, *[c_void_p] * 3, c_uint32, c_int32
)  # fmt: skip
_DRAIN = Entry("minsnap_sender_drain", c_void_p, c_int32, c_void_p, c_void_p, c_void_p)
_SEQUENCE = Entry("minsnap_sender_sequence", c_void_p)
_STOP = Entry("minsnap_sender_stop", c_void_p)
_CLOSE = Entry("minsnap_sender_close", c_void_p)


@dataclass(frozen=True)
class Served:
    """A slot that was served.

    Parameters
    ----------
    slot : int
    time : float
        When its message was handed to the system, on the monotonic clock [s].
    """

    slot: int
    time: float


class NativeSender:
    """The thread, from the opening of one to its end; slot k is due at ``start + k / rate``.

    Parameters
    ----------
    handle : int
        Address of the sender in the native core.

    Attributes
    ----------
    generation : int
        Counts the long gaps after which prepared slots were thrown away; raised by ``drain``.
    granted : int
        2: real-time priority; 1: a raised ordinary one; 0: none; -1: not asked for yet.
    """

    def __init__(self, handle: int) -> None:
        self._handle: int | None = handle
        self.generation, self.granted = 0, -1
        self._slots, self._times = np.zeros(1024, dtype=np.int64), np.zeros(1024)
        self._counts = np.zeros(4, dtype=np.int64)

    @classmethod
    def open(cls, port: int, rate: float, start: float, max_gap: float, extra: int) -> NativeSender | None:
        """Start a sender.

        Parameters
        ----------
        port : int
            File descriptor of a datagram socket or a serial port, which must stay open longer than the sender.
        rate, start : float
            [Hz], and the instant of slot 0 on the monotonic clock [s].
        max_gap : float
            A setpoint of a flight is not sent later than this after the one before [s].
        extra : int
            The byte that MAVLink adds to the checksum of this type of message.

        Returns
        -------
        NativeSender or None
            None where the native core is not in use or cannot do it.
        """
        handle = c_void_p()
        status = _OPEN(port, rate, start, max_gap, extra, 0, ctypes.addressof(handle))
        return None if status else cls(int(handle.value or 0))

    def supply(
        self, first: int, messages: Sequence[bytes], flying: Sequence[bool], target: tuple[str, int] | None
    ) -> bool:
        """Prepare slots from ``first`` on; return False if a long gap has to be looked at before (see ``drain``).

        Parameters
        ----------
        first : int
        messages : sequence of bytes
            MAVLink 2 messages without signature; their sequence number and checksum are filled in. Empty: send nothing.
        flying : sequence of bool
            Which are setpoints of the flight.
        target : tuple or None
            Numeric IPv4 address, and port, of datagrams; None writes to a serial port.
        """
        content = b"".join(message.ljust(LONGEST, b"\0") for message in messages)
        lengths = np.array([len(message) for message in messages], dtype=np.int32)
        flags = np.array(flying, dtype=np.uint8)
        host, port = target or ("0.0.0.0", 0)
        where = int.from_bytes(socket.inet_aton(host), sys.byteorder), port
        sizes = (self.generation, first, len(messages))
        return not _SUPPLY(self._opened, *sizes, content, address(lengths), address(flags), *where)

    def drain(self) -> list[Served]:
        """Return what was served since the last call."""
        arrays = (address(values) for values in (self._slots, self._times, self._counts))
        _DRAIN(self._opened, len(self._slots), *arrays)
        count, self.generation, _, self.granted = self._counts.tolist()
        return [
            Served(slot, time)
            for slot, time in zip(self._slots[:count].tolist(), self._times[:count].tolist(), strict=True)
        ]

    def sequence(self) -> int:
        """Return the sequence number for another message of the same system, 0 to 255."""
        return _SEQUENCE(self._opened)

    def stop(self) -> None:
        """End the thread; nothing leaves from then on, and what has left may still be drained."""
        _STOP(self._opened)

    def close(self) -> None:
        """Free the memory of a stopped sender."""
        if self._handle is not None:
            _CLOSE(self._handle)
        self._handle = None

    @property
    def _opened(self) -> int:
        if self._handle is None:
            raise RuntimeError("the sender is closed")
        return self._handle

"""A MAVLink connection to one vehicle: sends heartbeats, signs messages, ignores other systems."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from minsnap.basics.storage.text import check_size
from minsnap.errors import FileError, LinkError
from minsnap.flight.mavlink._transports import LinkTransport, Peer, open_transport
from minsnap.flight.mavlink.schedule import Clock
from minsnap.flight.mavlink.vehicle_messages import TEXTS, Message, VehicleState, load_dialect

_GROUND_STATION, _COMPANION, _NO_AUTOPILOT, _ACTIVE = 6, 18, 8, 4
_COMPONENT = 191  # MAV_COMP_ID_ONBOARD_COMPUTER


class Link:
    """Messages to and from one vehicle over a transport.

    Parameters
    ----------
    transport : LinkTransport
        Where bytes go.
    clock : Clock
        Whose time everything is.
    system : int or None
        The vehicle's MAVLink system id; None takes the first autopilot that is heard.
    source_system : int
        Our own id; the component is that of an onboard computer.
    signing_key : bytes or None
        32 bytes: sign what is sent, and refuse what is not signed with the same key.
    events : mapping of int to str
        Texts of PX4's events (:func:`~minsnap.flight.mavlink.vehicle_messages.read_events`).

    Attributes
    ----------
    vehicle : VehicleState
        What the vehicle last said.
    ignored : Counter
        Messages of other systems and components, by (system, component).
    refused : int
        Messages that were damaged or not signed as they should be.
    numbering : callable or None
        Where sequence numbers come from while another thread sends as well.
    """

    def __init__(
        self,
        transport: LinkTransport,
        clock: Clock,
        system: int | None = None,
        source_system: int = 245,
        signing_key: bytes | None = None,
        events: Mapping[int, str] = TEXTS,
    ) -> None:
        self._dialect = load_dialect()
        self._transport, self._clock, self._wanted, self._events = transport, clock, system, events
        self.address = transport.address
        self.vehicle = VehicleState()
        self.ignored: Counter[tuple[int, int]] = Counter()
        self.refused = 0
        self.numbering: Callable[[], int] | None = None
        self._codec = self._dialect.MAVLink(self, srcSystem=source_system, srcComponent=_COMPONENT)
        self._parsers: dict[Peer, Any] = {}
        self._peer: Peer | None = None
        self._next_heartbeat = clock.now()
        if signing_key is not None:
            self._sign(signing_key)

    def _sign(self, key: bytes) -> None:
        """MAVLink 2 signing; its time stamp counts 10 microseconds since 2015 and must never go back."""
        import time

        signing = self._codec.signing
        signing.secret_key, signing.sign_outgoing = key, True
        signing.timestamp = int((time.time() - 1420070400) * 1e5)

    def write(self, data: bytes) -> None:
        """Send raw bytes (called by pymavlink)."""
        self._transport.send(bytes(data))

    def send(self, message: Message) -> None:
        """Send a message."""
        if self.numbering is not None:
            self._codec.seq = self.numbering()
        self._codec.send(message)

    def packed(self, message: Message) -> bytes:
        """Return a message as bytes, for a thread that sends it later."""
        return bytes(message.pack(self._codec))

    def outlet(self) -> tuple[int, Peer | None] | None:
        """Return where another thread may write messages (``LinkTransport.outlet``); None if they are signed."""
        return None if self._codec.signing.sign_outgoing else self._transport.outlet()

    def close(self) -> None:
        """Close the port."""
        self._transport.close()

    def pump(self, until: float) -> Iterator[Message]:
        """Receive until an instant and send heartbeats meanwhile; yield the vehicle's messages on arrival.

        Parameters
        ----------
        until : float
            An instant of the clock [s]. What has arrived is looked at even when that is past.
        """
        while True:
            self._beat()
            for _ in range(_DRAIN):
                arrived = self._arrived()
                yield from arrived or ()
                if arrived is None:
                    break
            if self._clock.now() >= until:
                return
            self._clock.wait(min(until, self._next_heartbeat), self._transport.readers())

    def _beat(self) -> None:
        """Send our heartbeat once per second; after a pause only one is sent."""
        now = self._clock.now()
        if now < self._next_heartbeat:
            return
        self._next_heartbeat = max(self._next_heartbeat + 1.0, now)
        self.send(self._dialect.MAVLink_heartbeat_message(_COMPANION, _NO_AUTOPILOT, 0, 0, _ACTIVE, 3))

    def _arrived(self) -> list[Message] | None:
        """Return the vehicle's messages in the received data; None if no data was received."""
        data, peer = self._transport.receive()
        if not data:
            return None
        parsed = self._parser(peer).parse_buffer(data) or ()
        messages = [message for message in parsed if self._is_from_vehicle(message, peer)]
        if messages:
            self._peer = peer
            self._transport.choose(peer)
        return messages

    def _parser(self, peer: Peer) -> Any:
        """Return the parser of one peer; every peer has its own, so that their bytes do not mix."""
        if peer not in self._parsers:
            if len(self._parsers) >= _PEERS:
                self._parsers.clear()
            parser = self._dialect.MAVLink(None)
            parser.robust_parsing, parser.signing = True, self._codec.signing
            self._parsers[peer] = parser
        return self._parsers[peer]

    def _is_from_vehicle(self, message: Message, peer: Peer) -> bool:
        """Whether a message is from the chosen vehicle; the first suitable heartbeat chooses the vehicle.

        Messages of an unknown type are ignored, since their checksum cannot be verified. So are those that come in its
        name from another address, until the vehicle has been silent for a while: then it may have a new one.
        """
        if message.get_type() == "BAD_DATA" or message.get_type().startswith("UNKNOWN"):
            self.refused += message.get_type() == "BAD_DATA"
            return False
        sender = (message.get_srcSystem(), message.get_srcComponent())
        if not self.vehicle.known and self._is_suitable(message, sender[0]):
            self.vehicle = replace(self.vehicle, system=sender[0], component=sender[1])
            self.ignored.pop(sender, None)
        chosen = (self.vehicle.system, self.vehicle.component)
        elsewhere = self._peer not in (None, peer) and self._clock.now() - self.vehicle.heard < _MOVES
        if chosen == (0, 0) or sender != chosen or elsewhere:
            self.ignored[sender] += 1
            return False
        self.vehicle = self.vehicle.told(message, self._clock.now(), self._events)
        return True

    def _is_suitable(self, message: Message, system: int) -> bool:
        """Return whether this is the heartbeat of an autopilot with the requested system id."""
        if message.get_type() != "HEARTBEAT" or message.autopilot == _NO_AUTOPILOT or message.type == _GROUND_STATION:
            return False
        return self._wanted in (None, system)

    def wait_for_vehicle(self, timeout: float, cancelled: Callable[[], bool] = lambda: False) -> VehicleState:
        """Wait for the first heartbeat, sending ours meanwhile.

        Parameters
        ----------
        timeout : float
            How long [s].
        cancelled : callable
            Called now and then; True gives up at once.

        Raises
        ------
        LinkError
            If none comes in time; the sentence says how long, on what address, and who else was heard.
        """
        deadline = self._clock.now() + timeout
        while not self.vehicle.known:
            if cancelled() or self._clock.now() >= deadline:
                raise LinkError(self._silence(timeout), address=self.address)
            for _ in self.pump(min(deadline, self._clock.now() + 0.1)):
                break
        return self.vehicle

    def _silence(self, timeout: float) -> str:
        wanted = "a vehicle" if self._wanted is None else f"system {self._wanted}"
        sentence = f"no heartbeat of {wanted} within {timeout:g} s on {self.address}"
        if self.ignored:
            heard = ", ".join(str(system) for system in sorted({system for system, _ in self.ignored}))
            sentence += f"; heard only system {heard}" + ("" if self._wanted is None else ": check the system id")
        if self.address.startswith("udpout"):
            sentence += f"; a simulator that sends to a port is heard on it: try udpin{self.address[6:]}"
        if self.refused:
            sentence += f"; {self.refused} messages were damaged or not signed with this key"
        return sentence


_MOVES = 2.0
"""Silence after which a vehicle may come from another address [s]."""

_PEERS = 64
"""Senders that are kept apart at a time."""

_DRAIN = 100
"""What is looked at before time is looked at again: a flood must not keep a setpoint from leaving."""


def open_link(
    connection: str,
    clock: Clock | None = None,
    *,
    baud: int = 115200,
    system: int | None = None,
    source_system: int = 245,
    signing_key: bytes | str | os.PathLike[str] | None = None,
    events: Mapping[int, str] = TEXTS,
) -> Link:
    """Open a connection string as a link; see :func:`~minsnap.flight.mavlink._transports.open_transport`.

    Parameters
    ----------
    signing_key : bytes, path or None
        The key, or the file that holds it (:func:`read_signing_key`).
    events : mapping of int to str
        Texts of PX4's events.
    """
    key = signing_key if isinstance(signing_key, bytes) or signing_key is None else read_signing_key(signing_key)
    load_dialect()
    return Link(
        open_transport(connection, baud), clock or Clock(), system, source_system, signing_key=key, events=events
    )


def read_signing_key(path: str | os.PathLike[str]) -> bytes:
    """Read a MAVLink signing key: 32 raw bytes, or 64 hexadecimal digits.

    Raises
    ------
    FileError
        If the file holds neither.
    """
    check_size(path)
    raw = Path(path).read_bytes()
    if len(raw) == 32:
        return raw
    try:
        key = bytes.fromhex(raw.decode("ascii").strip())
    except ValueError:
        key = b""
    if len(key) != 32:
        raise FileError(f"{path} holds no MAVLink signing key: it must be 32 bytes, or 64 hexadecimal digits")
    return key

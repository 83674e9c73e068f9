"""A MAVLink connection to one vehicle, and the clock by which it is used.

A link sends heartbeats, signs messages, and ignores other systems. Setpoints leave in slots of a monotonic clock, one
in each without bursts; several vehicles begin together.
"""

from __future__ import annotations

import math
import select
import threading
import time
from array import array
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import SMALLEST
from minsnap.basics.checks import check_number
from minsnap.basics.storage.text import FileName, read_bytes
from minsnap.errors import FileError, InputError, LinkError, TimingError
from minsnap.flight.mavlink._transports import LinkTransport, Peer, open_transport
from minsnap.flight.mavlink.vehicle_messages import TEXTS, Message, Vector, VehicleState, load_dialect


def check_setpoint_rate(rate: float) -> float:
    """Return a rate [Hz], or raise TimingError where it is no positive number."""
    give = "it must be a positive number of setpoints per second"
    return float(check_number("the rate", rate, SMALLEST, math.inf, give, TimingError))


class Clock:
    """Monotonic time and waiting; tests may pass a clock with simulated time."""

    def now(self) -> float:
        """Return the time [s] from an arbitrary origin."""
        return time.monotonic()

    def wait(self, until: float, readers: Sequence[int]) -> None:
        """Wait until the instant, or until one of the file descriptors is readable.

        Parameters
        ----------
        until : float
            An instant of :meth:`now` [s].
        readers : sequence of int
            File descriptors to wake up for.
        """
        select.select(readers, [], [], max(0.0, until - self.now()))


@dataclass(frozen=True)
class Lateness:
    """Lateness of the sent setpoints, and the number of skipped ones.

    Parameters
    ----------
    sent, skipped : int
        Slots that were served, and slots that had passed when their turn came.
    rate : float
        Mean rate of the slots served and skipped, over the time they took [Hz].
    median, p99, p999, worst : float
        Time from the instant a slot was due to the instant it was served [s].
    """

    sent: int
    skipped: int
    rate: float
    median: float
    p99: float
    p999: float
    worst: float


class Schedule:
    """Slots at start + k/rate.

    Each slot is computed from the start time, so errors do not accumulate: after an hour slot k is still at k/rate.
    After a delay the slot due now is served; missed slots are skipped.

    Parameters
    ----------
    rate : float
        Slots a second [Hz].
    start : float
        Instant of slot 0 [s].

    Raises
    ------
    TimingError
        If the rate is not a positive number.
    """

    def __init__(self, rate: float, start: float) -> None:
        self.rate = check_setpoint_rate(rate)
        self.start = start
        self.skipped = 0
        self._last = -1
        self._lateness = array("d")
        self._served = array("d")

    @property
    def due(self) -> float:
        """The instant of the next slot [s]."""
        return self.instant(self._last + 1)

    def instant(self, slot: int) -> float:
        """Return when a slot is due [s]."""
        return self.start + slot / self.rate

    @property
    def last_lateness(self) -> float:
        """Lateness of the slot served last [s]."""
        return self._lateness[-1]

    def take(self, now: float) -> int:
        """Serve the slot due at ``now`` and return its number; missed slots are skipped and counted."""
        self._lateness.append(max(0.0, now - self.due))
        self._served.append(now)
        index = max(self._last + 1, math.floor((now - self.start) * self.rate + 1e-6))
        self.skipped += index - self._last - 1
        self._last = index
        return index

    def lateness(self) -> Lateness:
        """Summarise the slots served so far."""
        if not self._lateness:
            return Lateness(0, 0, 0.0, 0.0, 0.0, 0.0, 0.0)
        late = np.array(self._lateness)
        took = self._served[-1] - self._served[0]
        rate = self._last / took if took > 0 else 0.0
        median, p99, p999 = np.percentile(late, [50, 99, 99.9]).tolist()
        return Lateness(len(late), self.skipped, rate, median, p99, p999, float(late.max()))


AHEAD = 0.5
"""Time from the last vehicle's being ready to the first setpoint of all [s]."""


class CommonFlight:
    """What the flights of a fleet tell each other: who is ready, when all begin, and why all stop.

    Parameters
    ----------
    names : sequence of str
        Of the vehicles.
    clock : Clock
        The same for all.
    rate : float
        Setpoints a second, the same for all [Hz].
    trigger : callable
        Called once all are ready; True lets all go.
    links : sequence of Link
        Of the vehicles: no two of them may lead to the same one.
    judge : callable, optional
        Returns why vehicles that stand at these places must not fly, or None.

    Attributes
    ----------
    released : bool
        Whether all are prepared and let go: vehicles that begin on the ground are armed from then on, all at once.
    begin : float or None
        When the first setpoint of all is due [s].
    reason : str or None
        Why all stop.
    judged : bool
        Whether all have told where they stand, and these places were judged.
    """

    def __init__(
        self,
        names: Sequence[str],
        clock: Clock,
        rate: float,
        trigger: Callable[[], bool],
        links: Sequence[Link],
        judge: Callable[[Sequence[Vector]], str | None] = lambda places: None,
    ) -> None:
        self._names, self._clock, self._rate, self._trigger, self._links = tuple(names), clock, rate, trigger, links
        self._epoch, self._lock = clock.now(), threading.Lock()
        self._prepared, self._ready = [False] * len(names), [False] * len(names)
        self._judge = judge
        self._places: list[Vector | None] = [None] * len(names)
        self.judged = self.released = False
        self.begin: float | None = None
        self.reason: str | None = None

    def aligned(self, start: float) -> float:
        """Return the first instant of the common grid of setpoints from another on [s]."""
        return self._epoch + math.ceil((start - self._epoch) * self._rate) / self._rate

    def stand(self, member: int, place: Vector) -> None:
        """Take note of where a vehicle stands before anything is sent; with the last of them all are judged."""
        with self._lock:
            self._places[member] = place
            places = [each for each in self._places if each is not None]
            if len(places) == len(self._places) and not self.judged:
                refusal = self._judge(places)
                if refusal is not None and self.reason is None:
                    self.reason = refusal
                self.judged = True

    def tell(self, member: int, ready: bool, stopped: str | None, prepared: bool = False) -> None:
        """Take note of a vehicle: whether it is ready, or would be once it is armed, and why it has stopped."""
        with self._lock:
            if stopped is not None and self.reason is None:
                self.reason = f"{self._names[member]} has stopped: {stopped}"
            if self.begin is None and self.reason is None:
                self.reason = self._mistaken(member)
            self._ready[member], self._prepared[member] = ready, ready or prepared
            if not self.released and self.reason is None and all(self._prepared):
                self.released = self._trigger()
            if self.begin is None and self.reason is None and self.released and all(self._ready):
                self.begin = self.aligned(self._clock.now() + AHEAD)

    def _mistaken(self, member: int) -> str | None:
        """Return why the link of a member may lead to the vehicle of another, or None."""
        link = self._links[member]
        for name, other in zip(self._names, self._links, strict=True):
            if other is not link and link.may_lead_where(other):
                give = "give each vehicle a link of its own, or name the system of each (--system 1,2)"
                return f"{self._names[member]} and {name} both lead to system {link.vehicle.system}: {give}"
        return None


@dataclass(frozen=True)
class LinkSettings:
    """What a link takes from others than its vehicle.

    Parameters
    ----------
    moves : float
        Silence after which a vehicle may come from another address [s].
    peers : int
        Senders that are kept apart at a time.
    drain : int
        What is looked at before time is looked at again: a flood must not keep a setpoint from leaving.
    """

    moves: float = 2.0
    peers: int = 64
    drain: int = 100


LISTENING = LinkSettings()


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
    unknown : int
        Messages of the vehicle of a type that is not known here, such as ArduPilot's own.
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
        self.refused = self.unknown = 0
        self.numbering: Callable[[], int] | None = None
        own = self._dialect.MAV_COMP_ID_ONBOARD_COMPUTER
        self._codec = self._dialect.MAVLink(self, srcSystem=source_system, srcComponent=own)
        self._parsers: dict[Peer, Any] = {}
        self._peer: Peer | None = None
        self._next_heartbeat = clock.now()
        if signing_key is not None:  # its time stamp counts 10 microseconds since 2015 and must never go back
            signing = self._codec.signing
            signing.secret_key, signing.sign_outgoing = signing_key, True
            signing.timestamp = int((time.time() - 1420070400) * 1e5)

    def may_lead_where(self, other: Link) -> bool:
        """Whether the vehicle may be that of another link: of its id, from its address or among others' vehicles."""
        if not self.vehicle.known or self.vehicle.system != other.vehicle.system:
            return False
        autopilot = self._dialect.MAV_COMP_ID_AUTOPILOT1
        return self._peer == other._peer or any(component == autopilot for _, component in self.ignored | other.ignored)

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
            for _ in range(LISTENING.drain):
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
        d = self._dialect
        kind = (d.MAV_TYPE_ONBOARD_CONTROLLER, d.MAV_AUTOPILOT_INVALID)
        self.send(d.MAVLink_heartbeat_message(*kind, 0, 0, d.MAV_STATE_ACTIVE, 3))

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
            if len(self._parsers) >= LISTENING.peers:
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
        if message.get_type() == "BAD_DATA":
            self.refused += 1
            return False
        if message.get_type().startswith("UNKNOWN"):
            header = message.get_msgbuf()[:7]  # the parser keeps neither sender nor number of such a message
            place = (5, 6) if header[0] == self._dialect.PROTOCOL_MARKER_V2 else (3, 4)
            self.unknown += all(header[k] == own for k, own in zip(place, self._chosen(), strict=True))
            return False
        sender = (message.get_srcSystem(), message.get_srcComponent())
        if not self.vehicle.known and self._is_suitable(message, sender[0]):
            self.vehicle = replace(self.vehicle, system=sender[0], component=sender[1])
            self.ignored.pop(sender, None)
        chosen = self._chosen()
        elsewhere = self._peer not in (None, peer) and self._clock.now() - self.vehicle.heard < LISTENING.moves
        if chosen == (0, 0) or sender != chosen or elsewhere:
            self.ignored[sender] += 1
            return False
        self.vehicle = self.vehicle.told(message, self._clock.now(), self._events)
        return True

    def _chosen(self) -> tuple[int, int]:
        """Return system and component of the vehicle; zeros before one is chosen."""
        return self.vehicle.system, self.vehicle.component

    def _is_suitable(self, message: Message, system: int) -> bool:
        """Return whether this is the heartbeat of an autopilot with the requested system id."""
        if message.get_type() != "HEARTBEAT" or message.autopilot == self._dialect.MAV_AUTOPILOT_INVALID:
            return False
        return message.type != self._dialect.MAV_TYPE_GCS and self._wanted in (None, system)

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
        InputError
            If the timeout is not 0 or more.
        LinkError
            If none comes in time; the sentence says how long, on what address, and who else was heard.
        """
        if not timeout >= 0.0:
            raise InputError(f"the wait for a vehicle is {timeout} s: it must be 0 or more")
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


def open_link(
    connection: str,
    clock: Clock | None = None,
    *,
    baud: int = 115200,
    system: int | None = None,
    source_system: int = 245,
    signing_key: bytes | FileName | None = None,
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
    transport = open_transport(connection, baud)
    return Link(transport, clock or Clock(), system, source_system, signing_key=key, events=events)


def read_signing_key(path: FileName) -> bytes:
    """Read a MAVLink signing key: 32 raw bytes, or 64 hexadecimal digits.

    Raises
    ------
    FileError
        If the file holds neither.
    """
    key = read_bytes(path)
    if len(key) != 32:
        with suppress(ValueError):
            key = bytes.fromhex(key.decode("ascii").strip())
    if len(key) != 32:
        raise FileError(f"{path} holds no MAVLink signing key: it must be 32 bytes, or 64 hexadecimal digits")
    return key

"""Upload of a fleet to Crazyflies, and its flight: take-off, to the starts, a start of all, landing.

Vehicles answer on their own links. A start is sent a few times against loss, as crazyswarm2 does with broadcasts: the
firmware begins anew with each, so all begin between the first and the last. Where a vehicle heard none, all are told
again: one alone would be late by the wait.

Nothing takes off before every memory was read back. A vehicle that is gone in the air makes all others land in place.
"""

from __future__ import annotations

import math
import struct
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass

import numpy as np

from minsnap.basics.interrupts import ended_in_order
from minsnap.errors import FileError, FleetError, FlightError, LinkError
from minsnap.files.formats.bezier_segments import distance_bounds
from minsnap.files.formats.crazyflie import MAX_PIECES, compressed, crazyflie_rows, curve_of_bytes, curve_of_rows
from minsnap.fleet.common_clock import Fleet
from minsnap.flight.crtp_link import LINK_BITS, CrtpLink, RadioBroadcast, act_on_each, ask, channel_of, heard, open_link
from minsnap.trajectory.trajectory import Trajectory

MEMORY_PORT, INFO, READ, WRITE = 4, 0, 1, 2
COMMAND_PORT = 8
TRAJECTORIES = 0x12
"""Type of the memory of trajectories."""

CHUNK = 24
"""Bytes of a write or a read."""

SET_GROUP, DEFINE = 0, 6
POLYNOMIALS, COMPRESSED = 0, 1
SLOT, GROUP = 1, 1
"""Number of the trajectory in a vehicle, and the group that is started."""


@dataclass(frozen=True)
class Upload:
    """The content of a vehicle's memory.

    Parameters
    ----------
    content : bytes
    kind : int
        ``POLYNOMIALS``, 33 float32 a piece, or ``COMPRESSED``.
    pieces : int
    distance : float
        Upper bound of the distance of the curve in it to the planned one [m].
    """

    content: bytes
    kind: int
    pieces: int
    distance: float


def upload_of(trajectory: Trajectory, farthest: float = 0.01) -> Upload:
    """Return the bytes of a trajectory: polynomials if they fit, else the compressed form.

    Raises
    ------
    FileError
        If neither fits, or what is held is further than ``farthest`` [m] from the trajectory; says by how much.
    """
    if max(len(trajectory.durations), 2) <= MAX_PIECES:
        with np.errstate(over="ignore"):
            rows = crazyflie_rows(trajectory).astype("<f4")
        held = curve_of_rows(rows.astype(np.float64))
        content, kind = np.roll(rows, -1, axis=1).tobytes(), POLYNOMIALS
    else:
        content, kind = compressed(trajectory), COMPRESSED
        held = curve_of_bytes(content)
    distance = float(distance_bounds(trajectory, held)[0])
    if distance > farthest:
        text = f"the vehicle would hold a curve up to {distance:.2g} m from the planned one, rounded to its numbers"
        raise FileError(f"{text}: fly slower, or plan legs of more even durations")
    return Upload(content, kind, len(held.durations), distance)


def store(link: CrtpLink, upload: Upload) -> None:
    """Write a trajectory, read it back, define it and put the vehicle in the group.

    Raises
    ------
    LinkError
        If the vehicle does not answer.
    FlightError
        If it has no such memory, the memory reads otherwise than written, or it refuses.
    """
    number, size = find_memory(link)
    if len(upload.content) > size:
        raise FileError(f"{link.name}: {len(upload.content)} bytes, and its memory has {size}: fly it in parts")
    parts = [(start, upload.content[start : start + CHUNK]) for start in range(0, len(upload.content), CHUNK)]
    for start, part in parts:
        _write(link, number, start, part)
    stored = b"".join(_read(link, number, start, len(part)) for start, part in parts)
    if stored != upload.content:
        wrong = next(i for i, (a, b) in enumerate(zip(stored, upload.content, strict=True)) if a != b)
        raise FlightError(f"{link.name}: byte {wrong} reads {stored[wrong]} and was written {upload.content[wrong]}")
    command(link, struct.pack("<BBBBIB", DEFINE, SLOT, 1, upload.kind, 0, upload.pieces))
    command(link, struct.pack("<BB", SET_GROUP, GROUP))


def find_memory(link: CrtpLink) -> tuple[int, int]:
    """Return number and size of the memory of trajectories."""
    count = ask(link, MEMORY_PORT, INFO, b"\x01", lambda body: body[:1] == b"\x01" and len(body) > 1)[1]
    for number in range(count):
        request = bytes([2, number])
        about = ask(link, MEMORY_PORT, INFO, request, lambda body, request=request: body[:2] == request)  # type: ignore[misc]
        if len(about) >= 7 and about[2] == TRAJECTORIES:
            return number, struct.unpack_from("<I", about, 3)[0]
    raise FlightError(f"{link.name} has no memory of trajectories: its firmware is too old")


def command(link: CrtpLink, body: bytes) -> None:
    """Give a command of the high-level commander until it is answered, or raise FlightError if it is refused."""
    answer = ask(link, COMMAND_PORT, 0, body, lambda reply: reply[:1] == body[:1] and len(reply) >= 4)
    if answer[3]:
        raise FlightError(f"{link.name} refuses command {body[0]} with error {answer[3]}")


def _answered(link: CrtpLink, channel: int, place: bytes, rest: bytes) -> bytes:
    """Ask the memory for something at a place; return the status of its answer and what follows."""
    return ask(link, MEMORY_PORT, channel, place + rest, lambda body: body[:5] == place and len(body) > 5)[5:]


def _write(link: CrtpLink, number: int, start: int, part: bytes) -> None:
    status = _answered(link, WRITE, struct.pack("<BI", number, start), part)[0]
    if status:
        raise FlightError(f"{link.name} refuses to write at {start}: error {status}")


def _read(link: CrtpLink, number: int, start: int, count: int) -> bytes:
    status, *content = _answered(link, READ, struct.pack("<BI", number, start), bytes([count]))
    if status or len(content) != count:
        raise FlightError(f"{link.name} does not read {count} bytes at {start}: error {status}")
    return bytes(content)


START = 13


@dataclass(frozen=True)
class Volleys:
    """How often a start is sent.

    Parameters
    ----------
    copies : int
        Packets of a volley.
    pause : float
        Between two of them [s].
    most : int
        Volleys before a vehicle that does not answer counts as gone.
    hearing : float
        Wait for the answers to one [s].
    """

    copies: int = 3
    pause: float = 1e-3
    most: int = 3
    hearing: float = 0.25


@dataclass(frozen=True)
class GroupStart:
    """How a fleet was started.

    Parameters
    ----------
    ways : str
        By which broadcasts, and how many vehicles on links of their own, in words.
    spread : float
        Time from before the first packet to after the last [s]; no two vehicles began further apart.
    volleys : int
        1, or more where a vehicle heard none.
    """

    ways: str
    spread: float
    volleys: int

    def __str__(self) -> str:
        again = f", told {self.volleys} times" if self.volleys > 1 else ""
        return f"started {self.ways}, all within {1e3 * self.spread:.1f} ms{again}"


def planned_ways(uris: Sequence[str]) -> str:
    """Return how vehicles of these addresses would be started, in words."""
    channels = [channel_of(uri) for uri in uris]
    named, alone = sorted({one for one in channels if one}), channels.count(None)
    words = [f"by a broadcast on {', '.join(named)}"] if named else []
    words += [f"link by link ({alone} without a broadcast)"] if alone else []
    return " and ".join(words)


def start_group(links: Sequence[CrtpLink], volleys: Volleys) -> GroupStart:
    """Start the trajectories of all vehicles at one instant, or as near to it as their links allow.

    Raises
    ------
    LinkError
        If a vehicle does not answer.
    FlightError
        If one refuses.
    """
    channels = {link.name: channel_of(link.name) for link in links}
    named = sorted({channel for channel in channels.values() if channel})
    with ExitStack() as opened:
        casts = [opened.enter_context(closing(RadioBroadcast(channel))) for channel in named]
        alone = [link for link in links if channels[link.name] is None]
        sends = [cast.send for cast in casts] + [link.send for link in alone]
        for number in range(1, volleys.most + 1):
            act_on_each(links, _forget)
            spread = _send_copies(sends, volleys)
            begun: list[bool] = act_on_each(links, lambda link, _: _has_begun(link, volleys.hearing))
            if all(begun):
                return GroupStart(planned_ways([link.name for link in links]), spread, number)
    deaf = ", ".join(link.name for link, told in zip(links, begun, strict=True) if not told)
    raise LinkError(f"{deaf} does not answer to the start: out of reach, or on another channel than its address says")


def _forget(link: CrtpLink, _: int) -> None:
    """Drop what has come, such as answers to a start before."""
    while link.receive(1e-3):
        pass


def _send_copies(sends: Sequence[Callable[[bytes], None]], volleys: Volleys) -> float:
    """Send all copies of the start, and return how long that took [s]."""
    packet = bytes([COMMAND_PORT << 4 | LINK_BITS]) + struct.pack("<BBBBBBf", START, GROUP, 0, 0, 0, SLOT, 1.0)
    began = time.monotonic()
    for copy in range(volleys.copies):
        if copy:
            time.sleep(volleys.pause)
        for send in sends:
            send(packet)
    return time.monotonic() - began


def _has_begun(link: CrtpLink, wait: float) -> bool:
    """Whether a vehicle answers that it has begun."""
    answer = heard(link, COMMAND_PORT << 4, lambda body: body[:1] == bytes([START]) and len(body) >= 4, wait)
    if answer is not None and answer[3]:
        raise FlightError(f"{link.name} refuses to start with error {answer[3]}")
    return answer is not None


TAKE_OFF, LAND, GO_TO = 7, 8, 12

Place = tuple[float, float]
"""Where a vehicle stands: x and y [m]."""

Say = Callable[[str], None]
"""Is told a sentence."""


@dataclass(frozen=True)
class FlightTimes:
    """How long the parts around the trajectories take: what their ways need at moderate speeds, and no less than this.

    Parameters
    ----------
    take_off : float
        Climb to the height of the start, at least [s].
    approach : float
        Straight way to the start, at least [s].
    landing : float
        At least [s].
    settle : float
        Wait after each of these [s].
    start : Volleys
        How often the start of all is sent.
    ground : float
        Height below which a trajectory begins on the ground, and takes off itself [m].
    climb, travel, sink : float
        Greatest speeds of the take-off, of the way to the start, and of the landing [m/s]: moderate, and slower down,
        into its own wash.
    peak : float
        Greatest speed of a way from rest to rest over its mean: 35/16 for the firmware's polynomials of degree 7.
    """

    take_off: float = 2.5
    approach: float = 3.0
    landing: float = 3.0
    settle: float = 0.5
    start: Volleys = Volleys()
    ground: float = 0.1
    climb: float = 1.0
    travel: float = 1.0
    sink: float = 0.8
    peak: float = 35.0 / 16.0

    def lasting(self, least: float, way: float, speed: float) -> float:
        """Return the time of a way [m] that is nowhere faster than a speed [m/s]; ``least`` [s] or more."""
        return max(least, self.peak * way / speed)

    def landing_from(self, height: float) -> bytes:
        """Return the command to land from a height [m] or less, in place."""
        return struct.pack("<BBff?f", LAND, 0, 0.0, 0.0, True, self.lasting(self.landing, height, self.sink))


def uploads(fleet: Fleet, uris: Sequence[str]) -> list[Upload]:
    """Return the memory of each vehicle, without a link.

    Raises
    ------
    FleetError
        If there are not as many addresses as vehicles, or one is named twice.
    FileError
        If a trajectory does not fit.
    """
    if len(uris) != len(fleet):
        raise FleetError(f"there are {len(uris)} addresses for {len(fleet)} vehicles: give one for each")
    twice = next((uri for uri in uris if list(uris).count(uri) > 1), None)
    if twice is not None:
        raise FleetError(f"the address {twice} stands twice: each vehicle needs its own")
    return [upload_of(curve) for curve in fleet]


def upload(
    fleet: Fleet,
    uris: Sequence[str],
    *,
    start: bool = False,
    timing: FlightTimes | None = None,
    told: Say | None = None,
    places: Sequence[Place | None] | None = None,
) -> None:
    """Write a fleet into the memories of its vehicles, and fly it if ``start`` says so.

    Parameters
    ----------
    fleet : Fleet
    uris : sequence of str
        Address of each vehicle: ``udp://host:port``, or what cflib knows.
    start : bool
        Take off, fly to the starts, start all together, and land at the end.
    timing : FlightTimes, optional
    told : callable, optional
        Is told a sentence after each step.
    places : sequence of (x, y) or None, optional
        Where the vehicles stand before the flight [m], for the time of their ways; None for below its start.

    Raises
    ------
    LinkError
        If a vehicle does not answer; in the air, all others were told to land.
    FlightError
        If a memory reads otherwise than written, or a vehicle refuses.
    """
    contents = uploads(fleet, uris)
    say = told or (lambda line: None)
    with ExitStack() as opened:
        links = [opened.enter_context(closing(open_link(uri))) for uri in uris]
        act_on_each(links, lambda link, i: store(link, contents[i]))
        size, off = sum(len(part.content) for part in contents), max(part.distance for part in contents)
        say(f"{len(links)} memories written and read back, {size} bytes, at most {1e3 * off:.2g} mm from the curves")
        if start:
            with ended_in_order():
                _fly(fleet, links, timing or FlightTimes(), places or [None] * len(links), say)


def _fly(
    fleet: Fleet, links: Sequence[CrtpLink], timing: FlightTimes, places: Sequence[Place | None], say: Say
) -> None:
    """Climb to the starts that are above the ground, fly the uploaded curves; an early end lands all in place."""
    ends = [timing.landing_from(float(curve(curve.duration)[2])) for curve in fleet]
    anywhere = [timing.landing_from(float(curve.control_points[..., 2].max())) for curve in fleet]
    try:
        _go_to_starts(fleet, links, timing, places)
        say(str(start_group(links, timing.start)))
        time.sleep(fleet.duration + timing.settle)
        act_on_each(links, lambda link, i: command(link, ends[i]))
        say("landing")
    except BaseException:
        _land_all(links, anywhere, say)
        raise


def _go_to_starts(fleet: Fleet, links: Sequence[CrtpLink], timing: FlightTimes, places: Sequence[Place | None]) -> None:
    """Climb to the heights of the starts, and go to them in one time; those on the ground stay there."""
    high = [each for each in zip(links, fleet, places, strict=True) if each[1](0.0)[2] > timing.ground]
    if not high:
        return
    flying, starts = [link for link, *_ in high], [curve(0.0) for _, curve, _ in high]
    climbs = [timing.lasting(timing.take_off, at[2], timing.climb) for at in starts]
    ups = [struct.pack("<BBff?f", TAKE_OFF, 0, at[2], 0.0, True, each) for at, each in zip(starts, climbs, strict=True)]
    act_on_each(flying, lambda link, i: command(link, ups[i]))
    time.sleep(max(climbs) + timing.settle)
    far = max(0.0 if place is None else math.dist(place, at[:2]) for (*_, place), at in zip(high, starts, strict=True))
    approach = timing.lasting(timing.approach, far, timing.travel)
    yaws = [float(curve.yaw(np.array(0.0))) for _, curve, _ in high]
    ways = [struct.pack("<BBBBfffff", GO_TO, 0, 0, 0, *at, yaw, approach) for at, yaw in zip(starts, yaws, strict=True)]
    act_on_each(flying, lambda link, i: command(link, ways[i]))
    time.sleep(approach + timing.settle)


def _land_all(links: Sequence[CrtpLink], landings: Sequence[bytes], say: Say) -> None:
    """Tell every vehicle to land in place, whether or not others answer."""
    gone = []

    def land(link: CrtpLink, i: int) -> None:
        try:
            command(link, landings[i])
        except (LinkError, FlightError):
            gone.append(link.name)

    act_on_each(links, land)
    say("told all to land" + (f"; no answer from {', '.join(gone)}" if gone else ""))

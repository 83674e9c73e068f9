"""Upload of a fleet to Crazyflies: every memory is read back before a curve is defined, or anything takes off."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing

from minsnap.basics.interrupts import ended_in_order
from minsnap.errors import FileError, FleetError, FlightError
from minsnap.fleet import Fleet
from minsnap.flight.crtp_link import CrtpLink, act_on_each, ask, open_link
from minsnap.flight.high_level import GROUP, command
from minsnap.flight.swarm_flight import FlightTimes, Place, Say, fly_swarm
from minsnap.shows.memory_parts import MemoryPart, Upload, parts_of

MEMORY_PORT, INFO, READ, WRITE = 4, 0, 1, 2
TRAJECTORIES = 0x12
"""Type of the memory of trajectories."""

CHUNK = 24
"""Bytes of a write or a read."""

SET_GROUP, DEFINE = 0, 6


def storing(link: CrtpLink, upload: Upload) -> Iterator[None]:
    """Write a trajectory, read it back, define it and put the vehicle in the group, a packet after the other.

    Raises
    ------
    LinkError
        If the vehicle does not answer.
    FlightError
        If it has no such memory, the memory reads otherwise than written, or it refuses.
    """
    number, size = find_memory(link)
    yield
    if upload.offset + len(upload.content) > size:
        raise FileError(f"{link.name}: {len(upload.content)} bytes, and its memory has {size}: fly it in parts")
    starts = range(0, len(upload.content), CHUNK)
    parts = [(upload.offset + start, upload.content[start : start + CHUNK]) for start in starts]
    for start, part in parts:
        _write(link, number, start, part)
        yield
    stored = b""
    for start, part in parts:
        stored += _read(link, number, start, len(part))
        yield
    if stored != upload.content:
        wrong = next(i for i, (a, b) in enumerate(zip(stored, upload.content, strict=True)) if a != b)
        raise FlightError(f"{link.name}: byte {wrong} reads {stored[wrong]} and was written {upload.content[wrong]}")
    command(link, struct.pack("<BBBBIB", DEFINE, upload.slot, 1, upload.kind, upload.offset, upload.pieces))
    command(link, struct.pack("<BB", SET_GROUP, GROUP))


def store(link: CrtpLink, upload: Upload) -> None:
    """Do the same without a pause."""
    for _ in storing(link, upload):
        pass


def find_memory(link: CrtpLink) -> tuple[int, int]:
    """Return number and size of the memory of trajectories."""
    count = ask(link, MEMORY_PORT, INFO, b"\x01", lambda body: body[:1] == b"\x01" and len(body) > 1)[1]
    for number in range(count):
        request = bytes([2, number])
        about = ask(link, MEMORY_PORT, INFO, request, lambda body, request=request: body[:2] == request)  # type: ignore[misc]
        if len(about) >= 7 and about[2] == TRAJECTORIES:
            return number, struct.unpack_from("<I", about, 3)[0]
    raise FlightError(f"{link.name} has no memory of trajectories: its firmware is too old")


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


def uploads(fleet: Fleet, uris: Sequence[str], acts: Sequence[tuple[str, float]] = ()) -> list[MemoryPart]:
    """Return what lies in the memories of all vehicles, one part after the other, without a link.

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
    return parts_of(fleet, acts)


def upload(
    fleet: Fleet,
    uris: Sequence[str],
    *,
    start: bool = False,
    timing: FlightTimes | None = None,
    told: Say | None = None,
    places: Sequence[Place | None] | None = None,
    acts: Sequence[tuple[str, float]] = (),
) -> None:
    """Write a fleet into the memories of its vehicles, and fly it if ``start`` says so.

    One that does not fit is written in parts from rest to rest: the first two before the flight, each other one while
    the one before it is flown.

    Parameters
    ----------
    fleet : Fleet
    uris : sequence of str
        Address of each vehicle: ``udp://host:port``, or what cflib knows.
    start : bool
        Take off, fly to the starts, start all together, and land at the end, on ways that are proved apart.
    timing : FlightTimes, optional
    told : callable, optional
        Is told a sentence after each step.
    places : sequence of (x, y) or None, optional
        Where a file says that the vehicles stand before the flight [m]. What they say themselves
        counts; a difference is told.
    acts : sequence of (str, float)
        Names of acts, and when they are reached [s], to name one that does not fit.

    Raises
    ------
    LinkError
        If a vehicle does not answer; in the air, all others were told to land.
    FlightError
        If a memory reads otherwise than written, a vehicle refuses or cannot fly on, or no ways are proved apart.
    """
    parts = uploads(fleet, uris, acts)
    say = told or (lambda line: None)
    with ExitStack() as opened:
        links = [opened.enter_context(closing(open_link(uri))) for uri in uris]
        first = [each for part in parts[:2] for each in part.uploads]
        for part in parts[:2]:
            act_on_each(links, lambda link, i, part=part: store(link, part.uploads[i]))  # type: ignore[misc]
        size, off = sum(len(each.content) for each in first), max(each.distance for each in first)
        say(f"{len(links)} memories written and read back, {size} bytes, at most {1e3 * off:.2g} mm from the curves")
        if len(parts) > 1:
            say(f"of {len(parts)} parts, from rest to rest, those after the second are written in flight")
        if start:
            with ended_in_order():
                fly_swarm(fleet, links, timing or FlightTimes(), places or [None] * len(links), say, parts, storing)

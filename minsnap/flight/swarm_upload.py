"""Upload of a fleet to Crazyflies: every memory is read back before a curve is defined, or anything takes off."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass

import numpy as np

from minsnap.basics.interrupts import ended_in_order
from minsnap.errors import FileError, FleetError, FlightError
from minsnap.files.formats import MAX_PIECES, compressed, crazyflie_rows, curve_of_bytes, curve_of_rows, distance_bounds
from minsnap.fleet import Fleet
from minsnap.flight.crtp_link import CrtpLink, act_on_each, ask, open_link
from minsnap.flight.high_level import GROUP, SLOT, command
from minsnap.flight.swarm_flight import FlightTimes, Place, Say, fly_swarm
from minsnap.trajectory import Trajectory, widest_step

MEMORY_PORT, INFO, READ, WRITE = 4, 0, 1, 2
TRAJECTORIES = 0x12
"""Type of the memory of trajectories."""

CHUNK = 24
"""Bytes of a write or a read."""

SET_GROUP, DEFINE = 0, 6
POLYNOMIALS, COMPRESSED = 0, 1


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
        step, instant, piece = widest_step(trajectory)
        if step > farthest:
            raise FileError(
                f"piece {piece} ends {step:.3g} m from piece {piece + 1}, at {instant:.4g} s: mend the curve"
            )
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
        Take off, fly to the starts, start all together, and land at the end, on ways that are proved apart.
    timing : FlightTimes, optional
    told : callable, optional
        Is told a sentence after each step.
    places : sequence of (x, y) or None, optional
        Where a file says that the vehicles stand before the flight [m]. What they say themselves
        counts; a difference is told.

    Raises
    ------
    LinkError
        If a vehicle does not answer; in the air, all others were told to land.
    FlightError
        If a memory reads otherwise than written, a vehicle refuses or cannot fly on, or no ways are proved apart.
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
                fly_swarm(fleet, links, timing or FlightTimes(), places or [None] * len(links), say)

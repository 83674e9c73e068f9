"""The Crazyflie's memory of trajectories over CRTP: find it, write it, read it back, define what is in it."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from minsnap.errors import FileError, FlightError
from minsnap.files.formats.crazyflie import MAX_PIECES, compressed, crazyflie_rows
from minsnap.flight.crazyflie.crtp_link import CrtpLink, ask
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
    """

    content: bytes
    kind: int
    pieces: int


def upload_of(trajectory: Trajectory) -> Upload:
    """Return the bytes of a trajectory: polynomials if they fit, else the compressed form.

    Raises
    ------
    FileError
        If neither fits; says by how much.
    """
    if max(len(trajectory.durations), 2) <= MAX_PIECES:
        rows = crazyflie_rows(trajectory)
        order = np.concatenate([rows[:, 1:], rows[:, :1]], axis=1)
        return Upload(order.astype("<f4").tobytes(), POLYNOMIALS, len(rows))
    return Upload(compressed(trajectory), COMPRESSED, len(trajectory.durations))


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
    for start in range(0, len(upload.content), CHUNK):
        _write(link, number, start, upload.content[start : start + CHUNK])
    stored = b"".join(
        _read(link, number, start, min(CHUNK, len(upload.content) - start))
        for start in range(0, len(upload.content), CHUNK)
    )
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


def _write(link: CrtpLink, number: int, start: int, part: bytes) -> None:
    place = struct.pack("<BI", number, start)
    answer = ask(link, MEMORY_PORT, WRITE, place + part, lambda body: body[:5] == place and len(body) > 5)
    if answer[5]:
        raise FlightError(f"{link.name} refuses to write at {start}: error {answer[5]}")


def _read(link: CrtpLink, number: int, start: int, count: int) -> bytes:
    place = struct.pack("<BI", number, start)
    answer = ask(link, MEMORY_PORT, READ, place + bytes([count]), lambda body: body[:5] == place and len(body) > 5)
    if answer[5] or len(answer) != 6 + count:
        raise FlightError(f"{link.name} does not read {count} bytes at {start}: error {answer[5]}")
    return answer[6:]

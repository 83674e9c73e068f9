"""Skybrush's binary shows, ``.skyb``: the trajectory and the lights of one vehicle, with a checksum.

After ``skyb``, the version (2), a byte of features (bit 0: a checksum) and the CRC-32 of the whole file with these
four bytes zero; then blocks of a type, a length as uint16 and a body. Block 1 is the trajectory: a unit in millimetres,
the start, and segments (``bezier_segments``); block 2 the lights. World axes: x along the show's orientation, y to its
left, z up. Only lines and cubics are written: degree 7 is played, but its take-off and landing are computed wrongly.
"""

from __future__ import annotations

import os
import struct
import zlib
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from minsnap.basics.storage.atomic import atomic_write
from minsnap.basics.storage.reading import check_size, reading
from minsnap.errors import FileError
from minsnap.files.format import Format, Writing
from minsnap.files.formats.bezier_segments import packed, unpacked
from minsnap.files.formats.cubic_segments import CubicSegments, cubic_segments, is_line
from minsnap.files.formats.light_programme import Lights, light_bytes, lights_of
from minsnap.files.formats.pieces import polynomials_of
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory

MARK, VERSION, CHECKSUM = b"skyb", 2, 1
TRAJECTORY, LIGHTS = 1, 2
"""Types of blocks."""

LARGEST_BLOCK = 65535
"""Bytes of the largest block."""

LARGEST_FILE = 1 << 24
"""Bytes of the largest file that is read."""

UNIT_BITS = 127
"""Bits of the unit; the highest one is retired."""


@dataclass(frozen=True)
class SkybrushFile:
    """What a binary show holds of one vehicle.

    Parameters
    ----------
    trajectory : Trajectory
    lights : Lights or None
    """

    trajectory: Trajectory
    lights: Lights | None = None


def skybrush_bytes(segments: CubicSegments, lights: Lights | None = None) -> bytes:
    """Return the content of a file.

    Raises
    ------
    FileError
        If a block is too long; says by how much, and how much of the trajectory fits.
    """
    body = struct.pack("<B4h", segments.scale, *segments.points[0, 0].tolist(), 0)
    pieces = [_segment(*row) for row in zip(np.diff(segments.breaks).tolist(), segments.points, strict=True)]
    content = body + b"".join(pieces)
    if len(content) > LARGEST_BLOCK:
        sizes = len(body) + np.cumsum([len(piece) for piece in pieces])
        fits = int(np.searchsorted(sizes, LARGEST_BLOCK, side="right"))
        over = len(content) - LARGEST_BLOCK
        raise FileError(
            f"{len(pieces)} segments take {len(content)} bytes, {over} more than a block holds: "
            f"the first {segments.breaks[fits] / 1e3:.1f} s of {segments.breaks[-1] / 1e3:.1f} s fit; shorten the show "
            "or allow cubics farther from the curve"
        )
    blocks = _block(TRAJECTORY, content) + _block(LIGHTS, light_bytes(lights))
    head = MARK + bytes([VERSION, CHECKSUM])
    return head + struct.pack("<I", checksum(head + bytes(4) + blocks)) + blocks


def checksum(content: bytes) -> int:
    """Return the CRC-32 of a file whose checksum is zero: it begins at 0 and is not inverted at the end."""
    return zlib.crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF


def write_skybrush(
    trajectory: Path, path: str | os.PathLike[str], lights: Lights | None = None, *, clobber: bool = True
) -> CubicSegments:
    """Write a trajectory or a shape in one atomic step, and return what was written; raises as ``cubic_segments``."""
    segments = cubic_segments(polynomials_of(trajectory)[0])
    content = skybrush_bytes(segments, lights)
    with atomic_write(path, "wb", clobber=clobber) as file:
        file.write(content)
    return segments


def read_skybrush(path: str | os.PathLike[str]) -> SkybrushFile:
    """Read a binary show of version 1 or 2.

    Raises
    ------
    FileError
        If it is none, its checksum is wrong, or it has no trajectory.
    """
    check_size(path, LARGEST_FILE)
    with reading(path, "a binary Skybrush show"):
        with open(path, "rb") as file:
            content = file.read()
        return parsed(content, str(path))


def parsed(content: bytes, where: str = "the show") -> SkybrushFile:
    """Return the curve and the lights in the bytes of a file; ``where`` names it in messages."""
    if content[:4] != MARK or content[4] not in (1, VERSION):
        raise FileError(f"{where} is not a binary Skybrush show of version 1 or 2")
    offset = 5
    if content[4] == VERSION:
        offset = 10 if content[5] & CHECKSUM else 6
        if offset == 10 and struct.unpack_from("<I", content, 6)[0] != checksum(content[:6] + bytes(4) + content[10:]):
            raise FileError(f"the checksum of {where} is wrong: it was cut off or changed, so copy it again")
    blocks = _blocks(content, offset)
    if TRAJECTORY not in blocks:
        raise FileError(f"{where} has no trajectory")
    body = blocks[TRAJECTORY]
    start = struct.unpack_from("<4h", body, 1)
    milliseconds, points, _ = unpacked(body[9:], start)
    if not len(milliseconds):
        raise FileError(f"the trajectory of {where} has no segments")
    values = points[:, :3].transpose(0, 2, 1) * ((body[0] & UNIT_BITS) / 1e3)
    lights = lights_of(blocks[LIGHTS]) if LIGHTS in blocks else None
    return SkybrushFile(Trajectory(values, milliseconds / 1e3), lights)


def _segment(milliseconds: int, points: npt.NDArray[np.int64]) -> bytes:
    """Pack a segment: a line where all axes are lines, and nothing of an axis that stands still."""
    degree = 1 if is_line(points[None])[0] else 3
    still = (points == points[0]).all(axis=0)
    degrees = np.append(np.where(still, 0, degree), 0)
    rows = np.zeros((4, 4), dtype=np.int64)
    rows[:3, : degree + 1] = points[:: 3 // degree].T
    return packed(milliseconds, rows, degrees)


def _block(kind: int, body: bytes) -> bytes:
    if len(body) > LARGEST_BLOCK:
        raise FileError(f"a programme of lights takes {len(body)} bytes, and a block holds {LARGEST_BLOCK}")
    return struct.pack("<BH", kind, len(body)) + body


def _blocks(content: bytes, offset: int) -> dict[int, bytes]:
    """Return the first block of each type."""
    blocks: dict[int, bytes] = {}
    while offset < len(content):
        kind, length = struct.unpack_from("<BH", content, offset)
        body = content[offset + 3 : offset + 3 + length]
        if len(body) < length:
            raise FileError("a block is cut off")
        blocks.setdefault(kind, body)
        offset += 3 + length
    return blocks


def _write(content: Trajectory, path: str | os.PathLike[str], writing: Writing) -> str:
    segments = write_skybrush(content, path, clobber=writing.clobber)
    count = len(segments.points)
    return f"written as {count} cubics, at most {1e3 * segments.distance:.2g} mm from the curve; headings are left out"


def _read(path: str | os.PathLike[str], frame: str | None) -> Trajectory:
    return read_skybrush(path).trajectory


FORMAT = Format("skybrush", "polynomials", (".skyb",), _write, (".skyb",), _read)

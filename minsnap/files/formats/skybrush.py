"""Skybrush's binary shows, ``.skyb``: a trajectory as cubics of whole millimetres, and lights, with a checksum.

A cubic has the curve's position and velocity at both ends of its interval, so that halving it divides the distance by
16 (error of Hermite interpolation, h^4 max|x''''| / 384); intervals are halved until they are proved to be near.
They end at whole milliseconds: no time is rounded.

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

from minsnap.basics.arrays import FloatArray, ReadOnly
from minsnap.basics.checks import check_positive
from minsnap.basics.storage.atomic import atomic_write
from minsnap.basics.storage.reading import check_size, reading
from minsnap.errors import FileError
from minsnap.files.format import Format
from minsnap.files.formats.bezier_segments import LARGEST, distance_bounds, distances_within, packed, unpacked
from minsnap.files.formats.light_programme import Lights, light_bytes, lights_of
from minsnap.files.formats.pieces import check_spatial, polynomials_of
from minsnap.polynomials.bernstein import basis, differentiate
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory

TOLERANCE = 0.002
"""Largest distance of a cubic from the curve before rounding, by default: about what rounding adds [m]."""

LONGEST = 60_000
"""Longest segment [ms]: Skybrush's own builder splits above."""

SHORTEST_SEGMENT = 8
"""Segments that are not split any more [ms]."""

LARGEST_SCALE = 127
"""Largest unit [mm]."""

_Integers = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class CubicSegments(ReadOnly):
    """A curve as cubics of whole units.

    Parameters
    ----------
    breaks : ndarray of int, shape (segments + 1,)
        From 0 [ms].
    points : ndarray of int, shape (segments, 4, 3)
        Bernstein control points [scale mm]; the first is the last of the segment before.
    scale : int
        Unit [mm].
    distance : float
        Proved upper bound of the distance to the curve at any instant, rounding included [m].
    """

    breaks: _Integers
    points: _Integers
    scale: int
    distance: float

    def trajectory(self) -> Trajectory:
        """Return the curve that is flown: cubics, and lines where no control points are stored."""
        points = np.where(is_line(self.points)[:, None, None], _lines(self.points[:, [0, -1]]), self.points)
        return Trajectory(points * (self.scale / 1e3), np.diff(self.breaks) / 1e3)


def cubic_segments(trajectory: Trajectory, tolerance: float = TOLERANCE) -> CubicSegments:
    """Return a curve as cubics.

    Parameters
    ----------
    trajectory : Trajectory
        Three coordinates.
    tolerance : float
        Largest distance of the cubics before they are rounded [m]; segments of 8 ms may be farther.

    Raises
    ------
    FileError
        If it has other than 3 coordinates, or leads too far away.
    """
    check_spatial(trajectory, "a show")
    tolerance = check_positive("the tolerance", tolerance, "m", FileError)
    breaks = _whole(trajectory.breaks)
    while len(coarse := _coarse(trajectory, breaks, tolerance)):
        breaks = np.union1d(breaks, coarse).astype(np.int64)
    points = _hermite(trajectory, breaks)
    scale = _scale(points)
    rounded = np.round(points * (1e3 / scale)).astype(np.int64)
    # A drone reads each segment from where the last one ends: ends that round to two numbers would be a jump.
    rounded[1:, 0] = rounded[:-1, -1]
    held = CubicSegments(breaks, _straightened(rounded), scale, 0.0)
    return CubicSegments(breaks, held.points, scale, float(distance_bounds(held.trajectory(), trajectory)[0]))


def worst_distance(reach: float, tolerance: float = TOLERANCE) -> float:
    """Return how far cubics may be from curves that stay within half as far again as ``reach`` of the origin [m]."""
    scale = _scale(np.array([1.5 * reach]))
    return float(tolerance + np.sqrt(3.0) * 0.5e-3 * scale)


def _whole(breaks: FloatArray) -> _Integers:
    """Return knots at whole milliseconds, none farther apart than ``LONGEST``; the last is not before the end."""
    whole = np.unique(np.round(breaks * 1e3).astype(np.int64))
    end = max(int(np.ceil(breaks[-1] * 1e3 - 1e-6)), 1)
    whole = np.append(whole[whole < end], end)
    return np.union1d(whole, np.concatenate([np.arange(a, b, LONGEST) for a, b in zip(whole, whole[1:], strict=False)]))


def _coarse(trajectory: Trajectory, breaks: _Integers, tolerance: float) -> _Integers:
    """Return the middles of segments whose cubics are farther from the curve than is allowed [ms]."""
    stored = Trajectory(_hermite(trajectory, breaks), np.diff(breaks) / 1e3)
    coarse = (distances_within(stored, trajectory) > tolerance) & (np.diff(breaks) > SHORTEST_SEGMENT)
    return (breaks[:-1] + breaks[1:])[coarse] // 2


def _hermite(trajectory: Trajectory, breaks: _Integers) -> FloatArray:
    """Return the control points of the cubics, shape (segments, 4, 3); after its end the curve stays there."""
    t = breaks / 1e3
    inside = np.minimum(t, trajectory.duration)
    place = trajectory(inside)
    third = (np.diff(t) / 3.0)[:, None]
    leaving, arriving = trajectory(inside[:-1], 1), _arriving(trajectory, inside[1:])
    return np.stack([place[:-1], place[:-1] + third * leaving, place[1:] - third * arriving, place[1:]], axis=1)


def _arriving(trajectory: Trajectory, t: FloatArray) -> FloatArray:
    """Velocities from the left, which differ from those from the right where a curve has corners."""
    piece = np.maximum(np.searchsorted(trajectory.breaks, t) - 1, 0)
    duration = trajectory.durations[piece]
    share = np.clip((t - trajectory.breaks[piece]) / duration, 0.0, 1.0)
    slopes = differentiate(trajectory.control_points[piece], 1) / duration[:, None, None]
    return np.asarray(np.einsum("mj,mjd->md", basis(trajectory.degree - 1, share), slopes))


def _scale(points: FloatArray) -> int:
    """Return the least unit in which int16 holds the coordinates [mm]."""
    farthest = np.abs(points).max() * 1e3
    scale = int(np.ceil((farthest + 1.0) / (LARGEST + 1)))
    if scale > LARGEST_SCALE:
        raise FileError(
            f"the trajectory leads {farthest / 1e3:.0f} m from the origin, and a show holds "
            f"{LARGEST * LARGEST_SCALE / 1e3:.0f} m: move the origin nearer"
        )
    return scale


def _straightened(points: _Integers) -> _Integers:
    """Put the control points of segments that are lines, but for rounding, where those of a line are."""
    ends = points[:, [0, -1]]
    thirds = np.stack([2 * ends[:, 0] + ends[:, 1], ends[:, 0] + 2 * ends[:, 1]], axis=1) / 3.0
    straight = np.asarray(np.abs(points[:, 1:3] - thirds).max(axis=(1, 2)) <= 0.75)
    return np.where(straight[:, None, None], np.round(_lines(ends)).astype(np.int64), points)


def _lines(ends: _Integers) -> FloatArray:
    """Return control points of lines, shape (segments, 4, 3), from their ends."""
    share = np.arange(4)[:, None] / 3.0
    return ends[:, :1] * (1.0 - share) + ends[:, 1:] * share


def is_line(points: _Integers) -> npt.NDArray[np.bool_]:
    """Whether segments are stored as lines: their control points are the roundings of those of one."""
    return np.asarray((points == np.round(_lines(points[:, [0, -1]]))).all(axis=(1, 2)))


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


def _write(content: Trajectory, path: str | os.PathLike[str], *, clobber: bool) -> str:
    segments = write_skybrush(content, path, clobber=clobber)
    count = len(segments.points)
    return f"written as {count} cubics, at most {1e3 * segments.distance:.2g} mm from the curve; headings are left out"


def _read(path: str | os.PathLike[str]) -> Trajectory:
    return read_skybrush(path).trajectory


FORMATS = (Format("skybrush", "polynomials", (".skyb",), _write, (".skyb",), _read),)

"""Skybrush's binary shows, ``.skyb``: a trajectory as cubics of whole millimetres, and lights, with a checksum.

How a curve becomes cubics is told in ``cubic_segments``.

After ``skyb``, the version (2), a byte of features (bit 0: a checksum) and the CRC-32 of the whole file with these
four bytes zero; then blocks of a type, a length as uint16 and a body. Block 1 is the trajectory: a unit in millimetres,
the start, and segments (``bezier_segments``); block 2 the lights, block 5 the heading (``yaw_setpoints``).
World axes: x along the show's orientation, y to its left, z up. Only lines and cubics are written: degree 7 is played,
but its take-off and landing are computed wrongly.

Of lights, a command is a byte and its arguments; a duration is a varint of 20 ms. Written are 0 end, 2 sleep d, 4 set
colour r g b d, 8 fade to colour r g b d. Read too are 1 nothing, 3 wait until d, 5 to 7 and 9 to 11 set and fade to a
gray (one byte), black and white, and loops (12 begin n, 13 end). No programme is one zero byte.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from minsnap.basics.arrays import ArrayLike, BoolArray, FloatArray, NDArray, ReadOnly, numbers, set_fields
from minsnap.basics.storage.atomic import write_file
from minsnap.basics.storage.text import FileName, read_bytes, reading
from minsnap.errors import FileError, InputError
from minsnap.files.convert import Format
from minsnap.files.formats.bezier_segments import packed, unpacked
from minsnap.files.formats.cubic_segments import CUBIC, CubicSegments, as_cubic_segments, scale_of
from minsnap.files.formats.pieces import polynomials_of
from minsnap.files.formats.yaw_setpoints import YawSetpoints
from minsnap.polynomials.bernstein import differentiate
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory

TICK = 0.02
"""Unit of time [s]."""


class LightCommand(IntEnum):
    """Of a programme of lights."""

    END, NOTHING, SLEEP, UNTIL, SET, FADE, LOOP, LOOP_END = 0, 1, 2, 3, 4, 8, 12, 13


MOST_COMMANDS = 100_000
"""Commands that a programme runs at most, loops included."""


@dataclass(frozen=True, eq=False)
class Lights(ReadOnly):
    """Colours of one lamp.

    Parameters
    ----------
    instants : array_like, shape (n,)
        When each colour is reached, not descending [s].
    colours : array_like, shape (n, 3)
        Red, green, blue, from 0 to 255.
    fades : array_like of bool, shape (n,)
        Whether the lamp changes to the colour from the instant before; else it does at its instant.

    Raises
    ------
    InputError
        If they do not fit together.
    """

    instants: FloatArray
    colours: FloatArray
    fades: BoolArray

    def __post_init__(self) -> None:
        instants, colours = numbers(self.instants), numbers(self.colours)
        fades = np.asarray(self.fades, dtype=bool)
        if instants is None or instants.ndim != 1 or not (np.diff(instants, prepend=0.0) >= 0.0).all():
            raise InputError("the instants of lights must be numbers from 0 on that do not descend [s]")
        if colours is None or colours.shape != (len(instants), 3) or not ((colours >= 0) & (colours <= 255)).all():
            raise InputError("the colours of lights must be three numbers from 0 to 255 for each instant")
        if fades.shape != instants.shape:
            raise InputError(f"there are {fades.size} fades for {len(instants)} colours: give one for each")
        set_fields(self, instants=instants, colours=colours, fades=fades.copy())

    def __call__(self, t: ArrayLike) -> FloatArray:
        """Return the colour at instants of any shape, black before the first: ``t.shape + (3,)``."""
        shown = np.vstack([np.zeros(3), self.colours])
        before = np.where(self.fades[:, None], self.colours, shown[:-1])  # just before each instant
        keys = np.vstack([shown[:1], np.stack([before, self.colours], axis=1).reshape(-1, 3)])
        times = np.concatenate([[0.0], np.repeat(self.instants, 2)])
        return np.stack([np.interp(np.asarray(t), times, column) for column in keys.T], axis=-1)


def light_bytes(lights: Lights | None) -> bytes:
    """Return the programme of lights; instants are rounded to 20 ms, and the roundings do not add up."""
    if lights is None or not len(lights.instants):
        return bytes([LightCommand.END])
    ticks = np.diff(np.round(lights.instants / TICK).astype(int), prepend=0).tolist()
    colours = [bytes(row) for row in np.round(lights.colours).astype(np.uint8).tolist()]
    programme, now = b"", bytes(3)
    for wait, colour, fades in zip(ticks, colours, lights.fades.tolist(), strict=True):
        if wait and not fades:
            programme += bytes([LightCommand.SET]) + now + varint(wait)
            wait = 0
        programme += bytes([LightCommand.FADE if fades else LightCommand.SET]) + colour + varint(wait)
        now = colour
    return programme + bytes([LightCommand.END])


def lights_of(programme: bytes) -> Lights | None:
    """Return the lights of a programme; None if it sets no colour.

    Raises
    ------
    FileError
        If it is cut off, or has a command other than those of this module.
    """
    clock, keys = 0, []
    now: tuple[int, tuple[int, ...], bool] = (0, (0, 0, 0), False)
    for command, colour, ticks in _commands(programme):
        if command == LightCommand.FADE:  # it begins now, not at the colour before
            keys += [(clock, now[1], False)] * (now[0] < clock) + [(clock + ticks, colour, True)]
        elif command == LightCommand.SET:
            keys.append((clock, colour, False))
        now = keys[-1] if keys else now
        clock = max(clock, ticks) if command == LightCommand.UNTIL else clock + ticks
    if not keys:
        return None
    instants, colours, fades = zip(*keys, strict=True)
    return Lights(np.array(instants) * TICK, np.array(colours, dtype=np.float64), np.array(fades))


def _commands(programme: bytes) -> list[tuple[int, tuple[int, ...], int]]:
    """Return commands with their colours and ticks, loops written out."""
    commands: list[tuple[int, tuple[int, ...], int]] = []
    offset, steps = 0, 0
    loops: list[list[int]] = []
    while offset < len(programme) and programme[offset] != LightCommand.END:
        command = programme[offset]
        offset, steps = offset + 1, steps + 1
        if command in (LightCommand.SLEEP, LightCommand.UNTIL):
            ticks, offset = read_varint(programme, offset)
            commands.append((command, (), ticks))
        elif LightCommand.SET <= command < LightCommand.LOOP:  # of each four: a colour, a gray, black, white
            count = (3, 1, 0, 0)[command % 4]
            colour = tuple(programme[offset : offset + count]) or (0 if command % 4 == 2 else 255,)
            ticks, offset = read_varint(programme, offset + count)
            kind = LightCommand.SET if command < LightCommand.FADE else LightCommand.FADE
            commands.append((kind, colour * (3 // len(colour)), ticks))
        elif command == LightCommand.LOOP and offset < len(programme):
            loops.append([offset + 1, programme[offset] - 1])
            offset += 1
        elif command == LightCommand.LOOP_END and loops:
            if loops[-1][1] > 0:
                loops[-1][1] -= 1
                offset = loops[-1][0]
            else:
                loops.pop()
        elif command != LightCommand.NOTHING:
            raise FileError(f"a programme of lights has command {command}, which is not read: 0 to 13 are")
        if steps > MOST_COMMANDS:  # loops in loops that do nothing count too
            raise FileError(f"a programme of lights runs more than {MOST_COMMANDS} commands")
    return commands


def varint(value: int) -> bytes:
    """Return seven bits a byte, lowest first, the highest bit set on all but the last."""
    encoded = b""
    while value > 127:
        encoded += bytes([value & 127 | 128])
        value >>= 7
    return encoded + bytes([value])


def read_varint(content: bytes, offset: int) -> tuple[int, int]:
    """Return a number that begins at an offset, and where it ends."""
    value, shift = 0, 0
    while True:
        if offset >= len(content) or shift > 28:
            raise FileError("a programme of lights is cut off")
        value |= (content[offset] & 127) << shift
        offset, shift = offset + 1, shift + 7
        if content[offset - 1] < 128:
            return value, offset


MARK, VERSION, CHECKSUM = b"skyb", 2, 1
TRAJECTORY, LIGHTS, RETURN, YAW = 1, 2, 4, 5
"""Types of blocks."""

LARGEST_BLOCK = 65535
"""Bytes of the largest block."""

LARGEST_FILE = 1 << 24
"""Bytes of the largest file that is read."""

BEFORE_SEGMENTS = 9
"""Bytes of unit and start."""

UNIT_BITS = 127
"""Bits of the unit; the highest one is retired."""


@dataclass(frozen=True)
class SkybrushFile:
    """What a binary show holds of one vehicle.

    Parameters
    ----------
    trajectory : Trajectory
    programme : bytes
        Of its lights.
    returns : bytes
        How it returns when all are called, see ``return_entries``; empty where it does not say.
    """

    trajectory: Trajectory
    programme: bytes = b""
    returns: bytes = b""

    @property
    def lights(self) -> Lights | None:
        """Its lights; raises as :func:`lights_of`. The trajectory is read whatever they are."""
        return lights_of(self.programme)


def check_size(segments: CubicSegments) -> None:
    """Raise FileError where a trajectory is longer than a block, which says how much of it fits."""
    moves = (segments.points != segments.points[:, :1]).any(axis=1).sum(axis=1)
    sizes = BEFORE_SEGMENTS + np.cumsum(3 + 2 * np.where(segments.lines, 1, 3) * moves)
    if sizes[-1] > LARGEST_BLOCK:
        fits = int(np.searchsorted(sizes, LARGEST_BLOCK, side="right"))
        raise FileError(
            f"{len(sizes)} segments take {sizes[-1]} bytes, {sizes[-1] - LARGEST_BLOCK} more than a block holds: "
            f"the first {segments.breaks[fits] / 1e3:.1f} s of {segments.breaks[-1] / 1e3:.1f} s fit; shorten the show "
            "or allow cubics farther from the curve"
        )


def skybrush_bytes(
    segments: CubicSegments, lights: Lights | None = None, yaw: YawSetpoints | None = None, returns: bytes = b""
) -> bytes:
    """Return the content of a file; ``returns`` is that of its block of returns.

    Raises
    ------
    FileError
        If a block is too long; says by how much, and how much of the trajectory fits.
    """
    check_size(segments)
    rows = zip(np.diff(segments.breaks).tolist(), segments.points, segments.lines.tolist(), strict=True)
    start = struct.pack("<B4h", segments.scale, *segments.points[0, 0].tolist(), 0)
    blocks = _block(TRAJECTORY, start + b"".join(_segment(*row) for row in rows))
    blocks += _block(LIGHTS, light_bytes(lights))
    blocks += _block(RETURN, returns) if returns else b""
    blocks += b"" if yaw is None else _block(YAW, yaw.content)
    head = MARK + bytes([VERSION, CHECKSUM])
    return head + struct.pack("<I", checksum(head + bytes(4) + blocks)) + blocks


def checksum(content: bytes) -> int:
    """Return the CRC-32 of a file whose checksum is zero: it begins at 0 and is not inverted at the end."""
    return zlib.crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF


def write_skybrush(
    trajectory: Path, path: FileName, lights: Lights | None = None, *, clobber: bool = True
) -> CubicSegments:
    """Write a trajectory or a shape in one atomic step, and return what was written; raises as ``cubic_segments``."""
    curve = polynomials_of(trajectory)[0]
    segments = as_cubic_segments(curve)
    write_file(path, skybrush_bytes(segments, lights, YawSetpoints.of(curve)), clobber=clobber)
    return segments


def read_skybrush(path: FileName) -> SkybrushFile:
    """Read a binary show of version 1 or 2.

    Raises
    ------
    FileError
        If it is none, its checksum is wrong, or it has no trajectory.
    """
    content = read_bytes(path, LARGEST_FILE)
    with reading(path, "a binary Skybrush show"):
        return parsed(content, str(path))


def parsed(content: bytes, where: str = "the show") -> SkybrushFile:
    """Return what is in the bytes of a file; ``where`` names it in messages."""
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
    milliseconds, points, length = unpacked(body[BEFORE_SEGMENTS:], start)
    if not len(milliseconds):
        raise FileError(f"the trajectory of {where} has no segments")
    if length < len(body) - BEFORE_SEGMENTS:
        raise FileError(f"the trajectory of {where} has a segment of 0 ms before its end")
    values = points[:, :3].transpose(0, 2, 1) * ((body[0] & UNIT_BITS) / 1e3)
    curve = Trajectory(values, milliseconds / 1e3)
    yaw = YawSetpoints.parsed(blocks[YAW]) if YAW in blocks else None
    headed = curve if yaw is None else curve.with_yaw(yaw.heading(curve.duration))
    return SkybrushFile(headed, blocks.get(LIGHTS, b""), blocks.get(RETURN, b""))


def _segment(milliseconds: int, points: NDArray[np.int64], line: bool) -> bytes:
    """Pack a segment: a line, or a cubic, and nothing of an axis that stands still."""
    degree = 1 if line else 3
    still = (points == points[0]).all(axis=0)
    degrees = np.append(np.where(still, 0, degree), 0)
    rows = np.zeros((4, 4), dtype=np.int64)
    rows[:3, : degree + 1] = points[:: 3 // degree].T
    return packed(milliseconds, rows, degrees)


def _block(kind: int, body: bytes) -> bytes:
    if len(body) > LARGEST_BLOCK:
        what = {LIGHTS: "a programme of lights", RETURN: "a plan of returns", YAW: "a heading"}[kind]
        raise FileError(f"{what} takes {len(body)} bytes, and a block holds {LARGEST_BLOCK}: shorten the show")
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


def _write(content: Trajectory, path: FileName, *, clobber: bool) -> str:
    segments = write_skybrush(content, path, clobber=clobber)
    return f"written as {len(segments.points)} cubics, at most {1e3 * segments.distance:.2g} mm from the curve"


def _resolution(content: Trajectory, step: float) -> float:
    """Return what storing a smooth curve as cubics does to a difference of two values a step apart [m], [m/s].

    At a knot the velocity steps by what moved control points explain and no more, a corner between lines is no such
    step; the acceleration steps for as long as the shorter segment lasts. A step may have a knot at either end.
    """
    moved = CUBIC.moved * 1e-3 * scale_of(content.control_points)
    shorter = np.minimum(content.durations[:-1], content.durations[1:])
    faster, harder = (_steps(content, order) for order in (1, 2))
    at_knots = np.minimum(faster, 2.0 * content.degree * moved / shorter) + harder * np.minimum(shorter, step)
    return 2.0 * (moved + float(at_knots.max(initial=0.0)))


def _steps(content: Trajectory, order: int) -> FloatArray:
    """Return by how much a derivative steps at each inner knot, shape (pieces - 1,), on the axis with the most."""
    values = differentiate(content.control_points, order) / content.durations[:, None, None] ** order
    return np.asarray(np.abs(values[1:, 0] - values[:-1, -1]).max(axis=1, initial=0.0))


_READ_WRITE = ((".skyb",), _write, (".skyb",), lambda path: read_skybrush(path).trajectory)
FORMATS = (Format("skybrush", "polynomials", *_READ_WRITE, rounding=_resolution),)

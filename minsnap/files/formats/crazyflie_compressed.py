"""The Crazyflie's compressed trajectories: Bézier control points in millimetres, 45 bytes per piece at constant yaw.

A start of 4 int16 (x, y, z in millimetres, yaw in tenths of a degree); then per piece a byte of types (two bits per
axis: 0 constant, 1 linear, 2 cubic, 3 degree 7), its duration as uint16 in milliseconds, and for each axis the control
points except the first, which is the last one of the previous piece (Bitcraze's firmware, pptraj_compressed; the
segments of a Skybrush show are the same). World axes, z up.
"""

from __future__ import annotations

import os
import struct

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.atomic import atomic_write
from minsnap.basics.storage.reading import check_size, reading
from minsnap.errors import FileError
from minsnap.files.format import Format, Writing
from minsnap.files.formats.pieces import polynomials_of, position_powers, yaw_powers
from minsnap.polynomials.bernstein import elevate, powers_to_points
from minsnap.trajectory.path import Path
from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.trajectory import Trajectory

MEMORY = 4096
"""Bytes of the firmware's memory of trajectories."""

DEGREE = 7
UNITS = np.array([1e-3, 1e-3, 1e-3, np.pi / 1800.0])
"""What one unit of x, y, z and yaw is worth [m], [rad]."""

POINTS = (0, 1, 3, 7)
"""Control points that each type adds."""

LARGEST = 32767

MOST_PIECES = (MEMORY - 8) // 31
"""Pieces that fit at constant height and yaw."""


def compressed(trajectory: Trajectory) -> bytes:
    """Return a trajectory as the firmware's bytes.

    Every control point is rounded by half a unit at most, and shared knots stay shared; instants of knots are rounded
    by half a millisecond at most.

    Raises
    ------
    FileError
        If it has other than 3 coordinates or too high a degree, leaves the range of int16, has a piece of under a
        millisecond or over 65.5 s, or does not fit the memory; says by how much.
    YawError
        If its heading is no polynomial.
    """
    points = np.round(_control_points(trajectory) / UNITS[:, None]).astype(np.int64)
    farthest = np.abs(points).max(axis=(0, 2))
    if (farthest > LARGEST).any():
        axis = int(np.argmax(farthest > LARGEST))
        raise FileError(
            f"{('x', 'y', 'z', 'yaw')[axis]} reaches {farthest[axis]} units, and this format holds {LARGEST}: "
            f"that is 32.767 m or 3276.7 degrees from the origin"
        )
    points[1:, :, 0] = points[:-1, :, -1]
    milliseconds = np.diff(np.round(trajectory.breaks * 1e3)).astype(np.int64)
    if milliseconds.min() < 1 or milliseconds.max() > 65535:
        raise FileError(f"a piece of {milliseconds.min()} to {milliseconds.max()} ms: this format holds 1 to 65535 ms")
    pieces = [_piece(int(time), piece) for time, piece in zip(milliseconds, points, strict=True)]
    content = struct.pack("<4h", *points[0, :, 0].tolist()) + b"".join(pieces)
    if len(content) > MEMORY:
        sizes = 8 + np.cumsum([len(piece) for piece in pieces])
        fits = int(np.searchsorted(sizes, MEMORY, side="right"))
        raise FileError(
            f"{len(pieces)} pieces take {len(content)} bytes, {len(content) - MEMORY} above the memory's {MEMORY}: "
            f"the first {fits} would fit; fly it in parts"
        )
    return content


def rounding_bound(trajectory: Trajectory) -> float:
    """Return an upper bound of the distance between the flown curve and the trajectory at any instant [m].

    The curve is a convex combination of control points, each moved by at most half a millimetre per axis; instants are
    moved by at most half a millisecond.
    """
    return float(np.sqrt(3.0) * 0.5e-3 + 0.5e-3 * trajectory.max_norm(1)[0])


def write_compressed(trajectory: Path, path: str | os.PathLike[str], *, clobber: bool = True) -> None:
    """Write a trajectory or a shape as the firmware's bytes in one atomic step; errors as of :func:`compressed`."""
    content = compressed(polynomials_of(trajectory, MOST_PIECES)[0])
    with atomic_write(path, "wb", clobber=clobber) as file:
        file.write(content)


def read_compressed(path: str | os.PathLike[str]) -> Trajectory:
    """Read a compressed trajectory.

    Raises
    ------
    FileError
        If it is none: too short, longer than the memory, or with a piece that is cut off.
    """
    check_size(path)
    with reading(path, "a compressed trajectory"):
        with open(path, "rb") as file:
            content = file.read(16 * MEMORY + 1)
        durations, points = _unpacked(content)
        values = (points * UNITS[:, None]).transpose(0, 2, 1)
        return Trajectory(values[:, :, :3], durations, PlannedHeading(Trajectory(values[:, :, 3:], durations)))


def _unpacked(content: bytes) -> tuple[FloatArray, FloatArray]:
    """Return durations (pieces,) [s] and control points in units, shape (pieces, 4, 8)."""
    last: tuple[int, ...] = struct.unpack_from("<4h", content)
    offset, durations, pieces = 8, [], []
    while offset < len(content):
        types, milliseconds = struct.unpack_from("<BH", content, offset)
        offset += 3
        rows = []
        for axis in range(4):
            count = POINTS[types >> 2 * axis & 3]
            rows.append((last[axis], *struct.unpack_from(f"<{count}h", content, offset)))
            offset += 2 * count
        last = tuple(row[-1] for row in rows)
        durations.append(milliseconds / 1e3)
        pieces.append([elevate(np.array(row, dtype=np.float64), DEGREE + 1) for row in rows])
    return np.array(durations), np.array(pieces)


def _control_points(trajectory: Trajectory) -> FloatArray:
    """Return control points of degree 7 of x, y, z and yaw, shape (pieces, 4, 8)."""
    if trajectory.dim != 3:
        raise FileError(f"a Crazyflie file holds 3 coordinates, and the trajectory has {trajectory.dim}")
    position_powers(trajectory, DEGREE)
    place = elevate(trajectory.control_points.transpose(0, 2, 1), DEGREE + 1)
    powers = yaw_powers(trajectory, DEGREE) * trajectory.durations[:, None] ** np.arange(DEGREE + 1)
    return np.concatenate([place, (powers @ powers_to_points(DEGREE).T)[:, None]], axis=1)


def _piece(milliseconds: int, points: npt.NDArray[np.int64]) -> bytes:
    """Pack a piece: constant axes take no bytes, all others take seven control points."""
    kinds = [3 if (axis != axis[0]).any() else 0 for axis in points]
    head = struct.pack("<BH", sum(kind << 2 * i for i, kind in enumerate(kinds)), milliseconds)
    moving = [axis[1:].tolist() for axis, kind in zip(points, kinds, strict=True) if kind]
    return head + b"".join(struct.pack("<7h", *axis) for axis in moving)


def _write(content: Trajectory, path: str | os.PathLike[str], writing: Writing) -> str:
    write_compressed(content, path, clobber=writing.clobber)
    return f"rounding moves the curve by {1e3 * rounding_bound(content):.2g} mm at most"


def _read(path: str | os.PathLike[str], frame: str | None) -> Trajectory:
    return read_compressed(path)


FORMAT = Format("crazyflie-compressed", "polynomials", (".traj",), _write, (".traj",), _read, most_pieces=MOST_PIECES)

"""Bézier curves of int16 control points: the segments that compressed Crazyflie trajectories and Skybrush shows share.

A segment is a byte of types (two bits each for x, y, z and yaw: 0 constant, 1 linear, 2 cubic, 3 degree 7), its
duration as uint16 in milliseconds, and for each axis the control points except the first, which is the last one of the
segment before (Bitcraze's firmware, pptraj_compressed; Skybrush's binary shows). Little-endian.
"""

from __future__ import annotations

import struct

import numpy as np

from minsnap.basics.arrays import FloatArray, NDArray
from minsnap.errors import FileError
from minsnap.polynomials.bernstein import differentiate, elevate, split
from minsnap.polynomials.enclosures import UNIT
from minsnap.trajectory.trajectory import Trajectory

ADDED = (0, 1, 3, 7)
"""Control points that each type adds."""

DEGREE = 7
LARGEST = 32767
"""Largest coordinate, in units."""

LONGEST = 65535
"""Longest segment [ms]."""

STEP_TIME = 0.1
"""Time over which a step of the velocity at a knot counts as an acceleration [s]: no piece is shorter."""

_Integers = NDArray[np.int64]


def packed(milliseconds: int, points: _Integers, degrees: _Integers) -> bytes:
    """Return the bytes of one segment.

    Parameters
    ----------
    milliseconds : int
    points : ndarray, shape (4, 8)
        Control points in units; of an axis of degree n, the first n + 1 count.
    degrees : ndarray, shape (4,)
        0, 1, 3 or 7.
    """
    kinds = [ADDED.index(degree) for degree in degrees.tolist()]
    head = struct.pack("<BH", sum(kind << 2 * axis for axis, kind in enumerate(kinds)), milliseconds)
    rows = zip(points.tolist(), degrees.tolist(), strict=True)
    return head + b"".join(struct.pack(f"<{degree}h", *row[1 : degree + 1]) for row, degree in rows)


def unpacked(content: bytes, start: tuple[int, ...]) -> tuple[_Integers, FloatArray, int]:
    """Read segments until one whose duration is 0, or the end.

    Parameters
    ----------
    content : bytes
        What follows the start.
    start : tuple of 4 int
        The first control point of x, y, z and yaw, in units.

    Returns
    -------
    milliseconds : ndarray, shape (segments,)
    points : ndarray, shape (segments, 4, degree + 1)
        Control points in units, of the highest degree that occurs.
    length : int
        Bytes that were read; where a duration of 0 was met, its three bytes are not among them.
    """
    last, offset, milliseconds, segments = start, 0, [], []
    while offset < len(content):
        types, duration = struct.unpack_from("<BH", content, offset)
        if duration == 0:
            break
        offset += 3
        rows = []
        for axis in range(4):
            count = ADDED[types >> 2 * axis & 3]
            rows.append((last[axis], *struct.unpack_from(f"<{count}h", content, offset)))
            offset += 2 * count
        last = tuple(row[-1] for row in rows)
        milliseconds.append(duration)
        segments.append([np.array(row, dtype=np.float64) for row in rows])
    size = max([2, *(len(row) for rows in segments for row in rows)])
    points = np.array([[elevate(row, size) for row in rows] for rows in segments])
    return np.array(milliseconds, dtype=np.int64), points.reshape(len(milliseconds), 4, size), offset


def check_range(points: _Integers, units: str) -> None:
    """Refuse control points (..., 4, n) that int16 does not hold; ``units`` says how far that reaches."""
    farthest = np.abs(points).max(axis=(*range(points.ndim - 2), points.ndim - 1))
    if (farthest > LARGEST).any():
        axis = int(np.argmax(farthest > LARGEST))
        raise FileError(f"{('x', 'y', 'z', 'yaw')[axis]} reaches {farthest[axis]} units, and this format holds {units}")


def distance_bounds(first: Trajectory, second: Trajectory, orders: int = 1) -> FloatArray:
    """Upper bounds of the distances between two curves of one clock and between their derivatives, shape (orders,).

    Where one has ended it stays at its end; derivatives are compared while both last. On each interval between knots of
    either, the difference is a polynomial, whose control points bound it; both are restricted to it by de Casteljau's
    algorithm, each step of which is off by three roundings of the largest control point at most. Derivatives are taken
    before that: those of what is left on a short interval would be those of its rounding. Knots nearer than a
    nanosecond count as one.
    """
    bounds = []
    for order in range(orders):
        breaks, difference, rounding = _difference(first.derivative(order), second.derivative(order))
        norms = np.linalg.norm(difference, axis=2).max(axis=1)
        both = breaks[:-1] < min(first.duration, second.duration) if order else slice(None)
        bounds.append(float(norms[both].max() + rounding * np.sqrt(first.dim)))
    return np.array(bounds)


def velocity_steps(curve: Trajectory) -> FloatArray:
    """Return by how much the velocity steps at each inner knot, shape (pieces - 1,) [m/s]."""
    slopes = differentiate(curve.control_points, 1) / curve.durations[:, None, None]
    return np.asarray(np.linalg.norm(slopes[1:, 0] - slopes[:-1, -1], axis=1))


def distances_within(first: Trajectory, second: Trajectory) -> FloatArray:
    """Upper bounds of the distance between two curves of one clock during each piece of the first, shape (pieces,)."""
    breaks, difference, rounding = _difference(first, second)
    norms = np.linalg.norm(difference, axis=2).max(axis=1) + rounding * np.sqrt(first.dim)
    middle = (breaks[:-1] + breaks[1:]) / 2.0
    piece = np.clip(np.searchsorted(first.breaks, middle) - 1, 0, len(first.durations) - 1)
    distances = np.zeros(len(first.durations))
    np.maximum.at(distances, piece, norms)
    return distances


def _difference(first: Trajectory, second: Trajectory) -> tuple[FloatArray, FloatArray, float]:
    """Return common breaks, control points of the difference between them, and how far each coordinate may be off."""
    breaks = np.union1d(first.breaks, second.breaks)
    breaks = breaks[np.concatenate(([True], np.diff(breaks) > 1e-9))]
    size = max(first.degree, second.degree) + 1
    parts = [_restricted(curve, breaks, size) for curve in (first, second)]
    return breaks, parts[0] - parts[1], float(64.0 * size * UNIT * max(np.abs(part).max() for part in parts))


def _restricted(curve: Trajectory, breaks: FloatArray, size: int) -> FloatArray:
    """Return control points on every interval of finer breaks, (intervals, size, dim): after its end those of it."""
    low, high = breaks[:-1], breaks[1:]
    middle = (low + high) / 2.0
    piece = np.clip(np.searchsorted(curve.breaks, middle) - 1, 0, len(curve.durations) - 1)
    start, duration = curve.breaks[piece], curve.durations[piece]
    a, b = (np.clip((t - start) / duration, 0.0, 1.0)[:, None, None] for t in (low, high))
    points = split(split(curve.control_points[piece], b)[0], np.divide(a, b, out=np.ones_like(a), where=b > 0.0))[1]
    points[middle >= curve.duration] = curve.control_points[-1, -1]
    return elevate(points.transpose(0, 2, 1), size).transpose(0, 2, 1)

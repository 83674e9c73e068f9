r"""How fast the horizontal velocity of a trajectory turns at most: exactly, up to where it rests.

:math:`\dot\psi = (v \times \dot v) / \|v\|^2` over x and y.  Where a piece begins or ends at rest, :math:`v = s^k w`
with a :math:`w` that does not vanish, and :math:`\dot\psi` is the same quotient of :math:`w`: the power of s drops out.
"""

from __future__ import annotations

from math import comb, inf

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.native.proved_extrema import maximum
from minsnap.polynomials.bernstein import differentiate, elevate, multiply, squared_norm
from minsnap.polynomials.extrema import largest_ratio
from minsnap.trajectory.heading import ZERO_YAW
from minsnap.trajectory.trajectory import Trajectory

RESTING = 1e-9
"""Share of a piece's largest velocity control point below which one counts as rest."""


def largest_turn_within(traj: Trajectory, intervals: FloatArray) -> tuple[float, float]:
    """Largest rate at which the horizontal velocity turns in some intervals.

    Parameters
    ----------
    traj : Trajectory
    intervals : ndarray, shape (m, 2)
        [s].

    Returns
    -------
    rate : float
        [rad/s]; zero without intervals.
    instant : float
        When [s].
    """
    best, velocity = (0.0, 0.0), traj.with_yaw(ZERO_YAW).derivative(1)
    for first, last in intervals[intervals[:, 0] < intervals[:, 1]].tolist():
        part = _cut(velocity, first, last)
        for pieces, points in _by_degree(part.control_points[..., :2]):
            value, row, s = _fastest_turn(points, part.durations[pieces])
            piece = pieces[row]
            best = max(best, (value, first + float(part.breaks[piece] + s * part.durations[piece])))
    return best


def largest_look_rate(traj: Trajectory, point: FloatArray, start: float = 0.0, end: float = inf) -> tuple[float, float]:
    """Largest rate at which the vector from a trajectory to a point turns, over all time or between two instants.

    Parameters
    ----------
    traj : Trajectory
    point : ndarray, shape (2,) or (3,)
        [m].
    start, end : float
        [s].

    Returns
    -------
    rate : float
        [rad/s].
    instant : float
        When [s].
    """
    start = max(start, 0.0)
    part = _cut(traj.with_yaw(ZERO_YAW), start, min(end, traj.duration))
    spokes = point[:2] - part.control_points[..., :2]
    value, piece, s = _fastest_turn(spokes, part.durations)
    return value, start + float(part.breaks[piece] + s * part.durations[piece])


def _cut(traj: Trajectory, start: float, end: float) -> Trajectory:
    """Return a curve between two instants: itself, if that is all of it."""
    return traj if start <= 0.0 and end >= traj.duration else traj.between(start, end)


def _fastest_turn(vectors: FloatArray, durations: FloatArray) -> tuple[float, int, float]:
    """Largest rate at which plane vectors (m, n + 1, 2) turn, either way [rad/s], its piece, and where on [0, 1]."""
    scaled = vectors / np.abs(vectors).max(axis=(1, 2), keepdims=True)
    change, bottom = differentiate(scaled, 1), squared_norm(scaled)
    top = np.zeros((len(scaled), 1))
    if scaled.shape[1] > 1:
        top = multiply(scaled[..., 0], change[..., 1]) - multiply(scaled[..., 1], change[..., 0])
    top = elevate(top, bottom.shape[1]) / durations[:, None]
    value, row, s = largest_ratio(np.concatenate((top, -top)), np.concatenate((bottom, bottom)), maximum)
    return value, row % len(vectors), s


def _by_degree(velocity: FloatArray) -> list[tuple[IntArray, FloatArray]]:
    """Pieces that move, grouped by how many powers of s and 1 - s were divided out of them."""
    size = np.abs(velocity).max(axis=2)
    moving = size > RESTING * size.max(axis=1, keepdims=True)
    first = moving.argmax(axis=1)
    last = moving[:, ::-1].argmax(axis=1)
    some = moving.any(axis=1)
    groups: list[tuple[IntArray, FloatArray]] = []
    for start, end in {(int(a), int(b)) for a, b in zip(first[some], last[some], strict=True)}:
        pieces = np.flatnonzero(some & (first == start) & (last == end))
        groups.append((pieces, _divided(velocity[pieces], start, end)))
    return groups


def _divided(points: FloatArray, start: int, end: int) -> FloatArray:
    """Control points after ``s^start (1 - s)^end`` is divided out."""
    degree = points.shape[1] - 1
    rest = degree - start - end
    weights = np.array([comb(degree, j + start) / comb(rest, j) for j in range(rest + 1)])
    return np.asarray(points[:, start : degree + 1 - end] * weights[:, None])

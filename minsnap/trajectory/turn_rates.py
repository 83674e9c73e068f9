r"""How fast the horizontal velocity of a trajectory turns at most: exactly, up to where it rests.

:math:`\dot\psi = (v \times \dot v) / \|v\|^2` over x and y.  Where a piece begins or ends at rest, :math:`v = s^k w`
with a :math:`w` that does not vanish, and :math:`\dot\psi` is the same quotient of :math:`w`: the power of s drops out.
"""

from __future__ import annotations

from math import comb

import numpy as np

from minsnap.arrays import FloatArray, IntArray
from minsnap.polynomials.bernstein import differentiate, multiply, squared_norm
from minsnap.polynomials.ratios import largest_ratio
from minsnap.trajectory.look_at import LookAtHeading
from minsnap.trajectory.path import ConstantHeading
from minsnap.trajectory.trajectory import Trajectory
from minsnap.trajectory.velocity_heading import VelocityHeading

RESTING = 1e-9
"""Share of a piece's largest velocity control point below which one counts as rest."""


def largest_turn_rate(traj: Trajectory) -> tuple[float, float]:
    """Largest rate at which the horizontal velocity turns, either way.

    Parameters
    ----------
    traj : Trajectory
        Of two coordinates or more. Pieces that do not move horizontally are left out.

    Returns
    -------
    rate : float
        [rad/s]; infinite at a cusp.
    instant : float
        When [s].
    """
    velocity = differentiate(traj.control_points[..., :2], 1)
    best = (0.0, 0.0)
    for pieces, points in _by_degree(velocity):
        scaled = points / np.abs(points).max(axis=(1, 2), keepdims=True)
        top, bottom = _turning(scaled), squared_norm(scaled)
        span = traj.durations[pieces, None]
        value, row, s = largest_ratio(np.concatenate((top, -top)) / np.concatenate((span, span)), _twice(bottom))
        piece = pieces[row % len(pieces)]
        best = max(best, (value, float(traj.breaks[piece] + s * traj.durations[piece])))
    return best


def largest_heading_rate(heading: VelocityHeading, traj: Trajectory) -> tuple[float, float]:
    """Largest rate of a heading along the velocity of a trajectory, over all time.

    Parameters
    ----------
    heading : VelocityHeading
    traj : Trajectory
        That it follows.

    Returns
    -------
    rate : float
        [rad/s].
    instant : float
        When [s].
    """
    best = heading.held_rate
    for start, end in heading.followed:
        if end <= start:
            continue
        value, instant = largest_turn_rate(_cut(traj, float(start), float(end)))
        best = max(best, (value, float(start) + instant))
    return best


def largest_look_rate(heading: LookAtHeading, traj: Trajectory) -> tuple[float, float]:
    """Largest rate of a heading towards a point along a trajectory, over all time.

    The rate is that at which the vector to the point turns: the same quotient as for the velocity.

    Parameters
    ----------
    heading : LookAtHeading
    traj : Trajectory
        Along which it looks.

    Returns
    -------
    rate : float
        [rad/s].
    instant : float
        When [s].
    """
    spokes = heading.target.point[:2] - traj.control_points[..., :2]
    scaled = spokes / np.abs(spokes).max(axis=(1, 2), keepdims=True)
    top, bottom = _turning(scaled), squared_norm(scaled)
    span = traj.durations[:, None]
    value, row, s = largest_ratio(np.concatenate((top, -top)) / np.concatenate((span, span)), _twice(bottom))
    piece = row % len(traj.durations)
    return value, float(traj.breaks[piece] + s * traj.durations[piece])


def _cut(traj: Trajectory, start: float, end: float) -> Trajectory:
    """Return the bare curve between two instants, without its heading."""
    bare = traj.with_yaw(ConstantHeading())
    return bare if start <= 0.0 and end >= traj.duration else bare.between(start, end)


def _turning(points: FloatArray) -> FloatArray:
    """Control points of ``w x dw/ds``, of the degree of the squared norm."""
    if points.shape[1] == 1:
        return np.zeros((len(points), 1))
    change = differentiate(points, 1)
    cross = multiply(points[..., 0], change[..., 1]) - multiply(points[..., 1], change[..., 0])
    return multiply(cross, np.ones((len(points), 2)))


def _twice(values: FloatArray) -> FloatArray:
    return np.concatenate((values, values))


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

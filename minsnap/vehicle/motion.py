"""Vectors, derived from a motion, to which the body axes are perpendicular, with and without drag."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import GRAVITY, FloatArray
from minsnap.trajectory.medium import Medium

Triple = tuple[FloatArray, FloatArray, FloatArray]
Quadruple = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class FlatMotion:
    """Vectors to which the body axes are perpendicular, each with two derivatives, shape (3, m).

    Parameters
    ----------
    alpha, beta : tuple of 3 ndarrays
        What ``x_B`` and ``y_B`` are perpendicular to [m/s^2], [m/s^3], [m/s^4].
    gamma : ndarray, shape (3, m)
        Its component along ``z_B`` is the thrust per mass [m/s^2].
    heading : tuple of 3 ndarrays
        A direction that ``y_B`` is perpendicular to, and its derivatives: ``x_C`` of the yaw, or a forward axis.
    spinless : bool
        Whether it is a forward axis, which turns with the thrust axis and so leaves the sign of ``y_B`` no choice.
    """

    alpha: Triple
    beta: Triple
    gamma: FloatArray
    heading: Triple
    spinless: bool = False


def flat_motion(
    motion: Quadruple,
    heading: Triple,
    gravity: float = GRAVITY,
    linear: FloatArray | None = None,
    quadratic: FloatArray | None = None,
    spinless: bool = False,
) -> FlatMotion:
    """Compute the vectors that determine the attitude.

    Parameters
    ----------
    motion : tuple of 4 ndarrays, shape (3, m)
        Velocity through the air, acceleration, jerk, snap, in the world frame.
    heading : tuple of 3 ndarrays, shape (3, m)
        Direction that ``y_B`` is perpendicular to and its two derivatives; of a yaw, see ``heading_of``.
    gravity : float
        [m/s^2].
    linear, quadratic : ndarray, shape (3,), or None
        Drag per mass along the body's axes, ``-(linear + |u| quadratic) u`` [1/s], [1/m]; None is no drag.
    spinless : bool
        Whether the heading is a forward axis.

    Returns
    -------
    FlatMotion
    """
    if linear is None or quadratic is None:
        plain = _lifted(Medium(gravity), motion)
        return FlatMotion(plain, plain, plain[0], heading, spinless)
    sides = [_lifted(Medium(gravity, linear[axis], quadratic[axis]), motion) for axis in range(3)]
    return FlatMotion(sides[0], sides[1], sides[2][0], heading, spinless)


def _lifted(medium: Medium, motion: Quadruple) -> Triple:
    """Vector that a body axis is perpendicular to, with two derivatives."""
    force, change, bend = (np.ascontiguousarray(part.T) for part in medium.lift(*(part.T for part in motion)))
    return force, change, bend


def heading_of(yaw: Triple) -> Triple:
    """Return the yaw direction ``(cos, sin, 0)`` and its two derivatives, each of shape (3, m)."""
    angle, rate, acceleration = yaw
    zero = np.zeros_like(angle)
    along = np.stack([np.cos(angle), np.sin(angle), zero])
    across = np.stack([-along[1], along[0], zero])
    return along, rate * across, acceleration * across - rate**2 * along


def dot(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return the scalar product of each column, shape (m,)."""
    return np.asarray(left[0] * right[0] + left[1] * right[1] + left[2] * right[2])


def norm(vectors: FloatArray) -> FloatArray:
    """Return the length of each column, shape (m,)."""
    return np.sqrt(dot(vectors, vectors))


def cross(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return the vector product of each column, shape (3, m)."""
    (x, y, z), (u, v, w) = left, right
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u])

r"""What a vehicle's thrust acts against: gravity, and drag that is the same along both lateral axes of the body.

With drag per mass :math:`-(d + q \|v\|)` times each component of the velocity, lateral coefficients d and q, the thrust
axis lies along

.. math:: f = a + g e_z + (d + q \|v\|)\, v,

whatever the yaw (M. Faessler, A. Franchi and D. Scaramuzza, RA-L 2018), and the thrust per mass is
:math:`\|f\| + (d' + q' \|v\|)\, f \cdot v / \|f\|`, where d' and q' say by how much the coefficients along the thrust
axis are greater.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import GRAVITY, FloatArray


@dataclass(frozen=True)
class Medium:
    """Gravity and drag per mass.

    Parameters
    ----------
    gravity : float
        [m/s^2].
    linear, quadratic : float
        Of the drag across the thrust axis [1/s], [1/m].
    more_linear, more_quadratic : float
        By how much these are greater along the thrust axis [1/s], [1/m].
    """

    gravity: float = GRAVITY
    linear: float = 0.0
    quadratic: float = 0.0
    more_linear: float = 0.0
    more_quadratic: float = 0.0

    @property
    def drags(self) -> bool:
        """Whether there is drag."""
        return any(self.values[1:])

    @property
    def values(self) -> tuple[float, ...]:
        """All numbers in their order."""
        return self.gravity, self.linear, self.quadratic, self.more_linear, self.more_quadratic

    def lift(self, *motion: FloatArray) -> tuple[FloatArray, ...]:
        """Return f and as many of its derivatives as the motion allows, each of shape (..., 3).

        Parameters
        ----------
        *motion : ndarray, shape (..., 3)
            Velocity, acceleration, and jerk and snap if wanted; complex steps pass through.
        """
        velocity, acceleration, *others = motion
        force = acceleration + np.array([0.0, 0.0, self.gravity])
        if not (self.linear or self.quadratic):
            return force, *others
        speed = norm(velocity)[..., None]
        share, divisor = self.linear + self.quadratic * speed, np.where(speed == 0.0, np.inf, speed)
        derivatives = [force + share * velocity]
        if others:
            first = inner(velocity, acceleration)[..., None] / divisor
            derivatives.append(others[0] + self.quadratic * first * velocity + share * acceleration)
        if len(others) > 1:
            bent = inner(acceleration, acceleration) + inner(velocity, others[0])
            second = (bent[..., None] - first * first) / divisor
            change = self.quadratic * (second * velocity + 2.0 * first * acceleration)
            derivatives.append(others[1] + change + share * others[0])
        return tuple(np.asarray(part) for part in derivatives)

    def thrust(self, force: FloatArray, velocity: FloatArray) -> FloatArray:
        """Return the thrust per mass (...) where f and the velocity are (..., 3)."""
        size = norm(force)
        if not (self.more_linear or self.more_quadratic):
            return size
        share = self.more_linear + self.more_quadratic * norm(velocity)
        return np.asarray(size + share * inner(force, velocity) / np.where(size == 0.0, np.inf, size))


AIRLESS = Medium()
"""Gravity without drag."""


def norm(vectors: FloatArray) -> FloatArray:
    """Euclidean norm over the last axis, analytic, so that complex steps pass through it."""
    return np.asarray(np.sqrt((vectors * vectors).sum(axis=-1)))


def inner(left: FloatArray, right: FloatArray) -> FloatArray:
    """Inner product over the last axis without conjugation."""
    return np.asarray((left * right).sum(axis=-1))

"""Inputs and outputs of a controller, rotor allocation, and vector arithmetic shared by all controllers.

A controller is an immutable value: gains and limits. Its ``pilot`` controls one vehicle and holds the state between
calls. Pilots use floats, which for single vectors are several times faster than arrays.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

from minsnap.vehicle.dynamics import body_axes
from minsnap.vehicle.quadrotor import Quadrotor

Vector = tuple[float, float, float]
Axes = tuple[Vector, Vector, Vector]
"""Three unit vectors of a body in the world frame: forward, left, up."""


class Reference(NamedTuple):
    """The setpoint at an instant in the world frame; rates and angular accelerations about the body axes."""

    position: Vector
    velocity: Vector
    acceleration: Vector
    feed_forward: Vector
    """Acceleration that offsets drag, added to the commanded acceleration [m/s^2]."""
    yaw: float
    yaw_rate: float
    body_rates: Vector
    angular_acceleration: Vector


class Estimate(NamedTuple):
    """The estimated state of the vehicle: world frame, quaternion w, x, y, z, rates about the body axes."""

    position: Vector
    velocity: Vector
    quaternion: tuple[float, float, float, float]
    body_rates: Vector


class Pilot(Protocol):
    """A running controller of one vehicle."""

    def command(self, estimate: Estimate, reference: Reference) -> Command:
        """Return the commanded rotor speeds, one step after the previous call."""
        ...


class Controller(Protocol):
    """Gains and limits of a controller, and the factory of its pilots."""

    def pilot(self, vehicle: Quadrotor, step: float) -> Pilot:
        """Return the running controller for a vehicle, to be called every ``step`` seconds."""
        ...


class Command(NamedTuple):
    """The commanded rotor speeds."""

    rotor_speed: list[float]
    """[rad/s], within the limits of the vehicle."""
    saturated: bool
    """Whether thrust or torques had to be cut to stay within them."""


def dot(a: Sequence[float], b: Sequence[float]) -> float:
    """Return the scalar product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    """Return the vector product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def unit(a: Sequence[float], otherwise: Vector) -> Vector:
    """Return the direction of a vector, or a fallback if the vector is zero."""
    length = math.sqrt(dot(a, a))
    return (a[0] / length, a[1] / length, a[2] / length) if length > 1e-9 else otherwise


def axes_of(quaternion: Sequence[float]) -> Axes:
    """Return the body's axes at an attitude."""
    forward, left, up = body_axes(*quaternion)
    return forward, left, up


def relative(body: Axes, desired: Axes) -> Axes:
    """Return the rows of ``R^T R_d``: scalar products of each body axis with each desired axis."""
    rows = [(dot(axis, desired[0]), dot(axis, desired[1]), dot(axis, desired[2])) for axis in body]
    return rows[0], rows[1], rows[2]


def times(matrix: Sequence[Sequence[float]], vector: Sequence[float]) -> Vector:
    """Return the product of a matrix, as its rows, and a vector."""
    return dot(matrix[0], vector), dot(matrix[1], vector), dot(matrix[2], vector)


def clip(value: float, low: float, high: float) -> float:
    """Return a number moved inside its bounds."""
    return low if value < low else high if value > high else value


class Allocator:
    """Rotor speeds from thrust and torques within a vehicle's limits; priority: roll and pitch, thrust, yaw.

    Parameters
    ----------
    vehicle : Quadrotor
    """

    def __init__(self, vehicle: Quadrotor) -> None:
        self._inverse = vehicle.inverse_mixer.tolist()
        self._low, self._high = vehicle.rotor_thrust_limits
        self._coefficient = vehicle.thrust_coefficient

    def command(self, thrust: float, torque: Sequence[float]) -> Command:
        """Return rotor speeds for a thrust [N] and torques [N m]."""
        base = [row[0] * thrust + row[1] * torque[0] + row[2] * torque[1] for row in self._inverse]
        shift = self._shift(base)
        base = [clip(value + shift, self._low, self._high) for value in base]
        turn = [row[3] * torque[2] for row in self._inverse]
        share = min(self._room(one, other) for one, other in zip(base, turn, strict=True))
        thrusts = [one + share * other for one, other in zip(base, turn, strict=True)]
        speeds = [math.sqrt(max(value, 0.0) / self._coefficient) for value in thrusts]
        return Command(speeds, shift != 0.0 or share < 1.0)

    def _shift(self, thrusts: list[float]) -> float:
        """Return the common shift that brings all four inside the limits; if impossible, the upper limit is kept."""
        lift = max(self._low - min(thrusts), 0.0)
        return lift + min(self._high - max(thrusts) - lift, 0.0)

    def _room(self, thrust: float, change: float) -> float:
        """Return the largest share of a change, 0 to 1, that keeps one rotor inside its limits."""
        if change > 0.0:
            return min(1.0, (self._high - thrust) / change)
        return min(1.0, (self._low - thrust) / change) if change < 0.0 else 1.0

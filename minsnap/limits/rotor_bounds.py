r"""Bounds of rotor thrusts over all time, by interval arithmetic on successively smaller parts of a path.

With f along the thrust axis (:mod:`minsnap.trajectory.medium`), :math:`c = \|f\|` and
:math:`h = (\cos\psi, \sin\psi, 0)` the body axes are :math:`z = f/c`, :math:`y = f \times h / \|f \times h\|`,
:math:`x = y \times z` (D. Mellinger and V. Kumar, ICRA 2011), and differentiating
:math:`x \cdot f = y \cdot f = y \cdot h = 0` once and twice gives body rates and accelerations:

.. math:: p = -y \cdot \dot f / c, \quad q = x \cdot \dot f / c, \quad
    r = (y \cdot \dot h + p\, z \cdot h) / (x \cdot h).

Ranges of control points bound the derivatives on each part (convex hull), interval arithmetic the quantities computed
from them. Without spin (a ``TiltHeading``) x and y are known in the middle of each part, turn no faster than the thrust
axis, and :math:`r = 0`: there is no singularity while the thrust is positive.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.polynomials.intervals import Interval, Vector, along, cross, dot, length, plus, times

if TYPE_CHECKING:
    from minsnap.vehicle import Quadrotor


@dataclass(frozen=True, eq=False)
class Part:
    """Ranges of a motion on parts of a path.

    Parameters
    ----------
    thrust : Interval
        Thrust per mass [m/s^2].
    force, jerk, snap : Vector
        f and its derivatives [m/s^2], [m/s^3], [m/s^4]; without drag those of the acceleration.
    heading : tuple of 3 Vectors
        Yaw direction and its derivatives; without spin the axes x and y, and the former again.
    spinless : bool
        Whether these are axes.
    """

    thrust: Interval
    force: Vector
    jerk: Vector
    snap: Vector
    heading: tuple[Vector, Vector, Vector]
    spinless: bool = False


def heading_ranges(yaw: Interval, rate: Interval, acceleration: Interval) -> tuple[Vector, Vector, Vector]:
    """Ranges of ``(cos, sin, 0)`` of the yaw and of its two derivatives."""
    middle, half = 0.5 * (yaw.low + yaw.high), 0.5 * (yaw.high - yaw.low)
    cosine = Interval(np.cos(middle) - half, np.cos(middle) + half).within(-1.0, 1.0)
    sine = Interval(np.sin(middle) - half, np.sin(middle) + half).within(-1.0, 1.0)
    zero = Interval(np.zeros_like(middle), np.zeros_like(middle))
    straight, across = (cosine, sine, zero), (-sine, cosine, zero)
    second = plus(times(across, acceleration), times(straight, -rate.squared()))
    return straight, times(across, rate), second


def axis_ranges(force: Vector, jerk: Vector, axes: tuple[FloatArray, FloatArray], half: FloatArray) -> list[Vector]:
    """Ranges of body axes that are known in the middle of each part, (3, m) each, and turn with the thrust axis.

    Parameters
    ----------
    force, jerk : Vector
        Ranges on the parts.
    axes : tuple of 2 ndarrays, shape (3, m)
        x and y in the middle.
    half : ndarray, shape (m,)
        Half the lengths of the parts [s].
    """
    rate = (length(cross(force, jerk)) / dot(force, force)).high
    angle = np.minimum(half * np.minimum(rate, (length(jerk) / length(force)).high), 2.0)
    return [_around(axis, angle) for axis in axes]


def _around(axis: FloatArray, reach: FloatArray) -> Vector:
    x, y, z = (Interval(part - reach, part + reach).within(-1.0, 1.0) for part in axis)
    return x, y, z


def rotor_ranges(vehicle: Quadrotor, part: Part) -> list[Interval]:
    """Ranges of the four rotors' thrusts [N]."""
    rates, accelerations = _tilting(part) if part.spinless else _turning(part)
    wrench = [part.thrust.scaled(vehicle.mass), *_torques(vehicle.inertia, rates, accelerations)]
    return [_combined(row, wrench) for row in vehicle.inverse_mixer]


def _turning(part: Part) -> tuple[Vector, Vector]:
    """Ranges of body rates and angular accelerations."""
    heading, heading_rate, heading_turn = part.heading
    lift, lateral = length(part.force), cross(part.force, heading)
    y, z = along(lateral), along(part.force)
    x = tuple(component.within(-1.0, 1.0) for component in cross(y, z))
    x_heading, z_heading = (length(lateral) / lift).within(0.0, 1.0), dot(z, heading)
    pull = dot(z, part.jerk) / lift
    p, q = -dot(y, part.jerk) / lift, dot(x, part.jerk) / lift  # type: ignore[arg-type]
    r = (dot(y, heading_rate) + p * z_heading) / x_heading
    p_rate = r * q - (p * pull).scaled(2.0) - dot(y, part.snap) / lift
    q_rate = dot(x, part.snap) / lift - r * p - (q * pull).scaled(2.0)  # type: ignore[arg-type]
    known = p * q * x_heading + r * q * z_heading + dot(y, heading_turn)
    known = known + (p * dot(z, heading_rate) - r * dot(x, heading_rate)).scaled(2.0)  # type: ignore[arg-type]
    return (p, q, r), (p_rate, q_rate, (known + p_rate * z_heading) / x_heading)


def _tilting(part: Part) -> tuple[Vector, Vector]:
    """Ranges of body rates and angular accelerations without spin."""
    x, y, _ = part.heading
    lift, none = length(part.force), Interval(np.zeros_like(x[0].low), np.zeros_like(x[0].low))
    pull = dot(along(part.force), part.jerk) / lift
    p, q = -(dot(y, part.jerk) / lift), dot(x, part.jerk) / lift
    p_rate = -(dot(y, part.snap) / lift) - (p * pull).scaled(2.0)
    q_rate = dot(x, part.snap) / lift - (q * pull).scaled(2.0)
    return (p, q, none), (p_rate, q_rate, none)


def _torques(inertia: FloatArray, rates: Vector, accelerations: Vector) -> Vector:
    """Ranges of the torques, Euler's equations."""
    momentum = tuple(_combined(row, rates) for row in inertia)
    push = tuple(_combined(row, accelerations) for row in inertia)
    return plus(push, cross(rates, momentum))  # type: ignore[arg-type]


def _combined(weights: FloatArray, ranges: list[Interval] | Vector) -> Interval:
    """Range of a weighted sum."""
    total = ranges[0].scaled(float(weights[0]))
    for weight, other in zip(weights[1:], ranges[1:], strict=True):
        total = total + other.scaled(float(weight))
    return total

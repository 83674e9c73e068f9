r"""Newton-Euler equations of a quadrotor: the rate of change of its state from rotor speeds and wind.

.. math:: m \dot v = R\,(T e_z + F_{drag}) - m g e_z, \qquad I \dot\omega = \tau - \omega \times I\omega,
          \qquad \dot q = \tfrac12\, q \otimes (0, \omega)

The attitude is a quaternion. Drag acts at the center of mass unless its model gives a torque.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.vehicle.drag import BodyDrag, HubDrag
from minsnap.vehicle.quadrotor import Quadrotor

State = Sequence[Any]
"""Position (3) [m], velocity (3) [m/s], quaternion w, x, y, z (4), body rates (3) [rad/s]: 13 numbers, or arrays."""


class RigidBody:
    """The equations of motion of one vehicle, with its parameters unpacked for speed.

    They use plain arithmetic only. Floats are fastest for the simulation of one vehicle; arrays of shape (m,) in place
    of each float evaluate many instants at once.

    Parameters
    ----------
    vehicle : Quadrotor
    """

    def __init__(self, vehicle: Quadrotor) -> None:
        self.vehicle = vehicle
        self._mass, self._gravity = vehicle.mass, vehicle.gravity
        self._mixer = (vehicle.thrust_coefficient * vehicle.mixer).tolist()
        self._inertia = vehicle.inertia.tolist()
        self._inverse = np.linalg.inv(vehicle.inertia).tolist()
        self._plain = isinstance(vehicle.drag, BodyDrag)
        drag = vehicle.drag if isinstance(vehicle.drag, BodyDrag) else BodyDrag()
        self._drag = (drag.linear.tolist(), drag.quadratic.tolist())

    def derivative(self, state: State, rotor_speed: Sequence[Any], wind: Sequence[Any] = (0.0, 0.0, 0.0)) -> list[Any]:
        """Return the rate of change of the 13 numbers of the state.

        Parameters
        ----------
        state : sequence of 13
            See :data:`State`.
        rotor_speed : sequence of 4
            [rad/s].
        wind : sequence of 3
            In the world frame [m/s].

        Returns
        -------
        list of 13
        """
        _, _, _, vx, vy, vz, w, x, y, z, p, q, r = state
        axes = body_axes(w, x, y, z)
        thrust, *torque = (_weighted(row, rotor_speed) for row in self._mixer)
        air = (vx - wind[0], vy - wind[1], vz - wind[2])
        if self._plain:
            force = self._air_force(axes, air)
        else:
            force, turning = self._air_wrench(axes, air, (p, q, r), rotor_speed)
            torque = [one + other for one, other in zip(torque, turning, strict=True)]
        fx, fy, fz = force[0], force[1], force[2] + thrust
        (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = axes
        mass = self._mass
        return [
            vx,
            vy,
            vz,
            (xx * fx + yx * fy + zx * fz) / mass,
            (xy * fx + yy * fy + zy * fz) / mass,
            (xz * fx + yz * fy + zz * fz) / mass - self._gravity,
            0.5 * (-x * p - y * q - z * r),
            0.5 * (w * p + y * r - z * q),
            0.5 * (w * q + z * p - x * r),
            0.5 * (w * r + x * q - y * p),
            *self._turn((p, q, r), torque),
        ]

    def _air_force(self, axes: tuple[Any, Any, Any], air: tuple[Any, Any, Any]) -> Any:
        """Return the drag in the body frame from the velocity through the air in the world frame."""
        u, v, w = (axis[0] * air[0] + axis[1] * air[1] + axis[2] * air[2] for axis in axes)
        linear, quadratic = self._drag
        speed = (u * u + v * v + w * w) ** 0.5
        return (
            -(linear[0] + quadratic[0] * speed) * u,
            -(linear[1] + quadratic[1] * speed) * v,
            -(linear[2] + quadratic[2] * speed) * w,
        )

    def _air_wrench(
        self, axes: tuple[Any, Any, Any], air: tuple[Any, Any, Any], rates: Sequence[Any], rotor_speed: Sequence[Any]
    ) -> tuple[Any, Any]:
        """Return force and torque of a drag model that is not a BodyDrag, from the methods of the model."""
        drag, speeds = self.vehicle.drag, np.stack(list(rotor_speed), axis=-1)
        along = [axis[0] * air[0] + axis[1] * air[1] + axis[2] * air[2] for axis in axes]
        velocity = np.stack(along, axis=-1)
        known = {"pitch": -np.arcsin(np.clip(axes[0][2], -1.0, 1.0)), "rotor_speed": speeds}
        if isinstance(drag, HubDrag):
            turning = np.stack(list(rates), axis=-1)
            force, torque = drag.wrench(velocity, turning, self.vehicle.rotor_positions, **known)
            return _numbers(force), _numbers(torque)
        return _numbers(drag.force(velocity, **known)), (0.0, 0.0, 0.0)

    def _turn(self, rates: tuple[Any, Any, Any], torque: Sequence[Any]) -> list[Any]:
        """Return angular accelerations by Euler's equation."""
        p, q, r = rates
        h, k, m = (row[0] * p + row[1] * q + row[2] * r for row in self._inertia)
        net = (torque[0] - (q * m - r * k), torque[1] - (r * h - p * m), torque[2] - (p * k - q * h))
        return [row[0] * net[0] + row[1] * net[1] + row[2] * net[2] for row in self._inverse]

    def advance(
        self,
        state: list[float],
        speeds: tuple[Sequence[float], Sequence[float], Sequence[float]],
        wind: Sequence[float],
        step: float,
    ) -> list[float]:
        """Return the state one step later, by the classical Runge-Kutta method, its quaternion normalised.

        Parameters
        ----------
        state : list of 13 floats
        speeds : tuple of 3
            Rotor speeds at the start, the middle and the end of the step [rad/s].
        wind : sequence of 3
            Held over the step [m/s].
        step : float
            [s].

        Returns
        -------
        list of 13 floats
        """
        half = 0.5 * step
        first = self.derivative(state, speeds[0], wind)
        second = self.derivative([s + half * d for s, d in zip(state, first, strict=True)], speeds[1], wind)
        third = self.derivative([s + half * d for s, d in zip(state, second, strict=True)], speeds[1], wind)
        fourth = self.derivative([s + step * d for s, d in zip(state, third, strict=True)], speeds[2], wind)
        sixth = step / 6.0
        stages = zip(state, first, second, third, fourth, strict=True)
        moved = [s + sixth * (a + 2.0 * (b + c) + d) for s, a, b, c, d in stages]
        length = math.sqrt(moved[6] ** 2 + moved[7] ** 2 + moved[8] ** 2 + moved[9] ** 2)
        moved[6:10] = [part / length for part in moved[6:10]]
        return moved


def _numbers(vectors: FloatArray) -> Any:
    """Return the components of one vector as floats, or of many, shape (m, 3), as arrays."""
    return vectors.tolist() if vectors.ndim == 1 else vectors.T


def body_axes(w: Any, x: Any, y: Any, z: Any) -> tuple[Any, Any, Any]:
    """Return the body's axes in the world frame: the columns of the rotation matrix of a unit quaternion."""
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
        (2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
        (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)),
    )


def _weighted(row: Sequence[float], speed: Sequence[Any]) -> Any:
    """Return a row of the mixer times the signed squares of the rotor speeds."""
    a, b, c, d = speed
    return row[0] * a * abs(a) + row[1] * b * abs(b) + row[2] * c * abs(c) + row[3] * d * abs(d)

r"""Dynamics of a quadrotor, forward by Newton and Euler, and inverse: states and inputs of a motion, by flatness.

.. math:: m \dot v = R\,(T e_z + F_{drag}) - m g e_z, \qquad I \dot\omega = \tau - \omega \times I\omega,
          \qquad \dot q = \tfrac12\, q \otimes (0, \omega)

The attitude is a quaternion. Drag acts at the center of mass unless its model gives a torque.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, BoolArray, FloatArray, OwnsArrays, owned, read_only
from minsnap.basics.cached import cached_property
from minsnap.errors import ThrustError, VehicleError
from minsnap.trajectory.medium import Medium
from minsnap.trajectory.path import Path
from minsnap.vehicle import attitude
from minsnap.vehicle.attitude import spatial
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
        drag = vehicle.flat_drag
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


@dataclass(frozen=True, eq=False)
class FlatStates(OwnsArrays):
    """State and inputs at m instants; read-only arrays, SI units.

    Parameters
    ----------
    thrust : ndarray, shape (m,)
        Total thrust along the body's z axis [N].
    rotation : ndarray, shape (m, 3, 3)
        Attitude: its columns are the body's axes in the world frame.
    body_rates : ndarray, shape (m, 3)
        Angular velocity about the body's axes [rad/s].
    angular_acceleration : ndarray, shape (m, 3)
        Its derivative [rad/s^2].
    torque : ndarray, shape (m, 3)
        About the body's axes [N m].
    rotor_speed : ndarray, shape (m, 4)
        [rad/s]; negative where a rotor would have to pull downwards.
    singular : ndarray of bool, shape (m,)
        Instants of free fall, or of thrust parallel to the yaw direction: there the attitude is held from the instant
        before, and rates and accelerations are zero.
    """

    thrust: FloatArray
    rotation: FloatArray
    body_rates: FloatArray
    angular_acceleration: FloatArray
    torque: FloatArray
    rotor_speed: FloatArray
    singular: BoolArray

    def __len__(self) -> int:
        return len(self.thrust)

    @cached_property
    def quaternion(self) -> FloatArray:
        """The attitude as unit quaternions w, x, y, z, continuous in sign, shape (m, 4)."""
        return read_only(attitude.quaternions(self.rotation))


def flat_states(
    vehicle: Quadrotor,
    velocity: ArrayLike,
    acceleration: ArrayLike,
    jerk: ArrayLike,
    snap: ArrayLike,
    yaw: ArrayLike = 0.0,
    yaw_rate: ArrayLike = 0.0,
    yaw_acceleration: ArrayLike = 0.0,
    *,
    wind: ArrayLike = (0.0, 0.0, 0.0),
    drag: BodyDrag | None = None,
) -> FlatStates:
    """Return states and inputs of a quadrotor along a motion, in exact closed form.

    Parameters
    ----------
    vehicle : Quadrotor
        Its drag must be a :class:`~minsnap.vehicle.BodyDrag`, unless ``drag`` replaces it.
    velocity, acceleration, jerk, snap : array_like, shape (m, 3) or (m, 2)
        Derivatives of position at consecutive instants, in the world frame.
    yaw, yaw_rate, yaw_acceleration : array_like, shape (m,) or ()
        [rad], [rad/s], [rad/s^2].
    wind : array_like, shape (3,)
        Constant wind in the world frame [m/s].
    drag : BodyDrag or None
        Used in place of the vehicle's; ``BodyDrag()`` is none.

    Returns
    -------
    FlatStates

    Raises
    ------
    VehicleError
        If the drag is of a kind with which motion is not flat.
    """
    columns = [np.ascontiguousarray(np.atleast_2d(spatial(value)).T) for value in (acceleration, jerk, snap)]
    air = np.atleast_2d(spatial(velocity)).T - np.asarray(wind, dtype=np.float64)[:, None]
    zero = np.zeros(air.shape[1])
    turning = tuple(zero + np.asarray(value, dtype=np.float64) for value in (yaw, yaw_rate, yaw_acceleration))
    heading = attitude.heading_of(turning)  # type: ignore[arg-type]
    return _states(vehicle, attitude.flat_motion((air, *columns), heading, _media(vehicle, drag)))  # type: ignore[arg-type]


def _media(vehicle: Quadrotor, drag: BodyDrag | None) -> list[Medium]:
    """Return gravity and the drag to invert, or raise VehicleError if motion is not flat with it."""
    chosen = vehicle.drag if drag is None else drag
    if not isinstance(chosen, BodyDrag):
        kind = type(chosen).__name__
        raise VehicleError(f"motion is not flat with drag of kind {kind}: give drag=BodyDrag(...) in its place")
    if chosen.absent:
        return [Medium(vehicle.gravity)]
    sides = zip(chosen.linear / vehicle.mass, chosen.quadratic / vehicle.mass, strict=True)
    return [Medium(vehicle.gravity, linear, quadratic) for linear, quadratic in sides]


def _states(vehicle: Quadrotor, motion: attitude.FlatMotion) -> FlatStates:
    """Compute attitude, rates, accelerations, torques and rotor speeds, in this order."""
    frame, singular = attitude.body_frame(motion)
    rates = attitude.rates_of(motion, frame, singular)
    accelerations = attitude.angular_accelerations_of(motion, frame, rates, singular).T
    rotation = np.ascontiguousarray(np.stack(frame).transpose(2, 1, 0))
    thrust = vehicle.mass * attitude.dot(motion.gamma, frame[2])
    torque = accelerations @ vehicle.inertia + np.cross(rates.T, rates.T @ vehicle.inertia)
    speeds = vehicle.rotor_speeds(np.column_stack([thrust, torque]))
    return FlatStates(thrust, rotation, rates.T.copy(), accelerations, torque, speeds, singular)


def flatness_of(
    vehicle: Quadrotor, path: Path, t: ArrayLike, *, wind: ArrayLike = (0.0, 0.0, 0.0), drag: BodyDrag | None = None
) -> FlatStates:
    """Return states and inputs of a quadrotor along a path.

    Parameters
    ----------
    vehicle : Quadrotor
    path : Path
        Of two or three dimensions; its yaw is followed, or the forward axis of a ``TiltHeading``.
    t : array_like, shape (m,)
        Consecutive instants [s] in [0, path.duration].
    wind, drag
        As for :func:`flat_states`.

    Returns
    -------
    FlatStates
    """
    instants = np.atleast_1d(owned(t))
    derivatives = [path(instants, order) for order in range(1, 5)]
    forward = path.yaw.forward(np.minimum(instants, path.duration))
    if forward is None:
        turning = [path.yaw(instants, order) for order in range(3)]
        return flat_states(vehicle, *derivatives, *turning, wind=wind, drag=drag)
    columns = [np.ascontiguousarray(spatial(value).T) for value in derivatives]
    columns[0] = columns[0] - np.asarray(wind, dtype=np.float64)[:, None]
    return _states(vehicle, attitude.flat_motion(tuple(columns), forward, _media(vehicle, drag), True))  # type: ignore[arg-type]


def check_rotor_limits(vehicle: Quadrotor, states: FlatStates, t: ArrayLike) -> None:
    """Raise ThrustError if a rotor thrust exceeds its limits; the error gives the worst instant and the excess.

    Parameters
    ----------
    vehicle : Quadrotor
    states : FlatStates
    t : array_like, shape (m,)
        Their instants [s].
    """
    least, most = vehicle.rotor_thrust_limits
    thrusts = vehicle.thrusts(states.rotor_speed)
    above, below = thrusts.max(axis=1) - most, least - thrusts.min(axis=1)
    worst = int(np.argmax(np.maximum(above, below)))
    excess = float(max(above[worst], below[worst]))
    if excess > 1e-12 * most:
        high = above[worst] >= below[worst]
        limit, side = (most, "above the most") if high else (least, "below the least")
        instant = float(np.asarray(t, dtype=np.float64)[worst])
        text = f"at t = {instant:.3f} s a rotor must give {excess:.3g} N {side} it can ({limit:.3g} N)"
        raise ThrustError(f"{text}: fly it slower, or with a stronger vehicle", instant=instant, excess=excess)

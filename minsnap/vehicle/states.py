"""Differential flatness: the full state and the inputs of a quadrotor from its motion and yaw, at many instants."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import BoolArray, FloatArray, OwnsArrays
from minsnap.errors import ThrustError, VehicleError
from minsnap.trajectory.medium import Medium
from minsnap.trajectory.path import Path
from minsnap.vehicle.attitude import (
    FlatMotion,
    angular_accelerations_of,
    body_frame,
    dot,
    flat_motion,
    heading_of,
    quaternions,
    rates_of,
)
from minsnap.vehicle.drag import BodyDrag
from minsnap.vehicle.flatness import spatial
from minsnap.vehicle.quadrotor import Quadrotor


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
        quaternion = quaternions(self.rotation)
        quaternion.flags.writeable = False
        return quaternion


def flat_states(
    vehicle: Quadrotor,
    velocity: npt.ArrayLike,
    acceleration: npt.ArrayLike,
    jerk: npt.ArrayLike,
    snap: npt.ArrayLike,
    yaw: npt.ArrayLike = 0.0,
    yaw_rate: npt.ArrayLike = 0.0,
    yaw_acceleration: npt.ArrayLike = 0.0,
    *,
    wind: npt.ArrayLike = (0.0, 0.0, 0.0),
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
    heading = heading_of(turning)  # type: ignore[arg-type]
    return _states(vehicle, flat_motion((air, *columns), heading, _media(vehicle, drag)))  # type: ignore[arg-type]


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


def _states(vehicle: Quadrotor, motion: FlatMotion) -> FlatStates:
    """Compute attitude, rates, accelerations, torques and rotor speeds, in this order."""
    frame, singular = body_frame(motion)
    rates = rates_of(motion, frame, singular)
    accelerations = angular_accelerations_of(motion, frame, rates, singular).T
    rotation = np.ascontiguousarray(np.stack(frame).transpose(2, 1, 0))
    thrust = vehicle.mass * dot(motion.gamma, frame[2])
    torque = accelerations @ vehicle.inertia + np.cross(rates.T, rates.T @ vehicle.inertia)
    speeds = vehicle.rotor_speeds(np.column_stack([thrust, torque]))
    return FlatStates(thrust, rotation, rates.T.copy(), accelerations, torque, speeds, singular)


def flatness_of(
    vehicle: Quadrotor,
    path: Path,
    t: npt.ArrayLike,
    *,
    wind: npt.ArrayLike = (0.0, 0.0, 0.0),
    drag: BodyDrag | None = None,
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
    instants = np.atleast_1d(np.asarray(t, dtype=np.float64))
    derivatives = [path(instants, order) for order in range(1, 5)]
    forward = path.yaw.forward(np.minimum(instants, path.duration))
    if forward is None:
        turning = [path.yaw(instants, order) for order in range(3)]
        return flat_states(vehicle, *derivatives, *turning, wind=wind, drag=drag)
    columns = [np.ascontiguousarray(spatial(value).T) for value in derivatives]
    columns[0] = columns[0] - np.asarray(wind, dtype=np.float64)[:, None]
    return _states(vehicle, flat_motion(tuple(columns), forward, _media(vehicle, drag), True))  # type: ignore[arg-type]


def check_rotor_limits(vehicle: Quadrotor, states: FlatStates, t: npt.ArrayLike) -> None:
    """Raise ThrustError if a rotor thrust exceeds its limits; the error gives the worst instant and the excess.

    Parameters
    ----------
    vehicle : Quadrotor
    states : FlatStates
    t : array_like, shape (m,)
        Their instants [s].
    """
    least, most = vehicle.rotor_thrust_limits
    thrusts = vehicle.thrust_coefficient * states.rotor_speed * np.abs(states.rotor_speed)
    above, below = thrusts.max(axis=1) - most, least - thrusts.min(axis=1)
    worst = int(np.argmax(np.maximum(above, below)))
    excess = float(max(above[worst], below[worst]))
    if excess > 1e-12 * most:
        high = above[worst] >= below[worst]
        limit, side = (most, "above the most") if high else (least, "below the least")
        instant = float(np.asarray(t, dtype=np.float64)[worst])
        raise ThrustError(
            f"at t = {instant:.3f} s a rotor must give {excess:.3g} N {side} it can ({limit:.3g} N): "
            "fly it slower, or with a stronger vehicle",
            instant=instant,
            excess=excess,
        )

"""What a page draws of a plan: the path with its speed, profiles against time, the vehicle's pose and rotor thrusts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import GRAVITY, FloatArray
from minsnap.trajectory.path import Path
from minsnap.vehicle.flatness import specific_thrust, tilt
from minsnap.vehicle.quadrotor import Quadrotor
from minsnap.vehicle.states import flatness_of

PIECES = 320
"""Straight pieces that a path is drawn with."""

INSTANTS = 241
"""Instants of a profile."""

SPEED_SCALE = np.array([(68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37)], dtype=np.float64)
"""Colours from rest to the greatest speed: five of matplotlib's viridis (Smith and van der Walt, CC0)."""

ColourArray = npt.NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Profiles:
    """Quantities against time, arrays of shape (m,), rotors (m, 4).

    Parameters
    ----------
    t : ndarray
        [s].
    speed, acceleration : ndarray
        Euclidean norms [m/s], [m/s^2].
    thrust : ndarray
        Thrust to weight.
    tilt : ndarray
        [degrees].
    rotors : ndarray, shape (m, 4)
        Thrust of each rotor [N].
    """

    t: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    thrust: FloatArray
    tilt: FloatArray
    rotors: FloatArray


@dataclass(frozen=True, eq=False)
class VehiclePose:
    """Where a vehicle is.

    Parameters
    ----------
    position : ndarray, shape (3,)
        [m].
    quaternion : ndarray, shape (4,)
        Attitude w, x, y, z.
    rotors : ndarray, shape (4,)
        Thrust of each rotor [N].
    speed : float
        [m/s].
    """

    position: FloatArray
    quaternion: FloatArray
    rotors: FloatArray
    speed: float


def coloured_path(path: Path) -> tuple[npt.NDArray[np.float32], ColourArray, float]:
    """Return the pieces of a path, shape (n, 2, 3) [m], the colours of their ends, and the greatest speed [m/s]."""
    t = np.linspace(0.0, path.duration, PIECES + 1)
    speed = np.linalg.norm(path(t, 1), axis=1)
    top = float(speed.max())
    colours = speed_colours(speed / top if top > 0.0 else speed)
    return pieces_of(path(t)), np.stack([colours[:-1], colours[1:]], axis=1), top


def pieces_of(points: FloatArray) -> npt.NDArray[np.float32]:
    """Return the straight pieces between consecutive points, shape (n, 2, 3) [m]."""
    return np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)


def speed_colours(share: npt.ArrayLike) -> ColourArray:
    """Return colours of shares in [0, 1] of the greatest speed, shape (..., 3)."""
    at = np.clip(np.asarray(share, dtype=np.float64), 0.0, 1.0) * (len(SPEED_SCALE) - 1)
    below = np.minimum(at.astype(np.intp), len(SPEED_SCALE) - 2)
    part = (at - below)[..., None]
    return np.asarray((1.0 - part) * SPEED_SCALE[below] + part * SPEED_SCALE[below + 1]).round().astype(np.uint8)


def profiles_of(path: Path, vehicle: Quadrotor) -> Profiles:
    """Return the profiles of a path flown by a vehicle, drag included in the rotors' thrusts."""
    t = np.linspace(0.0, path.duration, INSTANTS)
    acceleration = path(t, 2)
    return Profiles(
        t,
        np.linalg.norm(path(t, 1), axis=1),
        np.linalg.norm(acceleration, axis=1),
        specific_thrust(acceleration) / GRAVITY,
        np.degrees(tilt(acceleration)),
        _rotor_thrusts(vehicle, path, t)[0],
    )


def pose_at(path: Path, vehicle: Quadrotor, instant: float) -> VehiclePose:
    """Return the pose of a vehicle on a path, its attitude and thrusts by differential flatness."""
    t = np.array([min(max(instant, 0.0), path.duration)])
    thrusts, quaternion = _rotor_thrusts(vehicle, path, t)
    return VehiclePose(path(t)[0], quaternion[0], thrusts[0], float(np.linalg.norm(path(t, 1)[0])))


def _rotor_thrusts(vehicle: Quadrotor, path: Path, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    states = flatness_of(vehicle, path, t)
    return vehicle.thrust_coefficient * states.rotor_speed * np.abs(states.rotor_speed), states.quaternion

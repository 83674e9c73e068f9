"""What the body felt: attitude, accelerometer and throttle of a log, in z-up world and forward-left-up body axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray, own_arrays

WORLD = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""From NED to ENU."""

BODY = np.diag([1.0, -1.0, -1.0])
"""From forward-right-down to forward-left-up."""


@dataclass(frozen=True, eq=False)
class InertialLog:
    """Attitude, specific force and throttle of a flight, on the clock of its :class:`FlightLog`.

    Parameters
    ----------
    attitude_t : ndarray, shape (m,)
        [s].
    quaternion : ndarray, shape (m, 4)
        From body (forward, left, up) to world (z up), w, x, y, z; continuous in sign.
    force_t : ndarray, shape (n,)
        [s].
    specific_force : ndarray, shape (n, 3)
        What the accelerometer measured, in the body: gravity is not in it [m/s^2].
    throttle_t, throttle : ndarray, shape (k,), or None
        Collective thrust that was commanded, 0 to 1; None where none was logged.
    hover_throttle : float or None
        The autopilot's own estimate of the throttle in hover.
    """

    attitude_t: FloatArray
    quaternion: FloatArray
    force_t: FloatArray
    specific_force: FloatArray
    throttle_t: FloatArray | None = None
    throttle: FloatArray | None = None
    hover_throttle: float | None = None

    def __post_init__(self) -> None:
        own_arrays(self)


def inertial_log(
    attitude: tuple[FloatArray, FloatArray],
    force: tuple[FloatArray, FloatArray],
    throttle: tuple[FloatArray, FloatArray] | None,
    hover: float | None,
    start: float,
) -> InertialLog:
    """Convert from z-down axes and time since boot.

    Parameters
    ----------
    attitude : tuple
        Instants (m,) and quaternions (m, 4) from forward-right-down to NED.
    force : tuple
        Instants (n,) and specific forces (n, 3) in forward-right-down.
    throttle : tuple or None
        Instants (k,) and values (k,).
    hover : float or None
        The autopilot's estimate of the throttle in hover.
    start : float
        Time since boot that is 0 in the log [s].
    """
    from scipy.spatial.transform import Rotation

    from minsnap.vehicle.rotation import quaternions

    (t, turns), (force_t, pulls) = _finite(*attitude), _finite(*force)
    matrices = Rotation.from_quat(np.roll(turns, -1, axis=1)).as_matrix()
    turned = quaternions(WORLD @ matrices @ BODY)
    felt = pulls @ BODY
    if throttle is None:
        return InertialLog(t - start, turned, force_t - start, felt, hover_throttle=hover)
    thrust_t, thrust = _finite(*throttle)
    return InertialLog(t - start, turned, force_t - start, felt, thrust_t - start, thrust, hover)


def from_euler(roll: FloatArray, pitch: FloatArray, yaw: FloatArray) -> FloatArray:
    """Return quaternions w, x, y, z of turns by yaw, then pitch, then roll [rad], shape (m, 4)."""
    from scipy.spatial.transform import Rotation

    return np.roll(Rotation.from_euler("ZYX", np.stack([yaw, pitch, roll], axis=1)).as_quat(), 1, axis=1)


def _finite(t: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Leave out rows that are not finite, or whose time does not rise."""
    good = np.isfinite(t) & np.isfinite(values).reshape(len(t), -1).all(axis=1)
    latest = np.maximum.accumulate(np.where(good, t, -np.inf))
    good[1:] &= t[1:] > latest[:-1]
    return t[good], values[good]

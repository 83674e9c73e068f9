"""Thrust, tilt and body rates that a motion needs, without drag: vectorised functions of its derivatives.

With ``t = a + g e_z`` the thrust per mass is ``c = |t|`` and the body's vertical axis ``z_B = t / c`` (Mellinger and
Kumar, *Minimum snap trajectory generation and control for quadrotors*, ICRA 2011). The whole state, with drag, is in
:mod:`minsnap.vehicle.attitude`.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import GRAVITY as GRAVITY
from minsnap.basics.arrays import FloatArray
from minsnap.trajectory.medium import Medium


def thrust_vector(acceleration: npt.ArrayLike, gravity: float = GRAVITY) -> FloatArray:
    """Return thrust per mass as a vector, ``a + g e_z``.

    Parameters
    ----------
    acceleration : array_like, shape (..., 3) or (..., 2)
        [m/s^2]; of a plane path the third component is zero.
    gravity : float
        [m/s^2].

    Returns
    -------
    ndarray, shape (..., 3)
        [m/s^2].
    """
    vector = spatial(acceleration).copy()
    vector[..., 2] += gravity
    return vector


def specific_thrust(acceleration: npt.ArrayLike, gravity: float = GRAVITY) -> FloatArray:
    """Return thrust per mass ``|a + g e_z|`` [m/s^2]; divided by ``gravity``: the thrust-to-weight.

    Parameters
    ----------
    acceleration : array_like, shape (..., 3) or (..., 2)
        [m/s^2].
    gravity : float
        [m/s^2].

    Returns
    -------
    ndarray, shape (...)
    """
    return np.asarray(np.linalg.norm(thrust_vector(acceleration, gravity), axis=-1))


def tilt(acceleration: npt.ArrayLike, gravity: float = GRAVITY) -> FloatArray:
    """Return the angle between thrust and the vertical [rad], 0 to pi; 0 in free fall, where it is undefined.

    Parameters
    ----------
    acceleration : array_like, shape (..., 3) or (..., 2)
        [m/s^2].
    gravity : float
        [m/s^2].

    Returns
    -------
    ndarray, shape (...)
    """
    vector = thrust_vector(acceleration, gravity)
    return np.asarray(np.arctan2(np.hypot(vector[..., 0], vector[..., 1]), vector[..., 2]))


def tilt_rate(acceleration: npt.ArrayLike, jerk: npt.ArrayLike, gravity: float = GRAVITY) -> FloatArray:
    """Return the rate of rotation of the thrust axis, ``|t x j| / |t|^2`` [rad/s]: the norm of roll and pitch rate.

    It does not depend on yaw. In free fall it is infinite unless the jerk is zero too.

    Parameters
    ----------
    acceleration, jerk : array_like, shape (..., 3) or (..., 2)
        [m/s^2], [m/s^3].
    gravity : float
        [m/s^2].

    Returns
    -------
    ndarray, shape (...)
    """
    vector = thrust_vector(acceleration, gravity)
    turning = np.linalg.norm(np.cross(vector, spatial(jerk)), axis=-1)
    squared = np.einsum("...i,...i", vector, vector)
    stopped = np.where(np.linalg.norm(spatial(jerk), axis=-1) > 0, np.inf, 0.0)
    return np.asarray(np.where(squared > 0, turning / np.where(squared > 0, squared, 1.0), stopped))


def body_rates(
    acceleration: npt.ArrayLike,
    jerk: npt.ArrayLike,
    yaw: npt.ArrayLike = 0.0,
    yaw_rate: npt.ArrayLike = 0.0,
    gravity: float = GRAVITY,
) -> FloatArray:
    """Return the body rates of a motion without drag.

    Parameters
    ----------
    acceleration, jerk : array_like, shape (m, 3) or (m, 2)
        [m/s^2], [m/s^3].
    yaw, yaw_rate : array_like, shape (m,) or ()
        [rad], [rad/s].
    gravity : float
        [m/s^2].

    Returns
    -------
    ndarray, shape (m, 3)
        Roll, pitch and yaw rate about the body's axes [rad/s]; zero at singular instants (see
        :func:`minsnap.vehicle.attitude.body_frame`).
    """
    from minsnap.vehicle.attitude import body_frame, flat_motion, heading_of, rates_of

    lift, change = np.atleast_2d(spatial(acceleration)).T, np.atleast_2d(spatial(jerk)).T
    zero = np.zeros(lift.shape[1])
    still = np.zeros_like(lift)
    turning = (zero + np.asarray(yaw, dtype=np.float64), zero + np.asarray(yaw_rate, dtype=np.float64), zero)
    motion = flat_motion((still, lift, change, still), heading_of(turning), [Medium(gravity)])
    frame, singular = body_frame(motion)
    return rates_of(motion, frame, singular).T


def spatial(vectors: npt.ArrayLike) -> FloatArray:
    """Return vectors of shape (..., 3): three components unchanged, two components extended with a zero."""
    array = np.asarray(vectors, dtype=np.float64)
    if array.shape[-1] == 3:
        return array
    return np.concatenate([array, np.zeros((*array.shape[:-1], 3 - array.shape[-1]))], axis=-1)

r"""What a motion needs: thrust, tilt, attitude, body rates and angular accelerations, by exact inverse dynamics.

Without drag, with ``t = a + g e_z``, the thrust per mass is ``c = |t|`` and the body's vertical axis ``z_B = t / c``
(Mellinger and Kumar, *Minimum snap trajectory generation and control for quadrotors*, ICRA 2011).

With drag :math:`F_B = -\operatorname{diag}(d)\,R^\top u` in the body frame, ``u`` the velocity through the air and
``delta = d / m``, the body axes satisfy (Faessler, Franchi and Scaramuzza, *Differential flatness of quadrotor dynamics
subject to rotor drag*, RA-L 2018)

.. math:: x_B \cdot \alpha = 0,\quad y_B \cdot \beta = 0,\quad
          \alpha = a + g e_z + \delta_x u,\quad \beta = a + g e_z + \delta_y u,

and the yaw angle adds :math:`y_B \cdot x_C = 0` with :math:`x_C = (\cos\psi, \sin\psi, 0)` (Mellinger and Kumar 2011).
Here ``delta`` may vary with the airspeed. Differentiating the three conditions once and twice gives body
rates and angular accelerations as solutions of one 3 x 3 system.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import GRAVITY as GRAVITY
from minsnap.basics.arrays import ArrayLike, BoolArray, FloatArray, IntArray, numbers, owned
from minsnap.basics.messages import shown
from minsnap.errors import InputError, VehicleError
from minsnap.trajectory.medium import Medium
from minsnap.trajectory.tilt_heading import FREE_FALL

PARALLEL = 1e-6
"""Thrust within this angle [rad] of the yaw direction leaves the lateral axis undefined."""

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


def flat_motion(motion: Quadruple, heading: Triple, media: Sequence[Medium], spinless: bool = False) -> FlatMotion:
    """Compute the vectors that determine the attitude.

    Parameters
    ----------
    motion : tuple of 4 ndarrays, shape (3, m)
        Velocity through the air, acceleration, jerk, snap, in the world frame.
    heading : tuple of 3 ndarrays, shape (3, m)
        Direction that ``y_B`` is perpendicular to and its two derivatives; of a yaw, see ``heading_of``.
    media : sequence of 1 or 3 Medium
        Gravity, and the drag along each of the body's axes; one is that of all.
    spinless : bool
        Whether the heading is a forward axis.
    """
    alpha, beta, (gamma, *_) = [_lifted(medium, motion) for medium in media] * (3 // len(media))
    return FlatMotion(alpha, beta, gamma, heading, spinless)


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


def body_frame(motion: FlatMotion) -> tuple[Triple, BoolArray]:
    """Return the attitude at consecutive instants, and a mask of the singular ones.

    Where the thrust is zero (free fall), the previous attitude is kept; where the thrust is parallel to the yaw
    direction, the previous lateral axis is kept. Both ``y_B`` and ``-y_B`` are consistent with thrust and yaw; in
    inverted flight the sign closer to the previous instant is taken, as Mellinger and Kumar propose.

    Parameters
    ----------
    motion : FlatMotion

    Returns
    -------
    frame : tuple of 3 ndarrays, shape (3, m)
        The body's axes in the world frame.
    singular : ndarray of bool, shape (m,)
    """
    lateral = cross(motion.beta[0], motion.heading[0])
    length, lift = norm(lateral), np.minimum(norm(motion.beta[0]), norm(motion.alpha[0]))
    falling = lift <= FREE_FALL * GRAVITY
    singular = falling | (length <= PARALLEL * lift)
    lateral = lateral / np.where(singular, 1.0, length)
    lateral = lateral if motion.spinless else _signs(lateral, motion, singular) * lateral
    if singular.any():
        lateral = _hold_lateral(lateral, motion, singular)
    frame = _frame_of(lateral, motion.alpha[0])
    return (_hold_frame(frame, falling) if falling.any() else frame), singular


def _signs(lateral: FloatArray, motion: FlatMotion, singular: BoolArray) -> FloatArray:
    """Return the sign, +1 or -1, per instant that keeps the lateral axis continuous in the rotating yaw frame."""
    heading = motion.heading[0]
    regular = np.flatnonzero(~singular)
    across = (lateral[1] * heading[0] - lateral[0] * heading[1])[regular]
    up, upright = lateral[2, regular], motion.beta[0][2, regular] > 0
    turned = across[1:] * across[:-1] + up[1:] * up[:-1] < 0
    flips = np.where(turned & ~(upright[1:] & upright[:-1]), -1.0, 1.0)
    signs = np.ones(lateral.shape[1])
    signs[regular[1:]] = np.cumprod(flips)
    return signs


def _last_regular(singular: BoolArray) -> IntArray:
    """Return per instant the index of the last regular instant, or of the first one if none precedes it."""
    index = np.maximum.accumulate(np.where(singular, -1, np.arange(len(singular))))
    return np.asarray(np.where(index < 0, int(np.argmin(singular)), index))


def _hold_lateral(lateral: FloatArray, motion: FlatMotion, singular: BoolArray) -> FloatArray:
    """Return lateral axes; singular ones copy a regular neighbour, or are horizontal if all are singular."""
    heading = motion.heading[0]
    if singular.all():
        return np.stack([-heading[1], heading[0], heading[2]])
    return np.where(singular, lateral[:, _last_regular(singular)], lateral)


def _hold_frame(frame: Triple, falling: BoolArray) -> Triple:
    """Return frames; those in free fall copy a neighbour that is not, or are level if all are in free fall."""
    if falling.all():
        return _frame_of(frame[1], np.broadcast_to([[0.0], [0.0], [1.0]], frame[1].shape))
    forward, lateral, vertical = np.where(falling, np.stack(frame)[:, :, _last_regular(falling)], np.stack(frame))
    return forward, lateral, vertical


def _frame_of(lateral: FloatArray, alpha: FloatArray) -> Triple:
    """Return the frame with lateral axis ``y_B`` and forward axis along ``y_B x alpha``."""
    forward = cross(lateral, alpha)
    length = norm(forward)
    forward = forward / np.where(length > 0, length, 1.0)
    return forward, lateral, cross(forward, lateral)


def rates_of(motion: FlatMotion, frame: Triple, singular: BoolArray) -> FloatArray:
    """Return body rates, shape (3, m) [rad/s], zero where singular, from the first derivative of the conditions."""
    forward, lateral, _ = frame
    known = (dot(forward, motion.alpha[1]), dot(lateral, motion.beta[1]), dot(lateral, motion.heading[1]))
    return _solve(motion, frame, known, singular)


def angular_accelerations_of(motion: FlatMotion, frame: Triple, rates: FloatArray, singular: BoolArray) -> FloatArray:
    """Return angular accelerations, shape (3, m) [rad/s^2], zero where singular, from the second derivative."""
    forward, lateral, vertical = frame
    roll, pitch, turn = rates
    forward_rate, lateral_rate = turn * lateral - pitch * vertical, roll * vertical - turn * forward
    vertical_rate = pitch * forward - roll * lateral
    forward_turn = turn * lateral_rate - pitch * vertical_rate
    lateral_turn = roll * vertical_rate - turn * forward_rate
    known = (
        _second(motion.alpha, forward, forward_rate, forward_turn),
        _second(motion.beta, lateral, lateral_rate, lateral_turn),
        _second(motion.heading, lateral, lateral_rate, lateral_turn),
    )
    return _solve(motion, frame, known, singular)


def _second(vector: Triple, axis: FloatArray, rate: FloatArray, turning: FloatArray) -> FloatArray:
    """Return ``(axis . vector)''`` without the term of the angular acceleration."""
    return dot(turning, vector[0]) + 2 * dot(rate, vector[1]) + dot(axis, vector[2])


def _solve(motion: FlatMotion, frame: Triple, known: Triple, singular: BoolArray) -> FloatArray:
    """Solve the three differentiated conditions for rates or angular accelerations, zero where singular."""
    alpha, beta, heading = motion.alpha[0], motion.beta[0], motion.heading[0]
    forward, lateral, vertical = frame
    up_beta, forward_beta = dot(vertical, beta), dot(forward, beta)
    up_heading, forward_heading = dot(vertical, heading), dot(forward, heading)
    determinant = np.where(singular, np.inf, up_beta * forward_heading - forward_beta * up_heading)
    roll = (known[2] * forward_beta - known[1] * forward_heading) / determinant
    turn = (known[2] * up_beta - known[1] * up_heading) / determinant
    pitch = (turn * dot(lateral, alpha) + known[0]) / np.where(singular, np.inf, dot(vertical, alpha))
    return np.stack([roll, pitch, turn])


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


def quaternions(rotation: FloatArray) -> FloatArray:
    """Return the quaternions of consecutive rotation matrices, with signs that make them continuous.

    Parameters
    ----------
    rotation : ndarray, shape (m, 3, 3)

    Returns
    -------
    ndarray, shape (m, 4)
        Unit quaternions w, x, y, z; the first has w >= 0.
    """
    from scipy.spatial.transform import Rotation

    own = np.array(rotation)  # not every release of scipy takes an array that is read-only
    return continuous(np.roll(Rotation.from_matrix(own).as_quat(), 1, axis=-1))


def rotations(quaternion: FloatArray) -> FloatArray:
    """Return the rotation matrices of quaternions (m, 4), shape (m, 3, 3).

    Raises
    ------
    VehicleError
        If they are malformed.
    """
    quaternion = _quaternions(quaternion)
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_quat(np.roll(quaternion, -1, axis=-1)).as_matrix())


def _quaternions(values: ArrayLike) -> FloatArray:
    quaternion = numbers(values, copy=False)
    if quaternion is None or quaternion.ndim != 2 or quaternion.shape[1] != 4:
        raise VehicleError(f"the attitudes are {shown(values)}: give quaternions (w, x, y, z), shape (m, 4)")
    return quaternion


def continuous(quaternion: FloatArray) -> FloatArray:
    """Return quaternions, shape (m, 4), with the signs that make them continuous; the first has w >= 0."""
    turned = np.einsum("mi,mi->m", quaternion[1:], quaternion[:-1]) < 0
    first = -1.0 if len(quaternion) and quaternion[0, 0] < 0 else 1.0
    signs = np.concatenate([np.full(min(len(quaternion), 1), first), first * np.cumprod(np.where(turned, -1.0, 1.0))])
    return np.asarray(quaternion * signs[:, None])


def headings(quaternion: FloatArray) -> FloatArray:
    """Return the continuous yaw of attitudes (m, 4), shape (m,) [rad]: the heading of the forward axis.

    Raises
    ------
    VehicleError
        If they are malformed.
    """
    w, x, y, z = _quaternions(quaternion).T
    return np.unwrap(np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)))


def thrust_vector(acceleration: ArrayLike, gravity: float = GRAVITY) -> FloatArray:
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
    vector[..., 2] += float(gravity)
    return vector


def specific_thrust(acceleration: ArrayLike, gravity: float = GRAVITY) -> FloatArray:
    """Return thrust per mass ``|a + g e_z|`` of accelerations (..., 3) or (..., 2), shape (...) [m/s^2].

    Divided by ``gravity`` [m/s^2] it is the thrust-to-weight.
    """
    return np.asarray(np.linalg.norm(thrust_vector(acceleration, gravity), axis=-1))


def tilt(acceleration: ArrayLike, gravity: float = GRAVITY) -> FloatArray:
    """Return the angle of thrust to the vertical, 0 to pi, of accelerations (..., 3) or (..., 2), shape (...) [rad].

    In free fall, where it is undefined, it is 0.
    """
    vector = thrust_vector(acceleration, gravity)
    return np.asarray(np.arctan2(np.hypot(vector[..., 0], vector[..., 1]), vector[..., 2]))


def tilt_rate(acceleration: ArrayLike, jerk: ArrayLike, gravity: float = GRAVITY) -> FloatArray:
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
    acceleration: ArrayLike, jerk: ArrayLike, yaw: ArrayLike = 0.0, yaw_rate: ArrayLike = 0.0, gravity: float = GRAVITY
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
    lift, change = np.atleast_2d(spatial(acceleration)).T, np.atleast_2d(spatial(jerk)).T
    zero = np.zeros(lift.shape[1])
    still = np.zeros_like(lift)
    turning = (zero + np.asarray(yaw, dtype=np.float64), zero + np.asarray(yaw_rate, dtype=np.float64), zero)
    motion = flat_motion((still, lift, change, still), heading_of(turning), [Medium(gravity)])
    frame, singular = body_frame(motion)
    return rates_of(motion, frame, singular).T


def spatial(vectors: ArrayLike) -> FloatArray:
    """Return vectors of shape (..., 3): three components unchanged, fewer extended with zeros, or InputError."""
    array = owned(vectors)
    if array.ndim == 0 or array.shape[-1] not in (1, 2, 3):
        raise InputError(f"vectors have up to three components, and this has shape {array.shape}")
    if array.shape[-1] == 3:
        return array
    return np.concatenate([array, np.zeros((*array.shape[:-1], 3 - array.shape[-1]))], axis=-1)

"""Unit quaternions (w, x, y, z) of attitudes, many at a time: continuous in sign, and their headings."""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import FloatArray


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

    return continuous(np.roll(Rotation.from_matrix(rotation).as_quat(), 1, axis=-1))


def rotations(quaternion: FloatArray) -> FloatArray:
    """Return the rotation matrices of quaternions (m, 4), shape (m, 3, 3)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_quat(np.roll(quaternion, -1, axis=-1)).as_matrix())


def continuous(quaternion: FloatArray) -> FloatArray:
    """Return quaternions, shape (m, 4), with the signs that make them continuous; the first has w >= 0."""
    turned = np.einsum("mi,mi->m", quaternion[1:], quaternion[:-1]) < 0
    first = -1.0 if len(quaternion) and quaternion[0, 0] < 0 else 1.0
    signs = np.concatenate([np.full(min(len(quaternion), 1), first), first * np.cumprod(np.where(turned, -1.0, 1.0))])
    return np.asarray(quaternion * signs[:, None])


def headings(quaternion: FloatArray) -> FloatArray:
    """Return the continuous yaw angle of attitudes, shape (m,) [rad]: the heading of the forward axis."""
    w, x, y, z = quaternion.T
    return np.unwrap(np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)))

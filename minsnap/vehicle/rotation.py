"""Rotations as matrices and unit quaternions (w, x, y, z), many at a time."""

from __future__ import annotations

import numpy as np

from minsnap.arrays import FloatArray


def quaternions(rotation: FloatArray) -> FloatArray:
    """Return the quaternions of consecutive rotation matrices, with signs that make them continuous.

    Parameters
    ----------
    rotation : ndarray, shape (m, 3, 3)

    Returns
    -------
    ndarray, shape (m, 4)
        Unit quaternions w, x, y, z; the first has w >= 0.

    Notes
    -----
    The largest of the four components is found from the diagonal and the others from sums and differences of the
    off-diagonal entries (Shepperd, *Quaternion from rotation matrix*, J. Guidance and Control 1978).
    """
    diagonal = np.einsum("mii->mi", rotation)
    trace = diagonal.sum(axis=-1)
    squares = np.concatenate([1.0 + trace[:, None], 1.0 - trace[:, None] + 2.0 * diagonal], axis=-1)
    largest = np.argmax(squares, axis=-1)
    rows = np.take_along_axis(_products(rotation, squares), largest[:, None, None], axis=1)[:, 0]
    unit = rows / np.sqrt(np.einsum("mi,mi->m", rows, rows))[:, None]
    return continuous(unit)


def _products(rotation: FloatArray, squares: FloatArray) -> FloatArray:
    """Return 4 times the outer product of each quaternion with itself, shape (m, 4, 4)."""
    products = np.empty((len(rotation), 4, 4))
    products[:, range(4), range(4)] = squares
    for axis, (one, two) in enumerate(((1, 2), (2, 0), (0, 1)), start=1):
        products[:, 0, axis] = products[:, axis, 0] = rotation[:, two, one] - rotation[:, one, two]
        products[:, one + 1, two + 1] = products[:, two + 1, one + 1] = rotation[:, two, one] + rotation[:, one, two]
    return products


def continuous(quaternion: FloatArray) -> FloatArray:
    """Return quaternions, shape (m, 4), with the signs that make them continuous; the first has w >= 0."""
    turned = np.einsum("mi,mi->m", quaternion[1:], quaternion[:-1]) < 0
    first = -1.0 if len(quaternion) and quaternion[0, 0] < 0 else 1.0
    signs = np.concatenate([np.full(min(len(quaternion), 1), first), first * np.cumprod(np.where(turned, -1.0, 1.0))])
    return np.asarray(quaternion * signs[:, None])


def matrices(quaternion: FloatArray) -> FloatArray:
    """Return the rotation matrices, shape (m, 3, 3), of unit quaternions w, x, y, z, shape (m, 4)."""
    w, x, y, z = quaternion.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.ascontiguousarray(np.array(rows).transpose(2, 0, 1))


def headings(quaternion: FloatArray) -> FloatArray:
    """Return the continuous yaw angle of attitudes, shape (m,) [rad]: the heading of the forward axis."""
    w, x, y, z = quaternion.T
    return np.unwrap(np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)))

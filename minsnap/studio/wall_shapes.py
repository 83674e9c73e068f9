"""Walls as triangles: the prism of a tube around a leg, and boxes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.planning.request import Box

TOUCHING = 1e-9
"""Relative distance from a plane below which a corner lies on it."""

_BOX_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4]]
    + [[1, 5, 7], [1, 7, 3]]
)


def tube_prism(start: Sequence[float], end: Sequence[float], half_width: float) -> tuple[FloatArray, IntArray]:
    r"""Return the surface of a tube between the waypoints of its leg.

    Across the leg the tube is the polygon :math:`\|d\|_\infty \le \delta` of the plane :math:`d \perp u` (see
    :class:`~minsnap.Tube`): its corners are where two of the planes :math:`d_k = \pm\delta` meet.

    Parameters
    ----------
    start, end : sequence of 3 floats
        Waypoints [m], different ones.
    half_width : float
        :math:`\delta` [m].

    Returns
    -------
    vertices : ndarray, shape (2 m, 3)
        The polygon at the start, then at the end [m].
    faces : ndarray of int, shape (2 m, 3)
        Triangles of the sides.
    """
    first, last = np.array(start, dtype=np.float64), np.array(end, dtype=np.float64)
    corners = _polygon((last - first) / np.linalg.norm(last - first), half_width)
    count = len(corners)
    here, following = np.arange(count), np.roll(np.arange(count), -1)
    lower = np.column_stack([here, following, here + count])
    upper = np.column_stack([following, following + count, here + count])
    return np.vstack([corners + first, corners + last]), np.vstack([lower, upper])


def box_surface(box: Box) -> tuple[FloatArray, IntArray]:
    """Return the corners and the triangles of a box, shapes (8, 3) [m] and (12, 3)."""
    bounds = np.array(box, dtype=np.float64)
    pick = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)])
    return bounds[pick, np.arange(3)], _BOX_FACES


def box_edges(box: Box) -> FloatArray:
    """Return the 12 edges of a box, shape (12, 2, 3) [m]."""
    corners = box_surface(box)[0]
    pairs = [(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit]
    return np.asarray(corners[np.array(pairs)])


def face_centres(box: Box) -> FloatArray:
    """Return the centers of the faces, shape (3, 2, 3) by axis and side [m]."""
    bounds = np.array(box, dtype=np.float64)
    centers = np.tile(bounds.mean(axis=0), (3, 2, 1))
    for axis in range(3):
        centers[axis, :, axis] = bounds[:, axis]
    return centers


def _polygon(along: FloatArray, half_width: float) -> FloatArray:
    """Return the corners of the section across a direction, in order, shape (m, 3) [m]."""
    across = _basis(along)
    normals = np.vstack([across, -across])
    kept = np.linalg.norm(normals, axis=1) > TOUCHING
    normals = normals[kept]
    vertices = []
    for i, first in enumerate(normals):
        for second in normals[i + 1 :]:
            matrix = np.array([first, second])
            if abs(np.linalg.det(matrix)) > TOUCHING:
                corner = np.linalg.solve(matrix, np.full(2, half_width))
                if (normals @ corner).max() <= half_width * (1.0 + TOUCHING):
                    vertices.append(corner)
    corners = np.array(vertices)
    order = np.argsort(np.arctan2(corners[:, 1], corners[:, 0]))
    return np.asarray(corners[order] @ across.T)


def _basis(along: FloatArray) -> FloatArray:
    """Return two unit vectors across a direction as columns, shape (3, 2): row k is axis k in their plane."""
    helper = np.eye(3)[int(np.abs(along).argmin())]
    first = np.cross(along, helper)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(along, first)])

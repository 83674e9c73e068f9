"""Corridors as convex bodies for drawing: the corners of the set that each leg must stay in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.constraint import Walls, walls_of
from minsnap.corridors.half_spaces import of_unit_length
from minsnap.corridors.linear_programmes import bounding_boxes, inner_balls
from minsnap.corridors.tubes import as_constraints

Corridor = Any
"""What :func:`minsnap.plan` takes: half-widths [m], a Constraint, or a sequence of them."""

ROUND = 48
"""Corners of a circle."""


def leg_bodies(corridor: Corridor, waypoints: FloatArray) -> list[FloatArray]:
    """Corners of the convex body that each leg must stay in.

    A tube is unbounded along its leg; it is drawn from one waypoint to the next. Repeated legs, as in laps, are
    returned once.

    Parameters
    ----------
    corridor : Constraint, sequence of Constraint, or array_like
        Objects with walls, or the half-widths of a tube [m].
    waypoints : ndarray, shape (n, dim)
        [m].

    Returns
    -------
    list of ndarray, shape (corners, dim)
        [m].
    """
    walls = [wall for wall in walls_of(as_constraints(corridor), waypoints) if wall.order == 0]
    bodies: dict[bytes, FloatArray] = {}
    for leg in range(len(waypoints) - 1):
        corners = _body(walls, leg, waypoints)
        bodies.setdefault(np.unique(np.round(corners, 9), axis=0).tobytes(), corners)
    return list(bodies.values())


def outline(corners: FloatArray) -> FloatArray:
    """Return the corners of the convex hull of points in the plane, in order: (m, 2)."""
    from scipy.spatial import ConvexHull

    return np.asarray(corners[ConvexHull(corners).vertices])


def facets(corners: FloatArray) -> FloatArray:
    """Return the triangles of the convex hull of points in space, shape (m, 3, 3)."""
    from scipy.spatial import ConvexHull

    return np.asarray(corners[ConvexHull(corners).simplices])


def _body(walls: Sequence[Walls], leg: int, waypoints: FloatArray) -> FloatArray:
    start, end = waypoints[leg], waypoints[leg + 1]
    blocks = [_half_spaces(wall, leg) for wall in walls]
    ends = [_ends(start, end) for block in blocks if _is_tube(block, end - start)][:1]
    rows = np.vstack([*blocks, *ends])
    return _polytope(np.vstack([rows, _far(rows, waypoints)]), (start + end) / 2.0)


def _half_spaces(cones: Walls, leg: int) -> FloatArray:
    """Rows (normal, offset) with normal . r + offset <= 0 of a leg's planes, and of planes tangent to what is round."""
    parts = [np.zeros((0, cones.anchor.shape[1] + 1))]
    for i in np.flatnonzero(cones.leg == leg):
        across, share = _directions(cones.matrix[i])
        normal = across - share * cones.slope[i]
        parts.append(np.column_stack([normal, -(normal @ cones.anchor[i]) - share * cones.radius[i]]))
    return np.vstack(parts)


def _directions(matrix: FloatArray) -> tuple[FloatArray, float]:
    """Return normals d A of planes d . A x <= share (radius + slope . x); a circle's have their corners on it."""
    _, scale, basis = np.linalg.svd(matrix)
    rank = int((scale > 1e-9).sum())
    if rank < 2:
        return scale[:rank, None] * basis[:rank] * [[1.0], [-1.0]] if rank else np.zeros((1, matrix.shape[1])), 1.0
    angle = np.linspace(0.0, 2.0 * np.pi, ROUND, endpoint=False) + np.pi / ROUND
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    if rank == 2:
        return circle @ (scale[:2, None] * basis[:2]), float(np.cos(np.pi / ROUND))
    height = np.linspace(-1.0, 1.0, ROUND // 2 + 1)[:, None, None]
    sphere = np.concatenate([np.sqrt(1.0 - height**2) * circle, height + 0.0 * circle[:, :1]], axis=2)
    return np.unique(np.round(sphere.reshape(-1, 3), 12), axis=0) @ (scale[:3, None] * basis[:3]), 1.0


def _is_tube(rows: FloatArray, step: FloatArray) -> bool:
    """Whether half-spaces are unbounded only along the direction of the leg."""
    normals = rows[:, :-1] / np.maximum(np.linalg.norm(rows[:, :-1], axis=1, keepdims=True), 1e-300)
    across = np.abs(normals @ step).max(initial=0.0) < 1e-9 * np.linalg.norm(step)
    paired = (normals @ normals.T).min(axis=1, initial=0.0) < 1e-9 - 1.0
    return bool(across and paired.all() and np.linalg.matrix_rank(normals, tol=1e-9) == len(step) - 1)


def _ends(start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the planes that close a tube at its waypoints."""
    along = (end - start) / np.linalg.norm(end - start)
    return np.array([[*along, -along @ end], [*-along, along @ start]])


def _far(rows: FloatArray, waypoints: FloatArray) -> FloatArray:
    """Return planes slightly beyond all waypoints, on the sides where the half-spaces are unbounded."""
    lower, upper = bounding_boxes([of_unit_length(rows[:, :-1], -rows[:, -1])])
    beyond = 1.0 + 0.25 * np.ptp(waypoints, axis=0).max()
    axes = np.eye(waypoints.shape[1])
    above = np.column_stack([axes, -waypoints.max(axis=0) - beyond])[~np.isfinite(upper[0])]
    below = np.column_stack([-axes, waypoints.min(axis=0) - beyond])[~np.isfinite(lower[0])]
    return np.vstack([above, below])


def _polytope(rows: FloatArray, guess: FloatArray) -> FloatArray:
    from scipy.spatial import HalfspaceIntersection

    if (rows[:, :-1] @ guess + rows[:, -1]).max() < 0.0:
        return np.asarray(HalfspaceIntersection(rows, guess).intersections)
    middle = inner_balls([of_unit_length(rows[:, :-1], -rows[:, -1])])[0][0]
    return np.asarray(HalfspaceIntersection(rows, middle).intersections)

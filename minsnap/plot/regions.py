"""Corridors as bodies to draw: the corners of what each leg may use."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.arrays import FloatArray

if TYPE_CHECKING:
    from minsnap.corridors.constraint import Balls, Faces, Walls

Corridor = Any
"""What :func:`minsnap.plan` takes: half-widths [m], a Constraint, or a sequence of them."""

ROUND = 48
"""Corners of a circle."""


def leg_bodies(corridor: Corridor, waypoints: FloatArray) -> list[FloatArray]:
    """Corners of the convex body that each leg must stay in.

    A tube has no ends; it is drawn from one waypoint to the next. Legs that repeat, as in laps, are given once.

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
    from minsnap.corridors.tubes import as_constraints

    walls = [wall for constraint in as_constraints(corridor) for wall in constraint.walls(waypoints) if wall.order == 0]
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
    from minsnap.corridors.constraint import Faces

    start, end = waypoints[leg], waypoints[leg + 1]
    for wall in walls:
        if not isinstance(wall, Faces) and (wall.leg == leg).any():
            return _cylinder(wall, int(np.flatnonzero(wall.leg == leg)[0]), start, end)
    faces = [wall for wall in walls if isinstance(wall, Faces)]
    rows = np.vstack([_half_spaces(wall, leg) for wall in faces])
    ends = [_ends(start, end) for wall in faces if _is_tube(wall, leg, end - start)][:1]
    closed = np.vstack([rows, *ends])
    return _polytope(np.vstack([closed, _far(closed, waypoints)]), (start + end) / 2.0)


def _half_spaces(faces: Faces, leg: int) -> FloatArray:
    """Return rows (normal, offset) with normal . r + offset <= 0 for the leg's planes."""
    mine = faces.leg == leg
    normal, base = faces.normal[mine], (faces.normal[mine] * faces.anchor[mine]).sum(axis=1)
    above = np.column_stack([normal, -base - faces.upper[mine]])
    below = np.column_stack([-normal, base + faces.lower[mine]])
    rows = np.vstack([above, below])
    return np.asarray(rows[np.isfinite(rows).all(axis=1)])


def _is_tube(faces: Faces, leg: int, step: FloatArray) -> bool:
    """Whether pairs of planes leave a leg no way but along its direction."""
    mine = faces.leg == leg
    across = bool(np.abs(faces.normal[mine] @ step).max(initial=0.0) < 1e-9 * np.linalg.norm(step))
    paired = bool(np.isfinite(faces.lower[mine]).all() and np.isfinite(faces.upper[mine]).all())
    return across and paired and np.linalg.matrix_rank(faces.normal[mine]) == len(step) - 1


def _ends(start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the planes that close a tube at its waypoints."""
    along = (end - start) / np.linalg.norm(end - start)
    return np.array([[*along, -along @ end], [*-along, along @ start]])


def _far(rows: FloatArray, waypoints: FloatArray) -> FloatArray:
    """Return planes a little beyond all waypoints, on the sides where half-spaces leave an axis unbounded."""
    from minsnap.corridors.half_spaces import bounding_boxes

    lengths = np.linalg.norm(rows[:, :-1], axis=1, keepdims=True)
    lower, upper = bounding_boxes([(rows[:, :-1] / lengths, -rows[:, -1] / lengths[:, 0])])
    beyond = 1.0 + 0.25 * np.ptp(waypoints, axis=0).max()
    axes = np.eye(waypoints.shape[1])
    above = np.column_stack([axes, -waypoints.max(axis=0) - beyond])[~np.isfinite(upper[0])]
    below = np.column_stack([-axes, waypoints.min(axis=0) - beyond])[~np.isfinite(lower[0])]
    return np.vstack([above, below])


def _polytope(rows: FloatArray, guess: FloatArray) -> FloatArray:
    from scipy.spatial import HalfspaceIntersection

    inside = guess if (rows[:, :-1] @ guess + rows[:, -1]).max() < 0.0 else _middle(rows)
    return np.asarray(HalfspaceIntersection(rows, inside).intersections)


def _middle(rows: FloatArray) -> FloatArray:
    """Return the centre of the largest ball inside the half-spaces, by a linear programme."""
    from scipy.optimize import linprog

    lengths = np.linalg.norm(rows[:, :-1], axis=1)
    cost = np.zeros(rows.shape[1])
    cost[-1] = -1.0
    found: Any = linprog(cost, np.column_stack([rows[:, :-1], lengths]), -rows[:, -1], bounds=(None, None))
    return np.asarray(found.x[:-1])


def _cylinder(balls: Balls, index: int, start: FloatArray, end: FloatArray) -> FloatArray:
    """Return points on the rims of a cylinder around a leg, or on two circles of a ball."""
    kernel = np.linalg.svd(balls.matrix[index])[2]
    across = kernel[: len(start) - 1] if len(start) > 1 else kernel
    angle = np.linspace(0.0, 2.0 * np.pi, ROUND, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])[:, : len(across)] @ across * balls.radius[index]
    return np.vstack([start + circle, end + circle])

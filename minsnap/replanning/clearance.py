"""Walls moved inwards for a search, so that what is found stays inside while walls that are measured anew shift."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.constraint import Balls, Faces, Walls

SHARE = 1.0 - 1e-6
"""Of the room that a waypoint has: what is taken of it at most."""


def moved_inwards(walls: Sequence[Walls], points: FloatArray, clearance: float) -> list[Walls]:
    """Return walls on positions moved inwards, less where a waypoint of their leg has less room.

    Parameters
    ----------
    walls : sequence of Walls
    points : ndarray, shape (n, dim)
        Start and waypoints [m].
    clearance : float
        [m]
    """
    return [_moved(wall, points, clearance) if wall.order == 0 and clearance else wall for wall in walls]


def _moved(wall: Walls, points: FloatArray, clearance: float) -> Walls:
    ends = np.stack((points[wall.leg], points[wall.leg + 1]), axis=1)
    if isinstance(wall, Faces):
        height = np.einsum("md,mkd->mk", wall.normal, ends - wall.anchor[:, None])
        size = clearance * np.linalg.norm(wall.normal, axis=1)
        above = _room((wall.upper[:, None] - height).min(axis=1), size)
        below = _room((height - wall.lower[:, None]).min(axis=1), size)
        return replace(wall, lower=wall.lower + below, upper=wall.upper - above)
    return _shrunk(wall, ends, clearance)


def _shrunk(wall: Balls, ends: FloatArray, clearance: float) -> Balls:
    slack = wall.cones.slack(ends).min(axis=1)
    inwards = np.minimum(_room(slack, np.full(len(slack), clearance)), 0.9 * wall.radius)
    return replace(wall, radius=wall.radius - inwards)


def _room(slack: FloatArray, clearance: FloatArray) -> FloatArray:
    return np.minimum(SHARE * np.maximum(slack, 0.0), clearance)

"""Walls moved inwards for a search, so that its curve stays inside while walls that are measured anew shift."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.constraint import Walls

SHARE = 1.0 - 1e-6
"""Of the room that a waypoint has: what is taken of it at most."""

MOST = 0.9
"""Of the radius of a ball: what is taken of it at most."""


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
    slack = wall.slack(ends).min(axis=1)
    size = clearance * np.linalg.norm(wall.slope, axis=1) if wall.flat else np.full(len(slack), clearance)
    inwards = np.minimum(SHARE * np.maximum(slack, 0.0), size)
    return replace(wall, radius=wall.radius - (inwards if wall.flat else np.minimum(inwards, MOST * wall.radius)))

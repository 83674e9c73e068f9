"""Waypoints on walls, where the curve may touch the wall and not cross it.

Where a wall bounds both legs of a waypoint that lies on it, the velocity along the wall's axis is zero, as at every
least distance. No solver returns that zero exactly, and any other velocity crosses the wall, so it is pinned. The first
derivative that is not pinned must not point into the wall (``normalised_walls``): the limit of the wall's rows as
the instant approaches the waypoint.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray
from minsnap.basics.tolerances import ROUNDING
from minsnap.corridors.constraint import Walls


class Side(IntEnum):
    """Which leg of a waypoint."""

    BEFORE = 0
    AFTER = 1


def touched_walls(waypoints: FloatArray, pinned: BoolArray, walls: Sequence[Walls], closed: bool) -> BoolArray:
    """Say which pinned waypoints lie on walls that bound one axis.

    Returns
    -------
    ndarray of bool, shape (2, 2, n, dim)
        By the leg that the wall belongs to (before or after the waypoint) and the side that is free (0 below
        the wall, 1 above it), waypoint and axis.
    """
    touched = np.zeros((2, 2, *waypoints.shape), dtype=bool)
    for cones in (wall for wall in walls if wall.order == 0 and wall.flat):
        ends = cones.leg[:, None] + np.array([0, 1])
        near = cones.slack(waypoints[ends]) <= ROUNDING * cones.width[:, None]
        if not near.any():
            continue
        for side, end in ((Side.AFTER, 0), (Side.BEFORE, 1)):
            row, waypoint = np.flatnonzero(near[:, end]), ends[:, end]
            along = cones.slope[row] != 0.0
            row, along = row[along.sum(axis=1) == 1], along[along.sum(axis=1) == 1]
            axis = along.argmax(axis=1)
            touched[side, (cones.slope[row, axis] > 0.0).astype(np.intp), waypoint[row], axis] = True
    if closed:
        touched[Side.BEFORE, :, 0], touched[Side.AFTER, :, -1] = touched[Side.BEFORE, :, -1], touched[Side.AFTER, :, 0]
    return touched & pinned

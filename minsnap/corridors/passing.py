"""How a curve passes its waypoints: how far from them, and whether where their boxes, balls and gates let it."""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.knot_regions import Placement
from minsnap.trajectory.trajectory import Trajectory


def knot_positions(traj: Trajectory) -> FloatArray:
    """Positions at the waypoints' instants where a leg ends and where one starts: (2, legs + 1, dim) [m]."""
    starts, ends = traj.control_points[:: traj.pieces, 0], traj.control_points[traj.pieces - 1 :: traj.pieces, -1]
    return np.stack((np.concatenate((starts[:1], ends)), np.concatenate((starts, ends[-1:]))))


def passing(traj: Trajectory, placement: Placement) -> tuple[float, bool]:
    """Measure how far a curve passes from its waypoints, beyond their tolerance, and whether it passes all.

    Returns
    -------
    excess : float
        Largest distance, on either side of a knot [m].
    passes : bool
        Whether that is 0, and gates are passed in their direction, to rounding: ``Placement.rounding`` of a
        distance, ``EXACT`` of the largest speed.
    """
    excess = max(float(placement.outside(side).max()) for side in knot_positions(traj))
    return excess, excess <= placement.rounding and _crossed(traj, placement)


def _crossed(traj: Trajectory, placement: Placement) -> bool:
    crossings = [(k, region.crossing) for k, region in placement.regions.items() if region.crossing is not None]
    if not crossings:
        return True
    velocity, size = traj(traj.leg_breaks, 1), traj.max_norm(1)[0]
    return all(float(velocity[k] @ crossing) >= -EXACT * size for k, crossing in crossings)

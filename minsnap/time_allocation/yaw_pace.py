"""How long the legs of a curve must take for a yaw given at the waypoints to turn no faster than a limit.

Such a yaw depends on the durations of the legs alone, but on all of them.
"""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.limits.yaw_rate import largest_yaw_rate
from minsnap.time_allocation.timing import AttachHeading
from minsnap.trajectory.trajectory import Trajectory

ROUNDS = 40
"""How often legs that turn too fast are slowed down."""

INSTANTS = 33
"""Instants of a piece at which the rate is looked at."""

ENOUGH = 1e-3
"""Relative excess that is left."""


def paced(curve: Trajectory, finish: AttachHeading, limit: float) -> FloatArray | None:
    """Return durations of the pieces, none shorter than those of a curve, at which the yaw keeps a limit on its rate.

    Parameters
    ----------
    curve : Trajectory
    finish : callable
        Gives a curve its yaw.
    limit : float
        [rad/s].

    Returns
    -------
    ndarray, shape (pieces in all,), or None
        [s]; None where they take longer than the whole curve flown as slowly, as with a yaw that is a function of time.
    """
    durations = curve.durations.copy()
    most = max(1.0, largest_yaw_rate(curve)[0] / limit) * curve.duration * (1.0 + ENOUGH)
    for _ in range(ROUNDS):
        if durations.sum() > most:
            break
        slower = finish(Trajectory(curve.control_points, durations, pieces=curve.pieces))
        t = slower.breaks[:-1, None] + np.linspace(0.0, 1.0, INSTANTS) * slower.durations[:, None]
        rate = np.abs(slower.yaw(t, 1)).max(axis=1)
        rate = np.repeat(rate.reshape(curve.legs, -1).max(axis=1), curve.pieces)
        if rate.max() <= limit * (1.0 + ENOUGH):
            return durations
        durations *= np.sqrt(np.maximum(rate / limit, 1.0))
    return None

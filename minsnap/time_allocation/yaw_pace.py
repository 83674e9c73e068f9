"""How long the legs of a curve must take for a yaw given at the waypoints to turn no faster than a limit.

Such a yaw depends on the durations of the legs alone, but on all of them.
"""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.time_allocation.certified_end import Finish
from minsnap.time_allocation.joint_layout import JointLayout, JointState

ROUNDS = 40
"""How often legs that turn too fast are slowed down."""

INSTANTS = 33
"""Instants of a piece at which the rate is looked at."""

ENOUGH = 1e-3
"""Relative excess that is left."""


def paced(layout: JointLayout, state: JointState, finish: Finish, limit: float, most: float) -> FloatArray | None:
    """Return durations of the pieces, none shorter than those of a state, at which the yaw keeps a limit on its rate.

    Parameters
    ----------
    layout : JointLayout
    state : JointState
    finish : callable
        Gives a curve its yaw.
    limit : float
        [rad/s].
    most : float
        Total that is too long, normalised.

    Returns
    -------
    ndarray, shape (pieces in all,), or None
        Normalised; None where that takes too long, as with a yaw that is a function of time.
    """
    durations = state.durations.copy()
    for _ in range(ROUNDS):
        if durations.sum() > most:
            break
        curve = finish(layout.trajectory(JointState(state.scaled, durations)))
        t = curve.breaks[:-1, None] + np.linspace(0.0, 1.0, INSTANTS) * curve.durations[:, None]
        rate = np.abs(curve.yaw(t, 1)).max(axis=1)
        rate = np.repeat(rate.reshape(layout.task.legs, -1).max(axis=1), layout.task.pieces)
        if rate.max() <= limit * (1.0 + ENOUGH):
            return durations
        durations *= np.sqrt(np.maximum(rate / limit, 1.0))
    return None

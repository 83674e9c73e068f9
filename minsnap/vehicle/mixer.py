"""The mixer: positions and spin directions of the four rotors, and the thrust and torques that they produce.

Rotors are numbered counter-clockwise seen from above. In the + layout they are left, rear, right and front; in the x
layout front-left, rear-left, rear-right and front-right. Rotors 1 and 3 turn the body counter-clockwise (+), 2 and 4
clockwise.
"""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.messages import shown
from minsnap.errors import VehicleError

LAYOUTS: dict[str, tuple[float, float, float, float]] = {
    "x": (45.0, 135.0, 225.0, 315.0),
    "+": (90.0, 180.0, 270.0, 0.0),
}
"""Angle of each rotor's arm from the forward axis [deg]."""

SPINS = np.array([1.0, -1.0, 1.0, -1.0])
"""Sign of each rotor's reaction torque on the body about z."""


def rotor_positions(layout: str, arm_length: float) -> FloatArray:
    """Return the positions of the rotors in the body frame, shape (4, 3) [m].

    Raises
    ------
    VehicleError
        If the layout is not known.
    """
    if layout not in LAYOUTS:
        raise VehicleError(f"the layout is {shown(layout)}: it must be one of {', '.join(LAYOUTS)}")
    angle = np.radians(LAYOUTS[layout])
    unit = np.round(np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1), 15)
    return np.asarray(arm_length * unit)


def mixer_matrix(positions: FloatArray, torque_per_thrust: float) -> FloatArray:
    """Return the matrix from rotor thrusts to total thrust and torques about x, y, z.

    Parameters
    ----------
    positions : ndarray, shape (4, 3)
        Rotor hubs in the body frame [m].
    torque_per_thrust : float
        Torque coefficient over thrust coefficient [m].

    Returns
    -------
    ndarray, shape (4, 4)
        Rows: thrust [1], torques [m]; columns: rotors.
    """
    return np.stack([np.ones(4), positions[:, 1], -positions[:, 0], SPINS * torque_per_thrust])

"""Bounds of a vehicle's thrust, tilt, body rate and rotors on parts of a path, by ranges, in the native core."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.native.library import Entry
from minsnap.native.records import VehicleRecord

_BOUNDS = Entry("minsnap_vehicle_bounds", VehicleRecord)


@dataclass(frozen=True, eq=False)
class VehicleNumbers:
    """What the bounds take of a vehicle.

    Parameters
    ----------
    mass : float
        [kg].
    medium : ndarray, shape (5,)
        As ``Medium.values``.
    inertia : ndarray, shape (3, 3)
        [kg m^2].
    mixer : ndarray, shape (4, 4)
        From thrust and torques to the thrusts of the rotors.
    """

    mass: float
    medium: FloatArray
    inertia: FloatArray
    mixer: FloatArray


def vehicle_bounds(
    vehicle: VehicleNumbers,
    points: FloatArray,
    half: FloatArray,
    yaw: FloatArray | None = None,
    jerk: float = 0.0,
    axes: FloatArray | None = None,
) -> FloatArray | None:
    """Return bounds on parts of a path, (parts, 6), or None where the Python core is in use.

    They are the greatest and minus the least thrust per mass [m/s^2], the squares of the tilt's tangent and of the body
    rate [rad^2/s^2], and the greatest and minus the least thrust of a rotor [N], zero where no heading is known.

    Parameters
    ----------
    points : ndarray, shape (parts, 4, 3, n)
        Control points of velocity to snap on each part, of one degree.
    half : ndarray, shape (parts,)
        Half of what each part takes [s].
    yaw : ndarray, shape (parts, 4), optional
        In the middle of each part: cosine and sine of the yaw, its rate and its acceleration.
    jerk : float
        Bound of the yaw's third derivative [rad/s^3].
    axes : ndarray, shape (parts, 2, 3), optional
        Of a body that does not spin: its axes x and y in the middle of each part.

    Raises
    ------
    ValueError
        If there are more than 64 control points.
    """
    call = _BOUNDS.function()
    if call is None:
        return None
    parts, _, _, count = points.shape
    bounds = np.empty((parts, 6))
    motion = {"points": points, "half": half, "yaw": yaw, "jerk": jerk, "axes": axes, "bounds": bounds}
    if call(VehicleRecord(parts=parts, count=count, **vars(vehicle), **motion)):
        raise ValueError(f"{count} control points on a part are more than the native core takes")
    return bounds

"""The additional rotor thrust that the default fixed heading needs."""

from __future__ import annotations

from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.limits.vehicle_use import measure_vehicle
from minsnap.trajectory.tilt_heading import TiltHeading
from minsnap.trajectory.trajectory import Trajectory


def fixed_yaw_notes(limits: Limits | None, traj: Trajectory) -> tuple[str, ...]:
    """Return a note if the same curve would use clearly less of the rotors' thrust range without spin.

    Parameters
    ----------
    limits : Limits or None
        Of a vehicle, or there is nothing to say.
    traj : Trajectory
        With the heading that it was given.

    Returns
    -------
    tuple of str
        One sentence, or none.
    """
    if not isinstance(limits, VehicleLimits):
        return ()
    spinless = traj.with_yaw(TiltHeading(traj, medium=limits.medium))
    fixed, free = (_used(limits, curve) for curve in (traj, spinless))
    if fixed - free <= 0.01:  # per cent are said
        return ()
    return (
        "no yaw was asked for, so it is fixed, and every banked turn takes torque about the thrust axis: the rotors "
        f"use {100.0 * fixed:.0f} % of their room on this curve, and with yaw='tilt' it would be {100.0 * free:.0f} %",
    )


def _used(limits: VehicleLimits, traj: Trajectory) -> float:
    """Largest used share of a rotor's thrust range above or below hover, over many instants."""
    used = measure_vehicle(limits.vehicle, limits.reserve, {}, traj, proved=False)
    return max(entry.fraction for entry in used.values())
